//! The first-order screening, and how well new movements would distinguish explanations.

use arm_core::effect::{Effect, Kind};
use arm_gap::prepared_session::PreparedSession;
use arm_gap::selection::model_discrimination::Discrimination;

use crate::sessions::session;

fn spring() -> Effect<f64> {
    let elastic = Kind::named("elastic").expect("known");
    Effect::new(elastic, 1).with(&[1.5, 1.0])
}

#[test]
fn a_first_look_suspects_the_hidden_spring_most_and_names_nothing() {
    let session = session(&[spring()], (1e-3, 0.1));
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let look = prepared.screen(&|_, _| Ok(())).expect("a look");
    assert!(look.calibrated.hypothesis.named.is_empty());
    assert!(look.lack.z > 6.0, "{:?}", look.lack);
    let worth = |s: &arm_gap::search::first_order_screening::ScreenedCandidate| s.gain - s.price;
    assert!(look.suspects.is_sorted_by(|a, b| worth(a) >= worth(b)));
    let own = look
        .suspects
        .iter()
        .find(|s| s.effect.kind == spring().kind && s.effect.index == 1)
        .expect("the spring was asked for");
    assert!(own.gain > 10.0 * own.price, "{} {}", own.gain, own.price);
    assert!((own.effect.parameters[0] - 1.5).abs() < 0.5, "{own:?}");
    assert!(own.smallest > 0.0 && own.smallest < 0.5, "{}", own.smallest);
    let twice = look.suspects.iter().enumerate().find(|(i, s)| {
        let mut before = look.suspects[..*i].iter();
        before.any(|b| b.candidate.is_same_effect(&s.effect))
    });
    assert!(twice.is_none(), "{twice:?}");
}

#[test]
fn a_first_look_at_a_session_that_lacks_nothing_suspects_nothing() {
    let session = session(&[], (1e-3, 0.1));
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let look = prepared.screen(&|_, _| Ok(())).expect("a look");
    let loud: Vec<_> = look.suspects.iter().filter(|s| s.gain > s.price).collect();
    assert!(loud.is_empty(), "{loud:?}");
    assert!(look.lack.z < 4.0, "{:?}", look.lack);
}

/// The spring itself imitates a spring; another law of the joint does not, and further movements distinguish them better.
#[test]
fn movements_tell_a_spring_from_friction_and_not_from_itself() {
    let session = session(&[spring()], (1e-3, 0.1));
    let prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let coulomb = Kind::named("coulomb").expect("known");
    let alternatives = [
        (spring(), vec![0]),
        (Effect::new(coulomb, 1).with(&[0.2, 0.01]), vec![0]),
    ];
    let discrimination =
        Discrimination::new(prepared, spring(), &alternatives).expect("a comparison");
    let now = discrimination.distances(None).expect("distances");
    assert!(now[0] < 0.1, "{now:?}");
    assert!(now[1] > 5.0, "{now:?}");
    let then = discrimination
        .distances(Some(&session.trials[4]))
        .expect("distances with one movement more");
    assert!(then[0] < 0.1 && then[1] > now[1], "{now:?} {then:?}");
}
