//! Samples at which joints with dry friction rest. Static friction is unknown there, so that fewer force components are compared.

use std::sync::Arc;

use arm_core::effect::{Local, Place};
use arm_core::{Pose, jacobian};

use crate::data::course::Course;
use crate::data::session::ComparisonMode;
use crate::data::valid_segments::{Observable, ValidSegments, widened};
use crate::hypothesis::Hypothesis;
use crate::prepared_session::{PreparedSession, Rest};
use crate::sensitivity::linearization_point::LinearizationPoint;

/// Share of the samples that must be left when those at which joints with dry friction rest are left out: of a simulated motion, which sticks as
/// well, half, since whole movements are lost otherwise, and laws that they alone determine;
const LEAST_LEFT: f64 = 0.5;
/// of a measured one, which says nothing of friction at rest. Where it is known joint by joint which rests, nothing must be left.
const LEAST_LEFT_OF_MEASURED: f64 = 0.15;

impl<const N: usize> PreparedSession<'_, N> {
    /// Leaves out what dry friction makes unknowable where its joint rests or reverses: there friction is whatever holds it.
    ///
    /// Whether anything changed since the last time; then linearization points are to be made anew. The samples of repeats stay the same:
    /// they rest together.
    pub fn leave_out_rest(&mut self, point: &LinearizationPoint<N>) -> bool {
        let dry = dry_joints(&point.hypothesis);
        if dry == self.dry {
            return false;
        }
        self.dry = dry;
        let one = |group: usize| self.rest(point, group);
        self.resting = (0..self.references.len()).map(one).collect();
        let compared = |prepared: &Self| -> usize {
            prepared.valid_segments.iter().map(ValidSegments::len).sum()
        };
        let before = compared(self);
        self.cut();
        self.mark_rest();
        let least = match self.session.comparison {
            ComparisonMode::Led => LEAST_LEFT,
            ComparisonMode::Torque => LEAST_LEFT_OF_MEASURED,
        };
        if !self.session.compares_contact_torques()
            && (compared(self) as f64) < least * before as f64
        {
            // Then some joint rests at any time, and imperfect samples are better than none.
            self.compare_rest();
        }
        true
    }

    /// Whether nothing holds any joint of a hypothesis, though rest is left out: what did showed at rest alone.
    pub(crate) fn leaves_out_rest_for_nothing(&self, hypothesis: &Hypothesis<N>) -> bool {
        self.leaves_out_rest() && dry_joints(hypothesis) == [false; N]
    }

    /// Compares rest as motion, until other joints are dry.
    pub(crate) fn compare_rest(&mut self) {
        self.resting.clear();
        self.cut();
        self.mark_rest();
    }

    /// Marks in measured motions where friction holds joints.
    fn mark_rest(&mut self) {
        for (course, group) in std::iter::zip(&mut self.courses, &self.group_of) {
            let joints = self
                .resting
                .get(*group)
                .map_or(&[][..], |rest| &rest.joints);
            let count = course.raw.first().map_or(0, Vec::len);
            let own = |joint: &Vec<bool>| {
                let mut own = joint.clone();
                own.resize(count, false);
                own
            };
            let at_rest: Vec<Vec<bool>> = joints.iter().map(own).collect();
            if course.at_rest != at_rest {
                Arc::make_mut(course).at_rest = at_rest;
            }
        }
    }

    /// What is found when no sample is left out because a joint rests there.
    pub(crate) fn over_whole_trials<R>(&mut self, find: impl FnOnce(&Self) -> R) -> R {
        let resting = std::mem::take(&mut self.resting);
        self.cut();
        let found = find(self);
        self.resting = resting;
        self.cut();
        found
    }

    /// What the rest of joints with dry friction takes from the comparison of a movement.
    ///
    /// The contact alone places an arm of one or two joints: what holds a resting joint shows in one component of the force
    /// and nowhere else. A longer arm moves under it, and nothing is known then.
    fn rest(&self, point: &LinearizationPoint<N>, group: usize) -> Rest {
        let course = &self.courses[self.references[group]];
        if self.session.compares_contact_torques() {
            return self.rest_in_motion(point, group);
        }
        let joints: Vec<Vec<bool>> = (0..N)
            .map(|j| match self.dry[j] {
                true => widened(&self.resting_joint(point, (course, group, j)), course),
                false => vec![false; course.seen[0].len()],
            })
            .collect();
        let held = |i: usize| -> Vec<usize> { (0..N).filter(|&j| joints[j][i]).collect() };
        let count = course.seen[0].len();
        match point.lines.get(group) {
            Some(line) if N <= 2 && self.session.comparison == ComparisonMode::Led => {
                let observable = |i: usize| match held(i)[..] {
                    [] => Observable::All,
                    // The torque of the other joint, as a component of the force.
                    [j] if N == 2 => {
                        let moves = jacobian(&self.session.chain, &Pose::new(&line.state(i).0));
                        let column = moves.column(1 - j);
                        match column.norm() {
                            size if size > 0.0 => {
                                Observable::ForceAlong([column[0] / size, column[1] / size])
                            }
                            _ => Observable::NoForce,
                        }
                    }
                    _ => Observable::NoForce,
                };
                Rest {
                    observable: Arc::new((0..count).map(observable).collect()),
                    ..Rest::default()
                }
            }
            _ => Rest {
                left_out: (0..count).map(|i| !held(i).is_empty()).collect(),
                ..Rest::default()
            },
        }
    }

    /// What the rest of joints with dry friction takes from the comparison of a movement that was measured: the torque of a joint while it rests
    /// in some repeat, and the samples at which all joints do. What friction holds there is part of both sides of the low-pass, so its neighbours
    /// are compared.
    fn rest_in_motion(&self, point: &LinearizationPoint<N>, group: usize) -> Rest {
        let repeats = std::iter::zip(&self.courses, &self.group_of);
        let repeats: Vec<_> = repeats.filter(|(_, g)| **g == group).collect();
        let count = repeats.iter().map(|(c, _)| c.seen[0].len()).max();
        let mut joints = vec![vec![false; count.unwrap_or(0)]; N];
        for (j, joint) in joints.iter_mut().enumerate().filter(|(j, _)| self.dry[*j]) {
            for (course, _) in &repeats {
                let own = self.resting_joint(point, (course, group, j));
                std::iter::zip(joint.iter_mut(), own).for_each(|(rests, own)| *rests |= own);
            }
        }
        let at = |i: usize| {
            (0..N)
                .filter(|&j| joints[j][i])
                .fold(0_u32, |set, j| set | 1 << j)
        };
        let resting: Vec<u32> = (0..joints[0].len()).map(at).collect();
        Rest {
            left_out: resting
                .iter()
                .map(|set| set.count_ones() == N as u32)
                .collect(),
            observable: Arc::new(
                resting
                    .into_iter()
                    .map(Observable::TorquesWithout)
                    .collect(),
            ),
            joints,
        }
    }

    /// The samples of a movement at which a joint rests.
    fn resting_joint(
        &self,
        point: &LinearizationPoint<N>,
        (course, group, j): (&Course<N>, usize, usize),
    ) -> Vec<bool> {
        /// Share of its fastest speed below which a joint rests, the speed below which it always does, and the one above
        /// which it never does \[rad/s\].
        const SLOW: (f64, f64, f64) = (0.25, 0.005, 0.03);
        /// Share of its fastest speed that the low-pass of a measured motion may leave at rest: less than that in the middle of a rest as
        /// long as a period of its cutoff, between two strokes of 0.3 s or more.
        const SMEARED: f64 = 0.1;
        let speed = |i: usize| match (course.motion(), point.lines.get(group)) {
            (Some(motion), _) => motion.qd[i][j].abs(),
            (None, Some(line)) => line.state(i).1[j].abs(),
            (None, None) => f64::INFINITY,
        };
        let speeds: Vec<f64> = (0..course.seen[0].len()).map(speed).collect();
        let fastest = speeds.iter().copied().fold(0.0, f64::max);
        let mut limit = (SLOW.0 * fastest).clamp(SLOW.1, SLOW.2);
        if let Some(motion) = course.motion()
            && self.session.compares_contact_torques()
        {
            limit = SLOW.2.max(SMEARED * fastest).max(motion.rest[j]);
        }
        let mut rest: Vec<bool> = speeds.into_iter().map(|v| v <= limit).collect();
        if self.session.comparison == ComparisonMode::Torque {
            // A joint that reverses on the way does not rest: the law of its friction holds through zero.
            let shortest = (course.rate / course.band) as usize;
            for run in rest.chunk_by_mut(|a, b| a == b) {
                if run.len() < shortest {
                    run.fill(false);
                }
            }
        }
        rest
    }
}

/// Joints in which something resists as much at a crawl as in motion.
fn dry_joints<const N: usize>(hypothesis: &Hypothesis<N>) -> [bool; N] {
    /// A speed at which a joint crawls \[rad/s\]: three times the default smoothing of dry laws, 0.01 rad/s, which are whole by then.
    const CREEP_SPEED: f64 = 0.03;
    /// A speed of motion \[rad/s\], ten times that of a crawl: a viscous torque is ten times as large there, a dry one the same.
    const MOTION_SPEED: f64 = 0.3;
    let mut dry = [false; N];
    for effect in hypothesis.known.iter().chain(&hypothesis.named) {
        if effect.kind.info().place != Place::Joint || effect.index >= N {
            continue;
        }
        let at = |speed: f64| {
            let torque = |qd: f64| {
                effect.torque(&Local {
                    joint_force: 1.0,
                    ..Local::moving(0.0, qd)
                })
            };
            0.5 * (torque(speed) - torque(-speed))
        };
        dry[effect.index] |=
            at(CREEP_SPEED) > 0.5 * at(MOTION_SPEED).abs() && at(CREEP_SPEED) > 0.0;
    }
    dry
}

#[cfg(test)]
mod tests {
    use arm_core::effect::{Effect, Kind};

    use arm_core::sample_arms;
    use arm_ident::regression::trial::Trial;

    use super::*;
    use crate::data::course::tests::of_one;
    use crate::data::noise::NoiseModel;
    use crate::hypothesis::tests::plain;

    fn with(known: Vec<Effect<f64>>) -> Hypothesis<2> {
        Hypothesis { known, ..plain() }
    }

    #[test]
    fn joints_are_dry_in_which_something_resists_as_much_at_a_crawl_as_in_motion() {
        let of = |kind: &str, values: &[f64]| {
            let kind = Kind::named(kind).expect("known");
            dry_joints(&with(vec![Effect::new(kind, 1).with(values)]))
        };
        assert_eq!(of("coulomb", &[0.2, 0.0]), [false, true]);
        assert_eq!(of("coulomb", &[0.2, 0.01]), [false, true]);
        // At the speed of a crawl it is three quarters of its size.
        assert_eq!(of("coulomb", &[0.2, 0.03]), [false, true]);
        // So smooth that it is half as large at 0.03 rad/s: it does not hold the joint.
        assert_eq!(of("coulomb", &[0.2, 0.1]), [false; 2]);
        assert_eq!(of("coulomb", &[0.0, 0.0]), [false; 2]);
        assert_eq!(of("viscous", &[0.5]), [false; 2]);
        assert_eq!(of("elastic", &[2.0, 1.0]), [false; 2]);
        assert_eq!(dry_joints(&with(Vec::new())), [false; 2]);
    }

    /// Strokes of a second about a pause of 0.3 s, in which the second joint is held by what nobody knows.
    #[test]
    fn what_friction_holds_in_a_measured_motion_is_what_was_measured() {
        let stroke = |t: f64| {
            let s = t.clamp(0.0, 1.0);
            s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
        };
        let angle = |t: f64| stroke(t - 0.5) - stroke(t - 1.8);
        let times = || (0..330).map(|i| f64::from(i) / 100.0);
        let q = times().map(|t| arm_core::Joints::from([0.0, 1.0 + angle(t)]));
        let trial = Trial {
            force_on_arm: Some(times().map(|t| [libm::sin(9.0 * t), 2.0]).collect()),
            ..Trial::new(100.0, q.collect())
        };
        let mut session = of_one(sample_arms::mechanical_arm(), trial);
        session.comparison = ComparisonMode::Torque;
        session.effects = vec![Effect::new(Kind::Coulomb, 1).with(&[0.2, 0.01])];
        let noise = NoiseModel::unknown(session.channels()).expect("white");
        let mut prepared = PreparedSession::with_noise(&session, noise, 1).expect("a session");
        let point = prepared.linearize(&session.given()).expect("torques");
        assert!(prepared.leave_out_rest(&point));
        let course = &prepared.courses[0];
        let (pause, stroke) = (165, 100);
        assert!(course.at_rest[1][pause] && !course.at_rest[1][stroke]);
        assert!(!course.at_rest[0].contains(&true), "it has no friction");
        let torques = session.torques(&session.given(), course).expect("torques");
        assert_eq!(torques[1][pause], course.raw[1][pause]);
        assert_ne!(torques[1][stroke], course.raw[1][stroke]);
        let compared = |prepared: &PreparedSession<2>, at: usize| {
            let mut samples = prepared.valid_segments[0].samples();
            samples.any(|i| i.abs_diff(at) < 10)
        };
        assert!(compared(&prepared, stroke) && compared(&prepared, pause));
        // Where both rest, nothing is compared.
        let first = Effect::new(Kind::Coulomb, 0).with(&[0.2, 0.01]);
        let mut both = session.given();
        both.named.push(first);
        assert!(prepared.leave_out_rest(&prepared.linearize(&both).expect("torques")));
        assert!(compared(&prepared, stroke) && !compared(&prepared, pause));
        prepared.compare_rest();
        assert!(prepared.courses[0].at_rest.is_empty());
    }
}
