//! Errors of experiments, and of runs.

use arm_core::{Invalid, Shown};

/// Why a simulation was refused or stopped.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// A value of the rig or of an effect that was refused.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// A setting outside what is allowed.
    #[error("{name} is {}, allowed is {allowed}", Shown(*found))]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// The value found, SI units.
        found: f64,
        /// The values allowed, in words.
        allowed: &'static str,
    },
    /// An effect that depends on muscle activity, where none is given.
    #[error("{kind} depends on muscle activity, and none is given")]
    NoActivity {
        /// Kind of the effect.
        kind: &'static str,
    },
    /// A table of samples that cannot be a function of time.
    #[error("{name}, sample {sample}: {problem}")]
    Samples {
        /// What the table holds.
        name: &'static str,
        /// One-based sample.
        sample: usize,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// A drive that is not known for the whole run.
    #[error("{name} is known from {from} s to {to} s, the run needs 0 s to {needed} s")]
    TooShort {
        /// What ends too early.
        name: &'static str,
        /// First time known \[s\].
        from: f64,
        /// Last time known \[s\].
        to: f64,
        /// Last time needed \[s\].
        needed: f64,
    },
    /// A rigidly held tip takes two freedoms; an arm of one joint has only one.
    #[error(
        "a rigid coupling holds the tip in y and z and needs at least 2 joints, the arm has {joints}"
    )]
    RigidCoupling {
        /// Joints of the arm.
        joints: usize,
    },
    /// A handle position that the robot cannot reach.
    #[error(
        "at {time} s the handle is {distance} m from the robot's base, its reach is {min} m to {max} m"
    )]
    Unreachable {
        /// First time out of reach \[s\].
        time: f64,
        /// Distance of the handle from the robot's base \[m\].
        distance: f64,
        /// Shortest reach \[m\].
        min: f64,
        /// Longest reach \[m\].
        max: f64,
    },
    /// The arm does not come to rest near the angles given.
    #[error("start: found {0}, allowed are angles near which the arm can rest")]
    NoEquilibrium(#[from] NoRest),
    /// The tip cannot be brought to the handle.
    #[error("the tip of the arm is {gap} m from the handle that holds it rigidly")]
    Gap {
        /// Distance left \[m\].
        gap: f64,
    },
    /// A contact too stiff for the step.
    #[error(
        "the contact vibrates at {frequency} rad/s with damping rate {damping} 1/s; \
         this integrator is stable for steps up to {largest} s, the step is {dt} s"
    )]
    TooStiff {
        /// Largest eigenfrequency \[rad/s\].
        frequency: f64,
        /// Largest damping rate \[1/s\].
        damping: f64,
        /// Largest stable step \[s\].
        largest: f64,
        /// Requested step \[s\].
        dt: f64,
    },
    /// The state ceased to be finite.
    #[error("the state is not finite after step {step} at {time} s, first in joint {}", joint + 1)]
    Diverged {
        /// Steps made.
        step: usize,
        /// Time \[s\].
        time: f64,
        /// Zero-based joint.
        joint: usize,
    },
    /// Friction that grows with the force through its joint so fast that it has no unique solution.
    #[error(
        "at {time} s the friction torque of joint {} has no unique solution: it increases the joint force on which it depends, with a loop gain of {gain:.3}, allowed is less than 0.98; the friction coefficient is too large for this arm",
        joint + 1
    )]
    AmbiguousFriction {
        /// Time \[s\].
        time: f64,
        /// Zero-based joint.
        joint: usize,
        /// Its loop gain through the joint force \[N m per N m\].
        gain: f64,
    },
    /// An accuracy that no admissible step reaches.
    #[error(
        "at a step of {dt:.3e} s the angles are accurate to {reached:.2e} rad, requested are {requested:e} rad; steps shorter than 1e-6 s are not tried"
    )]
    Accuracy {
        /// Requested accuracy \[rad\].
        requested: f64,
        /// Estimated error at the shortest step \[rad\].
        reached: f64,
        /// That step \[s\].
        dt: f64,
    },
    /// More memory than there is.
    #[error("the result needs {} of memory, {}", Bytes(*needed), remaining(*available))]
    Memory {
        /// What it needs \[bytes\].
        needed: u64,
        /// What this process can get, where that is known \[bytes\].
        available: Option<u64>,
    },
    /// Something that an engine cannot do.
    #[error("the {engine} engine cannot simulate {what}")]
    Unsupported {
        /// Name of the engine.
        engine: &'static str,
        /// The feature that was requested.
        what: &'static str,
    },
}

/// A size in memory as text: three digits and a prefix.
struct Bytes(u64);

impl core::fmt::Display for Bytes {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        const UNITS: [&str; 7] = ["B", "kB", "MB", "GB", "TB", "PB", "EB"];
        let mut value = self.0 as f64;
        let mut unit = 0;
        while value >= 999.5 && unit + 1 < UNITS.len() {
            (value, unit) = (value / 1000.0, unit + 1);
        }
        let decimals = if value >= 99.95 || unit == 0 { 0 } else { 1 };
        write!(f, "{value:.decimals$} {}", UNITS[unit])
    }
}

/// How much there is, as text.
fn remaining(available: Option<u64>) -> String {
    available.map_or("more than the system gives".to_owned(), |bytes| {
        format!("{} are available", Bytes(bytes))
    })
}

/// Why an arm has no equilibrium near given angles.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoRest {
    /// None was found.
    #[error(
        "no static equilibrium near these angles ({residual:.3} N m are left after {iterations} iterations)"
    )]
    Unbalanced {
        /// Largest torque left \[N m\], or gap left \[m\].
        residual: f64,
        /// Steps of the search.
        iterations: usize,
    },
    /// A maximum or a saddle of the potential energy.
    #[error(
        "an unstable equilibrium, such as that of an upright arm; try angles that differ by a few degrees"
    )]
    Unstable,
    /// Nothing holds a joint.
    #[error(
        "that joint {} turns more than twice: no spring or weight holds it",
        joint + 1
    )]
    FallsAway {
        /// Zero-based joint.
        joint: usize,
    },
    /// It comes to rest elsewhere.
    #[error(
        "that joint {} comes to rest {:.0}° from its angle, more than half a turn; the arm rests at {}°",
        joint + 1,
        turned.to_degrees(),
        degrees(rest)
    )]
    Far {
        /// Zero-based joint.
        joint: usize,
        /// How far it turns \[rad\].
        turned: f64,
        /// Angles at which the arm rests \[rad\].
        rest: Vec<f64>,
    },
}

fn degrees(angles: &[f64]) -> String {
    let listed: Vec<String> = angles
        .iter()
        .map(|angle| format!("{}", (angle.to_degrees() * 1e4).round() / 1e4))
        .collect();
    listed.join(",")
}

/// Refuses a setting that is not finite.
pub(crate) fn finite(
    name: &'static str,
    found: f64,
    allowed: &'static str,
) -> Result<(), SimulationError> {
    if found.is_finite() {
        return Ok(());
    }
    Err(SimulationError::Setting {
        name,
        found,
        allowed,
    })
}
