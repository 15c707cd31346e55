//! The closed forms of the thesis for three joints, with each misprint put right and shown to be one.

use arm_core::{
    Chain, JointMatrix, Joints, Pose, Segment, coriolis, coriolis_matrix, gravity, inertia,
    jacobian, sample_arms, static_torque,
};

use crate::common::Random;

/// Rounding of sums of a dozen terms of order one.
const ROUNDING: f64 = 1e-12;

/// Which equation is taken as printed.
#[derive(Clone, Copy, PartialEq)]
enum Misprint {
    None,
    /// Erratum 1: `l2²` for `l3²` in b11 of equation 3.4.
    Inertia,
    /// Erratum 2: `q1·q̇3` for `q̇1+q̇2+q̇3` in c13 and c23 of equation 3.6.
    Coriolis,
    /// Erratum 3: signs of the third row of Jᵀ in equation 3.10.
    Jacobian,
}

/// Symbols of the thesis.
struct Arm {
    a: [f64; 3],
    l: [f64; 3],
    m: [f64; 3],
    i: [f64; 3],
}

impl Arm {
    fn of(chain: &Chain<f64, 3>) -> Self {
        let s = chain.segments();
        Self {
            a: s.map(|s| s.length),
            l: s.map(|s| s.com[0]),
            m: s.map(|s| s.mass),
            i: s.map(|s| s.inertia),
        }
    }

    /// Equation 3.4.
    fn inertia(&self, q: &Joints<f64, 3>, misprint: Misprint) -> JointMatrix<f64, 3> {
        let ([a1, a2, _], [l1, l2, l3], [m1, m2, m3], [i1, i2, i3]) =
            (self.a, self.l, self.m, self.i);
        let (c2, c3, c23) = (libm::cos(q[1]), libm::cos(q[2]), libm::cos(q[1] + q[2]));
        let l = if misprint == Misprint::Inertia {
            l2
        } else {
            l3
        };
        let b11 = i1
            + i2
            + i3
            + l1 * l1 * m1
            + (a1 * a1 + l2 * l2) * m2
            + (a1 * a1 + a2 * a2 + l * l) * m3
            + 2.0 * a1 * (l2 * m2 + a2 * m3) * c2
            + 2.0 * l3 * m3 * (a2 * c3 + a1 * c23);
        let b12 = i2
            + i3
            + l2 * l2 * m2
            + (a2 * a2 + l3 * l3) * m3
            + a1 * (l2 * m2 + a2 * m3) * c2
            + 2.0 * a2 * l3 * m3 * c3
            + a1 * l3 * m3 * c23;
        let b13 = i3 + l3 * l3 * m3 + a2 * l3 * m3 * c3 + a1 * l3 * m3 * c23;
        let b22 = i2 + i3 + l2 * l2 * m2 + (a2 * a2 + l3 * l3) * m3 + 2.0 * a2 * l3 * m3 * c3;
        let b23 = i3 + l3 * l3 * m3 + a2 * l3 * m3 * c3;
        let b33 = i3 + l3 * l3 * m3;
        JointMatrix::<f64, 3>::new(b11, b12, b13, b12, b22, b23, b13, b23, b33)
    }

    /// Equation 3.6.
    fn coriolis(
        &self,
        q: &Joints<f64, 3>,
        qd: &Joints<f64, 3>,
        misprint: Misprint,
    ) -> JointMatrix<f64, 3> {
        let ([a1, a2, _], [_, l2, l3], [_, m2, m3]) = (self.a, self.l, self.m);
        let (s2, s3, s23) = (libm::sin(q[1]), libm::sin(q[2]), libm::sin(q[1] + q[2]));
        let last = if misprint == Misprint::Coriolis {
            q[0] * qd[2]
        } else {
            qd[0] + qd[1] + qd[2]
        };
        let near = a1 * ((l2 * m2 + a2 * m3) * s2 + l3 * m3 * s23);
        let far = l3 * m3 * (a2 * s3 + a1 * s23);
        let wrist = a2 * l3 * m3 * s3;
        JointMatrix::<f64, 3>::new(
            -(near * qd[1] + far * qd[2]),
            -near * (qd[0] + qd[1]) - far * qd[2],
            -far * last,
            near * qd[0] - wrist * qd[2],
            -wrist * qd[2],
            -wrist * last,
            far * qd[0] + wrist * qd[1],
            wrist * (qd[0] + qd[1]),
            0.0,
        )
    }

    /// Equation 3.8.
    fn gravity(&self, q: &Joints<f64, 3>) -> Joints<f64, 3> {
        let ([a1, a2, _], [l1, l2, l3], [m1, m2, m3]) = (self.a, self.l, self.m);
        let (c1, c12) = (libm::cos(q[0]), libm::cos(q[0] + q[1]));
        let third = l3 * m3 * libm::cos(q[0] + q[1] + q[2]);
        let second = (l2 * m2 + a2 * m3) * c12 + third;
        let first = (l1 * m1 + a1 * (m2 + m3)) * c1 + second;
        9.81 * Joints::<f64, 3>::new(first, second, third)
    }

    /// Equation 3.10 times `[F_y, F_z, M_x]`.
    fn end(
        &self,
        q: &Joints<f64, 3>,
        [fy, fz, mx]: [f64; 3],
        misprint: Misprint,
    ) -> Joints<f64, 3> {
        let [a1, a2, a3] = self.a;
        let angles = [q[0], q[0] + q[1], q[0] + q[1] + q[2]];
        let ([s1, s12, s123], [c1, c12, c123]) = (angles.map(libm::sin), angles.map(libm::cos));
        let sign = if misprint == Misprint::Jacobian {
            -1.0
        } else {
            1.0
        };
        Joints::<f64, 3>::new(
            (-a1 * s1 - a2 * s12 - a3 * s123) * fy + (a1 * c1 + a2 * c12 + a3 * c123) * fz + mx,
            (-a2 * s12 - a3 * s123) * fy + (a2 * c12 + a3 * c123) * fz + mx,
            sign * (-a3 * s123 * fy + a3 * c123 * fz) + mx,
        )
    }
}

fn degrees(q: [f64; 3]) -> Joints<f64, 3> {
    Joints::from(q) * (core::f64::consts::PI / 180.0)
}

fn random_arm(random: &mut Random) -> Chain<f64, 3> {
    let segments = core::array::from_fn(|_| {
        let length = random.uniform(0.1, 0.5);
        Segment {
            length,
            mass: random.uniform(0.3, 3.0),
            com: [random.uniform(0.1, 0.9) * length, 0.0],
            inertia: random.uniform(0.001, 0.02),
        }
    });
    Chain::new(segments, [0.0; 2], [0.0, -9.81]).expect("valid")
}

/// Largest deviations of B, C, G and JᵀF from the thesis' forms over random states.
fn deviations(misprint: Misprint) -> [f64; 4] {
    let mut random = Random(81);
    let mut largest = [0.0_f64; 4];
    for _ in 0..1000 {
        let chain = random_arm(&mut random);
        let arm = Arm::of(&chain);
        let (q, qd) = (random.joints(3.0), random.joints(2.0));
        let force = [
            random.uniform(-20.0, 20.0),
            random.uniform(-20.0, 20.0),
            0.5,
        ];
        let pose = Pose::new(&q);
        let b = inertia(&chain, &pose) - arm.inertia(&q, misprint);
        let c = coriolis_matrix(&chain, &pose, &qd) - arm.coriolis(&q, &qd, misprint);
        let g = gravity(&chain, &pose) - arm.gravity(&q);
        let end = static_torque(&chain, &pose, [force[0], force[1]], force[2])
            - arm.end(&q, force, misprint);
        let found = [b.amax(), c.amax(), g.amax(), end.amax()];
        for (sum, value) in largest.iter_mut().zip(found) {
            // Not a number stays.
            if !(value <= *sum || sum.is_nan()) {
                *sum = value;
            }
        }
    }
    largest
}

#[test]
fn corrected_equations_agree() {
    let found = deviations(Misprint::None);
    assert!(found.iter().all(|&d| d < ROUNDING), "{found:?}");
}

#[test]
fn printed_equations_fail_the_same_check() {
    for (misprint, place) in [
        (Misprint::Inertia, 0),
        (Misprint::Coriolis, 1),
        (Misprint::Jacobian, 3),
    ] {
        let found = deviations(misprint);
        for (i, &deviation) in found.iter().enumerate() {
            assert_eq!(deviation > 0.05, i == place, "{found:?}");
        }
    }
}

/// Erratum 1: 0.0061 kg m² or 1.05 % of b11 for the arm of table 4.10, too little to be seen with a loose tolerance.
#[test]
fn size_of_the_misprint_in_equation_3_4() {
    let chain = sample_arms::human_arm();
    let arm = Arm::of(&chain);
    let q = degrees([-40.0, 50.0, 10.0]);
    let right = inertia(&chain, &Pose::new(&q))[(0, 0)];
    let printed = arm.inertia(&q, Misprint::Inertia)[(0, 0)];
    assert!((printed - right - 0.753 * (0.121 * 0.121 - 0.081 * 0.081)).abs() < ROUNDING);
    assert!((printed - right - 0.0061).abs() < 5e-5);
    assert!(
        (0.009..0.012).contains(&((printed - right) / right)),
        "{}",
        (printed - right) / right
    );
}

/// Erratum 2: the torques of the worked example.
#[test]
fn size_of_the_misprint_in_equation_3_6() {
    let chain = sample_arms::human_arm();
    let arm = Arm::of(&chain);
    let (q, qd) = (
        degrees([-40.0, 50.0, 10.0]),
        Joints::<f64, 3>::new(0.2, 0.5, 0.3),
    );
    let right = coriolis(&chain, &Pose::new(&q), &qd);
    let printed = arm.coriolis(&q, &qd, Misprint::Coriolis) * qd;
    let is = |value: f64, expected: f64| (value - expected).abs() < 5e-5;
    assert!(
        is(right[0], -0.0568) && is(printed[0], -0.0496),
        "{right} {printed}"
    );
    assert!(
        is(right[1], 0.0027) && is(printed[1], 0.0037),
        "{right} {printed}"
    );
}

/// Erratum 3: −0.715 for +0.715 N m at F = (5, 10) N.
#[test]
fn size_of_the_misprint_in_equation_3_10() {
    let chain = sample_arms::human_arm();
    let arm = Arm::of(&chain);
    let q = degrees([-40.0, 50.0, 10.0]);
    let right = static_torque(&chain, &Pose::new(&q), [5.0, 10.0], 0.0);
    let printed = arm.end(&q, [5.0, 10.0, 0.0], Misprint::Jacobian);
    assert!((right[2] - 0.715).abs() < 5e-4 && (printed[2] + 0.715).abs() < 5e-4);
    assert_eq!(jacobian(&chain, &Pose::new(&q)).ncols(), 3);
}

/// The centrifugal terms come from off-diagonal entries of C (erratum 18): no diagonal entry gives a squared speed.
#[test]
fn diagonal_of_c_holds_no_squared_speed() {
    let chain = sample_arms::human_arm();
    let q = degrees([-40.0, 50.0, 10.0]);
    for k in 0..3 {
        let qd = Joints::from_fn(|i, _| if i == k { 1.0 } else { 0.0 });
        let c = coriolis_matrix(&chain, &Pose::new(&q), &qd);
        assert!((c[(k, k)] * qd[k]).abs() < ROUNDING);
    }
}
