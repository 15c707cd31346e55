//! Another simulation of dry friction, to compare with: events located in an adaptive method, modes by trying them all, and
//! dynamics from the Jacobians of the centres of mass. It shares no code with the engines but the handle's path.

use core::array::from_fn;

use arm_core::{Contact, Segment};
use arm_sim::HandlePath;

/// A law of dry friction.
#[derive(Clone, Copy, Debug)]
pub enum Law {
    Coulomb(f64),
    /// Torque, speed.
    Stribeck(f64, f64),
    Load(f64),
    /// Friction, stiffness, rest, breakdown, recovery; its state has a place.
    Thixotropy([f64; 5]),
}

/// An arm led by a handle through springs and dampers, with viscosity, elasticity and dry friction in its joints.
pub struct Reference<const N: usize> {
    pub segments: [Segment<f64>; N],
    pub gravity: [f64; 2],
    pub contact: Contact<f64>,
    pub viscosity: [f64; N],
    /// Stiffness and rest angle.
    pub elasticity: [[f64; 2]; N],
    /// Joint and law.
    pub friction: Vec<(usize, Law)>,
    pub path: HandlePath<N>,
}

/// Angles, speeds, and the broken part of each thixotropy.
#[derive(Clone, Copy, Debug)]
pub struct Motion<const N: usize> {
    pub q: [f64; N],
    pub qd: [f64; N],
    pub broken: [f64; N],
}

/// What follows from a motion.
#[derive(Clone, Copy, Debug)]
pub struct Follows<const N: usize> {
    pub qdd: [f64; N],
    pub friction: [f64; N],
    pub most: [f64; N],
    pub force: [f64; 2],
}

/// 1 and −1 for a joint that slips that way, 0 for one that sticks.
type Modes<const N: usize> = [i8; N];

impl<const N: usize> Reference<N> {
    fn most(&self, at: &Motion<N>, through: &[f64; N]) -> [f64; N] {
        let mut most = [0.0; N];
        for &(joint, law) in &self.friction {
            most[joint] += match law {
                Law::Coulomb(torque) => torque,
                Law::Stribeck(torque, speed) => torque * libm::exp(-at.qd[joint].abs() / speed),
                Law::Load(radius) => radius * through[joint],
                Law::Thixotropy([friction, ..]) => friction * (1.0 - at.broken[joint]),
            };
        }
        most
    }

    fn smooth(&self, at: &Motion<N>) -> [f64; N] {
        let mut torque: [f64; N] = from_fn(|j| {
            let [stiffness, rest] = self.elasticity[j];
            self.viscosity[j] * at.qd[j] + stiffness * (at.q[j] - rest)
        });
        for &(joint, law) in &self.friction {
            if let Law::Thixotropy([_, stiffness, rest, ..]) = law {
                torque[joint] += (1.0 - at.broken[joint]) * stiffness * (at.q[joint] - rest);
            }
        }
        torque
    }

    /// What follows in given modes; nothing where friction that grows with the joint force has no solution.
    fn follow(&self, time: f64, at: &Motion<N>, modes: &Modes<N>) -> Option<Follows<N>> {
        let (mut angle, mut speed) = (0.0, 0.0);
        let (mut joint, mut rate, mut bend) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        let (mut origins, mut coms, mut bends) = ([[0.0; 2]; N], [[0.0; 2]; N], [[0.0; 2]; N]);
        for i in 0..N {
            angle += at.q[i];
            speed += at.qd[i];
            let (c, s) = (libm::cos(angle), libm::sin(angle));
            origins[i] = joint;
            let segment = &self.segments[i];
            coms[i] = [joint[0] + segment.com[0] * c, joint[1] + segment.com[0] * s];
            bends[i] = [
                bend[0] - speed * speed * segment.com[0] * c,
                bend[1] - speed * speed * segment.com[0] * s,
            ];
            joint = [joint[0] + segment.length * c, joint[1] + segment.length * s];
            rate = [
                rate[0] - speed * segment.length * s,
                rate[1] + speed * segment.length * c,
            ];
            bend = [
                bend[0] - speed * speed * segment.length * c,
                bend[1] - speed * speed * segment.length * s,
            ];
        }
        let turn = |point: [f64; 2], origin: [f64; 2]| [origin[1] - point[1], point[0] - origin[0]];
        let handle = self.path.at(time);
        let force: [f64; 2] = from_fn(|k| {
            self.contact.stiffness[k] * (handle.position[k] - joint[k])
                + self.contact.damping[k] * (handle.velocity[k] - rate[k])
        });
        let (mut inertia, mut torque) = ([[0.0; N]; N], self.smooth(at).map(|t| -t));
        for j in 0..N {
            let lever = turn(joint, origins[j]);
            torque[j] += lever[0] * force[0] + lever[1] * force[1];
            for i in j..N {
                let (segment, own) = (&self.segments[i], turn(coms[i], origins[j]));
                for k in 0..2 {
                    torque[j] -= segment.mass * own[k] * (bends[i][k] - self.gravity[k]);
                }
                for c in 0..=i {
                    let other = turn(coms[i], origins[c]);
                    inertia[j][c] +=
                        segment.mass * (own[0] * other[0] + own[1] * other[1]) + segment.inertia;
                }
            }
        }
        // With friction of the slipping joints given: accelerations, friction of the others, force through each joint.
        let under = |slips: &[f64; N]| {
            let mut rows = [[0.0; N]; N];
            let mut right = [0.0; N];
            for j in 0..N {
                right[j] = torque[j] - slips[j];
                for c in 0..N {
                    let sticks = modes[c] == 0 && self.has_friction(c);
                    rows[j][c] = match (sticks, j == c) {
                        (true, true) => 1.0,
                        (true, false) => 0.0,
                        (false, _) => inertia[j][c],
                    };
                }
            }
            let mut found = eliminate(rows, right);
            let mut friction = *slips;
            for j in 0..N {
                if modes[j] == 0 && self.has_friction(j) {
                    (friction[j], found[j]) = (found[j], 0.0);
                }
            }
            let mut through = [0.0; N];
            let mut sum = force.map(|f| -f);
            for i in (0..N).rev() {
                for k in 0..2 {
                    let moved: f64 = (0..=i)
                        .map(|j| turn(coms[i], origins[j])[k] * found[j])
                        .sum();
                    sum[k] += self.segments[i].mass * (bends[i][k] + moved - self.gravity[k]);
                }
                through[i] = libm::hypot(sum[0], sum[1]);
            }
            (found, friction, through)
        };
        let grows = self
            .friction
            .iter()
            .any(|(_, law)| matches!(law, Law::Load(_)));
        if !grows {
            let most = self.most(at, &[0.0; N]);
            let slips = from_fn(|j| f64::from(modes[j]) * most[j]);
            let (qdd, friction, _) = under(&slips);
            return Some(Follows {
                qdd,
                friction,
                most,
                force,
            });
        }
        // Newton's method with differences, from no friction.
        let missing = |slips: &[f64; N]| {
            let most = self.most(at, &under(slips).2);
            from_fn::<f64, N, _>(|j| f64::from(modes[j]) * most[j] - slips[j])
        };
        let mut slips = [0.0; N];
        for _ in 0..40 {
            let left = missing(&slips);
            if left.iter().all(|l| l.abs() < 1e-12) {
                break;
            }
            let mut rows = [[0.0; N]; N];
            for c in 0..N {
                let mut beside = slips;
                beside[c] += 1e-4;
                let moved = missing(&beside);
                for j in 0..N {
                    rows[j][c] = (left[j] - moved[j]) / 1e-4;
                }
            }
            let step = eliminate(rows, left);
            for j in 0..N {
                slips[j] += step[j];
            }
        }
        if !missing(&slips).iter().all(|l| l.abs() < 1e-9) {
            return None;
        }
        let (qdd, friction, through) = under(&slips);
        Some(Follows {
            qdd,
            friction,
            most: self.most(at, &through),
            force,
        })
    }

    fn has_friction(&self, joint: usize) -> bool {
        self.friction.iter().any(|(j, _)| *j == joint)
    }

    /// The modes that obey the law, by trying all; of several that do, the one that needs the least friction.
    pub fn modes(&self, time: f64, at: &Motion<N>) -> Option<(Modes<N>, Follows<N>)> {
        let mut best: Option<(Modes<N>, Follows<N>, f64)> = None;
        for code in 0..3_usize.pow(N as u32) {
            let modes: Modes<N> = from_fn(|j| (code / 3_usize.pow(j as u32) % 3) as i8 - 1);
            let possible = (0..N).all(|j| match (self.has_friction(j), at.qd[j]) {
                (false, _) => modes[j] == 0,
                (true, 0.0) => true,
                (true, v) => modes[j] == if v > 0.0 { 1 } else { -1 },
            });
            if !possible {
                continue;
            }
            let Some(f) = self.follow(time, at, &modes) else {
                continue;
            };
            let obeys = (0..N)
                .filter(|&j| self.has_friction(j) && at.qd[j] == 0.0)
                .all(|j| {
                    if modes[j] == 0 {
                        f.friction[j].abs() <= f.most[j] + 1e-10
                    } else {
                        f64::from(modes[j]) * f.qdd[j] >= -1e-9
                    }
                });
            let size = f.friction.iter().map(|t| t.abs()).sum::<f64>();
            if obeys && best.as_ref().is_none_or(|b| size < b.2) {
                best = Some((modes, f, size));
            }
        }
        best.map(|(modes, follows, _)| (modes, follows))
    }

    fn slope(&self, time: f64, at: &Motion<N>, modes: &Modes<N>) -> Option<Motion<N>> {
        let follows = self.follow(time, at, modes)?;
        let mut broken = [0.0; N];
        for &(joint, law) in &self.friction {
            if let Law::Thixotropy([.., breakdown, recovery]) = law {
                broken[joint] = (1.0 - at.broken[joint]) * at.qd[joint].abs() / breakdown
                    - at.broken[joint] / recovery;
            }
        }
        Some(Motion {
            q: at.qd,
            qd: follows.qdd,
            broken,
        })
    }

    /// One step of Dormand and Prince's method with its error estimate.
    fn step(
        &self,
        (time, h): (f64, f64),
        at: &Motion<N>,
        modes: &Modes<N>,
    ) -> Option<(Motion<N>, f64)> {
        const C: [f64; 7] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
        const A: [[f64; 6]; 7] = [
            [0.0; 6],
            [0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
            [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
            [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
            [
                19372.0 / 6561.0,
                -25360.0 / 2187.0,
                64448.0 / 6561.0,
                -212.0 / 729.0,
                0.0,
                0.0,
            ],
            [
                9017.0 / 3168.0,
                -355.0 / 33.0,
                46732.0 / 5247.0,
                49.0 / 176.0,
                -5103.0 / 18656.0,
                0.0,
            ],
            [
                35.0 / 384.0,
                0.0,
                500.0 / 1113.0,
                125.0 / 192.0,
                -2187.0 / 6784.0,
                11.0 / 84.0,
            ],
        ];
        const E: [f64; 7] = [
            71.0 / 57600.0,
            0.0,
            -71.0 / 16695.0,
            71.0 / 1920.0,
            -17253.0 / 339200.0,
            22.0 / 525.0,
            -1.0 / 40.0,
        ];
        let mut slopes: Vec<Motion<N>> = Vec::new();
        let mut there = *at;
        for stage in 0..7 {
            there = *at;
            for (slope, a) in slopes.iter().zip(A[stage]) {
                there = add(&there, h * a, slope);
            }
            slopes.push(self.slope(time + C[stage] * h, &there, modes)?);
        }
        let zero = Motion {
            q: [0.0; N],
            qd: [0.0; N],
            broken: [0.0; N],
        };
        let error = slopes
            .iter()
            .zip(E)
            .fold(zero, |sum, (s, e)| add(&sum, h * e, s));
        let size = |e: &f64, v: &f64| (e / (1e-10 + 1e-9 * v.abs())).abs();
        let worst = (error.q.iter().zip(&there.q))
            .chain(error.qd.iter().zip(&there.qd))
            .map(|(e, v)| size(e, v))
            .fold(0.0, f64::max);
        Some((there, worst))
    }

    /// How far the joint nearest to a switch is from it; below zero it is beyond.
    fn margin(&self, time: f64, at: &Motion<N>, modes: &Modes<N>) -> Option<f64> {
        let follows = self.follow(time, at, modes)?;
        let of = |j: usize| match modes[j] {
            0 => follows.most[j] + 1e-10 - follows.friction[j].abs(),
            way => f64::from(way) * at.qd[j] + 1e-12,
        };
        Some(
            (0..N)
                .filter(|&j| self.has_friction(j))
                .map(of)
                .fold(f64::INFINITY, f64::min),
        )
    }

    /// The motion at equal intervals; nothing where the law has no solution.
    pub fn run(
        &self,
        start: ([f64; N], [f64; N]),
        interval: f64,
        samples: usize,
    ) -> Option<Vec<(Motion<N>, Follows<N>)>> {
        let mut at = Motion {
            q: start.0,
            qd: start.1,
            broken: [0.0; N],
        };
        let (mut time, mut h): (f64, f64) = (0.0, 1e-5);
        let mut out = Vec::new();
        let (mut modes, follows) = self.modes(time, &at)?;
        out.push((at, follows));
        let mut work = 0;
        while out.len() <= samples {
            work += 1;
            if work > 200_000 {
                return None;
            }
            let end = out.len() as f64 * interval;
            let wanted = h.min(end - time);
            let (there, error) = self.step((time, wanted), &at, &modes)?;
            if error > 1.0 {
                h = wanted * (0.9 * libm::pow(error, -0.2)).max(0.2);
                continue;
            }
            let mut made = (there, wanted);
            let switches = self.margin(time + wanted, &there, &modes)? < 0.0;
            if switches {
                let (mut low, mut high) = (0.0, wanted);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    let (there, _) = self.step((time, middle), &at, &modes)?;
                    if self.margin(time + middle, &there, &modes)? < 0.0 {
                        high = middle;
                        made = (there, middle);
                    } else {
                        low = middle;
                    }
                }
            }
            at = made.0;
            let reached = !switches && wanted >= end - time;
            time = if reached { end } else { time + made.1 };
            for j in 0..N {
                let stops = self.has_friction(j) && f64::from(modes[j]) * at.qd[j] <= 1e-12;
                if stops && (modes[j] == 0 || switches) {
                    at.qd[j] = 0.0;
                }
            }
            if switches {
                modes = self.modes(time, &at)?.0;
                h = 1e-6;
            } else {
                h = wanted * (0.9 * libm::pow(error.max(1e-9), -0.2)).clamp(0.5, 4.0);
            }
            if reached {
                let (now, follows) = self.modes(time, &at)?;
                modes = now;
                out.push((at, follows));
            }
        }
        Some(out)
    }
}

fn add<const N: usize>(a: &Motion<N>, factor: f64, b: &Motion<N>) -> Motion<N> {
    let sum = |a: &[f64; N], b: &[f64; N]| from_fn(|j| a[j] + factor * b[j]);
    Motion {
        q: sum(&a.q, &b.q),
        qd: sum(&a.qd, &b.qd),
        broken: sum(&a.broken, &b.broken),
    }
}

/// Gaussian elimination with pivots.
fn eliminate<const N: usize>(mut rows: [[f64; N]; N], mut right: [f64; N]) -> [f64; N] {
    for k in 0..N {
        let pivot = (k..N)
            .max_by(|&a, &b| rows[a][k].abs().total_cmp(&rows[b][k].abs()))
            .unwrap_or(k);
        rows.swap(k, pivot);
        right.swap(k, pivot);
        for i in k + 1..N {
            let factor = rows[i][k] / rows[k][k];
            for c in k..N {
                rows[i][c] -= factor * rows[k][c];
            }
            right[i] -= factor * right[k];
        }
    }
    for k in (0..N).rev() {
        for c in k + 1..N {
            right[k] -= rows[k][c] * right[c];
        }
        right[k] /= rows[k][k];
    }
    right
}
