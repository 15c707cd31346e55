//! Identification while the arm moves, in bounded memory and fixed time for each control period.
//!
//! The equation of motion of every sample is linear in the unknowns of an [`Equation`]. Its rows are averaged over a short
//! window and taken into a square-root information matrix; bounds are then imposed by fixing what lies outside. The work is
//! spread over the periods of the next window, one unit in each.
//!
//! Angles, forces and torques pass the same low-pass, so that none of them runs ahead of the others, and a sample that is
//! missing or wrong is bridged there and counts nowhere. Nothing is learned and nothing forgotten while the arm rests. What
//! is forgotten comes back from the prior, so that what a movement does not show returns to what was known before instead of
//! drifting.

mod estimate;
mod filtered_channel;
mod information;
mod sample;
mod schedule;
mod settings;
mod window;
mod work;

pub use estimate::{Decision, Estimate, Health};
pub use filtered_channel::Fault;
pub use sample::{Sample, SampleStatus};
pub use settings::Settings;

use filtered_channel::{Checks, FilteredChannel, restart, values};
use information::{Information, Row};
use schedule::Work;
use settings::Tuning;
use window::Windows;

use core::array::from_fn;

use crate::control::gravity_compensation::GravityCompensation;
use crate::effect::{MAX_STATES, Motion, States};
use crate::numeric::covariance::Covariance;
use crate::numeric::scalar::Real;
use crate::regression::{Equation, Measured, Needed, Prior};
use crate::{Invalid, joints};

/// Rows over which the usual size of the unexplained torque is averaged.
const USUAL: f64 = 50.0;

/// Identifies `P` unknowns of an arm of `N` joints and `E` effects while it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimator<T, const N: usize, const P: usize, const E: usize> {
    equation: Equation<T, N, P, E>,
    priors: [Prior<T>; P],
    tuning: Tuning<T, N>,
    /// Angles, angles that lead, torques.
    joints: [[FilteredChannel<T>; N]; 3],
    /// Force in y and z, moment.
    hand: [FilteredChannel<T>; 3],
    /// False until the first good sample, and after a gap.
    running: bool,
    /// Whether speeds come from angles of their own.
    led: bool,
    settling: u32,
    moving: bool,
    /// Periods since the last row.
    since_row: u32,
    /// The last sample behind the filters.
    motion: Motion<T, N>,
    measured: Measured<T, N>,
    memory: [States<T>; E],
    /// Usual size of the torque that the estimate does not explain \[N m\].
    usual: [T; N],
    /// Periods since a sample was last learned from; how often the state was not finite; what became of the last sample.
    age: u32,
    restarts: u32,
    /// A restart that the status of the next sample reports.
    restarted: bool,
    last: SampleStatus,
    windows: Windows<T, N, P>,
    work: Work,
    /// The row that is being taken in.
    row: Option<Row<T, P>>,
    information: Information<T, P>,
    /// The same with unknowns fixed to their bounds; then the place in which the next covariance is made.
    bounded: Information<T, P>,
    /// That of the estimates, of the window that they were published with.
    covariance: Covariance<T, P>,
    /// Standard deviations of the independent quantities behind that.
    deviations: [T; P],
    fixed: [bool; P],
    /// The last that was solved for.
    solution: [T; P],
    prior_row: usize,
    /// Running means of squared residuals and of products of neighbouring ones, in units of the noise; windows that were counted.
    residual: [T; 2],
    last_residual: [Option<T>; N],
    judged: T,
    /// See [`Estimator::excess`].
    excess: T,
    estimates: [Estimate<T>; P],
}

impl<T: Real, const N: usize, const P: usize, const E: usize> Estimator<T, N, P, E> {
    /// An estimator with its priors.
    ///
    /// # Errors
    /// [`Invalid`] for settings that are out of range, and priors without a positive standard deviation or with an empty
    /// range.
    pub fn new(
        equation: Equation<T, N, P, E>,
        priors: [Prior<T>; P],
        settings: &Settings<T, N>,
    ) -> Result<Self, Invalid> {
        for (index, prior) in priors.iter().enumerate() {
            prior.validate(index)?;
        }
        let tuning = Tuning::new(settings, P)?;
        let information = Information::independent(priors.iter().map(|p| (p.mean, p.sd)));
        let estimates = priors.map(|p| Estimate::of_prior(&p));
        Ok(Self {
            equation,
            priors,
            joints: [[FilteredChannel::new(); N]; 3],
            hand: [FilteredChannel::new(); 3],
            tuning,
            running: false,
            led: false,
            settling: 0,
            moving: false,
            since_row: 0,
            motion: Motion::new(T::ZERO, joints([T::ZERO; N]), joints([T::ZERO; N])),
            measured: Measured::none(),
            memory: [[T::ZERO; MAX_STATES]; E],
            usual: tuning.noise,
            age: 0,
            restarts: 0,
            restarted: false,
            last: SampleStatus::Settling,
            windows: Windows::EMPTY,
            work: Work::Idle,
            row: None,
            information,
            bounded: information,
            covariance: Covariance::independent(priors.map(|p| p.sd)),
            deviations: [T::ZERO; P],
            fixed: [false; P],
            solution: [T::ZERO; P],
            prior_row: 0,
            residual: [T::ZERO; 2],
            last_residual: [None; N],
            judged: T::ZERO,
            excess: T::ONE,
            estimates,
        })
    }

    /// The unknowns.
    pub fn equation(&self) -> &Equation<T, N, P, E> {
        &self.equation
    }
    /// Their priors.
    pub fn priors(&self) -> &[Prior<T>; P] {
        &self.priors
    }
    /// Their estimates.
    pub fn estimates(&self) -> &[Estimate<T>; P] {
        &self.estimates
    }

    /// How much larger the standard deviations are than the noise that was declared would make them: by residuals that are
    /// larger, and by neighbouring ones that resemble each other. Never below one.
    pub fn excess(&self) -> T {
        self.excess
    }

    /// How well it does.
    pub fn health(&self) -> Health<T, N> {
        Health {
            last: self.last,
            excess: self.excess(),
            residual: self.usual,
            age: T::of_count(self.age) * self.tuning.period,
            restarts: self.restarts,
        }
    }

    /// The torques that carry the arm at rest, or with what its effects resist with at the speeds of `motion`.
    ///
    /// With their standard deviation from the covariance of all unknowns, as of the last window. Give a motion without speed
    /// for the weight and the passive moments alone.
    pub fn carry(&self, motion: &Motion<T, N>) -> GravityCompensation<T, N> {
        let values = |i: usize| match (self.estimates.get(i), self.priors.get(i)) {
            (Some(estimate), Some(prior)) => [estimate.value, prior.mean],
            _ => [T::ZERO; 2],
        };
        let ([torque, expected], sd) =
            self.equation
                .carried(motion, &self.memory, values, &self.covariance);
        let far = |j: usize| (torque[j] - expected[j]).abs();
        GravityCompensation {
            // Not a number is not within.
            within: (0..N).all(|j| far(j) <= self.tuning.envelope[j]),
            torque,
            sd: joints(from_fn(|j| self.excess * sd[j])),
        }
    }

    /// One control period; `None` where a sample is missing.
    ///
    /// Filters the sample; then either builds a row from it or does one piece of the work that the last window left, so that
    /// no period takes much longer than another. A long cutoff period needs few rows: see [`Settings::cutoff`].
    pub fn update(&mut self, sample: Option<&Sample<T, N>>) -> SampleStatus {
        self.age = self.age.saturating_add(1);
        let status = self.step(sample);
        self.last = if self.restarted {
            SampleStatus::Refused(Fault::Restarted)
        } else {
            status
        };
        self.restarted = false;
        self.last
    }

    /// Filters, row and work are functions of their own, so that a period never needs the stack of two of them at once.
    fn step(&mut self, sample: Option<&Sample<T, N>>) -> SampleStatus {
        let sensed = self.sense(sample);
        self.since_row = self.since_row.saturating_add(1);
        let due = self.since_row >= self.tuning.stride && sensed.is_ok();
        // A row and the work on the last window take turns, so that no period has both.
        if self.tuning.stride == 1 || !due {
            self.work();
        }
        let fault = match sensed {
            Ok(()) => return self.learn(due),
            Err(status) => status,
        };
        if fault == SampleStatus::Refused(Fault::Frozen) {
            // Samples since it froze are discarded too.
            self.windows.open().clear();
            if let Work::Wait(_) = self.work {
                self.work = Work::Idle;
            }
        }
        self.age();
        fault
    }

    /// Checks and filters a sample.
    #[inline(never)]
    fn sense(&mut self, sample: Option<&Sample<T, N>>) -> Result<(), SampleStatus> {
        // A lead that comes or goes is another sensor.
        if !self.running || sample.is_some_and(|s| s.lead.is_some() != self.led) {
            return Err(self.start(sample));
        }
        let frozen_after = self.moving.then_some(self.tuning.frozen_after);
        // What the arm cannot have is bridged like what is not there.
        let implausible = sample.is_some_and(|s| !self.tuning.plausible(s));
        let sample = sample.filter(|_| !implausible);
        let [turn, load] = self.tuning.farthest;
        let cutoff = &self.tuning.cutoff;
        let mut checks = Checks {
            frozen_after,
            fault: implausible.then_some(Fault::Implausible),
            longest: 0,
        };
        let [angles, leads, torques] = &mut self.joints;
        let of_joints = |kind| sample.map(|s| s.of_joints(kind));
        let angle = checks.passed(angles, of_joints(0), turn, cutoff);
        // Without a better lead the angles lead themselves.
        let own;
        let (leads, lead) = if self.led {
            own = checks.passed(leads, of_joints(1), turn, cutoff);
            (leads, &own)
        } else {
            (&mut *angles, &angle)
        };
        let rates: [[T; 2]; N] = from_fn(|j| leads[j].rates(&lead[j], cutoff));
        let torque = checks.passed(torques, of_joints(2), load, cutoff);
        let of_hand = sample.map(Sample::of_hand);
        let hand = checks.passed(&mut self.hand, of_hand.as_ref(), load, cutoff);
        let Checks { fault, longest, .. } = checks;
        if longest > self.tuning.longest_gap {
            self.running = false;
        }
        let pace = self.tuning.pace;
        let (motion, measured) = (&mut self.motion, &mut self.measured);
        motion.q = joints(values(angles, &angle, cutoff));
        motion.qd = joints(rates.map(|[rate, _]| rate * pace));
        motion.qdd = joints(rates.map(|[_, rate]| rate * pace.squared()));
        measured.torque = joints(values(torques, &torque, cutoff));
        let [y, z, moment] = values(&mut self.hand, &hand, cutoff);
        (measured.force_on_arm, measured.moment_on_arm) = ([y, z], moment);
        self.moving = motion.qd.iter().any(|qd| qd.abs() > self.tuning.dead_band);
        self.equation
            .advance(motion, &mut self.memory, self.tuning.period);
        if !self.finite() {
            self.restart();
            return Err(SampleStatus::Refused(Fault::Restarted));
        }
        if let Some(fault) = fault {
            return Err(SampleStatus::Refused(fault));
        }
        if self.settling > 0 {
            self.settling -= 1;
            return Err(SampleStatus::Settling);
        }
        Ok(())
    }

    /// Whether nothing that is filtered has become NaN or infinite.
    fn finite(&self) -> bool {
        let (motion, measured) = (&self.motion, &self.measured);
        // A sum is not finite where one of its terms is not, and is faster than a check of each.
        let mut sum = measured.moment_on_arm + measured.force_on_arm[0] + measured.force_on_arm[1];
        for j in 0..N {
            sum += motion.q[j] + motion.qd[j] + motion.qdd[j] + measured.torque[j] + self.usual[j];
        }
        if self.equation.remembers() {
            let states = self.memory.as_flattened().iter();
            sum = states.fold(sum, |sum, &state| sum + state);
        }
        sum.is_finite()
    }

    /// Starts anew what a value that is not finite has spoiled: filters, states of effects, and what is usual.
    #[cold]
    #[inline(never)]
    fn restart(&mut self) {
        self.running = false;
        self.memory = [[T::ZERO; MAX_STATES]; E];
        self.usual = self.tuning.noise;
        self.windows.open().clear();
        self.restarts = self.restarts.saturating_add(1);
        self.restarted = true;
    }

    /// Restarts all filters at a sample.
    #[cold]
    #[inline(never)]
    fn start(&mut self, sample: Option<&Sample<T, N>>) -> SampleStatus {
        let Some(sample) = sample else {
            return SampleStatus::Refused(Fault::Missing);
        };
        if sample.finite() && !self.tuning.plausible(sample) {
            return SampleStatus::Refused(Fault::Implausible);
        }
        let mut good = true;
        for (kind, channels) in self.joints.iter_mut().enumerate() {
            good &= restart(channels, sample.of_joints(kind));
        }
        good &= restart(&mut self.hand, &sample.of_hand());
        if !good {
            return SampleStatus::Refused(Fault::NotFinite);
        }
        self.running = true;
        self.led = sample.lead.is_some();
        self.moving = false;
        self.settling = self.tuning.settling;
        self.windows.open().clear();
        SampleStatus::Settling
    }

    /// Adds a sample to the window, where one is due.
    ///
    /// At rest it is added as well, for to leave out slow samples would favour one side of every reversal; what counts is
    /// whether the arm moved at any time in the window.
    fn learn(&mut self, due: bool) -> SampleStatus {
        let status = if due {
            self.since_row = 0;
            self.weigh()
        } else {
            SampleStatus::Taken
        };
        self.windows.open().moved |= self.moving;
        self.age();
        match status {
            SampleStatus::Taken if !self.moving => SampleStatus::Resting,
            other => other,
        }
    }

    #[inline(never)]
    fn weigh(&mut self) -> SampleStatus {
        let mut rows = Needed::none();
        let acting =
            self.equation
                .add_needed(&self.motion, &self.memory, &self.measured, &mut rows);
        let expected = rows.torque_of(|i| self.estimates[i].value);
        let rest: [T; N] = from_fn(|j| (acting[j] - expected[j]).abs());
        // What is still uncertain may show at any time; correlations would only lessen it.
        let doubt = |j: usize| {
            let pairs = rows.columns[j].iter().zip(&self.estimates);
            pairs.fold(T::ZERO, |sum, (&c, e)| sum + (c * e.sd).squared())
        };
        let gate = self.tuning.gate.squared();
        let within = |j: usize| {
            let size = self.usual[j].max(self.tuning.noise[j]);
            rest[j] <= self.tuning.gate * size
                || rest[j].squared() <= gate * (size.squared() + doubt(j))
        };
        if !(0..N).all(within) {
            // Refused samples do not change the usual size: else a lasting fault would open the gate.
            return SampleStatus::Refused(Fault::Unexpected);
        }
        for j in 0..N {
            self.usual[j] += (rest[j] - self.usual[j]) * T::of(1.0 / USUAL);
        }
        self.age = 0;
        for j in 0..N {
            let window = self.windows.open();
            window.add(j, &rows.columns[j], acting[j] - rows.known[j]);
        }
        SampleStatus::Taken
    }

    /// One period more in the window; a full one is handed on.
    fn age(&mut self) {
        let window = self.windows.open();
        window.age += 1;
        if window.age < self.tuning.window {
            return;
        }
        if window.moved && window.counts.iter().any(|&n| n >= self.tuning.enough) {
            self.work = Work::Wait(self.tuning.quarantine);
            self.windows.exchange();
        } else {
            window.clear();
        }
    }
}
