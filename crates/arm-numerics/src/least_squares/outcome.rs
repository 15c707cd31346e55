//! The outcome of a constrained solve.

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The optimum, to the tolerance of its [`Route`].
    Solved,
    /// The interior-point solver reached only its reduced tolerances (5e-5).
    AlmostSolved,
    /// No `x` satisfies all constraints. `x` is NaN.
    Infeasible,
    /// No usable solution. `x` is NaN.
    Failed(Reason),
}

impl Status {
    /// Stable name in results.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Solved => "solved",
            Self::AlmostSolved => "almost_solved",
            Self::Infeasible => "infeasible",
            Self::Failed(Reason::Iterations) => "iteration_limit",
            Self::Failed(Reason::Numerical) => "numerical_breakdown",
            Self::Failed(Reason::Progress) => "insufficient_progress",
            Self::Failed(Reason::Unbounded) => "unbounded",
            Self::Failed(Reason::Other) => "failed",
        }
    }
}

/// Why the interior-point solver gave up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// Iteration limit.
    Iterations,
    /// Breakdown of a factorisation.
    Numerical,
    /// Steps became too short.
    Progress,
    /// It took the objective for unbounded, which a sum of squares never is: the problem is badly scaled.
    Unbounded,
    /// Another ending.
    Other,
}

/// How a solution was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Route {
    /// Least squares under the equalities already satisfied everything else.
    Direct,
    /// Interior point, then least squares on the binding constraints; exact to rounding.
    Polished,
    /// Interior point only; binding constraints are met to about 1e-6 of the scale.
    Interior,
}

/// The result of [`crate::least_squares::program::Program::solve`].
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// How it ended. Read it before `x`.
    pub status: Status,
    /// How it was found.
    pub route: Route,
    /// The estimate, in the caller's units; NaN if there is none.
    pub x: Vec<f64>,
    /// Per parameter: −1 at its lower bound, +1 at its upper bound, 0 between. Where both coincide the sign is the side of the unconstrained minimum.
    pub active: Vec<i8>,
    /// Per linear inequality: whether it holds with equality.
    pub binding_inequalities: Vec<bool>,
    /// Per cone: whether it holds with equality.
    pub binding_cones: Vec<bool>,
    /// `‖R x − z‖²` (without the `ρ²` of a [`crate::Factor`]).
    pub objective: f64,
    /// `Rᵀ(R x − z)` in the caller's units: what a binding bound costs per unit, half the derivative of the objective.
    pub gradient: Vec<f64>,
    /// Numerical rank of `R S`. Below `p`, `x` is one of many (the nearest to 0 in `x̃` on the direct route).
    pub rank: usize,
    /// Condition number of `R S`.
    pub condition: f64,
    /// Iterations of the interior-point solver.
    pub iterations: u32,
}
