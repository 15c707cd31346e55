//! The Rust side of `bench/peers`: a workload's name comes in on a line, a line of JSON goes out.
//!
//! The argument is the folder that `bench/peers/problem.py` has written.

use arm_core::{
    Chain, Joints, Lanes, Load, Plane, Pose, Products, Scalar, accelerations, forward_dynamics,
    inverse_dynamics,
};
use arm_core::{Segment, sample_arms as arms};
use arm_ident::cascade::quasi_static::{Cascade, Stream};
use arm_ident::regression::trial::Model;
use arm_sim::{
    Columns, Experiment, Integrator, Start, sample_experiments, simulate, simulate_accurately,
    simulate_batch,
};
use cpu_time::ProcessTime;
use std::hint::black_box;
use std::io::{BufRead, Write};
use std::path::Path;
use std::sync::OnceLock;
use std::time::Instant;

/// Prior means of the masses in the cascade, relative to the truth, and their standard deviation: as in `problem.py`.
const MASS_ERROR: [f64; 3] = [1.08, 0.92, 1.08];
const KNOWN_WITHIN: f64 = 0.3;
/// The accuracy of a batch is that of every fiftieth run.
const EVERY: usize = 50;
/// A belief so weak that the data alone decide, within the same bounds.
const WEAK: f64 = 1e3;

fn main() {
    let folder = std::env::args().nth(1).expect("the folder of the problem");
    let peer = Peer::new(Path::new(&folder));
    for line in std::io::stdin().lock().lines() {
        let line = line.expect("a line");
        println!("{}", peer.answer(line.trim()));
        std::io::stdout().flush().expect("an open output");
    }
}

/// Repeats a call for about a tenth of a second and gives the processor time of one, after one that does not count.
fn seconds_of<R>(call: impl FnMut() -> R) -> String {
    timed(cpu_seconds(call))
}

fn cpu_seconds<R>(call: impl FnMut() -> R) -> f64 {
    repeated(call, ProcessTime::now, |start| {
        start.elapsed().as_secs_f64()
    })
}

/// As [`seconds_of`] by the clock on the wall, for what runs on several cores.
fn wall_seconds_of<R>(call: impl FnMut() -> R) -> String {
    timed(repeated(call, Instant::now, |start| {
        start.elapsed().as_secs_f64()
    }))
}

/// How often a call is made where its instructions are counted instead of its time.
static EXACTLY: OnceLock<u32> = OnceLock::new();

fn repeated<R, C>(mut call: impl FnMut() -> R, now: fn() -> C, since: fn(&C) -> f64) -> f64 {
    if let Some(&times) = EXACTLY.get() {
        for _ in 0..times {
            black_box(call());
        }
        return 0.0;
    }
    black_box(call());
    let start = now();
    // Reading the clock costs as much as some kernels: once for many calls where they are short.
    let (mut calls, mut between) = (0, 1);
    loop {
        for _ in 0..between {
            black_box(call());
        }
        calls += between;
        let passed = since(&start);
        if passed >= 0.1 {
            return passed / f64::from(calls);
        }
        if passed < 0.01 {
            between *= 2;
        }
    }
}

fn numbers(folder: &Path, name: &str) -> Vec<f64> {
    let bytes = std::fs::read(folder.join(name)).expect("a file that problem.py has written");
    let number = |b: &[u8]| f64::from_ne_bytes(b.try_into().expect("eight bytes"));
    bytes.chunks_exact(8).map(number).collect()
}

fn json(values: &[f64]) -> String {
    let list: Vec<String> = values.iter().map(|v| format!("{v:?}")).collect();
    format!("[{}]", list.join(","))
}

fn joints_json(rows: impl IntoIterator<Item = Joints<f64, 3>>) -> String {
    json(
        &rows
            .into_iter()
            .flat_map(|row| [row[0], row[1], row[2]])
            .collect::<Vec<_>>(),
    )
}

fn timed(seconds: f64) -> String {
    format!("{{\"seconds\": {seconds:e}}}")
}

struct Peer {
    folder: std::path::PathBuf,
    arm: Chain<f64, 3>,
    /// Its moments, which a loop computes once.
    products: Products<f64, 3>,
    /// Angles, speeds, and accelerations or torques.
    states: Vec<[Joints<f64, 3>; 3]>,
}

impl Peer {
    fn new(folder: &Path) -> Self {
        let values = numbers(folder, "states.f64");
        let count = values.len() / 9;
        let state = |i: usize| {
            [0, 1, 2].map(|part| Joints::from_column_slice(&values[3 * (part * count + i)..][..3]))
        };
        Self {
            folder: folder.to_owned(),
            arm: arms::human_arm(),
            products: Products::of(&arms::human_arm()),
            states: (0..count).map(state).collect(),
        }
    }

    fn answer(&self, task: &str) -> String {
        let euler = Integrator::SemiImplicitEuler;
        match task.split(':').collect::<Vec<_>>()[..] {
            ["exactly", times] => EXACTLY
                .set(times.parse().expect("a number of calls"))
                .is_ok()
                .to_string(),
            ["check", "inverse_dynamics"] => {
                joints_json(self.states.iter().map(|s| self.inverse(s)))
            }
            ["check", "forward_dynamics"] => {
                joints_json(self.states.iter().map(|s| self.forward(s)))
            }
            ["inverse_dynamics"] => self.kernel(|s| self.inverse(s)),
            ["forward_dynamics"] => self.kernel(|s| self.forward(s)),
            ["inverse_dynamics", "lanes"] => {
                let arm = self.arm.cast();
                self.lanes(|[q, qd, qdd]| inverse_dynamics(&arm, &Pose::new(q), qd, qdd))
            }
            ["forward_dynamics", "lanes"] => {
                let products = Products::of(&self.arm.cast());
                self.lanes(|[q, qd, torque]| {
                    accelerations(&products, &Pose::new(q), qd, &load(*torque))
                })
            }
            ["forward_dynamics", "joints", n] => match n {
                "1" => joints::<1>(),
                "2" => joints::<2>(),
                "3" => joints::<3>(),
                "4" => joints::<4>(),
                "5" => joints::<5>(),
                "6" => joints::<6>(),
                _ => "null".into(),
            },
            ["check", "run"] => recorded(&run(euler, 20.0, Some(0.02))),
            ["check", "run", "fourth"] => recorded(&run(Integrator::Rk4, 20.0, Some(0.02))),
            ["run"] => self.run(euler, Some(0.02)),
            ["run", "ends"] => self.run(euler, Some(20.0)),
            ["run", "fourth"] => self.run(Integrator::Rk4, Some(0.02)),
            ["run", "all"] => {
                let mut experiment = run(euler, 20.0, Some(0.02));
                experiment.columns = Columns::All;
                seconds_of(|| simulate(black_box(&experiment)).expect("runs"))
            }
            ["check", "cascade", n] => {
                let (q, force) = self.samples(n);
                let found = cascade(&q, &force);
                format!(
                    "{{\"x\": {}, \"first_moments\": {}, \"rms\": {}}}",
                    json(&found.x),
                    json(&found.first_moments),
                    json(&found.residual_rms)
                )
            }
            ["cascade", n] => {
                let (q, force) = self.samples(n);
                seconds_of(|| cascade(black_box(&q), black_box(&force)))
            }
            ref words => batches(words).unwrap_or_else(|| right_to_an_accuracy(words)),
        }
    }

    fn inverse(&self, [q, qd, qdd]: &[Joints<f64, 3>; 3]) -> Joints<f64, 3> {
        inverse_dynamics(&self.arm, &Pose::new(q), qd, qdd)
    }

    fn forward(&self, [q, qd, torque]: &[Joints<f64, 3>; 3]) -> Joints<f64, 3> {
        accelerations(&self.products, &Pose::new(q), qd, &load(*torque))
    }

    fn kernel<R>(&self, call: impl Fn(&[Joints<f64, 3>; 3]) -> R) -> String {
        let all = cpu_seconds(|| {
            for state in &self.states {
                black_box(call(black_box(state)));
            }
        });
        timed(all / self.states.len() as f64)
    }

    /// Several states side by side; the time of one state.
    fn lanes<R>(&self, call: impl Fn(&[Joints<Lanes<8>, 3>; 3]) -> R) -> String {
        let side_by_side = |group: &[[Joints<f64, 3>; 3]]| {
            [0, 1, 2].map(|part| {
                Joints::from_fn(|j, _| Lanes(core::array::from_fn(|l| group[l][part][j])))
            })
        };
        let groups: Vec<_> = self.states.chunks_exact(8).map(side_by_side).collect();
        let all = cpu_seconds(|| {
            for group in &groups {
                black_box(call(black_box(group)));
            }
        });
        timed(all / (8 * groups.len()) as f64)
    }

    fn run(&self, integrator: Integrator, interval: Option<f64>) -> String {
        let experiment = from_its_equilibrium(run(integrator, 20.0, interval));
        seconds_of(|| simulate(black_box(&experiment)).expect("runs"))
    }

    fn samples(&self, n: &str) -> (Vec<Joints<f64, 3>>, Vec<Plane<f64>>) {
        let values = numbers(&self.folder, &format!("slow{n}.f64"));
        let split = |row: &[f64]| (Joints::from_column_slice(&row[..3]), [row[3], row[4]]);
        values.chunks_exact(5).map(split).unzip()
    }
}

/// Forward dynamics of an arm of any length, a call.
fn joints<const N: usize>() -> String {
    let segment = Segment {
        length: 0.25,
        mass: 1.0,
        com: [0.12, 0.0],
        inertia: 0.005,
    };
    let arm = Chain::<f64, N>::new([segment; N], [0.0; 2], [0.0, -9.81]).expect("a valid arm");
    let q = Joints::from_fn(|j, _| 0.3 + 0.1 * j as f64);
    let torque = load(Joints::repeat(1.0));
    seconds_of(|| {
        let q = black_box(&q);
        forward_dynamics(&arm, &Pose::new(q), q, &torque)
    })
}

fn load<T: Scalar, const N: usize>(torque: Joints<T, N>) -> Load<T, N> {
    Load {
        torque,
        ..Load::none()
    }
}

fn run(integrator: Integrator, duration: f64, interval: Option<f64>) -> Experiment<3> {
    let mut experiment =
        sample_experiments::human_experiment(duration, [0.0; 3]).expect("a sample experiment");
    experiment.integrator = integrator;
    experiment.output_interval = interval;
    experiment.columns = Columns::Motion;
    experiment
}

/// An experiment from the angles of its equilibrium, found before: as other tools start.
fn from_its_equilibrium(mut experiment: Experiment<3>) -> Experiment<3> {
    let mut short = experiment.clone();
    (short.duration, short.output_interval) = (0.02, Some(0.02));
    let found = simulate(&short).expect("runs").q;
    experiment.start = Start::Given {
        q: Joints::from_column_slice(&found[..3]),
        qd: Joints::zeros(),
    };
    experiment
}

/// W3; nothing for another task.
fn batches(task: &[&str]) -> Option<String> {
    Some(match *task {
        ["check", "batch"] => {
            let done = simulate_batch(&batch(), 1);
            let ends = done[done.len() - 4..].iter().flat_map(|r| {
                let q = &r.as_ref().expect("runs").q;
                q[q.len() - 3..].to_vec()
            });
            json(&ends.collect::<Vec<_>>())
        }
        ["check", "bits"] => bits().to_string(),
        ["batch"] => {
            let runs = batch();
            seconds_of(|| simulate_batch(black_box(&runs), 1))
        }
        ["batch", "all"] => {
            let runs = batch_of(Columns::All);
            seconds_of(|| simulate_batch(black_box(&runs), 1))
        }
        ["batch", "runs", n] => {
            let runs = &batch()[..n.parse().expect("a number of runs")];
            seconds_of(|| simulate_batch(black_box(runs), 1))
        }
        ["batch", "wall", threads] => {
            let (runs, threads) = (batch(), threads.parse().expect("threads"));
            wall_seconds_of(|| simulate_batch(black_box(&runs), threads))
        }
        _ => return None,
    })
}

/// W2a and W3a.
fn right_to_an_accuracy(task: &[&str]) -> String {
    let single = |substeps| {
        let whole = run(Integrator::SemiImplicitEuler, 20.0, Some(0.02));
        accurate(&from_its_equilibrium(whole), substeps)
    };
    let all = |substeps| -> Vec<_> { batch().iter().map(|run| accurate(run, substeps)).collect() };
    match *task {
        ["accurate", substeps] => {
            let experiment = single(substeps);
            seconds_of(|| simulate(black_box(&experiment)).expect("runs"))
        }
        ["check", "accurate", substeps] => recorded(&single(substeps)),
        ["accurate", "found", accuracy] => {
            let (runs, accuracy) = ([single("1")], number(accuracy));
            seconds_of(|| simulate_accurately(black_box(&runs), accuracy, 1))
        }
        ["check", "accurate", "found", accuracy] => {
            let mut found = simulate_accurately(&[single("1")], number(accuracy), 1);
            json(&found.remove(0).expect("runs").0.q)
        }
        ["batch", "accurate", "found", accuracy] => {
            let (runs, accuracy) = (all("1"), number(accuracy));
            seconds_of(|| simulate_accurately(black_box(&runs), accuracy, 1))
        }
        ["check", "batch", "accurate", "found", accuracy] => {
            let done = simulate_accurately(&all("1"), number(accuracy), 1);
            let some = done.iter().step_by(EVERY);
            let angles = some.flat_map(|run| run.as_ref().expect("runs").0.q.clone());
            json(&angles.collect::<Vec<_>>())
        }
        ["batch", "accurate", substeps] => {
            let runs = all(substeps);
            seconds_of(|| simulate_batch(black_box(&runs), 1))
        }
        ["check", "batch", "accurate", substeps] => {
            let done = simulate_batch(&all(substeps), 1);
            let some = done.iter().step_by(EVERY);
            let angles = some.flat_map(|run| run.as_ref().expect("runs").q.clone());
            json(&angles.collect::<Vec<_>>())
        }
        _ => "null".into(),
    }
}

fn number(text: &str) -> f64 {
    text.parse().expect("a number")
}

/// The experiment as it is run where its angles have to be right to an accuracy: in so many steps of fourth order from one sample to the next.
fn accurate(experiment: &Experiment<3>, substeps: &str) -> Experiment<3> {
    let mut experiment = experiment.clone();
    experiment.integrator = Integrator::Rk4;
    experiment.dt = 0.02 / number(substeps);
    experiment
}

fn recorded(experiment: &Experiment<3>) -> String {
    json(&simulate(experiment).expect("runs").q)
}

/// The runs as other tools make them: from given angles, with angles and speeds recorded.
fn batch() -> Vec<Experiment<3>> {
    let runs = batch_of(Columns::Motion).into_iter();
    runs.map(from_its_equilibrium).collect()
}

/// The runs, from equilibria that are found in them.
fn batch_of(columns: Columns) -> Vec<Experiment<3>> {
    let mut base = run(Integrator::SemiImplicitEuler, 2.0, Some(0.02));
    base.columns = columns;
    let scaled = |i: u32| {
        let scale = 1.0 + 1e-4 * f64::from(i);
        let mut run = base.clone();
        for segment in &mut run.setup.segments {
            segment.mass *= scale;
        }
        for effect in &mut run.effects {
            effect.parameters[0] *= scale;
        }
        run
    };
    (0..1000).map(scaled).collect()
}

/// Whether runs of a batch, on one thread and on two, have the bits of single runs.
fn bits() -> bool {
    let runs = &batch()[..24];
    let [one, two] = [1, 2].map(|threads| simulate_batch(runs, threads));
    runs.iter().zip(one.iter().zip(&two)).all(|(run, (a, b))| {
        let [alone, a, b] =
            [&simulate(run), a, b].map(|r| arm_sim::digest(r.as_ref().expect("runs")));
        alone == a && a == b
    })
}

fn cascade(q: &[Joints<f64, 3>], force: &[Plane<f64>]) -> Cascade<3> {
    let arm = arms::human_arm();
    let segments: [Segment<f64>; 3] = core::array::from_fn(|k| Segment {
        mass: arm.segments()[k].mass * MASS_ERROR[k],
        ..arm.segments()[k]
    });
    let model = Model {
        chain: Chain::new(segments, arm.base(), arm.gravity()).expect("a valid arm"),
        segment_uncertainty: WEAK,
        fitted: Vec::new(),
        held: Vec::new(),
        contact: arm_core::Contact::new([1e4; 2], [0.0; 2]),
    };
    let mut stream = Stream::new(&model.chain);
    stream.push(q, force).expect("finite samples");
    let condensed = stream.finish().expect("finite samples");
    condensed
        .solve(&model, KNOWN_WITHIN / WEAK)
        .expect("a solution")
}
