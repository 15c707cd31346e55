//! The equation of motion linearised along a run, `M δq̈ + D δq̇ + K δq = p`, and its solution step by step.
//!
//! The one place that solves it. Identification computes how unknowns move an arm that its robot does not hold, the gap search how the
//! readings of sensors change; each has its own equation of motion. It is solved implicitly, so that a stiff contact and dry friction need no short steps.

use arm_core::{Joints, Plane};
use nalgebra::SMatrix;

/// Point of a step at which its rates count: a little beyond the middle, so that fast vibrations are damped.
const THETA: f64 = 0.55;
/// Change of an angle for difference quotients \[rad\].
const ANGLE: f64 = 1e-6;
/// Change of a speed for difference quotients \[rad/s\].
const SPEED: f64 = 1e-5;

/// How the torques of the equation of motion, and a force, follow the motion around one instant.
#[derive(Clone, Copy, Debug)]
pub struct Slopes<const N: usize> {
    /// Torque by acceleration \[kg m²\].
    pub mass: SMatrix<f64, N, N>,
    /// Torque by speed \[N m s/rad\].
    pub damping: SMatrix<f64, N, N>,
    /// Torque by angle \[N m/rad\].
    pub stiffness: SMatrix<f64, N, N>,
    /// Force by angle \[N/rad\] and by speed \[N s/rad\].
    pub force: [SMatrix<f64, 2, N>; 2],
}

impl<const N: usize> Slopes<N> {
    /// Slopes by differences around angles, speeds and accelerations: one-sided for accelerations, in which torques are linear.
    ///
    /// * `here` - torque at that motion itself \[N m\]
    /// * `left` - torque \[N m\] and force \[N\] at angles \[rad\], speeds \[rad/s\] and accelerations \[rad/s²\]
    ///
    /// ```
    /// use arm_core::Joints;
    /// use arm_sim::Slopes;
    /// let at = [0.1, 0.2, 0.3].map(Joints::<f64, 1>::repeat);
    /// let left = |q: &Joints<f64, 1>, qd: &Joints<f64, 1>, qdd: &Joints<f64, 1>| (qdd * 2.0 + qd * 3.0 + q * 4.0, [5.0 * q[0], 0.0]);
    /// let slopes = Slopes::around(at, &left(&at[0], &at[1], &at[2]).0, left);
    /// assert!((slopes.mass[0] - 2.0).abs() < 1e-9 && (slopes.damping[0] - 3.0).abs() < 1e-9);
    /// assert!((slopes.stiffness[0] - 4.0).abs() < 1e-9 && (slopes.force[0][(0, 0)] - 5.0).abs() < 1e-9);
    /// ```
    pub fn around(
        [q, qd, qdd]: [Joints<f64, N>; 3],
        here: &Joints<f64, N>,
        left: impl Fn(&Joints<f64, N>, &Joints<f64, N>, &Joints<f64, N>) -> (Joints<f64, N>, Plane<f64>),
    ) -> Self {
        let mut slopes = Self {
            mass: SMatrix::zeros(),
            damping: SMatrix::zeros(),
            stiffness: SMatrix::zeros(),
            force: [SMatrix::zeros(); 2],
        };
        let between = |up: (Joints<f64, N>, Plane<f64>), down: (_, Plane<f64>), size: f64| {
            let force = [0, 1].map(|c| (up.1[c] - down.1[c]) / (2.0 * size));
            ((up.0 - down.0) / (2.0 * size), force.into())
        };
        for j in 0..N {
            let mut moved = qdd;
            moved[j] += 1.0;
            slopes.mass.set_column(j, &(left(&q, &qd, &moved).0 - here));
            let (mut up, mut down) = (q, q);
            (up[j], down[j]) = (q[j] + ANGLE, q[j] - ANGLE);
            let (torque, force) = between(left(&up, &qd, &qdd), left(&down, &qd, &qdd), ANGLE);
            slopes.stiffness.set_column(j, &torque);
            slopes.force[0].set_column(j, &force);
            (up, down) = (qd, qd);
            (up[j], down[j]) = (qd[j] + SPEED, qd[j] - SPEED);
            let (torque, force) = between(left(&q, &up, &qdd), left(&q, &down, &qdd), SPEED);
            slopes.damping.set_column(j, &torque);
            slopes.force[1].set_column(j, &force);
        }
        slopes
    }

    /// What multiplies the new accelerations in a step \[s\].
    pub fn of_step(&self, step: f64) -> SMatrix<f64, N, N> {
        let h = step * THETA;
        self.mass + self.damping * h + self.stiffness * (h * h)
    }
}

/// A change of the motion along a run.
#[derive(Clone, Copy, Debug)]
pub struct Change<const N: usize> {
    /// Of the angles \[rad\].
    pub q: Joints<f64, N>,
    /// Of the speeds \[rad/s\].
    pub qd: Joints<f64, N>,
    /// Of the accelerations \[rad/s²\].
    pub qdd: Joints<f64, N>,
}

impl<const N: usize> Default for Change<N> {
    fn default() -> Self {
        let (q, qd, qdd) = (Joints::zeros(), Joints::zeros(), Joints::zeros());
        Self { q, qd, qdd }
    }
}

impl<const N: usize> Change<N> {
    /// Angles and speeds at the end of a step \[s\] whose new accelerations are zero, and what one unit of these adds to the speeds \[s\].
    pub fn coast(&self, step: f64) -> (Joints<f64, N>, Joints<f64, N>, f64) {
        let (early, late) = (step * (1.0 - THETA), step * THETA);
        let speed = self.qd + self.qdd * early;
        (self.q + speed * late + self.qd * early, speed, late)
    }

    /// Solves a step \[s\].
    ///
    /// * `inverse` - of [`Slopes::of_step`], zero for joints that do not move
    /// * `push` - torque that is left over at the end of the step \[N m\]
    pub fn advance(
        &mut self,
        slopes: &Slopes<N>,
        inverse: &SMatrix<f64, N, N>,
        push: &Joints<f64, N>,
        step: f64,
    ) {
        let (early, late) = (step * (1.0 - THETA), step * THETA);
        let (angle, speed, _) = self.coast(step);
        let next = inverse * (push - slopes.damping * speed - slopes.stiffness * angle);
        let faster = speed + next * late;
        self.q += faster * late + self.qd * early;
        (self.qd, self.qdd) = (faster, next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A damped oscillator that is pushed from rest ends where its spring holds the push, and meets its own equation on the way.
    #[test]
    fn a_pushed_oscillator_comes_to_rest_where_its_spring_holds_the_push() {
        let (mass, damping, stiffness) = (0.5, 2.0, 8.0);
        let one = SMatrix::<f64, 1, 1>::repeat;
        let slopes = Slopes {
            mass: one(mass),
            damping: one(damping),
            stiffness: one(stiffness),
            force: [SMatrix::zeros(); 2],
        };
        let step = 0.01;
        let inverse = slopes.of_step(step).try_inverse().unwrap();
        let push = Joints::<f64, 1>::repeat(4.0);
        let mut change = Change::default();
        // The exact solution q = 0.5 (1 − e^(−2t) (cos(√12 t) + sin(√12 t) 2/√12)).
        let mut early = f64::NAN;
        for i in 1..=1200 {
            change.advance(&slopes, &inverse, &push, step);
            if i == 30 {
                early = change.q[0];
            }
        }
        let (t, w) = (0.3_f64, libm::sqrt(12.0));
        let decay = libm::exp(-2.0 * t);
        let exact = 0.5 * (1.0 - decay * (libm::cos(w * t) + 2.0 / w * libm::sin(w * t)));
        // Of first order beyond the middle of a step: 0.05 of a step of 10 ms.
        assert!((early - exact).abs() < 5e-3, "{early} {exact}");
        assert!((change.q[0] - 0.5).abs() < 1e-8);
    }
}
