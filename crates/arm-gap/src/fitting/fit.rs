//! Fit of a hypothesis to the fit trials by Gauss and Newton's method, within a region in which its linear model is trusted.

use arm_numerics::Matrix;

use crate::GapError;
use crate::candidates::candidate::Candidate;
use crate::data::course::Channels;
use crate::hypothesis::{Coordinate, Hypothesis, departure, priors};
use crate::linearization::linear_response::Response;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::sensitivity::normal_equations::{Cluster, Normal, solve};
use crate::sensitivity::rows::Columns;

/// Most steps of a fit.
const STEPS: usize = 6;
/// Damping of steps as a share of the diagonal of the normal equations (Levenberg and Marquardt): what the data decide well moves on
/// where a whole step leads astray.
const DAMPING: [f64; 16] = [
    0.0, 1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0,
];
/// Steps that are tried from one place, each shorter than the one before.
const TRIES: usize = 5;
/// A step that gains less than this, in units of the noise, is the last,
const ENOUGH: f64 = 0.2;
/// and where the model is far from the data, less than this share of what the cost exceeds the number of rows by.
const SHARE: f64 = 1e-4;
/// The same to first order, as a share of that.
const FIRST_ORDER_SHARE: f64 = 0.25;
/// A fit is given up where so many times the first-order gain of a whole step would not lower the cost to what it is fitted for: the
/// response to strong effects is not linear.
const HOPE: f64 = 4.0;
/// A step that gains less than so many times as much leads so near that the next one takes its slopes.
const NEAR: f64 = 30.0;
/// Maximum number of further fits in [`PreparedSession::fit_on`], each from the end of the fit before.
const CONTINUATIONS: usize = 4;
/// Times that a fit is simulated anew from where it ended.
const AGAIN: usize = 8;

/// A hypothesis fitted to the fit trials.
#[derive(Clone, Debug)]
pub struct FittedHypothesis<const N: usize> {
    /// The hypothesis at its best.
    pub hypothesis: Hypothesis<N>,
    /// The candidates that its named effects come from.
    pub asked: Vec<Candidate>,
    /// Whitened residual squares, and what the values cost against what was known of them.
    pub cost: f64,
    /// Number of rows behind them.
    pub rows: usize,
    /// Residuals of the fitted trials.
    pub residuals: Vec<Channels>,
}

impl<const N: usize> FittedHypothesis<N> {
    /// A gain below this is none.
    pub(crate) fn enough(&self) -> f64 {
        ENOUGH + SHARE * (self.cost - self.rows as f64).max(0.0)
    }

    /// Whether more is left than noise leaves.
    pub(crate) fn leaves_much(&self) -> bool {
        /// Misfit for each row from which on much is left: noise leaves 1.
        const MUCH: f64 = 1.5;
        self.cost >= MUCH * self.rows as f64
    }

    /// The place of a named effect that does nothing as it was fitted.
    pub(crate) fn comes_to_nothing(&self) -> Option<usize> {
        let mut named = std::iter::zip(&self.asked, &self.hypothesis.named);
        named.position(|(asked, effect)| asked.is_nothing(effect))
    }

    /// Whether a named effect has come to a shape in which it is another, plainer law.
    pub(crate) fn has_plainer(&self) -> bool {
        self.plainer().next().is_some()
    }

    /// The questions whose effects have come to such a shape.
    pub(crate) fn plainer(&self) -> impl Iterator<Item = Candidate> {
        let named = std::iter::zip(&self.asked, &self.hypothesis.named);
        let plainer = named.filter(|(asked, effect)| asked.is_plainer(effect));
        plainer.map(|(asked, _)| asked.clone())
    }

    /// The numbers of the named effects that a fit may change.
    pub fn named(&self) -> Vec<Coordinate> {
        named(&self.hypothesis, &self.asked)
    }
}

fn named<const N: usize>(hypothesis: &Hypothesis<N>, asked: &[Candidate]) -> Vec<Coordinate> {
    let each = asked.iter().enumerate();
    each.flat_map(|(slot, c)| c.coordinates(slot, &hypothesis.named[slot]))
        .collect()
}

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// A hypothesis near a linearization point with its residuals and their cost.
    pub(crate) fn state(
        &self,
        point: &LinearizationPoint<N>,
        hypothesis: Hypothesis<N>,
        asked: Vec<Candidate>,
    ) -> Result<FittedHypothesis<N>, GapError> {
        let residuals = self.residuals(point, &hypothesis)?;
        let squares = point.rows.squares(self, &residuals);
        let data: f64 = squares.iter().map(|c| c.square).sum();
        let own = named(&hypothesis, &asked);
        let cost = data + departure(&hypothesis, &point.coordinates) + departure(&hypothesis, &own);
        Ok(FittedHypothesis {
            hypothesis,
            asked,
            cost,
            rows: self.compared_rows(),
            residuals,
        })
    }

    /// The normal equations of all unknowns at a fitted hypothesis: nuisances first, then the named effects' own, then
    /// other columns.
    ///
    /// # Errors
    /// As [`PreparedSession::responses_at`].
    pub fn equations(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
        more: &Columns,
    ) -> Result<(Vec<Coordinate>, Vec<Cluster>), GapError> {
        let own = fitted.named();
        let responses = self.responses_at(point, &fitted.hypothesis, &own)?;
        let each: Vec<_> = responses.iter().collect();
        Ok(self.equations_with(point, fitted, (&each, more)))
    }

    /// The same with responses of the named effects that are known.
    pub(crate) fn equations_with(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
        columns: (&[&Response], &Columns),
    ) -> (Vec<Coordinate>, Vec<Cluster>) {
        let rows = &point.rows;
        let clusters = rows.clusters_beside(self, columns, &fitted.residuals);
        let own = fitted.named();
        let coordinates = point.coordinates.iter().copied().chain(own).collect();
        (coordinates, clusters)
    }

    /// Fits the nuisances and the named effects of a hypothesis, followed from a linearization point.
    ///
    /// * `asked` - the candidate behind each named effect
    ///
    /// # Errors
    /// [`GapError`] where the start cannot be followed from the linearization point.
    pub fn fit(
        &self,
        point: &LinearizationPoint<N>,
        start: Hypothesis<N>,
        asked: Vec<Candidate>,
    ) -> Result<FittedHypothesis<N>, GapError> {
        self.fit_towards(point, (start, asked), f64::INFINITY)
    }

    /// The same, given up where the cost will not come down to `aim`: the result is unfinished then, and its cost is above `aim`.
    ///
    /// # Errors
    /// As [`PreparedSession::fit`].
    pub(crate) fn fit_towards(
        &self,
        point: &LinearizationPoint<N>,
        (start, asked): (Hypothesis<N>, Vec<Candidate>),
        aim: f64,
    ) -> Result<FittedHypothesis<N>, GapError> {
        let mut fitted = self.state(point, start, asked)?;
        let mut slopes: Option<Vec<Response>> = None;
        let mut region = TrustRegion {
            radius: f64::INFINITY,
        };
        for _ in 0..STEPS {
            let hypothesis = &fitted.hypothesis;
            let old = slopes.is_some();
            let fresh = || self.responses_at(point, hypothesis, &fitted.named());
            // What cannot be followed a little further on is fitted as far as it was.
            let Ok(responses) = slopes.take().map_or_else(fresh, Ok) else {
                break;
            };
            let each: Vec<&Response> = responses.iter().collect();
            let (coordinates, clusters) =
                self.equations_with(point, &fitted, (&each, &Columns::default()));
            let equations = Equations::new(&clusters, hypothesis, &coordinates);
            let hopeless = equations.is_hopeless(fitted.cost, aim);
            // A step that gains too little to first order need not be tried.
            let least = FIRST_ORDER_SHARE * fitted.enough();
            let mut trusted = region;
            let mut found = None;
            for _ in 0..TRIES {
                let step = equations.step_within(trusted.radius);
                let Some(step) = step.filter(|step| !hopeless && step.gain > least) else {
                    break;
                };
                let moved = step.from(hypothesis, &coordinates);
                let next = self.state(point, moved, fitted.asked.clone()).ok();
                let cost = next.as_ref().map_or(f64::INFINITY, |next| next.cost);
                trusted.learn(&step, fitted.cost - cost);
                found = next.filter(|next| next.cost < fitted.cost);
                if found.is_some() {
                    break;
                }
            }
            // Where nothing decides an unknown, and where no step lowers the cost, what was found so far stands.
            let Some(next) = found else {
                if old {
                    continue;
                }
                break;
            };
            region = trusted;
            let gained = fitted.cost - next.cost;
            fitted = next;
            if gained < fitted.enough() {
                break;
            }
            slopes = (gained < NEAR * fitted.enough()).then_some(responses);
        }
        Ok(fitted)
    }

    /// Continues a fit from where an undamped step leads, even if the cost is higher there; keeps the result if its cost is lower. What would
    /// not come down to the cost `aim` is given up.
    ///
    /// The cost as a function of a size and the rest angle of its law is a curved valley, in which steps that lower the cost are short.
    pub(crate) fn fit_on(
        &self,
        point: &LinearizationPoint<N>,
        mut fitted: FittedHypothesis<N>,
        aim: f64,
    ) -> FittedHypothesis<N> {
        for _ in 0..CONTINUATIONS {
            let on = self.fit_after_whole_step(point, &fitted, aim);
            let Some(on) = on.filter(|on| on.cost < fitted.cost - fitted.enough()) else {
                break;
            };
            fitted = on;
        }
        fitted
    }

    /// A fit that starts after an undamped step; `None` if the model cannot be evaluated there, or the fit would be given up.
    fn fit_after_whole_step(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
        aim: f64,
    ) -> Option<FittedHypothesis<N>> {
        let (coordinates, clusters) = self.equations(point, fitted, &Columns::default()).ok()?;
        let equations = Equations::new(&clusters, &fitted.hypothesis, &coordinates);
        if equations.is_hopeless(fitted.cost, aim) {
            return None;
        }
        let start = equations.step(0.0)?.from(&fitted.hypothesis, &coordinates);
        self.fit_towards(point, (start, fitted.asked.clone()), aim)
            .ok()
    }

    /// Squares of what a fitted hypothesis leaves of each cluster when the others alone decide its numbers, to first order.
    ///
    /// # Errors
    /// As [`PreparedSession::equations`].
    pub fn foretold(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
    ) -> Result<f64, GapError> {
        let hypothesis = &fitted.hypothesis;
        let (coordinates, clusters) = self.equations(point, fitted, &Columns::default())?;
        let mut sum = 0.0;
        for (out, cluster) in clusters.iter().enumerate() {
            let others: Vec<Cluster> = clusters
                .iter()
                .enumerate()
                .filter(|(i, _)| *i != out)
                .map(|(_, c)| c.clone())
                .collect();
            let Step { usable, sizes, .. } = Equations::new(&others, hypothesis, &coordinates)
                .step(0.0)
                .unwrap_or_default();
            sum += cluster.square;
            for (&i, a) in usable.iter().zip(&sizes) {
                let row = usable.iter().zip(&sizes);
                let product = row.fold(0.0, |s, (&j, b)| s + cluster.gram[(i, j)] * b);
                sum += a * (product - 2.0 * cluster.score[i]);
            }
        }
        Ok(sum)
    }

    /// Fits a hypothesis, simulating it anew from where the fit ended until that changes nothing.
    ///
    /// # Errors
    /// [`GapError`] where the hypothesis cannot be simulated.
    pub fn settle(
        &self,
        start: Hypothesis<N>,
        asked: Vec<Candidate>,
    ) -> Result<(FittedHypothesis<N>, LinearizationPoint<'a, N>), GapError> {
        let mut point = self.linearize(&start)?;
        let mut before = self.state(&point, start, asked)?;
        for _ in 0..AGAIN {
            let after = self.fit(&point, before.hypothesis.clone(), before.asked.clone())?;
            let gained = before.cost - after.cost;
            if gained < 2.0 * after.enough() {
                return Ok((after, point));
            }
            let there = match self.linearize(&after.hypothesis) {
                Ok(there) => there,
                // A solution that can be followed but not simulated is refused.
                Err(_) => break,
            };
            let simulated = self.state(&there, after.hypothesis, after.asked)?;
            if simulated.cost > before.cost {
                break;
            }
            (before, point) = (simulated, there);
        }
        Ok((before, point))
    }
}

/// The region in which a linear model is trusted (Moré 1978).
#[derive(Clone, Copy)]
struct TrustRegion {
    /// Longest step within it; see [`Step::length`].
    radius: f64,
}

impl TrustRegion {
    /// Makes the region larger or smaller by what a step gained in fact; what it lost is less than nothing.
    fn learn(&mut self, step: &Step, gained: f64) {
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
    fn from<const N: usize>(
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

    /// Whether the cost will not come down to `aim`, by what a whole step would gain.
    fn is_hopeless(&self, cost: f64, aim: f64) -> bool {
        let gain = || self.step(0.0).map_or(f64::INFINITY, |step| step.gain);
        cost > aim && cost - HOPE * gain() > aim
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
    fn step_within(&self, radius: f64) -> Option<Step> {
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

    /// Noise leaves a cost of one for each row; a gain of 0.2 counts there, and with 10 000 too much left one of a ten thousandth more.
    #[test]
    fn much_is_left_from_a_half_beyond_noise_on_and_little_gains_count_near_it() {
        let fitted = |cost| FittedHypothesis {
            hypothesis: plain(),
            asked: Vec::new(),
            cost,
            rows: 1000,
            residuals: Vec::new(),
        };
        assert_eq!(
            [1490.0, 1510.0].map(|cost| fitted(cost).leaves_much()),
            [false, true]
        );
        let enough = [900.0, 1000.0, 11_000.0].map(|cost| fitted(cost).enough());
        assert_eq!(enough, [0.2, 0.2, 1.2]);
    }

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
        assert!(equations.is_hopeless(200.0, 55.0) && !equations.is_hopeless(200.0, 57.0));
        assert!(!equations.is_hopeless(50.0, 55.0) && !equations.is_hopeless(1e9, f64::INFINITY));
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
