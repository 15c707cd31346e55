//! A virtual spring and damper in every joint that hold a simulated arm near the measured one.
//!
//! An arm of which little is known moves elsewhere than its model, and a fit that is linearised along such a run may end in a wrong minimum. With
//! `K (q_m − q) + D (q̇_m − q̇)` in its joints the model moves nearly as measured whatever its parameters are. A fit along such runs starts the
//! next with a weaker assistance, until there is none: a homotopy (Vyasarayani, Uchida, Carvalho and McPhee 2011, Parameter identification in
//! dynamic systems using the homotopy optimization approach).

use arm_core::{Joints, Pose, inertia};
use arm_sim::{Experiment, Interpolation, Series};

use crate::error::IdentError;
use crate::regression::measured_motion::low_pass;
use crate::regression::trial::{Model, Trial};

/// Bandwidth of the angles that it pulls towards, in bandwidths of the rows.
const BAND: f64 = 2.0;

/// In every joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Assistance<const N: usize> {
    /// \[N m/rad\].
    pub stiffness: [f64; N],
    /// \[N m s/rad\].
    pub damping: [f64; N],
}

impl<const N: usize> Assistance<N> {
    /// One with which every joint by itself, the arm stretched, follows with a given natural frequency \[Hz\], critically damped.
    pub fn of_frequency(model: &Model<N>, frequency: f64) -> Self {
        let stretched = inertia(&model.chain, &Pose::new(&Joints::zeros()));
        let pace = core::f64::consts::TAU * frequency;
        let of = |power: i32, times: f64| {
            core::array::from_fn(|j| times * stretched[(j, j)] * libm::pow(pace, f64::from(power)))
        };
        Self {
            stiffness: of(2, 1.0),
            damping: of(1, 2.0),
        }
    }

    /// Lets it act in the experiment that simulates a trial.
    ///
    /// # Errors
    /// [`IdentError`] when the trial is too short for the filter.
    pub fn help(
        &self,
        experiment: &mut Experiment<N>,
        trial: &Trial<N>,
        cutoff: f64,
    ) -> Result<(), IdentError> {
        let filter = low_pass((BAND * cutoff).min(0.4 * trial.rate), trial.rate)?;
        let mut angles = vec![[0.0; N]; trial.len()];
        for j in 0..N {
            let measured: Vec<f64> = trial.q.iter().map(|q| q[j]).collect();
            for (angles, smooth) in angles.iter_mut().zip(filter.both_ways(&measured)?) {
                angles[j] = smooth;
            }
        }
        let times: Vec<f64> = (0..trial.len()).map(|i| i as f64 / trial.rate).collect();
        experiment.assistance = Some(arm_sim::Assistance {
            towards: Series::new("measured angles", &times, &angles, Interpolation::Cubic)?,
            stiffness: self.stiffness,
            damping: self.damping,
        });
        Ok(())
    }
}
