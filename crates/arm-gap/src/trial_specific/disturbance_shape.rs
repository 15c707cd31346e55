//! Shapes of disturbances: the response of the channels to each, and the time at which it explains most.

use arm_core::effect::{Effect, KINDS, Kind, Nature, Place};

use crate::data::course::{Channels, Course, smooth};
use crate::data::noise::dot;
use crate::linearization::linear_response::Change;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::{LinearizationPoint, slope};
use crate::trial_specific::component::timing_of;

/// Time between the starts that are tried \[s\]: a third of the shortest burst.
const EVERY: f64 = 0.1;

/// A disturbance at a time, with what the channels would show for one unit of each parameter that is its size.
pub(super) struct Shape {
    pub effect: Effect<f64>,
    pub columns: Vec<(usize, Channels)>,
}

impl<const N: usize> PreparedSession<'_, N> {
    /// What the channels of a movement would show of what acts or slips once.
    pub(super) fn shape_of(
        &self,
        point: &LinearizationPoint<N>,
        group: usize,
        effect: Effect<f64>,
    ) -> Option<Shape> {
        /// Torque that is small and yet seen \[N m\].
        const TORQUE: f64 = 1e-2;
        let part = effect.kind.prior().parts.first()?;
        let (sizes, unit) = (part.sizes, part.small);
        let unit = if unit > 0.0 { unit } else { TORQUE };
        let line = point.lines.get(group)?;
        let column = |&p: &usize| {
            let mut changed = point.hypothesis.clone();
            let mut one = effect;
            sizes.iter().for_each(|&size| one.parameters[size] = 0.0);
            one.parameters[p] = unit;
            changed.named.push(one);
            let channels = line.response(&Change::of(changed, unit)).ok()?;
            Some((p, channels))
        };
        let columns = sizes.iter().map(column).collect::<Option<Vec<_>>>()?;
        Some(Shape { effect, columns })
    }

    /// Disturbances of a movement: bursts in every joint, slips of the handle and of every angle sensor.
    pub(super) fn shapes_in(&self, point: &LinearizationPoint<N>, group: usize) -> Vec<Shape> {
        /// Durations of bursts that are tried \[s\], each twice the one before.
        const LONG: [f64; 3] = [0.3, 0.6, 1.2];
        if point.lines.is_empty() {
            return self.slips_in_torques(point, group);
        }
        let course = &self.courses[self.references[group]];
        let count = course.raw[0].len();
        let starts = (count as f64 / course.rate / EVERY) as usize;
        let of = |nature: Nature| KINDS.iter().filter(move |k| k.prior().nature == nature);
        let mut effects: Vec<Effect<f64>> = Vec::new();
        for (&kind, j) in of(Nature::Burst).flat_map(|k| (0..N).map(move |j| (k, j))) {
            for long in LONG {
                let at = |s| Effect::new(kind, j).with(&[0.0, EVERY * s as f64, long]);
                effects.extend((0..starts).map(at));
            }
        }
        for &kind in of(Nature::Slip) {
            let at = |s| Effect::new(kind, 0).with(&[0.0, 0.0, EVERY * s as f64]);
            effects.extend(within(starts).map(at));
        }
        let answered = self.parallel(effects.len(), |i| self.shape_of(point, group, effects[i]));
        let mut shapes: Vec<Shape> = answered.into_iter().flatten().collect();
        for (&kind, j) in angle_sensors::<N>() {
            let mut shown = vec![vec![0.0; count]; self.session.channels()];
            shown[j] = vec![1.0; count];
            shapes.extend(slips_within(Effect::new(kind, j), &[(0, shown)], course));
        }
        shapes
    }

    /// Slips of the handle and of every angle sensor where torques are compared that a contact exerts: what has slipped stays, and its
    /// torque is that of a slip before the start.
    fn slips_in_torques(&self, point: &LinearizationPoint<N>, group: usize) -> Vec<Shape> {
        /// A start before any trial \[s\].
        const BEFORE: f64 = -1.0;
        if !self.session.reads_contact() {
            return Vec::new();
        }
        let course = &self.courses[self.references[group]];
        let place = (group, course.as_ref());
        let Ok(base) = self.follow_raw(point, &point.hypothesis, place) else {
            return Vec::new();
        };
        let handles = KINDS.iter().filter(|k| k.prior().nature == Nature::Slip);
        let all = handles.map(|kind| (kind, 0)).chain(angle_sensors::<N>());
        let one = |(&kind, j): (&Kind, usize)| {
            let part = kind.prior().parts.first()?;
            let mut effect = Effect::new(kind, j);
            effect.parameters[timing_of(kind).0] = BEFORE;
            let shown = |&p: &usize| {
                let mut changed = point.hypothesis.clone();
                let mut slipped = effect;
                slipped.parameters[p] = part.small;
                changed.named.push(slipped);
                let up = self.follow_raw(point, &changed, place).ok()?;
                Some((p, slope(&up, &base, part.small)))
            };
            let shown = part.sizes.iter().map(shown).collect::<Option<Vec<_>>>()?;
            Some(slips_within(effect, &shown, course))
        };
        all.filter_map(one).flatten().collect()
    }
}

/// The kinds of errors of angle sensors, in every joint.
fn angle_sensors<const N: usize>() -> impl Iterator<Item = (&'static Kind, usize)> {
    let sensors = KINDS
        .iter()
        .filter(|k| k.info().place == Place::AngleSensor);
    sensors.flat_map(|kind| (0..N).map(move |j| (kind, j)))
}

/// What shows from some time on, for all times within a trial that are tried; what is off from its start is how the handle is held and
/// the sensor was put on.
///
/// * `shown` - by the size that it shows for one unit of
fn slips_within<const N: usize>(
    effect: Effect<f64>,
    shown: &[(usize, Channels)],
    course: &Course<N>,
) -> Vec<Shape> {
    let count = course.raw[0].len();
    let starts = (count as f64 / course.rate / EVERY) as usize;
    let from = |s: usize| {
        let first = (EVERY * s as f64 * course.rate) as usize;
        let cut = |channel: &Vec<f64>| {
            let each = channel.iter().enumerate();
            each.map(|(i, v)| if i >= first { *v } else { 0.0 })
                .collect()
        };
        let column = |(p, channels): &(usize, Channels)| {
            let cut: Channels = channels.iter().map(cut).collect();
            // In the band of what it is compared with.
            Some((*p, smooth(&cut, course.band, course.rate).ok()?))
        };
        let mut effect = effect;
        effect.parameters[timing_of(effect.kind).0] = EVERY * s as f64;
        let columns = shown.iter().map(column).collect::<Option<Vec<_>>>()?;
        Some(Shape { effect, columns })
    };
    within(starts).filter_map(from).collect()
}

/// The starts that are tried for what slips within a trial.
fn within(starts: usize) -> std::ops::Range<usize> {
    10..starts.saturating_sub(10)
}

/// A candidate disturbance, with its response.
#[derive(Clone)]
pub(super) struct CandidateDisturbance {
    /// Its size is one, in the direction that explains most.
    pub effect: Effect<f64>,
    /// Parameters that are its size.
    pub sizes: Vec<usize>,
    /// Variances of these, where white rows have one.
    pub variances: Vec<f64>,
    /// Whitened, without what is usual.
    pub row: Vec<f64>,
    pub square: f64,
}

impl CandidateDisturbance {
    /// A disturbance in the direction that explains most of a deviation; `None` where it would show nothing.
    ///
    /// * `rows` - what one unit of each parameter that is its size would show; one or two of them
    pub fn along(
        mut effect: Effect<f64>,
        mut rows: Vec<(usize, Vec<f64>)>,
        deviation: &[f64],
    ) -> Option<Self> {
        /// Part of a square that is rounding.
        const ROUNDING: f64 = 1e-9;
        let sizes: Vec<usize> = rows.iter().map(|(p, _)| *p).collect();
        let (first, mut row) = rows.remove(0);
        let mut square = dot(&row, &row);
        effect.parameters[first] = 1.0;
        let mut variances = vec![1.0 / square];
        let firsts = square;
        if let Some((second, other)) = rows.pop() {
            let (both, own) = (dot(&row, &other), dot(&other, &other));
            let determinant = square * own - both * both;
            if determinant <= ROUNDING * square * own {
                return None;
            }
            let (a, b) = (dot(&row, deviation), dot(&other, deviation));
            let (x, y) = (own * a - both * b, square * b - both * a);
            let length = libm::hypot(x, y);
            if length <= 0.0 {
                return None;
            }
            let (x, y) = (x / length, y / length);
            (effect.parameters[first], effect.parameters[second]) = (x, y);
            for (value, more) in row.iter_mut().zip(&other) {
                *value = x * *value + y * more;
            }
            square = dot(&row, &row);
            variances = vec![own / determinant, firsts / determinant];
        }
        (square > 0.0).then_some(Self {
            effect,
            sizes,
            variances,
            row,
            square,
        })
    }

    pub fn place(&self) -> (Kind, usize) {
        (self.effect.kind, self.effect.index)
    }

    /// How large it is in a deviation.
    pub fn size(&self, deviation: &[f64]) -> f64 {
        dot(&self.row, deviation) / self.square
    }

    /// What it explains of a deviation.
    pub fn gain(&self, deviation: &[f64]) -> f64 {
        let along = dot(&self.row, deviation);
        along * along / self.square
    }

    /// What is left of a deviation without it.
    pub fn left_of(&self, deviation: &[f64]) -> Vec<f64> {
        let size = self.size(deviation);
        let own = deviation.iter().zip(&self.row);
        own.map(|(value, row)| value - size * row).collect()
    }

    /// When it begins, and how long it lasts where it ends \[s\].
    fn timing(&self) -> (f64, Option<f64>) {
        let (start, duration) = timing_of(self.effect.kind);
        let value = |p: usize| self.effect.parameters[p];
        (value(start), duration.map(value))
    }
}

/// A disturbance at the time at which it explains most.
pub(super) struct Explained {
    pub asked: CandidateDisturbance,
    pub size: f64,
    /// What it explains of the deviation.
    pub gain: f64,
}

impl Explained {
    pub fn of(asked: CandidateDisturbance, deviation: &[f64]) -> Self {
        let (size, gain) = (asked.size(deviation), asked.gain(deviation));
        Self { asked, size, gain }
    }

    /// The effect in the size that it has.
    ///
    /// * `shrink` - part of it that the difference of a trial from its repeats shows
    pub fn effect(&self, shrink: f64) -> Effect<f64> {
        let mut effect = self.asked.effect;
        for &p in &self.asked.sizes {
            effect.parameters[p] *= self.size / shrink;
        }
        effect
    }

    /// Standard deviations of its sizes.
    ///
    /// * `scale` - misfit for each degree of freedom
    pub fn sd(&self, scale: f64, shrink: f64) -> Vec<f64> {
        let one = |variance: &f64| libm::sqrt(scale * variance) / shrink;
        self.asked.variances.iter().map(one).collect()
    }
}

/// What acts or slips once with the start and the duration with which it explains most: those of the grid decide neither its size nor its
/// place.
///
/// * `deviation` - what the trial differs from its repeats by
/// * `answer` - its response
pub(super) fn timed(
    mut best: CandidateDisturbance,
    deviation: &[f64],
    answer: impl Fn(Effect<f64>) -> Option<CandidateDisturbance>,
) -> CandidateDisturbance {
    /// First and last change of the start \[s\].
    const STEPS: (f64, f64) = (0.05, 0.01);
    /// Changes of the duration, in changes of the start.
    const LONGER: f64 = 2.0;
    /// Shortest and longest burst \[s\].
    const DURATION: (f64, f64) = (0.1, 3.0);
    if !matches!(
        best.effect.kind.prior().nature,
        Nature::Burst | Nature::Slip
    ) {
        return best;
    }
    let (start, duration) = timing_of(best.effect.kind);
    let mut step = STEPS.0;
    while step > STEPS.1 {
        let longer = LONGER * step;
        // A burst that lasts longer about its middle starts earlier.
        let moves = [(step, 0.0), (-step, 0.0), (-step, longer), (step, -longer)];
        let possible = if duration.is_some() { 4 } else { 2 };
        let moved = moves[..possible].iter().find_map(|(later, longer)| {
            let mut effect = best.effect;
            effect.parameters[start] += later;
            let mut within = effect.parameters[start] >= 0.0;
            if let Some(p) = duration {
                effect.parameters[p] += longer;
                within &= (DURATION.0..=DURATION.1).contains(&effect.parameters[p]);
            }
            let moved = within.then(|| answer(effect))??;
            (moved.gain(deviation) > best.gain(deviation)).then_some(moved)
        });
        match moved {
            Some(moved) => best = moved,
            None => step *= 0.5,
        }
    }
    best
}

/// How much more than noise the shape of a disturbance finds at other times of its movement, as a ratio of variances; at least one.
///
/// Joints that stick elsewhere in every repeat, and noise that differs from the autoregression, resemble disturbances at many times.
///
/// * `one` - as it stands among `asked`
/// * `deviations` - of the trial and its repeats, without what the disturbance itself explains: an arm rings long after a burst, and what
///   slips stays off
pub(super) fn scatter_elsewhere(
    one: &CandidateDisturbance,
    asked: &[CandidateDisturbance],
    deviations: &[Vec<f64>],
) -> f64 {
    /// Nine of ten squares of a standard normal number are smaller.
    const NINE_OF_TEN: f64 = 2.706;
    /// Duration of the response around a burst, and around the start of a slip \[s\].
    const RESPONSE_TIME: f64 = 1.0;
    let (start, duration) = one.timing();
    let long = duration.unwrap_or(0.0);
    let own = (start - RESPONSE_TIME, start + long);
    let elsewhere = asked.iter().filter(|other| {
        let (from, lasts) = other.timing();
        let same = other.place() == one.place() && lasts == duration;
        same && (from - RESPONSE_TIME > own.1 || from + long < own.0)
    });
    let mut squares: Vec<f64> = elsewhere
        .flat_map(|other| deviations.iter().map(|d| other.gain(d)))
        .collect();
    squares.sort_by(f64::total_cmp);
    let tenth = squares.len().saturating_sub(1) * 9 / 10;
    squares
        .get(tenth)
        .map_or(1.0, |s| f64::max(s / NINE_OF_TEN, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bursts of 0.5 s that start every 0.1 s of 10 s, each with a row of its own.
    fn bursts() -> Vec<CandidateDisturbance> {
        (0..95)
            .map(|k| {
                let mut row = vec![0.0; 95];
                row[k] = 1.0;
                let effect = Effect::new(Kind::Voluntary, 0).with(&[1e-2, 0.1 * k as f64, 0.5]);
                CandidateDisturbance {
                    effect,
                    sizes: vec![0],
                    variances: vec![1.0],
                    row,
                    square: 1.0,
                }
            })
            .collect()
    }

    #[test]
    fn a_burst_stands_out_against_other_times_and_not_against_itself() {
        let asked = bursts();
        // Far more than noise from 4.0 to 5.0 s alone: that is what a burst does.
        let once: Vec<f64> = (0..95)
            .map(|k| if (40..50).contains(&k) { 9.0 } else { 1.0 })
            .collect();
        assert_eq!(
            scatter_elsewhere(&asked[45], &asked, std::slice::from_ref(&once)),
            1.0
        );
        // As much all the time is no burst.
        let always = vec![9.0; 95];
        let scatter = scatter_elsewhere(&asked[45], &asked, &[once, always]);
        assert!((scatter - 81.0 / 2.706).abs() < 1e-12, "{scatter}");
    }

    #[test]
    fn what_rings_after_a_burst_is_no_scatter() {
        let mut asked = bursts();
        for (k, one) in asked.iter_mut().enumerate() {
            // An arm that rings for 4 s.
            (k..95.min(k + 40)).for_each(|i| one.row[i] = libm::exp(-0.05 * (i - k) as f64));
            one.square = dot(&one.row, &one.row);
        }
        let seen: Vec<f64> = asked[30].row.iter().map(|v| 50.0 * v).collect();
        let rings = scatter_elsewhere(&asked[30], &asked, std::slice::from_ref(&seen));
        assert!(rings > 10.0, "{rings}");
        let left = asked[30].left_of(&seen);
        assert_eq!(scatter_elsewhere(&asked[30], &asked, &[left]), 1.0);
    }

    #[test]
    fn a_burst_is_timed_between_the_points_of_the_grid() {
        // A bump over 10 s, a hundred samples a second.
        let answer = |effect: Effect<f64>| {
            let [_, start, duration, ..] = effect.parameters;
            let at = |i: usize| {
                let s = (0.01 * i as f64 - start) / duration;
                let inside = (0.0..=1.0).contains(&s);
                let bump = s * (1.0 - s);
                if inside { bump * bump * bump } else { 0.0 }
            };
            let row: Vec<f64> = (0..1000).map(at).collect();
            let square = dot(&row, &row);
            Some(CandidateDisturbance {
                effect,
                sizes: vec![0],
                variances: vec![1.0 / square],
                row,
                square,
            })
        };
        let burst =
            |start, duration| Effect::new(Kind::Voluntary, 0).with(&[1e-2, start, duration]);
        let seen = answer(burst(4.28, 0.5)).expect("a row").row;
        let coarse = answer(burst(4.4, 0.3)).expect("a row");
        let part = coarse.gain(&seen) / dot(&seen, &seen);
        assert!(part < 0.9, "{part}");
        let found = timed(coarse, &seen, answer);
        let [_, start, duration, ..] = found.effect.parameters;
        assert!(
            (start - 4.28).abs() < 0.03 && (duration - 0.5).abs() < 0.05,
            "{start} {duration}"
        );
        assert!(found.gain(&seen) > 0.99 * dot(&seen, &seen));
    }

    #[test]
    fn a_slip_takes_the_direction_that_explains_most() {
        let effect = Effect::new(Kind::HandleSlip, 0).with(&[0.0, 0.0, 2.0]);
        let rows = vec![(0, vec![2.0, 0.0, 0.0]), (1, vec![1.0, 1.0, 0.0])];
        // Three of the first and four of the second, and something that neither shows.
        let asked = CandidateDisturbance::along(effect, rows, &[10.0, 4.0, 7.0])
            .expect("it shows something");
        let [y, z, start, ..] = asked.effect.parameters;
        assert!((y - 0.6).abs() < 1e-12 && (z - 0.8).abs() < 1e-12 && start == 2.0);
        assert!((asked.size(&[10.0, 4.0, 7.0]) - 5.0).abs() < 1e-12);
        assert!((asked.gain(&[10.0, 4.0, 7.0]) - 116.0).abs() < 1e-9);
        // The inverse of (4 2; 2 2).
        assert!(
            (asked.variances[0] - 0.5).abs() < 1e-12 && (asked.variances[1] - 1.0).abs() < 1e-12
        );
        let alike = vec![(0, vec![1.0, 0.0]), (1, vec![2.0, 0.0])];
        assert!(CandidateDisturbance::along(effect, alike, &[1.0, 1.0]).is_none());
    }

    /// What makes other times loud counts from a second before and after on, and not nearer.
    #[test]
    fn a_burst_is_felt_for_a_second_around_it() {
        let asked = bursts();
        let scatter = |loud: &dyn Fn(usize) -> bool| {
            let deviation = (0..95).map(|k| if loud(k) { 9.0 } else { 1.0 });
            scatter_elsewhere(&asked[45], &asked, &[deviation.collect()])
        };
        assert_eq!(scatter(&|k| (31..60).contains(&k)), 1.0);
        assert!(scatter(&|k| (21..30).contains(&k) || (62..70).contains(&k)) > 1.0);
    }
}
