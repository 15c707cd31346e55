//! A session as files: `data/` for the workflow, and `truth.json` beside it.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::{Map, Value, json};

use crate::little_known::{self, Slip};
use crate::rig::{Passive, Rig};
use crate::sensor::tolerance;
use crate::session::{Case, Session, Trial};

/// Writes a session below a folder.
///
/// # Errors
/// What the system said, with the path.
pub fn write(session: &Session, folder: &Path) -> Result<(), String> {
    let data = folder.join("data");
    let make =
        |path: &Path| fs::create_dir_all(path).map_err(|e| format!("{}: {e}", path.display()));
    let save = |path: &Path, text: &str| {
        fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
    };
    make(&data.join("trials"))?;
    for trial in &session.trials {
        save(&data.join(file(trial)), &table(session, trial))?;
    }
    save(&data.join("model.toml"), &model(session))?;
    save(&data.join("dataset.toml"), &dataset(session))?;
    save(
        &folder.join("truth.json"),
        &format!("{:#}\n", truth(session)),
    )
}

fn file(trial: &Trial) -> String {
    format!("trials/{}_{}.csv", trial.configuration, trial.repeat)
}

fn table(session: &Session, trial: &Trial) -> String {
    let joints = session.setting.model.size();
    let sign = if session.force_on_robot { -1.0 } else { 1.0 };
    let mut text = "t_s".to_owned();
    for j in 1..=joints {
        let _ = write!(text, ",q{j}_rad");
    }
    text.push_str(",Fy_N,Fz_N,qr1_rad,qr2_rad\n");
    let readings = &trial.readings;
    // Whole hundredths of a second at the usual rate, thousandths at others.
    let decimals = if session.noise.rate == crate::motion::RATE {
        2
    } else {
        3
    };
    for (k, time) in readings.time.iter().enumerate() {
        let _ = write!(text, "{time:.decimals$}");
        for q in &readings.q[k] {
            let _ = write!(text, ",{q:.6}");
        }
        for force in readings.force_on_arm[k] {
            let _ = write!(text, ",{:.4}", sign * force);
        }
        for q in readings.robot[k] {
            let _ = write!(text, ",{q:.7}");
        }
        text.push('\n');
    }
    text
}

fn dataset(session: &Session) -> String {
    let on = if session.force_on_robot {
        "robot"
    } else {
        "arm"
    };
    let mut text = format!(
        "name = \"session {}\"\nmodel = \"model.toml\"\nforce_on = \"{on}\"\nsample_rate = {:?}\nsynthetic = true\n",
        session.seed, session.noise.rate
    );
    if let Some(person) = &session.setting.person {
        let _ = write!(
            text,
            "\n[subject]\nbody_mass = {:?}\nheight = {:?}\nsex = \"{}\"\n",
            person.body_mass, person.height, person.sex
        );
    }
    let _ = write!(
        text,
        "\n[tolerance]\nangle_offset_deg = {:?}\nforce_bias_N = {:?}\nforce_gain = {:?}\ntime_delay_s = {:?}\nhandle_placement_m = {:?}\n",
        tolerance::ANGLE_OFFSET,
        tolerance::FORCE_BIAS,
        tolerance::FORCE_GAIN,
        tolerance::TIME_DELAY,
        tolerance::PLACEMENT,
    );
    for trial in &session.trials {
        let role = if trial.test { "test" } else { "fit" };
        let _ = write!(
            text,
            "\n[[trial]]\nfile = \"{}\"\nconfiguration = \"{}\"\nrepeat = {}\nrole = \"{role}\"\n",
            file(trial),
            trial.configuration,
            trial.repeat
        );
    }
    text
}

/// The model with its nine significant digits.
fn model(session: &Session) -> String {
    let (rig, names) = (&session.setting.model, ["shoulder", "elbow", "wrist"]);
    let number = |x: f64| format!("{x:.8e}");
    let mut text = format!(
        "[arm]\ngravity = {:?}\nbase = [{:?}, {:?}]\nsegment_uncertainty = {:?}\n",
        -rig.gravity[1], rig.base[0], rig.base[1], session.setting.uncertainty
    );
    let parts = if session.setting.person.is_some() {
        ["upper arm", "forearm", "hand"]
    } else {
        ["upper link", "lower link", "handle"]
    };
    for (link, name) in rig.links.iter().zip(parts) {
        let _ = write!(
            text,
            "\n[[arm.segment]]\nname = \"{name}\"\nlength = {}\nmass = {}\ncom = {}\ninertia = {}\n",
            number(link.length),
            number(link.mass),
            number(link.com),
            number(link.inertia)
        );
    }
    for (joint, name) in rig.joints.iter().zip(names) {
        let _ = write!(text, "\n[[arm.joint]]\nname = \"{name}\"\n");
        if *joint == Passive::NONE {
            continue;
        }
        let _ = write!(
            text,
            "stiffness = {}\nrest = {}\nviscosity = {}\ncoulomb = 0.0\n",
            number(joint.stiffness),
            number(joint.rest),
            number(joint.viscosity)
        );
    }
    let [a, b] = rig.robot.lengths;
    let [y, z] = rig.robot.base.map(number);
    let _ = write!(
        text,
        "\n[robot]\nlengths = [{a:?}, {b:?}]\nbase = [{y}, {z}]\nelbow = \"up\"\n"
    );
    let ([sy, sz], [dy, dz]) = (rig.contact.stiffness, rig.contact.damping);
    let _ = write!(
        text,
        "\n[contact]\nstiffness = [{sy:?}, {sz:?}]\ndamping = [{dy:?}, {dz:?}]\n"
    );
    text
}

/// Everything that the workflow is not told. Effects come with joints and channels as the data set counts them.
pub fn truth(session: &Session) -> Value {
    let laws = match session.case {
        Case::LittleKnown(..) => little_known::laws(&session.setting),
        _ => Vec::new(),
    };
    let effects: Vec<Value> = laws
        .iter()
        .chain(&session.hidden)
        .map(|effect| {
            let mut parameters = Map::new();
            for scored in &effect.scored {
                let entry = json!({"value": scored.value, "exact": scored.exact});
                parameters.insert(scored.name.to_owned(), entry);
            }
            json!({
                "kind": effect.kind,
                "joint": effect.joint.map(|j| j + 1),
                "channel": effect.channel.map(|c| ["Fy", "Fz"][c]),
                "trial": effect.trial.map(|k| file(&session.trials[k])),
                "parameters": parameters,
                "law": format!("{:?}", effect.law),
            })
        })
        .collect();
    let (strength, imperfect) = match &session.case {
        Case::Null(null) => (None, Some(null.name())),
        Case::Single(_, strength) => (Some(strength.name()), None),
        Case::Several(_) => (Some("strong"), None),
        Case::Outside(_) => (None, None),
        Case::LittleKnown(_, strength) => (Some(strength.name()), None),
    };
    let calibration = &session.calibration;
    let placed: Vec<Value> = session
        .trials
        .iter()
        .map(|trial| {
            json!({"file": file(trial), "in_hand_m": trial.grip.in_hand, "in_room_m": trial.grip.in_room})
        })
        .collect();
    json!({
        "seed": session.seed,
        "family": session.case.family(),
        "strength": strength,
        "null": imperfect,
        "joints": session.setting.model.size(),
        "effects": effects,
        "noise": {
            "angle_rad": session.noise.angle,
            "force_N": session.noise.force,
            "memory": session.noise.memory,
            "rate_Hz": session.noise.rate,
            "quantum_N_rad": session.noise.quantum,
            "encoder_rad": session.noise.encoder,
        },
        "calibration": {
            "angle_offset_rad": calibration.angle_offset,
            "force_bias_on_arm_N": calibration.force_bias,
            "force_gain": calibration.force_gain,
            "time_delay_s": calibration.delay,
        },
        "friction": if session.friction_grip > 1e3 { "sticks" } else { "creeps" },
        "placement": placed,
        "slip": slipped(session),
        "segments": segments(&session.setting.truth),
    })
}

/// What slipped in which trial.
fn slipped(session: &Session) -> Option<Value> {
    session.trials.iter().find_map(|trial| {
        Some(match trial.slip? {
            Slip::Handle(start, by) => {
                json!({"trial": file(trial), "what": "handle", "start_s": start, "by_m": by})
            }
            Slip::Angle(start, joint, by) => {
                json!({"trial": file(trial), "what": "angle", "joint": joint + 1, "start_s": start, "by_rad": by})
            }
        })
    })
}

/// True segments without the hidden effects.
fn segments(rig: &Rig) -> Vec<Value> {
    let links = rig.links.iter();
    links
        .map(|l| json!({"length": l.length, "mass": l.mass, "com": l.com, "inertia": l.inertia}))
        .collect()
}
