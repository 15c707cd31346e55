//! Dry friction that obeys its law at the end of a step: smooth, set-valued, or both, however steep.
//!
//! The torques besides friction are linear in the speeds there, which leaves a monotone equation in these: Newton's method for friction
//! that is smooth, and an exchange of modes for friction that is set-valued, as in principal pivoting (Murty 1974).

use arm_core::Joints;
use arm_core::effect::{Effect, Motion, States};
use nalgebra::SMatrix;

/// Smooth dry friction of a joint: `most · tanh(speed/smoothing)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothFriction {
    /// Zero-based joint.
    pub joint: usize,
    /// What it resists with in fast motion \[N m\].
    pub most: f64,
    /// Speed at which it resists with three quarters of that \[rad/s\].
    pub smoothing: f64,
}

impl SmoothFriction {
    /// The smooth dry friction among joint effects, each with its size in a motion.
    pub fn among<'e, const N: usize>(
        effects: &'e [Effect<f64>],
        motion: &'e Motion<f64, N>,
        memory: &'e [States<f64>],
    ) -> impl Iterator<Item = Self> + 'e {
        effects.iter().enumerate().filter_map(|(i, effect)| {
            let smoothing = effect.parameters[smoothed_by(effect)?];
            let state = memory.get(i).copied().unwrap_or_default();
            Some(Self {
                joint: effect.index,
                most: effect.dry(&motion.local(effect.index, state)),
                smoothing,
            })
        })
    }

    /// Its torque at a speed, and the slope of that \[N m, N m s/rad\].
    fn at(&self, speed: f64) -> (f64, f64) {
        let share = libm::tanh(speed / self.smoothing);
        let slope = self.most / self.smoothing * (1.0 - share * share);
        (self.most * share, slope)
    }

    /// Torques of several, and the slopes of those to the speeds of their joints \[N m, N m s/rad\].
    pub fn sum<const N: usize>(
        all: &[Self],
        speed: &Joints<f64, N>,
    ) -> (Joints<f64, N>, Joints<f64, N>) {
        let (mut torque, mut slope) = (Joints::zeros(), Joints::zeros());
        for own in all {
            let (resisting, steepness) = own.at(speed[own.joint]);
            torque[own.joint] += resisting;
            slope[own.joint] += steepness;
        }
        (torque, slope)
    }
}

/// Position of the smoothing of an effect that is smooth dry friction, or has some.
fn smoothed_by(effect: &Effect<f64>) -> Option<usize> {
    let smoothing = effect.kind.smoothed_by()?;
    (effect.on && effect.parameters[smoothing] > 0.0).then_some(smoothing)
}

/// Dry friction of all joints at the end of a step.
#[derive(Clone, Copy, Debug)]
pub struct ImplicitFriction<'a, const N: usize> {
    /// Most that set-valued friction of each joint resists with \[N m\].
    pub set_valued: Joints<f64, N>,
    /// Smooth friction.
    pub smooth: &'a [SmoothFriction],
}

/// Speeds at the end of a step, and the friction there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WithFriction<const N: usize> {
    /// Speeds; zero where set-valued friction holds a joint \[rad/s\].
    pub speed: Joints<f64, N>,
    /// Torques of set-valued friction \[N m\].
    pub set_valued: Joints<f64, N>,
    /// Whether the iteration converged; if not, the speeds are those of its last step.
    pub exact: bool,
}

impl<const N: usize> ImplicitFriction<'_, N> {
    /// The speeds `v` at which `matrix · (v − from) + friction(v) = pulling`.
    ///
    /// * `matrix` - torque per unit of speed \[N m s/rad\]; with positive definite symmetric part
    /// * `from`, `pulling` - speeds \[rad/s\], and what pulls there besides friction \[N m\]
    /// * `near` - speeds at which the search starts \[rad/s\]
    ///
    /// `None` for a matrix without an inverse.
    ///
    /// ```
    /// use arm_core::Joints;
    /// use arm_sim::{ImplicitFriction, SmoothFriction};
    /// // An inertia of 2 kg m² turning at 0.5 rad/s, braked by 0.1 N m for 1 s: by set-valued friction, and by smooth friction.
    /// let (inertia, from) = (nalgebra::Matrix1::new(2.0), Joints::<f64, 1>::repeat(0.5));
    /// let smooth = [SmoothFriction { joint: 0, most: 0.1, smoothing: 1e-4 }];
    /// let none = Joints::zeros();
    /// for (set_valued, smooth) in [(Joints::repeat(0.1), &[][..]), (none, &smooth[..])] {
    ///     let friction = ImplicitFriction { set_valued, smooth };
    ///     let after = friction.solve(&inertia, (&from, &none), &from).expect("a mass");
    ///     assert!((after.speed[0] - 0.45).abs() < 1e-12);
    /// }
    /// ```
    pub fn solve(
        &self,
        matrix: &SMatrix<f64, N, N>,
        (from, pulling): (&Joints<f64, N>, &Joints<f64, N>),
        near: &Joints<f64, N>,
    ) -> Option<WithFriction<N>> {
        /// Rounds in which all joints change their mode at once, a joint that turns round takes about ten; and most rounds.
        const ROUNDS: (usize, usize) = (20, 600);
        let mut search = Search::new(self, near);
        for round in 0..ROUNDS.1 {
            let (smooth, slope) = SmoothFriction::sum(self.smooth, &search.speed);
            let left = pulling - matrix * (search.speed - from) - smooth - search.slipping();
            let change = search.step(*matrix, left, &slope)?;
            // Several joints may change to and fro together; one at a time, and by short steps, they do not.
            let is_careful = round >= ROUNDS.0;
            let change = match is_careful && !self.smooth.is_empty() {
                true => change * 0.5,
                false => change,
            };
            let is_near = !search.go(&change) && search.is_near(&change);
            if !is_careful && search.hold_turned() || !is_near {
                continue;
            }
            let (smooth, _) = SmoothFriction::sum(self.smooth, &search.speed);
            let held = pulling - matrix * (search.speed - from) - smooth;
            let wrong = |&j: &usize| search.is_turned(j) || search.is_pulled(j, held[j]);
            let Some(joint) = (0..N).find(wrong) else {
                return Some(search.found(&held, true));
            };
            search.exchange(joint, held[joint]);
        }
        Some(search.found(pulling, false))
    }
}

/// Newton's method, and what set-valued friction does meanwhile.
struct Search<'a, const N: usize> {
    friction: &'a ImplicitFriction<'a, N>,
    speed: Joints<f64, N>,
    /// Direction against which set-valued friction resists; zero where it holds the joint, or there is none.
    way: Joints<f64, N>,
    held: [bool; N],
    /// Speed within which the smooth friction of a joint is about linear; infinite where there is none.
    linear: [f64; N],
}

impl<'a, const N: usize> Search<'a, N> {
    fn new(friction: &'a ImplicitFriction<'a, N>, near: &Joints<f64, N>) -> Self {
        let mut linear = [f64::INFINITY; N];
        for smooth in friction.smooth {
            let own = &mut linear[smooth.joint];
            *own = own.min(smooth.smoothing);
        }
        let dry = |j: usize| friction.set_valued[j] > 0.0;
        let way = |j: usize, _| match dry(j) && near[j] != 0.0 {
            true => near[j].signum(),
            false => 0.0,
        };
        Self {
            friction,
            speed: *near,
            way: Joints::from_fn(way),
            held: core::array::from_fn(|j| dry(j) && near[j] == 0.0),
            linear,
        }
    }

    /// Torque of set-valued friction of the joints that slip \[N m\].
    fn slipping(&self) -> Joints<f64, N> {
        self.friction.set_valued.component_mul(&self.way)
    }

    /// Newton's step for what is left; `None` for a matrix without an inverse.
    fn step(
        &self,
        mut matrix: SMatrix<f64, N, N>,
        mut left: Joints<f64, N>,
        slope: &Joints<f64, N>,
    ) -> Option<Joints<f64, N>> {
        for j in 0..N {
            if self.held[j] {
                for k in 0..N {
                    matrix[(j, k)] = 0.0;
                }
                matrix[(j, j)] = 1.0;
                left[j] = 0.0;
            } else {
                matrix[(j, j)] += slope[j];
            }
        }
        matrix.try_inverse().map(|inverse| inverse * left)
    }

    /// Makes a step; whether a joint with smooth friction would turn round in it, and stops at zero.
    ///
    /// Beyond zero, where the law is steepest, it is far from linear; from zero on its slope falls, so that a step is never too long.
    fn go(&mut self, change: &Joints<f64, N>) -> bool {
        let mut stops = false;
        for j in 0..N {
            let (before, after) = (self.speed[j], self.speed[j] + change[j]);
            let is_beyond = before * after < 0.0 && before.abs() > self.linear[j];
            self.speed[j] = if is_beyond { 0.0 } else { after };
            stops |= is_beyond;
        }
        stops
    }

    /// Whether a joint moves the way in which set-valued friction pulls it.
    fn is_turned(&self, joint: usize) -> bool {
        self.way[joint] * self.speed[joint] < 0.0
    }

    /// Whether a joint is held against more than its set-valued friction.
    fn is_pulled(&self, joint: usize, pulling: f64) -> bool {
        /// Torque that is rounding, as a share.
        const ROUNDING: f64 = 1e-12;
        let most = self.friction.set_valued[joint];
        self.held[joint] && pulling.abs() > most * (1.0 + ROUNDING)
    }

    /// Holds all joints that have turned round; whether there are any.
    fn hold_turned(&mut self) -> bool {
        let mut any = false;
        for j in 0..N {
            if self.is_turned(j) {
                self.exchange(j, 0.0);
                any = true;
            }
        }
        any
    }

    /// Holds a joint that slips, or lets one slip that is held against a pull.
    fn exchange(&mut self, joint: usize, pulling: f64) {
        if self.held[joint] {
            (self.held[joint], self.way[joint]) = (false, pulling.signum());
        } else {
            (self.held[joint], self.way[joint], self.speed[joint]) = (true, 0.0, 0.0);
        }
    }

    /// Whether a step was so short that the next one would be rounding, as each is about the square of the one before.
    fn is_near(&self, change: &Joints<f64, N>) -> bool {
        /// Share of the speed within which friction is linear.
        const NEAR: f64 = 1e-5;
        (0..N).all(|j| change[j].abs() <= NEAR * self.linear[j])
    }

    fn found(&self, pulling: &Joints<f64, N>, exact: bool) -> WithFriction<N> {
        let mut set_valued = self.slipping();
        for j in (0..N).filter(|&j| self.held[j]) {
            let most = self.friction.set_valued[j];
            set_valued[j] = pulling[j].clamp(-most, most);
        }
        WithFriction {
            speed: self.speed,
            set_valued,
            exact,
        }
    }
}
