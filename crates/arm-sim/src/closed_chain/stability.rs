//! Limits of the step: stability of the contact's vibration, and steep dry friction.

use arm_core::effect::Effect;
use arm_core::{Chain, Contact, Joints, Plane, Pose, Setup, inertia};
use nalgebra::SMatrix;

use crate::closed_chain::joint_space::JointSpaceEquation;
use crate::closed_chain::model::{Link, Model};
use crate::{Integrator, SimulationError};

/// The method of [`Integrator::Imex`]: time of the middle stage as a fraction of the step,
pub(crate) const MIDDLE: f64 = 1.0 - core::f64::consts::FRAC_1_SQRT_2;
/// and weight of the start in the explicit part.
pub(crate) const START: f64 = 1.0 - 0.5 / MIDDLE;

/// The fastest vibration of an arm on the springs and dampers of its contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vibration {
    /// Largest eigenfrequency ω of `B⁻¹ Jᵀ S J` \[rad/s\].
    pub frequency: f64,
    /// Largest eigenvalue c of `B⁻¹ Jᵀ D J` \[1/s\].
    pub damping: f64,
}

impl Vibration {
    /// Largest step for which the vibration does not grow \[s\].
    ///
    /// The limits hold for the mode `ẍ + c ẋ + ω² x = 0` with the largest c and the largest ω together, which is exact
    /// where damping and stiffness share their directions, and safe elsewhere:
    /// semi-implicit Euler `ω²h² + 2ch < 4`; Rk4 `|λ| h < 2.61`, the radius of its region of stability in the left half-plane. For Imex see [`Imex`].
    pub fn largest_step(&self, integrator: Integrator) -> f64 {
        let (w, c) = (self.frequency, self.damping);
        match integrator {
            Integrator::SemiImplicitEuler => 4.0 / (c + (c * c + 4.0 * w * w).sqrt()),
            Integrator::Rk4 => {
                let overdamped = (c * c - 4.0 * w * w).max(0.0).sqrt();
                RK4_RADIUS / w.max(0.5 * (c + overdamped))
            }
            Integrator::Imex => Imex {
                by_place: SMatrix::from_diagonal_element(w * w),
                by_speed: SMatrix::from_diagonal_element(c),
            }
            .largest_step(4.0 / w.max(c)),
        }
    }

    /// The vibration at a pose.
    pub(crate) fn at<const N: usize>(
        contact: &Contact<f64>,
        model: &Model<f64, N>,
        q: &Joints<f64, N>,
    ) -> Self {
        let terms = model.terms(&Pose::new(q), &Joints::zeros());
        // B⁻¹ Jᵀ S J has the eigenvalues of the 2×2 matrix J B⁻¹ Jᵀ S.
        let columns = yielding(&terms);
        let largest = |s: [f64; 2]| {
            let (a, d) = (columns[0][0] * s[0], columns[1][1] * s[1]);
            let bc = columns[0][1] * columns[1][0] * s[0] * s[1];
            let (mean, half) = (0.5 * (a + d), 0.5 * (a - d));
            mean + (half * half + bc).max(0.0).sqrt()
        };
        Self {
            frequency: largest(contact.stiffness).sqrt(),
            damping: largest(contact.damping),
        }
    }
}

/// Accelerations of the tip for one newton along each axis \[1/kg\].
fn yielding<const N: usize>(terms: &JointSpaceEquation<f64, N>) -> [Plane<f64>; 2] {
    let unit = [[1.0, 0.0], [0.0, 1.0]];
    unit.map(|f| terms.tip_rate(&terms.accelerate(&terms.tip_torque(f))))
}

/// A tip on its contact, as [`Integrator::Imex`] takes it: `ẍ = −by_place x − by_speed ẋ`, with explicit contact forces; the positions follow the implicit speeds of the stages.
struct Imex {
    by_place: SMatrix<f64, 2, 2>,
    by_speed: SMatrix<f64, 2, 2>,
}

impl Imex {
    fn at<const N: usize>(
        contact: &Contact<f64>,
        model: &Model<f64, N>,
        q: &Joints<f64, N>,
    ) -> Self {
        let columns = yielding(&model.terms(&Pose::new(q), &Joints::zeros()));
        let scaled = |by: [f64; 2]| SMatrix::from_fn(|row, axis| columns[axis][row] * by[axis]);
        Self {
            by_place: scaled(contact.stiffness),
            by_speed: scaled(contact.damping),
        }
    }

    /// Whether the spectral radius of the amplification matrix exceeds one, estimated from its 2²⁴-th power.
    fn grows(&self, h: f64) -> bool {
        /// Squarings, and growth in each step that is rounding.
        const SQUARINGS: u32 = 24;
        const ROUNDING: f64 = 1e-6;
        let [x, v] = self.step(
            h,
            [0, 2].map(|first| SMatrix::from_fn(|row, column| f64::from(first + row == column))),
        );
        let mut power = SMatrix::<f64, 4, 4>::from_fn(|row, column| {
            if row < 2 {
                x[(row, column)]
            } else {
                v[(row - 2, column)]
            }
        });
        let mut logarithm = 0.0;
        for _ in 0..SQUARINGS {
            let size = power.amax();
            if !(size > 0.0 && size.is_finite()) {
                return size != 0.0;
            }
            power /= size;
            logarithm = 2.0 * (logarithm + libm::log(size));
            power *= power;
        }
        logarithm + libm::log(power.amax()) > ROUNDING * f64::from(1_u32 << SQUARINGS)
    }

    /// What a step makes of places and speeds, one in each column.
    fn step(&self, h: f64, [x, v]: [SMatrix<f64, 2, 4>; 2]) -> [SMatrix<f64, 2, 4>; 2] {
        let pulled = |x: SMatrix<f64, 2, 4>, v| -(self.by_place * x) - self.by_speed * v;
        let reach = MIDDLE * h;
        let first = pulled(x, v);
        let middle = v + first * reach;
        let second = pulled(x + middle * reach, middle);
        let end = v + (first * START + second * (1.0 - START)) * h;
        [x + middle * (h - reach) + end * reach, end]
    }

    /// Largest step with which no vibration grows, up to one with which some does \[s\].
    fn largest_step(&self, too_long: f64) -> f64 {
        let (mut least, mut most) = (0.0, too_long);
        for _ in 0..50 {
            let middle = 0.5 * (least + most);
            if self.grows(middle) {
                most = middle;
            } else {
                least = middle;
            }
        }
        least
    }
}

/// Radius of the largest half disc in the left half plane in which the fourth-order method is stable: 2.6155, rounded down.
const RK4_RADIUS: f64 = 2.61;

/// Largest rate of decay that the fourth-order method follows, times the step: where its stability ends on the negative real axis.
const RK4_DECAY: f64 = 2.785;

/// Longest step with which the fourth-order method follows smooth dry friction at rest, the arm stretched \[s\].
///
/// There the slope `size/smoothing` of the friction makes the speed of its joint decay at the rate `(B⁻¹)_jj size/smoothing`. Infinite where
/// friction is not smooth, and where its size is a share of the force through the joint.
pub fn longest_step<const N: usize>(chain: &Chain<f64, N>, effect: &Effect<f64>) -> f64 {
    let Some(smoothing) = effect.kind.smoothed_by() else {
        return f64::INFINITY;
    };
    let p = &effect.parameters;
    if p[smoothing] <= 0.0 || effect.kind.info().parameters[0].unit != "N m" {
        return f64::INFINITY;
    }
    let agility = inertia(chain, &Pose::new(&Joints::zeros())).try_inverse();
    agility.map_or(f64::INFINITY, |m| {
        let rate = m[(effect.index, effect.index)] * p[0] / p[smoothing];
        RK4_DECAY / rate
    })
}

/// Longest step with which the fourth-order method keeps the vibration of an arm on a compliant contact from growing \[s\].
///
/// * `setup` - the rig
/// * `poses` - at which it is judged \[rad\]: a contact that is stiff in one direction is felt in some poses only
///
/// # Errors
/// [`SimulationError`] for a rig that cannot be simulated.
pub fn longest_step_on_contact<'a, const N: usize>(
    setup: &Setup<f64, N>,
    poses: impl IntoIterator<Item = &'a Joints<f64, N>>,
) -> Result<f64, SimulationError> {
    let contact = setup.contact;
    let model = Model::new(setup, Link::Compliant(contact), Vec::new())?;
    let steps = poses
        .into_iter()
        .map(|q| Vibration::at(&contact, &model, q).largest_step(Integrator::Rk4));
    Ok(steps.fold(f64::INFINITY, f64::min))
}

/// Refuses a contact that is too stiff for the step, judged at one pose.
///
/// Dry friction of joints is stiffer still near rest, but bounded, so that it cannot grow without limit; it is not judged.
pub(crate) fn check<const N: usize>(
    model: &Model<f64, N>,
    (integrator, dt): (Integrator, f64),
    q: &Joints<f64, N>,
) -> Result<(), SimulationError> {
    if integrator == Integrator::Imex && matches!(model.link, Link::Rigid) {
        return Err(SimulationError::Unsupported {
            engine: "native",
            what: "a rigid coupling with the integrator imex, allowed are rk4 and euler",
        });
    }
    let Link::Compliant(contact) = &model.link else {
        return Ok(());
    };
    let imex = (integrator == Integrator::Imex).then(|| Imex::at(contact, model, q));
    if imex.as_ref().is_some_and(|imex| !imex.grows(dt)) {
        return Ok(());
    }
    let vibration = Vibration::at(contact, model, q);
    let largest = imex.map_or_else(
        || vibration.largest_step(integrator),
        |imex| imex.largest_step(dt),
    );
    if dt <= largest {
        return Ok(());
    }
    Err(SimulationError::TooStiff {
        frequency: vibration.frequency,
        damping: vibration.damping,
        largest,
        dt,
    })
}
