//! A hypothesis about a rig: its segments, its known effects, its calibration, and the named effects.

use arm_core::effect::Effect;
use arm_core::{Chain, Contact, Invalid, Segment, Setup};
use arm_ident::regression::unknown::spring;

/// A belief about the rig from which every channel follows by simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis<const N: usize> {
    /// Relative changes of mass, centre of mass and inertia of each segment.
    pub segments: [[f64; 3]; N],
    /// Relative changes of compliance and damping of the contact, y and z.
    pub contact: [[f64; 2]; 2],
    /// Shift of the robot's base against the arm's, y and z \[m\].
    pub shift: [f64; 2],
    /// Where the handle sits in the hand: along the last segment and to its left \[m\].
    pub placement: [f64; 2],
    /// Once-per-turn error of each joint's encoder, as multiples of the cosine and the sine of its angle \[rad\]: a disc that sits
    /// off its shaft.
    pub eccentricity: [[f64; 2]; N],
    /// Effects of the model.
    pub known: Vec<Effect<f64>>,
    /// Small imperfections of the sensors, as effects.
    pub calibration: Vec<Effect<f64>>,
    /// Effects that the model lacks.
    pub named: Vec<Effect<f64>>,
}

/// One number of a hypothesis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Relative change of a segment's mass (0), centre of mass (1) or inertia (2).
    Segment(usize, usize),
    /// Relative change of compliance (0) or damping (1) of the contact along y (0) or z (1).
    Contact(usize, usize),
    /// Shift of the robot's base along y (0) or z (1).
    Shift(usize),
    /// Place of the handle along the last segment (0) or to its left (1).
    Placement(usize),
    /// Part of an encoder's once-per-turn error that goes with the cosine (0) or the sine (1) of its angle.
    Eccentricity(usize, usize),
    /// A parameter of a known effect.
    Known(usize, usize),
    /// The first parameter of an imperfection.
    Calibration(usize),
    /// A parameter of a named effect.
    Named(usize, usize),
}

/// A number that a fit may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinate {
    /// Which one.
    pub target: Target,
    /// Its value before the data, and how far it may be from it (standard deviation); `None` leaves it to the data alone.
    pub prior: Option<(f64, f64)>,
    /// Smallest value allowed.
    pub lower: f64,
    /// Largest value allowed.
    pub upper: f64,
    /// A change that is small and yet seen.
    pub step: f64,
}

impl Coordinate {
    /// Whether a value is as small or as large as is allowed.
    pub fn is_at_limit(&self, value: f64) -> bool {
        value <= self.lower || value >= self.upper
    }
}

impl<const N: usize> Hypothesis<N> {
    /// The value of a number.
    pub fn get(&self, target: Target) -> f64 {
        match target {
            Target::Segment(k, part) => self.segments[k][part],
            Target::Contact(part, axis) => self.contact[part][axis],
            Target::Shift(axis) => self.shift[axis],
            Target::Placement(axis) => self.placement[axis],
            Target::Eccentricity(j, part) => self.eccentricity[j][part],
            Target::Known(e, p) => self.known[e].parameters[p],
            Target::Calibration(e) => self.calibration[e].parameters[0],
            Target::Named(e, p) => self.named[e].parameters[p],
        }
    }

    /// The same belief with one number set.
    pub fn with(mut self, target: Target, value: f64) -> Self {
        let place = match target {
            Target::Segment(k, part) => &mut self.segments[k][part],
            Target::Contact(part, axis) => &mut self.contact[part][axis],
            Target::Shift(axis) => &mut self.shift[axis],
            Target::Placement(axis) => &mut self.placement[axis],
            Target::Eccentricity(j, part) => &mut self.eccentricity[j][part],
            Target::Known(e, p) => &mut self.known[e].parameters[p],
            Target::Calibration(e) => &mut self.calibration[e].parameters[0],
            Target::Named(e, p) => &mut self.named[e].parameters[p],
        };
        *place = value;
        self
    }

    /// The hypothesis after a step of some numbers, within their bounds.
    ///
    /// The torque of a spring is linear in its stiffness and in stiffness · rest, not in its rest angle: a step to first order means a
    /// change of that product. Where data decide both badly, a step in the angle itself would have to be many times shorter.
    pub fn moved(&self, steps: &[(&Coordinate, f64)]) -> Self {
        let to = |h: Self, c: &Coordinate, step: f64| {
            let value = self.get(c.target) + step;
            h.with(c.target, value.clamp(c.lower, c.upper))
        };
        let is_rest = |c: &Coordinate| self.spring_that_rests(c.target).is_some();
        let (rests, others): (Vec<_>, Vec<_>) = steps.iter().partition(|(c, _)| is_rest(c));
        let others = others.into_iter();
        let stepped = others.fold(self.clone(), |h, (c, step)| to(h, c, step));
        rests.into_iter().fold(stepped, |h, (c, step)| {
            let amplitudes = [self, &h].map(|of| of.spring_that_rests(c.target));
            let share = amplitudes[0].zip(amplitudes[1]).map(|(b, a)| b / a);
            // A spring that vanishes or turns over has no such angle.
            let share = share.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(1.0);
            to(h, c, share * step)
        })
    }

    /// The amplitude of the spring whose rest angle a number is.
    pub fn spring_that_rests(&self, target: Target) -> Option<f64> {
        let (effect, parameter) = self.law_of(target)?;
        let (amplitude, rest) = spring(effect)?;
        (parameter == rest).then_some(effect.parameters[amplitude])
    }

    /// The known or named effect that a number is a parameter of, and which one.
    fn law_of(&self, target: Target) -> Option<(&Effect<f64>, usize)> {
        match target {
            Target::Known(e, p) => Some((&self.known[e], p)),
            Target::Named(e, p) => Some((&self.named[e], p)),
            _ => None,
        }
    }

    /// Whether a number is the angle of a joint about which a law lies, such as a rest angle.
    pub fn is_joint_angle(&self, target: Target) -> bool {
        let Some((effect, parameter)) = self.law_of(target) else {
            return false;
        };
        let info = &effect.kind.info().parameters[parameter];
        // A phase is an angle of no joint.
        info.unit == "rad" && !info.linear && !effect.kind.prior().nature.swings()
    }

    /// Hands what calibration stands in for a sensor over to a named fault of the same sensor: the two are one sum, and the fault is
    /// free to be as large as it is.
    pub fn handed_over(mut self) -> Self {
        for fault in &mut self.named {
            let same = |c: &&mut Effect<f64>| (c.kind, c.index) == (fault.kind, fault.index);
            for imperfection in self.calibration.iter_mut().filter(same) {
                fault.parameters[0] += imperfection.parameters[0];
                imperfection.parameters[0] = 0.0;
            }
        }
        self
    }

    /// All effects: those of the model, the named ones, then the imperfections of the sensors.
    pub fn effects(&self) -> Vec<Effect<f64>> {
        let parts = [&self.known, &self.named, &self.calibration];
        parts.into_iter().flatten().copied().collect()
    }

    /// Whether dry friction acts in some joint, set-valued or smoothed.
    pub fn has_dry_friction(&self) -> bool {
        let mut acting = self.known.iter().chain(&self.named);
        acting.any(|e| e.on && e.parameters[0] != 0.0 && e.kind.smoothed_by().is_some())
    }

    /// Lets an effect stick or creep at rest as the friction that acts in its joint does.
    pub fn share_rest(&self, effect: &mut Effect<f64>) {
        let Some(smoothing) = effect.kind.smoothed_by() else {
            return;
        };
        let acting = self.known.iter().chain(&self.named);
        let mut own = acting.filter(|e| e.index == effect.index && e.parameters[0] != 0.0);
        if own.any(Effect::is_dry) {
            effect.parameters[smoothing] = 0.0;
        }
    }

    /// The segments of the hypothesis.
    pub fn changed_segments(&self, nominal: &[Segment<f64>; N]) -> [Segment<f64>; N] {
        core::array::from_fn(|k| {
            let [mass, com, inertia] = self.segments[k].map(|change| 1.0 + change);
            let mut segment = nominal[k];
            segment.mass *= mass;
            segment.com = segment.com.map(|c| c * com);
            segment.inertia *= inertia;
            segment
        })
    }

    /// The rig without effects.
    ///
    /// # Errors
    /// [`Invalid`] for segments that cannot be, such as a negative mass.
    pub fn setup(
        &self,
        nominal: &Chain<f64, N>,
        mut contact: Contact<f64>,
    ) -> Result<Setup<f64, N>, Invalid> {
        for axis in 0..2 {
            contact.stiffness[axis] /= 1.0 + self.contact[0][axis];
            contact.damping[axis] *= 1.0 + self.contact[1][axis];
        }
        let segments = self.changed_segments(nominal.segments());
        let chain = Chain::new(segments, nominal.base(), nominal.gravity())?
            .with_rotor_inertia(*nominal.rotor_inertia())?;
        let mut setup = Setup::new(&chain, contact);
        setup.placement = self.placement;
        Ok(setup)
    }
}

/// The distance of each number from what was known of it, with its standard deviation.
pub fn priors<const N: usize>(
    hypothesis: &Hypothesis<N>,
    coordinates: &[Coordinate],
) -> Vec<Option<(f64, f64)>> {
    coordinates
        .iter()
        .map(|c| {
            c.prior
                .map(|(mean, sd)| (hypothesis.get(c.target) - mean, sd))
        })
        .collect()
}

/// What the numbers of a hypothesis cost against what was known of them.
pub fn departure<const N: usize>(hypothesis: &Hypothesis<N>, coordinates: &[Coordinate]) -> f64 {
    let known = priors(hypothesis, coordinates).into_iter().flatten();
    known
        .map(|(distance, sd)| (distance / sd) * (distance / sd))
        .sum()
}

#[cfg(test)]
pub(crate) mod tests {
    use arm_core::effect::Kind;

    use super::*;

    fn with(kind: Kind, index: usize, size: f64) -> Effect<f64> {
        Effect::new(kind, index).with(&[size])
    }

    /// The model as given, with nothing in it.
    pub(crate) fn plain() -> Hypothesis<2> {
        Hypothesis {
            segments: [[0.0; 3]; 2],
            contact: [[0.0; 2]; 2],
            shift: [0.0; 2],
            placement: [0.0; 2],
            eccentricity: [[0.0; 2]; 2],
            known: Vec::new(),
            calibration: Vec::new(),
            named: Vec::new(),
        }
    }

    #[test]
    fn a_step_of_a_spring_changes_the_product_of_stiffness_and_rest_as_to_first_order() {
        let spring = Effect::new(Kind::Elastic, 0).with(&[0.5, 0.1]);
        let before = Hypothesis {
            known: vec![spring],
            ..plain()
        };
        let number = |parameter, most| Coordinate {
            target: Target::Known(0, parameter),
            prior: None,
            lower: -7.0,
            upper: most,
            step: 1e-3,
        };
        let (stiffness, rest) = (number(0, 0.8), number(1, 7.0));
        let product = |h: &Hypothesis<2>| h.known[0].parameters[0] * h.known[0].parameters[1];
        // The rest angle precedes the stiffness: their order does not matter.
        let after = before.moved(&[(&rest, -1.7), (&stiffness, 0.2)]);
        let first_order = 0.5 * 0.1 + 0.2 * 0.1 - 0.5 * 1.7;
        assert!((product(&after) - first_order).abs() < 1e-12);
        assert_eq!(after.known[0].parameters[0], 0.7);
        // A stiffness that meets its bound changes the product by what is left of its step.
        let bounded = before.moved(&[(&stiffness, 1.0), (&rest, -1.7)]);
        assert_eq!(bounded.known[0].parameters[0], 0.8);
        assert!((bounded.known[0].parameters[1] - (0.1 - 1.7 * 0.5 / 0.8)).abs() < 1e-12);
        // A spring that turns over keeps the step of its angle.
        let over = before.moved(&[(&stiffness, -0.9), (&rest, -1.7)]);
        assert!((over.known[0].parameters[1] + 1.6).abs() < 1e-12);
    }

    #[test]
    fn a_named_fault_takes_over_the_calibration_of_its_own_sensor_alone() {
        let before = Hypothesis {
            calibration: vec![
                with(Kind::ForceBias, 0, 0.1),
                with(Kind::ForceBias, 1, -0.2),
                with(Kind::TimeDelay, 0, 0.01),
            ],
            named: vec![
                with(Kind::ForceBias, 1, 3.0),
                with(Kind::TimeDelay, 0, 0.03),
            ],
            ..plain()
        };
        let after = before.handed_over();
        let sizes = |list: &[Effect<f64>]| list.iter().map(|e| e.parameters[0]).collect::<Vec<_>>();
        assert_eq!(sizes(&after.calibration), [0.1, 0.0, 0.0]);
        assert_eq!(sizes(&after.named), [2.8, 0.04]);
    }
}
