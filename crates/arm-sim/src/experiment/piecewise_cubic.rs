//! Functions of time from samples: piecewise cubic polynomials.

use crate::SimulationError;

/// How samples are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Each value holds until the next (a digital controller).
    Hold,
    /// Straight lines.
    Linear,
    /// Twice continuously differentiable cubic spline with the not-a-knot ends of de Boor 1978; fourth order.
    Cubic,
}

/// `M` channels as functions of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Series<const M: usize> {
    times: Vec<f64>,
    /// Samples a second where the times are even, so that a piece is found without a search.
    rate: Option<f64>,
    /// For each interval and channel the coefficients of 1, τ, τ², τ³ with τ from the start of the interval.
    pieces: Vec<[[f64; 4]; M]>,
}

/// Value, first and second derivative of a [`Series`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet<const M: usize> {
    /// Value.
    pub value: [f64; M],
    /// First derivative \[1/s\].
    pub rate: [f64; M],
    /// Second derivative \[1/s²\].
    pub curvature: [f64; M],
}

impl<const M: usize> Series<M> {
    /// A function through samples at even or uneven times.
    ///
    /// * `name` - what the samples are, for messages
    /// * `times` - strictly increasing \[s\]
    ///
    /// # Errors
    /// [`SimulationError::Samples`] for fewer than two samples, unequal numbers, values that are not finite, or times
    /// that do not increase.
    pub fn new(
        name: &'static str,
        times: &[f64],
        values: &[[f64; M]],
        interpolation: Interpolation,
    ) -> Result<Self, SimulationError> {
        let refuse = |sample: usize, problem| {
            Err(SimulationError::Samples {
                name,
                sample: sample + 1,
                problem,
            })
        };
        if times.len() != values.len() {
            return refuse(times.len().min(values.len()), "time or value is missing");
        }
        if times.len() < 2 {
            return refuse(times.len(), "at least two samples are needed");
        }
        for (i, (t, v)) in times.iter().zip(values).enumerate() {
            if !t.is_finite() || v.iter().any(|v| !v.is_finite()) {
                return refuse(i, "not finite");
            }
            if i > 0 && *t <= times[i - 1] {
                return refuse(i, "time does not increase");
            }
        }
        let intervals = times.len() - 1;
        let mut pieces = vec![[[0.0; 4]; M]; intervals];
        for channel in 0..M {
            let y: Vec<f64> = values.iter().map(|v| v[channel]).collect();
            let slopes = match interpolation {
                Interpolation::Cubic => not_a_knot(times, &y),
                Interpolation::Hold | Interpolation::Linear => Vec::new(),
            };
            for (i, piece) in pieces.iter_mut().enumerate() {
                let h = times[i + 1] - times[i];
                let secant = (y[i + 1] - y[i]) / h;
                piece[channel] = match interpolation {
                    Interpolation::Hold => [y[i], 0.0, 0.0, 0.0],
                    Interpolation::Linear => [y[i], secant, 0.0, 0.0],
                    Interpolation::Cubic => {
                        let bend = (slopes[i] + slopes[i + 1] - 2.0 * secant) / h;
                        [y[i], slopes[i], (secant - slopes[i]) / h - bend, bend / h]
                    }
                };
            }
        }
        let step = (times[intervals] - times[0]) / intervals as f64;
        let even = times
            .iter()
            .enumerate()
            .all(|(i, t)| (t - (times[0] + i as f64 * step)).abs() <= 1e-6 * step);
        Ok(Self {
            times: times.to_vec(),
            rate: even.then_some(1.0 / step),
            pieces,
        })
    }

    /// Times of the samples \[s\].
    pub(crate) fn times(&self) -> &[f64] {
        &self.times
    }

    /// First time \[s\].
    pub fn start(&self) -> f64 {
        self.times[0]
    }

    /// Last time \[s\].
    pub fn end(&self) -> f64 {
        self.times[self.times.len() - 1]
    }

    /// Value and derivatives; outside the samples the first or last piece goes on.
    #[inline]
    pub fn at(&self, time: f64) -> Jet<M> {
        let i = self.interval(time);
        let t = time - self.times[i];
        let mut jet = Jet {
            value: [0.0; M],
            rate: [0.0; M],
            curvature: [0.0; M],
        };
        for (channel, &[c0, c1, c2, c3]) in self.pieces[i].iter().enumerate() {
            jet.value[channel] = c0 + t * (c1 + t * (c2 + t * c3));
            jet.rate[channel] = c1 + t * (2.0 * c2 + t * (3.0 * c3));
            jet.curvature[channel] = 2.0 * c2 + t * (6.0 * c3);
        }
        jet
    }

    #[inline]
    fn interval(&self, time: f64) -> usize {
        let last = self.pieces.len() - 1;
        match self.rate {
            Some(rate) => {
                // Rounding may put a sample's own time into the interval before it.
                let guess = (((time - self.times[0]) * rate) as usize).min(last);
                if guess < last && time >= self.times[guess + 1] {
                    guess + 1
                } else if guess > 0 && time < self.times[guess] {
                    guess - 1
                } else {
                    guess
                }
            }
            None => self
                .times
                .partition_point(|&t| t <= time)
                .saturating_sub(1)
                .min(last),
        }
    }
}

/// Weights of four even samples, at 0, 1, 2 and 3, for the value at `x` of the cubic through them (Lagrange).
pub fn cubic_weights(x: f64) -> [f64; 4] {
    let (a, b, c, d) = (x, x - 1.0, x - 2.0, x - 3.0);
    [
        -b * c * d / 6.0,
        a * c * d / 2.0,
        -a * b * d / 2.0,
        a * b * c / 6.0,
    ]
}

/// Slopes at the samples of the cubic spline whose first two and last two pieces are one polynomial each.
///
/// Two samples give a straight line, three a parabola.
fn not_a_knot(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let h: Vec<f64> = x.windows(2).map(|w| w[1] - w[0]).collect();
    let secant: Vec<f64> = (0..n - 1).map(|i| (y[i + 1] - y[i]) / h[i]).collect();
    if n == 2 {
        return vec![secant[0]; 2];
    }
    if n == 3 {
        let bend = (secant[1] - secant[0]) / (h[0] + h[1]);
        let first = secant[0] - bend * h[0];
        return vec![
            first,
            first + 2.0 * bend * h[0],
            first + 2.0 * bend * (h[0] + h[1]),
        ];
    }
    // Rows: below · s[i−1] + diagonal · s[i] + above · s[i+1] = right. The pivots are positive without exchanges.
    let (mut diagonal, mut above, mut right) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let both = h[0] + h[1];
    (diagonal[0], above[0]) = (h[1], both);
    right[0] = ((h[0] + 2.0 * both) * h[1] * secant[0] + h[0] * h[0] * secant[1]) / both;
    for i in 1..n {
        let (below, mut d, a, mut r);
        if i < n - 1 {
            (below, d, a) = (h[i], 2.0 * (h[i - 1] + h[i]), h[i - 1]);
            r = 3.0 * (h[i] * secant[i - 1] + h[i - 1] * secant[i]);
        } else {
            let (near, far) = (h[n - 2], h[n - 3]);
            (below, d, a) = (near + far, far, 0.0);
            r = (near * near * secant[n - 3] + (2.0 * (near + far) + near) * far * secant[n - 2])
                / (near + far);
        }
        let factor = below / diagonal[i - 1];
        d -= factor * above[i - 1];
        r -= factor * right[i - 1];
        (diagonal[i], above[i], right[i]) = (d, a, r);
    }
    let mut slopes = right;
    slopes[n - 1] /= diagonal[n - 1];
    for i in (0..n - 1).rev() {
        slopes[i] = (slopes[i] - above[i] * slopes[i + 1]) / diagonal[i];
    }
    slopes
}
