//! Whitened rows of trials, condensed: repeats with the same samples share their columns.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::data::noise::dot;
use crate::data::prepared_session::PreparedSession;
use crate::data::valid_segments::ValidSegments;
use crate::measurement_model::prediction::Channels;
use crate::sensitivity::normal_equations::{Cluster, factor};
use crate::sensitivity::response::Response;

/// Parts of a trial that are predicted from each other where no movement is repeated.
pub const PARTS: usize = 5;

/// Fitted trials of one movement that are compared at the same samples.
#[derive(Clone)]
struct Class {
    /// The movement, or one part of a trial where no movement is repeated.
    group: usize,
    /// The movement in whose reference columns are computed.
    reference: usize,
    valid_segments: ValidSegments,
    /// Number of rows of one trial that tell anything.
    rows: usize,
    /// Positions in the list of fitted trials.
    members: Vec<usize>,
    /// Whitened columns: first those whose coefficients belong to each trial alone, then the common ones.
    columns: Vec<Vec<f64>>,
    /// Their products.
    products: DMatrix<f64>,
}

/// Whitened columns of the fitted trials.
#[derive(Default)]
pub struct Rows {
    classes: Vec<Class>,
    /// Standard deviations of what belongs to each trial alone.
    own: Vec<f64>,
}

impl Rows {
    /// Whitens the responses to what is always refitted.
    ///
    /// * `own` - responses to what differs from trial to trial
    pub fn new<const N: usize>(
        prepared: &PreparedSession<N>,
        responses: &[Response],
        own: &[Response],
    ) -> Self {
        let mut classes: Vec<Class> = Vec::new();
        for (m, &trial) in prepared.fitted.iter().enumerate() {
            let (group, valid_segments) =
                (prepared.group_of[trial], &prepared.valid_segments[trial]);
            if !prepared.repeated {
                // Parts of a trial stand in for the repeats that are not there.
                for part in valid_segments.parts(PARTS) {
                    classes.push(Class {
                        group: classes.len(),
                        reference: group,
                        rows: part
                            .rows_per_channel(prepared.session.channels())
                            .iter()
                            .sum(),
                        valid_segments: part,
                        members: vec![m],
                        columns: Vec::new(),
                        products: DMatrix::zeros(0, 0),
                    });
                }
                continue;
            }
            let known = classes
                .iter_mut()
                .find(|c| c.reference == group && c.valid_segments == *valid_segments);
            match known {
                Some(class) => class.members.push(m),
                None => classes.push(Class {
                    // What is broken off or disturbed has another score than its repeats, without any noise.
                    group: classes.len(),
                    reference: group,
                    rows: valid_segments
                        .rows_per_channel(prepared.session.channels())
                        .iter()
                        .sum(),
                    valid_segments: valid_segments.clone(),
                    members: vec![m],
                    columns: Vec::new(),
                    products: DMatrix::zeros(0, 0),
                }),
            }
        }
        let whitened = prepared.parallel(classes.len(), |i| {
            let class = &classes[i];
            let all = own.iter().chain(responses);
            let columns: Vec<Vec<f64>> = all.map(|r| class.whitened(prepared, r)).collect();
            let products = products(&columns, &columns, true);
            (columns, products)
        });
        for (class, (columns, products)) in classes.iter_mut().zip(whitened) {
            (class.columns, class.products) = (columns, products);
        }
        let sd = |c: crate::measurement_model::hypothesis::Coordinate| {
            c.prior.map_or(f64::INFINITY, |(_, sd)| sd)
        };
        Self {
            classes,
            own: prepared.session.by_trial().into_iter().map(sd).collect(),
        }
    }

    /// The same without some of the common columns.
    pub fn without(&self, columns: &[usize]) -> Self {
        let places: Vec<usize> = columns.iter().map(|c| self.own.len() + c).collect();
        let classes = self.classes.iter().map(|class| {
            let kept =
                |(i, column): (usize, &Vec<f64>)| (!places.contains(&i)).then(|| column.clone());
            let products = class.products.clone();
            Class {
                columns: class.columns.iter().enumerate().filter_map(kept).collect(),
                products: products.remove_columns_at(&places).remove_rows_at(&places),
                ..class.clone()
            }
        });
        Self {
            classes: classes.collect(),
            own: self.own.clone(),
        }
    }

    /// Condenses the fitted trials to normal equations, in their order.
    ///
    /// * `extra` - responses to further unknowns, behind those that are always refitted
    /// * `residuals` - of the fitted trials
    pub fn clusters<const N: usize>(
        &self,
        prepared: &PreparedSession<N>,
        extra: &[&Response],
        residuals: &[Channels],
    ) -> Vec<Cluster> {
        let condensed = prepared.parallel(self.classes.len(), |i| {
            let class = &self.classes[i];
            let more: Vec<Vec<f64>> = extra.iter().map(|r| class.whitened(prepared, r)).collect();
            let gram = bordered(class, &more);
            let residuals: Vec<Vec<f64>> = class
                .members
                .iter()
                .map(|&m| class.white(prepared, &residuals[m]))
                .collect();
            self.condense(class, (&class.columns, &more), gram, &residuals)
        });
        let mut all: Vec<(usize, Cluster)> = std::iter::zip(&self.classes, condensed)
            .flat_map(|(class, own)| class.members.iter().copied().zip(own))
            .collect();
        all.sort_by_key(|(m, _)| *m);
        all.into_iter().map(|(_, cluster)| cluster).collect()
    }

    /// Only the squares of residuals, with what belongs to each trial alone taken out.
    pub fn squares<const N: usize>(
        &self,
        prepared: &PreparedSession<N>,
        residuals: &[Channels],
    ) -> Vec<Cluster> {
        let k = self.own.len();
        let squares = prepared.parallel(self.classes.len(), |i| {
            let class = &self.classes[i];
            let residuals: Vec<Vec<f64>> = class
                .members
                .iter()
                .map(|&m| class.white(prepared, &residuals[m]))
                .collect();
            let gram = class.products.view((0, 0), (k, k)).into_owned();
            self.condense(class, (&class.columns[..k], &[]), gram, &residuals)
        });
        squares.into_iter().flatten().collect()
    }

    /// Takes what belongs to each trial alone out of its equations.
    fn condense(
        &self,
        class: &Class,
        (first, more): (&[Vec<f64>], &[Vec<f64>]),
        mut gram: DMatrix<f64>,
        residuals: &[Vec<f64>],
    ) -> Vec<Cluster> {
        let k = self.own.len();
        let n = gram.nrows() - k;
        for (i, sd) in self.own.iter().enumerate() {
            gram[(i, i)] += 1.0 / (sd * sd);
        }
        let solver = factor(gram.view((0, 0), (k, k)).into_owned());
        let mut reduced = gram.view((k, k), (n, n)).into_owned();
        // What a unit of each common column takes of the trial's own.
        let mut share = DMatrix::zeros(k, n);
        if let Some(solver) = &solver {
            for column in 0..n {
                let right = gram.view((0, k + column), (k, 1)).column(0).into_owned();
                share.set_column(column, &solver.solve(&right));
            }
            reduced -= gram.view((k, 0), (n, k)) * &share;
        }
        let reduced = Arc::new(reduced);
        residuals
            .iter()
            .map(|residual| {
                let all = first.iter().chain(more);
                let score: Vec<f64> = all.map(|c| dot(c, residual)).collect();
                let own = DVector::from_column_slice(&score[..k]);
                let mut common = DVector::from_column_slice(&score[k..]);
                let mut square = dot(residual, residual);
                if let Some(solver) = &solver {
                    common -= share.tr_mul(&own);
                    square -= own.dot(&solver.solve(&own));
                }
                Cluster {
                    configuration: class.group,
                    gram: Arc::clone(&reduced),
                    score: common,
                    square,
                    rows: class.rows,
                }
            })
            .collect()
    }
}

impl Class {
    fn whitened<const N: usize>(
        &self,
        prepared: &PreparedSession<N>,
        response: &Response,
    ) -> Vec<f64> {
        self.white(prepared, &response.0[self.reference])
    }

    fn white<const N: usize>(
        &self,
        prepared: &PreparedSession<N>,
        channels: &Channels,
    ) -> Vec<f64> {
        // Trials of which several share their columns are repeats, and weigh the same.
        let trial = prepared.fitted[self.members[0]];
        prepared
            .noise
            .whiten_in(trial, channels, &self.valid_segments)
    }
}

/// Products of all columns of a class and further ones.
fn bordered(class: &Class, more: &[Vec<f64>]) -> DMatrix<f64> {
    let (n, m) = (class.columns.len(), more.len());
    let mut gram = DMatrix::zeros(n + m, n + m);
    gram.view_mut((0, 0), (n, n)).copy_from(&class.products);
    let mixed = products(&class.columns, more, false);
    gram.view_mut((0, n), (n, m)).copy_from(&mixed);
    gram.view_mut((n, 0), (m, n)).copy_from(&mixed.transpose());
    gram.view_mut((n, n), (m, m))
        .copy_from(&products(more, more, true));
    gram
}

fn products(a: &[Vec<f64>], b: &[Vec<f64>], symmetric: bool) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(a.len(), b.len());
    for i in 0..a.len() {
        for j in if symmetric { i } else { 0 }..b.len() {
            out[(i, j)] = dot(&a[i], &b[j]);
            if symmetric {
                out[(j, i)] = out[(i, j)];
            }
        }
    }
    out
}
