//! Whitened rows of trials, condensed: repeats with the same samples share their columns.

use std::sync::Arc;

use arm_numerics::linalg::matrix::add_scaled;
use arm_numerics::{Cholesky, Matrix};

use crate::data::course::Channels;
use crate::data::noise::dot;
use crate::data::valid_segments::ValidSegments;
use crate::data::whitening::Whitening;
use crate::linearization::linear_response::Response;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::normal_equations::Cluster;

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
    whitening: Whitening,
    /// Number of observable rows of one trial.
    rows: usize,
    /// Positions in the list of fitted trials.
    members: Vec<usize>,
    /// Whitened columns: first those whose coefficients belong to each trial alone, then the common ones.
    columns: Vec<Vec<f64>>,
    /// Their products.
    products: Matrix,
}

/// Whitened responses with their products, class by class.
#[derive(Default)]
pub struct Columns(Vec<(Vec<Vec<f64>>, Matrix)>);

/// Whitened columns of the fitted trials.
#[derive(Clone, Default)]
pub struct WhitenedRows {
    classes: Vec<Class>,
    /// Standard deviations of what belongs to each trial alone.
    own: Vec<f64>,
}

impl WhitenedRows {
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
            let (reference, valid_segments) =
                (prepared.group_of[trial], &prepared.valid_segments[trial]);
            if !prepared.repeated {
                // Parts of a trial stand in for the repeats that are not there.
                for part in valid_segments.parts(PARTS) {
                    classes.push(Class::new(prepared, (classes.len(), reference), part, m));
                }
                continue;
            }
            let known = classes
                .iter_mut()
                .find(|c| c.reference == reference && c.valid_segments == *valid_segments);
            match known {
                Some(class) => class.members.push(m),
                None => {
                    // What is broken off or disturbed has another score than its repeats, without any noise.
                    let own = (classes.len(), reference);
                    classes.push(Class::new(prepared, own, valid_segments.clone(), m));
                }
            }
        }
        let all: Vec<&Response> = own.iter().chain(responses).collect();
        let Columns(whitened) = columns(&classes, prepared, &all);
        for (class, whitened) in classes.iter_mut().zip(whitened) {
            (class.columns, class.products) = whitened;
        }
        let sd = |c: crate::hypothesis::Coordinate| c.prior.map_or(f64::INFINITY, |(_, sd)| sd);
        Self {
            classes,
            own: prepared.session.by_trial().into_iter().map(sd).collect(),
        }
    }

    /// The same without some of the common columns.
    pub fn without(&self, columns: &[usize]) -> Self {
        let own = self.own.len();
        let classes = self.classes.iter().map(|class| {
            let kept: Vec<usize> = (0..class.columns.len())
                .filter(|&i| i < own || !columns.contains(&(i - own)))
                .collect();
            Class {
                columns: kept.iter().map(|&i| class.columns[i].clone()).collect(),
                products: class.products.select(&kept, &kept),
                ..class.clone()
            }
        });
        Self {
            classes: classes.collect(),
            own: self.own.clone(),
        }
    }

    /// Whitens responses to further unknowns, for [`WhitenedRows::clusters_beside`].
    pub fn columns<const N: usize>(
        &self,
        prepared: &PreparedSession<N>,
        responses: &[&Response],
    ) -> Columns {
        columns(&self.classes, prepared, responses)
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
        self.clusters_beside(prepared, (extra, &Columns::default()), residuals)
    }

    /// The same with columns that are known behind them.
    pub fn clusters_beside<const N: usize>(
        &self,
        prepared: &PreparedSession<N>,
        (extra, known): (&[&Response], &Columns),
        residuals: &[Channels],
    ) -> Vec<Cluster> {
        let condensed = prepared.parallel(self.classes.len(), |i| {
            let class = &self.classes[i];
            let own: Vec<Vec<f64>> = extra.iter().map(|r| class.whitened(prepared, r)).collect();
            let none = (Vec::new(), Matrix::zeros(0, 0));
            let known = known.0.get(i).unwrap_or(&none);
            let gram = bordered(class, &own, known);
            let more: Vec<&Vec<f64>> = own.iter().chain(&known.0).collect();
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
            let gram = class.products.block(0..k, 0..k);
            self.condense(class, (&class.columns[..k], &[]), gram, &residuals)
        });
        squares.into_iter().flatten().collect()
    }

    /// Takes what belongs to each trial alone out of its equations.
    fn condense(
        &self,
        class: &Class,
        (first, more): (&[Vec<f64>], &[&Vec<f64>]),
        mut gram: Matrix,
        residuals: &[Vec<f64>],
    ) -> Vec<Cluster> {
        let k = self.own.len();
        let all = gram.rows();
        for (i, sd) in self.own.iter().enumerate() {
            gram[(i, i)] += 1.0 / (sd * sd);
        }
        let solver = Cholesky::new(gram.block(0..k, 0..k));
        let mut reduced = gram.block(k..all, k..all);
        // What a unit of each common column takes of the trial's own.
        let mut share = Matrix::zeros(k, all - k);
        if let Some(solver) = &solver {
            share = solver.solve_columns(&gram.block(0..k, k..all));
            reduced.add_scaled(-1.0, &gram.block(k..all, 0..k).product(&share));
        }
        let reduced = Arc::new(reduced);
        residuals
            .iter()
            .map(|residual| {
                let all = first.iter().chain(more.iter().copied());
                let score: Vec<f64> = all.map(|c| dot(c, residual)).collect();
                let (own, common) = score.split_at(k);
                let mut common = common.to_vec();
                let mut square = dot(residual, residual);
                if let Some(solver) = &solver {
                    add_scaled(&mut common, -1.0, &share.transpose_times(own));
                    square -= dot(own, &solver.solve(own));
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
    /// A class of one fitted trial, without columns.
    fn new<const N: usize>(
        prepared: &PreparedSession<N>,
        (group, reference): (usize, usize),
        valid_segments: ValidSegments,
        member: usize,
    ) -> Self {
        let compared = valid_segments.rows_per_channel(prepared.session.channels());
        Self {
            group,
            reference,
            rows: compared.iter().sum(),
            whitening: prepared.noise.whitening(&valid_segments),
            valid_segments,
            members: vec![member],
            columns: Vec::new(),
            products: Matrix::zeros(0, 0),
        }
    }

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
            .whiten_in(trial, channels, (&self.valid_segments, &self.whitening))
    }
}

/// Products of all columns of a class, further ones, and some whose own products are known.
fn bordered(class: &Class, more: &[Vec<f64>], known: &(Vec<Vec<f64>>, Matrix)) -> Matrix {
    let (n, m) = (class.columns.len(), more.len());
    let all = n + m + known.0.len();
    let mut gram = Matrix::zeros(all, all);
    gram.set_block((0, 0), &class.products);
    gram.set_block((n, n), &products(more, more, true));
    gram.set_block((n + m, n + m), &known.1);
    let mixed = [
        (0, n, products(&class.columns, more, false)),
        (0, n + m, products(&class.columns, &known.0, false)),
        (n, n + m, products(more, &known.0, false)),
    ];
    for (row, column, block) in &mixed {
        gram.set_block((*row, *column), block);
        gram.set_block((*column, *row), &block.transpose());
    }
    gram
}

fn columns<const N: usize>(
    classes: &[Class],
    prepared: &PreparedSession<N>,
    responses: &[&Response],
) -> Columns {
    let whitened = prepared.parallel(classes.len(), |i| {
        let class = &classes[i];
        let each = responses.iter().map(|r| class.whitened(prepared, r));
        let columns: Vec<Vec<f64>> = each.collect();
        let products = products(&columns, &columns, true);
        (columns, products)
    });
    Columns(whitened)
}

fn products(a: &[Vec<f64>], b: &[Vec<f64>], symmetric: bool) -> Matrix {
    let mut out = Matrix::zeros(a.len(), b.len());
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
