//! The gap of each channel on the test trials.

use std::sync::Arc;

use serde::Serialize;

use super::Named;
use super::simulated_trial::{SimulatedTrial, Version, free_size, size};
use crate::selection::held_out::{HeldOutGap, TrialResidual, held_out};

/// Where the gap of a channel is open on the test trials.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Open {
    /// File of the trial.
    pub trial: String,
    /// Start of the piece of the trial that exceeds the floor by most \[s\].
    pub t_start: f64,
    /// Its end \[s\].
    pub t_end: f64,
    /// Root mean square of simulated less measured there; `None` for a trial that cannot be simulated.
    pub size: Option<f64>,
}

/// Root mean square difference of simulation and data in one channel, over the test trials.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ChannelGap {
    /// With the model as given.
    pub before: Option<f64>,
    /// After refitting what the tolerances allow.
    pub calibrated: Option<f64>,
    /// With the named effects.
    pub after: Option<f64>,
    /// What repeats of one movement differ by; `None` without repeats.
    pub floor: Option<f64>,
    /// Standard deviation of `after` less `floor` where nothing is missing: both are estimates.
    pub floor_std: Option<f64>,
    /// Where `after` exceeds the floor by more than these allow; a list of its own in JSON.
    #[serde(skip)]
    pub open: Option<Open>,
}

impl ChannelGap {
    /// With the model as given, calibrated and amended.
    fn of([before, calibrated, after]: [Option<f64>; 3]) -> Self {
        Self {
            before,
            calibrated,
            after,
            ..Self::default()
        }
    }

    /// Share of the calibrated gap above the floor that is gone, 1 where all of it is.
    pub fn closed(&self) -> Option<f64> {
        let (calibrated, after, floor) = (self.calibrated?, self.after?, self.floor?);
        let above = calibrated - floor;
        (above > 0.0).then(|| f64::min((calibrated - after) / above, 1.0))
    }
}

/// Names of the channels that are compared: angles and forces of a led arm, else joint torques.
pub fn channel_names(joints: usize, led: bool) -> Vec<String> {
    let joints = 1..=joints;
    if led {
        let angles = joints.map(|j| format!("q{j}_rad"));
        angles.chain(["Fy_N", "Fz_N"].map(str::to_owned)).collect()
    } else {
        joints.map(|j| format!("tau{j}_Nm")).collect()
    }
}

/// The test of every channel's gap for a version.
///
/// The floor is what test trials differ by from repeats of them, after their own simulated differences: their own noise, and not that of all
/// trials, for it is in what is left on them as well. Where no test trial has a repeat, what the repeats of other movements differ by.
fn tested(trials: &[SimulatedTrial], version: Version) -> Vec<HeldOutGap> {
    let left: Vec<TrialResidual> = trials
        .iter()
        .map(|t| TrialResidual {
            group: t.group,
            test: t.test,
            rate: t.rate,
            residuals: t.version(version).map(|shown| {
                let channels = t.measured.iter().zip(shown);
                let one =
                    |(m, s): (&Vec<f64>, &Vec<f64>)| m.iter().zip(s).map(|(m, s)| m - s).collect();
                channels.map(one).collect()
            }),
            counted: t.counted.clone(),
        })
        .collect();
    held_out(&left)
}

fn opened(gap: &HeldOutGap, trials: &[SimulatedTrial]) -> Option<Open> {
    gap.open.map(|open| Open {
        trial: trials[open.trial].file.clone(),
        t_start: open.span.0,
        t_end: open.span.1,
        size: open.size.is_finite().then_some(open.size),
    })
}

/// The gap of every channel on the test trials; `last` is the last version that there is.
///
/// Of a rig without a robot these are joint torques by inverse dynamics of the measured angles, both low-passed at the common band, away
/// from ends and gaps, reversals and rests included; and the angles of a run from the state that explains the first second best: a free
/// swing to the end of the trial, a driven arm for that second, with the measured torques.
pub(super) fn channel_gaps(
    trials: &[SimulatedTrial],
    (joints, led): (usize, bool),
    last: Version,
) -> Named<ChannelGap> {
    let tests = || trials.iter().filter(|t| t.test);
    let tested = tested(trials, last);
    let channel = |(c, name): (usize, String)| {
        let gap = tested.get(c);
        let gap = ChannelGap {
            floor: gap.and_then(|g| g.floor),
            floor_std: gap.and_then(|g| g.floor_std),
            open: gap.and_then(|g| opened(g, trials)),
            ..ChannelGap::of(Version::ALL.map(|v| size(tests(), v, c)))
        };
        (name, gap)
    };
    let mut all: Named<_> = (0..).zip(channel_names(joints, led)).map(channel).collect();
    for joint in (0..joints).filter(|_| !led) {
        let gap = ChannelGap::of(Version::ALL.map(|v| free_size(tests(), v, joint)));
        all.insert(format!("q{}_rad", joint + 1), gap);
    }
    all
}

/// The gap of a result on trials that played no part in it; its floors are kept.
///
/// * `plays` - all trials with the model as given, calibrated and amended, each as [`Version::Given`]
pub fn confirmed(
    plays: &[Vec<Arc<SimulatedTrial>>; 3],
    known: &Named<ChannelGap>,
    names: &[String],
) -> Named<ChannelGap> {
    let mut tests: Vec<SimulatedTrial> =
        plays[2].iter().map(|t| SimulatedTrial::clone(t)).collect();
    for trial in &mut tests {
        trial.test = true;
    }
    let tested = tested(&tests, Version::Given);
    let channel = |(c, name): (usize, &String)| {
        let simulated = |trials: &Vec<Arc<SimulatedTrial>>| {
            size(trials.iter().map(AsRef::as_ref), Version::Given, c)
        };
        let known = known.get(name);
        let gap = ChannelGap {
            floor: known.and_then(|g| g.floor),
            floor_std: known.and_then(|g| g.floor_std),
            open: tested.get(c).and_then(|g| opened(g, &tests)),
            ..ChannelGap::of(plays.each_ref().map(simulated))
        };
        (name.clone(), gap)
    };
    names.iter().enumerate().map(channel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_than_all_of_a_gap_is_closed() {
        let gap = |after| ChannelGap {
            before: Some(3.0),
            calibrated: Some(2.4),
            after: Some(after),
            floor: Some(0.15),
            ..ChannelGap::default()
        };
        assert_eq!(gap(0.10).closed(), Some(1.0));
        assert!((gap(1.275).closed().expect("a share") - 0.5).abs() < 1e-12);
        let nothing = ChannelGap {
            calibrated: Some(0.1),
            ..gap(0.1)
        };
        assert_eq!(nothing.closed(), None);
    }

    fn trial(number: usize, shown: [Option<f64>; 3]) -> SimulatedTrial {
        SimulatedTrial {
            file: format!("{number}.csv"),
            group: 0,
            test: number > 1,
            rate: 50.0,
            counted: vec![vec![true; 100]],
            measured: vec![vec![0.0; 100]],
            shown: shown.map(|v| v.map(|v| vec![vec![v; 100]])),
            free: [const { None }; 3],
        }
    }

    /// Off by 3, 2 and 1 N m in the test trial, whatever the fit trials are off by.
    #[test]
    fn gaps_are_measured_on_test_trials() {
        let trials = [
            trial(0, [Some(9.0); 3]),
            trial(1, [Some(9.0); 3]),
            trial(2, [Some(3.0), Some(2.0), Some(-1.0)]),
        ];
        let gaps = channel_gaps(&trials, (1, false), Version::Amended);
        let names: Vec<_> = gaps.keys().collect();
        assert_eq!(names, ["tau1_Nm", "q1_rad"]);
        let torque = &gaps[0];
        assert_eq!(
            [torque.before, torque.calibrated, torque.after],
            [Some(3.0), Some(2.0), Some(1.0)]
        );
        assert_eq!(gaps[1], ChannelGap::default());
    }

    #[test]
    fn a_test_trial_that_cannot_be_simulated_is_open_without_a_size() {
        let mut trials: Vec<_> = (0..4).map(|k| trial(k, [Some(0.1); 3])).collect();
        for (k, t) in trials.iter_mut().enumerate() {
            t.measured[0] = (0..100).map(|i| ((i * (k + 3)) % 7) as f64).collect();
        }
        trials[3].shown[2] = None;
        let gaps = channel_gaps(&trials, (1, false), Version::Amended);
        let open = gaps[0].open.clone().expect("an open gap");
        assert_eq!((open.trial.as_str(), open.size), ("3.csv", None));
    }
}
