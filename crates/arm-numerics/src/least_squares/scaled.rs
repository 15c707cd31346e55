//! A [`Program`] in scaled variables, every constraint with a gradient of about unit length.

use crate::error::{NumericsError, check_finite};
use crate::least_squares::program::{Cone, Program};
use crate::linalg::matrix::{Matrix, add_scaled, dot, norm};

/// Where a linear constraint comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Origin {
    Lower(usize),
    Upper(usize),
    Inequality(usize),
    Equality,
}

/// `aᵀx̃ ≤ b` or `= b`.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    pub(crate) a: Vec<f64>,
    pub(crate) b: f64,
    pub(crate) origin: Origin,
}

/// The problem in `x̃`.
pub(crate) struct Scaled {
    /// `R S` divided by its largest element.
    pub(crate) r: Matrix,
    /// `z` divided by the same.
    pub(crate) z: Vec<f64>,
    pub(crate) equal: Vec<Row>,
    pub(crate) at_most: Vec<Row>,
    pub(crate) cones: Vec<Cone>,
}

impl Scaled {
    pub(crate) fn of(program: &Program) -> Result<Self, NumericsError> {
        let s = &program.scale;
        let p = s.len();
        let r = program.r.scaled_columns(s);
        let largest = if r.max_abs() > 0.0 { r.max_abs() } else { 1.0 };
        let r = r.scaled_columns(&vec![1.0 / largest; p]);
        let z: Vec<f64> = program.z.iter().map(|v| v / largest).collect();
        check_finite("scaled r", r.as_slice())?;
        check_finite("scaled z", &z)?;

        let unit = |i: usize, sign: f64| {
            (0..p)
                .map(|j| if j == i { sign } else { 0.0 })
                .collect::<Vec<f64>>()
        };
        let (mut equal, mut at_most) = (Vec::new(), Vec::new());
        for i in 0..p {
            let (lower, upper) = (program.lower[i] / s[i], program.upper[i] / s[i]);
            if program.lower[i] == program.upper[i] {
                equal.push(Row {
                    a: unit(i, 1.0),
                    b: lower,
                    origin: Origin::Equality,
                });
                continue;
            }
            // No row for a bound at infinity: huge numbers in its place stall the solver.
            if lower > f64::NEG_INFINITY {
                at_most.push(Row {
                    a: unit(i, -1.0),
                    b: -lower,
                    origin: Origin::Lower(i),
                });
            }
            if upper < f64::INFINITY {
                at_most.push(Row {
                    a: unit(i, 1.0),
                    b: upper,
                    origin: Origin::Upper(i),
                });
            }
        }
        equal.extend(
            program
                .equalities
                .iter()
                .map(|(a, b)| row(a, *b, s, Origin::Equality)),
        );
        at_most.extend(
            program
                .inequalities
                .iter()
                .enumerate()
                .map(|(i, (a, b))| row(a, *b, s, Origin::Inequality(i))),
        );
        for row in equal.iter().chain(&at_most) {
            check_finite("scaled constraint", &row.a)?;
            check_finite("scaled constraint", &[row.b])?;
        }
        let cones = program.cones.iter().map(|c| cone(c, s)).collect();
        Ok(Self {
            r,
            z,
            equal,
            at_most,
            cones,
        })
    }

    pub(crate) fn p(&self) -> usize {
        self.r.cols()
    }

    /// Gradients (one a column) and values of the equalities.
    pub(crate) fn equalities(&self) -> (Matrix, Vec<f64>) {
        let c = Matrix::from_fn(self.p(), self.equal.len(), |i, j| self.equal[j].a[i]);
        (c, self.equal.iter().map(|row| row.b).collect())
    }

    /// How far each linear inequality is from binding, relative to 1 and its value; negative if violated.
    pub(crate) fn row_slack(&self, x: &[f64]) -> Vec<f64> {
        self.at_most
            .iter()
            .map(|row| (row.b - dot(&row.a, x)) / (1.0 + row.b.abs()))
            .collect()
    }

    /// The same for each cone.
    pub(crate) fn cone_slack(&self, x: &[f64]) -> Vec<f64> {
        self.cones
            .iter()
            .map(|cone| {
                let (u, right) = sides(cone, x);
                (right - norm(&u)) / (1.0 + right.abs())
            })
            .collect()
    }

    /// Largest violation of an inequality or cone; 0 if there is none.
    pub(crate) fn worst_violation(&self, x: &[f64]) -> f64 {
        // `>` and not `max`: a NaN slack must not hide a violation; x is finite here.
        self.row_slack(x)
            .into_iter()
            .chain(self.cone_slack(x))
            .fold(
                0.0,
                |worst, slack| if -slack > worst { -slack } else { worst },
            )
    }

    /// What has less slack than `tolerance`.
    pub(crate) fn near(&self, x: &[f64], tolerance: f64) -> Active {
        let below = |slack: Vec<f64>| slack.into_iter().map(|s| s <= tolerance).collect();
        Active {
            rows: below(self.row_slack(x)),
            cones: below(self.cone_slack(x)),
        }
    }
}

/// `A x + b` and `cᵀx + d`.
pub(crate) fn sides(cone: &Cone, x: &[f64]) -> (Vec<f64>, f64) {
    let mut u = cone.a.times(x);
    add_scaled(&mut u, 1.0, &cone.b);
    (u, dot(&cone.c, x) + cone.d)
}

fn row(a: &[f64], b: f64, scale: &[f64], origin: Origin) -> Row {
    let a: Vec<f64> = a.iter().zip(scale).map(|(a, s)| a * s).collect();
    let length = norm(&a);
    let length = if length > 0.0 { length } else { 1.0 };
    Row {
        a: a.iter().map(|v| v / length).collect(),
        b: b / length,
        origin,
    }
}

fn cone(cone: &Cone, scale: &[f64]) -> Cone {
    let a = cone.a.scaled_columns(scale);
    let c: Vec<f64> = cone.c.iter().zip(scale).map(|(c, s)| c * s).collect();
    let largest = a
        .transpose()
        .column_norms()
        .into_iter()
        .fold(norm(&c), |m, v| if v > m { v } else { m });
    let unit = if largest > 0.0 { largest } else { 1.0 };
    Cone {
        a: a.scaled_columns(&vec![1.0 / unit; scale.len()]),
        b: cone.b.iter().map(|v| v / unit).collect(),
        c: c.iter().map(|v| v / unit).collect(),
        d: cone.d / unit,
    }
}

/// Which inequalities and cones bind.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Active {
    pub(crate) rows: Vec<bool>,
    pub(crate) cones: Vec<bool>,
}
