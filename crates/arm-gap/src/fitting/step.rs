//! A step of a fit: the normal equations within bounds, damped so far that the step stays where their linear model is trusted.

use arm_numerics::Matrix;

use crate::hypothesis::{Coordinate, Hypothesis, priors};
use crate::sensitivity::normal_equations::{Cluster, Normal, solve};

/// Damping of steps as a share of the diagonal of the normal equations (Levenberg and Marquardt): what the data decide well moves on
/// where a whole step leads astray.
const DAMPING: [f64; 16] = [
    0.0, 1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0,
];
/// What a fit is for.
#[derive(Clone, Copy)]
pub(crate) struct Aim {
    /// The cost to which it must come down.
    cost: f64,
    /// The fit is given up where so many times the first-order gain of a whole step would not lower the cost to that: responses to strong
    /// effects are not linear.
    hope: f64,
    /// Of what the cost exceeds this by, a hundredth does not count.
    beside: f64,
}

impl Aim {
    /// The best fit, whatever it costs.
    pub const BEST: Self = Self {
        cost: f64::INFINITY,
        hope: f64::INFINITY,
        beside: f64::INFINITY,
    };

    /// To come down to a cost.
    ///
    /// * `dry` - whether dry friction is fitted: to first order, a joint that sticks responds to nothing
    pub fn at(cost: f64, dry: bool) -> Self {
        /// Hopes without and with dry friction.
        const HOPES: [f64; 2] = [1.5, 4.0];
        Self {
            cost,
            hope: HOPES[usize::from(dry)],
            ..Self::BEST
        }
    }

    /// To see by how much more it costs than another fit.
    pub fn beside(cost: f64) -> Self {
        Self {
            beside: cost,
            ..Self::BEST
        }
    }

    /// A gain that does not count at a cost.
    pub fn negligible(&self, cost: f64) -> f64 {
        0.01 * (cost - self.beside).max(0.0)
    }

    /// Whether steps after one that gained so much will not lead from a cost to the aim, if each gains at most four times as much as the one
    /// before: the trusted region is at most doubled with each.
    pub fn is_out_of_reach(&self, cost: f64, gained: f64, steps: usize) -> bool {
        const GROWTH: f64 = 4.0;
        let mut last = gained;
        let reach = (0..steps).map(|_| {
            last *= GROWTH;
            last
        });
        cost > self.cost && cost - reach.sum::<f64>() > self.cost
    }
}

/// The region in which a linear model is trusted (Moré 1978).
#[derive(Clone, Copy)]
pub(crate) struct TrustRegion {
    /// Longest step within it; see [`Step::length`].
    pub radius: f64,
}

impl TrustRegion {
    /// Makes the region larger or smaller by what a step gained in fact; what it lost is less than nothing.
    pub fn learn(&mut self, step: &Step, gained: f64) {
        /// Shares of the foretold gain below and above which the region is made smaller and larger.
        const POOR: f64 = 0.25;
        const GOOD: f64 = 0.75;
        if gained > GOOD * step.gain {
            self.radius = self.radius.max(2.0 * step.length);
        } else if gained < POOR * step.gain {
            // To where the parabola through the slope at the start and the cost at the end is lowest.
            let lowest = step.slope / (2.0 * (step.slope - gained));
            self.radius = step.length * lowest.clamp(0.1, 0.5);
        }
    }
}

/// A step of the unknowns that the equations decide anything about.
#[derive(Default)]
pub(crate) struct Step {
    /// Their places among the coordinates.
    pub usable: Vec<usize>,
    /// Change of each.
    pub sizes: Vec<f64>,
    /// By how much it lowers the cost, to first order.
    pub gain: f64,
    /// The slope of the cost along it, downwards.
    pub slope: f64,
    /// Its length, with the diagonal of the normal equations as the measure of each unknown.
    pub length: f64,
}

impl Step {
    /// The hypothesis after this step from `hypothesis`.
    pub fn from<const N: usize>(
        &self,
        hypothesis: &Hypothesis<N>,
        coordinates: &[Coordinate],
    ) -> Hypothesis<N> {
        let along = self.usable.iter().map(|&i| &coordinates[i]);
        let along = std::iter::zip(along, self.sizes.iter().copied());
        hypothesis.moved(&along.collect::<Vec<_>>())
    }
}

/// The normal equations of a step, with the room that bounds leave it.
pub(crate) struct Equations {
    normal: Normal,
    regularised: Matrix,
    /// Places of the unknowns that they decide anything about.
    usable: Vec<usize>,
    /// How far each of these may go down and up.
    room: Vec<(f64, f64)>,
}

impl Equations {
    pub(crate) fn new<const N: usize>(
        clusters: &[Cluster],
        hypothesis: &Hypothesis<N>,
        coordinates: &[Coordinate],
    ) -> Self {
        let normal = Normal::new(clusters, &priors(hypothesis, coordinates));
        let usable: Vec<usize> = (0..coordinates.len())
            .filter(|&i| normal.gram[(i, i)] > 0.0)
            .collect();
        let mut regularised = normal.gram.clone();
        regularise(&mut regularised, hypothesis, coordinates);
        let room = usable.iter().map(|&i| {
            let c = &coordinates[i];
            let value = hypothesis.get(c.target);
            (c.lower - value, c.upper - value)
        });
        Self {
            room: room.collect(),
            normal,
            regularised,
            usable,
        }
    }

    /// Whether the cost will not come down to an aim, by what a whole step would gain.
    pub fn is_hopeless(&self, cost: f64, aim: Aim) -> bool {
        let gain = || self.step(0.0).map_or(f64::INFINITY, |step| step.gain);
        cost > aim.cost && cost - aim.hope * gain() > aim.cost
    }

    /// The step that lowers the cost most within bounds; `None` where the equations are singular.
    pub(crate) fn step(&self, damping: f64) -> Option<Step> {
        let (usable, score) = (&self.usable, &self.normal.score);
        let mut damped = self.regularised.clone();
        for &i in usable {
            damped[(i, i)] *= 1.0 + damping;
        }
        let (sizes, _) = solve(&damped, score, usable, &|i| self.room[i])?;
        let gain = usable.iter().zip(&sizes).map(|(&i, a)| {
            let bent: f64 = usable
                .iter()
                .zip(&sizes)
                .map(|(&j, b)| self.normal.gram[(i, j)] * b)
                .sum();
            a * (2.0 * score[i] - bent)
        });
        let each = || std::iter::zip(usable, &sizes);
        let squares = each().map(|(&i, a)| self.regularised[(i, i)] * a * a);
        Some(Step {
            gain: gain.sum(),
            slope: each().map(|(&i, a)| 2.0 * a * score[i]).sum(),
            length: libm::sqrt(squares.sum()),
            usable: usable.clone(),
            sizes,
        })
    }

    /// The least damped step that is no longer than a radius; `None` where there is none.
    pub fn step_within(&self, radius: f64) -> Option<Step> {
        let within = |damping: &f64| self.step(*damping).filter(|step| step.length <= radius);
        let first = DAMPING.first().and_then(within);
        first.or_else(|| {
            // More damping makes a step shorter.
            let place = DAMPING.partition_point(|damping| within(damping).is_none());
            within(DAMPING.get(place)?)
        })
    }
}

/// Shapes that the data hardly decide move no further than their own size in one step. An angle has no size of its own.
pub fn regularise<const N: usize>(
    gram: &mut Matrix,
    hypothesis: &Hypothesis<N>,
    coordinates: &[Coordinate],
) {
    /// Least size of the angle of a joint \[rad\].
    const ANGLE: f64 = 1.0;
    for (i, c) in coordinates.iter().enumerate() {
        if c.prior.is_none() {
            let least = match hypothesis.is_joint_angle(c.target) {
                true => ANGLE,
                false => 10.0 * c.step,
            };
            let size = hypothesis.get(c.target).abs().max(least);
            gram[(i, i)] += 1.0 / (size * size);
        }
    }
}

#[cfg(test)]
mod tests {
    use arm_core::effect::{Effect, Kind};

    use super::*;
    use crate::hypothesis::Target;
    use crate::hypothesis::tests::plain;

    fn equations(gram: f64, score: f64, room: (f64, f64)) -> Equations {
        let matrix = || Matrix::from_fn(1, 1, |_, _| gram);
        Equations {
            normal: Normal {
                gram: matrix(),
                score: vec![score],
                square: 0.0,
                rows: 10,
            },
            regularised: matrix(),
            usable: vec![0],
            room: vec![room],
        }
    }

    /// Of a parabola of curvature 4 with its minimum at 3: the step, half of it when damped by one, and what each gains.
    #[test]
    fn damping_shortens_a_step_and_the_gain_is_that_of_the_undamped_equations() {
        let free = equations(4.0, 12.0, (-10.0, 10.0));
        let step = |damping| free.step(damping).expect("not singular");
        let (plain, damped) = (step(0.0), step(1.0));
        let near = |step: &Step, size: f64, gain: f64| {
            (step.sizes[0] - size).abs() < 1e-12 && (step.gain - gain).abs() < 1e-12
        };
        assert!(near(&plain, 3.0, 36.0) && near(&damped, 1.5, 27.0));
        let bounded = equations(4.0, 12.0, (-1.0, 1.0)).step(0.0).expect("a step");
        assert!(near(&bounded, 1.0, 20.0));
    }

    /// The whole step has a length of 6 and a slope of 72; with `d` times the diagonal more it is `1 + d` times as short.
    #[test]
    fn a_step_within_a_region_is_the_least_damped_one_that_is_no_longer() {
        let equations = equations(4.0, 12.0, (-10.0, 10.0));
        let size = |radius| equations.step_within(radius).map(|step| step.sizes[0]);
        assert_eq!(size(f64::INFINITY), Some(3.0));
        assert_eq!(size(6.0), Some(3.0));
        // With three times the diagonal more: twice would do, and once would not.
        assert_eq!(size(2.0), Some(0.75));
        assert_eq!(size(1e-4), None);
    }

    #[test]
    fn a_region_grows_where_a_step_gains_as_foretold_and_shrinks_to_the_lowest_point_of_a_parabola()
    {
        let whole = equations(4.0, 12.0, (-10.0, 10.0)).step(0.0);
        let whole = whole.expect("not singular");
        let after = |radius: f64, gained: f64| {
            let mut region = TrustRegion { radius };
            region.learn(&whole, gained);
            region.radius
        };
        assert_eq!([after(6.0, 36.0), after(20.0, 36.0)], [12.0, 20.0]);
        // Half of what was foretold changes nothing.
        assert_eq!(after(6.0, 18.0), 6.0);
        // It loses 36: through a slope of -72, the parabola is lowest at a third of the step.
        assert!((after(6.0, -36.0) - 2.0).abs() < 1e-12);
        assert_eq!(after(6.0, 5.0), 3.0);
        assert!((after(6.0, f64::NEG_INFINITY) - 0.6).abs() < 1e-12);
    }

    /// A whole step gains 36; the fit may still gain four times as much.
    #[test]
    fn a_fit_is_given_up_where_steps_like_the_next_will_not_lead_to_its_aim() {
        let equations = equations(4.0, 12.0, (-10.0, 10.0));
        let hopeless = |cost, aim| equations.is_hopeless(cost, Aim::at(aim, true));
        assert!(hopeless(200.0, 55.0) && !hopeless(200.0, 57.0));
        assert!(!hopeless(50.0, 55.0) && !equations.is_hopeless(1e9, Aim::BEST));
    }

    /// After a gain of 2, three steps gain at most 8 + 32 + 128.
    #[test]
    fn an_aim_is_out_of_reach_where_steps_that_grow_do_not_lead_to_it() {
        let aim = Aim::at(100.0, false);
        assert!(aim.is_out_of_reach(269.0, 2.0, 3) && !aim.is_out_of_reach(267.0, 2.0, 3));
        assert!(!aim.is_out_of_reach(99.0, 0.0, 0) && aim.is_out_of_reach(101.0, 0.0, 5));
        assert!(!Aim::BEST.is_out_of_reach(1e9, 0.0, 0));
        assert_eq!(Aim::beside(100.0).negligible(300.0), 2.0);
        assert_eq!(Aim::BEST.negligible(300.0), 0.0);
    }

    /// A rest angle near zero could move by a hundredth of a radian in a step, and a fit ended before it was reached.
    #[test]
    fn an_angle_of_a_joint_has_no_size_of_its_own() {
        let mut hypothesis = plain();
        hypothesis.named = [
            (Kind::CubicElastic, 1),
            (Kind::Elastic, 1),
            (Kind::Relaxation, 0),
        ]
        .map(|(kind, joint)| Effect::new(kind, joint).with(&[1.0, 0.002]))
        .into();
        let coordinate = |slot| Coordinate {
            target: Target::Named(slot, 1),
            prior: None,
            lower: -7.0,
            upper: 7.0,
            step: 1e-3,
        };
        let mut gram = Matrix::zeros(3, 3);
        regularise(&mut gram, &hypothesis, &[0, 1, 2].map(coordinate));
        let size = [0, 1, 2].map(|i| 1.0 / libm::sqrt(gram[(i, i)]));
        // A time moves by ten of its steps at most.
        assert!((size[2] - 0.01).abs() < 1e-12, "{size:?}");
        assert_eq!(size[..2], [1.0, 1.0]);
    }
}
