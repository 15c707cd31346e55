"""The gap workflow's part of a report: what an engineer wants to know, in the order in which it is asked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...report import words as common
from ...report.pages import bullets, heading, paragraph, table
from . import words
from .headline import effect_name

_SECTIONS = ("gap", "effects", "where", "evidence")


def sections(data: Mapping[str, Any], figures: Mapping[str, str]) -> str:
    """Return the sections of a result; `figures` are those of each section, ready to stand in a page."""
    drawn = {name: figures.get(name, "") for name in _SECTIONS}
    return "".join(
        (
            _care(data),
            _missing(data, drawn["effects"]),
            _gap(data, drawn["gap"]),
            _where(data, drawn["where"]),
            _evidence(data, drawn["evidence"]),
            _left(data),
            _ruled_out(data),
            _calibration(data),
            heading("Data set") + bullets(common.data_lines(data["data"])),
        )
    )


def _care(data: Mapping[str, Any]) -> str:
    if not data["warnings"]:
        return ""
    return f'<div class="care">{heading("Take care")}{bullets(data["warnings"])}</div>\n'


def _missing(data: Mapping[str, Any], drawn: str) -> str:
    if not data["effects"]:
        return ""
    joints = data["data"]["joints"]
    out = heading("What the model lacks")
    out += bullets(
        f"{effect_name(e, joints)}: {e['summary']}. {e['formula']}. {words.size(e)}; by chance {words.chance(e)}." for e in data["effects"]
    )
    out += table(words.missing(data))
    out += paragraph(
        "The share is what would be lost of all that is explained if this one effect were left out and everything else refitted. "
        "An interval holds if the structure of the model is right.",
        "soft",
    )
    if data["verdict"] == "unexplained":
        out += paragraph(
            "Here it is not right: something is left that no effect explains. Intervals were widened by what is left, and may still be too "
            "narrow.",
            "soft",
        )
    lines = words.others(data)
    if lines:
        out += heading("What it may be instead") + bullets(lines)
        out += paragraph(
            "These explain the data within 10 units of twice the log-likelihood as well: on these movements they cannot be told apart.",
            "soft",
        )
    lines = words.apart(data)
    if lines:
        out += heading("What was set apart") + bullets(lines)
    return out + (heading("Each effect by itself") + drawn if drawn else "")


def _gap(data: Mapping[str, Any], drawn: str) -> str:
    content = words.gap(data)
    if not content.rows:
        return heading("The gap") + paragraph("There is no test trial, so that the gap cannot be measured on data that were kept apart.")
    led = any(name.endswith("_N") for name in data["gap"])
    own = "Of these trials nothing was fitted but where the handle is in each, and the phase of a rhythm." if led else ""
    return heading("The gap on trials that were kept apart") + table(content) + (paragraph(own, "soft") if own else "") + drawn


def _where(data: Mapping[str, Any], drawn: str) -> str:
    content = words.where(data)
    if not content.rows and not drawn:
        return ""
    out = heading("Where model and data disagree") + drawn
    if content.rows:
        out += paragraph("The clearest places, with the calibrated model: mean of the missing torque, and how sure its sign is.", "soft")
        out += table(content)
    return out


def _evidence(data: Mapping[str, Any], drawn: str) -> str:
    return heading("Evidence") + drawn if drawn else ""


def _left(data: Mapping[str, Any]) -> str:
    return heading("What is left") + bullets(words.left(data))


def _ruled_out(data: Mapping[str, Any]) -> str:
    content = words.limits(data)
    if not content.rows:
        return ""
    out = heading("What was ruled out")
    out += paragraph(
        "Everything else in the catalogue was asked for as well. These are the smallest sizes that would have been named on these data, "
        "with segments and calibration refitted: an effect larger than that is not there, or looks like one that was named. Many of these "
        "limits are what the calibration sheet and the uncertainty of the segments leave open, not noise.",
        "soft",
    )
    out += table(content)
    near = words.nearest(data)
    if near.rows:
        out += paragraph(
            "What came nearest to being named, in units of twice the log-likelihood. One that would explain more than it would have to and "
            "was not named explains no more than the laws of the named ones may miss, or less than a fifth of what is left:",
            "soft",
        )
        out += table(near)
    return out


def _calibration(data: Mapping[str, Any]) -> str:
    content = words.calibration(data)
    if not content.rows:
        return ""
    out = heading("Absorbed by the calibration")
    out += paragraph("Small imperfections that were refitted with every question, beside what the data set promises of them.", "soft")
    return out + table(content)
