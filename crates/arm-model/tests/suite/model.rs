//! Models: what is accepted, what is refused and in which words, that writing loses nothing, and the identity of parameters.

use std::time::{Duration, Instant};

use arm_core::effect::{KINDS, Kind};
use arm_model::{Contact, Effect, Joint, Model, ParameterId, Parts, Refused, Segment, Site};

const MODEL: &str = r#"[arm]
gravity = 9.81
base = [0.0, 0.0]
segment_uncertainty = 0.05

[[arm.segment]]
name = "upper arm"
length = 0.322
mass = 2.114
com = 0.186
inertia = 0.0165

[[arm.segment]]
name = "forearm"
length = 0.264
mass = 1.264
com = 0.121
inertia = 0.0074

[[arm.joint]]
name = "shoulder"
stiffness = 1.2
rest = -0.785
viscosity = 0.25
coulomb = 0.0

[[arm.joint]]
name = "elbow"

[robot]
lengths = [0.45, 0.45]
base = [1.05, -0.10]
elbow = "up"

[contact]
stiffness = [10000.0, 10000.0]
damping = [25.0, 25.0]

[[effect]]
kind = "coulomb"
joint = 2
torque = 0.161
"#;

fn model() -> Model {
    Model::from_toml(MODEL).expect("the model is accepted")
}

fn id(text: &str) -> ParameterId {
    text.parse().expect("a parameter")
}

#[test]
fn every_key_is_read() {
    let model = model();
    assert_eq!(model.segments[0].name, "upper arm");
    assert_eq!(model.segments[1].inertia, 0.0074);
    assert_eq!(model.joints[0].rest, -0.785);
    assert_eq!(model.joints[1], Joint::named("elbow"));
    assert_eq!((model.gravity, model.base), (9.81, [0.0; 2]));
    assert_eq!(
        (model.segment_uncertainty, model.joint_uncertainty),
        (0.05, 0.0)
    );
    assert_eq!(model.robot.unwrap().lengths, [0.45; 2]);
    assert_eq!(model.contact, Some(Contact::ASSUMED));
    let [effect] = model.effects[..] else {
        panic!("one effect")
    };
    assert_eq!((effect.name(), effect.joint()), ("coulomb", Some(1)));
    assert_eq!(effect.value("torque"), Some(0.161));
    assert_eq!(effect.value("smoothing"), Some(0.01));
}

#[test]
fn what_is_left_out_has_its_default() {
    let text =
        "[arm]\n[[arm.segment]]\nlength = 1\nmass = 1\ncom = 0.5\ninertia = 0\n[[arm.joint]]\n";
    let model = Model::from_toml(text).unwrap();
    assert_eq!(model.segments[0].name, "segment 1");
    assert_eq!(model.joints[0], Joint::named("joint 1"));
    assert_eq!(
        (model.robot, model.contact, model.effects.len()),
        (None, None, 0)
    );
}

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
        "[[effect]] 1 (coulom), kind: found unknown kind of effect 'coulom', allowed added_mass, "
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

fn hard() -> Model {
    let hard = 0.1 + 0.2;
    let mut effects: Vec<Effect> = KINDS
        .iter()
        .map(|&kind| Effect::new(kind, Site::of(kind, 1)).unwrap())
        .collect();
    effects.push(
        Effect::new(Kind::Coulomb, Site::Joint(0))
            .unwrap()
            .with("torque", hard)
            .unwrap(),
    );
    model()
        .change(|parts: &mut Parts| {
            parts.gravity = hard;
            parts.joint_uncertainty = 0.1;
            parts.segments[0] = Segment {
                name: "a \"quoted\" \\ näme".to_owned(),
                length: 5e-324,
                mass: 1e-300,
                com: 0.0,
                inertia: hard,
                com_normal: 5e-324,
            };
            parts.effects = effects;
        })
        .unwrap()
}

#[test]
fn writing_loses_nothing() {
    for model in [model(), hard()] {
        let text = model.to_toml();
        let again = Model::from_toml(&text).unwrap();
        assert_eq!(again, model);
        assert_eq!(again.to_toml(), text);
        let json = serde_json::to_string(&model).unwrap();
        assert_eq!(serde_json::from_str::<Model>(&json).unwrap(), model);
    }
    // What Python's `repr` and the writer before this one gave.
    let text = model().to_toml();
    assert!(text.starts_with("[arm]\ngravity = 9.81\nbase = [0.0, 0.0]\nsegment_uncertainty = 0.05\n\n[[arm.segment]]\nname = \"upper arm\"\n"));
    assert!(text.ends_with(
        "\n\n[[effect]]\nkind = \"coulomb\"\njoint = 2\ntorque = 0.161\nsmoothing = 0.01\n"
    ));
}

#[test]
fn json_is_refused_in_the_same_words() {
    let json = serde_json::to_string(&model())
        .unwrap()
        .replace("2.114", "-1");
    let refused = serde_json::from_str::<Model>(&json)
        .unwrap_err()
        .to_string();
    assert_eq!(
        refused,
        "[[arm.segment]] 1, mass: found -1.0, allowed a finite number > 0 kg"
    );
    let twice = r#"{"arm": 1, "arm": 2}"#;
    assert!(
        serde_json::from_str::<Model>(twice)
            .unwrap_err()
            .to_string()
            .contains("key 'arm' twice")
    );
}

#[test]
fn a_parameter_has_one_identity() {
    let model = hard();
    let all = model.parameters();
    for parameter in &all {
        let text = parameter.id.to_string();
        assert_eq!(id(&text), parameter.id, "{text}");
        assert_eq!(model.value(parameter.id), Some(parameter.value), "{text}");
        assert_eq!(
            model.with(parameter.id, parameter.value).as_ref(),
            Ok(&model),
            "{text}"
        );
        assert!(
            parameter.bounds.check("", parameter.value).is_ok(),
            "{text}"
        );
    }
    let mut ids: Vec<_> = all.iter().map(|p| p.id).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), all.len());
}

#[test]
fn the_same_model_with_one_parameter_changed() {
    let model = model();
    for (text, value) in [
        ("arm.gravity", 1.62),
        ("arm.base[2]", 0.5),
        ("segment[2].mass", 1.0),
        ("joint[1].coulomb.torque", 0.3),
        ("joint[2].coulomb.torque", 0.3),
        ("joint[2].coulomb.smoothing", 0.02),
        ("joint[1].elastic.rest", 0.1),
        ("joint[1].viscous.viscosity", 0.0),
        ("joint[2].elastic.stiffness", -1.0),
        ("contact.stiffness[1]", 5000.0),
        ("robot.lengths[2]", 0.5),
        ("channel[Fz].force_bias.bias", 0.2),
        ("sensors.time_delay.delay", 0.01),
        ("arm.gravity_tilt.angle", 0.01),
        ("hand.added_mass.mass", 0.2),
        ("contact.backlash.y", 0.001),
        ("segment[1].gravity_moment.moment", 0.1),
    ] {
        let changed = model.with(id(text), value).unwrap();
        assert_eq!(changed.value(id(text)), Some(value), "{text}");
        let others = model.parameters();
        for other in others.iter().filter(|p| p.id != id(text)) {
            let after = changed.value(other.id);
            // A viscosity of zero is no effect, and its key still says so.
            assert_eq!(after, Some(other.value), "{} after {text}", other.id);
        }
        let again = Model::from_toml(&changed.to_toml()).unwrap();
        assert_eq!(again, changed, "{text}");
    }
    // Stated by the joint: smoothing has no key there.
    let smooth = model.with(id("joint[1].coulomb.torque"), 0.2).unwrap();
    let smooth = smooth.with(id("joint[1].coulomb.smoothing"), 0.05).unwrap();
    assert_eq!(smooth.joints[0].coulomb, 0.0);
    assert_eq!(smooth.value(id("joint[1].coulomb.torque")), Some(0.2));
    assert_eq!(smooth.joints[0].stiffness, 1.2);
}

#[test]
fn parameters_that_are_not_there_are_refused() {
    let model = model();
    let refused = |text: &str, value: f64| model.with(id(text), value).unwrap_err().to_string();
    assert_eq!(
        refused("joint[1].coulomb.torque", 150.0),
        "[[arm.joint]] 1, coulomb: found 150.0, allowed a finite number 0 to 100 N m"
    );
    assert_eq!(
        refused("joint[2].coulomb.torque", 150.0),
        "[[effect]] 1 (coulomb), torque: found 150.0, allowed a finite number 0 to 100 N m"
    );
    assert_eq!(
        refused("segment[3].mass", 1.0),
        "parameter: found no segment[3].mass, allowed a parameter of an object that the model has"
    );
    assert_eq!(
        refused("joint[3].tremor.amplitude", 1.0),
        "[[effect]] 2 (tremor), joint: found 3, allowed 1 to 2"
    );
    assert_eq!(
        refused("segment[1].com", 0.5),
        "[[arm.segment]] 1, com: found 0.5, allowed a finite number 0 to 0.322 m (at most the length of the segment)"
    );
    for (text, expected) in [
        ("segmnt[1].mass", "unknown object 'segmnt'"),
        ("segment[1].mas", "unknown parameter 'mas'"),
        ("joint[1].coulom.torque", "unknown kind of effect 'coulom'"),
        ("joint[1].coulomb.torqe", "unknown parameter 'torqe'"),
        ("segment[1].coulomb.torque", "'segment[1].coulomb.torque'"),
        ("segment.mass", "'segment.mass'"),
        ("segment[0].mass", "'segment[0].mass'"),
        ("arm.gravity[1]", "'arm.gravity[1]'"),
        ("arm.base", "'arm.base'"),
        ("arm.base[3]", "'arm.base[3]'"),
        ("", "unknown object ''"),
    ] {
        let refused: Refused = text.parse::<ParameterId>().unwrap_err();
        assert_eq!(refused.found, expected, "{text}");
    }
}

#[test]
fn laws_of_joints_are_effects_like_any_other() {
    let model = model();
    let names: Vec<_> = model
        .all_effects()
        .iter()
        .map(|e| (e.name(), e.joint()))
        .collect();
    assert_eq!(
        names,
        [
            ("elastic", Some(0)),
            ("viscous", Some(0)),
            ("coulomb", Some(1))
        ]
    );
    let [elastic, ..] = model.core_effects()[..] else {
        panic!("effects")
    };
    assert_eq!(elastic.parameters[..2], [1.2, -0.785]);
    let again = model.with_joint_effects(&model.all_effects(), &[]).unwrap();
    assert_eq!(again.joints[0], model.joints[0]);
    assert_eq!((again.joints[1].coulomb, again.effects.len()), (0.161, 0));
    let soft = Effect::new(Kind::Elastic, Site::Joint(0))
        .unwrap()
        .with("stiffness", -0.5)
        .unwrap();
    let again = model.with_joint_effects(&[soft], &[]).unwrap();
    assert_eq!(
        (again.joints[0].stiffness, again.effects.as_slice()),
        (0.0, &[soft][..])
    );
}

#[test]
fn the_core_gets_the_arm_as_it_stands() {
    let model = model();
    let chain = model.chain::<2>().unwrap();
    assert_eq!(chain.segments()[1].mass, 1.264);
    assert_eq!(chain.gravity(), [0.0, -9.81]);
    assert!(model.chain::<3>().is_err());
    assert_eq!(model.setup::<2>().unwrap().contact.stiffness, [1e4; 2]);
    let heavier = model.with_mass(1, 0.5, None).unwrap();
    let hand = &heavier.segments[1];
    assert!((hand.mass * hand.com - (1.264 * 0.121 + 0.5 * 0.264)).abs() < 1e-15);
    assert!(model.with_mass(1, 0.5, Some(0.3)).is_err());
}
