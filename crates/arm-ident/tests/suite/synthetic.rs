//! Trials made without the code under test: smooth trajectories with analytic derivatives, torques by the core's inverse dynamics.

use arm_core::effect::{Effect, Kind, MAX_STATES, Motion, resisting_torque};
use arm_core::{
    Chain, Contact, Joints, Plane, Pose, Segment, inverse_dynamics, jacobian, static_torque,
};
use arm_ident::regression::trial::{Model, Tolerance, Trial};

/// Angles, speeds and accelerations at a time.
pub type State<const N: usize> = [Joints<f64, N>; 3];

/// Sums of three sines around a pose, each joint with frequencies and phases of its own.
///
/// * `speed` - 1 gives about 1 rad/s and 0.1 … 0.7 Hz
pub fn sines<const N: usize>(
    centre: [f64; N],
    amplitude: f64,
    speed: f64,
) -> impl Fn(f64) -> State<N> {
    move |t| {
        let mut state = [Joints::<f64, N>::zeros(); 3];
        for j in 0..N {
            state[0][j] = centre[j];
            for k in 0..3 {
                let w = speed * (0.7 + 1.1 * k as f64 + 0.37 * j as f64);
                let phase = 1.3 * j as f64 + 0.9 * k as f64;
                let a = amplitude / (1.0 + k as f64);
                let (s, c) = (libm::sin(w * t + phase), libm::cos(w * t + phase));
                state[0][j] += a * s;
                state[1][j] += a * w * c;
                state[2][j] -= a * w * w * s;
            }
        }
        state
    }
}

/// How a trial is made.
#[derive(Clone, Copy)]
pub struct Recipe<const N: usize> {
    pub truth: Chain<f64, N>,
    pub rate: f64,
    pub duration: f64,
    /// Force on the arm at a time, beside the torques that the joints' motors then make up for; none for `None`.
    pub force: Option<fn(f64) -> Plane<f64>>,
    /// Inertia and speed-dependent torques are left out, as in a movement of no speed.
    pub quasi_static: bool,
}

impl<const N: usize> Recipe<N> {
    pub fn new(truth: Chain<f64, N>) -> Self {
        Self {
            truth,
            rate: 1000.0,
            duration: 12.0,
            force: None,
            quasi_static: false,
        }
    }

    /// A trial with torques (and forces where the recipe has some).
    pub fn torque_trial(
        &self,
        path: &impl Fn(f64) -> State<N>,
        effects: &[Effect<f64>],
    ) -> Trial<N> {
        let mut trial = self.empty();
        let mut torque = Vec::new();
        let mut forces = Vec::new();
        for i in 0..self.samples() {
            let t = i as f64 / self.rate;
            let q = path(t)[0];
            let force = self.force.map_or([0.0; 2], |f| f(t));
            trial.q.push(q);
            forces.push(force);
            torque.push(
                self.needed(path, effects, t)
                    - static_torque(&self.truth, &Pose::new(&q), force, 0.0),
            );
        }
        trial.torque = Some(torque);
        trial.force_on_arm = self.force.map(|_| forces);
        trial
    }

    /// Torque that the motion needs at a time.
    pub fn needed(
        &self,
        path: &impl Fn(f64) -> State<N>,
        effects: &[Effect<f64>],
        t: f64,
    ) -> Joints<f64, N> {
        let [q, qd, qdd] = path(t);
        let rest = Joints::<f64, N>::zeros();
        let (speed, acceleration) = if self.quasi_static {
            (rest, rest)
        } else {
            (qd, qdd)
        };
        let states = vec![[0.0; MAX_STATES]; effects.len()];
        inverse_dynamics(&self.truth, &Pose::new(&q), &speed, &acceleration)
            + resisting_torque(effects, &Motion::new(t, q, qd), &states)
    }

    pub fn samples(&self) -> usize {
        (self.duration * self.rate) as usize
    }

    pub fn empty(&self) -> Trial<N> {
        Trial {
            valid: vec![true; self.samples()],
            ..Trial::new(self.rate, Vec::new())
        }
    }
}

impl Recipe<2> {
    /// A trial led by a force at the tip alone: `F = J⁻ᵀ τ`. The arm must stay bent.
    pub fn force_trial(
        &self,
        path: &impl Fn(f64) -> State<2>,
        effects: &[Effect<f64>],
    ) -> Trial<2> {
        let mut trial = self.empty();
        let mut forces = Vec::new();
        for i in 0..self.samples() {
            let t = i as f64 / self.rate;
            trial.q.push(path(t)[0]);
            forces.push(self.force_at(path, effects, t));
        }
        trial.force_on_arm = Some(forces);
        trial
    }

    /// The force of that trial at any time.
    pub fn force_at(
        &self,
        path: &impl Fn(f64) -> State<2>,
        effects: &[Effect<f64>],
        t: f64,
    ) -> Plane<f64> {
        let torque = self.needed(path, effects, t);
        let inverse = jacobian(&self.truth, &Pose::new(&path(t)[0]))
            .transpose()
            .try_inverse()
            .expect("the arm is bent");
        let force = inverse * torque;
        [force[0], force[1]]
    }
}

pub fn effect(kind: &str, joint: usize, values: &[f64]) -> Effect<f64> {
    Effect::new(Kind::named(kind).expect("a kind of the catalogue"), joint).with(values)
}

/// The same kinds at every joint, with no value yet.
pub fn at_every_joint<const N: usize>(kinds: &[&str]) -> Vec<Effect<f64>> {
    let of = |kind: &&str| (0..N).map(|j| effect(kind, j, &[])).collect::<Vec<_>>();
    kinds.iter().flat_map(of).collect()
}

/// A model whose masses, centres of mass and inertias are off by these factors, joint by joint.
pub fn wrong<const N: usize>(
    truth: &Chain<f64, N>,
    factors: [[f64; 3]; N],
    uncertainty: f64,
) -> Model<N> {
    let segments: [Segment<f64>; N] = core::array::from_fn(|k| {
        let (s, [m, l, i]) = (truth.segments()[k], factors[k]);
        Segment {
            mass: s.mass * m,
            com: [s.com[0] * l, s.com[1]],
            inertia: s.inertia * i,
            ..s
        }
    });
    Model {
        chain: Chain::new(segments, truth.base(), truth.gravity()).expect("a valid arm"),
        segment_uncertainty: uncertainty,
        fitted: Vec::new(),
        held: Vec::new(),
        contact: Contact::new([1e4; 2], [25.0; 2]),
    }
}

pub const EXACT: Tolerance = Tolerance {
    angle_offset_deg: 0.0,
    force_bias: 0.0,
    force_gain: 0.0,
    time_delay: 0.0,
    handle_placement: 0.0,
};
