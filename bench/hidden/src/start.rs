//! Where an arm rests when the handle stands still.

use crate::effect::{Acts, Instant, Loads};
use crate::rig::{Plane, Rig};

/// Joint angles near `q` at which no joint has a torque left, by Newton's method.
///
/// # Errors
/// In words, when there are none.
pub(crate) fn equilibrium(
    rig: &Rig,
    acting: &[Box<dyn Acts>],
    q: &[f64],
    (handle, grip_point): (Plane, Plane),
) -> Result<Vec<f64>, String> {
    let unbalanced = |q: &[f64]| unbalanced(rig, acting, q, handle, grip_point);
    let size = |r: &[f64]| r.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let mut q = q.to_vec();
    for _ in 0..200 {
        let r = unbalanced(&q);
        if size(&r) < 1e-9 {
            return Ok(q);
        }
        let slopes: Vec<Vec<f64>> = (0..q.len())
            .map(|j| {
                let mut ahead = q.clone();
                ahead[j] += 1e-6;
                let there = unbalanced(&ahead);
                r.iter().zip(there).map(|(a, b)| (b - a) / 1e-6).collect()
            })
            .collect();
        let way = solve(&slopes, &r).ok_or("the equilibrium at the start is singular")?;
        let longest = size(&way);
        let mut part = if longest > 0.2 { 0.2 / longest } else { 1.0 };
        loop {
            let tried: Vec<f64> = q.iter().zip(&way).map(|(q, w)| q - part * w).collect();
            if size(&unbalanced(&tried)) < size(&r) {
                q = tried;
                break;
            }
            part *= 0.5;
            if part < 1e-8 {
                return Err(format!(
                    "no equilibrium at the start: {:.1e} N m left",
                    size(&r)
                ));
            }
        }
    }
    Err("no equilibrium at the start".to_owned())
}

/// Torques that are left at rest: about each joint, of all that pulls on what lies beyond it \[N m\].
fn unbalanced(
    rig: &Rig,
    acting: &[Box<dyn Acts>],
    q: &[f64],
    handle: Plane,
    grip_point: Plane,
) -> Vec<f64> {
    let now = resting(rig, q);
    let mut loads = Loads::none(rig.size());
    for effect in acting {
        effect.act(&now, &mut loads);
    }
    let along = |i: usize, [x, y]: Plane| {
        let (sin, cos) = libm::sincos(now.angles[i]);
        let from = now.points[i];
        [from[0] + x * cos - y * sin, from[1] + x * sin + y * cos]
    };
    let hand = rig.size() - 1;
    let tip = along(hand, grip_point);
    let gap = [handle[0] - tip[0], handle[1] - tip[1]];
    let mut pulls = loads.pushes.clone();
    pulls.push((hand, tip, rig.contact.force_on_arm(gap, [0.0; 2])));
    for (i, link) in rig.links.iter().enumerate() {
        let weight = rig.gravity.map(|g| g * link.mass);
        pulls.push((i, along(i, [link.com, 0.0]), weight));
    }
    let weight = rig.gravity.map(|g| g * rig.hand_mass);
    pulls.push((hand, along(hand, [rig.links[hand].length, 0.0]), weight));
    let mut left: Vec<f64> = (0..rig.size())
        .map(|j| {
            let own = &rig.joints[j];
            let about = now.points[j];
            let beyond = pulls.iter().filter(|(link, ..)| *link >= j);
            let turned = beyond.fold(0.0, |sum, (_, at, f)| {
                sum + (at[0] - about[0]) * f[1] - (at[1] - about[1]) * f[0]
            });
            turned - loads.resist[j] - own.stiffness * (q[j] - own.rest)
        })
        .collect();
    // The guide of a base that moves does no work.
    let (_, per_angle) = rig.base_path.at(q[0]);
    for (_, _, force) in &pulls {
        left[0] += per_angle[0] * force[0] + per_angle[1] * force[1];
    }
    left
}

/// The arm at rest.
pub(crate) fn resting(rig: &Rig, q: &[f64]) -> Instant {
    let (points, angles) = rig.points(q);
    Instant {
        time: 0.0,
        q: q.to_vec(),
        qd: vec![0.0; q.len()],
        through: vec![0.0; q.len()],
        points,
        angles,
    }
}

/// Solves `Σ_j columns[j] x_j = r` by elimination with pivots.
fn solve(columns: &[Vec<f64>], r: &[f64]) -> Option<Vec<f64>> {
    let n = r.len();
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let mut row: Vec<f64> = columns.iter().map(|c| c[i]).collect();
            row.push(r[i]);
            row
        })
        .collect();
    for i in 0..n {
        let pivot = (i..n).max_by(|a, b| rows[*a][i].abs().total_cmp(&rows[*b][i].abs()))?;
        rows.swap(i, pivot);
        if rows[i][i].abs() < 1e-12 {
            return None;
        }
        for k in 0..n {
            if k != i {
                let factor = rows[k][i] / rows[i][i];
                for c in i..=n {
                    rows[k][c] -= factor * rows[i][c];
                }
            }
        }
    }
    Some((0..n).map(|i| rows[i][n] / rows[i][i]).collect())
}
