//! Evidence that a law of the passive base needs to stay in the simulation, and to be named.

use arm_core::effect::Effect;
use arm_ident::regression::unknown::spring;

use crate::data::passive_law::Passive;
use crate::selection::friction_at_rest::TRIED_AT_REST;

/// Square of the standard deviations from zero beyond which a law stays once it was refitted by simulation, 2,
pub(super) const LEAST_GAIN_TO_KEEP: f64 = 4.0;
/// and what it must gain at least to be named, 3: with nine such laws an arm without any has a false name in one of eighty sessions.
const LEAST_GAIN_TO_NAME: f64 = 9.0;
/// Prior odds of a law that every passive joint has against one that few have, in units of twice the log-likelihood: odds of 20.
pub(super) const ODDS: f64 = 6.0;

/// A law of the passive base, and its gain.
pub(super) struct Term {
    /// Its place in the base.
    pub base: usize,
    /// Standard deviation of its first parameter.
    pub sd: f64,
    /// Square of its first parameter in standard deviations.
    pub gain: f64,
}

impl Term {
    /// What its law must gain to be named, in units of twice the log-likelihood: more than chance does with any of the speeds below which
    /// dry friction may creep, and so much that a size, of which only a typical one is known beforehand, is likelier than none. Of a size
    /// that is a small part of the typical one, the latter is more.
    pub fn least_to_be_named(&self, law: &Passive) -> f64 {
        let tried = match law.effect.kind.smoothed_by() {
            Some(_) => TRIED_AT_REST as f64,
            None => 1.0,
        };
        let typical = law.free.iter().find(|f| f.parameter == 0).map(|f| f.sd);
        // The Bayes factor of a half-normal density of that width, to Laplace's approximation.
        let likelier = typical.map_or(0.0, |width| 2.0 * libm::log(0.5 * width / self.sd));
        f64::max(LEAST_GAIN_TO_NAME, likelier) + 2.0 * libm::log(tried)
    }
}

/// What a law of the base must gain: a spring that a named spring over two joints crosses need only be there.
///
/// * `otherwise` - of every other law
pub(super) fn least_of<const N: usize>(
    law: &Effect<f64>,
    crossed: &[bool; N],
    otherwise: f64,
) -> f64 {
    match spring(law) {
        Some(_) if crossed[law.index] => f64::MIN_POSITIVE,
        _ => otherwise,
    }
}

/// Joints that a named spring over two joints crosses. Movements determine the stiffness matrix of both joints, three numbers, not its three
/// springs and a ratio: to leave out an own spring there is one of infinitely many equivalent choices.
pub(super) fn crossed_joints<const N: usize>(named: &[Effect<f64>]) -> [bool; N] {
    std::array::from_fn(|j| {
        let mut crossing = named.iter().filter(|e| e.kind.crosses());
        crossing.any(|e| e.index == j || e.index == j + 1)
    })
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;
    use arm_numerics::statistics::distributions::chi_square_tail;

    use super::*;
    use crate::data::passive_law::Free;

    #[test]
    fn a_spring_over_two_joints_keeps_the_springs_of_the_joint_it_is_named_after_and_of_the_one_before()
     {
        let of = |kind, index| Effect::<f64>::new(kind, index).with(&[1.0]);
        let crossed = crossed_joints::<3>(&[of(Kind::Biarticular, 1), of(Kind::EndRange, 2)]);
        assert_eq!(crossed, [true, true, false]);
        assert_eq!(
            least_of(&of(Kind::Elastic, 0), &crossed, LEAST_GAIN_TO_NAME),
            f64::MIN_POSITIVE
        );
        assert_eq!(
            least_of(&of(Kind::Elastic, 2), &crossed, LEAST_GAIN_TO_NAME),
            LEAST_GAIN_TO_NAME
        );
        assert_eq!(
            least_of(&of(Kind::Viscous, 0), &crossed, LEAST_GAIN_TO_NAME),
            LEAST_GAIN_TO_NAME
        );
    }

    #[test]
    fn a_law_of_a_small_part_of_its_typical_size_must_gain_more_to_be_named() {
        let law = |kind, typical: f64| Passive {
            effect: Effect::new(kind, 0),
            free: vec![Free::expected((0, [0.0, typical]))],
            likely: true,
        };
        let least = |kind, sd| {
            Term {
                base: 0,
                sd,
                gain: 0.0,
            }
            .least_to_be_named(&law(kind, 1.0))
        };
        // At 3 and at √(2 ln 500) standard deviations.
        assert_eq!(least(Kind::Viscous, 0.1), LEAST_GAIN_TO_NAME);
        assert!((least(Kind::Viscous, 1e-3) - 12.43).abs() < 0.01);
        // Of dry friction, eight speeds are tried.
        assert!(
            (least(Kind::Coulomb, 0.1) - LEAST_GAIN_TO_NAME - 2.0 * libm::log(8.0)).abs() < 1e-12
        );
        // Where the limit is the one of likelihood, the half-normal density and the likelihood have equal areas: by sums over sizes.
        let (sd, width) = (1e-3, 1.0);
        let found = sd * least(Kind::Viscous, sd).sqrt();
        let density = |x: f64, sd: f64| libm::exp(-0.5 * x * x / (sd * sd)) / sd;
        let sizes = (0..200_000).map(|i| 1e-7 * f64::from(i));
        let with: f64 = sizes
            .map(|x| 2e-7 * density(found - x, sd) * density(x, width))
            .sum();
        let none = density(found, sd) * libm::sqrt(core::f64::consts::TAU);
        assert!((with / none - 1.0).abs() < 0.01, "{}", with / none);
    }

    /// Of nine laws, each with a first parameter that is not negative, chance names one in 80 sessions; a rare law has odds of 20 against it.
    #[test]
    fn limits_have_the_probabilities_that_they_stand_for() {
        let false_name = 9.0 * 0.5 * chi_square_tail(LEAST_GAIN_TO_NAME, 1);
        assert!((1.0 / false_name - 82.0).abs() < 2.0, "{false_name}");
        assert!((libm::exp(0.5 * ODDS) - 20.0).abs() < 0.5);
        assert_eq!(libm::sqrt(LEAST_GAIN_TO_KEEP), 2.0);
    }
}
