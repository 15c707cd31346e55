"""A model as C source for firmware: what `armrs export-c` writes."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _armrs, checks
from ..catalogue import catalogue
from ..errors import BadInput, Text
from ..io import files, jsonfile
from ..model import Effect, Model, load_model

if TYPE_CHECKING:
    from .._armrs import _Firmware

_POSTURES = 12
"""Test vectors."""
_SINGLE_TOLERANCE = 1e-5
"""Of the largest torque of a test vector, in single precision."""


@dataclass(frozen=True)
class FirmwareSource:
    """C source of a model.

    Attributes
    ----------
    header, source : str
        Text of `armrs_model.h` and `armrs_model.c`.
    vectors : ndarray, shape (n, 3 n_joints + 3)
        Motions of the self-test: angles, speeds, accelerations, then force and moment on the arm at its tip [rad, s, N, N m].
    torques : ndarray, shape (n, n_joints)
        What the joints need for them [N m].
    hash : str
        SHA-256 of the model's file.
    """

    header: str
    source: str
    vectors: np.ndarray
    torques: np.ndarray
    hash: str

    def write(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write both files below a folder."""
        folder = checks.path("folder", folder)
        folder.mkdir(parents=True, exist_ok=True)
        written = []
        for name, text in (("armrs_model.h", self.header), ("armrs_model.c", self.source)):
            files.write_text(folder / name, text, kind=Path(name).suffix)
            written.append(folder / name)
        return written


def export_c(
    model: Model | str | os.PathLike[str],
    *,
    precision: str = "double",
    identified: str | os.PathLike[str] | None = None,
) -> FirmwareSource:
    """Return the C source with which firmware makes the arm of a model.

    Parameters
    ----------
    model : Model or path
        Two or three segments. Effects of the arm become part of it, constant errors of the sensors become the calibration.
    precision : {"double", "single"}
        Of the library that the firmware links.
    identified : path, optional
        `identified.json` of the model, for standard deviations and correlations. Without it standard deviations of the segments follow
        from `segment_uncertainty`, and effects count as exact.

    Returns
    -------
    FirmwareSource

    Raises
    ------
    BadInput
        For an effect that a device cannot apply (play, a compliant contact, a drift …), and more segments or effects than fit.

    Examples
    --------
    >>> from armrs import load_model
    >>> export_c("model.toml", precision="single").write("firmware")  # doctest: +SKIP
    """
    checks.choice("precision", precision, ("double", "single"))
    loaded = checks.loaded("model", model, Model, load_model)
    digest = hashlib.sha256(loaded.to_toml().encode()).hexdigest()
    vectors = _vectors(loaded.n_joints)
    core = _armrs.firmware(_armrs.Rig(loaded), loaded.segment_uncertainty, vectors.tolist())
    effects = [e for e, acts_on in zip(loaded.all_effects, core["acts_on"], strict=True) if acts_on != "sensors"]
    covariance = _covariance(loaded, core, identified)
    parts = _Parts(loaded, precision, digest, core, effects, covariance, vectors)
    return FirmwareSource(parts.header(), parts.source(), vectors, np.array(core["torques"]), digest)


def _vectors(joints: int) -> np.ndarray:
    """Return motions that are spread evenly (Weyl sequence), the first three at rest."""
    number = np.arange(1, _POSTURES + 1)[:, None]
    spread = np.modf(number * np.sqrt([2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37][: 3 * joints + 3]))[0] * 2 - 1
    scale = np.repeat([1.2, 2.0, 5.0], joints).tolist()
    vectors = spread * np.array([*scale, 10.0, 10.0, 1.0])
    vectors[:3, joints:] = 0.0
    # Exact in single precision, so that both precisions get the same motions.
    return vectors.astype(np.float32).astype(np.float64)


def covariance_of(model: Model, identified: str | os.PathLike[str] | None = None) -> np.ndarray:
    """Return the covariance of the unknowns that `export_c` writes, shape (n_unknowns, n_unknowns)."""
    return _covariance(model, _core_firmware(model), identified)


def unknowns_of(model: Model) -> list[tuple[str, int, str]]:
    """Return name, joint and unit of the unknowns of a device in their order: first and second moments, then parameters of effects."""
    joints = range(1, model.n_joints + 1)
    base = [(f"X{j}", j, "kg m") for j in joints] + [(f"J{j}", j, "kg m^2") for j in joints]
    return base + [(f"{e.kind} {p.name}", e.joint or 1, p.unit) for e, p in _linear(model, _core_firmware(model))]


def _core_firmware(model: Model) -> _Firmware:
    return _armrs.firmware(_armrs.Rig(model), model.segment_uncertainty, [])


def _linear(model: Model, core: _Firmware) -> list[tuple[Effect, Any]]:
    """Return the effects that stay in the joints with each of their linear parameters."""
    acting = [e for e, acts_on in zip(model.all_effects, core["acts_on"], strict=True) if acts_on == "joints"]
    return [(e, p) for e in acting for p in catalogue()[e.kind].parameters if p.linear]


def _covariance(model: Model, core: _Firmware, path: str | os.PathLike[str] | None) -> np.ndarray:
    """Return the covariance of the unknowns: the base parameters, then the linear parameters of the effects."""
    base = 2 * model.n_joints
    linear = _linear(model, core)
    if path is None:
        return np.diag(np.square([*core["sd"][:base], *(0.0 for _ in linear)]))
    result = _result(checks.path("identified", path))
    combinations = result["combinations"]
    if len(combinations) != base:
        raise BadInput("combinations", Text(f"{len(combinations)} of them"), f"{base} for {model.n_joints} segments", file=Path(path))
    known = {(e["kind"], e["joint"], e["name"]): e["std"] for e in result["parameters"]}
    sd = np.array([e["std"] for e in combinations] + [known.get((e.kind, e.joint, p.name), 0.0) for e, p in linear])
    names = [e["name"] for e in combinations] + [f"{e.kind}{e.joint} {p.name}" for e, p in linear]
    return np.outer(sd, sd) * _correlations(result, names)


def _correlations(result: dict[str, Any], names: list[str]) -> np.ndarray:
    """Return the correlations between quantities; those that were not identified together have none."""
    places = {name: place for place, name in enumerate(result.get("correlated", []))}
    between = np.eye(len(names))
    for i, k in np.ndindex(between.shape):
        if i != k and names[i] in places and names[k] in places:
            between[i, k] = result["correlations"][places[names[i]]][places[names[k]]]
    return between


def _result(path: Path) -> dict[str, Any]:
    result = jsonfile.read(path, "the JSON of armrs identify")
    if isinstance(result, dict) and {"combinations", "parameters"} <= result.keys():
        return result
    raise BadInput("--identified", Text("no result"), "the JSON of armrs identify", file=path)


def _number(value: float) -> str:
    """Return a number with all its bits."""
    return f"R({float(value).hex()})"


def _row(values: Any) -> str:
    return "{" + ", ".join(_number(v) for v in values) + "}"


def _rows(rows: Any) -> str:
    return "{\n" + "".join(f"    {_row(row)},\n" for row in rows) + "}"


class _Parts:
    """The pieces of both files."""

    def __init__(
        self,
        model: Model,
        precision: str,
        digest: str,
        core: _Firmware,
        effects: list[Effect],
        covariance: np.ndarray,
        vectors: np.ndarray,
    ) -> None:
        self.model, self.precision, self.digest, self.core = model, precision, digest, core
        self.effects, self.covariance, self.vectors = effects, covariance, vectors

    def _guards(self) -> str:
        wrong = "ifndef" if self.precision == "single" else "ifdef"
        say = "with -DARMRS_SINGLE" if self.precision == "single" else "without ARMRS_SINGLE"
        return (
            f'#{wrong} ARMRS_SINGLE\n#error "this model is for {self.precision} precision: compile {say}"\n#endif\n'
            f"#if ARMRS_JOINTS != {self.model.n_joints}\n"
            f'#error "this model has {self.model.n_joints} joints: ARMRS_TWO_JOINTS is for two"\n#endif\n'
        )

    def header(self) -> str:
        """Return `armrs_model.h`."""
        return f"""/* The arm of a model for firmware, written by armrs export-c {_armrs.__version__}; do not edit. */
#ifndef ARMRS_MODEL_H
#define ARMRS_MODEL_H

#include "armrs.h"

{self._guards()}
/* SHA-256 of the model. */
#define ARMRS_MODEL_HASH "{self.digest}"
/* Relative standard deviation of masses, centres of mass and inertias, for armrs_estimator_init. */
#define ARMRS_MODEL_UNCERTAINTY ((armrs_real){self.model.segment_uncertainty!r})
/* How late the forces are behind the angles [s]: delay the angles by it, or take it into account. */
#define ARMRS_MODEL_FORCE_DELAY ((armrs_real){self.core["force_delay"]!r})
/* Motions of the self-test. */
#define ARMRS_MODEL_VECTORS {len(self.vectors)}

#ifdef __cplusplus
extern "C" {{
#endif

/* Makes the arm with its effects. */
ARMRS_MUST_USE armrs_status armrs_model_arm(armrs_arm *arm, armrs_problem *problem);

/* Makes what carries it, with the covariance of its unknowns. */
ARMRS_MUST_USE armrs_status armrs_model_compensation(armrs_compensation *compensation, const armrs_arm *arm, armrs_problem *problem);

/* Takes the errors of the sensors out of readings: angles [rad], force [N] and moment [N m] on the arm. */
void armrs_model_calibrate(armrs_real q[ARMRS_JOINTS], armrs_real force_on_arm[2], armrs_real *moment_on_arm);

/* A motion of the self-test with its load, and the torques that the computer found for it. */
void armrs_model_vector(size_t index, armrs_motion *motion, armrs_load *load, armrs_real torque[ARMRS_JOINTS]);

/* Computes the torques of all motions. ARMRS_CORRUPT where one differs: by a bit in double precision, in single by more than
   {_SINGLE_TOLERANCE:g} of the motion's largest. For the start of the device. */
ARMRS_MUST_USE armrs_status armrs_model_self_test(const armrs_arm *arm);

#ifdef __cplusplus
}}
#endif
#endif
"""

    def source(self) -> str:
        """Return `armrs_model.c`."""
        return "\n".join(
            [
                "/* See armrs_model.h. */",
                '#include "armrs_model.h"\n\n#define R(x) ((armrs_real)(x))\n',
                self._arm(),
                self._compensation(),
                self._calibrate(),
                self._self_test(),
            ]
        )

    def _arm(self) -> str:
        segments = "".join(
            f"    {{{_number(s.length)}, {_number(s.mass)}, {{{_number(s.com)}, {_number(s.com_normal)}}}, {_number(s.inertia)}}},\n"
            for s in self.model.segments
        )
        known = catalogue()
        effects = "".join(f'    {{"{e.kind}", {(e.joint or 1) - 1}, {_row(self._six(e, known[e.kind]))}}},\n' for e in self.effects)
        count = len(self.effects)
        return f"""typedef struct {{
  const char *kind;
  uint32_t joint;
  armrs_real parameters[6];
}} part;

static const armrs_segment segments[ARMRS_JOINTS] = {{
{segments}}};
#define EFFECTS {count}
static const part parts[EFFECTS + 1] = {{
{effects}    {{0, 0, {{0}}}},
}};

armrs_status armrs_model_arm(armrs_arm *arm, armrs_problem *problem) {{
  static const armrs_real base[2] = {_row(self.model.base)}, gravity[2] = {_row([0.0, -self.model.gravity])};
  armrs_effect effects[EFFECTS + 1];
  for (size_t i = 0; i < EFFECTS; i++) {{
    armrs_status status = armrs_effect_named(parts[i].kind, parts[i].joint, &effects[i]);
    if (status != ARMRS_OK) return status;
    for (size_t k = 0; k < 6; k++) effects[i].parameters[k] = parts[i].parameters[k];
  }}
  return armrs_arm_init(arm, segments, base, gravity, effects, EFFECTS, problem);
}}
"""

    @staticmethod
    def _six(effect: Effect, kind: Any) -> list[float]:
        given = [effect.parameters.get(p.name, p.default) for p in kind.parameters]
        return [*given, *[0.0] * (6 - len(given))]

    def _compensation(self) -> str:
        padded = [*self.core["values"], *[0.0] * (18 - len(self.core["values"]))]
        unknowns = len(self.covariance)
        # Of a symmetric matrix what is below and on the diagonal.
        lower = [self.covariance[i, k] for i in range(unknowns) for k in range(i + 1)]
        return f"""armrs_status armrs_model_compensation(armrs_compensation *compensation, const armrs_arm *arm, armrs_problem *problem) {{
  static const armrs_real values[ARMRS_UNKNOWNS] = {_row(padded)};
  /* Of the unknowns in use, by rows up to the diagonal. */
  static const armrs_real lower[{len(lower)}] = {_row(lower)};
  armrs_real covariance[ARMRS_UNKNOWNS * ARMRS_UNKNOWNS];
  const armrs_real *next = lower;
  for (size_t i = 0; i < ARMRS_UNKNOWNS * ARMRS_UNKNOWNS; i++) covariance[i] = 0;
  for (size_t i = 0; i < {unknowns}; i++) {{
    for (size_t k = 0; k <= i; k++) covariance[i * ARMRS_UNKNOWNS + k] = *next++;
  }}
  return armrs_compensation_init(compensation, arm, values, covariance, problem);
}}
"""

    def _calibrate(self) -> str:
        back = np.linalg.inv(np.array(self.core["force"]))
        return f"""void armrs_model_calibrate(armrs_real q[ARMRS_JOINTS], armrs_real force_on_arm[2], armrs_real *moment_on_arm) {{
  static const armrs_real angle[ARMRS_JOINTS] = {_row(self.core["angle_offset"])};
  static const armrs_real offset[3] = {_row(self.core["force_offset"])};
  static const armrs_real back[3][3] = {_rows(back)};
  const armrs_real read[3] = {{force_on_arm[0] - offset[0], force_on_arm[1] - offset[1], *moment_on_arm - offset[2]}};
  armrs_real found[3];
  for (size_t j = 0; j < ARMRS_JOINTS; j++) q[j] -= angle[j];
  for (size_t i = 0; i < 3; i++) found[i] = back[i][0] * read[0] + back[i][1] * read[1] + back[i][2] * read[2];
  force_on_arm[0] = found[0];
  force_on_arm[1] = found[1];
  *moment_on_arm = found[2];
}}
"""

    def _self_test(self) -> str:
        columns = 3 * self.model.n_joints + 3
        close = f"difference <= R({_SINGLE_TOLERANCE!r}) * largest" if self.precision == "single" else "difference == 0"
        return f"""static const armrs_real vectors[ARMRS_MODEL_VECTORS][{columns}] = {_rows(self.vectors)};
static const armrs_real torques[ARMRS_MODEL_VECTORS][ARMRS_JOINTS] = {_rows(self.core["torques"])};

void armrs_model_vector(size_t index, armrs_motion *motion, armrs_load *load, armrs_real torque[ARMRS_JOINTS]) {{
  const armrs_real *from = vectors[index < ARMRS_MODEL_VECTORS ? index : 0];
  motion->time = 0;
  for (size_t j = 0; j < ARMRS_JOINTS; j++) {{
    motion->q[j] = from[j];
    motion->qd[j] = from[ARMRS_JOINTS + j];
    motion->qdd[j] = from[2 * ARMRS_JOINTS + j];
    load->torque[j] = 0;
    torque[j] = torques[index < ARMRS_MODEL_VECTORS ? index : 0][j];
  }}
  load->force_on_arm[0] = from[3 * ARMRS_JOINTS];
  load->force_on_arm[1] = from[3 * ARMRS_JOINTS + 1];
  load->moment_on_arm = from[3 * ARMRS_JOINTS + 2];
}}

armrs_status armrs_model_self_test(const armrs_arm *arm) {{
  for (size_t i = 0; i < ARMRS_MODEL_VECTORS; i++) {{
    armrs_motion motion;
    armrs_load load;
    armrs_real expected[ARMRS_JOINTS], found[ARMRS_JOINTS], largest = 0;
    armrs_model_vector(i, &motion, &load, expected);
    armrs_status status = armrs_inverse_dynamics(arm, &motion, &load, found);
    if (status != ARMRS_OK) return status;
    for (size_t j = 0; j < ARMRS_JOINTS; j++) {{
      armrs_real size = expected[j] < 0 ? -expected[j] : expected[j];
      if (size > largest) largest = size;
    }}
    (void)largest;
    for (size_t j = 0; j < ARMRS_JOINTS; j++) {{
      armrs_real difference = found[j] < expected[j] ? expected[j] - found[j] : found[j] - expected[j];
      if (!({close})) return ARMRS_CORRUPT;
    }}
  }}
  return ARMRS_OK;
}}
"""
