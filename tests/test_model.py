"""Models: what is accepted, what is refused and in which words, and that writing loses nothing."""

from __future__ import annotations

import copy
import pickle
import re
from pathlib import Path

import pytest

import armrs
from armrs import BadInput, Subject, Tolerance, catalogue
from armrs.model import AddedMass, Description, ParameterId, TrialEntry
from conftest import MODEL


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "model.toml"
    file.write_text(MODEL, encoding="utf-8")
    return file


def refusal(path: Path) -> str:
    with pytest.raises(BadInput) as caught:
        armrs.load_model(path)
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith(f"{path}: ")
    assert caught.value.file == str(path)
    return text.removeprefix(f"{path}: ")


def test_reads_every_key(path: Path) -> None:
    model = armrs.load_model(path)
    assert model.segments[0] == armrs.Segment("upper arm", 0.322, 2.114, 0.186, 0.0165)
    assert model.segments[1].com_normal == 0.0
    assert model.joints == (armrs.Joint("shoulder", 1.2, -0.785, 0.25, 0.0), armrs.Joint("elbow"))
    assert (model.gravity, model.base, model.segment_uncertainty) == (9.81, (0.0, 0.0), 0.05)
    assert model.robot == armrs.Robot((0.45, 0.45), (1.05, -0.10), "up")
    assert model.contact == armrs.Contact((1e4, 1e4), (25.0, 25.0))
    (effect,) = model.effects
    assert (effect.kind, effect.joint, effect.channel, effect.parameters["torque"]) == ("coulomb", 2, None, 0.161)


def test_needs_only_segments_and_joints(path: Path) -> None:
    path.write_text("[arm]\n[[arm.segment]]\nlength = 1\nmass = 1\ncom = 0.5\ninertia = 0\n[[arm.joint]]\n", encoding="utf-8")
    model = armrs.load_model(path)
    assert model == armrs.Model([armrs.Segment("segment 1", 1.0, 1.0, 0.5, 0.0)], [armrs.Joint("joint 1")])
    assert (model.robot, model.contact, model.effects) == (None, None, ())


# What is broken: text in the accepted model, its replacement, and the message.
BROKEN = {
    "unknown key": ("mass = 2.114", "mas = 2.114", "[[arm.segment]] 1: found unknown key 'mas'", "(nearest known: mass)"),
    "unknown table": ("[contact]", "[contakt]", "found unknown key 'contakt'", "(nearest known: contact)"),
    "missing key": ("mass = 2.114\n", "", "`mass` is missing in [[arm.segment]] 1", ""),
    "mass zero": ("mass = 2.114", "mass = 0.0", "[[arm.segment]] 1, mass: found 0.0, allowed a finite number > 0 kg", ""),
    "mass negative": ("mass = 2.114", "mass = -1", "[[arm.segment]] 1, mass: found -1.0, allowed a finite number > 0 kg", ""),
    "mass infinite": ("mass = 2.114", "mass = inf", "mass: found inf, allowed a finite number > 0 kg", ""),
    "mass not a number": ("mass = 2.114", "mass = nan", "mass: found nan, allowed a finite number > 0 kg", ""),
    "mass as text": ("mass = 2.114", 'mass = "2.114"', "mass: found '2.114', allowed a finite number > 0 kg", ""),
    "mass as truth value": ("mass = 2.114", "mass = true", "mass: found true, allowed a finite number > 0 kg", ""),
    "mass beyond floats": ("mass = 2.114", f"mass = 1{'0' * 400}", "mass: found 1000", "allowed a finite number > 0 kg"),
    "length in millimetres": ("length = 0.322", "length = 322", "length: found 322.0, allowed", "(millimetres?)"),
    "com beyond the length": ("com = 0.186", "com = 0.4", "[[arm.segment]] 1, com: found 0.4, allowed a finite number 0 to 0.322 m", ""),
    "com negative": ("com = 0.186", "com = -0.1", "com: found -0.1, allowed a finite number 0 to 0.322 m", ""),
    "inertia negative": ("inertia = 0.0165", "inertia = -0.1", "inertia: found -0.1, allowed a finite number >= 0 kg m²", ""),
    "empty name": ('"upper arm"', '""', "name: found '', allowed a text on one line", ""),
    "one joint too few": ('[[arm.joint]]\nname = "elbow"\n', "", "[[arm.joint]]: found 1 joints, allowed one a segment, so 2", ""),
    "negative stiffness": (
        "stiffness = 1.2",
        "stiffness = -1.2",
        "[[arm.joint]] 1, stiffness: found -1.2, allowed",
        "a finite number 0 to 1000 N m/rad",
    ),
    "friction beyond the catalogue": ("coulomb = 0.0", "coulomb = 150", "[[arm.joint]] 1, coulomb: found 150.0, allowed", "0 to 100 N m"),
    "uncertain joints in percent": (
        "uncertainty = 0.05",
        "uncertainty = 0.05\njoint_uncertainty = 5",
        "[arm], joint_uncertainty: found 5.0, allowed a finite number 0 to 1",
        "0.05",
    ),
    "rest in degrees": ("rest = -0.785", "rest = -145", "rest: found -145.0, allowed", "(degrees?)"),
    "three numbers for two": ("base = [0.0, 0.0]", "base = [0.0, 0.0, 0.0]", "[arm], base: found [0.0, 0.0, 0.0]", "two numbers, not 3"),
    "one number for two": ("base = [0.0, 0.0]", "base = 0.0", "[arm], base: found 0.0, allowed two numbers", ""),
    "uncertainty in percent": (
        "uncertainty = 0.05",
        "uncertainty = 5",
        "segment_uncertainty: found 5.0, allowed a finite number 0 to 1",
        "0.05",
    ),
    "elbow": ('elbow = "up"', 'elbow = "left"', '[robot], elbow: found \'left\', allowed "up" or "down"', ""),
    "robot link": ("lengths = [0.45, 0.45]", "lengths = [0.45, 0]", "[robot], lengths[1]: found 0.0, allowed a finite number > 0", ""),
    "contact stiffness": ("stiffness = [10000.0, 10000.0]", "stiffness = [0, 1]", "[contact], stiffness[0]: found 0.0, allowed", "> 0 N/m"),
    "contact missing": ("stiffness = [10000.0, 10000.0]\n", "", "`stiffness` is missing in [contact]", ""),
    "table for a list": ("[[effect]]", "[effect]", "effect: found one table, allowed a list of tables, written [[effect]]", ""),
    "value for a table": ("[robot]", "[arm.robot]", "[arm]: found unknown key 'robot'", ""),
    "joint beyond the arm": ("joint = 2", "joint = 3", "[[effect]] 1 (coulomb), joint: found 3, allowed 1 to 2", ""),
    "joint zero": ("joint = 2", "joint = 0", "[[effect]] 1 (coulomb), joint: found 0, allowed a whole number >= 1", ""),
    "joint as float": ("joint = 2", "joint = 2.0", "[[effect]] 1 (coulomb), joint: found 2.0, allowed a whole number", ""),
    "effect without kind": ('kind = "coulomb"\n', "", "`kind` is missing in [[effect]] 1", ""),
    "unknown kind": (
        '"coulomb"',
        '"coulom"',
        "[[effect]] 1 (coulom), kind: found unknown kind of effect 'coulom'",
        "(nearest known: coulomb)",
    ),
    "kind as number": ('"coulomb"', "1", "[[effect]] 1, kind: found 1, allowed a text on one line", ""),
    "unknown parameter": ("torque = 0.161", "torqe = 0.161", "(coulomb): found unknown key 'torqe'", "(nearest known: torque)"),
    "parameter out of bounds": ("torque = 0.161", "torque = -1.0", "(coulomb), torque: found -1.0, allowed a finite number 0 to", "N m"),
    "joint missing": ("joint = 2\n", "", "[[effect]] 1 (coulomb), joint: found nothing, allowed the number of the joint", ""),
    "channel at a joint effect": ("joint = 2", 'joint = 2\nchannel = "Fy"', "(coulomb), channel: found 'Fy', allowed no key channel", ""),
    "unknown channel": ("joint = 2", 'channel = "Fx"', '(coulomb), channel: found \'Fx\', allowed "Fy" or "Fz" or "Mx"', ""),
    "duplicate key": ("mass = 2.114", "mass = 2.114\nmass = 2.0", "line 10, column", "allowed TOML"),
    "not TOML": ("mass = 2.114", "mass = = 2", "line 9, column 8: found ", "allowed TOML"),
    "key over two lines": ("mass = 2.114", '"ma\\nss" = 2.114', "unknown key 'ma\\nss'", ""),
}


@pytest.mark.parametrize("name", BROKEN)
def test_refuses(path: Path, name: str) -> None:
    old, new, start, end = BROKEN[name]
    assert MODEL.count(old) == 1
    path.write_text(MODEL.replace(old, new), encoding="utf-8")
    text = refusal(path)
    assert start in text
    assert end in text


def test_refuses_a_file_without_an_arm(path: Path) -> None:
    path.write_text("", encoding="utf-8")
    assert refusal(path) == "`arm` is missing"


def test_refuses_a_value_for_a_table(path: Path) -> None:
    path.write_text("arm = 3\n", encoding="utf-8")
    assert refusal(path) == "[arm]: found 3, allowed a table"


def test_refuses_no_segments(path: Path) -> None:
    path.write_text("[arm]\nsegment = []\n", encoding="utf-8")
    assert refusal(path) == "[[arm.segment]]: found 0 segments, allowed 1 to 6 segments"


def test_refuses_text_that_is_not_utf8(path: Path) -> None:
    path.write_bytes(b"[arm]\ngravity = 9.81 # \xb5\n")
    assert refusal(path) == "line 2: found byte 0xb5, allowed UTF-8 text (Latin-1 or Windows-1252 text? Save it as UTF-8)"


def test_refuses_a_file_that_is_not_there(tmp_path: Path) -> None:
    assert refusal(tmp_path / "none.toml") == "no such file"


def test_refuses_a_folder(tmp_path: Path) -> None:
    assert refusal(tmp_path) == "file: found a folder, allowed a TOML file"


def test_accepts_a_byte_order_mark_and_windows_line_ends(path: Path) -> None:
    plain = armrs.load_model(path)
    path.write_bytes(b"\xef\xbb\xbf" + MODEL.replace("\n", "\r\n").encode())
    assert armrs.load_model(path) == plain


def test_writing_loses_nothing(path: Path, tmp_path: Path) -> None:
    model = armrs.load_model(path)
    hard = 0.1 + 0.2  # needs 17 digits
    model = model.replace(
        gravity=hard,
        segments=[armrs.Segment('a "quoted" \\ näme', 5e-324, 1e-300, 0.0, hard, 5e-324), model.segments[1]],
        effects=[armrs.Effect("coulomb", 1, None, {"torque": hard}), armrs.Effect("force_bias", channel="Fz")],
    )
    again = tmp_path / "again.toml"
    model.write(again)
    assert armrs.load_model(again) == model
    first = again.read_bytes()
    armrs.load_model(again).write(again)
    assert again.read_bytes() == first


def test_writing_leaves_no_other_file(path: Path) -> None:
    armrs.load_model(path).write(path)
    assert [p.name for p in path.parent.iterdir()] == ["model.toml"]


def test_does_not_replace_a_file_of_another_kind(path: Path, tmp_path: Path) -> None:
    other = tmp_path / "thesis.docx"
    other.write_text("precious", encoding="utf-8")
    with pytest.raises(BadInput, match=re.escape("found an existing file with suffix '.docx', allowed a new file, or a .toml file")):
        armrs.load_model(path).write(other)
    assert other.read_text(encoding="utf-8") == "precious"


def test_values_given_in_python_are_checked_too() -> None:
    with pytest.raises(BadInput, match=r"^mass: found -1.0, allowed a finite number > 0 kg$"):
        armrs.Segment("s", length=1.0, mass=-1.0, com=0.5, inertia=0.0)
    with pytest.raises(ValueError, match="gravity"):
        armrs.Model([armrs.Segment("s", 1.0, 1.0, 0.5, 0.0)], [armrs.Joint("j")], gravity=float("nan"))


def test_replace_checks_and_names_what_it_does_not_know(path: Path) -> None:
    model = armrs.load_model(path)
    assert model.replace(gravity=0.0).gravity == 0.0
    assert model.gravity == 9.81
    with pytest.raises(BadInput, match="nearest known: gravity"):
        model.replace(gravitty=1.0)
    with pytest.raises(BadInput, match=r"\[arm\], gravity: found -1.0"):
        model.replace(gravity=-1.0)


def test_values_can_be_hashed_pickled_and_copied(path: Path) -> None:
    model = armrs.load_model(path).replace(joint_uncertainty=0.1)
    entry = TrialEntry("a.csv", "slow", 1, "fit")
    worn = AddedMass(2, 0.2, 0.1, ("slow",))
    person = Subject(name="S1", height=1.8, sex="female")
    data = Description("S1", "model.toml", [entry], subject=person, tolerance=Tolerance(force_gain=0.1), added=[worn], sample_rate=50.0)
    parts = (*model.segments, *model.joints, model.robot, model.contact, *model.effects)
    for value in (model, *parts, entry, worn, person, data, data.tolerance, ParameterId("segment[1].mass")):
        for twin in (pickle.loads(pickle.dumps(value)), copy.deepcopy(value), copy.copy(value)):
            assert twin == value
            assert type(twin) is type(value)
            assert hash(twin) == hash(value)
        if not isinstance(value, ParameterId):
            assert value.replace() == value
            assert type(value).from_dict(value.to_dict()) == value
        with pytest.raises(AttributeError):
            value.name = "other"
        assert value != 3
    assert model.joint_uncertainty == 0.1
    assert len({*model.segments, *armrs.load_model(path).segments}) == 2
    assert "mass=2.114 kg" in repr(model.segments[0])
    assert "joint=2, parameters={'torque': 0.161" in repr(model.effects[0])


def test_a_parameter_has_one_identity(path: Path) -> None:
    model = armrs.load_model(path)
    friction = ParameterId("joint[2].coulomb.torque")
    assert (friction.object, friction.kind, friction.name, str(friction)) == ("joint[2]", "coulomb", "torque", "joint[2].coulomb.torque")
    assert model.value(friction) == model.value("joint[2].coulomb.torque") == 0.161
    info = {p.id: p for p in model.parameters}[friction]
    assert (info.value, info.unit, info.min, info.max) == (0.161, "N m", 0.0, 100.0)
    assert all(model.with_value(p.id, p.value) == model for p in model.parameters)
    # The same friction, stated by the joint.
    stated = model.replace(effects=(), joints=(model.joints[0], model.joints[1].replace(coulomb=0.161)))
    assert stated.value(friction) == 0.161
    assert stated.all_effects == model.all_effects
    assert stated.with_value(friction, 0.3).joints[1].coulomb == 0.3
    with pytest.raises(BadInput, match=r"\[\[arm.joint\]\] 2, coulomb: found 150.0, allowed a finite number 0 to 100 N m"):
        stated.with_value(friction, 150)
    with pytest.raises(BadInput, match="nearest known: coulomb"):
        model.value("joint[2].coulom.torque")
    for wrong in (3, None, b"x", object()):
        with pytest.raises(BadInput, match="allowed a ParameterId, or its text"):
            model.value(wrong)


def bombs() -> dict[str, str]:
    """Return small documents that cost a careless reader all its stack or time."""
    return {
        "nested arrays": "a = " + "[" * 100_000 + "]" * 100_000,
        "nested tables": "a = " + "{b = " * 50_000 + "1" + "}" * 50_000,
        "a dotted key": "a." * 100_000 + "x = 1",
        "digits": MODEL.replace("mass = 2.114", "mass = " + "9" * 5000),
        "a key": "k" * 1_000_000 + " = 1\n" + MODEL,
    }


@pytest.mark.parametrize("name", bombs())
def test_bombs_are_refused_on_one_short_line(path: Path, name: str) -> None:
    path.write_text(bombs()[name], encoding="utf-8")
    assert len(refusal(path)) < 300


def test_the_catalogue_has_sound_defaults() -> None:
    # Other tests declare kinds of their own in the same process.
    kinds = [kind for kind in catalogue.catalogue().values() if not kind.own]
    assert len(kinds) == 38
    for kind in kinds:
        assert kind.address in ("joint", "channel", None)
        for p in kind.parameters:
            assert p.min <= p.default <= p.max, (kind.kind, p.name)
            assert p.unit.strip() == p.unit
