"""The one line that a refusal is."""

from __future__ import annotations

from armrs.errors import NO_FILE, WRITABLE, BadInput, Sentence, Text, nearest, unreadable


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


def test_what_is_missing_is_said_in_a_sentence() -> None:
    """It was `found nothing, allowed key configuration is required`."""
    key = BadInput("[[trial]] 2, configuration", Text("nothing"), "key configuration is required", file="dataset.toml", kind="missing_key")
    assert str(key) == "dataset.toml: `configuration` is missing in [[trial]] 2: the name of the movement, shared by its repeats"
    of_file = BadInput("arm", Text("nothing"), "key arm is required", file="model.toml", kind="missing_key")
    assert str(of_file) == "model.toml: `arm` is missing"


def test_a_file_that_is_missing_has_one_message() -> None:
    """It was `file: found No such file or directory, allowed a TOML file that can be read`."""
    system = Text("No such file or directory")
    assert str(unreadable(FileNotFoundError(2, "No such file or directory"), "a TOML file", file="a.toml")) == "a.toml: no such file"
    entry = BadInput(
        "[[trial]] 1 of dataset.toml, file", NO_FILE, "a file that exists", file="a.csv", hint="nearest: b.csv", kind="missing_file"
    )
    assert str(entry) == "a.csv: [[trial]] 1 of dataset.toml: no such file (nearest: b.csv)"
    # What is allowed is said where it says more.
    source = BadInput("file", system, "a folder with dataset.toml", file="a", kind="missing_source")
    assert str(source) == "a: no such file, allowed a folder with dataset.toml"
    assert str(BadInput("file", system, WRITABLE, file="a")) == f"a: file: found {system}, allowed {WRITABLE}"


def test_a_sentence_is_printed_without_found_and_allowed() -> None:
    taken = BadInput("file", Sentence("this folder holds a report of armrs gap"), "choose another -o", file="out/report.html")
    assert str(taken) == "out/report.html: this folder holds a report of armrs gap; choose another -o"
