//! Dry friction at the end of a step of a linear equation of motion, a linear complementarity problem.
//!
//! It is solved by principal pivoting (Murty 1974; Moreau 1988 for the step).

use arm_core::Joints;
use nalgebra::SMatrix;

/// What the dry friction of a joint does at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// It holds the joint.
    Sticks,
    /// It resists with all that it can against this direction; a joint without friction goes any way.
    Slips(i8),
}

impl Mode {
    /// The mode of a joint that moves with a speed.
    pub fn of(speed: f64) -> Self {
        match speed {
            v if v > 0.0 => Self::Slips(1),
            v if v < 0.0 => Self::Slips(-1),
            _ => Self::Sticks,
        }
    }

    /// The direction against which it resists.
    pub fn way(self) -> f64 {
        match self {
            Self::Sticks => 0.0,
            Self::Slips(way) => f64::from(way),
        }
    }
}

/// An equation of motion that is linear in the accelerations.
pub(super) struct LinearStep<'a, const N: usize> {
    /// Torque per unit of acceleration.
    pub slope: &'a SMatrix<f64, N, N>,
    /// Torque that is missing, friction apart \[N m\].
    pub missing: Joints<f64, N>,
    /// Most that the friction of each joint resists with; none where it is zero \[N m\].
    pub friction: Joints<f64, N>,
    /// Speeds at the end of the step \[rad/s\].
    pub speed: Joints<f64, N>,
    /// Their change with the accelerations \[s\].
    pub reach: f64,
}

impl<const N: usize> LinearStep<'_, N> {
    /// The change of the accelerations at which friction obeys its law, and what the friction of each joint does then; `None` for a
    /// slope without an inverse.
    ///
    /// * `modes` - what is tried first
    pub fn solve(&self, mut modes: [Mode; N]) -> Option<(Joints<f64, N>, [Mode; N])> {
        /// Speed \[rad/s\] and torque \[N m\] that are rounding.
        const ROUNDING: (f64, f64) = (1e-12, 1e-10);
        for (j, mode) in modes.iter_mut().enumerate() {
            if self.friction[j] <= 0.0 {
                *mode = Mode::Slips(0);
            } else if *mode == Mode::Slips(0) {
                *mode = Mode::of(self.speed[j]);
            }
        }
        let mut change = self.with_modes(&modes)?;
        // As many exchanges as there are modes: with a slope that is a P-matrix it ends earlier.
        for _ in 0..3_usize.pow(N as u32) {
            let held = self.missing - self.slope * change;
            let exchanged = (0..N).find_map(|j| {
                let other = match modes[j] {
                    Mode::Slips(0) => return None,
                    Mode::Slips(_) => {
                        let speed = self.speed[j] + self.reach * change[j];
                        (modes[j].way() * speed < -ROUNDING.0).then_some(Mode::Sticks)
                    }
                    Mode::Sticks => {
                        (held[j].abs() > self.friction[j] + ROUNDING.1).then_some(Mode::of(held[j]))
                    }
                };
                other.map(|other| (j, other))
            });
            let Some((j, mode)) = exchanged else {
                break;
            };
            modes[j] = mode;
            change = self.with_modes(&modes)?;
        }
        Some((change, modes))
    }

    /// The change of the accelerations for given modes.
    fn with_modes(&self, modes: &[Mode; N]) -> Option<Joints<f64, N>> {
        let mut matrix = *self.slope;
        let mut right = self.missing;
        for j in 0..N {
            match modes[j] {
                Mode::Sticks => {
                    matrix.set_row(j, &SMatrix::<f64, 1, N>::zeros());
                    matrix[(j, j)] = 1.0;
                    right[j] = -self.speed[j] / self.reach;
                }
                slips => right[j] -= slips.way() * self.friction[j],
            }
        }
        matrix.try_inverse().map(|inverse| inverse * right)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every combination of torques, speeds and friction on a small grid obeys the law.
    #[test]
    fn friction_obeys_its_law_at_the_end_of_the_step() {
        let slope = SMatrix::<f64, 2, 2>::new(0.3, 0.08, 0.08, 0.05);
        let (reach, grid) = (0.005, [-0.4, -0.05, 0.0, 0.07, 0.3]);
        let mut seen = [0; 2];
        for a in grid {
            for b in grid {
                for friction in [[0.1, 0.1], [0.2, 0.0], [0.02, 0.3]] {
                    let step = LinearStep {
                        slope: &slope,
                        missing: [a, b].into(),
                        friction: friction.into(),
                        speed: [b * 0.01, -a * 0.01].into(),
                        reach,
                    };
                    let start = [Mode::of(-b), Mode::of(a)];
                    let (change, _) = step.solve(start).expect("a mass matrix has an inverse");
                    let torque = step.missing - slope * change;
                    let speed = step.speed + change * reach;
                    for j in 0..2 {
                        let slips = speed[j].abs() > 1e-11;
                        seen[usize::from(slips)] += 1;
                        assert!(torque[j].abs() <= friction[j] + 1e-9, "{torque} {speed}");
                        if slips {
                            let expected = friction[j] * speed[j].signum();
                            assert!((torque[j] - expected).abs() < 1e-9, "{torque} {speed}");
                        }
                    }
                }
            }
        }
        assert!(seen.iter().all(|&count| count > 20), "{seen:?}");
    }
}
