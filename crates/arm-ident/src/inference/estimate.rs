//! The result of an identification.

use arm_core::effect::Effect;
pub use arm_core::estimator::Decision;
use arm_core::{Chain, Joints};
use serde::{Serialize, Serializer};

use crate::error::IdentError;
use arm_numerics::least_squares::program::Status;

/// One estimated quantity, in the terms of files.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Parameter of a segment (`m2`, `m2*l2`, `l2`, `I2`) or of an effect (`torque`), or a combination of parameters.
    pub name: String,
    /// Joint or segment, from 1, where it belongs to one.
    pub joint: Option<usize>,
    /// `segment`, `combination`, `calibration`, or the kind of effect.
    pub kind: String,
    /// Estimate, in `unit`.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// SI unit.
    pub unit: String,
    /// Interval at the requested level.
    pub interval: (f64, f64),
    /// What the value rests on.
    #[serde(serialize_with = "word")]
    pub decided_by: Decision,
    /// Why `std` and `interval` are too small, where an assumption behind the value is known to be wrong.
    pub caveat: Option<String>,
}

fn word<S: Serializer>(decision: &Decision, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(decision.name())
}

impl Estimate {
    /// The same, within limits that it cannot exceed.
    pub(crate) fn within(mut self, least: f64, most: f64) -> Self {
        let (low, high) = self.interval;
        self.interval = (low.clamp(least, most), high.clamp(least, most));
        self
    }
}

/// How the model explains one trial, after filtering and decimation.
#[derive(Clone, Debug, PartialEq)]
pub struct Explained<const N: usize> {
    /// Index of each sample in the trial.
    pub samples: Vec<usize>,
    /// Torques that follow from the measurement \[N m\].
    pub measured: Vec<Joints<f64, N>>,
    /// Torques of the fitted model \[N m\].
    pub fitted: Vec<Joints<f64, N>>,
}

/// The result of an identification.
#[derive(Clone, Debug)]
pub struct Identified<const N: usize> {
    /// How the solver ended.
    pub status: Status,
    /// Number of combinations that the data determine.
    pub rank: usize,
    /// Number of unknowns, calibration not counted.
    pub unknowns: usize,
    /// The unknowns and what follows from them.
    pub parameters: Vec<Estimate>,
    /// The base parameters: what any movement of a planar chain can determine at most.
    pub combinations: Vec<Estimate>,
    /// Calibrations that were refitted within their tolerance.
    pub calibration: Vec<Estimate>,
    /// Names of the quantities between which `correlations` are: the combinations, then the parameters of effects as
    /// [`Unknown::printed`](crate::regression::unknown::Unknown::printed). None where each joint was fitted by itself.
    pub correlated: Vec<String>,
    /// Correlations of their errors, by rows.
    pub correlations: Vec<Vec<f64>>,
    /// In words: which unknowns trade against each other.
    pub trades: Vec<String>,
    /// Whether no torque acted, so that all parameters are known up to one common factor only.
    pub scale_free: bool,
    /// Cutoff of the common low-pass \[Hz\].
    pub cutoff: f64,
    /// Number of independent clusters behind the standard deviations.
    pub clusters: usize,
    /// By how many standard deviations the inertia that the cascade neglects moves each first moment `X_j`; zeros for the joint method.
    pub neglected_inertia: Vec<f64>,
    /// Noise of each joint's speed relative to the speed itself, where the motion was measured; zero where it was simulated.
    /// Above a few tenths, friction, viscosity and inertia have a bias that the intervals do not contain.
    pub speed_noise: Vec<f64>,
    /// Why the motion was measured where it was to be simulated if that could be done.
    pub not_simulated: Option<IdentError>,
    /// Measured and fitted torques of each trial.
    pub explained: Vec<Explained<N>>,
    /// The arm with the estimates.
    pub chain: Chain<f64, N>,
    /// The fitted effects with their estimates.
    pub fitted: Vec<Effect<f64>>,
}
