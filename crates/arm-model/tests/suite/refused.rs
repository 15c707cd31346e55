//! What is no model: refused quickly, and named on one line.

use std::time::{Duration, Instant};

use arm_model::Model;

use crate::model::{MODEL, model};

/// What is broken: text in the accepted model, its replacement, and the message.
const BROKEN: &[(&str, &str, &str)] = &[
    (
        "mass = 2.114",
        "mas = 2.114",
        "[[arm.segment]] 1: found unknown key 'mas', allowed com, com_normal, inertia, length, mass, name (nearest known: mass)",
    ),
    (
        "[contact]",
        "[contakt]",
        ": found unknown key 'contakt', allowed arm, contact, effect, robot (nearest known: contact)",
    ),
    (
        "mass = 2.114\n",
        "",
        "[[arm.segment]] 1, mass: found nothing, allowed key mass is required",
    ),
    (
        "mass = 2.114",
        "mass = 0.0",
        "[[arm.segment]] 1, mass: found 0.0, allowed a finite number > 0 kg",
    ),
    (
        "mass = 2.114",
        "mass = -1",
        "[[arm.segment]] 1, mass: found -1.0, allowed a finite number > 0 kg",
    ),
    (
        "mass = 2.114",
        "mass = inf",
        "[[arm.segment]] 1, mass: found inf, allowed a finite number > 0 kg",
    ),
    (
        "mass = 2.114",
        "mass = nan",
        "[[arm.segment]] 1, mass: found nan, allowed a finite number > 0 kg",
    ),
    (
        "mass = 2.114",
        "mass = \"2.114\"",
        "[[arm.segment]] 1, mass: found '2.114', allowed a finite number > 0 kg",
    ),
    (
        "mass = 2.114",
        "mass = true",
        "[[arm.segment]] 1, mass: found true, allowed a finite number > 0 kg",
    ),
    (
        "mass = 2.114",
        "mass = 2026-01-01",
        "[[arm.segment]] 1, mass: found 2026-01-01, allowed a finite number > 0 kg",
    ),
    (
        "mass = 2.114",
        "mass = 400",
        "[[arm.segment]] 1, mass: found 400.0, allowed at most 322 kg for a segment of 0.322 m (grams?)",
    ),
    (
        "length = 0.322",
        "length = 322",
        "[[arm.segment]] 1, length: found 322.0, allowed a finite number > 0 and <= 100 m (millimetres?)",
    ),
    (
        "com = 0.186",
        "com = 0.4",
        "[[arm.segment]] 1, com: found 0.4, allowed a finite number 0 to 0.322 m (at most the length of the segment)",
    ),
    (
        "inertia = 0.0165",
        "inertia = -0.1",
        "[[arm.segment]] 1, inertia: found -0.1, allowed a finite number >= 0 kg m²",
    ),
    (
        "inertia = 0.0165",
        "inertia = 0.0165\ncom_normal = -1",
        "[[arm.segment]] 1, com_normal: found -1.0, allowed a finite number -0.322 to 0.322 m",
    ),
    (
        "\"upper arm\"",
        "\"\"",
        "[[arm.segment]] 1, name: found '', allowed a text on one line",
    ),
    (
        "[[arm.joint]]\nname = \"elbow\"\n",
        "",
        "[[arm.joint]]: found 1 joints, allowed one a segment, so 2",
    ),
    (
        "stiffness = 1.2",
        "stiffness = -1.2",
        "[[arm.joint]] 1, stiffness: found -1.2, allowed a finite number 0 to 1000 N m/rad",
    ),
    (
        "rest = -0.785",
        "rest = -145",
        "[[arm.joint]] 1, rest: found -145.0, allowed a finite number -7 to 7 rad (degrees?)",
    ),
    (
        "coulomb = 0.0",
        "coulomb = 150",
        "[[arm.joint]] 1, coulomb: found 150.0, allowed a finite number 0 to 100 N m",
    ),
    (
        "viscosity = 0.25",
        "viscosity = 1e300",
        "[[arm.joint]] 1, viscosity: found 1e+300, allowed a finite number 0 to 100 N m s/rad",
    ),
    (
        "base = [0.0, 0.0]",
        "base = [0.0, 0.0, 0.0]",
        "[arm], base: found [0.0, 0.0, 0.0], allowed two numbers, not 3",
    ),
    (
        "base = [0.0, 0.0]",
        "base = 0.0",
        "[arm], base: found 0.0, allowed two numbers",
    ),
    (
        "uncertainty = 0.05",
        "uncertainty = 5",
        "[arm], segment_uncertainty: found 5.0, allowed a finite number 0 to 1 (5 % is 0.05)",
    ),
    (
        "uncertainty = 0.05",
        "uncertainty = 0\njoint_uncertainty = 5",
        "[arm], joint_uncertainty: found 5.0, allowed a finite number 0 to 1 (5 % is 0.05)",
    ),
    (
        "elbow = \"up\"",
        "elbow = \"left\"",
        "[robot], elbow: found 'left', allowed \"up\" or \"down\"",
    ),
    (
        "lengths = [0.45, 0.45]",
        "lengths = [0.45, 0]",
        "[robot], lengths[1]: found 0.0, allowed a finite number > 0 and <= 100 m (millimetres?)",
    ),
    (
        "stiffness = [10000.0, 10000.0]",
        "stiffness = [0, 1]",
        "[contact], stiffness[0]: found 0.0, allowed a finite number > 0 N/m",
    ),
    (
        "stiffness = [10000.0, 10000.0]",
        "stiffness = [1, 1]",
        "[contact], stiffness: found 1.0, allowed >= 136 N/m: 16 N of the arm's weight would press it in by 16 m (kN/m or N/mm? 10 kN/m is 10000)",
    ),
    (
        "stiffness = [10000.0, 10000.0]\n",
        "",
        "[contact], stiffness: found nothing, allowed key stiffness is required",
    ),
    (
        "[[effect]]",
        "[effect]",
        "effect: found one table, allowed a list of tables, written [[effect]]",
    ),
    (
        "[robot]",
        "[arm.robot]",
        "[arm]: found unknown key 'robot', allowed base, gravity, joint, joint_uncertainty, segment, segment_uncertainty",
    ),
    (
        "joint = 2",
        "joint = 3",
        "[[effect]] 1 (coulomb), joint: found 3, allowed 1 to 2",
    ),
    (
        "joint = 2",
        "joint = 0",
        "[[effect]] 1 (coulomb), joint: found 0, allowed a whole number >= 1",
    ),
    (
        "joint = 2",
        "joint = 2.0",
        "[[effect]] 1 (coulomb), joint: found 2.0, allowed a whole number >= 1",
    ),
    (
        "joint = 2",
        "joint = \"elbo\"",
        "[[effect]] 1 (coulomb), joint: found unknown joint 'elbo', allowed elbow, shoulder (nearest known: elbow)",
    ),
    (
        "joint = 2\n",
        "",
        "[[effect]] 1 (coulomb), joint: found nothing, allowed the number of the joint or segment, from 1",
    ),
    (
        "joint = 2",
        "joint = 2\nchannel = \"Fy\"",
        "[[effect]] 1 (coulomb), channel: found 'Fy', allowed no key channel: coulomb acts on the joint",
    ),
    (
        "joint = 2",
        "channel = \"Fx\"",
        "[[effect]] 1 (coulomb), channel: found 'Fx', allowed \"Fy\" or \"Fz\" or \"Mx\"",
    ),
    (
        "kind = \"coulomb\"\n",
        "",
        "[[effect]] 1, kind: found nothing, allowed key kind is required",
    ),
    (
        "kind = \"coulomb\"",
        "kind = 1",
        "[[effect]] 1, kind: found 1, allowed a text on one line",
    ),
    (
        "torque = 0.161",
        "torqe = 0.161",
        "[[effect]] 1 (coulomb): found unknown key 'torqe', allowed joint, smoothing, torque (nearest known: torque)",
    ),
    (
        "torque = 0.161",
        "torque = -1.0",
        "[[effect]] 1 (coulomb), torque: found -1.0, allowed a finite number 0 to 100 N m",
    ),
    (
        "kind = \"coulomb\"\njoint = 2\ntorque = 0.161",
        "kind = \"biarticular\"\njoint = 1",
        "[[effect]] 1 (biarticular), joint: found 1, allowed 2 to 2",
    ),
    (
        "mass = 2.114",
        "mass = 2.114\nmass = 2.0",
        "line 10, column 1: found duplicate key, allowed TOML",
    ),
    (
        "mass = 2.114",
        "\"ma\\nss\" = 2.114",
        "[[arm.segment]] 1: found unknown key 'ma\\nss', allowed com, com_normal, inertia, length, mass, name (nearest known: mass)",
    ),
];

#[test]
fn what_is_broken_is_named_on_one_line() {
    for (old, new, expected) in BROKEN {
        assert_eq!(MODEL.matches(old).count(), 1, "{old}");
        let refused = Model::from_toml(&MODEL.replace(old, new)).expect_err(expected);
        assert_eq!(refused.to_string(), *expected);
        assert!(!refused.to_string().contains('\n'));
    }
}

fn refusal(text: &str) -> String {
    Model::from_toml(text).expect_err("refused").to_string()
}

#[test]
fn what_is_no_model_is_refused() {
    for (text, expected) in [
        ("", "arm: found nothing, allowed key arm is required"),
        ("arm = 3", "[arm]: found 3, allowed a table"),
        (
            "[arm]\nsegment = []",
            "[[arm.segment]]: found 0 segments, allowed 1 to 6 segments",
        ),
        (
            "[arm]\nsegment = [1]",
            "arm.segment: found [1], allowed a list of tables, written [[arm.segment]]",
        ),
    ] {
        assert_eq!(refusal(text), expected);
    }
    let kind = MODEL.replace("\"coulomb\"", "\"coulom\"");
    let refused = refusal(&kind);
    assert!(refused.starts_with(
        "[[effect]] 1 (coulom), kind: found unknown kind of effect 'coulom', allowed active_stiffness, "
    ));
    assert!(refused.ends_with("(nearest known: coulomb)"));
    assert!(
        refusal(&MODEL.replace("mass = 2.114", "mass = = 2"))
            .starts_with("line 9, column 8: found ")
    );
}

/// Documents that are small and would cost a careless reader all its stack or time.
#[test]
fn bombs_are_refused_quickly() {
    let start = Instant::now();
    let deep = format!("a = {}{}", "[".repeat(100_000), "]".repeat(100_000));
    let tables = format!("a = {}1{}", "{b = ".repeat(50_000), "}".repeat(50_000));
    let dotted = format!("{}x = 1", "a.".repeat(100_000));
    for bomb in [&deep, &tables, &dotted] {
        let refused = Model::from_toml(bomb).unwrap_err();
        assert_eq!(refused.allowed, "TOML", "{refused}");
        assert!(refused.to_string().len() < 200);
    }
    let long = |digits: String| MODEL.replace("mass = 2.114", &format!("mass = {digits}"));
    for digits in [
        "9".repeat(5000),
        format!("1{}", "0".repeat(400)),
        "9".repeat(5000) + ".0",
    ] {
        let refused = Model::from_toml(&long(digits)).unwrap_err();
        assert_eq!(refused.place, "[[arm.segment]] 1, mass");
        assert_eq!(refused.allowed, "a finite number > 0 kg");
        assert!(refused.found.len() <= 80);
    }
    let small = format!("0.{}1", "0".repeat(5000));
    assert_eq!(
        refusal(&long(small)),
        "[[arm.segment]] 1, mass: found 0.0, allowed a finite number > 0 kg"
    );
    let key = format!("{} = 1\n", "k".repeat(1_000_000));
    assert!(refusal(&(key + MODEL)).len() < 300);
    let nested = format!("{}1{}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(serde_json::from_str::<Model>(&nested).is_err());
    let file = std::env::temp_dir().join(format!("arm-model-{}.toml", std::process::id()));
    std::fs::write(&file, vec![b'#'; 17 << 20]).unwrap();
    let refused = Model::load(&file).unwrap_err();
    std::fs::remove_file(&file).unwrap();
    assert_eq!(refused.found, "more than 16777216 bytes");
    assert!(start.elapsed() < Duration::from_secs(5));
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let folder = std::env::temp_dir();
    let refused = Model::load(&folder).unwrap_err();
    assert_eq!(
        refused.to_string(),
        format!(
            "{}: file: found a folder, allowed a TOML file",
            folder.display()
        )
    );
    #[cfg(unix)]
    {
        let refused = Model::load("/dev/zero".as_ref()).unwrap_err();
        assert_eq!(refused.found, "a device or a pipe");
    }
    let none = folder.join("no such model.toml");
    let refused = Model::load(&none).unwrap_err().to_string();
    assert_eq!(
        refused,
        format!(
            "{}: file: found No such file or directory, allowed a TOML file that can be read",
            none.display()
        )
    );
    let file = folder.join(format!("arm-model-bytes-{}.toml", std::process::id()));
    std::fs::write(&file, b"[arm]\ngravity = 9.81 # \xb5\n").unwrap();
    let latin = Model::load(&file).unwrap_err();
    let marked = [b"\xef\xbb\xbf", MODEL.replace('\n', "\r\n").as_bytes()].concat();
    std::fs::write(&file, marked).unwrap();
    let windows = Model::load(&file);
    std::fs::remove_file(&file).unwrap();
    assert_eq!(latin.place, "line 2");
    assert_eq!(latin.found, "byte 0xb5");
    assert_eq!(windows, Ok(model()));
}
