"""The score of the hidden-effect cases, on made-up answers in the form of `armrs gap --json`."""

from __future__ import annotations

import csv
import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

SCRIPT = Path(__file__).parents[1] / "bench" / "hidden" / "score.py"


@pytest.fixture(scope="module")
def score() -> ModuleType:
    spec = importlib.util.spec_from_file_location("hidden_score", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def effect(kind: str, joint: int | None = None, channel: str | None = None, **parameters: float) -> dict[str, Any]:
    """A hidden effect as in truth.json."""
    exact = {name: {"value": value, "exact": True} for name, value in parameters.items()}
    return {"kind": kind, "joint": joint, "channel": channel, "trial": None, "parameters": exact}


def named(kind: str, joint: int | None = None, channel: str | None = None, alternatives: Any = (), **parameters: Any) -> dict[str, Any]:
    """A named effect as in gap.json; parameters are (value, std)."""
    estimates = {name: {"value": value, "std": std, "unit": "N m"} for name, (value, std) in parameters.items()}
    return {"kind": kind, "joint": joint, "channel": channel, "parameters": estimates, "alternatives": list(alternatives)}


def truth(*effects: dict[str, Any], family: str = "single", strength: str | None = "strong", null: str | None = None) -> dict[str, Any]:
    return {
        "seed": 1, "family": family, "strength": strength, "null": null, "joints": 2, "friction": "sticks",
        "noise": {"memory": 0.9}, "effects": list(effects),
    }  # fmt: skip


def answer(*effects: dict[str, Any], verdict: str | None = None, gap: dict[str, Any] | None = None) -> dict[str, Any]:
    return {"verdict": verdict or ("explained" if effects else "nothing_missing"), "effects": list(effects), "gap": gap or {}}


COULOMB = effect("coulomb", 2, torque=0.16)


def test_the_right_name_with_the_right_joint_and_nothing_else(score: ModuleType) -> None:
    line = score.judge(truth(COULOMB), answer(named("coulomb", 2, torque=(0.161, 0.006))))
    assert line["right"] and line["detected"] and line["missed"] == line["spurious"] == 0
    assert line["covered"] == {"coulomb 2 torque": True}
    assert line["errors"]["coulomb 2 torque"] == pytest.approx(0.00625)


@pytest.mark.parametrize(
    ("effects", "missed", "spurious"),
    [
        ([named("coulomb", 1)], 1, 1),
        ([named("stribeck", 2)], 1, 1),
        ([named("coulomb", 2), named("viscous", 2)], 0, 1),
        ([named("coulomb", 2), named("coulomb", 2)], 0, 1),
        ([], 1, 0),
    ],
)
def test_what_is_not_the_right_name(score: ModuleType, effects: list[dict[str, Any]], missed: int, spurious: int) -> None:
    line = score.judge(truth(COULOMB), answer(*effects))
    assert not line["right"] and (line["missed"], line["spurious"]) == (missed, spurious)


def test_an_alternative_counts_as_stated_but_not_as_named(score: ModuleType) -> None:
    other = {"kind": "coulomb", "joint": 2, "why": "not separable", "separating_movement": "faster"}
    line = score.judge(truth(COULOMB), answer(named("stribeck", 2, alternatives=[other])))
    assert line["among_alternatives"] and not line["right"]
    wrong_joint = score.judge(truth(COULOMB), answer(named("stribeck", 2, alternatives=[{**other, "joint": 1}])))
    assert not wrong_joint["among_alternatives"]


def test_either_name_of_one_term_is_right(score: ModuleType) -> None:
    rotor = truth(effect("motor_inertia", 1, inertia=0.2))
    assert score.judge(rotor, answer(named("inertia", 1)))["right"]
    assert not score.judge(rotor, answer(named("inertia", 2)))["right"]
    assert not score.judge(truth(effect("motor_inertia", 2, inertia=0.2)), answer(named("inertia", 2)))["right"]


def test_two_effects_need_both(score: ModuleType) -> None:
    both = truth(COULOMB, effect("force_bias", channel="Fz", bias=2.0), family="double")
    assert score.judge(both, answer(named("force_bias", channel="Fz"), named("coulomb", 2)))["right"]
    half = score.judge(both, answer(named("coulomb", 2), named("force_bias", channel="Fy")))
    assert (half["right"], half["missed"], half["spurious"]) == (False, 1, 1)


def test_a_burst_is_in_its_trial(score: ModuleType) -> None:
    burst = effect("voluntary", 1) | {"trial": "trials/slow_1.csv"}
    assert score.judge(truth(burst), answer(named("voluntary", 1)))["right"]
    assert score.judge(truth(burst), answer(named("voluntary", 1) | {"trial": "trials/slow_1.csv"}))["right"]
    assert not score.judge(truth(burst), answer(named("voluntary", 1) | {"trial": "trials/slow_2.csv"}))["right"]


def test_the_gap_is_closed_from_the_calibrated_base(score: ModuleType) -> None:
    channel = {"before": 9.0, "calibrated": 2.0, "after": 1.1, "floor": 1.0}
    assert score.closure({"Fy_N": channel}) == pytest.approx(0.9)
    # A channel at its floor has nothing to close, whatever `before` was; nor has one without numbers.
    at_floor = {"before": 9.0, "calibrated": 1.05, "after": 1.0, "floor": 1.0}
    unknown = {"before": None, "calibrated": None, "after": None, "floor": None}
    assert score.closure({"Fy_N": channel, "Fz_N": at_floor, "q1_rad": unknown}) == pytest.approx(0.9)
    assert score.closure({"Fz_N": at_floor}) is None
    # What lies above a floor by less than that is uncertain does not count either.
    uncertain = {"before": 9.0, "calibrated": 1.4, "after": 1.4, "floor": 1.0, "floor_std": 0.5}
    assert score.closure({"Fy_N": channel, "Fz_N": uncertain}) == pytest.approx(0.9)
    assert score.closure({"Fy_N": channel, "Fz_N": uncertain | {"floor_std": 0.3}}) == pytest.approx(0.9 / 1.4)
    # Channels of other units count by their floors: (0.9 + 0) / (1 + 1).
    stays = {"before": 0.02, "calibrated": 0.002, "after": 0.002, "floor": 0.001}
    assert score.closure({"Fy_N": channel, "q1_rad": stays}) == pytest.approx(0.45)


def test_intervals(score: ModuleType) -> None:
    assert score.covered(COULOMB, named("coulomb", 2, torque=(0.17, 0.004))) == {"torque": False}
    given = named("coulomb", 2)
    given["parameters"] = {"torque": {"value": 0.17, "std": 0.004, "interval": [0.15, 0.19]}}
    assert score.covered(COULOMB, given) == {"torque": True}
    withheld = named("coulomb", 2)
    withheld["parameters"] = {"torque": {"value": 0.17, "std": None}}
    assert score.covered(COULOMB, withheld) == {}
    of_a_size = effect("stribeck", 2, torque=0.2)
    of_a_size["parameters"]["torque"]["exact"] = False
    assert score.covered(of_a_size, named("stribeck", 2, torque=(0.1, 0.001))) == {}


CASES: list[tuple[dict[str, Any], dict[str, Any] | None]] = [
    (truth(family="null", strength=None, null="white"), answer()),
    (truth(family="null", strength=None, null="white"), answer(named("force_bias", channel="Fy"))),
    (truth(COULOMB), answer(named("coulomb", 2, torque=(0.161, 0.006)), gap={"Fy_N": {"calibrated": 2.0, "after": 1.05, "floor": 1.0}})),
    (truth(COULOMB, strength="medium"), answer(named("stribeck", 2))),
    (truth(effect("magnetic_detent", 1), family="outside", strength=None), answer(verdict="unexplained")),
    (truth(COULOMB), None),
]


@pytest.fixture
def scored(tmp_path: Path) -> Path:
    """A folder of sessions with answers, the last of which failed."""
    for k, (hidden, said) in enumerate(CASES, start=1):
        folder = tmp_path / f"s{k}"
        folder.mkdir()
        (folder / "truth.json").write_text(json.dumps(hidden), encoding="utf-8")
        if said is not None:
            (folder / "gap.json").write_text(json.dumps(said), encoding="utf-8")
        outcome = {"seconds": 10.0 * k, "error": None if said is not None else "status 2: no"}
        (folder / "outcome.json").write_text(json.dumps(outcome), encoding="utf-8")
    manifest = {"sessions": [{"folder": f"s{k}", "seed": k} for k in range(1, len(CASES) + 1)]}
    (tmp_path / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    return tmp_path


def test_tables(score: ModuleType, scored: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert score.main([str(scored), "--only-score"]) == 1
    printed = capsys.readouterr().out
    assert "| false alarms over nulls: ≤ 2 % | 50.0 % | **no** |" in printed
    # What failed was not named.
    assert "| strong effects named, nothing else: ≥ 95 % | 50.0 % | **no** |" in printed
    assert "| outside the catalogue “unexplained”: ≥ 85 % | 100.0 % | yes |" in printed
    assert "| gap closed by ≥ 90 % wherever the naming is right: ≥ 95 % | 100.0 % | yes |" in printed
    assert "| coulomb 2 | stribeck 2 | 1 | s4 |" in printed
    assert "| nothing | force_bias Fy | 1 | s2 |" in printed
    assert "| coulomb 2 | failed: status 2: no | 1 | s6 |" in printed
    assert "| coulomb | 50 % (1/2) | 0 % (0/1) |" in printed
    lines = [json.loads(line) for line in (scored / "scores.jsonl").read_text(encoding="utf-8").splitlines()]
    assert [line["session"] for line in lines] == ["s1", "s2", "s3", "s4", "s5", "s6"]


def test_only_what_has_no_answer_is_run(score: ModuleType, scored: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (scored / "s3" / "outcome.json").unlink()
    ran: list[str] = []

    def workflow(folder: Path, timeout: float) -> dict[str, Any]:
        ran.append(folder.name)
        return {"seconds": 1.0, "error": None}

    monkeypatch.setattr(score, "workflow", workflow)
    score.main([str(scored)])
    assert ran == ["s3"]


def test_a_command_that_fails_is_recorded(score: ModuleType, scored: Path) -> None:
    outcome = score.workflow(scored / "s1", 60.0)  # there is no data folder
    assert outcome["error"].startswith("status 2: ")
    assert not (scored / "s1" / "gap.json").exists()


def test_an_answer_in_another_form_is_an_error(score: ModuleType, scored: Path) -> None:
    (scored / "s3" / "gap.json").write_text('{"verdict": "explained"}', encoding="utf-8")
    assert "gap.json is not what it should be" in score.record(scored / "s3")["error"]


def test_a_folder_without_sessions_is_refused(score: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert score.main([str(tmp_path)]) == 2
    assert "manifest.json" in capsys.readouterr().err


def test_a_bias_is_counted_as_the_file_shows_it(score: ModuleType) -> None:
    bias = {"kind": "force_bias", "joint": None, "channel": "Fz", "parameters": {"bias": {"exact": True, "value": 0.5}}}
    truth = {"effects": [bias]}
    assert score.as_in_file(truth, "arm") is truth
    assert score.as_in_file(truth, "robot")["effects"][0]["parameters"]["bias"]["value"] == -0.5
    assert bias["parameters"]["bias"]["value"] == 0.5


def little_known(slip: str | None = None) -> dict[str, Any]:
    """A little-known arm: two springs and a viscosity, and perhaps a trial that slips."""
    effects = [
        effect("elastic", 1, stiffness=1.0, rest=-0.8),
        effect("elastic", 2, stiffness=0.5, rest=1.0),
        effect("viscous", 2, viscosity=0.1),
    ]
    return truth(*effects, family="little_known") | {"slip": None if slip is None else {"trial": slip}}


def test_names_are_counted_one_by_one(score: ModuleType) -> None:
    limits = [{"kind": "viscous", "joint": 2, "at_least": 0.06}, {"kind": "elastic", "joint": 2, "at_least": 0.2}]
    said = answer(named("elastic", 1), named("relaxation", 2)) | {"would_have_seen": limits}
    line = score.judge(little_known(), said)
    assert (line["names"]["decided_right"], line["names"]["decided"]) == (1, 2)
    assert line["names"]["found"] == ["elastic 1"]
    # The viscosity is less than twice what would have been seen; the spring that was not named is more.
    assert line["detectable"] == ["elastic 1", "elastic 2"]
    # Of a joint that is held nothing would have been seen.
    said["would_have_seen"] = [{"kind": "viscous", "joint": 2, "at_least": None}, {"kind": "elastic", "joint": 2, "at_least": None}]
    assert score.judge(little_known(), said)["detectable"] == ["elastic 1"]


def test_a_name_that_is_not_decided_asks_whether_the_true_one_is_stated(score: ModuleType) -> None:
    open_question = named("coulomb", 2, alternatives=[{"kind": "viscous", "joint": 2}]) | {"decided": False}
    counts = score.judge(little_known(), answer(named("elastic", 1), open_question))["names"]
    assert (counts["decided"], counts["decided_right"]) == (1, 1)
    assert (counts["undecided"], counts["undecided_stated"]) == (1, 1)
    assert counts["found"] == ["elastic 1", "viscous 2"]
    beside = score.judge(little_known(), answer(open_question | {"alternatives": []}))["names"]
    assert (beside["undecided"], beside["undecided_stated"], beside["found"]) == (1, 0, [])


def test_a_name_of_the_trial_that_slips_is_neither_right_nor_wrong(score: ModuleType) -> None:
    slipped = named("angle_offset", 1) | {"trial": "trials/fast_2.csv"}
    assert score.judge(little_known("trials/fast_2.csv"), answer(slipped))["names"]["decided"] == 0
    assert score.judge(little_known("trials/fast_1.csv"), answer(slipped))["names"]["decided"] == 1


def test_a_verdict_above_an_open_gap_is_counted(score: ModuleType) -> None:
    channels = {"q1_rad": {"calibrated": 3.0, "after": 1.6, "floor": 1.0}, "Fy_N": {"calibrated": 1.4, "after": None, "floor": 1.0}}
    assert score.left_open(answer(gap=channels)) == ["q1_rad"]
    line = {"session": "s1", "world": "rapier", "family": "little_known", "error": None, "hidden": ["elastic 1"], "seconds": 5.0}
    counted = score.counted([line | score.judge(little_known(), answer(verdict="explained", gap=channels))])
    assert counted["“explained” or “nothing missing” above an open gap"] == (1, 1)
    honest = line | score.judge(little_known(), answer(verdict="unexplained", gap=channels))
    assert score.counted([honest])["“explained” or “nothing missing” above an open gap"] == (0, 0)


def test_the_trend_keeps_every_night(score: ModuleType, scored: Path) -> None:
    score.main([str(scored), "--only-score"])
    for revision in ("a" * 40, "b" * 40):
        command = [sys.executable, str(SCRIPT.with_name("trend.py")), scored / "scores.jsonl", scored / "trend.csv", revision]
        printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    with (scored / "trend.csv").open(encoding="utf-8", newline="") as file:
        nights = list(csv.DictReader(file))
    assert [night["revision"] for night in nights] == ["a" * 10, "b" * 10]
    assert nights[1]["outside the catalogue “unexplained”: ≥ 85 %"] == "100.0 %"
    assert printed.count("\n") == 4 and all(name in printed for name in nights[0])
