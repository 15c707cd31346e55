//! Fit of effects by simulation: the parameters whose run is nearest to recorded angles and forces.
//!
//! Levenberg and Marquardt's method within bounds. Each round simulates the estimate and one run beside it for every parameter in
//! one batch, so the derivatives come almost for nothing: they go in the lanes beside the run.

use arm_sim::{Experiment, Recording, simulate_batch};
use serde::Serialize;

use crate::error::IdentError;
use crate::inference::multistart::{Ended, best};
use arm_numerics::error::{check_finite, check_least, check_len, check_range};
use arm_numerics::least_squares::condense::Condenser;
use arm_numerics::least_squares::factor::Factor;
use arm_numerics::least_squares::program::Program;
use arm_numerics::statistics::sandwich_covariance::SandwichCovariance;

/// A parameter beside the estimate is this share of its size away: between rounding (1e-14 of an angle) and curvature.
const BESIDE: f64 = 1e-6;
/// Size of a parameter that is zero, in its own unit.
const LEAST_SIZE: f64 = 1e-2;
/// Damping of the first round, relative to the columns' norms.
const FIRST_DAMPING: f64 = 1e-3;
/// Beyond this damping no step is left.
const MOST_DAMPING: f64 = 1e12;
/// Converged when the predicted reduction of the sum of squares is less than this share of it,
const SETTLED: f64 = 1e-10;
/// or less than this share and not obtained: what is left then is rounding of the differences.
const ROUNDED: f64 = 1e-8;
/// Most rounds.
const MOST_ROUNDS: usize = 100;

/// A parameter that is fitted: that of an effect of the experiment, within bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Free {
    /// Index of the effect in the experiment.
    pub effect: usize,
    /// Index of its parameter.
    pub parameter: usize,
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
}

/// What was recorded at the samples of the experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded<'a, const N: usize> {
    /// Joint angles, a row of N each sample \[rad\].
    pub q: &'a [f64],
    /// Force on the arm, two numbers each sample \[N\].
    pub force_on_arm: &'a [f64],
    /// Standard deviation of the noise of each angle \[rad\].
    pub angle_noise: [f64; N],
    /// Of each component of the force \[N\].
    pub force_noise: [f64; 2],
}

/// The run that comes closest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// Value of each free parameter.
    pub values: Vec<f64>,
    /// Its standard deviation where the noise is white and of the sizes given, as if no bound held; infinite where the data are silent.
    pub sd: Vec<f64>,
    /// −1 at the least value, +1 at the greatest, 0 between.
    pub active: Vec<i8>,
    /// Sum of squared residuals, in units of the noise.
    pub squares: f64,
    /// Number of residuals.
    pub residuals: usize,
    /// Rounds of simulations from the start that led here.
    pub rounds: usize,
    /// Whether the estimate stands; false when the rounds ran out.
    pub settled: bool,
}

/// Fits parameters of an experiment's effects; the fit starts from the experiment's own values, and again from elsewhere where it ends at a bound or does
/// not settle: the run that comes closest counts.
///
/// * `threads` - over which the runs of a round are spread; the result has the same bits for any number
///
/// # Errors
/// [`NumericsError::TooFew`](arm_numerics::NumericsError::TooFew) without a parameter, [`NumericsError::OutOfRange`](arm_numerics::NumericsError::OutOfRange) for one that the experiment lacks, a start beyond its bounds or
/// a noise that is not positive, [`NumericsError::Length`](arm_numerics::NumericsError::Length) for records of other samples than the experiment's,
/// [`NumericsError::NotFinite`](arm_numerics::NumericsError::NotFinite), and [`IdentError::Simulation`] where the first run stops.
pub fn fit<const N: usize>(
    experiment: &Experiment<N>,
    recorded: &Recorded<'_, N>,
    free: &[Free],
    threads: usize,
) -> Result<Fit, IdentError> {
    check_least("free parameters", free.len(), 1)?;
    check_finite("recorded angles", recorded.q)?;
    check_finite("recorded forces", recorded.force_on_arm)?;
    for noise in recorded.angle_noise.iter().chain(&recorded.force_noise) {
        check_range("noise", *noise, [f64::MIN_POSITIVE, f64::MAX])?;
    }
    let mut x = Vec::with_capacity(free.len());
    for f in free {
        let most = experiment.effects.len() as f64 - 1.0;
        check_range("effect of a free parameter", f.effect as f64, [0.0, most])?;
        let effect = &experiment.effects[f.effect];
        let most = effect.kind.info().parameters.len() as f64 - 1.0;
        check_range("index of a free parameter", f.parameter as f64, [0.0, most])?;
        let start = effect.parameters[f.parameter];
        check_range("start of a free parameter", start, [f.min, f.max])?;
        x.push(start);
    }
    let search = Search {
        experiment,
        recorded,
        free,
        threads,
    };
    let limits: Vec<[f64; 2]> = free.iter().map(|f| [f.min, f.max]).collect();
    let first = search.settle(x.clone())?;
    Ok(best(first, &x, &limits, |_, from| {
        search.settle(from.to_vec()).ok()
    }))
}

impl Ended for Fit {
    fn parameters(&self) -> Vec<(f64, i8)> {
        let values = self.values.iter().copied();
        values.zip(self.active.iter().copied()).collect()
    }

    fn settled(&self) -> bool {
        self.settled
    }

    fn objective(&self) -> f64 {
        self.squares
    }
}

struct Search<'a, const N: usize> {
    experiment: &'a Experiment<N>,
    recorded: &'a Recorded<'a, N>,
    free: &'a [Free],
    threads: usize,
}

impl<const N: usize> Search<'_, N> {
    /// Rounds from a start until the estimate stands.
    fn settle(&self, mut x: Vec<f64>) -> Result<Fit, IdentError> {
        let still = vec![0.0; x.len()];
        let mut here = self.around(&x)?;
        let mut squares = here.residual2(&still)?;
        let (mut damping, mut rounds, mut settled) = (FIRST_DAMPING, 1, false);
        while rounds < MOST_ROUNDS && damping < MOST_DAMPING {
            let step = self.step(&here, &x, damping)?;
            let promised = squares - here.residual2(&step)?;
            if promised <= SETTLED * (1.0 + squares) {
                settled = true;
                break;
            }
            rounds += 1;
            let candidate: Vec<f64> = x.iter().zip(&step).map(|(x, s)| x + s).collect();
            // A candidate whose run stops is no better than one that fits worse.
            let there = self.around(&candidate).ok();
            match there.map(|there| (there.residual2(&still), there)) {
                Some((Ok(fewer), there)) if fewer < squares => {
                    (squares, here, x) = (fewer, there, candidate);
                    damping *= 0.1;
                }
                _ if promised <= ROUNDED * (1.0 + squares) => {
                    settled = true;
                    break;
                }
                _ => damping *= 10.0,
            }
        }
        // Where damping has taken every step away, what is left is rounding.
        settled |= damping >= MOST_DAMPING;
        let active = x
            .iter()
            .zip(self.free)
            .map(|(&x, f)| i8::from(x >= f.max) - i8::from(x <= f.min))
            .collect();
        Ok(Fit {
            sd: deviations(&here),
            squares,
            residuals: here.rows,
            active,
            values: x,
            rounds,
            settled,
        })
    }

    /// The problem of least squares around an estimate: derivatives by differences, in the unit of the noise.
    fn around(&self, x: &[f64]) -> Result<Factor, IdentError> {
        let at = |values: &[f64]| {
            let mut run = self.experiment.clone();
            for (f, value) in self.free.iter().zip(values) {
                run.effects[f.effect].parameters[f.parameter] = *value;
            }
            run
        };
        let mut runs = vec![at(x)];
        let mut shifts = Vec::with_capacity(x.len());
        for (i, f) in self.free.iter().enumerate() {
            let size = BESIDE * x[i].abs().max(LEAST_SIZE);
            let mut beside = x.to_vec();
            beside[i] += if x[i] + size > f.max { -size } else { size };
            shifts.push(beside[i] - x[i]);
            runs.push(at(&beside));
        }
        let runs = simulate_batch(&runs, self.threads)
            .into_iter()
            .collect::<Result<Vec<Recording<N>>, _>>()?;
        let samples = runs[0].len();
        check_len("recorded angles", self.recorded.q.len(), samples * N)?;
        check_len(
            "recorded forces",
            self.recorded.force_on_arm.len(),
            samples * 2,
        )?;
        let mut condenser = Condenser::new(x.len());
        let mut row = vec![0.0; x.len()];
        let Recorded {
            q,
            force_on_arm,
            angle_noise,
            force_noise,
        } = self.recorded;
        let noise: Vec<f64> = angle_noise.iter().chain(force_noise).copied().collect();
        for i in 0..samples {
            for (c, noise) in noise.iter().enumerate() {
                let of = |q: &[f64], force: &[f64]| {
                    if c < N {
                        q[i * N + c]
                    } else {
                        force[2 * i + c - N]
                    }
                };
                let value = of(&runs[0].q, &runs[0].force_on_arm);
                for ((entry, run), shift) in row.iter_mut().zip(&runs[1..]).zip(&shifts) {
                    *entry = (of(&run.q, &run.force_on_arm) - value) / (shift * noise);
                }
                condenser.push(&row, (of(q, force_on_arm) - value) / noise)?;
            }
        }
        Ok(condenser.finish())
    }

    /// The damped step within the bounds.
    fn step(&self, here: &Factor, x: &[f64], damping: f64) -> Result<Vec<f64>, IdentError> {
        let norms = here.r.column_norms();
        // A direction of which the data are silent is held by the size of its parameter.
        let sd: Vec<f64> = norms
            .iter()
            .zip(x)
            .map(|(&n, x)| 1.0 / (damping.sqrt() * n).max(f64::EPSILON / x.abs().max(LEAST_SIZE)))
            .collect();
        let damped = here.with_prior(&vec![0.0; x.len()], &sd)?;
        let room = |end: fn(&Free) -> f64| -> Vec<f64> {
            self.free.iter().zip(x).map(|(f, x)| end(f) - x).collect()
        };
        let scale: Vec<f64> = x.iter().map(|x| x.abs().max(LEAST_SIZE)).collect();
        let outcome = Program::of(&damped)?
            .scale(&scale)?
            .bounds(&room(|f| f.min), &room(|f| f.max))?
            .solve()?;
        if outcome.x.iter().any(|v| !v.is_finite()) {
            return Err(IdentError::NoSolution {
                status: outcome.status,
            });
        }
        // Rounding must not carry an estimate beyond a bound.
        let within = |((s, f), x): ((f64, &Free), &f64)| (x + s).clamp(f.min, f.max) - x;
        Ok(outcome
            .x
            .into_iter()
            .zip(self.free)
            .zip(x)
            .map(within)
            .collect())
    }
}

/// Standard deviations of a factor in units of the noise, as if no bound held.
fn deviations(factor: &Factor) -> Vec<f64> {
    let p = factor.parameters();
    match SandwichCovariance::new(&factor.r, &[]) {
        Ok(bread) => {
            let covariance = bread.white(1.0);
            (0..p).map(|i| libm::sqrt(covariance[(i, i)])).collect()
        }
        Err(_) => vec![f64::INFINITY; p],
    }
}
