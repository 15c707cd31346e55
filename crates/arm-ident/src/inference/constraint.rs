//! Physical constraints of an arm, as bounds, inequalities and second-order cones over the unknowns.

use crate::error::IdentError;
use crate::regression::trial::Model;
use crate::regression::unknown::{Moment, Source, Unknown};
use arm_numerics::least_squares::factor::Factor;
use arm_numerics::least_squares::outcome::Outcome;
use arm_numerics::least_squares::program::{Cone, Program};
use arm_numerics::linalg::matrix::Matrix;

/// Positions of one segment's unknowns.
struct Place {
    mass: usize,
    along: usize,
    normal: Option<usize>,
    inertia: usize,
    length: f64,
}

fn places<const N: usize>(unknowns: &[Unknown], model: &Model<N>) -> Vec<Place> {
    let find = |k, moment| {
        unknowns
            .iter()
            .position(|u| u.source == Source::Segment(k, moment))
    };
    (0..N)
        .filter_map(|k| {
            Some(Place {
                mass: find(k, Moment::Mass)?,
                along: find(k, Moment::Along)?,
                normal: find(k, Moment::Normal),
                inertia: find(k, Moment::Inertia)?,
                length: model.chain.segments()[k].length,
            })
        })
        .collect()
}

/// The constrained problem: bounds of every unknown, the centre of mass within the segment, and for each segment the
/// planar pseudo-inertia `I m ≥ h_x² + h_y²` as `‖(2L h_x, 2L h_y, I − L² m)‖ ≤ I + L² m` (Wensing, Kim, Slotine 2018
/// reduced to the plane; L is the segment's length and only balances units).
///
/// Without any load the mean relative size of the base parameters is held at the model's.
///
/// # Errors
/// [`IdentError`] for a factor that is not finite.
pub fn program<const N: usize>(
    factor: &Factor,
    unknowns: &[Unknown],
    model: &Model<N>,
    scale_free: bool,
) -> Result<Program, IdentError> {
    let p = unknowns.len();
    let lower: Vec<f64> = unknowns.iter().map(|u| u.min).collect();
    let upper: Vec<f64> = unknowns.iter().map(|u| u.max).collect();
    let norms = factor.r.column_norms();
    let level = arm_numerics::linalg::matrix::norm(&factor.z).max(f64::MIN_POSITIVE.sqrt());
    let scale: Vec<f64> = unknowns
        .iter()
        .zip(&norms)
        .map(|(u, &n)| match (u.sd.is_finite(), n > 0.0) {
            (true, _) => u.sd,
            (false, true) => level / n,
            (false, false) => 1.0,
        })
        .collect();
    let mut program = Program::of(factor)?.scale(&scale)?.bounds(&lower, &upper)?;
    for s in places(unknowns, model) {
        program = program
            .at_most(&within_segment(p, &s), 0.0)?
            .cone(cone(p, &s))?;
    }
    if scale_free {
        let row = common_scale(unknowns, model);
        let value = row.iter().zip(unknowns).map(|(w, u)| w * u.mean).sum();
        program = program.equal(&row, value)?;
    }
    Ok(program)
}

/// `h_x − a m ≤ 0`.
fn within_segment(p: usize, s: &Place) -> Vec<f64> {
    let mut row = vec![0.0; p];
    row[s.along] = 1.0;
    row[s.mass] = -s.length;
    row
}

fn cone(p: usize, s: &Place) -> Cone {
    let square = s.length * s.length;
    let mut a = Matrix::zeros(3, p);
    a.column_mut(s.along)[0] = 2.0 * s.length;
    if let Some(normal) = s.normal {
        a.column_mut(normal)[1] = 2.0 * s.length;
    }
    a.column_mut(s.inertia)[2] = 1.0;
    a.column_mut(s.mass)[2] = -square;
    let mut c = vec![0.0; p];
    c[s.inertia] = 1.0;
    c[s.mass] = square;
    Cone {
        a,
        b: vec![0.0; 3],
        c,
        d: 0.0,
    }
}

/// Sum of all first and second moments of the links, each relative to the model's value.
pub fn common_scale<const N: usize>(unknowns: &[Unknown], model: &Model<N>) -> Vec<f64> {
    let mut row = vec![0.0; unknowns.len()];
    for (weights, value) in base_parameters(unknowns, model) {
        for (total, w) in row.iter_mut().zip(&weights) {
            *total += w / value;
        }
    }
    row
}

/// The base parameters `X_1 … X_N, J_1 … J_N` as linear functions of the unknowns, with the model's prior values.
///
/// Empty when the segments are held.
pub fn base_parameters<const N: usize>(
    unknowns: &[Unknown],
    model: &Model<N>,
) -> Vec<(Vec<f64>, f64)> {
    let segments = places(unknowns, model);
    if segments.len() < N {
        return Vec::new();
    }
    let mut list = Vec::with_capacity(2 * N);
    for second in [false, true] {
        for j in 0..N {
            let a = segments[j].length;
            let mut w = vec![0.0; unknowns.len()];
            w[if second {
                segments[j].inertia
            } else {
                segments[j].along
            }] = 1.0;
            for s in &segments[j + 1..] {
                w[s.mass] = if second { a * a } else { a };
            }
            let value = w.iter().zip(unknowns).map(|(w, u)| w * u.mean).sum();
            list.push((w, value));
        }
    }
    list
}

/// Gradients of the inequalities and cones that hold with equality.
pub fn binding_gradients<const N: usize>(
    outcome: &Outcome,
    unknowns: &[Unknown],
    model: &Model<N>,
) -> Vec<Vec<f64>> {
    let p = unknowns.len();
    let mut list = Vec::new();
    for (i, s) in places(unknowns, model).iter().enumerate() {
        if outcome.binding_inequalities.get(i) == Some(&true) {
            list.push(within_segment(p, s));
        }
        if outcome.binding_cones.get(i) == Some(&true) {
            let mut gradient = vec![0.0; p];
            gradient[s.mass] = -outcome.x[s.inertia];
            gradient[s.inertia] = -outcome.x[s.mass];
            gradient[s.along] = 2.0 * outcome.x[s.along];
            if let Some(normal) = s.normal {
                gradient[normal] = 2.0 * outcome.x[normal];
            }
            list.push(gradient);
        }
    }
    list
}
