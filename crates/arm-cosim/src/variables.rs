//! The one table of variables. Model descriptions, value references, the Python object and the documentation come from it.

use arm_core::effect::{KINDS, Parameter, Place};
use arm_sim::Port;

use crate::hash::fnv1a;
use crate::quantity::Quantity;
use crate::spec::{ArmSpec, port_name};
use crate::status::Refused;

/// What a variable is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// Time.
    Independent,
    /// Set by the importer before each step.
    Input,
    /// Read by the importer.
    Output,
    /// Fixed when initialization ends.
    Parameter,
    /// For information.
    Local,
}

impl Causality {
    /// The word of the standard.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Input => "input",
            Self::Output => "output",
            Self::Parameter => "parameter",
            Self::Local => "local",
        }
    }
}

/// When a variable may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variability {
    /// Never.
    Constant,
    /// Not after initialization.
    Fixed,
    /// Between communication steps.
    Tunable,
    /// At any time.
    Continuous,
}

impl Variability {
    /// The word of the standard.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Fixed => "fixed",
            Self::Tunable => "tunable",
            Self::Continuous => "continuous",
        }
    }
}

/// Where the value at the start comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Initial {
    /// From `start`.
    Exact,
    /// From other variables.
    Calculated,
}

/// One row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Structured name, one-based: `q[1]`, `body[2].m`.
    pub name: String,
    /// Its quantity.
    pub quantity: Quantity,
    /// What it is for.
    pub causality: Causality,
    /// When it may change.
    pub variability: Variability,
    /// Where its start comes from; nothing for time and inputs.
    pub initial: Option<Initial>,
    /// SI unit as in the catalogue: `N m s/rad`.
    pub unit: &'static str,
    /// Value before anything is set; nothing for what is calculated.
    pub start: Option<f64>,
    /// Smallest and largest value that is accepted.
    pub range: (f64, f64),
    /// Usual size, for tolerances.
    pub nominal: f64,
    /// What it is, with its sign where it has one.
    pub description: String,
}

impl Variable {
    fn new(
        quantity: Quantity,
        name: impl Into<String>,
        unit: &'static str,
        causality: Causality,
    ) -> Self {
        let (variability, initial) = match causality {
            Causality::Independent | Causality::Input => (Variability::Continuous, None),
            Causality::Output => (Variability::Continuous, Some(Initial::Calculated)),
            Causality::Parameter => (Variability::Fixed, Some(Initial::Exact)),
            Causality::Local => (Variability::Constant, Some(Initial::Exact)),
        };
        Self {
            name: name.into(),
            quantity,
            causality,
            variability,
            initial,
            unit,
            start: None,
            range: (f64::NEG_INFINITY, f64::INFINITY),
            nominal: 1.0,
            description: String::new(),
        }
    }

    /// A time derivative, for importers that integrate the arm themselves.
    fn rate(quantity: Quantity, of: &str, unit: &'static str) -> Self {
        Self {
            variability: Variability::Continuous,
            initial: Some(Initial::Calculated),
            ..Self::new(quantity, format!("der({of})"), unit, Causality::Local)
        }
        .says(format!("Time derivative of {of}."))
    }

    fn tunable(self) -> Self {
        Self {
            variability: Variability::Tunable,
            ..self
        }
    }

    fn start(mut self, value: f64) -> Self {
        if self.causality == Causality::Output {
            self.initial = Some(Initial::Exact);
        }
        self.start = Some(value);
        self
    }

    fn least(mut self, value: f64) -> Self {
        self.range.0 = value;
        self
    }

    fn nominal(mut self, value: f64) -> Self {
        self.nominal = value;
        self
    }

    fn says(mut self, text: impl Into<String>) -> Self {
        self.description = text.into();
        self
    }
}

/// The least length \[m\] and mass \[kg\] that the core takes.
const SMALLEST: f64 = f32::MIN_POSITIVE as f64;

const AXES: [&str; 2] = ["y, forward", "z, up"];

/// All variables of an arm. The value reference of a variable is its place in the table.
///
/// # Errors
/// [`Refused`] for an effect that the catalogue does not hold.
pub fn variables(spec: &ArmSpec) -> Result<Vec<Variable>, Refused> {
    let mut table = vec![
        Variable::new(Quantity::Time, "time", "s", Causality::Independent).says("Simulation time."),
    ];
    inputs(spec, &mut table);
    outputs(spec, &mut table);
    rates(spec, &mut table);
    input_rates(&mut table);
    parameters(spec, &mut table);
    effects(spec, &mut table)?;
    table.push(
        Variable::new(Quantity::InnerStep, "solver.h", "s", Causality::Local)
            .start(spec.step)
            .nominal(1e-3)
            .says("Inner step of the fourth-order integrator."),
    );
    Ok(table)
}

fn inputs(spec: &ArmSpec, table: &mut Vec<Variable>) {
    let input =
        |quantity, name: String, unit| Variable::new(quantity, name, unit, Causality::Input);
    for (axis, along) in AXES.iter().enumerate() {
        let n = axis + 1;
        match spec.port {
            Port::Force => table.push(
                input(Quantity::ForceOnArm(axis), format!("handle.F[{n}]"), "N")
                    .start(0.0)
                    .nominal(10.0)
                    .says(format!("Force of the environment on the arm at its handle, along {along}, when it is set; goes on with der(handle.F[{n}]).")),
            ),
            Port::Motion => {
                table.push(
                    input(Quantity::RobotPosition(axis), format!("robot.r[{n}]"), "m")
                        .start(spec.start.handle[axis])
                        .says(format!(
                            "Position of the robot's handle when it is set, along {along}; goes on with robot.v[{n}]."
                        )),
                );
                table.push(
                    input(Quantity::RobotVelocity(axis), format!("robot.v[{n}]"), "m/s")
                        .start(0.0)
                        .nominal(0.1)
                        .says(format!("Velocity of the robot's handle when it is set, along {along}; goes on with der(robot.v[{n}]).")),
                );
            }
        }
    }
    for joint in 0..spec.joints() {
        let n = joint + 1;
        table.push(
            input(Quantity::Torque(joint), format!("tau[{n}]"), "N m")
                .start(0.0)
                .says(format!("Torque of a motor in joint {n} when it is set, counter-clockwise on what lies beyond it; goes on with der(tau[{n}]).")),
        );
    }
}

/// How inputs go on between communication points. Behind the rest, as only some importers set them.
fn input_rates(table: &mut Vec<Variable>) {
    let rates: Vec<_> = table
        .iter()
        .filter_map(|v| {
            let (quantity, unit, nominal) = match v.quantity {
                Quantity::ForceOnArm(axis) => (Quantity::ForceRate(axis), "N/s", 100.0),
                Quantity::RobotVelocity(axis) => (Quantity::RobotAcceleration(axis), "m/s²", 1.0),
                Quantity::Torque(joint) => (Quantity::TorqueRate(joint), "N m/s", 10.0),
                _ => return None,
            };
            let name = format!("der({})", v.name);
            let text = format!(
                "Time derivative of {}, held until it is set anew; not used in Model Exchange.",
                v.name
            );
            let rate = Variable::new(quantity, name, unit, Causality::Input);
            Some(rate.start(0.0).nominal(nominal).says(text))
        })
        .collect();
    table.extend(rates);
}

fn output(quantity: Quantity, name: String, unit: &'static str) -> Variable {
    Variable::new(quantity, name, unit, Causality::Output)
}

fn outputs(spec: &ArmSpec, table: &mut Vec<Variable>) {
    joint_outputs(spec, table);
    tip_outputs(spec, table);
    energy_outputs(spec, table);
}

fn joint_outputs(spec: &ArmSpec, table: &mut Vec<Variable>) {
    for joint in 0..spec.joints() {
        let text = match joint {
            0 => "Angle of joint 1: that of segment 1 from +y, counter-clockwise.".to_owned(),
            _ => format!(
                "Angle of joint {}, relative to the segment before, counter-clockwise.",
                joint + 1
            ),
        };
        table.push(
            output(Quantity::Angle(joint), format!("q[{}]", joint + 1), "rad")
                .start(spec.start.q[joint])
                .says(text),
        );
    }
    for joint in 0..spec.joints() {
        table.push(
            output(
                Quantity::Speed(joint),
                format!("qd[{}]", joint + 1),
                "rad/s",
            )
            .start(spec.start.qd[joint])
            .says(format!("Speed of joint {}.", joint + 1)),
        );
    }
}

fn tip_outputs(spec: &ArmSpec, table: &mut Vec<Variable>) {
    for (axis, along) in AXES.iter().enumerate() {
        table.push(
            output(
                Quantity::TipPosition(axis),
                format!("handle.r[{}]", axis + 1),
                "m",
            )
            .says(format!("Position of the arm's tip, along {along}.")),
        );
    }
    for (axis, along) in AXES.iter().enumerate() {
        table.push(
            output(
                Quantity::TipVelocity(axis),
                format!("handle.v[{}]", axis + 1),
                "m/s",
            )
            .nominal(0.1)
            .says(format!("Velocity of the arm's tip, along {along}.")),
        );
    }
    if spec.port == Port::Motion {
        for (axis, along) in AXES.iter().enumerate() {
            table.push(
                output(
                    Quantity::ForceOnRobot(axis),
                    format!("contact.F[{}]", axis + 1),
                    "N",
                )
                .nominal(10.0)
                .says(format!("Force of the contact on the robot, along {along}.")),
            );
        }
    }
}

fn energy_outputs(spec: &ArmSpec, table: &mut Vec<Variable>) {
    let energy =
        |quantity, name: &str, text: &str| output(quantity, name.to_owned(), "J").says(text);
    table.push(energy(
        Quantity::Energy,
        "energy",
        "Kinetic and potential energy of the arm, and the energy in the springs of a contact on this side.",
    ));
    table.push(energy(
        Quantity::Work(0),
        "work.port",
        "Work done on the arm through its port since the start.",
    ));
    table.push(energy(
        Quantity::Work(1),
        "work.tau",
        "Work done by the motors in the joints since the start.",
    ));
    table.push(energy(
        Quantity::Work(2),
        "work.resisted",
        "Work done against everything in the joints that resists since the start, stored or lost.",
    ));
    if spec.port == Port::Motion {
        table.push(energy(
            Quantity::Work(3),
            "work.damped",
            "Energy lost in the damping of the contact since the start.",
        ));
    }
}

fn rates(spec: &ArmSpec, table: &mut Vec<Variable>) {
    let named = |quantity| {
        let found = table.iter().find(|v| v.quantity == quantity);
        found.map_or_else(String::new, |v| v.name.clone())
    };
    let mut rates = Vec::new();
    for joint in 0..spec.joints() {
        let name = named(Quantity::Angle(joint));
        rates.push(Variable::rate(Quantity::AngleRate(joint), &name, "rad/s"));
    }
    for joint in 0..spec.joints() {
        let name = named(Quantity::Speed(joint));
        rates.push(Variable::rate(Quantity::SpeedRate(joint), &name, "rad/s²"));
    }
    for which in 0..works(spec) {
        let name = named(Quantity::Work(which));
        rates.push(Variable::rate(Quantity::WorkRate(which), &name, "W"));
    }
    table.extend(rates);
}

/// How many works the arm counts.
const fn works(spec: &ArmSpec) -> usize {
    match spec.port {
        Port::Force => 3,
        Port::Motion => 4,
    }
}

fn parameters(spec: &ArmSpec, table: &mut Vec<Variable>) {
    let parameter = |quantity, name: String, unit, start| {
        Variable::new(quantity, name, unit, Causality::Parameter).start(start)
    };
    for (i, s) in spec.segments.iter().enumerate() {
        let (n, at) = (i + 1, format!("body[{}]", i + 1));
        table.extend([
            parameter(Quantity::Length(i), format!("{at}.a"), "m", s.length)
                .least(SMALLEST)
                .says(format!(
                    "Length of segment {n}, joint to joint or to the handle."
                )),
            parameter(Quantity::Mass(i), format!("{at}.m"), "kg", s.mass)
                .least(SMALLEST)
                .says(format!("Mass of segment {n}.")),
            parameter(Quantity::Com(i), format!("{at}.l"), "m", s.com[0]).says(format!(
                "Centre of mass of segment {n} from its proximal joint, along it."
            )),
            parameter(Quantity::ComNormal(i), format!("{at}.h"), "m", s.com[1]).says(format!(
                "Centre of mass of segment {n}, normal to it, counter-clockwise."
            )),
            parameter(Quantity::Inertia(i), format!("{at}.I"), "kg m²", s.inertia)
                .least(0.0)
                .nominal(0.01)
                .says(format!(
                    "Moment of inertia of segment {n} about its centre of mass."
                )),
        ]);
    }
    table.push(
        parameter(
            Quantity::Gravity,
            "gravity".to_owned(),
            "m/s²",
            spec.gravity,
        )
        .says("Acceleration of gravity, along −z."),
    );
    for (axis, along) in AXES.iter().enumerate() {
        table.push(
            parameter(
                Quantity::Base(axis),
                format!("base[{}]", axis + 1),
                "m",
                spec.base[axis],
            )
            .says(format!("First joint, along {along}.")),
        );
    }
    if spec.port == Port::Motion {
        for (axis, along) in AXES.iter().enumerate() {
            let n = axis + 1;
            table.extend([
                parameter(
                    Quantity::ContactStiffness(axis),
                    format!("contact.S[{n}]"),
                    "N/m",
                    spec.contact_stiffness[axis],
                )
                .least(0.0)
                .tunable()
                .nominal(1e4)
                .says(format!("Stiffness of the contact, along {along}.")),
                parameter(
                    Quantity::ContactDamping(axis),
                    format!("contact.D[{n}]"),
                    "N s/m",
                    spec.contact_damping[axis],
                )
                .least(0.0)
                .tunable()
                .nominal(10.0)
                .says(format!("Damping of the contact, along {along}.")),
            ]);
        }
    }
}

fn effects(spec: &ArmSpec, table: &mut Vec<Variable>) -> Result<(), Refused> {
    for (k, effect) in spec.effects.iter().enumerate() {
        let Some(info) = KINDS
            .iter()
            .map(|kind| kind.info())
            .find(|info| info.kind == effect.kind)
        else {
            return Err(Refused::error(format!(
                "effect {}: unknown kind {:?}",
                k + 1,
                effect.kind
            )));
        };
        let place = match info.place {
            Place::Joint => format!(" in joint {}", effect.index + 1),
            Place::Segment => format!(" of segment {}", effect.index + 1),
            _ => String::new(),
        };
        for (p, (parameter, &start)) in info.parameters.iter().zip(&effect.values).enumerate() {
            let Parameter {
                name,
                unit,
                min,
                max,
                or_zero,
                ..
            } = *parameter;
            let least = if or_zero { 0.0 } else { min };
            table.push(Variable {
                start: Some(start),
                range: (least, max),
                description: format!("Effect {}{place}: {name}.", effect.kind),
                ..Variable::new(
                    Quantity::Effect(k, p),
                    format!("effect[{}].{name}", k + 1),
                    unit,
                    Causality::Parameter,
                )
            });
        }
    }
    Ok(())
}

/// Whether a value fits a variable.
pub(crate) fn fits(variable: &Variable, value: f64) -> bool {
    let (min, max) = variable.range;
    value.is_finite() && value >= min && value <= max
}

/// Writes the value of a settable variable into an arm.
pub(crate) fn put(spec: &mut ArmSpec, quantity: Quantity, value: f64) {
    match quantity {
        Quantity::Angle(j) => spec.start.q[j] = value,
        Quantity::Speed(j) => spec.start.qd[j] = value,
        Quantity::Length(i) => spec.segments[i].length = value,
        Quantity::Mass(i) => spec.segments[i].mass = value,
        Quantity::Com(i) => spec.segments[i].com[0] = value,
        Quantity::ComNormal(i) => spec.segments[i].com[1] = value,
        Quantity::Inertia(i) => spec.segments[i].inertia = value,
        Quantity::Gravity => spec.gravity = value,
        Quantity::Base(axis) => spec.base[axis] = value,
        Quantity::ContactStiffness(axis) => spec.contact_stiffness[axis] = value,
        Quantity::ContactDamping(axis) => spec.contact_damping[axis] = value,
        Quantity::Effect(k, p) => spec.effects[k].values[p] = value,
        Quantity::Time
        | Quantity::ForceOnArm(_)
        | Quantity::RobotPosition(_)
        | Quantity::RobotVelocity(_)
        | Quantity::Torque(_)
        | Quantity::ForceRate(_)
        | Quantity::RobotAcceleration(_)
        | Quantity::TorqueRate(_)
        | Quantity::TipPosition(_)
        | Quantity::TipVelocity(_)
        | Quantity::ForceOnRobot(_)
        | Quantity::Energy
        | Quantity::Work(_)
        | Quantity::AngleRate(_)
        | Quantity::SpeedRate(_)
        | Quantity::WorkRate(_)
        | Quantity::InnerStep => {}
    }
}

/// The instantiation token of FMI 3.0 and GUID of FMI 2.0: `{armrs-<table>-<arm>}`. It changes with the version of this
/// library, with any row of the table and with any value of the arm.
///
/// # Errors
/// As [`variables`].
pub fn token(spec: &ArmSpec) -> Result<String, Refused> {
    let mut rows = format!("{} {}\n", env!("CARGO_PKG_VERSION"), port_name(spec.port));
    for v in variables(spec)? {
        rows += &format!(
            "{} {} {} {:?} {} {:?} {:?} {:?}\n",
            v.name,
            v.causality.name(),
            v.variability.name(),
            v.initial,
            v.unit,
            v.start.map(f64::to_bits),
            v.range,
            v.description
        );
    }
    let (table, arm) = (fnv1a(rows.as_bytes()), fnv1a(spec.to_json()?.as_bytes()));
    Ok(format!("{{armrs-{table:016x}-{arm:016x}}}"))
}
