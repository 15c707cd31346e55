//! Many side by side are each alone: every kernel in lanes has the bits of the same run in `f64`.

use arm_core::effect::{Effect, KINDS, Motion, States, resisting_torque};
use arm_core::{
    Chain, Contact, Joints, Lanes, Load, Pose, Reading, Scalar, Segment, Setup, forward_dynamics,
    inverse_dynamics,
};

use crate::common::Random;

/// Numbers of each lane, gathered.
fn wide<const L: usize>(one: impl Fn(usize) -> f64) -> Lanes<L> {
    Lanes(core::array::from_fn(one))
}
fn joints<const N: usize, const L: usize>(all: &[Joints<f64, N>; L]) -> Joints<Lanes<L>, N> {
    Joints::from_fn(|i, _| wide(|lane| all[lane][i]))
}
fn segments<const N: usize, const L: usize>(
    all: &[[Segment<f64>; N]; L],
) -> [Segment<Lanes<L>>; N] {
    core::array::from_fn(|i| Segment {
        length: wide(|lane| all[lane][i].length),
        mass: wide(|lane| all[lane][i].mass),
        com: core::array::from_fn(|axis| wide(|lane| all[lane][i].com[axis])),
        inertia: wide(|lane| all[lane][i].inertia),
    })
}
fn arms<const N: usize, const L: usize>(all: &[Chain<f64, N>; L]) -> Chain<Lanes<L>, N> {
    let pair = |of: fn(&Chain<f64, N>) -> [f64; 2]| {
        core::array::from_fn(|axis| wide(|lane| of(&all[lane])[axis]))
    };
    Chain::new(
        segments(&all.map(|a| *a.segments())),
        pair(Chain::base),
        pair(Chain::gravity),
    )
    .and_then(|c| {
        c.with_rotor_inertia(core::array::from_fn(|i| {
            wide(|lane| all[lane].rotor_inertia()[i])
        }))
    })
    .expect("each is valid")
}

fn same<const L: usize>(together: Lanes<L>, lane: usize, alone: f64) {
    assert_eq!(together.0[lane].to_bits(), alone.to_bits(), "lane {lane}");
}

fn functions<const L: usize>(seed: u64) {
    let mut random = Random(seed);
    for bound in [1.0, 2.5, 1e3, 1e5, 1e7] {
        for _ in 0..2000 {
            let x: [f64; L] = core::array::from_fn(|_| random.uniform(-bound, bound));
            let (sin, cos) = Lanes(x).sin_cos();
            for lane in 0..L {
                let (s, c) = Scalar::sin_cos(x[lane]);
                same(sin, lane, s);
                same(cos, lane, c);
                same(Lanes(x).exp(), lane, Scalar::exp(x[lane]));
                same(Lanes(x).tanh(), lane, Scalar::tanh(x[lane]));
            }
        }
    }
}

/// A single sine takes another branch in each quarter turn.
#[test]
fn quarter_turns_have_the_same_bits_in_lanes() {
    for half_quarter in -9..=9 {
        let turn = f64::from(half_quarter) * core::f64::consts::FRAC_PI_4;
        for x in [turn, turn.next_down(), turn.next_up(), -turn] {
            let (sin, cos) = Lanes([x; 4]).sin_cos();
            let (s, c) = Scalar::sin_cos(x);
            same(sin, 3, s);
            same(cos, 3, c);
        }
    }
}

fn dynamics<const N: usize, const L: usize>(seed: u64) {
    let mut random = Random(seed);
    for _ in 0..200 {
        let all: [Chain<f64, N>; L] = core::array::from_fn(|_| random.arm());
        let [q, qd, qdd]: [[Joints<f64, N>; L]; 3] =
            core::array::from_fn(|k| core::array::from_fn(|_| random.joints([4.0, 3.0, 10.0][k])));
        let forces: [[f64; 3]; L] =
            core::array::from_fn(|_| core::array::from_fn(|_| random.uniform(-20.0, 20.0)));
        let (arm, pose) = (arms(&all), Pose::new(&joints(&q)));
        let torque = inverse_dynamics(&arm, &pose, &joints(&qd), &joints(&qdd));
        let load = Load {
            torque,
            force_on_arm: [wide(|lane| forces[lane][0]), wide(|lane| forces[lane][1])],
            moment_on_arm: wide(|lane| forces[lane][2]),
        };
        let moved = forward_dynamics(&arm, &pose, &joints(&qd), &load);
        for lane in 0..L {
            let pose = Pose::new(&q[lane]);
            let torque_alone = inverse_dynamics(&all[lane], &pose, &qd[lane], &qdd[lane]);
            let load = Load {
                torque: torque_alone,
                force_on_arm: [forces[lane][0], forces[lane][1]],
                moment_on_arm: forces[lane][2],
            };
            let moved_alone = forward_dynamics(&all[lane], &pose, &qd[lane], &load);
            for i in 0..N {
                same(torque[i], lane, torque_alone[i]);
                same(moved[i], lane, moved_alone[i]);
            }
        }
    }
}

fn effects<const L: usize>(seed: u64) {
    let mut random = Random(seed);
    for &kind in KINDS {
        for _ in 0..50 {
            let all: [Effect<f64>; L] = core::array::from_fn(|_| random.effect(kind, 1));
            let motions: [Motion<f64, 3>; L] = core::array::from_fn(|_| random.motion());
            let memory: [States<f64>; L] = core::array::from_fn(|_| random.states());
            let effect = Effect {
                kind,
                index: 1,
                parameters: core::array::from_fn(|p| wide(|lane| all[lane].parameters[p])),
                on: true,
            };
            let motion = Motion {
                time: wide(|lane| motions[lane].time),
                q: joints(&motions.map(|m| m.q)),
                qd: joints(&motions.map(|m| m.qd)),
                qdd: joints(&motions.map(|m| m.qdd)),
                joint_force: core::array::from_fn(|i| wide(|lane| motions[lane].joint_force[i])),
                activity: core::array::from_fn(|i| wide(|lane| motions[lane].activity[i])),
            };
            let state = core::array::from_fn(|k| wide(|lane| memory[lane][k]));
            let torque = resisting_torque(&[effect], &motion, &[state]);
            let local = motion.local(1, state);
            let (gradient, rate) = (effect.gradient(&local), effect.memory_rate(&local));
            for lane in 0..L {
                let alone = resisting_torque(&[all[lane]], &motions[lane], &[memory[lane]]);
                let local = motions[lane].local(1, memory[lane]);
                for i in 0..3 {
                    same(torque[i], lane, alone[i]);
                }
                for (g, a) in gradient.iter().zip(all[lane].gradient(&local)) {
                    same(*g, lane, a);
                }
                for (r, a) in rate.iter().zip(all[lane].memory_rate(&local)) {
                    same(*r, lane, a);
                }
            }
            rig(&effect, &all, &mut random);
        }
    }
}

/// The rig and the readings of all lanes, in a fixed order.
fn numbers<T: Scalar>(rig: &Setup<T, 3>, reading: &Reading<T, 3>) -> Vec<T> {
    let mut all: Vec<T> = rig
        .segments
        .iter()
        .flat_map(|s| [s.length, s.mass, s.com[0], s.com[1], s.inertia])
        .collect();
    let contact = [rig.contact.stiffness, rig.contact.damping, rig.contact.play];
    let pairs = [
        rig.base,
        rig.gravity,
        rig.base_motion,
        rig.displaced.ripple.amplitude,
        rig.heave.amplitude,
        rig.displaced.slip,
        reading.force_on_arm,
    ];
    all.extend(contact.iter().chain(&pairs).flatten());
    all.extend(rig.rotor.iter().chain(reading.q.iter()));
    all.extend([
        rig.base_rest,
        rig.displaced.ripple.frequency,
        rig.displaced.ripple.phase,
        rig.heave.frequency,
        rig.heave.phase,
        rig.displaced.slip_start,
        rig.force_delay,
    ]);
    all.push(reading.moment_on_arm);
    all
}

fn rig<const L: usize>(effect: &Effect<Lanes<L>>, all: &[Effect<f64>; L], random: &mut Random) {
    let arms_alone: [Chain<f64, 3>; L] = core::array::from_fn(|_| random.arm());
    let read: [Joints<f64, 3>; L] = core::array::from_fn(|_| random.joints(20.0));
    let reading = |of: &dyn Fn(usize) -> Lanes<L>| Reading {
        time: of(0),
        q: joints(&read),
        force_on_arm: [of(1), of(2)],
        moment_on_arm: of(0),
    };
    let mut together = reading(&|i| wide(|lane| read[lane][i]));
    let contact = |k: f64| Contact::new([k, 2.0 * k], [25.0, 30.0]);
    let wide_contact = Contact::new(
        [Lanes::of(9e3), Lanes::of(18e3)],
        [Lanes::of(25.0), Lanes::of(30.0)],
    );
    let mut altered = Setup::new(&arms(&arms_alone), wide_contact);
    effect.alter(&mut altered);
    effect.distort(&mut together);
    let together = numbers(&altered, &together);
    for lane in 0..L {
        let mut alone = Setup::new(&arms_alone[lane], contact(9e3));
        let mut seen = Reading {
            time: read[lane][0],
            q: read[lane],
            force_on_arm: [read[lane][1], read[lane][2]],
            moment_on_arm: read[lane][0],
        };
        all[lane].alter(&mut alone);
        all[lane].distort(&mut seen);
        for (a, b) in together.iter().zip(numbers(&alone, &seen)) {
            same(*a, lane, b);
        }
    }
}

#[test]
fn transcendental_functions() {
    functions::<4>(101);
    functions::<8>(102);
}
#[test]
fn forward_and_inverse_dynamics() {
    dynamics::<1, 4>(103);
    dynamics::<2, 4>(104);
    dynamics::<3, 4>(105);
    dynamics::<2, 8>(106);
    dynamics::<3, 8>(107);
    dynamics::<5, 8>(108);
}
#[test]
fn every_effect() {
    effects::<4>(109);
    effects::<8>(110);
}
