//! Seeded noise with the same bits everywhere.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// Independent numbers of the standard normal distribution: ChaCha8 (Bernstein 2008) through the transform of Box and
/// Muller 1958, with the logarithm and the circular functions of `libm`.
#[derive(Clone, Debug)]
pub struct Normal {
    random: ChaCha8Rng,
    /// The second number of a pair.
    kept: Option<f64>,
}

impl Normal {
    /// Numbers of a seed and a stream.
    ///
    /// * `stream` - numbers of different streams of one seed are independent
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        Self { random, kept: None }
    }

    /// The next number.
    #[expect(clippy::should_implement_trait, reason = "it never ends")]
    pub fn next(&mut self) -> f64 {
        if let Some(kept) = self.kept.take() {
            return kept;
        }
        let radius = (-2.0 * libm::log(self.uniform())).sqrt();
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * self.uniform());
        self.kept = Some(radius * sin);
        radius * cos
    }

    /// In steps of 2⁻⁵³ above zero, up to one.
    fn uniform(&mut self) -> f64 {
        ((self.random.next_u64() >> 11) + 1) as f64 / (1u64 << 53) as f64
    }
}

/// Noise of one sensor channel, sample by sample: white, or coloured as a first-order autoregression.
#[derive(Clone, Debug)]
pub(crate) struct SensorNoise {
    normal: Normal,
    deviation: f64,
    /// Correlation of one sample with the next.
    memory: f64,
    last: Option<f64>,
}

impl SensorNoise {
    /// * `deviation` - standard deviation of the noise, white or coloured
    /// * `correlation_time` - time in which the correlation falls to 1/e \[s\], zero for white noise
    pub fn new(normal: Normal, deviation: f64, correlation_time: f64, interval: f64) -> Self {
        let memory = if correlation_time > 0.0 {
            libm::exp(-interval / correlation_time)
        } else {
            0.0
        };
        Self {
            normal,
            deviation,
            memory,
            last: None,
        }
    }

    pub fn next(&mut self) -> f64 {
        let fresh = self.deviation * self.normal.next();
        let value = match self.last {
            // The first sample has the distribution of all others.
            None => fresh,
            Some(last) => self.memory * last + (1.0 - self.memory * self.memory).sqrt() * fresh,
        };
        self.last = Some(value);
        value
    }
}
