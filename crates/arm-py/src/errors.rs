//! Conversion of errors of the core to Python's.

use arm_core::{Invalid, Shown};
use arm_gap::GapError;
use arm_ident::IdentError;
use arm_numerics::NumericsError;
use arm_sim::SimulationError;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;

/// `armrs.errors.BadInput` for an argument.
pub fn bad_input(place: &str, found: impl std::fmt::Display, allowed: &str) -> PyErr {
    Python::attach(|py| {
        let made = py.import("armrs.errors").and_then(|errors| {
            let text = errors.getattr("Text")?.call1((found.to_string(),))?;
            errors.getattr("BadInput")?.call1((place, text, allowed))
        });
        match made {
            Ok(error) => PyErr::from_value(error),
            Err(error) => error,
        }
    })
}

/// A refusal of a model or a description as `BadInput`.
pub fn refused(error: arm_model::Refused) -> PyErr {
    Python::attach(|py| {
        let made = py.import("armrs.errors").and_then(|errors| {
            let text = errors.getattr("Text")?.call1((error.found,))?;
            let named = pyo3::types::PyDict::new(py);
            named.set_item("file", error.file.as_deref())?;
            named.set_item("hint", error.hint)?;
            named.set_item("kind", error.kind.name())?;
            let class = errors.getattr("BadInput")?;
            class.call((error.place, text, error.allowed), Some(&named))
        });
        match made {
            Ok(error) => PyErr::from_value(error),
            Err(error) => error,
        }
    })
}

/// A refusal of the core as `BadInput`.
pub fn invalid(error: Invalid) -> PyErr {
    match error {
        Invalid::NotFinite { name, index } => bad_input(
            &format!("{name} {}", index + 1),
            "a value that is not finite",
            "a finite number",
        ),
        Invalid::OutOfRange {
            name,
            index,
            found,
            min,
            max,
        } => {
            // The smallest positive number of either precision stands for "above zero", unless what was found lies between the two; the
            // largest stands for "any".
            let positive =
                min > 0.0 && min <= f64::from(f32::MIN_POSITIVE) && !(found > 0.0 && found < min);
            let any = max >= f64::from(f32::MAX);
            let (low, high) = (Shown(min), Shown(max));
            let allowed = match (positive, any) {
                (true, true) => "more than 0".to_owned(),
                (true, false) => format!("more than 0, at most {high}"),
                (false, true) => format!("at least {low}"),
                (false, false) => format!("{low} to {high}"),
            };
            bad_input(&format!("{name} {}", index + 1), Shown(found), &allowed)
        }
        Invalid::OutOfReach { distance, min, max } => bad_input(
            "handle",
            format!("{} from the robot's base", metres(distance)),
            &format!("{} to {}", metres(min), metres(max)),
        ),
        other => bad_input("argument", other, "a known name"),
    }
}

/// A refusal or failure of an identification: bad data and limits that nothing respects are `BadInput`, the rest is `IdentificationError`.
pub fn identification(error: impl Into<IdentError>) -> PyErr {
    let (number, error) = match error.into() {
        IdentError::InTrial { number, error } => (Some(number), *error),
        error => (None, error),
    };
    let refused = match error {
        IdentError::Numerics(NumericsError::TooFew {
            name,
            found,
            expected,
        }) => bad_input(name, found, &format!("at least {expected}")),
        IdentError::Numerics(NumericsError::OutOfRange {
            name,
            found,
            min,
            max,
        }) => bad_input(
            name,
            Shown(found),
            &format!("{} to {}", Shown(min), Shown(max)),
        ),
        IdentError::NoPlan {
            evaluations,
            nearest,
        } => bad_input(
            nearest.limit.name(),
            format!(
                "{} in the nearest of {evaluations} movements",
                nearest.found_text()
            ),
            &format!("{} {}", nearest.allowed, nearest.limit.words()[1]),
        ),
        IdentError::Numerics(NumericsError::Rank {
            found, expected, ..
        }) => in_python(
            "IdentificationError",
            &format!(
                "the data determine {found} of {expected} unknowns and nothing is known beforehand of the others: \
                 leave out effects that these movements do not show"
            ),
        ),
        other => in_python("IdentificationError", &other.to_string()),
    };
    match number {
        Some(number) => of_trial(refused, number - 1),
        None => refused,
    }
}

/// An error with its trial, from 0; Python, which has the files, names it.
fn of_trial(error: PyErr, index: usize) -> PyErr {
    Python::attach(|py| match error.value(py).setattr("trial", index) {
        Ok(()) => error.clone_ref(py),
        Err(other) => other,
    })
}

/// A call that a co-simulation slave did not do, as `SlaveError`.
pub fn slave(function: &str, refused: arm_cosim::Refused) -> PyErr {
    Python::attach(|py| {
        let made = py.import("armrs.errors").and_then(|errors| {
            let arguments = (function, refused.status as i32, refused.message);
            errors.getattr("SlaveError")?.call1(arguments)
        });
        match made {
            Ok(error) => PyErr::from_value(error),
            Err(error) => error,
        }
    })
}

/// An error of the tree in `armrs.errors` with a text.
fn in_python(class: &str, text: &str) -> PyErr {
    Python::attach(|py| {
        match py
            .import("armrs.errors")
            .and_then(|e| e.getattr(class)?.call1((text,)))
        {
            Ok(error) => PyErr::from_value(error),
            Err(error) => error,
        }
    })
}

/// A refusal or failure of a simulation: wrong input is `BadInput`, a run that stopped is `SimulationError`.
pub fn simulation(error: SimulationError) -> PyErr {
    match error {
        SimulationError::Invalid(error) => invalid(error),
        SimulationError::Setting {
            name,
            found,
            allowed,
        } => bad_input(name, found, allowed),
        SimulationError::NoActivity { kind } => bad_input(
            "effects of the model",
            kind,
            "muscle activity, in a trial with emg columns and [[muscle]] in dataset.toml: identify and simulate alone follow it",
        ),
        SimulationError::Samples {
            name,
            sample,
            problem,
        } => bad_input(
            &format!("{name}, sample {sample}"),
            problem,
            "finite samples at increasing times",
        ),
        SimulationError::Unreachable {
            time,
            distance,
            min,
            max,
        } => bad_input(
            &format!("handle at {time} s"),
            format!("{} from the robot's base", metres(distance)),
            &format!("{} to {}", metres(min), metres(max)),
        ),
        // A little less than the largest, so that its rounded digits can be taken.
        SimulationError::TooStiff {
            frequency,
            largest,
            dt,
            ..
        } => bad_input(
            "dt",
            format!("{dt} s"),
            &format!(
                "at most {:.2e} s: the contact vibrates at {frequency:.4} rad/s",
                0.995 * largest
            ),
        ),
        error @ SimulationError::Memory { .. } => PyMemoryError::new_err(error.to_string()),
        other => in_python("SimulationError", &other.to_string()),
    }
}

/// A length to the micrometre, without trailing zeros.
fn metres(value: f64) -> String {
    let digits = format!("{value:.6}");
    format!("{} m", digits.trim_end_matches('0').trim_end_matches('.'))
}

/// A refusal or failure of the gap workflow.
pub fn gap(error: GapError) -> PyErr {
    match error {
        GapError::Data {
            what,
            found,
            allowed,
        } => bad_input(what, found, allowed),
        GapError::Numerics(error) => identification(error),
        GapError::Simulation { trial, source } => {
            of_trial(in_python("SimulationError", &source.to_string()), trial)
        }
        other => in_python("IdentificationError", &other.to_string()),
    }
}
