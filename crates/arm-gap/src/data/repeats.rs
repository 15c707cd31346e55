//! Groups of trials that repeat one movement.

use std::sync::Arc;

use arm_ident::regression::trial::Trial;

use crate::data::course::Course;

/// Root mean square distance between the paths of two trials that are the same movement \[m, rad\].
const SAME_PATH: f64 = 0.01;

/// The same of the angles of an arm whose contact is compared by torques: a sensor may slip by some degrees within a trial \[rad\].
const SAME_ANGLES: f64 = 0.1;

/// Trials that repeat one movement: the group of each, and the longest trial of every group.
pub fn groups<const N: usize>(
    trials: &[Trial<N>],
    courses: &[Arc<Course<N>>],
) -> (Vec<usize>, Vec<usize>) {
    let mut group_of = Vec::with_capacity(trials.len());
    let mut references: Vec<usize> = Vec::new();
    for (i, trial) in trials.iter().enumerate() {
        let found = references.iter().position(|&r| {
            trials[r].configuration == trial.configuration
                && same_rate(trials[r].rate, trial.rate)
                && courses[r].is_like(&courses[i])
        });
        match found {
            Some(group) => {
                group_of.push(group);
                if trial.len() > trials[references[group]].len() {
                    references[group] = i;
                }
            }
            None => {
                group_of.push(references.len());
                references.push(i);
            }
        }
    }
    (group_of, references)
}

/// Whether two sampling rates are one: time stamps are rounded.
pub fn same_rate(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-3 * b
}

impl<const N: usize> Course<N> {
    /// Whether another trial makes the same movement at the same times. One of both may have been broken off after half of the way.
    fn is_like(&self, other: &Self) -> bool {
        let allowed = if self.has_contact_readings() {
            SAME_ANGLES
        } else {
            SAME_PATH
        };
        let (mine, theirs) = (self.path(), other.path());
        let count = mine.len().min(theirs.len());
        let longer = if mine.len() > count { &mine } else { &theirs };
        if reach(&longer[..count]) < 0.5 * reach(longer) {
            return false;
        }
        let square: f64 = std::iter::zip(&mine, &theirs)
            .flat_map(|(a, b)| std::iter::zip(a, b).map(|(a, b)| (a - b) * (a - b)))
            .sum();
        square <= allowed * allowed * count as f64
    }
}

/// How far a path goes from its start.
fn reach(path: &[Vec<f64>]) -> f64 {
    let from_start = |point: &Vec<f64>| {
        let square = std::iter::zip(point, &path[0]).map(|(a, b)| (a - b) * (a - b));
        libm::sqrt(square.sum())
    };
    path.iter().map(from_start).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::course::tests::resting;

    #[test]
    fn trials_whose_paths_lie_within_a_centimetre_repeat_one_movement() {
        let count = |off: f64, rate: f64| {
            let mut session = resting(100.0);
            let mut other = session.trials[0].clone();
            other.rate = rate;
            for point in other.handle.as_mut().expect("a handle") {
                point[0] += off;
            }
            session.trials.push(other);
            let course = |i| Arc::new(session.course(i).expect("a course"));
            groups(&session.trials, &[course(0), course(1)]).1.len()
        };
        assert_eq!([0.0099, 0.0101].map(|off| count(off, 100.0)), [1, 2]);
        // Rates of rounded time stamps are one.
        assert_eq!([100.05, 100.2].map(|rate| count(0.0, rate)), [1, 2]);
    }
}
