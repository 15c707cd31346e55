//! Readings of the sensors at hand and contact where joint torques are compared, corrected under a hypothesis.
//!
//! The measured torque of a contact is `J(q)ᵀ F` of the readings of angle and force sensors. Errors of the readings, and a displaced
//! handle, are part of the prediction: the torque of the readings minus that of the angles and forces of a hypothesis.

use arm_core::effect::{Effect, Place};
use arm_core::{Chain, Joints, Placement, Plane, Pose, Reading, Setup, jacobian, static_torque};
use arm_sim::{Interpolation, Series};
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector3};

use crate::GapError;
use crate::data::session::{ComparisonMode, Session};

/// Angles, and force and moment on the arm, as they were read.
#[derive(Clone, Debug)]
pub(crate) struct ContactReadings<const N: usize> {
    q: Vec<Joints<f64, N>>,
    /// Force \[N\] and moment \[N m\]: `Fy`, `Fz`, `Mx`.
    force: Series<3>,
}

impl<const N: usize> Session<N> {
    /// What the sensors of a contact read in a trial, where it is compared by torques.
    ///
    /// # Errors
    /// [`GapError`] for forces that a spline refuses.
    pub(crate) fn contact_readings(
        &self,
        trial: usize,
        times: &[f64],
    ) -> Result<Option<ContactReadings<N>>, GapError> {
        let own = &self.trials[trial];
        let (Some(force), None, ComparisonMode::Torque) =
            (&own.force_on_arm, &own.torque, self.comparison)
        else {
            return Ok(None);
        };
        let moment = |i: usize| own.moment_on_arm.as_ref().map_or(0.0, |m| m[i]);
        let each = force.iter().enumerate();
        let read: Vec<[f64; 3]> = each.map(|(i, [y, z])| [*y, *z, moment(i)]).collect();
        let series = Series::new("contact force", times, &read, Interpolation::Cubic);
        let refused = |source| GapError::Simulation { trial, source };
        Ok(Some(ContactReadings {
            q: own.q.clone(),
            force: series.map_err(refused)?,
        }))
    }
}

impl<const N: usize> ContactReadings<N> {
    /// The predicted channels at a sample for required joint torques \[N m\], and their derivative with respect to these torques. The
    /// channels are the torques of the readings minus the residual.
    ///
    /// The residual has two parts. A contact force can produce the first part, which is scaled to what the sensors would read of this
    /// force. The second part is scaled by the ratio of the norms of both Jacobians (as read, true). Without this scaling, a small gain or
    /// length would shrink the residual.
    ///
    /// * `nominal`, `chain`, `setup` - the arm with which the channels were computed; the arm and the rig as a hypothesis has them
    /// * `misread` - what the angle sensors add \[rad\]
    pub(crate) fn missing_force(
        &self,
        (nominal, chain, setup, sensing): (
            &Chain<f64, N>,
            &Chain<f64, N>,
            &Setup<f64, N>,
            &Sensing,
        ),
        misread: Joints<f64, N>,
        (sample, time): (usize, f64),
        needed: Joints<f64, N>,
    ) -> (Joints<f64, N>, SMatrix<f64, N, N>) {
        /// Part of a Jacobian's square that keeps the force of a stretched arm finite.
        const SMALL: f64 = 1e-6;
        let [y, z, moment] = self.force.at(time).value;
        let seen = Pose::new(&self.q[sample]);
        let read = static_torque(nominal, &seen, [y, z], moment);
        let late = (time + setup.force_delay).clamp(self.force.start(), self.force.end());
        let (force, moment) = sensing.undone(time, self.force.at(late).value);
        let pose = Pose::new(&(self.q[sample] - misread));
        let placed = Placement::of(setup).map_or(0.0, |p| p.moment(&pose, force));
        let [displaced, ..] = setup.displaced.at(time);
        let slipped = displaced[0] * force[1] - displaced[1] * force[0];
        let left = static_torque(chain, &pose, force, moment + placed + slipped) - needed;
        let moves = jacobian(chain, &pose);
        let gains = sensing.gains.fixed_view::<2, 2>(0, 0);
        let moves_as_read = gains.transpose() * jacobian(nominal, &seen);
        let mut square = moves * moves.transpose();
        let size = square.trace();
        square += Matrix2::from_diagonal_element(SMALL * size);
        let inverse = square.try_inverse().unwrap_or_else(Matrix2::zeros);
        let of_missing = inverse * moves;
        let beyond = SMatrix::identity() - moves.transpose() * of_missing;
        let larger = libm::sqrt(moves_as_read.norm_squared() / size);
        let follow = moves_as_read.transpose() * of_missing + beyond * larger;
        (read - follow * left, follow)
    }
}

/// What the sensors of the contact force do to it: they are affine in force and moment.
#[derive(PartialEq)]
pub(crate) struct Sensing {
    effects: Vec<Effect<f64>>,
    gains: Matrix3<f64>,
    inverse: Matrix3<f64>,
}

impl Sensing {
    pub(crate) fn of(effects: &[Effect<f64>]) -> Self {
        let senses =
            |e: &&Effect<f64>| matches!(e.kind.info().place, Place::ForceSensor | Place::Sensors);
        let mut sensing = Self {
            effects: effects.iter().filter(senses).copied().collect(),
            gains: Matrix3::identity(),
            inverse: Matrix3::identity(),
        };
        let bias = sensing.read(0.0, Vector3::zeros());
        let unit = |channel: usize| sensing.read(0.0, Vector3::ith(channel, 1.0)) - bias;
        sensing.gains = Matrix3::from_columns(&[0, 1, 2].map(unit));
        let unknown = Matrix3::repeat(f64::NAN);
        sensing.inverse = sensing.gains.try_inverse().unwrap_or(unknown);
        sensing
    }

    pub(crate) fn read(&self, time: f64, true_values: Vector3<f64>) -> Vector3<f64> {
        let [y, z, moment] = true_values.into();
        let mut reading = Reading::<f64, 0> {
            time,
            q: Joints::zeros(),
            force_on_arm: [y, z],
            moment_on_arm: moment,
        };
        let distorting = self.effects.iter();
        distorting.for_each(|effect| effect.distort(&mut reading));
        let [y, z] = reading.force_on_arm;
        Vector3::new(y, z, reading.moment_on_arm)
    }

    /// The force \[N\] and the moment \[N m\] that are read as these.
    pub(crate) fn undone(&self, time: f64, read: [f64; 3]) -> (Plane<f64>, f64) {
        let left = Vector3::from(read) - self.read(time, Vector3::zeros());
        let [y, z, moment] = (self.inverse * left).into();
        ([y, z], moment)
    }
}
