//! Which sessions there are.

use std::collections::BTreeSet;

use hidden_world::cast::{OUTSIDE, Strength, family, kinds};
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
