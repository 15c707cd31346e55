"""Joint moments of OpenSim's arm26 model against the file that OpenSim computed.

OpenSim's inverse dynamics low-passes the coordinates at 6 Hz as its set-up file asks: a Butterworth filter of third order, forwards and
backwards, -3 dB of a single pass, with half the record mirrored through its end points on either side; then it differentiates splines
of fifth degree. Other orders, cutoffs and paddings were tried and agree less well. What is left is that arm26's axes are 3.4 and 3.5
degrees off the plane's normal, which a planar arm has not.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt

import armrs


def table(path: Path) -> np.ndarray:
    lines = path.read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.strip() == "endheader")
    rows = [line.split() for line in lines[start + 1 :] if line.strip()]
    return np.array(rows[1:], dtype=float)


def planar_arm(path: Path) -> tuple[armrs.Arm, np.ndarray]:
    """Return the arm, and what is to be added to OpenSim's angles: its segments hang at zero, and the elbow lies off the humerus."""
    bodies = {body.get("name"): body for body in ET.parse(path).iter("Body")}

    def numbers(body: str, tag: str) -> np.ndarray:
        element = next(bodies[body].iter(tag))
        return np.array((element.text or "").split(), dtype=float)

    elbow = numbers("r_ulna_radius_hand", "location_in_parent")[:2]
    length, angle = np.hypot(*elbow), np.arctan2(elbow[1], elbow[0])
    along, normal = elbow / length, np.array([-elbow[1], elbow[0]]) / length
    com = [numbers(body, "mass_center")[:2] for body in ("r_humerus", "r_ulna_radius_hand")]
    arm = armrs.Arm(
        [length, 0.3],  # the forearm's length has no part in the moments
        [numbers(body, "mass")[0] for body in ("r_humerus", "r_ulna_radius_hand")],
        [com[0] @ along, -com[1][1]],
        [numbers(body, "inertia_zz")[0] for body in ("r_humerus", "r_ulna_radius_hand")],
        com_normals=[com[0] @ normal, com[1][0]],
        gravity=9.80665,
    )
    return arm, np.array([angle, -np.pi / 2 - angle])


def test_moments_are_those_of_opensim(data: Path) -> None:
    folder = data / "raw" / "arm_files"
    arm, offset = planar_arm(folder / "opensim_arm26.osim")
    motion = table(folder / "opensim_arm26_InverseKinematics.mot")
    t, angles = motion[:, 0], np.radians(motion[:, 1:3])
    rate = 1.0 / float(np.mean(np.diff(t)))
    half = len(t) // 2
    before, after = 2 * angles[0] - angles[half:0:-1], 2 * angles[-1] - angles[-2 : -half - 2 : -1]
    padded = np.concatenate([before, angles, after])
    low_pass = butter(3, 6.0, fs=rate, output="sos")
    q = sosfiltfilt(low_pass, padded, axis=0)[half:-half]
    spline = make_interp_spline(t, q, k=5)
    moments = arm.inverse_dynamics(q + offset, spline(t, 1), spline(t, 2))
    expected = table(folder / "opensim_std_arm26_InverseDynamics.sto")[:, 1:3]
    assert moments.shape == expected.shape == (121, 2)
    shoulder, elbow = np.sqrt(np.mean(np.square(moments - expected), axis=0))
    assert shoulder <= 0.03
    assert elbow <= 0.003
    # Without the filter nothing agrees: the test can fail.
    raw = make_interp_spline(t, angles, k=5)
    wrong = arm.inverse_dynamics(angles + offset, raw(t, 1), raw(t, 2))
    assert np.sqrt(np.mean(np.square(wrong - expected))) > 0.3
