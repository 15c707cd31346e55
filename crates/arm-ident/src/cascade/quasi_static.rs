//! The cascade on raw samples, in one streamed pass without stored rows.
//!
//! One pass folds `[1, y_N … y_1 | t_N … t_1]` into a triangle of `2N + 1` columns, `y_k` being the gravity column of link k and
//! `t_j` the torque `(JᵀF)_j`. The step of joint j needs the columns `1, y_N … y_j`, which lead: its own triangle is a corner of the
//! common one. No filter, no intervals: use [`crate::cascade`] for these.

use arm_core::{Chain, Joints, Plane, write_sines_and_cosines};

use crate::cascade::step::bounded;
use crate::cascade::unknowns::{is_dissipative, own, unknowns};
use crate::error::IdentError;
use crate::inference::weighted_fit::weighed;
use crate::regression::trial::Model;
use crate::regression::unknown::{Moment, Source, Unknown};
use arm_core::simd_dispatch::{Computation, dispatch};
use arm_numerics::NumericsError;
use arm_numerics::error::{check_least, check_len};
use arm_numerics::least_squares::condense::{BLOCK, Column, Condenser, acceptable};
use arm_numerics::least_squares::factor::Factor;
use arm_numerics::linalg::matrix::{Matrix, add_scaled, dot};

/// Folds samples as they come. Memory is fixed when it is made; pushing never allocates.
#[derive(Clone, Debug)]
pub struct Stream<const N: usize> {
    chain: Chain<f64, N>,
    block: Box<Block<N>>,
    condenser: Condenser,
}

impl<const N: usize> Stream<N> {
    /// An empty stream for an arm; only its lengths, gravity and normal moments are used.
    pub fn new(chain: &Chain<f64, N>) -> Self {
        Self {
            chain: *chain,
            block: Box::new(Block::empty()),
            condenser: Condenser::new(2 * N),
        }
    }

    /// Adds samples. The result does not depend on how they are cut into calls.
    ///
    /// * `q` - joint angles \[rad\]
    /// * `force_on_arm` - at the tip \[N\]
    ///
    /// # Errors
    /// [`NumericsError::Length`]; [`NumericsError::NotFinite`] with the index (from 0) of the first sample whose angle or force is not finite or
    /// too large; earlier samples are kept. If a torque of a full block is too large, the block is discarded, and the index is that of its
    /// first sample.
    pub fn push(
        &mut self,
        q: &[Joints<f64, N>],
        force_on_arm: &[Plane<f64>],
    ) -> Result<(), IdentError> {
        check_len("force_on_arm", force_on_arm.len(), q.len())?;
        let (mut q, mut force) = (q, force_on_arm);
        while !q.is_empty() {
            let first = self.block.samples;
            let taken = q.len().min(BLOCK - first);
            let block = &mut *self.block;
            let good = dispatch(Take {
                block,
                q: &q[..taken],
                force: &force[..taken],
            });
            if !good {
                return Err(self.without_bad(first).into());
            }
            (q, force) = (&q[taken..], &force[taken..]);
            if self.block.samples == BLOCK {
                self.fold()?;
            }
        }
        Ok(())
    }

    /// The condensed problem of all samples.
    ///
    /// # Errors
    /// [`NumericsError::NotFinite`] where the torques of a sample are too large.
    pub fn finish(mut self) -> Result<Condensed<N>, IdentError> {
        self.fold()?;
        Ok(Condensed {
            factor: self.condenser.finish(),
        })
    }

    /// Takes the first bad sample from a place of the block on, and all after it, out of the block; says what is wrong with it.
    fn without_bad(&mut self, first: usize) -> NumericsError {
        let block = &mut *self.block;
        let columns = || block.links.iter().chain(&block.force);
        let found = |place: usize| {
            let values = columns().map(move |column| column.0[place]);
            values.into_iter().find(|&v| !acceptable(&[v]))
        };
        let mut places = (first..block.samples).filter_map(|place| Some((place, found(place)?)));
        let (place, found) = places.next().unwrap_or((first, f64::NAN));
        block.samples = place;
        NumericsError::NotFinite {
            name: "samples",
            index: self.condenser.rows() + place,
            found,
        }
    }

    /// Folds the samples that wait.
    fn fold(&mut self) -> Result<(), IdentError> {
        let (chain, block) = (&self.chain, &mut *self.block);
        let samples = core::mem::take(&mut block.samples);
        self.condenser.push_panel(samples, |panel| {
            dispatch(Fill {
                chain,
                block,
                panel,
            });
        })?;
        Ok(())
    }
}

/// Samples that wait, each quantity in a column of its own, and memory for what follows from them.
#[derive(Clone, Debug)]
struct Block<const N: usize> {
    samples: usize,
    /// Angles of the links \[rad\].
    links: [Column; N],
    /// On the arm \[N\].
    force: [Column; 2],
    sin: Column,
    cos: Column,
    /// Sums over the links from the tip: torque of the contact, and moment of the weight that lies beside them \[N m\].
    contact: Column,
    beside: Column,
}

impl<const N: usize> Block<N> {
    fn empty() -> Self {
        let zeros = Column([0.0; BLOCK]);
        Self {
            samples: 0,
            links: [zeros; N],
            force: [zeros; 2],
            sin: zeros,
            cos: zeros,
            contact: zeros,
            beside: zeros,
        }
    }
}

/// Takes samples into a block with room for them; returns whether all can be used.
struct Take<'a, const N: usize> {
    block: &'a mut Block<N>,
    q: &'a [Joints<f64, N>],
    force: &'a [Plane<f64>],
}

impl<const N: usize> Computation for Take<'_, N> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        let Self { block, q, force } = self;
        let first = block.samples;
        block.samples += q.len();
        let places = first..block.samples;
        for ((place, q), force) in places.clone().zip(q).zip(force) {
            let mut angle = 0.0;
            for (link, q) in block.links.iter_mut().zip(q.iter()) {
                angle += q;
                link.0[place] = angle;
            }
            for (column, force) in block.force.iter_mut().zip(force) {
                column.0[place] = *force;
            }
        }
        let mut columns = block.links.iter().chain(&block.force);
        columns.all(|column| acceptable(&column.0[places.clone()]))
    }
}

/// Writes the columns of a block: gravity column of every link \[N m/(kg m)\] and contact torque of every joint \[N m\], the last first,
/// with known normal moments taken off. A loop over samples within each quantity: the compiler then uses the widest vectors.
struct Fill<'a, const N: usize> {
    chain: &'a Chain<f64, N>,
    block: &'a mut Block<N>,
    panel: &'a mut [Column],
}

impl<const N: usize> Computation for Fill<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self {
            chain,
            block,
            panel,
        } = self;
        let [gy, gz] = chain.gravity();
        let ([fy, fz], sin, cos) = (&block.force, &mut block.sin.0, &mut block.cos.0);
        let (contact, beside) = (&mut block.contact.0, &mut block.beside.0);
        contact.fill(0.0);
        beside.fill(0.0);
        let (ones, panel) = panel.split_at_mut(1);
        ones[0].0.fill(1.0);
        let (columns, torques) = panel.split_at_mut(N);
        for (k, link) in (0..N).rev().enumerate() {
            write_sines_and_cosines(&block.links[link].0, [&mut sin[..], &mut cos[..]]);
            let (length, normal) = (chain.segments()[link].length, chain.normal_moments()[link]);
            let (column, torque) = (&mut columns[k].0, &mut torques[k].0);
            for i in 0..BLOCK {
                contact[i] += length * (cos[i] * fz.0[i] - sin[i] * fy.0[i]);
                beside[i] += normal * (gy * cos[i] + gz * sin[i]);
                column[i] = gy * sin[i] - gz * cos[i];
                torque[i] = contact[i] - beside[i];
            }
        }
    }
}

/// All samples of a stream as one triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Condensed<const N: usize> {
    factor: Factor,
}

/// What the cascade makes of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Cascade<const N: usize> {
    /// The unknowns with their bounds.
    pub unknowns: Vec<Unknown>,
    /// Their values.
    pub x: Vec<f64>,
    /// −1 at the lower bound, +1 at the upper bound, 0 between.
    pub active: Vec<i8>,
    /// `X_j`, what the data determine \[kg m\].
    pub first_moments: [f64; N],
    /// Root mean square of the residual of each joint \[N m\].
    pub residual_rms: [f64; N],
}

impl<const N: usize> Condensed<N> {
    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.factor.rows
    }

    /// Wrist to shoulder, each under its bounds; see [`crate::cascade`]. A stream has no direction of motion, so
    /// dissipative torques are not among the unknowns.
    ///
    /// # Errors
    /// [`NumericsError::TooFew`] for fewer samples than unknowns.
    pub fn solve(&self, model: &Model<N>, bound_width: f64) -> Result<Cascade<N>, IdentError> {
        let mut unknowns = unknowns(model, bound_width);
        unknowns.retain(|u| match u.source {
            Source::Effect(e, _) => !is_dissipative(&model.fitted[e]),
            _ => true,
        });
        check_least("samples", self.samples(), N + 2)?;
        let mut x: Vec<f64> = unknowns.iter().map(|u| u.mean).collect();
        let mut active = vec![0; unknowns.len()];
        let mut first = *model.chain.first_moments();
        let mut rms = [0.0; N];
        for joint in (0..N).rev() {
            let own = own(model, &unknowns, joint);
            let (problem, rest) = self.step(model, &unknowns, &own, (joint, &first, &x))?;
            let variance = f64::max(
                problem.rho2 / (self.samples() - own.len()) as f64,
                1e-20 * dot(&problem.z, &problem.z) / self.samples() as f64,
            )
            .max(f64::MIN_POSITIVE.sqrt());
            let (mean, sd): (Vec<f64>, Vec<f64>) = own
                .iter()
                .map(|&u| (unknowns[u].mean, unknowns[u].sd))
                .unzip();
            let posterior = weighed(&problem, variance).with_prior(&mean, &sd)?;
            let (values, at, _) = bounded(&posterior, &own, &unknowns)?;
            rms[joint] = libm::sqrt((problem.residual2(&values)? + rest) / self.samples() as f64);
            for ((&u, value), at) in own.iter().zip(values).zip(at) {
                (x[u], active[u]) = (value, at);
            }
            first[joint] = first_moment(model, &unknowns, &x, joint);
        }
        Ok(Cascade {
            unknowns,
            x,
            active,
            first_moments: first,
            residual_rms: rms,
        })
    }

    /// The problem of one joint in its own unknowns, and the sum of squares that lies outside of its columns.
    fn step(
        &self,
        model: &Model<N>,
        unknowns: &[Unknown],
        own: &[usize],
        (joint, first, x): (usize, &[f64; N], &[f64]),
    ) -> Result<(Factor, f64), IdentError> {
        let size = 1 + N - joint;
        let column = |link: usize| &self.factor.r.column(N - link)[..size];
        let torque = if joint == 0 {
            &self.factor.z[..]
        } else {
            self.factor.r.column(2 * N - joint)
        };
        let (inside, outside) = torque.split_at(size);
        let mut z = inside.to_vec();
        for link in joint + 1..N {
            add_scaled(&mut z, -first[link], column(link));
        }
        // Load of this link beyond its own unknowns: segments that are identified already, or held.
        let own_share: f64 = own
            .iter()
            .map(|&u| share(model, unknowns[u].source, joint) * x[u])
            .sum();
        add_scaled(
            &mut z,
            own_share - first_moment(model, unknowns, x, joint),
            column(joint),
        );
        let y = Matrix::from_fn(size, own.len(), |i, c| match unknowns[own[c]].source {
            Source::Effect(..) => self.factor.r.column(0)[i],
            source => share(model, source, joint) * column(joint)[i],
        });
        let problem = Factor {
            rows: self.samples(),
            ..Factor::of(&y, &z)?
        };
        let beyond = dot(outside, outside) + if joint == 0 { self.factor.rho2 } else { 0.0 };
        Ok((problem, beyond))
    }
}

/// How much of an unknown is in `X_j`.
fn share<const N: usize>(model: &Model<N>, source: Source, joint: usize) -> f64 {
    match source {
        Source::Segment(k, Moment::Along) if k == joint => 1.0,
        Source::Segment(k, Moment::Mass) if k > joint => model.chain.segments()[joint].length,
        _ => 0.0,
    }
}

/// `X_j` with the unknowns at `x` and the rest as in the model.
fn first_moment<const N: usize>(
    model: &Model<N>,
    unknowns: &[Unknown],
    x: &[f64],
    joint: usize,
) -> f64 {
    let moved = unknowns
        .iter()
        .zip(x)
        .map(|(u, x)| share(model, u.source, joint) * (x - u.mean));
    model.chain.first_moments()[joint] + moved.sum::<f64>()
}
