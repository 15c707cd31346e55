//! The parts of a result of the gap workflow.

use arm_gap::results as core;
use pyo3::prelude::*;

use super::class::{digits, result_class};

result_class! {
    /// One parameter of a named effect.
    Value of core::Value, in "armrs.workflows.gap" {
        /// In `unit`.
        value: f64, "";
        /// Standard deviation; None for a value that was held.
        std: Option<f64>, "";
        /// SI unit.
        unit: String, "";
        /// The 95 % interval, within what its kind allows.
        interval: Option<(f64, f64)>, "", or None;
    }
}

#[pymethods]
impl Value {
    /// Return a value with its interval; `limits` are the smallest and the largest value that its kind allows.
    #[staticmethod]
    fn of(value: f64, std: Option<f64>, unit: &str, limits: (f64, f64)) -> Self {
        Self(core::Value::of(value, std, unit, limits))
    }
}

result_class! {
    /// A movement that would distinguish two explanations.
    Separation of core::Separation, in "armrs.workflows.gap" {
        /// Joint angles, a tuple a waypoint [deg].
        waypoints_deg: Vec<Vec<f64>>, "deg";
        /// Largest of any joint [rad/s].
        speed_rad_s: f64, "rad/s";
        /// Largest of any joint [rad/s²].
        acceleration_rad_s2: f64, "rad/s²";
        /// "trapezoid" or "smooth".
        shape: String, "";
        /// Distance of the two in standard deviations by the fit trials alone, everything refitted.
        now: f64, "standard deviations";
        /// The same with one such trial more.
        then: f64, "standard deviations";
    }
}

result_class! {
    /// Another effect that would explain what a named one does.
    Alternative of core::Alternative, in "armrs.workflows.gap" {
        /// Its kind.
        kind: String, "";
        /// Joint or segment where it acts, from 1.
        joint: Option<usize>, "";
        /// Channel of the force sensor where it acts.
        channel: Option<String>, "";
        /// How well it explains the data.
        why: String, "";
        /// How much worse it does, in units of twice the log-likelihood; a few units decide nothing.
        worse: f64, "";
        /// Squared cosine between what the two would show on these movements: 1 cannot be distinguished; NaN where it was not computed.
        likeness: f64, "";
        /// A movement that would distinguish the two, in words; its numbers are in `separation`.
        separating_movement: Option<String>, "", or None;
        /// The movement as numbers.
        separation: Option<core::Separation>, "", or None;
        /// The effect as it fits best; not in JSON.
        simulated: Option<arm_model::Effect>, "", or None;
        /// Positions of the parameters that were fitted; not in JSON.
        free: Vec<usize>, "", or Vec::new();
    }
}

result_class! {
    /// An effect that the model lacks.
    Missing of core::Missing, in "armrs.workflows.gap" {
        /// Its kind.
        kind: String, "";
        /// Joint or segment where it acts, from 1.
        joint: Option<usize>, "";
        /// Channel of the force sensor where it acts.
        channel: Option<String>, "";
        /// Its parameters by name, with signs as in the files.
        parameters: core::Named<core::Value>, "";
        /// Probability of such a gain by chance in any of the tests that were made.
        p_value: f64, "";
        /// Share of what can be explained that is lost without it.
        share: f64, "";
        /// What else explains the data.
        alternatives: Vec<core::Alternative>, "", or Vec::new();
        /// Where it was in one trial only, its file; None for what is in all of them.
        trial: Option<String>, "", or None;
        /// When it acted there [s].
        span: Option<(f64, f64)>, "s", or None;
        /// The family of effects that it belongs to: `dry`, `rate`, `elastic`, `two_joints`, `segment`, `frame`, `contact`, `sensor` or
        /// `muscle`.
        family: String, "", or String::new();
        /// False where an alternative explains the data as well.
        decided: bool, "", or true;
        /// What the model would be off by without it, everything else refitted: root mean square in units of what repeats differ by. None
        /// without repeats, and for what was set apart.
        without: Option<f64>, "", or None;
        /// The effect as it is simulated: its force is on the arm; not in JSON.
        simulated: Option<arm_model::Effect>, "", or None;
    }
}

#[pymethods]
impl Missing {
    fn __str__(&self, py: Python<'_>) -> PyResult<String> {
        let of = &self.0;
        let place = match (of.joint, &of.channel) {
            (Some(joint), _) => format!(" joint {joint}"),
            (None, Some(channel)) => format!(" {channel}"),
            (None, None) => String::new(),
        };
        let value = |(name, v): (&String, &core::Value)| {
            let std = v.std.filter(|std| *std != 0.0);
            let std = std.map(|std| digits(py, std, ".2g")).transpose()?;
            let std = std.map_or_else(String::new, |std| format!(" ± {std}"));
            let size = digits(py, v.value, ".4g")?;
            Ok(format!("{name} = {size}{std} {}", v.unit))
        };
        let values = of.parameters.iter().map(value);
        let values = values.collect::<PyResult<Vec<String>>>()?;
        Ok(format!("{}{place}: {}", of.kind, values.join(", ")))
    }
}

result_class! {
    /// Somewhere that simulation and data disagree.
    Place of core::Place, in "armrs.workflows.gap" {
        /// File of the trial.
        trial: String, "";
        /// Name of the channel, with its unit.
        channel: String, "";
        /// Start [s].
        t_start: f64, "s";
        /// End [s].
        t_end: f64, "s";
        /// Joint, from 1.
        joint: Option<usize>, "";
        /// Region of movement: `dq2 > 0`, `dq2 < 0`, `dq2 = 0`.
        condition: String, "";
        /// Mean difference there, in the unit of the channel.
        mean: f64, "";
        /// The mean in its standard deviations; the correlation of residuals in time is taken into account.
        z: f64, "standard deviations";
    }
}

result_class! {
    /// Where the gap of a channel is open on the test trials.
    Open of core::Open, in "armrs.workflows.gap" {
        /// File of the trial.
        trial: String, "";
        /// Start of the piece of the trial that exceeds the floor by most [s].
        t_start: f64, "s";
        /// Its end [s].
        t_end: f64, "s";
        /// Root mean square of simulated less measured there, in the unit of the channel; None for a trial that cannot be simulated.
        size: Option<f64>, "";
    }
}

result_class! {
    /// Root mean square difference of simulation and data in one channel over the test trials, in the unit of the channel.
    ChannelGap of core::ChannelGap, in "armrs.workflows.gap" {
        /// With the model as given.
        before: Option<f64>, "";
        /// After refitting what the tolerances allow.
        calibrated: Option<f64>, "";
        /// With the named effects.
        after: Option<f64>, "";
        /// What repeats of one movement differ by; None without repeats.
        floor: Option<f64>, "";
        /// Standard deviation of `after` less `floor` where nothing is missing: both are estimates.
        floor_std: Option<f64>, "", or None;
        /// Where `after` exceeds the floor by more than these allow; a list of its own in JSON.
        open: Option<core::Open>, "", or None;
    }
}

#[pymethods]
impl ChannelGap {
    /// Share of the calibrated gap above the floor that is gone, 1 where all of it is.
    #[getter]
    fn closed(&self) -> Option<f64> {
        self.0.closed()
    }
}

result_class! {
    /// A small imperfection that was refitted, beside twice the standard deviation that was known of it beforehand.
    Absorbed of core::Absorbed, in "armrs.workflows.gap" {
        /// What it is, in words.
        name: String, "";
        /// Its value, in `unit`.
        value: f64, "";
        /// Twice the tolerance of the data set, or twice the `segment_uncertainty` of the model.
        promised: f64, "";
        /// SI unit; "of its value" for what is relative.
        unit: String, "";
    }
}

result_class! {
    /// An effect that was tested and not named: the smallest size that these data would have shown, and what it would explain.
    Limit of core::Limit, in "armrs.workflows.gap" {
        /// Its kind.
        kind: String, "";
        /// Joint or segment where it would act, from 1.
        joint: Option<usize>, "";
        /// Channel of the force sensor where it would act.
        channel: Option<String>, "";
        /// The parameter that is its size.
        parameter: String, "";
        /// Smallest size of the parameter that would have been named, in `unit`; `None` where the data show no size of it.
        at_least: Option<f64>, "";
        /// SI unit of the parameter.
        unit: String, "";
        /// What it would still explain, in units of twice the log-likelihood.
        gain: f64, "", or 0.0;
        /// What it would have to explain to be named.
        price: f64, "", or 0.0;
    }
}

result_class! {
    /// An effect alone, to first order.
    Suspect of core::Suspect, in "armrs.workflows.gap" {
        /// Its kind.
        kind: String, "";
        /// Joint or segment where it would act, from 1.
        joint: Option<usize>, "";
        /// Channel of the force sensor where it would act.
        channel: Option<String>, "";
        /// What is free in it, as it would be.
        parameters: core::Named<f64>, "";
        /// SI unit of the first.
        unit: String, "";
        /// What it would explain, in units of twice the log-likelihood.
        gain: f64, "";
        /// What it must explain to be named.
        price: f64, "";
        /// Smallest size of the first parameter that would be named.
        smallest: f64, "";
    }
}

result_class! {
    /// Effects that were added together and converged by simulation.
    Tried of core::Tried, in "armrs.workflows.gap" {
        /// Kind, joint from 1, and channel of each.
        effects: Vec<(String, Option<usize>, Option<String>)>, "";
        /// What they gained, in units of twice the log-likelihood.
        gain: f64, "";
    }
}

result_class! {
    /// One round of the search.
    SearchStep of core::SearchStep, in "armrs.workflows.gap" {
        /// What was converged by simulation, best first.
        tried: Vec<core::Tried>, "";
        /// Misfit before the round.
        before: f64, "";
        /// Misfit with the best of what was tried.
        after: f64, "";
    }
}

/// What of a fitted model stands beside the amended model.
pub fn add(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<Value>()?;
    m.add_class::<Separation>()?;
    m.add_class::<Alternative>()?;
    m.add_class::<Missing>()?;
    m.add_class::<Place>()?;
    m.add_class::<Open>()?;
    m.add_class::<ChannelGap>()?;
    m.add_class::<Absorbed>()?;
    m.add_class::<Limit>()?;
    m.add_class::<Suspect>()?;
    m.add_class::<Tried>()?;
    m.add_class::<SearchStep>()
}
