//! The state in which a run starts.

use arm_core::effect::Motion;
use arm_core::{Contact, Joints, Pose};

use crate::SimulationError;
use crate::model::{Input, Link, Model, State};

/// Largest torque left in an equilibrium, and largest gap of a rigid coupling \[N m, m\].
const BALANCED: f64 = 1e-9;
/// Newton steps after which a search is given up.
const ITERATIONS: usize = 100;

/// A given state, which a rigid coupling pulls onto its constraint.
pub(crate) fn given<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    (q, qd): (&Joints<f64, N>, &Joints<f64, N>),
) -> Result<(Joints<f64, N>, Joints<f64, N>), SimulationError> {
    for (name, values) in [("start angle", q), ("start speed", qd)] {
        for &found in values.iter() {
            if !found.is_finite() {
                let allowed = "a finite number";
                return Err(SimulationError::Setting {
                    name,
                    found,
                    allowed,
                });
            }
        }
    }
    let mut state = State {
        q: *q,
        qd: *qd,
        work: [0.0; 4],
    };
    if matches!(model.link, Link::Rigid) {
        model.project(input, &mut state, ITERATIONS);
        let [y, z] = gap(model, input, &state.q);
        let gap = libm::hypot(y, z);
        // Not a number counts as apart.
        if !matches!(gap.partial_cmp(&BALANCED), Some(core::cmp::Ordering::Less)) {
            return Err(SimulationError::Gap { gap });
        }
    }
    Ok((state.q, state.qd))
}

/// The static equilibrium near given angles: `G + R = τ + Jᵀ F` at rest.
///
/// A contact with play pushes nowhere inside it, and a search that comes there finds no way out. Then the play is closed
/// first; the tip hangs back by the play on the side to which it is pulled.
pub(crate) fn equilibrium<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    near: &Joints<f64, N>,
) -> Result<Joints<f64, N>, SimulationError> {
    let found = balanced(model, input, near);
    let Link::Compliant(contact) = &model.link else {
        return found;
    };
    if found.is_ok() || contact.play == [0.0; 2] {
        return found;
    }
    let (play, tight) = (
        contact.play,
        Contact {
            play: [0.0; 2],
            ..*contact
        },
    );
    let mut closed = model.clone();
    closed.link = Link::Compliant(tight);
    let q = balanced(&closed, input, near)?;
    let stretch = gap(model, input, &q);
    let back = [0, 1].map(|axis| -play[axis].copysign(stretch[axis]));
    // The smallest change of the angles that moves the tip so.
    let terms = model.terms(&Pose::new(&q), &Joints::zeros());
    let [along_y, along_z] = [[1.0, 0.0], [0.0, 1.0]].map(|unit| terms.tip_torque(unit));
    let (yy, yz, zz) = (
        along_y.dot(&along_y),
        along_y.dot(&along_z),
        along_z.dot(&along_z),
    );
    let det = yy * zz - yz * yz;
    // One row of an arm that can move its tip along one line only.
    let [y, z] = if det > 1e-12 * yy * zz {
        [
            (zz * back[0] - yz * back[1]) / det,
            (yy * back[1] - yz * back[0]) / det,
        ]
    } else {
        back.map(|b| b / (yy + zz))
    };
    balanced(model, input, &(q + along_y * y + along_z * z))
}

/// The equilibrium by Newton's method with halved steps.
///
/// With a rigid coupling the force on the arm is unknown too, and the gap between handle and tip must vanish.
fn balanced<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    near: &Joints<f64, N>,
) -> Result<Joints<f64, N>, SimulationError> {
    let rigid = matches!(model.link, Link::Rigid);
    let mut x: Vec<f64> = near.iter().copied().collect();
    if rigid {
        x.extend([0.0; 2]);
    }
    let stiffest = match &model.link {
        Link::Compliant(contact) => contact.stiffness[0].max(contact.stiffness[1]),
        Link::Free | Link::Forced(_) | Link::Rigid => 0.0,
    };
    // A stiff contact turns the rounding of a position into a force.
    let enough = BALANCED + 1e-15 * stiffest;
    let residual = |x: &[f64]| imbalance(model, input, x);
    let size = |r: &[f64]| {
        r.iter()
            .fold(0.0, |m: f64, v| if v.abs() <= m { m } else { v.abs() })
    };
    let mut r = residual(&x);
    for iteration in 0..ITERATIONS {
        if size(&r) < enough {
            return Ok(Joints::from_fn(|i, _| x[i]));
        }
        let failed = SimulationError::NoEquilibrium {
            residual: size(&r),
            iterations: iteration,
        };
        let Some(step) = newton_step(&residual, &x, &r) else {
            return Err(failed);
        };
        let mut fraction = 1.0;
        loop {
            let tried: Vec<f64> = x.iter().zip(&step).map(|(x, s)| x - fraction * s).collect();
            let left = residual(&tried);
            if size(&left) < size(&r) {
                (x, r) = (tried, left);
                break;
            }
            fraction *= 0.5;
            if fraction < 1e-6 {
                return Err(failed);
            }
        }
    }
    Err(SimulationError::NoEquilibrium {
        residual: size(&r),
        iterations: ITERATIONS,
    })
}

/// Left-hand side less right-hand side at rest; for a rigid coupling the last two of `x` are the force on the arm.
fn imbalance<const N: usize>(model: &Model<f64, N>, input: &Input<f64, N>, x: &[f64]) -> Vec<f64> {
    let q = Joints::<f64, N>::from_fn(|i, _| x[i]);
    let rest = Joints::<f64, N>::zeros();
    let pose = Pose::new(&q);
    let memory = vec![0.0; model.effects.len()];
    let resisting = model.resisting(&Motion::new(0.0, q, rest), &memory);
    let force = match (&model.link, x.get(N..)) {
        (Link::Compliant(contact), _) => contact.force_on_arm(gap(model, input, &q), [0.0; 2]),
        (Link::Forced(force), _) => *force,
        (Link::Rigid, Some(&[y, z])) => [y, z],
        _ => [0.0; 2],
    };
    let terms = model.terms(&pose, &rest);
    let held = terms.tip_torque(force);
    let mut r: Vec<f64> = (0..N)
        .map(|i| terms.bias[i] + resisting[i] - input.torque[i] - held[i])
        .collect();
    if matches!(model.link, Link::Rigid) {
        r.extend(gap(model, input, &q));
    }
    r
}

fn gap<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    q: &Joints<f64, N>,
) -> [f64; 2] {
    let at = model.tip(q, &Pose::new(q));
    let handle = input.handle.position;
    [handle[0] - at[0], handle[1] - at[1]]
}

/// Solution of `(∂r/∂x) s = r`, with central differences and Gaussian elimination; nothing where it is singular.
fn newton_step(residual: &impl Fn(&[f64]) -> Vec<f64>, x: &[f64], r: &[f64]) -> Option<Vec<f64>> {
    const SMALL: f64 = 1e-6;
    let n = x.len();
    let mut rows: Vec<Vec<f64>> = r
        .iter()
        .map(|r| [vec![0.0; n], vec![*r]].concat())
        .collect();
    for k in 0..n {
        let shifted = |by: f64| {
            let mut x = x.to_vec();
            x[k] += by;
            residual(&x)
        };
        let (more, less) = (shifted(SMALL), shifted(-SMALL));
        for (i, row) in rows.iter_mut().enumerate() {
            row[k] = (more[i] - less[i]) / (2.0 * SMALL);
        }
    }
    for k in 0..n {
        let largest = |a: &usize, b: &usize| rows[*a][k].abs().total_cmp(&rows[*b][k].abs());
        let pivot = (k..n).max_by(largest)?;
        rows.swap(k, pivot);
        let head = rows[k].clone();
        for row in rows.iter_mut().skip(k + 1) {
            let factor = row[k] / head[k];
            for (value, above) in row.iter_mut().zip(&head).skip(k) {
                *value -= factor * above;
            }
        }
    }
    let mut step = vec![0.0; n];
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|c| rows[k][c] * step[c]).sum();
        step[k] = (rows[k][n] - known) / rows[k][k];
    }
    step.iter().all(|s| s.is_finite()).then_some(step)
}
