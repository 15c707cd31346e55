//! Which sessions there are.

use std::collections::BTreeSet;

use hidden_world::cast::{OUTSIDE, Strength, family, kinds};
use hidden_world::output;
use hidden_world::rig::Passive;
use hidden_world::session::{Case, IMPERFECT, Session, case};

fn cases(name: &str, count: usize) -> Vec<Case> {
    (0..count)
        .map(|k| case(name, None, k).expect("a family"))
        .collect()
}

#[test]
fn singles_go_round_all_kinds_at_both_strengths() {
    let all = cases("single", 2 * kinds().len());
    for kind in kinds() {
        for strength in [Strength::Strong, Strength::Medium] {
            let wanted = Case::Single(kind, strength);
            assert_eq!(all.iter().filter(|c| **c == wanted).count(), 1, "{kind}");
        }
    }
}

#[test]
fn a_mixture_has_everything() {
    let all = cases("all", 200);
    let count = |name: &str| all.iter().filter(|c| c.family() == name).count();
    let counts = ["null", "single", "double", "triple", "outside"].map(count);
    assert_eq!(counts, [60, 80, 20, 20, 20]);
    let outside: BTreeSet<String> = all
        .iter()
        .filter(|c| c.family() == "outside")
        .map(|c| format!("{c:?}"))
        .collect();
    assert_eq!(outside.len(), OUTSIDE.len());
    for null in IMPERFECT {
        assert!(all.contains(&Case::Null(null)), "{null:?}");
    }
}

#[test]
fn an_unknown_family_is_refused() {
    let refused = case("quadruple", None, 0).expect_err("no such family");
    assert!(
        refused.contains("found quadruple; allowed: null, single"),
        "{refused}"
    );
}

#[test]
fn combinations_are_of_different_families_and_nulls_of_none() {
    for (seed, number) in [(51, 2), (52, 3)] {
        let session = Session::new(seed, Case::Several(number)).expect("a session");
        let families: BTreeSet<_> = session.hidden.iter().map(|h| family(h.kind)).collect();
        assert_eq!(families.len(), number);
        assert!(session.trials.iter().any(|t| t.test) && session.trials.iter().any(|t| !t.test));
    }
    let null = Session::new(53, Case::Null(IMPERFECT[0])).expect("a session");
    assert!(null.hidden.is_empty());
    assert_eq!(null.setting.truth, null.setting.model);
}

#[test]
fn of_little_known_arms_the_model_says_nothing_of_the_joints() {
    let mut rates = BTreeSet::new();
    for seed in 61..65 {
        let session =
            Session::new(seed, Case::LittleKnown(1, Strength::Strong)).expect("a session");
        let (model, truth) = (&session.setting.model, &session.setting.truth);
        assert!(model.joints.iter().all(|joint| *joint == Passive::NONE));
        assert!(truth.joints.iter().all(|joint| joint.stiffness >= 0.4));
        for (there, said) in truth.links.iter().zip(&model.links) {
            let off = (there.mass / said.mass - 1.0).abs();
            assert!(off > 0.0 && off <= 0.15, "{off}");
        }
        // Springs, viscosities, whatever rubs, and one effect more.
        let stated = output::truth(&session)["effects"]
            .as_array()
            .map_or(0, Vec::len);
        let rubs = session
            .hidden
            .iter()
            .filter(|h| h.kind == "coulomb")
            .count();
        assert_eq!(stated, 2 * model.size() + rubs + 1);
        assert_eq!(session.hidden.len(), rubs + 1);
        let slipped: Vec<_> = session.trials.iter().filter(|t| t.slip.is_some()).collect();
        assert!(slipped.len() == 1 && !slipped[0].test);
        let lengths: BTreeSet<_> = session
            .trials
            .iter()
            .map(|t| t.readings.time.len())
            .collect();
        assert!(lengths.len() > 3);
        let time = &session.trials[0].readings.time;
        assert!((time[1] * session.noise.rate - 1.0).abs() < 1e-12);
        rates.insert(session.noise.rate as u64);
    }
    assert!(rates.len() > 1);
}
