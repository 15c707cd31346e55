//! Every joule is accounted for.

use arm_core::effect::{Effect, Kind};
use arm_core::{Chain, Joints, Limits, Pose, Shape, coriolis_matrix, sample_arms as arms};
use arm_sim::{
    Coupling, Drive, Experiment, HandlePath, Integrator, Movement, Recording, sample_experiments,
};

use crate::common::{most, run, several_effects, smooth};

/// Largest unexplained energy, and the work exchanged by all ways in the run \[J\].
fn unexplained<const N: usize>(recording: &Recording<N>) -> (f64, f64) {
    let error = most(recording.energy_error());
    let w = &recording.work;
    let columns = [&w.handle, &w.drive, &w.resisted, &w.damped];
    let exchanged = columns.map(|c| c.windows(2).map(|p| (p[1] - p[0]).abs()).sum::<f64>());
    (error, exchanged.iter().sum())
}

#[test]
fn rk4_accounts_for_energy_to_a_billionth_a_second() {
    let recording = run(&smooth(4.0));
    let (error, exchanged) = unexplained(&recording);
    println!("smooth: {error:e} of {exchanged} J");
    assert!(error < 1e-9 * 4.0 * exchanged, "{error:e} of {exchanged} J");
}

#[test]
fn rk4_accounts_for_energy_with_memory_friction_and_a_moving_base() {
    let mut experiment = smooth(4.0);
    experiment.effects = several_effects();
    let (error, exchanged) = unexplained(&run(&experiment));
    println!("several effects: {error:e} of {exchanged} J");
    assert!(error < 1e-8 * 4.0 * exchanged, "{error:e} of {exchanged} J");
}

#[test]
fn rk4_accounts_for_energy_on_a_path_with_jumps_of_acceleration() {
    let recording = run(&sample_experiments::human_experiment(4.0, [0.0; 3]).expect("a sample"));
    let (error, exchanged) = unexplained(&recording);
    println!("trapezoid: {error:e} of {exchanged} J");
    assert!(error < 1e-9 * 4.0 * exchanged, "{error:e} of {exchanged} J");
}

const DT: f64 = 0.25e-3;
const TWO: [[f64; 2]; 2] = [[-60.0, 60.0], [-48.0, 60.0]];
const THREE: [[f64; 3]; 2] = [[-68.0, 40.0, 0.0], [-56.0, 80.0, 5.0]];

/// An arm led there and back by limits of speed and acceleration: ramps end at no multiple of a step.
fn by_limits<const N: usize>(
    arm: Chain<f64, N>,
    degrees: [[f64; N]; 2],
    (shape, coupling): (Shape, Coupling),
) -> Experiment<N> {
    let mut experiment =
        sample_experiments::led(arm, shape, (degrees[0], degrees[1]), 1.0, [0.3; N])
            .expect("a sample");
    let [from, to] = degrees.map(|q| q.map(f64::to_radians).into());
    let limits = Limits {
        speed: 0.5,
        acceleration: 2.0,
    };
    let movement = Movement::within(shape, &[from, to, from], &[limits; N], 0.1).expect("limits");
    let coarse = 16.0 * DT;
    experiment.duration = (movement.duration() / coarse).ceil() * coarse;
    experiment.drive = Drive::Handle {
        path: HandlePath::of_arm(arm, movement),
        coupling,
    };
    experiment
}

/// Energy that nothing explains of what was exchanged, a second; with a contact of given damping.
fn share<const N: usize>(
    mut experiment: Experiment<N>,
    (integrator, dt, damping): (Integrator, f64, f64),
) -> f64 {
    (experiment.integrator, experiment.dt) = (integrator, dt);
    experiment.setup.contact.damping = [damping; 2];
    let (error, exchanged) = unexplained(&run(&experiment));
    error / (exchanged * experiment.duration)
}

/// [`share`] of two and three joints, led through the contact and rigidly.
fn shares(shape: Shape, settings: (Integrator, f64, f64)) -> [f64; 4] {
    let two = |by| {
        share(
            by_limits(arms::mechanical_arm(), TWO, (shape, by)),
            settings,
        )
    };
    let three = |by| share(by_limits(arms::human_arm(), THREE, (shape, by)), settings);
    let (soft, hard) = (Coupling::Compliant, Coupling::Rigid);
    [two(soft), three(soft), two(hard), three(hard)]
}

#[test]
fn rk4_accounts_for_energy_wherever_ramps_end() {
    for shape in [Shape::Trapezoid, Shape::Smooth] {
        for damping in [0.0, 25.0] {
            let found = shares(shape, (Integrator::Rk4, DT, damping));
            println!("{shape:?}, {damping} N s/m: {found:?}");
            assert!(found.iter().all(|&s| s < 5e-12), "{shape:?}: {found:?}");
        }
    }
}

/// At steps at which the error is above rounding: a rigidly led arm has no vibration and needs longer ones.
#[test]
fn rk4_accounts_for_energy_to_fourth_order_wherever_ramps_end() {
    for (shape, dt) in [(Shape::Trapezoid, DT), (Shape::Smooth, 4.0 * DT)] {
        let at = |dt| shares(shape, (Integrator::Rk4, dt, 25.0));
        let soft = [at(dt), at(0.5 * dt)];
        let hard = [at(16.0 * DT), at(8.0 * DT)];
        let orders = [(soft, 0), (soft, 1), (hard, 2), (hard, 3)]
            .map(|([whole, half], case)| libm::log2(whole[case] / half[case]));
        println!("{shape:?}: {orders:?}");
        assert!(
            orders.iter().all(|o| (3.7..4.5).contains(o)),
            "{shape:?}: {orders:?}"
        );
    }
}

#[test]
fn semi_implicit_euler_accounts_for_energy_to_first_order() {
    for shape in [Shape::Trapezoid, Shape::Smooth] {
        let [whole, half] =
            [DT, 0.5 * DT].map(|dt| shares(shape, (Integrator::SemiImplicitEuler, dt, 25.0)));
        println!("{shape:?}: {whole:?}");
        for (a, b) in whole.iter().zip(half) {
            let order = libm::log2(a / b);
            assert!((order - 1.0).abs() < 0.05, "{shape:?}: order {order}");
            assert!(*a < 1.5e-4, "{shape:?}: {a:e}");
        }
    }
}

/// The error of semi-implicit Euler is `h/2 · ( [P − q̇ᵀBq̈] + ∫ (2 ∂T/∂q + Q)·q̈ dt )` to first order, with the power P that
/// the energy gains and Q what acts besides its gradient: after a step the angles are ahead by h²q̈/2, the speeds behind by
/// that of their change, and the power at its start misses h²Ṗ/2.
#[test]
fn semi_implicit_euler_errs_by_its_first_order_term() {
    let arm = arms::human_arm();
    let mut experiment = by_limits(arm, THREE, (Shape::Smooth, Coupling::Compliant));
    experiment.integrator = Integrator::SemiImplicitEuler;
    let r = run(&experiment);
    let error = r.energy_error();
    let at = |column: &[f64], i: usize| Joints::<f64, 3>::from_fn(|j, _| column[3 * i + j]);
    let work = |i: usize| r.work.handle[i] - r.work.resisted[i];
    let (mut integral, mut largest, mut apart, mut first) = (0.0, 0.0, 0.0, 0.0);
    for i in 0..r.len() - 1 {
        let (q, qd, qdd) = (at(&r.q, i), at(&r.qd, i), at(&r.qdd, i));
        let boundary = (work(i + 1) - work(i)) / DT - qd.dot(&at(&r.torque.inertial, i));
        if i == 0 {
            first = boundary;
        }
        let predicted = 0.5 * DT * (boundary - first + integral);
        apart = most([apart, error[i] - predicted]);
        largest = most([largest, error[i]]);
        // ∂T/∂q = Cᵀ q̇.
        let turning = coriolis_matrix(&arm, &Pose::new(&q), &qd).transpose() * qd;
        integral += DT * (2.0 * turning - at(&r.torque.resisting, i)).dot(&qdd);
    }
    println!("{apart:e} of {largest:e} J");
    assert!(apart < 1e-3 * largest, "{apart:e} of {largest:e} J");
}

/// All torques of the equation of motion cancel at every sample, with a moving base too.
#[test]
fn the_torques_balance_at_every_sample() {
    let mut experiment = smooth(1.0);
    experiment.effects = several_effects();
    experiment
        .effects
        .push(Effect::new(Kind::Tremor, 2).with(&[0.1, 5.0]));
    let r = run(&experiment);
    let t = &r.torque;
    for i in 0..t.inertial.len() {
        let left = t.inertial[i]
            + t.centrifugal[i]
            + t.coriolis[i]
            + t.gravity[i]
            + t.frame[i]
            + t.resisting[i];
        let imbalance = left - t.drive[i] - t.contact[i];
        assert!(imbalance.abs() < 1e-9, "entry {i}: {imbalance:e} N m");
    }
}
