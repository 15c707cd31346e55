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

#[test]
fn rows_are_sound() {
    for spec in both() {
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
