//! `armrs.Arm`: the kernels of the core, each also over a batch.

use arm_core::{Chain, Invalid, Segment};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays::{Numbers, RowBatch, over_rows};
use crate::errors::{bad_input, invalid};
use crate::row_kernels::{self, MOST};

/// A chain whose length is known at run time.
#[derive(Clone, Debug)]
pub enum AnyChain {
    One(Chain<f64, 1>),
    Two(Chain<f64, 2>),
    Three(Chain<f64, 3>),
    Four(Chain<f64, 4>),
    Five(Chain<f64, 5>),
    Six(Chain<f64, 6>),
}

/// Runs the same expression on the chain of whatever length.
macro_rules! each_length {
    ($any:expr, $chain:ident => $body:expr) => {
        match $any {
            AnyChain::One($chain) => $body,
            AnyChain::Two($chain) => $body,
            AnyChain::Three($chain) => $body,
            AnyChain::Four($chain) => $body,
            AnyChain::Five($chain) => $body,
            AnyChain::Six($chain) => $body,
        }
    };
}

pub(crate) use each_length;

/// The same for what is large to compile and made for arms of shoulder, elbow and wrist: whatever simulates or identifies.
macro_rules! each_short_length {
    ($any:expr, $chain:ident => $body:expr) => {
        match $any {
            AnyChain::One($chain) => $body,
            AnyChain::Two($chain) => $body,
            AnyChain::Three($chain) => $body,
            AnyChain::Four(_) => Err(crate::arm::too_long(4)),
            AnyChain::Five(_) => Err(crate::arm::too_long(5)),
            AnyChain::Six(_) => Err(crate::arm::too_long(6)),
        }
    };
}

pub(crate) use each_short_length;

pub(crate) fn too_long(segments: usize) -> PyErr {
    bad_input(
        "[[arm.segment]]",
        segments,
        "1 to 3 segments; only kernels, passive moments and co-simulation take more",
    )
}

impl AnyChain {
    fn new(
        segments: &[Segment<f64>],
        base: [f64; 2],
        gravity: [f64; 2],
        rotor: &[f64],
    ) -> PyResult<Self> {
        fn build<const N: usize>(
            segments: &[Segment<f64>],
            base: [f64; 2],
            gravity: [f64; 2],
            rotor: &[f64],
        ) -> Result<Chain<f64, N>, Invalid> {
            Chain::new(std::array::from_fn(|i| segments[i]), base, gravity)?
                .with_rotor_inertia(std::array::from_fn(|i| rotor[i]))
        }
        match segments.len() {
            1 => build(segments, base, gravity, rotor).map(Self::One),
            2 => build(segments, base, gravity, rotor).map(Self::Two),
            3 => build(segments, base, gravity, rotor).map(Self::Three),
            4 => build(segments, base, gravity, rotor).map(Self::Four),
            5 => build(segments, base, gravity, rotor).map(Self::Five),
            6 => build(segments, base, gravity, rotor).map(Self::Six),
            n => return Err(bad_input("segments", n, &format!("1 to {MOST} segments"))),
        }
        .map_err(invalid)
    }
}

type Array<'py> = PyResult<Bound<'py, PyArrayDyn<f64>>>;

/// A planar arm: a rigid serial chain in a vertical plane.
///
/// Angles are relative, the first from +y (forward), counter-clockwise; z is up; SI units and radians. Every method
/// takes a single state, shape `(n_joints,)`, or a batch, shape `(n_samples, n_joints)`.
///
/// Parameters
/// ----------
/// lengths, masses, coms, inertias : array_like, shape (n_joints,)
///     Segment lengths [m], masses [kg], centres of mass from the proximal joint [m], moments of inertia about the
///     centre of mass [kg m²], proximal first.
/// com_normals : array_like, optional
///     Offset of the centres of mass normal to the segments, counter-clockwise [m]. Default 0.
/// gravity : float, default 9.81
///     Acceleration along −z [m/s²].
/// base : (float, float), default (0, 0)
///     First joint, y and z [m].
/// rotor_inertia : array_like, optional
///     Inertia of a drive's rotor as seen at each joint [kg m²]. Default 0.
#[pyclass(frozen, module = "armrs")]
pub struct Arm {
    pub chain: AnyChain,
}

impl Arm {
    /// The rigid arm of a model.
    pub fn of(model: &arm_model::Model) -> PyResult<Self> {
        let segments: Vec<_> = model
            .segments
            .iter()
            .map(arm_model::Segment::core)
            .collect();
        let still = vec![0.0; segments.len()];
        let chain = AnyChain::new(&segments, model.base, [0.0, -model.gravity], &still)?;
        Ok(Self { chain })
    }

    /// Reads three arguments that have a value for every joint.
    pub fn rows<'a>(
        &self,
        [(a, x), (b, y), (c, z)]: [(&'static str, &'a Numbers<'_>); 3],
    ) -> PyResult<[RowBatch<'a>; 3]> {
        let n = self.n_joints();
        Ok([
            RowBatch::new(a, x, n)?,
            RowBatch::new(b, y, n)?,
            RowBatch::new(c, z, n)?,
        ])
    }
}

#[pymethods]
impl Arm {
    #[new]
    #[pyo3(
        signature = (lengths, masses, coms, inertias, *, com_normals=None, gravity=None, base=None, rotor_inertia=None),
        text_signature = "(lengths, masses, coms, inertias, *, com_normals=None, gravity=9.81, base=(0.0, 0.0), rotor_inertia=None)"
    )]
    #[expect(
        clippy::too_many_arguments,
        reason = "keyword arguments of a Python constructor"
    )]
    fn new(
        lengths: Numbers<'_>,
        masses: Numbers<'_>,
        coms: Numbers<'_>,
        inertias: Numbers<'_>,
        com_normals: Option<Numbers<'_>>,
        gravity: Option<Numbers<'_>>,
        base: Option<Numbers<'_>>,
        rotor_inertia: Option<Numbers<'_>>,
    ) -> PyResult<Self> {
        let lengths = lengths.list("lengths")?;
        let n = lengths.len();
        let (masses, coms) = (masses.list("masses")?, coms.list("coms")?);
        let inertias = inertias.list("inertias")?;
        let or_zero = |name, given: Option<Numbers<'_>>| {
            given.map_or_else(|| Ok(vec![0.0; n]), |values| values.list(name))
        };
        let com_normals = or_zero("com_normals", com_normals)?;
        let rotor = or_zero("rotor_inertia", rotor_inertia)?;
        let gravity = gravity.map_or(Ok(9.81), |value| value.number("gravity"))?;
        let base = base.map_or_else(|| Ok(vec![0.0; 2]), |values| values.list("base"))?;
        if base.len() != 2 {
            return Err(bad_input(
                "base",
                format!("{} values", base.len()),
                "two numbers, y and z [m]",
            ));
        }
        let named = [
            ("masses", &masses),
            ("coms", &coms),
            ("inertias", &inertias),
            ("com_normals", &com_normals),
            ("rotor_inertia", &rotor),
        ];
        for (name, values) in named {
            if values.len() != n {
                return Err(bad_input(
                    name,
                    format!("{} values", values.len()),
                    &format!("{n}, as many as lengths"),
                ));
            }
        }
        let segments: Vec<_> = (0..n)
            .map(|i| Segment {
                length: lengths[i],
                mass: masses[i],
                com: [coms[i], com_normals[i]],
                inertia: inertias[i],
            })
            .collect();
        let chain = AnyChain::new(&segments, [base[0], base[1]], [0.0, -gravity], &rotor)?;
        Ok(Self { chain })
    }

    /// Return the rigid arm of a model: its segments, base and gravity, without any effect.
    ///
    /// Parameters
    /// ----------
    /// model : Model
    ///
    /// Returns
    /// -------
    /// Arm
    #[staticmethod]
    fn from_model(model: &Bound<'_, PyAny>) -> PyResult<Self> {
        let of = |m: &crate::model::Model| Self::of(m.inner());
        crate::model::one("model", model, of)?
    }

    /// What makes an equal arm, for `copy` and `pickle`.
    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        each_length!(&self.chain, c => {
            let of = |part: fn(&Segment<f64>) -> f64| -> Vec<f64> { c.segments().iter().map(part).collect() };
            let named = PyDict::new(py);
            named.set_item("com_normals", of(|s| s.com[1]))?;
            named.set_item("gravity", -c.gravity()[1])?;
            named.set_item("base", (c.base()[0], c.base()[1]))?;
            named.set_item("rotor_inertia", c.rotor_inertia().to_vec())?;
            let parts = [of(|s| s.length), of(|s| s.mass), of(|s| s.com[0]), of(|s| s.inertia)];
            Ok((PyTuple::new(py, parts)?, named))
        })
    }

    /// Number of joints.
    #[getter]
    pub fn n_joints(&self) -> usize {
        each_length!(&self.chain, c => c.segments().len())
    }

    /// First moments `X_j = m_j l_j + a_j Σ m_k` [kg m], what slow movement shows of the masses.
    #[getter]
    fn first_moments(&self) -> Vec<f64> {
        each_length!(&self.chain, c => c.first_moments().to_vec())
    }

    /// Second moments `J_j = I_j + m_j l_j² + a_j² Σ m_k` [kg m²].
    #[getter]
    fn second_moments(&self) -> Vec<f64> {
        each_length!(&self.chain, c => c.second_moments().to_vec())
    }

    fn __repr__(&self) -> String {
        each_length!(&self.chain, c => {
            let list = |f: fn(&Segment<f64>) -> f64| {
                c.segments().iter().map(|s| format!("{:.4}", f(s))).collect::<Vec<_>>().join(", ")
            };
            format!("Arm(lengths=[{}] m, masses=[{}] kg)", list(|s| s.length), list(|s| s.mass))
        })
    }

    /// Position of the tip, shape (2,) or (n_samples, 2) [m].
    fn forward_kinematics<'py>(&self, py: Python<'py>, q: Numbers<'py>) -> Array<'py> {
        let rows = [RowBatch::new("q", &q, self.n_joints())?];
        each_length!(&self.chain, c => over_rows(py, row_kernels::ForwardKinematics, c, rows))
    }

    /// Derivative of the tip position to the joint angles, shape (2, n_joints) or (n_samples, 2, n_joints) [m/rad].
    fn jacobian<'py>(&self, py: Python<'py>, q: Numbers<'py>) -> Array<'py> {
        let rows = [RowBatch::new("q", &q, self.n_joints())?];
        each_length!(&self.chain, c => over_rows(py, row_kernels::Jacobian, c, rows))
    }

    /// Inertia matrix B(q), shape (n_joints, n_joints), with the batch in front [kg m²].
    fn inertia<'py>(&self, py: Python<'py>, q: Numbers<'py>) -> Array<'py> {
        let rows = [RowBatch::new("q", &q, self.n_joints())?];
        each_length!(&self.chain, c => over_rows(py, row_kernels::Inertia, c, rows))
    }

    /// Coriolis and centrifugal torques C(q, q̇) q̇, shape of `q` [N m].
    fn coriolis<'py>(&self, py: Python<'py>, q: Numbers<'py>, qd: Numbers<'py>) -> Array<'py> {
        let n = self.n_joints();
        let rows = [RowBatch::new("q", &q, n)?, RowBatch::new("qd", &qd, n)?];
        each_length!(&self.chain, c => over_rows(py, row_kernels::Coriolis, c, rows))
    }

    /// Gravity torques G(q), shape of `q` [N m].
    fn gravity<'py>(&self, py: Python<'py>, q: Numbers<'py>) -> Array<'py> {
        let rows = [RowBatch::new("q", &q, self.n_joints())?];
        each_length!(&self.chain, c => over_rows(py, row_kernels::Gravity, c, rows))
    }

    /// Joint torques of a force on the arm at its tip, Jᵀ F, shape of `q` [N m].
    ///
    /// `force_on_arm` has shape (2,) or (n_samples, 2) [N].
    fn static_torque<'py>(
        &self,
        py: Python<'py>,
        q: Numbers<'py>,
        force_on_arm: Numbers<'py>,
    ) -> Array<'py> {
        let rows = [
            RowBatch::new("q", &q, self.n_joints())?,
            RowBatch::new("force_on_arm", &force_on_arm, 2)?,
        ];
        each_length!(&self.chain, c => over_rows(py, row_kernels::StaticTorque, c, rows))
    }

    /// Joint torques of a motion of the rigid arm, B q̈ + C q̇ + G, shape of `q` [N m].
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: Numbers<'py>,
        qd: Numbers<'py>,
        qdd: Numbers<'py>,
    ) -> Array<'py> {
        let rows = self.rows([("q", &q), ("qd", &qd), ("qdd", &qdd)])?;
        each_length!(&self.chain, c => over_rows(py, row_kernels::InverseDynamics, c, rows))
    }

    /// Joint accelerations under joint torques, the inverse of `inverse_dynamics`, shape of `q` [rad/s²].
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: Numbers<'py>,
        qd: Numbers<'py>,
        tau: Numbers<'py>,
    ) -> Array<'py> {
        let rows = self.rows([("q", &q), ("qd", &qd), ("tau", &tau)])?;
        each_length!(&self.chain, c => over_rows(py, row_kernels::ForwardDynamics, c, rows))
    }

    /// The regressor of the base parameters, shape (n_joints, 3·n_joints) with the batch in front.
    ///
    /// Columns: first moments X_1…X_n, normal moments H_1…H_n, second moments J_1…J_n. Its product with them is
    /// `inverse_dynamics` of an arm without rotor inertia.
    fn regressor<'py>(
        &self,
        py: Python<'py>,
        q: Numbers<'py>,
        qd: Numbers<'py>,
        qdd: Numbers<'py>,
    ) -> Array<'py> {
        let rows = self.rows([("q", &q), ("qd", &qd), ("qdd", &qdd)])?;
        each_length!(&self.chain, c => over_rows(py, row_kernels::Regressor, c, rows))
    }
}
