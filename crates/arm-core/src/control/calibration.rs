//! Sensor readings as one affine map of the true values, and its inverse for devices.

use core::array::from_fn;

use crate::effect::{ActsOn, Effect};
use crate::{Chain, Contact, Invalid, Joints, Reading, Scalar, Setup, joints};

/// `q_read = q + angle_offset`, `[Fy, Fz, Mx]_read = force · [Fy, Fz, Mx] + force_offset`, forces `force_delay` late.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration<T, const N: usize> {
    /// \[rad\]
    pub angle_offset: [T; N],
    /// Gains and misalignment, row by row.
    pub force: [[T; 3]; 3],
    /// \[N, N, N m\]
    pub force_offset: [T; 3],
    /// \[s\]
    pub force_delay: T,
}

/// Farthest that a map may be from affine, of values of the order of one.
const ROUNDING: f64 = 1e-9;

impl<T: Scalar, const N: usize> Calibration<T, N> {
    /// Of the effects that act on the sensors; the others count nothing.
    ///
    /// # Errors
    /// The index of the first effect that is no such map, as a drift is not, and [`Invalid::CannotAct`].
    pub fn of(chain: &Chain<T, N>, effects: &[Effect<T>]) -> Result<Self, (usize, Invalid)> {
        for (index, effect) in effects.iter().enumerate() {
            if effect.on && !constant::<T, N>(effect) {
                let kind = effect.kind.info().kind;
                return Err((index, Invalid::CannotAct { kind }));
            }
        }
        let mut setup = Setup::new(chain, Contact::new([T::ZERO; 2], [T::ZERO; 2]));
        for effect in effects.iter().filter(|e| of_sensors(e)) {
            effect.alter(&mut setup);
        }
        let zero = read::<T, N>(effects, T::ZERO, [T::ZERO; 3]);
        let columns: [[T; 3]; 3] = from_fn(|k| {
            let unit = from_fn(|i| if i == k { T::ONE } else { T::ZERO });
            let one = forces(&read::<T, N>(effects, T::ZERO, unit));
            from_fn(|i| one[i] - forces(&zero)[i])
        });
        Ok(Self {
            angle_offset: zero.q.into(),
            force: from_fn(|i| from_fn(|k| columns[k][i])),
            force_offset: forces(&zero),
            force_delay: setup.force_delay,
        })
    }
}

fn of_sensors<T>(effect: &Effect<T>) -> bool {
    effect.on && effect.kind.acts_on() == ActsOn::Sensors
}

/// What is read at a time, all angles zero.
fn read<T: Scalar, const N: usize>(effects: &[Effect<T>], time: T, force: [T; 3]) -> Reading<T, N> {
    let mut reading = Reading {
        time,
        q: joints([T::ZERO; N]),
        force_on_arm: [force[0], force[1]],
        moment_on_arm: force[2],
    };
    for effect in effects.iter().filter(|e| of_sensors(e)) {
        effect.distort(&mut reading);
    }
    reading
}

fn forces<T: Scalar, const N: usize>(reading: &Reading<T, N>) -> [T; 3] {
    let [y, z] = reading.force_on_arm;
    [y, z, reading.moment_on_arm]
}

/// Whether what an effect does to a reading is the same at any time.
fn constant<T: Scalar, const N: usize>(effect: &Effect<T>) -> bool {
    let one = core::slice::from_ref(effect);
    let force = [T::of(1.25), T::of(-0.75), T::of(0.5)];
    let [now, later] = [0.0, 60.0].map(|time| read::<T, N>(one, T::of(time), force));
    let angles: Joints<T, N> = now.q - later.q;
    let changes = (0..3).map(|i| forces(&now)[i] - forces(&later)[i]);
    angles
        .iter()
        .copied()
        .chain(changes)
        .all(|change| change.within(-ROUNDING, ROUNDING))
}
