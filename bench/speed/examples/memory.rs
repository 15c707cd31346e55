//! Time and memory of one identification by the joint method: `cargo run --release -p speed --example memory -- 1000000`.
//!
//! With `auto` as second argument the cutoff is chosen from the data.

use arm_ident::inference::joint_method::identify;
use cpu_time::ProcessTime;
use speed::identification::joint;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let samples = arguments
        .next()
        .and_then(|n| n.parse().ok())
        .unwrap_or(1000);
    let (model, trials, mut options) = joint(samples);
    if arguments.next().as_deref() == Some("auto") {
        options.cutoff = None;
    }
    let before = peak();
    let start = ProcessTime::now();
    let found = identify(&model, &trials, &options).expect("a solution");
    println!(
        "{samples} samples: {:.3} s of processor time, {:.1} MB at most, {before:.1} MB of them before; cutoff {:.3} Hz",
        start.elapsed().as_secs_f64(),
        peak(),
        found.cutoff
    );
    for e in &found.parameters {
        println!(
            "{:>20} {:?} {:+.16e} ± {:.16e}",
            e.name, e.joint, e.value, e.std
        );
    }
}

/// Largest memory of this process so far \[MB\], where the system states it.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok())
        .map_or(f64::NAN, |kilobytes| kilobytes * 1024.0 / 1e6)
}
