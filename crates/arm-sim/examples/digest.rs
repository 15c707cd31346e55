//! Prints the digest of the reference run, so that builds can be compared:
//! `cargo run --example digest`, with `--release`, and with `RUSTFLAGS="-C target-cpu=native"`.

use arm_sim::{Integrator, digest, models, simulate, simulate_batch};

fn main() -> Result<(), arm_sim::SimulationError> {
    let mut experiment = models::reference()?;
    println!("rk4   {:#018x}", digest(&simulate(&experiment)?)?);
    for lane in simulate_batch(&[experiment.clone(), experiment.clone()], 2) {
        println!("lane  {:#018x}", digest(&lane?)?);
    }
    experiment.integrator = Integrator::SemiImplicitEuler;
    println!("euler {:#018x}", digest(&simulate(&experiment)?)?);
    Ok(())
}
