//! The initial state of a run.

use arm_core::{Contact, Joints, Pose};

use crate::SimulationError;
use crate::closed_chain::model::{Link, Model};
use crate::closed_chain::state::{Input, State};
use crate::error::{NoRest, finite};
use crate::preparation::equilibrium::{Balance, MOST, Values};

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
            finite(name, found, "a finite number")?;
        }
    }
    let mut state = State {
        q: *q,
        qd: *qd,
        work: [0.0; 4],
    };
    if matches!(model.link, Link::Rigid) {
        model.project(input, &mut state, (ITERATIONS, &[false; N]));
        let [y, z] = gap(model, input, (&state.q, &Pose::new(&state.q)));
        let gap = libm::hypot(y, z);
        // Not a number counts as apart.
        if !matches!(gap.partial_cmp(&BALANCED), Some(core::cmp::Ordering::Less)) {
            return Err(SimulationError::Gap { gap });
        }
    }
    Ok((state.q, state.qd))
}

/// What dry friction does in a joint at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Friction {
    /// It resists nothing, as if the joint was shaken.
    Shaken,
    /// It holds the joint where that was given.
    Holds,
    /// It could not, and the joint slid, against all that it resists with, until it could: by the sign of the torque that pulled.
    Slides(f64),
}

/// The static equilibrium to which an arm comes from given angles: `G + R = τ + Jᵀ F` at rest, and stable.
///
/// Dry friction can hold a joint in a whole range of angles. What the handle leaves free, the last joints first, stays where it
/// was given if its friction can hold it there, and else slides until it can; the other joints come to rest as if shaken, where they
/// need no friction. Where that is nowhere, as few joints as possible are held by friction.
///
/// # Errors
/// [`SimulationError::NoEquilibrium`] where there is none within half a turn of each angle.
pub(crate) fn equilibrium<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    near: &Joints<f64, N>,
) -> Result<Joints<f64, N>, SimulationError> {
    let rest = nearest(model, input, near)?;
    let turned = |&j: &usize| (rest[j] - near[j]).abs() > core::f64::consts::PI;
    match (0..N).find(turned) {
        None => Ok(rest),
        Some(joint) => Err(NoRest::Far {
            joint,
            turned: rest[joint] - near[joint],
            rest: rest.iter().copied().collect(),
        }
        .into()),
    }
}

/// The equilibrium with as many joints held by dry friction as it can hold.
fn nearest<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    near: &Joints<f64, N>,
) -> Result<Joints<f64, N>, SimulationError> {
    let led = matches!(model.link, Link::Compliant(_) | Link::Rigid);
    let dry = (0..N).filter(|&j| model.dry[j]).count();
    let free = if led { N.saturating_sub(2) } else { N };
    for count in (1..=dry.min(free)).rev() {
        let mut friction = [Friction::Shaken; N];
        for joint in (0..N).rev().filter(|&j| model.dry[j]).take(count) {
            friction[joint] = Friction::Holds;
        }
        if let Some(q) = slid(model, input, near, friction) {
            return Ok(q);
        }
    }
    let angles = |x: Values| Joints::from_fn(|i, _| x[i]);
    let found = settled(model, input, (near, &[Friction::Shaken; N])).map(angles);
    if found.is_ok() {
        return found;
    }
    let mut choices: Vec<[Friction; N]> = (1..1_usize << N)
        .map(|code| {
            core::array::from_fn(|j| match code >> (N - 1 - j) & 1 {
                1 => Friction::Holds,
                _ => Friction::Shaken,
            })
        })
        .filter(|held: &[Friction; N]| (0..N).all(|j| model.dry[j] || held[j] == Friction::Shaken))
        .collect();
    choices.sort_by_key(|held| held.iter().filter(|&&h| h == Friction::Holds).count());
    for held in &choices {
        if let Ok(x) = settled(model, input, (near, held))
            && beyond_friction(model, input, (&x, held)).is_empty()
        {
            return Ok(angles(x));
        }
    }
    found
}

/// The equilibrium in which the joints that friction is to hold stay where they are, or slide until it holds them; `None` where there is
/// none, or where one slid against what pulled it.
fn slid<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    near: &Joints<f64, N>,
    mut friction: [Friction; N],
) -> Option<Joints<f64, N>> {
    loop {
        let x = settled(model, input, (near, &friction)).ok()?;
        let beyond = beyond_friction(model, input, (&x, &friction));
        if beyond.is_empty() {
            let along = |j: usize| match friction[j] {
                Friction::Slides(pull) => (x[j] - near[j]) * pull >= 0.0,
                _ => true,
            };
            return (0..N).all(along).then(|| Joints::from_fn(|i, _| x[i]));
        }
        for (joint, pull) in beyond {
            friction[joint] = Friction::Slides(pull);
        }
    }
}

/// Speeds with which an arm on a heaving base keeps its tip at the handle, with the least energy of motion; none where the base stands still.
pub(crate) fn following<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    q: &Joints<f64, N>,
) -> Joints<f64, N> {
    let led = matches!(model.link, Link::Compliant(_) | Link::Rigid);
    if !(model.heaves && led) || N < 2 {
        return Joints::zeros();
    }
    let terms = model.terms(&Pose::new(q), &Joints::zeros());
    let constraint = terms.constraint();
    constraint.response(constraint.force(input.handle.velocity))
}

/// The joints that friction is to hold and cannot, with the sign of the torque that pulls each.
fn beyond_friction<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    (x, friction): (&Values, &[Friction; N]),
) -> Vec<(usize, f64)> {
    if !friction.contains(&Friction::Holds) {
        return Vec::new();
    }
    let (most, left) = (most_friction(model, input, x), imbalance(model, input, x));
    (0..N)
        .filter(|&j| friction[j] == Friction::Holds && left[j].abs() > most[j])
        .map(|j| (j, -left[j].signum()))
        .collect()
}

/// What dry friction resists with at most in each joint \[N m\].
fn most_friction<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    x: &Values,
) -> [f64; N] {
    let (q, rest) = (Joints::from_fn(|i, _| x[i]), Joints::<f64, N>::zeros());
    let pose = Pose::new(&q);
    let force = force(model, input, (x, &q, &pose));
    let through = model.through_joints(&pose, (&rest, &rest), (force, input));
    let motion = input.motion(&q, &rest).with_joint_force(&through);
    model.dry_friction(&motion, &[])
}

/// The equilibrium of the joints that friction does not hold where they are given.
///
/// A contact with play pushes nowhere inside it, and a search that comes there finds no way out. Then the play is closed
/// first; the tip hangs back by the play on the side to which it is pulled.
fn settled<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    (near, friction): (&Joints<f64, N>, &[Friction; N]),
) -> Result<Values, SimulationError> {
    let found = balanced(model, input, (near, friction));
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
    let x = balanced(&closed, input, (near, friction))?;
    let q = Joints::<f64, N>::from_fn(|i, _| x[i]);
    let pose = Pose::new(&q);
    let stretch = gap(model, input, (&q, &pose));
    let back = [0, 1].map(|axis| -play[axis].copysign(stretch[axis]));
    // The smallest change of the angles that moves the tip so.
    let terms = model.terms(&pose, &Joints::zeros());
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
    balanced(model, input, (&(q + along_y * y + along_z * z), friction))
}

/// The equilibrium to which the joints come that are not held: the angles, and the force of a rigid coupling.
///
/// With a rigid coupling the force on the arm is unknown too, and the gap between handle and tip must vanish.
fn balanced<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    (near, friction): (&Joints<f64, N>, &[Friction; N]),
) -> Result<Values, SimulationError> {
    const { assert!(N + 2 <= MOST) };
    let held = &friction.map(|f| f == Friction::Holds);
    let mut start = [0.0; MOST];
    start[..N].copy_from_slice(near.as_slice());
    let stiffest = match &model.link {
        Link::Compliant(contact) => contact.stiffness[0].max(contact.stiffness[1]),
        Link::Free | Link::Forced(_) | Link::Rigid => 0.0,
    };
    let is_rigid = matches!(model.link, Link::Rigid);
    let slides = friction.iter().any(|f| matches!(f, Friction::Slides(_)));
    let residual = |x: &Values| {
        let mut r = imbalance(model, input, x);
        let most = match slides {
            true => most_friction(model, input, x),
            false => [0.0; N],
        };
        for joint in 0..N {
            match friction[joint] {
                Friction::Shaken => {}
                Friction::Holds => r[joint] = x[joint] - near[joint],
                Friction::Slides(pull) => r[joint] += pull * most[joint],
            }
        }
        r
    };
    // A torque counts by the angle that it turns a joint by, where that is more than 1 rad/(N m): an arm may be light.
    let unit = stiffness(&residual, &start, N).min(1.0);
    let size = |r: &[f64]| {
        let sizes = r.iter().enumerate().map(|(i, v)| {
            let torque = i < N && !held[i];
            if torque { v.abs() / unit } else { v.abs() }
        });
        sizes.fold(0.0, |m: f64, v| if v <= m { m } else { v })
    };
    let balance = Balance {
        residual,
        unknowns: if is_rigid { N + 2 } else { N },
        held,
        size: &size,
        // A stiff contact turns the rounding of a position into a force.
        enough: BALANCED + 1e-15 * stiffest / unit,
    };
    balance.settle(start)
}

/// Largest change of a torque with an angle \[N m/rad\]; 1 where none changes.
fn stiffness(residual: &impl Fn(&Values) -> Values, x: &Values, joints: usize) -> f64 {
    /// Step of the difference quotient \[rad\].
    const SMALL: f64 = 1e-6;
    let here = residual(x);
    let mut largest: f64 = 0.0;
    for k in 0..joints {
        let mut beside = *x;
        beside[k] += SMALL;
        for (there, here) in residual(&beside).iter().zip(&here).take(joints) {
            largest = largest.max((there - here).abs() / SMALL);
        }
    }
    if largest > 0.0 { largest } else { 1.0 }
}

/// Force on the arm at rest \[N\]; for a rigid coupling the unknowns behind the angles.
fn force<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    (x, q, pose): (&Values, &Joints<f64, N>, &Pose<f64, N>),
) -> [f64; 2] {
    match &model.link {
        Link::Compliant(contact) => contact.force_on_arm(gap(model, input, (q, pose)), [0.0; 2]),
        Link::Forced(force) => *force,
        Link::Rigid => [x[N], x[N + 1]],
        Link::Free => [0.0; 2],
    }
}

/// Left-hand side less right-hand side at rest; for a rigid coupling the unknowns behind the angles are the force on the arm.
fn imbalance<const N: usize>(model: &Model<f64, N>, input: &Input<f64, N>, x: &Values) -> Values {
    let q = Joints::<f64, N>::from_fn(|i, _| x[i]);
    let rest = Joints::<f64, N>::zeros();
    let pose = Pose::new(&q);
    let resisting = model.resisting(&input.motion(&q, &rest), &[]);
    let force = force(model, input, (x, &q, &pose));
    let given = model.bias_and_jacobian_at_rest(&pose);
    let held = given.tip_torque(force);
    let driving = model.driving(input, &pose);
    let mut r = [0.0; MOST];
    for i in 0..N {
        r[i] = given.bias[i] + resisting[i] - driving[i] - held[i];
    }
    if matches!(model.link, Link::Rigid) {
        [r[N], r[N + 1]] = gap(model, input, (&q, &pose));
    }
    r
}

fn gap<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    (q, pose): (&Joints<f64, N>, &Pose<f64, N>),
) -> [f64; 2] {
    let at = model.tip(q, pose);
    let handle = input.handle.position;
    [handle[0] - at[0], handle[1] - at[1]]
}
