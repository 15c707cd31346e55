"""Virtual patients whose laws are written here anew: an elbow that a dynamometer stretches, with a reflex that acts late.

Nothing of the catalogue or of the simulation is used but the rigid arm. The motion is given in closed form, so that its past is exact.
The virtual laboratory records the same patients with the laws of the catalogue, led by a controlled robot (`recorded`).
"""

from __future__ import annotations

import dataclasses
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import armrs
from armrs import _armrs
from armrs.io.dataset import Dataset
from armrs.io.trial import Trial
from armrs.model import Joint, Model, Segment
from armrs.workflows.experiment import load_experiment
from armrs.workflows.record import measure

SPEEDS = np.radians([15.0, 60.0, 110.0, 170.0, 230.0])
"""Largest speeds of the stretches [rad/s]."""
LOW, HIGH = np.radians([25.0, 115.0])


@dataclass(frozen=True)
class Patient:
    """What is true of a patient, in SI units."""

    gain: float = 1.2
    threshold: float = 1.0
    latency: float = 0.04
    tonic: float = 0.0
    slope: float = 0.0
    viscosity: float = 0.15
    dry: float = 0.2
    stiffness: float = 0.8
    tone: float = 0.15
    wrong_inertia: float = 0.03
    force_gains: tuple[float, float] = (0.0, 0.0)
    force_biases: tuple[float, float] = (0.0, 0.0)
    """Errors of the laboratory's force sensor along y and z [1, N], the same in all sessions, as large as a data set declares them."""
    person: int = 0
    """Seed of the masses in the laboratory, the same in all sessions."""

    @staticmethod
    def drawn(draw: np.random.Generator) -> Patient:
        """Return one of a population."""
        return Patient(
            gain=draw.uniform(0.5, 2.5),
            threshold=draw.uniform(0.5, 1.8),
            latency=draw.uniform(0.025, 0.06),
            viscosity=draw.uniform(0.05, 0.3),
            dry=draw.uniform(0.05, 0.3),
            stiffness=draw.uniform(0.3, 1.5),
            force_gains=tuple(0.01 * draw.standard_normal(2)),
            force_biases=tuple(0.2 * draw.standard_normal(2)),
            person=int(draw.integers(1, 2**31)),
        )


def arm() -> Model:
    """Return a forearm with hand."""
    return Model((Segment("forearm", 0.3, 1.5, 0.15, 0.012),), (Joint("elbow"),))


def motion(t: np.ndarray, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return angle, speed and acceleration of a stretch and a slow return: minimum jerk, after 0.4 s of rest."""
    there, back = 1.875 * (HIGH - LOW) / speed, 1.875 * (HIGH - LOW) / min(speed, SPEEDS[1])
    q, qd, qdd = np.full(len(t), LOW), np.zeros(len(t)), np.zeros(len(t))
    for begin, lasts, way in ((0.4, there, 1.0), (0.9 + there, back, -1.0)):
        s = np.clip((t - begin) / lasts, 0.0, 1.0)
        q += way * (HIGH - LOW) * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        qd += way * (HIGH - LOW) / lasts * 30.0 * s**2 * (1.0 - s) ** 2
        qdd += way * (HIGH - LOW) / lasts**2 * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    return q, qd, qdd


def felt(patient: Patient, t: np.ndarray, speed: float) -> np.ndarray:
    """Return how far the speed is beyond the threshold a latency ago [rad/s]."""
    q, qd, _ = motion(t - patient.latency, speed)
    return np.maximum(0.0, qd - patient.threshold - patient.slope * np.maximum(0.0, patient.tonic - q))


def resistance(patient: Patient, t: np.ndarray, speed: float) -> np.ndarray:
    """Return the torque with which the elbow resists [N m]."""
    q, qd, qdd = motion(t, speed)
    middle = 0.5 * (LOW + HIGH)
    spring = patient.stiffness * (q - middle) + 0.15 * (np.exp(3.0 * (q - HIGH)) - np.exp(-3.0 * (q - LOW)))
    friction = patient.viscosity * qd + patient.dry * np.tanh(qd / 0.03) + patient.wrong_inertia * qdd
    return spring + friction + patient.gain * felt(patient, t, speed)


def session(patient: Patient, seed: int, *, repeats: int = 3, rate: float = 200.0, emg: bool = False) -> Dataset:
    """Return a session: every speed some times, with noise of 0.05 N m and 0.05°, and tone that drifts from trial to trial."""
    draw = np.random.default_rng(seed)
    model, trials = arm(), []
    chain = _armrs.Arm.from_model(model)
    for number, speed in enumerate(SPEEDS):
        for repeat in range(1, repeats + 1):
            lasts = 1.4 + 1.875 * (HIGH - LOW) * (1.0 / speed + 1.0 / min(speed, SPEEDS[1]))
            t = np.arange(0.0, lasts, 1.0 / rate)
            q, qd, qdd = (np.ascontiguousarray(x[:, None]) for x in motion(t, speed))
            torque = chain.inverse_dynamics(q, qd, qdd)[:, 0] + resistance(patient, t, speed) + patient.tone * draw.standard_normal()
            tau = torque + 0.05 * draw.standard_normal(len(t))
            q = q + np.radians(0.05) * draw.standard_normal(q.shape)
            channels = {}
            if emg:
                # Nerve before torque: activity 15 ms ahead of it, a random signal of which the size follows what is felt.
                drive = felt(patient, t + 0.015, speed)
                channels["emg_biceps_uV"] = (3.0 + 60.0 * drive) * draw.standard_normal(len(t))
            trials.append(Trial(f"v{number}_{repeat}.csv", f"speed {number}", repeat, "fit", t, q, tau=tau[:, None], emg=channels))
    return Dataset("patient", model, tuple(trials))


def written(data: Dataset, folder: Path) -> Path:
    """Write a session as a data set."""
    armrs.write_dataset(data, folder)
    return folder


PERSON = """\
[subject]
body_mass = 77.0
height = 1.80
sex = "male"
lengths_m = [0.322, 0.30]
"""
"""Subject of an experiment; `spread`, the deviation of the true arm from what is expected of it, follows."""
EXPERIMENT = """\
name = "patient"
seed = {seed}

{person}spread = 0.3

[[joint]]
[[joint]]
stiffness = {stiffness}
rest = 1.2
viscosity = {viscosity}
coulomb = {dry}

[[effect]]
kind = "stretch_reflex"
joint = 2
gain = {gain}
threshold = {threshold}
latency = {latency}

[handle]
mass = 0.193

[sensors]
rate_Hz = 200
marker_offset_m = 0.0014
marker_skin_m_rad = 0.002
clock_offset_s = {clock}
emg = true

[variation]
moment_Nm = [0.3, {tone}]

[safety]
speed_rad_s = 20.0
acceleration_rad_s2 = 400.0
force_N = 100.0
"""
STRETCH = """
[[movement]]
configuration = "stretch {number}"
waypoints_deg = [[-60, 30], [-60, 30.2], [-60, 110], [-60, 30], [-60, 30.2]]
speed_rad_s = {speed}
acceleration_rad_s2 = {acceleration}
pause_s = 0.5
shape = "smooth"
repeats = 3
"""
FORCE_ERROR = """
[[effect]]
kind = "force_{kind}"
channel = "{channel}"
{kind} = {value}
"""
CLOCK, BASE, COMPLIANCE = 0.005, 0.01, 0.5
"""Standard deviations of what each session of the laboratory has anew: clock of the cameras [s], place of the first joint relative to the
robot [m], compliance of the contact (relative); the sizes that the analysis assumes (`[tolerance]`, `joint_centres`)."""
LABORATORY_SPEEDS = (0.3, 1.0, 1.8, 2.7, 3.6)
"""Speeds of the stretches in the laboratory [rad/s]."""


def recorded(patient: Patient, seed: int) -> Dataset:
    """Return a session of the virtual laboratory; its model has the place of the shoulder and the compliance of the contact with errors."""
    draw = np.random.default_rng([seed, 5])
    values = dataclasses.asdict(patient) | {"clock": CLOCK * draw.standard_normal()}
    said = EXPERIMENT.format(**values | {"person": PERSON, "seed": values["person"]})
    said += "".join(STRETCH.format(number=k, speed=s, acceleration=max(4.0, 12.0 * s)) for k, s in enumerate(LABORATORY_SPEEDS))
    for kind, values in (("gain", patient.force_gains), ("bias", patient.force_biases)):
        said += "".join(FORCE_ERROR.format(kind=kind, channel=c, value=v) for c, v in zip(("Fy", "Fz"), values, strict=True))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "EXPERIMENT.toml"
        file.write_text(said, encoding="utf-8")
        data = measure(dataclasses.replace(load_experiment(file), seed=seed)).dataset
    robot, contact = data.model.robot, data.model.contact
    assert robot is not None and contact is not None
    place = np.array(robot.base) + BASE * draw.standard_normal(2)
    yields = np.exp(COMPLIANCE * draw.standard_normal(2))
    robot = robot.replace(base=tuple(place.tolist()))
    contact = contact.replace(stiffness=tuple((np.array(contact.stiffness) / yields).tolist()))
    return data.replace(model=data.model.replace(robot=robot, contact=contact))
