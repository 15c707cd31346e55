//! Fits by simulation.

use arm_core::Chain;
use arm_ident::inference::by_simulation::{self, Free, Recorded};
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arm::{AnyChain, each_short_length};
use crate::arrays::by_rows;
use crate::errors::{bad_input, identification};
use crate::results::RunFit;
use crate::rig::Rig;
use crate::simulation::{Driven, RunSettings, experiment};

/// What was recorded, C-contiguous, and the noise of its channels.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Records<'py> {
    /// Shape (n, n_joints) [rad].
    q: PyReadonlyArray2<'py, f64>,
    /// Shape (n, 2) [N].
    force_on_arm: PyReadonlyArray2<'py, f64>,
    /// [rad]
    angle_noise: f64,
    /// [N]
    force_noise: f64,
}

/// Fits parameters of effects by simulation; see `armrs.fit_by_simulation`.
#[pyfunction]
pub fn fit_by_simulation<'py>(
    py: Python<'py>,
    rig: &Rig,
    drive: Driven<'py>,
    settings: RunSettings,
    recorded: Records<'py>,
    free: Vec<(usize, usize, f64, f64)>,
) -> PyResult<RunFit> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (drive, settings, recorded): (&Driven<'py>, &RunSettings, &Records<'py>),
        free: &[Free],
    ) -> PyResult<RunFit> {
        if recorded.q.shape()[1] != N {
            let found = recorded.q.shape()[1];
            return Err(bad_input(
                "angles of each sample",
                found,
                &format!("{N}, one a joint"),
            ));
        }
        let experiment = experiment(chain, rig, drive, settings)?;
        let values = Recorded {
            q: &by_rows(&recorded.q),
            force_on_arm: &by_rows(&recorded.force_on_arm),
            angle_noise: [recorded.angle_noise; N],
            force_noise: [recorded.force_noise; 2],
        };
        let outcome = py.detach(|| by_simulation::fit(&experiment, &values, free, 1));
        crate::custom_effects::failed()?;
        Ok(RunFit(outcome.map_err(identification)?))
    }
    let free: Vec<Free> = free
        .into_iter()
        .map(|(effect, parameter, min, max)| Free {
            effect,
            parameter,
            min,
            max,
        })
        .collect();
    let given = (&drive, &settings, &recorded);
    each_short_length!(&rig.arm.chain, c => run(py, c, rig, given, &free))
}
