"""The one line that a refusal is."""

from __future__ import annotations

from armrs.errors import BadInput, Text, nearest


def test_a_refusal_is_one_line_whatever_was_found() -> None:
    error = BadInput("a\nplace", "x\ny" * 100, "something\nelse", file="b\nad.toml")
    assert "\n" not in str(error)
    assert len(str(error)) < 250


def test_a_refusal_seen_from_outside_names_the_file_and_the_table() -> None:
    error = BadInput("mass", -1.0, "> 0").within(place="[[arm.segment]] 2").within(file="model.toml")
    assert str(error) == "model.toml: [[arm.segment]] 2, mass: found -1.0, allowed > 0"
    assert (error.file, error.found, error.allowed) == ("model.toml", -1.0, "> 0")


def test_the_file_named_first_stays() -> None:
    assert BadInput("x", Text("y"), "z", file="inner").within(file="outer").file == "outer"


def test_the_nearest_name_is_one_that_is_near() -> None:
    assert nearest("FY_N", ["Fy_N", "Fz_N", "t_s"]) == "Fy_N"
    assert nearest("coulom", ["viscous", "coulomb"]) == "coulomb"
    assert nearest("zzzzzz", ["mass", "com"]) is None
    assert nearest("mass", []) is None
