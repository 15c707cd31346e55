"""Samples at which muscles are active are marked and left out; quiet channels mark nothing."""

from __future__ import annotations

import dataclasses
import functools
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs.analysis import repeat_statistics
from armrs.io.muscle_activity import _applied, channel_faults, co_contraction, comparable, joint_activity, mark_activity, onset

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts"))
import check_passive

configurations = functools.cache(check_passive.configurations)
SEGMENTS = (armrs.Segment("upper arm", 0.322, 2.114, 0.186, 0.0165), armrs.Segment("forearm", 0.264, 1.264, 0.121, 0.0074))
JOINTS = (armrs.Joint("shoulder", viscosity=0.25), armrs.Joint("elbow", viscosity=0.2, stiffness=0.5, rest=0.6))
ROBOT = armrs.Robot((0.45, 0.45), (1.05, -0.10))
MODEL = armrs.Model(SEGMENTS, JOINTS, robot=ROBOT)
MOVEMENT = armrs.Movement(np.radians([[-60, 40], [-25, 75], [-70, 90], [-60, 40]]), speed=0.5, acceleration=2.0)
BURST = armrs.Effect("voluntary", 2, parameters={"amplitude": 1.0, "start": 2.5, "duration": 0.6})


OTHER = armrs.Movement(np.radians([[-70, 60], [-40, 20], [-60, 95], [-30, 50], [-70, 60]]), speed=1.0, acceleration=4.0)


def trial(repeat: int, seed: int, burst: bool, movement: armrs.Movement = MOVEMENT) -> armrs.Trial:
    """A measured trial with a surface EMG of the biceps: noise at rest, ten times as much in a burst."""
    rng = np.random.default_rng(seed)
    model = MODEL.replace(effects=(BURST,)) if burst else MODEL
    run = armrs.simulate(model, movement, rate=50.0)
    noise = rng.standard_normal
    q = run.q + 5e-4 * noise(run.q.shape)
    force = run.force_on_arm + 0.1 * noise(run.force_on_arm.shape)
    # Drawn last, so that angles and forces have the same noise with and without a burst.
    emg = 0.02 * noise(len(run.t))
    if burst:
        during = (run.t > 2.45) & (run.t < 3.1)
        emg[during] += 0.2 * noise(during.sum())
    name = "slow" if movement is MOVEMENT else "fast"
    return armrs.Trial(f"{name}_{repeat}.csv", name, repeat, "fit", run.t, q, force_on_arm=force, emg={"emg_biceps": emg})


def test_noise_at_rest_is_no_activity() -> None:
    t = np.arange(100_000) / 100.0
    quiet = [
        armrs.Trial(f"{k}.csv", "rest", k, "fit", t, np.zeros((len(t), 1)), emg={"emg_a": np.random.default_rng(k).standard_normal(len(t))})
        for k in range(1, 11)
    ]
    marked, lines = mark_activity(quiet)
    assert sum(int(m.active.sum()) for m in marked) == 0
    assert lines == []


def test_a_channel_that_is_active_all_the_time_marks_nothing_and_says_so() -> None:
    t = np.arange(2000) / 100.0
    envelope = np.where(np.arange(2000) % 400 < 300, np.linspace(1.0, 2.0, 2000), 0.01)
    one = armrs.Trial("a.csv", "a", 1, "fit", t, np.zeros((2000, 1)), emg={"emg_a": envelope})
    marked, lines = mark_activity([one])
    assert marked[0].valid.all() or "resting level is not known" in lines[0]


def test_a_burst_is_marked_with_a_margin_and_left_out_of_all_repeats_where_gap_compares_them() -> None:
    trials = [trial(1, 11, False), trial(2, 12, True), trial(3, 13, False)]
    marked, lines = mark_activity(trials)
    assert [bool(m.active.any()) for m in marked] == [False, True, False]
    during = (trials[0].t > 2.5) & (trials[0].t < 3.1)
    assert [bool(m.valid.all()) for m in marked] == [True, False, True]
    for m in comparable(marked):
        assert not m.valid[during].any()
        assert m.valid[(m.t < 2.2) | (m.t > 3.7)].all()
    assert len(lines) == 1 and "slow_2.csv" in lines[0]


def pair(flexor: np.ndarray, extensor: np.ndarray) -> armrs.Trial:
    t = np.arange(len(flexor)) / 100.0
    emg = {"emg_elbow_flexor_uV": flexor, "emg_elbow_extensor_uV": extensor, "emg_other": flexor}
    return armrs.Trial("a.csv", "a", 1, "fit", t, np.zeros((len(t), 1)), emg=emg)


def test_co_contraction_is_that_of_antagonists() -> None:
    on = np.where((np.arange(1000) > 400) & (np.arange(1000) < 600), 5.0, 1.0)
    off = np.ones(1000)
    assert co_contraction([pair(on, on)], 0, 4.0, 6.0) == pytest.approx(1.0)
    # Twice the gain of an amplifier changes nothing.
    assert co_contraction([pair(on, 2.0 * on)], 0, 4.0, 6.0) == pytest.approx(1.0)
    assert co_contraction([pair(on, off)], 0, 4.0, 6.0) == 0.0
    assert co_contraction([pair(off, off)], 0, 4.0, 6.0) is None
    assert co_contraction([trial(1, 11, True)], 0, 0.0, 5.0) is None
    half = np.where((np.arange(1000) > 400) & (np.arange(1000) < 500), 5.0, 1.0)
    assert co_contraction([pair(on, half)], 0, 4.0, 6.0) == pytest.approx(2.0 / 3.0, abs=0.01)


@pytest.mark.parametrize("seed", [0, 1000, 2000])
def test_a_marked_burst_moves_no_estimate_by_a_tenth_of_its_interval(seed: int) -> None:
    """Beside the same trials without a burst. Before, other weights were used where a repeat had lost samples: 0.3 to 0.7 intervals."""
    others = [trial(k, seed + 20 + k, False, OTHER) for k in (1, 2, 3)]
    clean = [*(trial(k, seed + 10 + k, False) for k in (1, 2, 3)), *others]
    disturbed = [clean[0], trial(2, seed + 12, True), *clean[2:]]

    def identified(trials: Sequence[armrs.Trial]) -> armrs.Identified:
        return armrs.identify(armrs.Dataset("s", MODEL.replace(segment_uncertainty=0.1), tuple(trials), force_on="arm"), motion="measured")

    marked = mark_activity(disturbed)[0]
    same_samples = [dataclasses.replace(quiet, valid=own.valid) for quiet, own in zip(clean, marked, strict=True)]

    def moved(base: armrs.Identified, result: armrs.Identified) -> float:
        pairs = zip((*base.parameters, *base.combinations), (*result.parameters, *result.combinations), strict=True)
        return max(abs(b.value - a.value) / (a.interval[1] - a.interval[0]) for a, b in pairs)

    quiet, left_out = identified(clean), identified(marked)
    assert moved(quiet, identified(disturbed)) > 0.8
    assert moved(quiet, left_out) < 0.1
    # What is left is the noise of the samples that are missing: nothing of the burst is in the others.
    assert moved(identified(same_samples), left_out) < 0.002


def disturbed_session(seed: int) -> tuple[armrs.Dataset, armrs.Dataset]:
    """Three slow repeats of one configuration of the thesis with its tone; the second also with a burst of 1 N m, and its activity."""
    known = [configurations(1.0)[seed % 10]]
    dataset, draw = check_passive.session(known, seed, 1.0, 1.0), np.random.default_rng(seed)
    noise = draw.standard_normal
    trials = [dataclasses.replace(t, emg={"emg_biceps": 0.02 * noise(len(t))}) for t in dataset.trials if t.repeat <= 3]
    second = trials[1]
    since = (second.t - draw.uniform(0.5, second.t[-1] - 1.1)) / 0.6
    torque = np.zeros(second.q.shape)
    torque[:, known[0].joint - 1] = np.where((since >= 0.0) & (since <= 1.0), np.sin(np.pi * since) ** 2, 0.0)
    segments = dataset.model.segments
    arm = armrs.Arm(*([getattr(s, name) for s in segments] for name in ("length", "mass", "com", "inertia")))
    force = np.linalg.solve(arm.jacobian(second.q).transpose(0, 2, 1), torque[:, :, None])[:, :, 0]
    emg = second.emg["emg_biceps"] + np.where(torque.any(axis=1), 0.2, 0.0) * noise(len(second))
    burst = dataclasses.replace(second, force_on_arm=second.force_on_arm - force, emg={"emg_biceps": emg})
    return dataset.replace(trials=tuple(trials)), dataset.replace(trials=(trials[0], burst, trials[2]))


@pytest.mark.long
def test_a_marked_burst_moves_passive_moments_by_the_noise_of_what_is_lost() -> None:
    """In units of the usual interval of each configuration of the thesis: that of three repeats is narrow where these agree by chance."""

    def told(data: armrs.Dataset) -> np.ndarray:
        found = [e for e in armrs.passive_moments(data).followed() if "range" not in e.name and np.isfinite(e.value)]
        return np.array([(e.value, e.interval[1] - e.interval[0]) for e in found])

    def changes(number: int) -> np.ndarray:
        sessions = []
        for seed in range(120 + number, 150, 10):
            quiet, burst = disturbed_session(seed)
            marked = burst.replace(trials=mark_activity(burst.trials)[0])
            pairs = zip(quiet.trials, marked.trials, strict=True)
            # Without the burst, and the same samples are left out.
            lost = quiet.replace(trials=tuple(dataclasses.replace(t, valid=m.valid, active=m.active) for t, m in pairs))
            sessions.append([told(data) for data in (quiet, burst, lost, marked)])
        found = np.array(sessions)
        usual = np.sqrt(np.mean(found[:, 0, :, 1] ** 2, axis=0))
        quiet_of, burst_of, lost_of, marked_of = np.moveaxis(found[..., 0] / usual, 1, 0)
        return np.array([burst_of - quiet_of, marked_of - lost_of, marked_of - quiet_of]).reshape(3, -1)

    raw, leaked, left = np.concatenate([changes(number) for number in range(10)], axis=1)
    assert np.sqrt(np.mean(raw**2)) > 0.3
    # Nothing of the burst is in the samples that are left; those that are lost move estimates by little, and in no direction.
    assert np.sqrt(np.mean(leaked**2)) < 0.01
    assert np.sqrt(np.mean(left**2)) < 0.07 and np.mean(np.abs(left) < 0.1) > 0.9
    assert abs(left.mean()) < 3.0 * left.std(ddof=1) / np.sqrt(left.size)


def test_one_line_says_in_which_trials_muscles_are_active_and_for_how_long() -> None:
    quiet = disturbed_session(120)[0].trials
    times = [np.zeros(len(trial), dtype=bool) for trial in quiet]
    for active, samples in zip(times[:2], (20, 60), strict=True):
        active[10 : 10 + samples] = True
    marked, lines = _applied(quiet, times, [])
    least, most = (f"{n * quiet[0].dt:.2g}" for n in (20, 60))
    assert lines == [
        f"{quiet[0].file} and {quiet[1].file}: muscles are active for {least} to {most} s; analyses of a passive arm leave these samples out"
    ]
    assert [int((~trial.valid).sum()) for trial in marked] == [20, 60, 0]


def test_a_trial_that_is_active_throughout_is_compared_and_told() -> None:
    (trial,) = disturbed_session(120)[0].trials[:1]
    (marked,), lines = _applied([trial], [np.ones(len(trial), dtype=bool)], [])
    assert marked.valid.all() and lines == [f"{trial.file}: muscles are active throughout; this is no passive recording"]


def test_a_gap_is_completed_by_the_shape_of_all_repeats_at_the_level_of_each() -> None:
    shape, levels = np.sin(np.linspace(0.0, 2.0, 20)), np.array([0.0, 3.0, -1.0])
    whole = shape + levels[:, None]
    values = whole.copy()
    values[0, 3:8] = values[1, 12:] = values[2, 15] = np.nan
    completed = repeat_statistics.completed(values, np.array([True, True, False]))
    np.testing.assert_allclose(completed[:2], whole[:2], atol=1e-6)
    assert np.isnan(completed[2, 15])


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_data_set_without_or_with_dead_channels_is_as_it_was(share: float) -> None:
    one = trial(1, 11, False)
    kept = {} if share == 0.0 else {"emg_dead": np.zeros(len(one))}
    plain = armrs.Trial(one.file, one.configuration, 1, "fit", one.t, one.q, force_on_arm=one.force_on_arm, emg=kept)
    marked, lines = mark_activity([plain])
    assert marked[0].valid.all() and lines == []


def channels(**emg: np.ndarray) -> armrs.Trial:
    t = np.arange(4000) / 1000.0
    return armrs.Trial("a.csv", "a", 1, "fit", t, np.zeros((len(t), 1)), emg={f"emg_{name}": values for name, values in emg.items()})


def test_dead_and_saturated_channels_are_named_with_their_files() -> None:
    """They passed every verb without a word."""
    draw = np.random.default_rng(3)
    burst = np.where(np.arange(4000) // 500 % 4 == 3, 10.0, 1.0) * draw.standard_normal(4000)
    good = {
        "noise": burst,
        "of_few_levels": np.round(2.0 * burst),
        "rectified": np.maximum(np.abs(burst) - 2.0, 0.0),
        "with_a_gap": np.where(np.arange(4000) < 2000, np.nan, burst),
        "not_recorded": np.full(4000, np.nan),
        "switch": 1.0 * (np.arange(4000) > 2000),
    }
    assert channel_faults([channels(**good)]) == []
    trials = [
        dataclasses.replace(channels(triceps=triceps, biceps=biceps), file=file)
        for file, triceps, biceps in (
            ("a.csv", np.full(4000, 0.3), np.clip(burst, -8.0, 8.0)), ("b.csv", burst, burst.clip(-3.0, 3.0)),
            ("c.csv", np.zeros(4000), np.maximum(burst, -8.0).clip(None, 8.0)),
        )
    ]  # fmt: skip
    dead, clipped = channel_faults(trials)
    assert dead == "a.csv and 1 more: emg_triceps is constant: a dead channel?"
    n = 2 * int((np.abs(burst) >= 8.0).sum())
    assert clipped == f"a.csv and 1 more: emg_biceps stays at 8 or -8, its extreme, in {n} samples: saturated?"


def test_channels_that_are_resampled_are_judged_as_read(tmp_path: Path) -> None:
    """Interpolation between samples of uneven times leaves few of them at the extreme."""
    one = trial(1, 11, True)
    uneven = one.t + 2e-3 * np.sin(np.arange(len(one.t)))
    clipped = np.clip(one.emg["emg_biceps"], -0.03, 0.03)
    assert one.force_on_arm is not None
    table = np.column_stack([uneven, one.q, one.force_on_arm, clipped])
    head = "t_s,q1_rad,q2_rad,Fy_N,Fz_N,emg_biceps"
    folder = armrs.write_dataset(armrs.Dataset("one", MODEL, (one,), force_on="arm"), tmp_path / "one").parent
    [path] = folder.rglob("slow_1.csv")
    np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.9g")
    loaded = armrs.load_dataset(folder)
    assert loaded.trials[0].resampled
    assert sum("emg_biceps stays at 0.03 or -0.03" in line for line in loaded.warnings) == 1


MUSCLES = (armrs.model.Muscle("emg_elbow_flexor_uV", 1, mvc=50.0, rest=2.0, delay_s=0.0), armrs.model.Muscle("emg_other", 1))


def test_activity_is_the_envelope_above_rest_relative_to_a_maximal_contraction() -> None:
    t = np.arange(3000) / 100.0
    step = np.where((t > 10.0) & (t < 12.0), 26.0, 2.0)
    one = armrs.Trial("a.csv", "a", 1, "fit", t, np.zeros((len(t), 2)), emg={"emg_elbow_flexor_uV": step, "emg_other": 2.0 * step})
    (told,), lines = joint_activity([one], MUSCLES[:1], 2)
    assert told.activity is not None and lines == []
    assert told.activity[(t > 10.2) & (t < 11.8)] == pytest.approx(np.tile([0.5, 0.0], (159, 1)))
    assert told.activity[(t < 9.8) | (t > 12.2)] == pytest.approx(0.0, abs=1e-15)
    # As late as torque.
    (late,), _ = joint_activity([one], [MUSCLES[0].replace(delay_s=0.1)], 2)
    assert late.activity is not None
    assert late.activity[10:] == pytest.approx(told.activity[:-10])
    # The mean of both; the other one, of which nothing is known, is at its largest.
    (both,), lines = joint_activity([one], MUSCLES, 2)
    assert both.activity is not None
    assert both.activity[1100] == pytest.approx([0.75, 0.0])
    assert len(lines) == 1 and "emg_other: no mvc" in lines[0]
    assert joint_activity([one], (), 2)[0][0].activity is None


def test_co_contraction_is_relative_to_contractions_that_are_stated() -> None:
    on = np.where((np.arange(1000) > 400) & (np.arange(1000) < 600), 5.0, 1.0)
    # Of an extensor that could be three times as active it is a third.
    stated = (armrs.model.Muscle("emg_elbow_extensor_uV", 1, mvc=13.0, rest=1.0),)
    assert co_contraction([pair(on, on)], 0, 4.0, 6.0, stated) == pytest.approx(2.0 * (1.0 / 3.0) / (4.0 / 3.0), abs=0.01)


ACTIVE_MODEL = armrs.Model(SEGMENTS, JOINTS)


def turned(t: np.ndarray, phase: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles, speeds and torques of two joints that a dynamometer turns, with an elbow of active muscles. What they do is written here."""
    arm = armrs.Arm(*([getattr(s, name) for s in SEGMENTS] for name in ("length", "mass", "com", "inertia")))
    omega = np.array([1.3, 2.1])
    q = np.array([-0.8, 1.2]) + 0.5 * np.sin(omega * t[:, None] + phase)
    qd, qdd = 0.5 * omega * np.cos(omega * t[:, None] + phase), -0.5 * omega**2 * np.sin(omega * t[:, None] + phase)
    tau = arm.inverse_dynamics(q, qd, qdd) + np.array([0.25, 0.2]) * qd
    tau[:, 1] += 0.5 * (q[:, 1] - 0.6) + u * (8.0 * q[:, 1] - 5.0 + 0.9 * qd[:, 1])
    return q, qd, tau


def active_session(seed: int, muscles: bool = True) -> armrs.Dataset:
    """Three recordings in which the elbow's muscles contract now and then: 2 µV at rest, 80 µV at most, torque 50 ms later."""
    draw, trials, t = np.random.default_rng(seed), [], np.arange(0.0, 20.0, 0.01)
    for repeat in (1, 2, 3):
        u = np.sum([0.3 * np.exp(-(((t - at) / 0.4) ** 2)) for at in draw.uniform(1.0, 19.0, 3)], axis=0)
        q, _, tau = turned(t, draw.uniform(0.0, 6.0, 2), u)
        emg = (2.0 + 78.0 * np.interp(t + 0.05, t, u)) * (1.0 + 0.1 * draw.standard_normal(len(t)))
        q, tau = q + 1e-4 * draw.standard_normal(q.shape), tau + 0.02 * draw.standard_normal(tau.shape)
        trials.append(armrs.Trial(f"{repeat}.csv", "swing", repeat, "fit", t, q, tau=tau, emg={"emg_biceps_uV": emg}))
    stated = (armrs.model.Muscle("emg_biceps_uV", 2, mvc=80.0, rest=2.0),) if muscles else ()
    marked = joint_activity(mark_activity(trials)[0], stated, 2)[0]
    return armrs.Dataset("active", ACTIVE_MODEL, marked, muscles=stated)


ACTIVE = ("active_stiffness", "active_viscosity")


def test_stiffness_and_viscosity_that_grow_with_activity_are_identified() -> None:
    truth = {("stiffness", "active_stiffness"): 8.0, ("torque", "active_stiffness"): 5.0, ("viscosity", "active_viscosity"): 0.9}
    found_of: dict[tuple[str, str], list[armrs.Estimate]] = {key: [] for key in truth}
    for seed in range(400, 412):
        data = active_session(seed)
        assert any(t.active.any() for t in data.trials)
        found = armrs.identify(data, with_effects=ACTIVE, motion="measured")
        estimates = {(p.name, p.kind): p for p in found.parameters if p.kind in ACTIVE}
        # The shoulder has no muscle that is recorded.
        assert set(estimates) == set(truth) and all(p.joint == 2 for p in estimates.values())
        for key in truth:
            found_of[key].append(estimates[key])
        passive = {(p.name, p.kind): p.value for p in found.parameters if p.joint == 2}
        assert passive["stiffness", "elastic"] == pytest.approx(0.5, rel=0.1)
    for key, true in truth.items():
        assert np.mean([e.value for e in found_of[key]]) == pytest.approx(true, rel=0.03)
        assert sum(e.interval[0] <= true <= e.interval[1] for e in found_of[key]) >= 10


def test_activity_that_no_effect_depends_on_changes_nothing() -> None:
    with_muscles, without = (armrs.identify(active_session(400, muscles), motion="measured") for muscles in (True, False))
    assert [p.value for p in with_muscles.parameters] == [p.value for p in without.parameters]


def test_what_depends_on_activity_needs_muscles_and_repeats_are_not_compared_with_it(tmp_path: Path) -> None:
    data = active_session(400, muscles=False)
    with pytest.raises(armrs.BadInput, match=r"\[\[muscle\]\]: found no muscle of joint 1"):
        armrs.identify(data, with_effects=ACTIVE, motion="measured")
    effect = armrs.Effect("active_stiffness", 2, parameters={"stiffness": 8.0, "torque": 5.0})
    told = active_session(400)
    model = told.model.replace(effects=(effect,))
    with pytest.raises(armrs.BadInput, match="no two have the same muscle activity"):
        armrs.find_gap(told.replace(model=model))
    with pytest.raises(armrs.BadInput, match="identify and simulate alone follow it"):
        armrs.simulate(model, data.trials[0], duration=1.0)
    with pytest.raises(armrs.BadInput, match="identify and simulate alone follow it"):
        armrs.simulate(model, MOVEMENT)
    wrong = told.model.replace(effects=(effect.replace(joint=1),))
    with pytest.raises(armrs.BadInput, match="found no muscle of joint 1"):
        armrs.identify(told.replace(model=wrong), motion="measured")


def test_a_simulated_arm_is_moved_by_its_muscles() -> None:
    """Forward, with the laws of the catalogue, an arm follows the torques that were computed inversely with those written here."""
    effects = (
        armrs.Effect("active_stiffness", 2, parameters={"stiffness": 8.0, "torque": 5.0}),
        armrs.Effect("active_viscosity", 2, parameters={"viscosity": 0.9}),
    )
    t = np.arange(0.0, 1.5, 0.001)
    u = 0.3 * np.exp(-(((t - 0.7) / 0.3) ** 2))
    q, qd, tau = turned(t, np.zeros(2), u)
    led = armrs.Trial("a.csv", "swing", 1, "fit", t, q, tau=tau, activity=np.column_stack([np.zeros(len(t)), u]))
    active, passive = (armrs.simulate(ACTIVE_MODEL.replace(effects=e), led, start_speed=qd[0], rate=1000.0) for e in (effects, ()))
    assert np.abs(active.q - q).max() < 1e-5
    assert np.abs(passive.q - q).max() > 0.1


def test_muscles_of_a_data_set_are_written_read_and_refused(tmp_path: Path) -> None:
    data = active_session(400)
    armrs.write_dataset(data, tmp_path)
    again = armrs.load_dataset(tmp_path)
    assert again.muscles == data.muscles
    for one, other in zip(again.trials, data.trials, strict=True):
        np.testing.assert_allclose(one.activity, other.activity, atol=1e-9)
    file = tmp_path / "dataset.toml"
    text = file.read_text(encoding="utf-8")
    for old, new, message in (
        ("joint = 2", "joint = 3", r"\[\[muscle\]\] 1, joint: found 3"),
        (
            'channel = "emg_biceps_uV"',
            'channel = "emg_triceps"',
            r"\[\[muscle\]\] 1, channel: found no such column in 1.csv.*emg_biceps_uV",
        ),
        ('channel = "emg_biceps_uV"', 'channel = "biceps"', r"\[\[muscle\]\] 1, channel: found .*the name of an emg_ column"),
        ("mvc = 80.0", "mvc = 1.0", r"\[\[muscle\]\] 1, mvc: found 1.*above rest = 2"),
        ("delay_s = 0.05", "delay_s = 5.0", r"\[\[muscle\]\] 1, delay_s: found 5.*0 to 0.5"),
    ):
        assert old in text
        file.write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(armrs.BadInput, match=message):
            armrs.load_dataset(tmp_path)
    table = text[text.index("[[muscle]]") : text.index("[[trial]]")]
    file.write_text(text.replace(table, table + table), encoding="utf-8")
    with pytest.raises(armrs.BadInput, match=r"\[\[muscle\]\] 2, channel: .*each channel once"):
        armrs.load_dataset(tmp_path)


@pytest.mark.parametrize(("rise", "ratio", "bias", "spread"), [
    (0.0, 3.2, 3.0, 9.0), (0.0, 5.6, 1.0, 4.0), (0.0, 10.0, 1.0, 3.0), (0.05, 5.6, 7.0, 12.0), (0.05, 10.0, 5.0, 8.0),
])  # fmt: skip
def test_an_onset_is_where_activity_begins(rise: float, ratio: float, bias: float, spread: float) -> None:
    """Amplitudes so many times that of rest, at once or over 50 ms; the alarm came up to 35 ms later [ms]."""
    draw, late = np.random.default_rng(5), []
    t = np.arange(0.0, 1.5, 1e-3)
    grown = np.clip((t - 0.7) / rise, 0.0, 1.0) if rise else (t >= 0.7).astype(float)
    for _ in range(60):
        # White noise between 20 and 450 Hz, as surface electrodes record it.
        noise = np.fft.rfft(draw.standard_normal(len(t)))
        frequency = np.fft.rfftfreq(len(t), 1e-3)
        noise[(frequency < 20.0) | (frequency > 450.0)] = 0.0
        signal = np.fft.irfft(noise, len(t)) * (1.0 + (ratio - 1.0) * grown)
        one = armrs.Trial("a.csv", "a", 1, "fit", t, np.zeros((len(t), 1)), emg={"emg_a": signal})
        found = onset(one, "emg_a", 0.5, 1.2)
        assert found is not None
        late.append(1e3 * (found - 0.7))
    assert abs(np.mean(late)) < bias and np.std(late) < spread, (np.mean(late), np.std(late))
