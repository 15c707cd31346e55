//! One trial: the robot leads, the arm follows.

use crate::effect::{Acts, Hidden, Instant, Loads};
use crate::motion::{Lead, RATE, STEPS};
use crate::random::Random;
use crate::rig::{Plane, Rig};
use crate::start::{equilibrium, resting};
use crate::world::{Bodies, World};

/// What happened in a trial, at every `kept`th step.
#[derive(Clone, Debug, Default)]
pub struct Truth {
    /// Steps from one record to the next.
    pub kept: usize,
    /// Joint angles \[rad\].
    pub q: Vec<Vec<f64>>,
    /// Force on the arm \[N\].
    pub force_on_arm: Vec<Plane>,
    /// Joint angles of the robot \[rad\].
    pub robot: Vec<Plane>,
}

/// Steps from one record to the next at the usual rate: forces that are read late lie between samples.
pub const KEPT: usize = 4;
/// Records from one sample to the next at the usual rate.
pub const RECORDS: usize = (STEPS / RATE) as usize / KEPT;

/// What differs from trial to trial besides the movement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Where the hand holds the handle, beside the tip of the last segment: along it and across \[m\].
    pub in_hand: Plane,
    /// Where the handle is, beside where the robot's angles put it \[m\].
    pub in_room: Plane,
    /// The handle slips in the hand: when \[s\], and by how much along the last segment and across \[m\].
    pub slip: Option<(f64, Plane)>,
}

impl Grip {
    /// Where the model thinks it is.
    pub const NOMINAL: Self = Self {
        in_hand: [0.0; 2],
        in_room: [0.0; 2],
        slip: None,
    };

    /// Where the hand holds the handle at a time, beside the tip of the last segment \[m\].
    fn at(&self, time: f64) -> Plane {
        let Some((start, by)) = self.slip else {
            return self.in_hand;
        };
        let s = ((time - start) / SLIP_TIME).clamp(0.0, 1.0);
        let part = s * s * (3.0 - 2.0 * s);
        core::array::from_fn(|k| self.in_hand[k] + part * by[k])
    }
}

/// How long a slip takes \[s\].
const SLIP_TIME: f64 = 0.1;

/// In which circumstances a trial is run.
#[derive(Clone, Copy, Debug)]
pub struct Conditions<'a> {
    /// Its number.
    pub trial: usize,
    /// How the handle is held.
    pub grip: &'a Grip,
    /// Joint angles from which the equilibrium at the start is sought \[rad\].
    pub near: &'a [f64],
    /// Damping of dry friction where it sticks \[N m s/rad\].
    pub friction_grip: f64,
    /// Steps from one record to the next.
    pub kept: usize,
}

/// Runs a trial.
///
/// * `rig` - the true one, with the hidden effects applied to it
///
/// # Errors
/// In words, when it has no start or does not stay finite.
pub fn run(
    rig: &Rig,
    hidden: &[Hidden],
    lead: &Lead,
    conditions: &Conditions,
    random: &mut Random,
) -> Result<Truth, String> {
    let step = 1.0 / STEPS;
    let Conditions { trial, grip, .. } = *conditions;
    let mut acting: Vec<_> = hidden
        .iter()
        .filter_map(|effect| effect.acting(rig, trial, random))
        .collect();
    let handle = gripped(hidden, lead, grip);
    let hand = rig.size() - 1;
    let held_at = |time: f64| {
        let [x, y] = grip.at(time);
        [rig.links[hand].length + x, y]
    };
    let grip_point = held_at(0.0);
    let q = equilibrium(rig, &acting, conditions.near, (handle[0], grip_point))?;
    let dry = rubs(&acting, &resting(rig, &q));
    let mut world = World::new(rig, &q, step, (dry, conditions.friction_grip));
    let mut bodies = world.read();
    let (weights, held) = at_rest(rig, &acting, &q, (handle[0], grip_point));
    world.note(&bodies, &bodies.clone(), &weights, held);
    let (mut speed_before, mut tip_before) = (bodies.qd.clone(), None);
    let mut truth = Truth {
        kept: conditions.kept,
        ..Truth::default()
    };
    for n in 0..handle.len() {
        let now = instant(
            rig,
            (&bodies, &speed_before),
            &world.reaction,
            n as f64 * step,
        );
        let grip_point = held_at(now.time);
        let (tip, velocity) = grip_motion(rig, &now, grip_point, &mut tip_before, step);
        let lead_velocity = Lead::velocity(&handle, n);
        let rate = gap(&lead_velocity, &velocity);
        let force = rig.contact.force_on_arm(gap(&handle[n], &tip), rate);
        if n % conditions.kept == 0 {
            truth.q.push(now.q.clone());
            truth.force_on_arm.push(force);
            truth.robot.push(lead.robot[n]);
        }
        let loads = loads(rig, &acting, &now, world.reaction[0]);
        world
            .step(&bodies, &loads, (force, grip_point))
            .map_err(|joint| format!("joint {} left the world at {:.2} s", joint + 1, now.time))?;
        for effect in &mut acting {
            effect.advance(&now, step);
        }
        let after = world.read();
        world.note(&bodies, &after, &loads, force);
        speed_before = core::mem::replace(&mut bodies, after).qd;
    }
    match truth.q.iter().flatten().all(|q| q.abs() < 10.0) {
        true => Ok(truth),
        false => Err("the arm spun".to_owned()),
    }
}

/// Where the handle is that leads the arm \[m\], beside where the robot's angles say.
fn gripped(hidden: &[Hidden], lead: &Lead, grip: &Grip) -> Vec<Plane> {
    let step = 1.0 / STEPS;
    let displaced = lead.handle.iter().enumerate().map(|(n, at)| {
        let mut at = [at[0] + grip.in_room[0], at[1] + grip.in_room[1]];
        for effect in hidden {
            let [y, z] = effect.ripple(n as f64 * step);
            at = [at[0] + y, at[1] + z];
        }
        at
    });
    displaced.collect()
}

/// What effects do in equilibrium, and the force of the contact there: what the hinges carry at rest.
fn at_rest(
    rig: &Rig,
    acting: &[Box<dyn Acts>],
    q: &[f64],
    (handle, grip_point): (Plane, Plane),
) -> (Loads, Plane) {
    let rest = resting(rig, q);
    let mut weights = Loads::none(rig.size());
    for effect in acting {
        effect.act(&rest, &mut weights);
    }
    let stretch = gap(&handle, &grip_point_at(rig, &rest, grip_point));
    (weights, rig.contact.force_on_arm(stretch, [0.0; 2]))
}

/// What is known of the arm now. Speeds are known half a step before; forces need them now.
fn instant(
    rig: &Rig,
    (bodies, speed_before): (&Bodies, &[f64]),
    reaction: &[Plane],
    time: f64,
) -> Instant {
    let ahead = |k: usize| bodies.qd[k] + 0.5 * (bodies.qd[k] - speed_before[k]);
    let (points, angles) = rig.points(&bodies.q);
    Instant {
        time,
        q: bodies.q.clone(),
        qd: (0..rig.size()).map(ahead).collect(),
        through: reaction
            .iter()
            .map(|[y, z]| (y * y + z * z).sqrt())
            .collect(),
        points,
        angles,
    }
}

/// What loads the arm now.
///
/// The guide of a base that moves does no work: what the base does to the arm turns the first joint.
fn loads(rig: &Rig, acting: &[Box<dyn Acts>], now: &Instant, at_base: Plane) -> Loads {
    let mut loads = passive(rig, now);
    for effect in acting {
        effect.act(now, &mut loads);
    }
    let (_, per_angle) = rig.base_path.at(now.q[0]);
    let [y, z] = at_base;
    loads.resist[0] += per_angle[0] * y + per_angle[1] * z;
    loads
}

/// Whether any effect is dry friction.
fn rubs(acting: &[Box<dyn Acts>], rest: &Instant) -> bool {
    let mut loads = Loads::none(rest.q.len());
    let moving = Instant {
        qd: vec![0.05; rest.q.len()],
        through: vec![1.0; rest.q.len()],
        ..rest.clone()
    };
    let everywhere = [-3.0, 3.0].map(|q| Instant {
        q: vec![q; rest.q.len()],
        ..moving.clone()
    });
    for place in everywhere.iter().chain([&moving]) {
        for effect in acting {
            effect.act(place, &mut loads);
        }
    }
    loads.dry.iter().flatten().any(|torque| *torque > 0.0)
}

/// What the joints do by themselves.
fn passive(rig: &Rig, now: &Instant) -> Loads {
    let mut loads = Loads::none(rig.size());
    for (j, joint) in rig.joints.iter().enumerate() {
        loads.resist[j] = joint.stiffness * (now.q[j] - joint.rest) + joint.viscosity * now.qd[j];
    }
    loads
}

/// Place and velocity of the point at which the hand holds the handle; the velocity now, from the last three places.
fn grip_motion(
    rig: &Rig,
    now: &Instant,
    grip_point: Plane,
    before: &mut Option<[Plane; 2]>,
    step: f64,
) -> (Plane, Plane) {
    let at = grip_point_at(rig, now, grip_point);
    let [last, last_but_one] = before.unwrap_or([at, at]);
    *before = Some([at, last]);
    let velocity =
        core::array::from_fn(|k| (1.5 * at[k] - 2.0 * last[k] + 0.5 * last_but_one[k]) / step);
    (at, velocity)
}

/// Where a point of the last segment is (along it and across, \[m\]).
fn grip_point_at(rig: &Rig, now: &Instant, [x, y]: Plane) -> Plane {
    let hand = rig.size() - 1;
    let (sin, cos) = libm::sincos(now.angles[hand]);
    let from = now.points[hand];
    [from[0] + x * cos - y * sin, from[1] + x * sin + y * cos]
}

/// What lies between two points, or moves between two velocities.
fn gap(there: &Plane, here: &Plane) -> Plane {
    [there[0] - here[0], there[1] - here[1]]
}
