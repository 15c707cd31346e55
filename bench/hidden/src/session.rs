//! A session: who, which movements, what is hidden, and what is read.

use crate::cast::{OUTSIDE, Scene, Strength, cast, cast_outside, family, kinds};
use crate::effect::Hidden;
use crate::little_known::{self, Slip};
use crate::model::Setting;
use crate::motion::{Lead, Movement, Pace, Profile, RATE, STEPS};
use crate::random::Random;
use crate::rig::{Plane, Rig};
use crate::run::{Conditions, Grip, KEPT, Truth, run};
use crate::sensor::{Calibration, Noise, Readings, read, tolerance};

/// What kind of session it is.
#[derive(Clone, Debug, PartialEq)]
pub enum Case {
    /// Nothing is hidden; what is not ideal.
    Null(Imperfect),
    /// One effect of the catalogue.
    Single(&'static str, Strength),
    /// Several strong effects of different families.
    Several(usize),
    /// One effect that no catalogue has.
    Outside(&'static str),
    /// A rigid model of an arm with passive joints and so many further effects.
    LittleKnown(usize, Strength),
}

impl Case {
    /// As its family is called in files.
    pub fn family(&self) -> &'static str {
        match self {
            Self::Null(_) => "null",
            Self::Single(..) => "single",
            Self::Several(2) => "double",
            Self::Several(_) => "triple",
            Self::Outside(_) => "outside",
            Self::LittleKnown(..) => "little_known",
        }
    }
}

/// What is not ideal where nothing is hidden, besides white noise and calibration errors within their tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Imperfect {
    /// Nothing.
    White,
    /// Noise with a correlation of 0.9 from sample to sample.
    Coloured,
    /// Noise with a correlation of 0.98.
    Drifting,
    /// The handle is held elsewhere in every trial.
    Placement,
    /// Segments off within their uncertainty.
    Segments,
    /// All of these.
    All,
}

/// All of them.
pub const IMPERFECT: [Imperfect; 6] = [
    Imperfect::White,
    Imperfect::Coloured,
    Imperfect::Drifting,
    Imperfect::Placement,
    Imperfect::Segments,
    Imperfect::All,
];

impl Imperfect {
    /// As it is called in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::White => "white",
            Self::Coloured => "ar0.9",
            Self::Drifting => "ar0.98",
            Self::Placement => "placement",
            Self::Segments => "segments",
            Self::All => "all",
        }
    }
}

/// The case with a number in a family; numbers that follow each other go round all kinds.
///
/// # Errors
/// A family that does not exist.
pub fn case(name: &str, strength: Option<Strength>, number: usize) -> Result<Case, String> {
    let count = kinds().len();
    let single = |number: usize| {
        let kind = kinds().nth(number % count).unwrap_or("coulomb");
        let turn = [Strength::Strong, Strength::Medium][(number / count) % 2];
        Case::Single(kind, strength.unwrap_or(turn))
    };
    let outside = |number: usize| Case::Outside(OUTSIDE[number % OUTSIDE.len()]);
    let null = |number: usize| Case::Null(IMPERFECT[number % IMPERFECT.len()]);
    Ok(match name {
        "null" => null(number),
        "single" => single(number),
        "double" => Case::Several(2),
        "triple" => Case::Several(3),
        "outside" => outside(number),
        // None, one and two further effects in turn.
        "little_known" => Case::LittleKnown(number % 3, strength.unwrap_or(Strength::Strong)),
        "all" => {
            // Of ten, three nulls, four single effects, two combinations, one from outside.
            let (round, place) = (number / 10, number % 10);
            match place {
                0..=2 => null(3 * round + place),
                3..=6 => single(4 * round + place - 3),
                7 => Case::Several(2),
                8 => Case::Several(3),
                _ => outside(round),
            }
        }
        _ => {
            return Err(format!(
                "--family: found {name}; allowed: null, single, double, triple, outside, little_known, all"
            ));
        }
    })
}

/// A trial of a session.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Name of its movement.
    pub configuration: String,
    /// From 1.
    pub repeat: usize,
    /// Whether it is for checking alone.
    pub test: bool,
    /// How the handle is held.
    pub grip: Grip,
    /// What slips in it.
    pub slip: Option<Slip>,
    /// Part of the movement that was recorded.
    pub recorded: f64,
    /// What was read.
    pub readings: Readings,
}

/// A session, and the truth of it.
#[derive(Clone, Debug)]
pub struct Session {
    /// All of it follows from this number.
    pub seed: u64,
    /// What kind it is.
    pub case: Case,
    /// The rig and what the model says of it.
    pub setting: Setting,
    /// What is hidden.
    pub hidden: Vec<Hidden>,
    /// Of the sensors.
    pub noise: Noise,
    /// What the calibration left.
    pub calibration: Calibration,
    /// Whether files hold the force on the robot.
    pub force_on_robot: bool,
    /// Damping of dry friction where it sticks \[N m s/rad\].
    pub friction_grip: f64,
    /// All trials, those to fit first.
    pub trials: Vec<Trial>,
}

/// Streams of random numbers of one seed.
mod stream {
    pub const SETTING: u64 = 1;
    pub const MOVEMENTS: u64 = 2;
    pub const SENSORS: u64 = 3;
    pub const EFFECTS: u64 = 1000;
    pub const TRIALS: u64 = 100_000;
}

/// Draws of effects after which a session is given up.
const ATTEMPTS: u64 = 20;

impl Session {
    /// Makes a session.
    ///
    /// # Errors
    /// In words, when no effect could be drawn under which the arm stays where the robot leads it.
    pub fn new(seed: u64, case: Case) -> Result<Self, String> {
        let null = match case {
            Case::Null(null) => Some(null),
            _ => None,
        };
        let unknown = matches!(case, Case::LittleKnown(..));
        let mut random = Random::new(seed, stream::SETTING);
        let off = match null {
            None | Some(Imperfect::Segments | Imperfect::All) => 1.0,
            Some(_) => 0.0,
        };
        let setting = if unknown {
            little_known::setting(&mut random)?
        } else {
            Setting::draw(&mut random, off)?
        };
        let friction_grip = random.pick(&[1e6, 20.0]);
        let plan = Plan::draw(&setting, seed, unknown)?;
        let mut random = Random::new(seed, stream::SENSORS);
        let mut noise = noise(null, &mut random);
        let calibration = Calibration::draw(setting.model.size(), &mut random);
        let misplaced = match null {
            None => random.chance(0.5) || unknown,
            Some(null) => matches!(null, Imperfect::Placement | Imperfect::All),
        };
        let in_hand = random.chance(0.5);
        let force_on_robot = random.chance(0.5);
        let mut trials: Vec<Trial> = plan
            .trials
            .iter()
            .map(|(movement, repeat, test)| Trial {
                configuration: plan.movements[*movement].name.clone(),
                repeat: *repeat,
                test: *test,
                grip: if misplaced {
                    misplacement(in_hand, &mut random)
                } else {
                    Grip::NOMINAL
                },
                slip: None,
                recorded: 1.0,
                readings: Readings::default(),
            })
            .collect();
        if unknown {
            noise.resample(random.pick(&little_known::RATES));
            plan.mishaps(&mut trials, setting.model.size(), &mut random);
        }
        let mut session = Self {
            seed,
            case,
            setting,
            hidden: Vec::new(),
            noise,
            calibration,
            force_on_robot,
            friction_grip,
            trials,
        };
        session.hide(&plan)?;
        Ok(session)
    }

    /// Draws effects until the arm bears them, and runs all trials.
    fn hide(&mut self, plan: &Plan) -> Result<(), String> {
        if let Case::Null(_) = self.case {
            let truths = self.run_all(plan, &[])?;
            return self.sense(&truths);
        }
        let mut reason = String::new();
        for attempt in 0..ATTEMPTS {
            let mut random = Random::new(self.seed, stream::EFFECTS + attempt);
            let hidden = self.draw(&plan.scene(&self.setting.truth), &mut random)?;
            match self.run_all(plan, &hidden) {
                Ok(truths) => {
                    self.hidden = hidden;
                    return self.sense(&truths);
                }
                Err(why) => reason = why,
            }
        }
        Err(format!("seed {}: {reason}", self.seed))
    }

    fn draw(&self, scene: &Scene, random: &mut Random) -> Result<Vec<Hidden>, String> {
        match &self.case {
            Case::Null(_) => Ok(Vec::new()),
            Case::Single(kind, strength) => Ok(vec![cast(kind, *strength, scene, random)?]),
            Case::Outside(kind) => Ok(vec![cast_outside(kind, scene, random)?]),
            Case::LittleKnown(count, strength) => {
                let mut hidden = little_known::friction(self.setting.model.size(), random);
                hidden.extend(little_known::further(*count, *strength, scene, random)?);
                Ok(hidden)
            }
            Case::Several(count) => {
                let mut names: Vec<&str> = kinds().collect();
                random.shuffle(&mut names);
                let (mut hidden, mut taken): (Vec<Hidden>, Vec<u8>) = (Vec::new(), Vec::new());
                for name in names {
                    let own = family(name).unwrap_or(u8::MAX);
                    if hidden.len() < *count && !taken.contains(&own) {
                        taken.push(own);
                        hidden.push(cast(name, Strength::Strong, scene, random)?);
                    }
                }
                Ok(hidden)
            }
        }
    }

    fn run_all(&self, plan: &Plan, hidden: &[Hidden]) -> Result<Vec<Truth>, String> {
        let mut rig = self.setting.truth.clone();
        for effect in hidden {
            effect.alter(&mut rig);
        }
        if rig.links.iter().any(|l| l.mass <= 0.0 || l.inertia <= 0.0) {
            return Err("a segment without mass".to_owned());
        }
        let trials = plan.trials.iter().enumerate();
        trials
            .map(|(k, (movement, ..))| {
                let mut random = Random::new(self.seed, stream::TRIALS + k as u64);
                let movement = &plan.movements[*movement];
                let lead = lead(movement, &self.setting, &mut random)?;
                let conditions = Conditions {
                    trial: k,
                    grip: &self.trials[k].grip,
                    near: &movement.from,
                    friction_grip: self.friction_grip,
                    kept: self.kept(),
                };
                run(&rig, hidden, &lead, &conditions, &mut random)
            })
            .collect()
    }

    /// Steps from one record to the next: half as many where samples are not a whole number of the usual records apart.
    fn kept(&self) -> usize {
        let steps = libm::round(STEPS / self.noise.rate) as usize;
        if steps.is_multiple_of(KEPT) {
            KEPT
        } else {
            KEPT / 2
        }
    }

    fn sense(&mut self, truths: &[Truth]) -> Result<(), String> {
        let mut random = Random::new(self.seed, stream::TRIALS - 1);
        // Trials are not measured in the order of the file: a drift over the session is none over the configurations.
        let mut order: Vec<usize> = (0..truths.len()).collect();
        random.shuffle(&mut order);
        let part = 1.0 / truths.len() as f64;
        for (k, truth) in truths.iter().enumerate() {
            let place = order[k] as f64 * part;
            let elapsed = [place, place + part];
            let (hidden, noise) = (&self.hidden, &self.noise);
            let trial = &mut self.trials[k];
            trial.readings = read(
                truth,
                hidden,
                &self.calibration,
                noise,
                (elapsed, trial.slip),
                &mut random,
            );
            trial.readings.keep(trial.recorded);
        }
        Ok(())
    }
}

fn lead(movement: &Movement, setting: &Setting, random: &mut Random) -> Result<Lead, String> {
    Lead::along(movement, &setting.model, &setting.servo, random)
        .ok_or_else(|| "the robot does not reach".to_owned())
}

/// The hand holds the handle about half a millimetre beside where it should.
fn misplacement(in_hand: bool, random: &mut Random) -> Grip {
    let sd = 0.5e-3 / core::f64::consts::SQRT_2;
    let limit = tolerance::PLACEMENT / sd / core::f64::consts::SQRT_2;
    let beside: Plane = [
        sd * random.limited_normal(limit),
        sd * random.limited_normal(limit),
    ];
    if in_hand {
        Grip {
            in_hand: beside,
            ..Grip::NOMINAL
        }
    } else {
        Grip {
            in_room: beside,
            ..Grip::NOMINAL
        }
    }
}

fn noise(null: Option<Imperfect>, random: &mut Random) -> Noise {
    let memory = match null {
        None => random.pick(&[0.0, 0.0, 0.9, 0.98]),
        Some(Imperfect::Coloured) => 0.9,
        Some(Imperfect::Drifting) => 0.98,
        Some(Imperfect::All) => random.pick(&[0.9, 0.98]),
        Some(_) => 0.0,
    };
    // Slow noise is not averaged away: sensors that have it are the better ones.
    let finest = if memory > 0.95 { 0.5 } else { 1.0 };
    Noise {
        angle: finest * random.within(0.02, 0.15).to_radians(),
        force: finest * random.within(0.05, 0.3),
        memory,
        rate: RATE,
        quantum: random.pick(&[[0.0, 0.0], [0.0, 0.0], [0.054, 1e-4]]),
        encoder: random.within(1e-6, 4e-6),
    }
}

/// Movements and trials of a session.
struct Plan {
    movements: Vec<Movement>,
    /// Movement, repeat, and whether for checking alone.
    trials: Vec<(usize, usize, bool)>,
    /// Of each joint over the movements to fit, nothing hidden.
    range: Vec<[f64; 2]>,
    speed: Vec<f64>,
}

impl Plan {
    /// Draws movements until the robot reaches along all of them and the arm follows.
    fn draw(setting: &Setting, seed: u64, unknown: bool) -> Result<Self, String> {
        let mut random = Random::new(seed, stream::MOVEMENTS);
        let mut reason = String::new();
        for attempt in 0..40 {
            // Smaller and smaller, so that there is an end to it.
            let size = 1.0 - 0.015 * f64::from(attempt);
            let mut movements = movements(&setting.posture, size, &mut random);
            let mut repeats = [2, 3];
            if unknown {
                movements = little_known::choose(movements, &mut random);
                repeats = [2, 5];
            }
            match Self::survey(setting, movements, repeats, &mut random) {
                Ok(plan) => return Ok(plan),
                Err(why) => reason = why,
            }
        }
        Err(format!("seed {seed}: {reason}"))
    }

    fn survey(
        setting: &Setting,
        movements: Vec<Movement>,
        repeats: [usize; 2],
        random: &mut Random,
    ) -> Result<Self, String> {
        let for_checking = movements.len() - 1;
        let joints = setting.model.size();
        let (mut range, mut speed) = (vec![[f64::MAX, f64::MIN]; joints], vec![0.0_f64; joints]);
        for (m, movement) in movements.iter().enumerate() {
            let lead = lead(movement, setting, random)?;
            let conditions = Conditions {
                trial: 0,
                grip: &Grip::NOMINAL,
                near: &movement.from,
                friction_grip: 0.0,
                kept: KEPT,
            };
            let truth = run(&setting.truth, &[], &lead, &conditions, random)?;
            inside(&truth, &setting.truth)?;
            if m == for_checking {
                continue;
            }
            let interval = KEPT as f64 / STEPS;
            for j in 0..joints {
                for pair in truth.q.windows(2) {
                    let q = pair[1][j];
                    range[j] = [range[j][0].min(q), range[j][1].max(q)];
                    speed[j] = speed[j].max((q - pair[0][j]).abs() / interval);
                }
            }
        }
        let mut trials = Vec::new();
        let repeats = match repeats {
            [2, 3] => 2 + usize::from(random.chance(0.4)),
            [least, most] => least + random.below(most + 1 - least),
        };
        let mut fitted: Vec<usize> = (0..movements.len())
            .filter(|m| *m != for_checking)
            .collect();
        for &m in &fitted {
            trials.extend((1..=repeats).map(|repeat| (m, repeat, false)));
        }
        // Two further repeats of movements to fit, and the movement that is never fitted.
        random.shuffle(&mut fitted);
        let further = fitted.iter().take(2);
        trials.extend(further.map(|m| (*m, repeats + 1, true)));
        trials.extend([(for_checking, 1, true), (for_checking, 2, true)]);
        Ok(Self {
            movements,
            trials,
            range,
            speed,
        })
    }

    /// A third of the trials ends early, and in one trial to fit something slips.
    fn mishaps(&self, trials: &mut [Trial], joints: usize, random: &mut Random) {
        for trial in trials.iter_mut() {
            if random.chance(1.0 / 3.0) {
                trial.recorded = random.within(0.7, 1.0);
            }
        }
        let fitted: Vec<usize> = (0..trials.len()).filter(|k| !trials[*k].test).collect();
        let k = random.pick(&fitted);
        let duration = trials[k].recorded * self.movements[self.trials[k].0].duration;
        let slip = little_known::slip(joints, duration, random);
        if let Slip::Handle(start, by) = slip {
            trials[k].grip.slip = Some((start, by));
        }
        trials[k].slip = Some(slip);
    }

    fn scene<'a>(&self, rig: &'a Rig) -> Scene<'a> {
        let fitted = self.trials.iter().enumerate().filter(|(_, t)| !t.2);
        Scene {
            rig,
            range: self.range.clone(),
            speed: self.speed.clone(),
            trials: fitted
                .map(|(k, (m, ..))| (k, self.movements[*m].duration))
                .collect(),
        }
    }
}

/// Whether the joints stay where an arm's joints can be.
fn inside(truth: &Truth, rig: &Rig) -> Result<(), String> {
    let limits: &[[f64; 2]] = &[[-100.0, 60.0], [3.0, 145.0], [-75.0, 75.0]];
    for q in &truth.q {
        for j in 0..rig.size() {
            let [low, high] = limits[j].map(f64::to_radians);
            if !(low..=high).contains(&q[j]) {
                return Err(format!("joint {} at {:.0} °", j + 1, q[j].to_degrees()));
            }
        }
    }
    Ok(())
}

/// The movements of a session, the last of them for checking alone.
fn movements(posture: &[f64], size: f64, random: &mut Random) -> Vec<Movement> {
    let mut away = |parts: &[(f64, f64)], sizes: [f64; 2]| -> Vec<Vec<f64>> {
        let wrist = random.within(-12.0, 12.0).to_radians();
        parts
            .iter()
            .map(|(shoulder, elbow)| {
                let all = [shoulder * sizes[0], elbow * sizes[1], elbow * wrist];
                all[..posture.len()].iter().map(|q| size * q).collect()
            })
            .collect()
    };
    let degrees = |low: f64, high: f64| (low.to_radians(), high.to_radians());
    let (small, large) = (degrees(14.0, 22.0), degrees(28.0, 38.0));
    let elbow_only = [(0.0, 1.0), (0.0, -0.4), (0.0, 0.0)];
    let shoulder_only = [(1.0, 0.0), (-0.3, 0.0), (0.0, 0.0)];
    let round = [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)];
    let slanted = [(0.9, -0.5), (0.2, 1.0), (-0.3, 0.3), (0.0, 0.0)];
    let slow_elbow = away(&elbow_only, [0.0, large.0]);
    let slow_shoulder = away(&shoulder_only, [small.1, 0.0]);
    let both = away(&round, [large.0, large.1]);
    let fast = away(&slanted, [small.1, large.0]);
    let elsewhere = away(&round, [small.0, large.0]);
    let creep = away(&[(1.0, -1.0), (0.0, 0.0)], [0.2, 0.22]);

    let smooth = random.pick(&[Profile::LeastJerk, Profile::Trapezoid]);
    let pause = random.pick(&[0.0, 0.15, 0.3]);
    let mut pace = |low: f64, high: f64, profile: Profile| Pace {
        speed: random.within(low, high),
        pause,
        profile,
        duration: random.within(8.0, 11.0),
    };
    let slow = pace(0.2, 0.3, smooth);
    let slow_too = pace(0.2, 0.3, smooth);
    let brisk = pace(0.5, 0.8, smooth);
    // With sharp ramps: what depends on the rate of forces shows in them alone.
    let quick = pace(1.0, 1.5, Profile::Trapezoid);
    let medium = pace(0.4, 0.6, smooth);
    let crawl = pace(0.04, 0.06, Profile::Trapezoid);

    let shift = [random.within(28.0, 42.0), random.within(-18.0, 12.0), 0.0];
    let second: Vec<f64> = posture
        .iter()
        .zip(shift)
        .map(|(q, shift)| q + size * f64::to_radians(shift))
        .collect();
    let waves: Vec<f64> = [14.0, 18.0, 4.0][..posture.len()]
        .iter()
        .map(|a| size * f64::to_radians(*a))
        .collect();
    let between: Vec<f64> = posture
        .iter()
        .zip([0.25, 0.15, 0.0])
        .map(|(q, shift)| q + size * shift)
        .collect();
    vec![
        Movement::legs("slow-elbow", posture, &slow_elbow, &slow),
        Movement::legs("slow-shoulder", posture, &slow_shoulder, &slow_too),
        Movement::legs("both-large", posture, &both, &brisk),
        Movement::legs("fast", posture, &fast, &quick),
        Movement::legs("second-posture", &second, &elsewhere, &medium),
        Movement::legs("creep", posture, &creep, &crawl),
        Movement::waves("mixed", &between, &waves, 10.0, random),
    ]
}
