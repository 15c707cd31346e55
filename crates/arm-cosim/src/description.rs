//! The model descriptions of FMI 2.0 and 3.0, and the terminals of FMI 3.0, as XML.

use arm_sim::Port;

use crate::dependencies::{When, dependencies};
use crate::spec::ArmSpec;
use crate::status::Refused;
use crate::units::{Unit, unit};
use crate::variables::{Causality, Initial, Variable, token, variables};

/// Name of the shared library inside an FMU, the same in both versions.
pub const MODEL_IDENTIFIER: &str = "ArmRs";

/// Versions of the Functional Mock-up Interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fmi {
    /// FMI 2.0 for co-simulation.
    Two,
    /// FMI 3.0 for co-simulation.
    Three,
}

/// `modelDescription.xml` of an arm. The same arm has the same bytes; there is no date in it.
///
/// # Errors
/// [`Refused`] for an arm whose effects the catalogue does not hold.
pub fn model_description(spec: &ArmSpec, fmi: Fmi) -> Result<String, Refused> {
    let table = variables(spec)?;
    let units = used_units(&table)?;
    let exchange = spec.no_exchange().is_none();
    let mut xml = Xml::new();
    open_root(&mut xml, spec, fmi, exchange)?;
    interfaces(&mut xml, spec, fmi, exchange);
    unit_definitions(&mut xml, &units);
    log_categories(&mut xml);
    xml.leaf(
        "DefaultExperiment",
        &[
            ("startTime", "0.0"),
            ("stopTime", "2.0"),
            ("stepSize", "0.001"),
        ],
    );
    xml.open("ModelVariables", &[]);
    for (reference, variable) in table.iter().enumerate() {
        // Value references are places from one in FMI 2.0, where time is left out.
        let state = variable.quantity.state().filter(|_| exchange);
        let integral = state.or(variable.quantity.input());
        let integral = integral.and_then(|s| table.iter().position(|v| v.quantity == s));
        match fmi {
            Fmi::Two if variable.causality == Causality::Independent => {}
            Fmi::Two => scalar_variable(&mut xml, reference, variable, integral)?,
            Fmi::Three => float64(&mut xml, reference, variable, integral)?,
        }
    }
    xml.close("ModelVariables");
    structure(&mut xml, fmi, spec, &table);
    xml.close("fmiModelDescription");
    Ok(xml.text)
}

/// Opens the element of the whole: what the model is, and who made it.
fn open_root(xml: &mut Xml, spec: &ArmSpec, fmi: Fmi, exchange: bool) -> Result<(), Refused> {
    let (version, token) = (env!("CARGO_PKG_VERSION"), token(spec)?);
    let port = match spec.port {
        Port::Force => "force port: force on the arm in, motion of its handle out",
        Port::Motion => {
            "motion port: motion of the robot's handle in, force of the contact on the robot out"
        }
    };
    let (fmi_version, token_name) = match fmi {
        Fmi::Two => ("2.0", "guid"),
        Fmi::Three => ("3.0", "instantiationToken"),
    };
    let indicators: &[(&str, &str)] = match fmi {
        Fmi::Two if exchange => &[("numberOfEventIndicators", "0")],
        _ => &[],
    };
    let text = format!(
        "Planar arm of {} joints, {port}. y forward, z up, counter-clockwise positive.",
        spec.joints()
    );
    let tool = format!("armrs {version}");
    xml.open(
        "fmiModelDescription",
        &[
            &[
                ("fmiVersion", fmi_version),
                ("modelName", &spec.name),
                (token_name, &token),
                ("description", &text),
                ("version", version),
                ("license", "MIT OR Apache-2.0"),
                ("generationTool", &tool),
                ("variableNamingConvention", "structured"),
            ],
            indicators,
        ]
        .concat(),
    );
    Ok(())
}

fn log_categories(xml: &mut Xml) {
    xml.open("LogCategories", &[]);
    xml.leaf(
        "Category",
        &[
            ("name", "logStatusError"),
            ("description", "Calls that were not done, and why."),
        ],
    );
    xml.leaf(
        "Category",
        &[
            ("name", "logEvents"),
            ("description", "What an instance does."),
        ],
    );
    xml.close("LogCategories");
}

/// `terminalsAndIcons.xml` of an arm: its port as the terminal `handle`.
///
/// # Errors
/// As [`model_description`].
pub fn terminals(spec: &ArmSpec) -> Result<String, Refused> {
    let mut xml = Xml::new();
    xml.open("fmiTerminalsAndIcons", &[("fmiVersion", "3.0")]);
    xml.open("GraphicalRepresentation", &[]);
    let corners = [("x1", "-100"), ("y1", "-100"), ("x2", "100"), ("y2", "100")];
    xml.leaf(
        "CoordinateSystem",
        &[&corners[..], &[("suggestedScalingFactorTo_mm", "0.1")]].concat(),
    );
    xml.leaf("Icon", &corners);
    xml.close("GraphicalRepresentation");
    xml.open("Terminals", &[]);
    let members: &[&str] = match spec.port {
        Port::Force => &["handle.F", "handle.r", "handle.v"],
        Port::Motion => &["robot.r", "robot.v", "contact.F"],
    };
    xml.open(
        "Terminal",
        &[
            ("name", "handle"),
            ("matchingRule", "plug"),
            ("description", "The power bond between hand and robot: force, position and velocity along y and z."),
        ],
    );
    for variable in variables(spec)? {
        let Some((stem, _)) = variable.name.split_once('[') else {
            continue;
        };
        if members.contains(&stem) {
            let member = &variable.name[stem.find('.').map_or(0, |dot| dot + 1)..];
            xml.leaf(
                "TerminalMemberVariable",
                &[
                    ("variableName", &*variable.name),
                    ("memberName", member),
                    ("variableKind", "signal"),
                ],
            );
        }
    }
    xml.close("Terminal");
    xml.close("Terminals");
    xml.close("fmiTerminalsAndIcons");
    Ok(xml.text)
}

fn used_units(table: &[Variable]) -> Result<Vec<Unit>, Refused> {
    let mut units: Vec<Unit> = Vec::new();
    for variable in table {
        let known = unit(variable.unit).ok_or_else(|| {
            Refused::error(format!(
                "{}: unknown unit {:?}",
                variable.name, variable.unit
            ))
        })?;
        if !units.contains(&known) {
            units.push(known);
        }
    }
    Ok(units)
}

fn unit_definitions(xml: &mut Xml, units: &[Unit]) {
    xml.open("UnitDefinitions", &[]);
    for unit in units {
        xml.open("Unit", &[("name", &unit.name)]);
        let exponents: Vec<_> = ["kg", "m", "s", "rad"]
            .into_iter()
            .zip(unit.exponents.map(|e| e.to_string()))
            .filter(|(_, e)| e != "0")
            .collect();
        let pairs: Vec<_> = exponents
            .iter()
            .map(|(name, e)| (*name, e.as_str()))
            .collect();
        xml.leaf("BaseUnit", &pairs);
        let degrees = number(180.0 / std::f64::consts::PI);
        match unit.name.as_str() {
            "rad" => xml.leaf("DisplayUnit", &[("name", "deg"), ("factor", &degrees)]),
            "rad/s" => xml.leaf("DisplayUnit", &[("name", "deg/s"), ("factor", &degrees)]),
            _ => {}
        }
        xml.close("Unit");
    }
    xml.close("UnitDefinitions");
}

/// Attributes of the number itself, the same in both versions.
fn numeric(variable: &Variable) -> Result<Vec<(&'static str, String)>, Refused> {
    let unit = unit(variable.unit)
        .ok_or_else(|| Refused::error(format!("unknown unit {:?}", variable.unit)))?;
    let mut attributes = vec![("unit", unit.name.clone())];
    match unit.name.as_str() {
        "rad" => attributes.push(("displayUnit", "deg".to_owned())),
        "rad/s" => attributes.push(("displayUnit", "deg/s".to_owned())),
        _ => {}
    }
    let (min, max) = variable.range;
    for (name, bound) in [("min", min), ("max", max)] {
        if bound.is_finite() {
            attributes.push((name, number(bound)));
        }
    }
    if variable.nominal != 1.0 {
        attributes.push(("nominal", number(variable.nominal)));
    }
    if let Some(start) = variable.start {
        attributes.push(("start", number(start)));
    }
    Ok(attributes)
}

/// Attributes of the variable, the same in both versions.
fn general(reference: usize, variable: &Variable) -> Vec<(&'static str, String)> {
    let mut attributes = vec![
        ("name", variable.name.clone()),
        ("valueReference", reference.to_string()),
        ("description", variable.description.clone()),
        ("causality", variable.causality.name().to_owned()),
        ("variability", variable.variability.name().to_owned()),
    ];
    match variable.initial {
        Some(Initial::Exact) => attributes.push(("initial", "exact".to_owned())),
        Some(Initial::Calculated) => attributes.push(("initial", "calculated".to_owned())),
        None => {}
    }
    attributes
}

fn float64(
    xml: &mut Xml,
    reference: usize,
    variable: &Variable,
    integral: Option<usize>,
) -> Result<(), Refused> {
    let mut attributes = general(reference, variable);
    attributes.extend(numeric(variable)?);
    attributes.extend(integral.map(|s| ("derivative", s.to_string())));
    xml.leaf("Float64", &borrowed(&attributes));
    Ok(())
}

fn scalar_variable(
    xml: &mut Xml,
    reference: usize,
    variable: &Variable,
    integral: Option<usize>,
) -> Result<(), Refused> {
    xml.open("ScalarVariable", &borrowed(&general(reference, variable)));
    let mut real = numeric(variable)?;
    real.extend(integral.map(|s| ("derivative", s.to_string())));
    xml.leaf("Real", &borrowed(&real));
    xml.close("ScalarVariable");
    Ok(())
}

fn borrowed<'a>(attributes: &'a [(&'static str, String)]) -> Vec<(&'static str, &'a str)> {
    attributes
        .iter()
        .map(|(name, value)| (*name, value.as_str()))
        .collect()
}

/// The interfaces that are offered, Model Exchange first as the schemas have it.
fn interfaces(xml: &mut Xml, spec: &ArmSpec, fmi: Fmi, exchange: bool) {
    let step = number(spec.step);
    let identifier = ("modelIdentifier", MODEL_IDENTIFIER);
    let varies = ("canHandleVariableCommunicationStepSize", "true");
    let order = ("maxOutputDerivativeOrder", "1");
    let states: &[(&str, &str)] = match fmi {
        Fmi::Two => &[
            ("canNotUseMemoryManagementFunctions", "true"),
            ("canGetAndSetFMUstate", "true"),
            ("canSerializeFMUstate", "true"),
            ("providesDirectionalDerivative", "true"),
        ],
        Fmi::Three => &[
            ("canGetAndSetFMUState", "true"),
            ("canSerializeFMUState", "true"),
            ("providesDirectionalDerivatives", "true"),
        ],
    };
    if exchange {
        let steps: &[(&str, &str)] = match fmi {
            Fmi::Two => &[("completedIntegratorStepNotNeeded", "true")],
            Fmi::Three => &[],
        };
        xml.leaf("ModelExchange", &[&[identifier], steps, states].concat());
    }
    let steps: &[(&str, &str)] = match fmi {
        Fmi::Two => &[varies, ("canInterpolateInputs", "true"), order],
        Fmi::Three => &[varies, ("fixedInternalStepSize", &step), order],
    };
    xml.leaf("CoSimulation", &[&[identifier], steps, states].concat());
}

fn structure(xml: &mut Xml, fmi: Fmi, spec: &ArmSpec, table: &[Variable]) {
    let exchange = spec.no_exchange().is_none();
    let rows = |wanted: &dyn Fn(&Variable) -> bool| -> Vec<usize> {
        let all = table.iter().enumerate();
        all.filter(|(_, v)| wanted(v)).map(|(k, _)| k).collect()
    };
    let outputs = rows(&|v| v.causality == Causality::Output);
    let derivatives = rows(&|v| exchange && v.quantity.state().is_some());
    let calculated = rows(&|v| {
        let computed =
            v.causality == Causality::Output || (exchange && v.quantity.state().is_some());
        computed && v.initial == Some(Initial::Calculated)
    });
    xml.open("ModelStructure", &[]);
    for (two, three, unknowns, when) in [
        ("Outputs", "Output", outputs, When::Moving),
        (
            "Derivatives",
            "ContinuousStateDerivative",
            derivatives,
            When::Moving,
        ),
        (
            "InitialUnknowns",
            "InitialUnknown",
            calculated,
            When::Starting,
        ),
    ] {
        if unknowns.is_empty() {
            continue;
        }
        if fmi == Fmi::Two {
            xml.open(two, &[]);
        }
        for reference in unknowns {
            let listed = dependencies(spec, table, table[reference].quantity, when);
            // In FMI 2.0 time is no variable; states are known where the importer has them.
            let listed: Vec<_> = listed
                .into_iter()
                .filter(|&k| fmi == Fmi::Three || table[k].causality != Causality::Independent)
                .filter(|&k| exchange || when == When::Starting || !table[k].quantity.is_state())
                .map(|k| k.to_string())
                .collect();
            let (reference, listed) = (reference.to_string(), listed.join(" "));
            match fmi {
                // Indices count from one, and time, the first row of the table, is not listed: they are the value references.
                Fmi::Two => xml.leaf(
                    "Unknown",
                    &[("index", &reference), ("dependencies", &listed)],
                ),
                Fmi::Three => xml.leaf(
                    three,
                    &[("valueReference", &reference), ("dependencies", &listed)],
                ),
            }
        }
        if fmi == Fmi::Two {
            xml.close(two);
        }
    }
    xml.close("ModelStructure");
}

/// The shortest decimal number that reads back to the same bits.
fn number(value: f64) -> String {
    format!("{value:?}")
}

/// XML with two spaces a level.
struct Xml {
    text: String,
    depth: usize,
}

impl Xml {
    fn new() -> Self {
        Self {
            text: "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_owned(),
            depth: 0,
        }
    }

    fn open(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.start(name, attributes);
        self.text += ">\n";
        self.depth += 1;
    }

    fn leaf(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.start(name, attributes);
        self.text += "/>\n";
    }

    fn close(&mut self, name: &str) {
        self.depth -= 1;
        self.text += &format!("{}</{name}>\n", "  ".repeat(self.depth));
    }

    fn start(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.text += &format!("{}<{name}", "  ".repeat(self.depth));
        for (name, value) in attributes {
            self.text += &format!(" {name}=\"{}\"", escaped(value));
        }
    }
}

fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
