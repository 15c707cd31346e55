//! The table: names, references, units, starts.

use std::collections::HashSet;

use arm_cosim::{ArmSpec, Causality, Fmi, Initial, Slave, model_description, unit, variables};
use arm_sim::Port;

fn both() -> [ArmSpec; 2] {
    [Port::Force, Port::Motion].map(|port| ArmSpec {
        port,
        ..ArmSpec::sample()
    })
}

/// An arm whose friction sticks.
fn sticking() -> ArmSpec {
    let mut spec = ArmSpec::sample();
    for effect in &mut spec.effects {
        effect.values[1] = 0.0;
    }
    spec
}

#[test]
fn rows_are_sound() {
    for spec in both().into_iter().chain([sticking()]) {
        let table = variables(&spec).unwrap();
        let names: HashSet<_> = table.iter().map(|v| v.name.as_str()).collect();
        assert_eq!(names.len(), table.len());
        assert_eq!(table[0].causality, Causality::Independent);
        for v in &table {
            assert!(unit(v.unit).is_some(), "{}", v.unit);
            assert!(v.description.ends_with('.'), "{}", v.name);
            let known = v.start.is_some();
            let wanted = v.initial == Some(Initial::Exact) || v.causality == Causality::Input;
            assert_eq!(known, wanted, "{}", v.name);
            if let Some(start) = v.start {
                assert!(v.range.0 <= start && start <= v.range.1, "{}", v.name);
            }
        }
    }
}

#[test]
fn every_limit_of_a_variable_is_taken() {
    for spec in both() {
        for v in variables(&spec).unwrap() {
            let settable = v.start.is_some() && v.causality != Causality::Local;
            let limits = [v.range.0, v.range.1];
            for limit in limits.into_iter().filter(|l| settable && l.is_finite()) {
                let mut arm = Slave::new(spec.clone()).unwrap();
                let reference = arm.reference(&v.name).unwrap();
                arm.set(&[reference], &[limit]).unwrap();
                arm.enter_initialization_mode(0.0, None).unwrap();
                let taken = arm.exit_initialization_mode();
                assert!(taken.is_ok(), "{} = {limit}: {taken:?}", v.name);
            }
        }
    }
}

#[test]
fn derivatives_of_inputs_are_variables() {
    let mut arms = both().map(|spec| Slave::new(spec).unwrap());
    let of = |arm: &Slave, name: &str| arm.reference(name).unwrap();
    for (port, name, order, rate) in [
        (0, "handle.F[1]", 1, "der(handle.F[1])"),
        (0, "tau[2]", 1, "der(tau[2])"),
        (1, "robot.r[2]", 1, "robot.v[2]"),
        (1, "robot.r[2]", 2, "der(robot.v[2])"),
    ] {
        let arm = &mut arms[port];
        let (input, rate) = (of(arm, name), of(arm, rate));
        let set = arm.set_input_derivatives(&[input], &[order], &[0.5 * f64::from(order)]);
        assert!(set.is_ok(), "{name}: {set:?}");
        let mut value = [0.0];
        arm.get(&[rate], &mut value).unwrap();
        assert_eq!(value[0], 0.5 * f64::from(order), "{name}");
    }
    let forced = &mut arms[0];
    for (name, order) in [
        ("handle.F[1]", 0),
        ("handle.F[1]", -1),
        ("handle.F[1]", i32::MAX),
        ("q[1]", 1),
    ] {
        let reference = of(forced, name);
        let refused = forced.set_input_derivatives(&[reference], &[order], &[1.0]);
        assert!(
            refused
                .unwrap_err()
                .message
                .contains(&format!("no derivative of order {order}"))
        );
        forced.reset().unwrap();
    }
}

#[test]
fn references_are_places_and_descriptions_agree() {
    for spec in both() {
        let slave = Slave::new(spec.clone()).unwrap();
        let three = model_description(&spec, Fmi::Three).unwrap();
        let two = model_description(&spec, Fmi::Two).unwrap();
        for (place, v) in slave.variables().iter().enumerate() {
            assert_eq!(slave.reference(&v.name), u32::try_from(place).ok());
            let entry = format!("name=\"{}\" valueReference=\"{place}\"", v.name);
            assert!(three.contains(&entry));
            assert_eq!(two.contains(&entry), v.causality != Causality::Independent);
        }
        assert!(three.contains(slave.token()) && two.contains(slave.token()));
    }
}

#[test]
fn units_are_products_of_powers() {
    for (text, name, exponents) in [
        ("1", "1", [0, 0, 0, 0]),
        ("N m s/rad", "N.m.s/rad", [1, 2, -1, -1]),
        ("kg m²", "kg.m2", [1, 2, 0, 0]),
        ("N m/rad³", "N.m/rad3", [1, 2, -2, -3]),
        ("Hz", "Hz", [0, 0, -1, 0]),
    ] {
        let known = unit(text).unwrap();
        assert_eq!((known.name.as_str(), known.exponents), (name, exponents));
    }
    for text in ["", "furlong", "N/m/s", "m^2"] {
        assert_eq!(unit(text), None, "{text}");
    }
}
