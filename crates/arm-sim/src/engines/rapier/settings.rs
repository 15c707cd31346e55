//! Settings of the solver.

/// How rapier solves for the forces in the joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RapierSettings {
    /// Gauss-Seidel sweeps over all joints in each step, 30 unless set.
    pub sweeps: usize,
}

impl Default for RapierSettings {
    fn default() -> Self {
        Self { sweeps: 30 }
    }
}
