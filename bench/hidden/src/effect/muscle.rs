//! What muscles do.

use std::collections::VecDeque;

use super::acting::{Acts, Instant, Loads};
use crate::random::Random;

/// A law of muscles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Muscle {
    /// Resistance to speed above a threshold, after a latency: gain \[N m s/rad\], threshold \[rad/s\], direction (1 or −1),
    /// latency \[s\].
    Reflex([f64; 4]),
    /// Amplitude \[N m\] and frequency \[Hz\]; the phase is another in each trial, and the amplitude swells and ebbs.
    Tremor([f64; 2]),
    /// Amplitude \[N m\], start \[s\] and duration \[s\] of a push.
    Burst([f64; 3]),
}

impl Muscle {
    /// The law at work.
    pub fn acting(&self, joint: usize, random: &mut Random) -> Box<dyn Acts> {
        let turn = core::f64::consts::TAU;
        Box::new(Active {
            joint,
            law: *self,
            phases: [random.within(0.0, turn), random.within(0.0, turn)],
            past: VecDeque::new(),
        })
    }
}

struct Active {
    joint: usize,
    law: Muscle,
    phases: [f64; 2],
    /// Speeds within the latency, the oldest first.
    past: VecDeque<f64>,
}

impl Acts for Active {
    fn act(&self, now: &Instant, loads: &mut Loads) {
        let wave = |frequency: f64, phase: f64| {
            libm::sin(core::f64::consts::TAU * frequency * now.time + phase)
        };
        loads.resist[self.joint] += match self.law {
            Muscle::Reflex([gain, threshold, direction, _]) => {
                let felt = self.past.front().copied().unwrap_or(0.0);
                direction * gain * (direction * felt - threshold).max(0.0)
            }
            Muscle::Tremor([amplitude, frequency]) => {
                let swell = 1.0 + 0.15 * wave(0.31, self.phases[1]);
                -amplitude * swell * wave(frequency, self.phases[0])
            }
            Muscle::Burst([amplitude, start, duration]) => {
                let s = (now.time - start) / duration;
                if (0.0..1.0).contains(&s) {
                    -amplitude * 0.5 * (1.0 - libm::cos(core::f64::consts::TAU * s))
                } else {
                    0.0
                }
            }
        };
    }

    fn advance(&mut self, now: &Instant, step: f64) {
        if let Muscle::Reflex([.., latency]) = self.law {
            self.past.push_back(now.qd[self.joint]);
            while self.past.len() as f64 * step > latency {
                self.past.pop_front();
            }
        }
    }
}
