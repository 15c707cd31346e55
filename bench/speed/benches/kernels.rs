//! Time of one call of every kernel in a stream of independent states, for 2 and 3 joints, alone and in lanes.
//!
//! `cargo bench -p arm-core`, and with `RUSTFLAGS="-C target-cpu=native"` for the machine's widest vectors. Figures are
//! for one simulation: a call in lanes is divided by their number.

use core::hint::black_box;

use arm_core::effect::{Effect, KINDS, Kind, Motion, Place, resisting_torque};
use arm_core::{
    Chain, Contact, Elbow, Joints, Lanes, Limits, Load, Path, Plane, Pose, Robot, Scalar, Shape,
    contributions, coriolis, coriolis_matrix, forward_dynamics, gravity, inertia, inverse_dynamics,
    jacobian, joint_force, kinetic_energy, regressor, sample_arms, tip, tip_velocity,
};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};

/// Enough states that none is predicted, few enough to stay in the first cache.
const STATES: usize = 64;

#[derive(Clone, Copy)]
struct State<T, const N: usize> {
    q: Joints<T, N>,
    qd: Joints<T, N>,
    qdd: Joints<T, N>,
    load: Load<T, N>,
}

/// Distinct angles of a moving arm, distinct in every lane.
fn states<T: Scalar, const N: usize>() -> [State<T, N>; STATES] {
    let mut count = 0.0;
    let mut next = |size: f64| {
        count += 1.0;
        // A slope that no two lanes share.
        let lane = core::cell::Cell::new(0.0);
        T::of(size * Scalar::sin_cos(1.7 * count).0).map(|v| {
            lane.set(lane.get() + 0.01);
            v + lane.get()
        })
    };
    core::array::from_fn(|_| State {
        q: Joints::from_fn(|_, _| next(1.5)),
        qd: Joints::from_fn(|_, _| next(1.0)),
        qdd: Joints::from_fn(|_, _| next(3.0)),
        load: Load {
            torque: Joints::from_fn(|_, _| next(5.0)),
            force_on_arm: [next(20.0), next(20.0)],
            moment_on_arm: next(0.5),
        },
    })
}

/// One call on each state.
fn each<S, R>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    lanes: usize,
    states: &[S; STATES],
    call: impl Fn(&S) -> R,
) {
    group.throughput(Throughput::Elements((STATES * lanes) as u64));
    group.bench_function(name, |b| {
        b.iter(|| {
            for state in states {
                black_box(call(black_box(state)));
            }
        });
    });
}

fn kernels<T: Scalar, const N: usize>(
    criterion: &mut Criterion,
    name: &str,
    lanes: usize,
    arm: &Chain<f64, N>,
) {
    let arm = &arm.cast::<T>();
    let states = &states::<T, N>();
    let posed: &[(Pose<T, N>, State<T, N>); STATES] = &states.map(|s| (Pose::new(&s.q), s));
    let mut group = criterion.benchmark_group(name);
    let g = &mut group;
    each(g, "sin_cos", lanes, states, |s| s.q[0].sin_cos());
    each(g, "pose", lanes, states, |s| Pose::new(&s.q));
    each(g, "tip", lanes, posed, |(p, _)| tip(arm, p));
    each(g, "tip_velocity", lanes, posed, |(p, s)| {
        tip_velocity(arm, p, &s.qd)
    });
    each(g, "jacobian", lanes, posed, |(p, _)| jacobian(arm, p));
    each(g, "inertia", lanes, posed, |(p, _)| inertia(arm, p));
    each(g, "coriolis", lanes, posed, |(p, s)| {
        coriolis(arm, p, &s.qd)
    });
    each(g, "coriolis_matrix", lanes, posed, |(p, s)| {
        coriolis_matrix(arm, p, &s.qd)
    });
    each(g, "gravity", lanes, posed, |(p, _)| gravity(arm, p));
    each(g, "kinetic_energy", lanes, posed, |(p, s)| {
        kinetic_energy(arm, p, &s.qd)
    });
    each(g, "joint_force", lanes, posed, |(p, s)| {
        joint_force(arm, p, (&s.qd, &s.qdd), s.load.force_on_arm)
    });
    each(g, "regressor", lanes, posed, |(p, s)| {
        regressor(arm, p, &s.qd, &s.qdd)
    });
    each(g, "contributions", lanes, posed, |(p, s)| {
        contributions(arm, p, (&s.qd, &s.qdd), &s.load)
    });
    each(g, "inverse_dynamics", lanes, posed, |(p, s)| {
        inverse_dynamics(arm, p, &s.qd, &s.qdd)
    });
    each(g, "forward_dynamics", lanes, posed, |(p, s)| {
        forward_dynamics(arm, p, &s.qd, &s.load)
    });
    each(g, "pose + inverse_dynamics", lanes, states, |s| {
        inverse_dynamics(arm, &Pose::new(&s.q), &s.qd, &s.qdd)
    });
    each(g, "pose + forward_dynamics", lanes, states, |s| {
        forward_dynamics(arm, &Pose::new(&s.q), &s.qd, &s.load)
    });
    effects(g, lanes, states, arm);
    group.finish();
}

fn of<T: Scalar>(kind: Kind, joint: usize, values: &[f64]) -> Effect<T> {
    let mut effect = Effect::new(kind, joint);
    for (value, &given) in effect.parameters.iter_mut().zip(values) {
        *value = T::of(given);
    }
    effect
}

/// Resisting torques alone, and one whole right-hand side of the closed chain.
fn effects<T: Scalar, const N: usize>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    lanes: usize,
    states: &[State<T, N>; STATES],
    arm: &Chain<T, N>,
) {
    let typical: Vec<Effect<T>> = (0..N)
        .flat_map(|j| [of(Kind::Viscous, j, &[0.2]), of(Kind::Elastic, j, &[0.5])])
        .collect();
    let dry: Vec<Effect<T>> = (0..N).map(|j| of(Kind::Coulomb, j, &[0.1])).collect();
    let all: Vec<Effect<T>> = KINDS
        .iter()
        .filter(|k| k.info().place == Place::Joint)
        .flat_map(|&kind| (0..N).map(move |j| of(kind, j, &[0.5])))
        .collect();
    for (name, list) in [
        ("resisting_torque, viscous + elastic", &typical),
        ("resisting_torque, coulomb", &dry),
        ("resisting_torque, every kind", &all),
    ] {
        each(group, name, lanes, states, |s| {
            resisting_torque(list, &Motion::new(T::of(0.3), s.q, s.qd), &[])
        });
    }
    let contact = Contact::new([T::of(1e4); 2], [T::of(25.0); 2]);
    each(
        group,
        "closed chain, viscous + elastic",
        lanes,
        states,
        |s| {
            let pose = Pose::new(&s.q);
            let handle = s.load.force_on_arm;
            let [tip, velocity] = [tip(arm, &pose), tip_velocity(arm, &pose, &s.qd)];
            let gap = |a: Plane<T>, b: Plane<T>| [a[0] - b[0], a[1] - b[1]];
            let load = Load {
                torque: -resisting_torque(&typical, &Motion::new(T::of(0.3), s.q, s.qd), &[]),
                force_on_arm: contact.force_on_arm(gap(handle, tip), gap([T::ZERO; 2], velocity)),
                moment_on_arm: T::ZERO,
            };
            forward_dynamics(arm, &pose, &s.qd, &load)
        },
    );
}

fn arm_kernels(c: &mut Criterion) {
    let (two, three) = (sample_arms::mechanical_arm(), sample_arms::human_arm());
    kernels::<f64, 2>(c, "2 joints, f64", 1, &two);
    kernels::<f64, 3>(c, "3 joints, f64", 1, &three);
    kernels::<Lanes<4>, 2>(c, "2 joints, 4 lanes", 4, &two);
    kernels::<Lanes<4>, 3>(c, "3 joints, 4 lanes", 4, &three);
    kernels::<Lanes<8>, 2>(c, "2 joints, 8 lanes", 8, &two);
    kernels::<Lanes<8>, 3>(c, "3 joints, 8 lanes", 8, &three);
}

fn robot_and_trajectory(c: &mut Criterion) {
    let mut group = c.benchmark_group("robot and trajectory");
    let robot = Robot::new([0.45, 0.45], [1.05, -0.1], Elbow::Up).expect("valid");
    let states = &states::<f64, 2>().map(|s| {
        let [y, z] = [0.5 + 0.05 * s.q[0], 0.1 + 0.05 * s.q[1]];
        ([y, z], [s.qd[0], s.qd[1]], [s.qdd[0], s.qdd[1]])
    });
    each(&mut group, "angles", 1, states, |s| robot.angles(s.0));
    each(
        &mut group,
        "angles, speeds, accelerations",
        1,
        states,
        |s| {
            let q = robot.angles(s.0)?;
            let qd = robot.speeds(&q, s.1);
            Ok::<_, arm_core::Invalid>((qd, robot.accelerations(&q, &qd, s.2)))
        },
    );
    let limits = [Limits {
        speed: 0.3,
        acceleration: 1.2,
    }; 3];
    let waypoints =
        [[-1.2, 0.7, 0.0], [-1.0, 1.4, 0.1], [-1.2, 0.7, 0.0]].map(Joints::<f64, 3>::from);
    for shape in [Shape::Trapezoid, Shape::Smooth] {
        let path = Path::new(shape, &waypoints, limits, 0.0).expect("valid");
        each(&mut group, &format!("path, {shape:?}"), 1, states, |s| {
            path.at(3.0 + s.0[0])
        });
    }
    group.finish();
}

criterion_group!(benches, arm_kernels, robot_and_trajectory);
criterion_main!(benches);
