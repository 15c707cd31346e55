//! Models: what is accepted, what is refused and in which words, that writing loses nothing, and the identity of parameters.

use arm_core::effect::{KINDS, Kind};
use arm_model::{
    Contact, Effect, Joint, Model, ParameterId, Parts, Refused, Segment, Site, joint_laws,
};

pub const MODEL: &str = r#"[arm]
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

pub fn model() -> Model {
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
            // A viscosity of zero is no effect, and its key is still stated.
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
fn an_effect_may_name_its_joint() {
    let named = MODEL.replace("joint = 2", "joint = \"elbow\"");
    let read = Model::from_toml(&named).unwrap();
    assert_eq!(read, model());
    // Written, it is the number, which a renamed joint keeps.
    assert_eq!(read.to_toml(), model().to_toml());
    let twins = named.replace("name = \"shoulder\"", "name = \"elbow\"");
    assert_eq!(
        Model::from_toml(&twins).unwrap_err().to_string(),
        "[[effect]] 1 (coulomb), joint: found 'elbow', allowed the number of the joint: several have this name"
    );
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

/// A `[[joint]]` states the laws that every passive joint has by the catalogue.
#[test]
fn joints_state_the_laws_of_every_passive_joint() {
    let stated: Vec<_> = joint_laws()
        .map(|(key, kind, size)| (key, kind.info().kind, size))
        .collect();
    let laws = [
        ("stiffness", "elastic", "stiffness"),
        ("viscosity", "viscous", "viscosity"),
        ("coulomb", "coulomb", "torque"),
    ];
    assert_eq!(stated, laws);
    let passive = KINDS.iter().filter(|kind| kind.prior().passive);
    let mut passive: Vec<_> = passive.map(|kind| kind.info().kind).collect();
    let mut stated = laws.map(|(_, kind, _)| kind);
    passive.sort_unstable();
    stated.sort_unstable();
    assert_eq!(passive, stated);
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

/// Where a segment's centre of mass is at its end, the mean with a mass there was beyond it by rounding, and the model refused.
#[test]
fn a_mass_at_the_end_of_a_segment_leaves_its_centre_of_mass_on_it() {
    let model = model();
    for n in 1..200 {
        let length = 0.08 + 1e-3 * f64::from(n) / 7.0;
        let change = |parts: &mut Parts| {
            (parts.segments[1].length, parts.segments[1].com) = (length, length);
            parts.segments[1].mass = 0.5 + 0.01 * f64::from(n);
        };
        let at_its_end = model.change(change).unwrap();
        let heavier = at_its_end.with_mass(1, 0.193, None).unwrap();
        assert_eq!(heavier.segments[1].com, length);
    }
}
