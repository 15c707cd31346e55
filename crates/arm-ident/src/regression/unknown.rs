//! The unknowns of an identification and their priors.

use arm_core::effect::{Effect, Place};

use crate::regression::trial::{Model, Tolerance, Trial};

/// Smallest mass that a fit may return \[kg\].
pub(crate) const LEAST_MASS: f64 = 1e-3;

/// An inertial parameter of a segment, in which the dynamics are linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// Mass \[kg\].
    Mass,
    /// Mass × centre of mass along the segment \[kg m\].
    Along,
    /// Mass × centre of mass normal to the segment \[kg m\].
    Normal,
    /// Moment of inertia about the proximal joint \[kg m²\].
    Inertia,
}

/// A small imperfection of the measurement that the calibration allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Imperfection {
    /// Offset of a joint angle \[rad\].
    AngleOffset(usize),
    /// Bias of a force channel \[N\].
    ForceBias(usize),
    /// Relative gain error of a force channel.
    ForceGain(usize),
    /// Delay of the forces \[s\].
    TimeDelay,
    /// Displacement of the handle along (0) or normal to (1) the last segment \[m\].
    HandlePlacement(usize),
    /// The torque of the model's inertia, as a share; for a method that takes the movement for quasi-static.
    NeglectedInertia,
}

/// The quantity of a column of the regression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// An inertial parameter of a segment.
    Segment(usize, Moment),
    /// A linear parameter of a fitted effect: index of the effect, index of the parameter.
    Effect(usize, usize),
    /// Amplitude times rest angle of a fitted spring: index of the effect, index of its rest angle.
    RestTorque(usize, usize),
    /// A calibration that is refitted within its tolerance.
    Calibration(Imperfection),
}

/// One unknown.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// The quantity.
    pub source: Source,
    /// Name as in files: of an effect's parameter without effect and joint.
    pub name: String,
    /// `segment`, `calibration`, or the kind of effect.
    pub kind: &'static str,
    /// Joint or segment, from 1, where it belongs to one.
    pub joint: Option<usize>,
    /// SI unit.
    pub unit: &'static str,
    /// Prior mean.
    pub mean: f64,
    /// Its standard deviation; infinite where nothing is known.
    pub sd: f64,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
}

impl Unknown {
    /// Name by itself, among those of other effects: `coulomb1 torque`.
    pub fn printed(&self) -> String {
        match (self.source, self.joint) {
            (Source::Effect(..) | Source::RestTorque(..), Some(joint)) => {
                format!("{}{joint} {}", self.kind, self.name)
            }
            _ => self.name.clone(),
        }
    }

    /// A parameter of a fitted effect, of which nothing is known but its bounds.
    pub(crate) fn of_effect((number, effect): (usize, &Effect<f64>), position: usize) -> Self {
        let info = effect.kind.info();
        let parameter = &info.parameters[position];
        Self {
            source: Source::Effect(number, position),
            name: parameter.name.to_owned(),
            kind: info.kind,
            joint: Some(effect.index + 1),
            unit: parameter.unit,
            mean: 0.0,
            sd: f64::INFINITY,
            min: parameter.min,
            max: parameter.max,
        }
    }
}

/// The unknowns of a model on given trials: segments, effects, calibration, in this order.
pub fn unknowns<const N: usize>(
    model: &Model<N>,
    tolerance: &Tolerance,
    trials: &[&Trial<N>],
) -> Vec<Unknown> {
    let mut list = Vec::new();
    if model.segment_uncertainty > 0.0 {
        for k in 0..N {
            list.extend(segment(model, k));
        }
    }
    for (i, effect) in model.fitted.iter().enumerate() {
        let info = effect.kind.info();
        if info.place != Place::Joint {
            continue;
        }
        for (p, _) in info.parameters.iter().enumerate().filter(|(_, p)| p.linear) {
            list.push(Unknown::of_effect((i, effect), p));
        }
        list.extend(rest_torque(model, i));
    }
    list.extend(calibration::<N>(tolerance, trials));
    list
}

/// Amplitude and rest angle among the parameters of a spring whose torque is linear in both amplitude and amplitude · rest.
pub fn spring(effect: &Effect<f64>) -> Option<(usize, usize)> {
    let prior = effect.kind.prior();
    let mut parts = prior.parts.iter();
    parts.find_map(|part| part.rest.map(|rest| (part.sizes[0], rest)))
}

/// The unknown that a spring's rest angle is: amplitude · rest. A constant moment fitted in the same joint takes its place, and so do
/// two springs of one kind, whose stiffnesses span every rest angle between and beyond their own.
fn rest_torque<const N: usize>(model: &Model<N>, index: usize) -> Option<Unknown> {
    let effect = &model.fitted[index];
    let (amplitude, rest) = spring(effect)?;
    let spans =
        |(i, e): (usize, &Effect<f64>)| i != index && e.kind == effect.kind || e.is_constant();
    let mut others = model.fitted.iter().enumerate();
    if others.any(|(i, e)| e.index == effect.index && spans((i, e))) {
        return None;
    }
    let info = effect.kind.info();
    Some(Unknown {
        source: Source::RestTorque(index, rest),
        name: format!(
            "{}*{}",
            info.parameters[amplitude].name, info.parameters[rest].name
        ),
        kind: info.kind,
        joint: Some(effect.index + 1),
        unit: "N m",
        mean: 0.0,
        sd: f64::INFINITY,
        min: -f64::INFINITY,
        max: f64::INFINITY,
    })
}

fn segment<const N: usize>(model: &Model<N>, k: usize) -> Vec<Unknown> {
    let s = &model.chain.segments()[k];
    let u = model.segment_uncertainty;
    let along = s.mass * s.com[0];
    let about_joint = s.inertia + s.mass * (s.com[0] * s.com[0] + s.com[1] * s.com[1]);
    let j = k + 1;
    let unknown = |moment, name: String, unit, mean: f64, sd, min, max| Unknown {
        source: Source::Segment(k, moment),
        name,
        kind: "segment",
        joint: Some(j),
        unit,
        mean,
        sd,
        min,
        max,
    };
    // Mass and centre of mass are uncertain independently: the product has both uncertainties.
    let product = u * core::f64::consts::SQRT_2;
    let spread =
        |mean: f64, relative: f64, scale: f64| (mean.abs() * relative).max(1e-3 * u * scale);
    let inf = f64::INFINITY;
    let mut list = vec![
        unknown(
            Moment::Mass,
            format!("m{j}"),
            "kg",
            s.mass,
            spread(s.mass, u, 1.0),
            LEAST_MASS,
            inf,
        ),
        unknown(
            Moment::Along,
            format!("m{j}*l{j}"),
            "kg m",
            along,
            spread(along, product, s.mass * s.length),
            0.0,
            inf,
        ),
    ];
    if s.com[1] != 0.0 {
        let normal = s.mass * s.com[1];
        list.push(unknown(
            Moment::Normal,
            format!("m{j}*n{j}"),
            "kg m",
            normal,
            spread(normal, product, along),
            -inf,
            inf,
        ));
    }
    list.push(unknown(
        Moment::Inertia,
        format!("I{j} + m{j}*l{j}^2"),
        "kg m^2",
        about_joint,
        spread(about_joint, 2.0 * u, s.mass * s.length * s.length),
        0.0,
        inf,
    ));
    list
}

/// What the calibration of the sensors leaves open, within a tolerance.
pub(crate) fn calibration<const N: usize>(
    tolerance: &Tolerance,
    trials: &[&Trial<N>],
) -> Vec<Unknown> {
    let mut list = Vec::new();
    let mut push = |imperfection, name: String, unit, sd: f64| {
        if sd > 0.0 {
            let source = Source::Calibration(imperfection);
            list.push(Unknown {
                source,
                name,
                kind: "calibration",
                joint: None,
                unit,
                mean: 0.0,
                sd,
                min: -f64::INFINITY,
                max: f64::INFINITY,
            });
        }
    };
    for j in 0..N {
        push(
            Imperfection::AngleOffset(j),
            format!("angle offset {}", j + 1),
            "rad",
            tolerance.angle_offset(),
        );
    }
    if trials.iter().any(|t| t.force_on_arm.is_some()) {
        for (c, channel) in ["Fy", "Fz"].iter().enumerate() {
            push(
                Imperfection::ForceBias(c),
                format!("force bias {channel}"),
                "N",
                tolerance.force_bias,
            );
            push(
                Imperfection::ForceGain(c),
                format!("force gain {channel}"),
                "1",
                tolerance.force_gain,
            );
        }
        push(
            Imperfection::TimeDelay,
            "time delay".into(),
            "s",
            tolerance.time_delay,
        );
        for (axis, direction) in ["along", "normal"].iter().enumerate() {
            let name = format!("handle placement {direction}");
            push(
                Imperfection::HandlePlacement(axis),
                name,
                "m",
                tolerance.handle_placement,
            );
        }
    }
    list
}

/// The estimated delay of the force channels \[s\], zero where it is taken as known.
pub(crate) fn delay(unknowns: &[Unknown], x: &[f64]) -> f64 {
    let is_delay = |u: &Unknown| u.source == Source::Calibration(Imperfection::TimeDelay);
    unknowns
        .iter()
        .position(is_delay)
        .map_or(0.0, |place| x[place])
}
