//! Descriptions of data sets: what is accepted, what is refused and in which words, and that writing loses nothing.

use arm_model::{Description, ForceOn, Role, Sex, Side, Tolerance};

const DATASET: &str = r#"name = "S1"
model = "model.toml"
force_on = "robot"
sample_rate = 50.0

[subject]
body_mass = 77.0
height = 1.8
sex = "male"
side = "left"

[tolerance]
force_bias_N = 0.4

[[added]]
segment = 2
mass = 0.2
at = 0.1
configurations = ["slow"]

[[trial]]
file = "trials/slow_1.csv"
configuration = "slow"
repeat = 1
role = "fit"

[[trial]]
file = "trials/slow_2.csv"
configuration = "slow"
repeat = 2
role = "test"
"#;

#[test]
fn every_key_is_read_and_written() {
    let data = Description::from_toml(DATASET).unwrap();
    assert_eq!(
        (data.name.as_deref(), data.force_on),
        (Some("S1"), Some(ForceOn::Robot))
    );
    assert_eq!(
        (data.subject.height, data.subject.sex, data.subject.side),
        (Some(1.8), Some(Sex::Male), Some(Side::Left))
    );
    let expected = Tolerance {
        force_bias: 0.4,
        ..Tolerance::default()
    };
    assert_eq!(data.tolerance, expected);
    assert!((data.tolerance.angle_offset() - 0.3 * std::f64::consts::PI / 180.0).abs() < 1e-18);
    assert_eq!(data.added[0].configurations, ["slow"]);
    assert_eq!(
        (data.trials[1].repeat, data.trials[1].role),
        (2, Role::Test)
    );
    let text = data.to_toml();
    assert_eq!(Description::from_toml(&text).unwrap(), data);
    let json = serde_json::to_string(&data).unwrap();
    assert_eq!(serde_json::from_str::<Description>(&json).unwrap(), data);
    assert!(text.starts_with("name = \"S1\"\nmodel = \"model.toml\"\nforce_on = \"robot\"\nsample_rate = 50.0\n\n[subject]\n"));
}

#[test]
fn a_whole_subject_takes_the_place_of_a_model() {
    let subject = DATASET.replace("model = \"model.toml\"\n", "").replace(
        "sex = \"male\"",
        "sex = \"male\"\nlengths_m = [0.322, 0.345]",
    );
    let data = Description::from_toml(&subject).unwrap();
    assert_eq!(
        (data.model.as_deref(), data.subject.lengths.len()),
        (None, 2)
    );
    assert_eq!(Description::from_toml(&data.to_toml()).unwrap(), data);
    let refused =
        Description::from_toml(&DATASET.replace("model = \"model.toml\"\n", "")).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "model: found nothing, allowed the file of the model, or a [subject] with body_mass, height, sex and lengths_m \
         (lengths_m is missing in [subject])"
    );
    let long = subject.replace("0.345", "345.0");
    let refused = Description::from_toml(&long).unwrap_err().to_string();
    assert!(
        refused.starts_with("[subject], lengths_m, 2: found 345"),
        "{refused}"
    );
}

const BROKEN: &[(&str, &str, &str)] = &[
    (
        "force_on",
        "forces_on",
        ": found unknown key 'forces_on', allowed added, force_on, model, muscle, name, sample_rate, subject, synthetic, tolerance, trial (nearest known: force_on)",
    ),
    (
        "repeat = 1",
        "repetition = 1",
        "[[trial]] 1: found unknown key 'repetition', allowed configuration, file, repeat, role (nearest known: repeat)",
    ),
    (
        "height",
        "hight",
        "[subject]: found unknown key 'hight', allowed body_mass, height, lengths_m, name, sex, side (nearest known: height)",
    ),
    (
        "force_bias_N",
        "force_bias",
        "[tolerance]: found unknown key 'force_bias', allowed angle_offset_deg, force_bias_N, force_gain, handle_placement_m, time_delay_s (nearest known: force_bias_N)",
    ),
    (
        "model = \"model.toml\"\n",
        "",
        "model: found nothing, allowed the file of the model, or a [subject] with body_mass, height, sex and lengths_m (lengths_m is missing in [subject])",
    ),
    (
        "\"robot\"",
        "\"handle\"",
        "force_on: found 'handle', allowed \"robot\" or \"arm\"",
    ),
    (
        "\"test\"",
        "\"train\"",
        "[[trial]] 2, role: found 'train', allowed \"fit\" or \"test\"",
    ),
    (
        "role = \"fit\"",
        "role = \"test\"",
        "[[trial]]: found no trial with role = \"fit\", allowed at least one",
    ),
    (
        "repeat = 2",
        "repeat = 1",
        "[[trial]] 2, repeat: found repeat 1 of \"slow\", allowed each repeat once: [[trial]] 1 has it already",
    ),
    (
        "slow_2.csv",
        "./slow_1.csv",
        "[[trial]] 2, file: found 'trials/./slow_1.csv', allowed each file once: [[trial]] 1 has it already",
    ),
    (
        "slow_2.csv",
        "../trials/slow_1.csv",
        "[[trial]] 2, file: found 'trials/../trials/slow_1.csv', allowed each file once: [[trial]] 1 has it already",
    ),
    (
        "repeat = 2",
        "repeat = 0",
        "[[trial]] 2, repeat: found 0, allowed a whole number >= 1",
    ),
    (
        "height = 1.8",
        "height = 180",
        "[subject], height: found 180.0, allowed a finite number 0.3 to 3 m (centimetres?)",
    ),
    (
        "\"male\"",
        "\"m\"",
        "[subject], sex: found 'm', allowed \"male\" or \"female\"",
    ),
    (
        "\"left\"",
        "\"links\"",
        "[subject], side: found 'links', allowed \"left\" or \"right\"",
    ),
    (
        "= 0.4",
        "= -0.4",
        "[tolerance], force_bias_N: found -0.4, allowed a finite number 0 to 10000",
    ),
    (
        "= 50.0",
        "= 0",
        "sample_rate: found 0.0, allowed a finite number > 0 and <= 1e+06 Hz",
    ),
    (
        "\"trials/slow_1.csv\"",
        "\"\"",
        "[[trial]] 1, file: found '', allowed a text on one line",
    ),
    (
        "[\"slow\"]",
        "[\"fast\"]",
        "[[added]] 1, configurations: found unknown configuration 'fast', allowed slow",
    ),
    (
        "[\"slow\"]",
        "[1]",
        "[[added]] 1, configurations: found [1], allowed a list of names",
    ),
    (
        "mass = 0.2",
        "mass = 0",
        "[[added]] 1, mass: found 0.0, allowed a finite number > 0 and <= 20 kg",
    ),
    (
        "sample_rate = 50.0",
        "synthetic = 1",
        "synthetic: found 1, allowed true or false",
    ),
];

#[test]
fn what_is_broken_is_named_on_one_line() {
    for (old, new, expected) in BROKEN {
        assert_eq!(DATASET.matches(old).count(), 1, "{old}");
        let refused = Description::from_toml(&DATASET.replace(old, new)).expect_err(expected);
        assert_eq!(refused.to_string(), *expected);
    }
    let text = DATASET.split("[[trial]]").next().unwrap();
    let refused = Description::from_toml(text).unwrap_err().to_string();
    assert_eq!(
        refused,
        "trial: found nothing, allowed key trial is required"
    );
}
