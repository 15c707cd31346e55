"""Export of an arm as an FMU: description, library, documentation and the arm itself. The same arm gives the same bytes."""

from __future__ import annotations

import html
import os
import zipfile
from collections.abc import Iterable
from importlib import resources
from pathlib import Path

from .. import _armrs, checks
from ..fmu.bundled_libraries import collected
from ..fmu.slave_interface import Variable
from ..io import files
from ..model import Model
from .slave import Slave

IDENTIFIER = "ArmRs"
"""Name of the library inside an FMU."""
_ARM = "resources/arm.json"
"""The arm in an FMU of armrs."""
_MOMENT = (1980, 1, 1, 0, 0, 0)
"""The earliest time an archive can hold: files in an FMU carry no date of their making."""
_SPDX = b"SPDX-License-Identifier: MIT OR Apache-2.0\n"
_HEAD = ("name", "what it is", "unit", "causality", "variability", "start")


def export_fmu(
    model: Model | str | os.PathLike[str] | Slave,
    path: str | os.PathLike[str],
    *,
    fmi: int = 3,
    port: str = "force",
    start: Iterable[float] | None = None,
    rest: bool = False,
    name: str | None = None,
    libraries: str | os.PathLike[str] | None = None,
    replace: bool = False,
) -> Path:
    """Write an arm as a functional mock-up unit for co-simulation.

    Parameters
    ----------
    model : Model, path or Slave
        The arm; with a slave, its port, start and inner step.
    path : path
        The FMU to write; it ends in `.fmu`.
    fmi : {3, 2}
        Version of the standard.
    port : {"force", "motion"}
        Force on the arm in and motion of the handle out, or motion of the robot's handle in and contact force out.
    start : array_like, shape (n_joints,), optional
        Joint angles at the start [rad].
    rest : bool
        Start in equilibrium near these angles.
    name : str, optional
        Name of the model in the description; that of the file when absent.
    libraries : path, optional
        Libraries for several machines, see `armrs.fmu.bundled_libraries`; that of this machine alone when absent.
    replace : bool
        Whether an FMU of another tool may be replaced; one of armrs always is.

    Returns
    -------
    Path

    Raises
    ------
    BadInput
        For an arm, a name or a library that cannot be used; nothing is written.
    """
    target = checks.path("path", path)
    checks.text("path", target.stem)
    files.may_replace(target, ".fmu")
    if not checks.flag("replace", replace):
        files.may_replace_archive(target, ".fmu", _ARM)
    fmi = checks.whole("fmi", fmi, least=2, most=3)
    if not isinstance(model, Slave):
        model = Slave(model, port=port, start=start, rest=rest, name=target.stem if name is None else name)
    content = contents(model, fmi, libraries)
    with files.replacing(target) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as packed:
        for inside, data in content.items():
            info = zipfile.ZipInfo(inside, _MOMENT)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = 3
            info.external_attr = 0o644 << 16
            packed.writestr(info, data, compresslevel=9)
    return target


def contents(slave: Slave, fmi: int, libraries: str | os.PathLike[str] | None = None) -> dict[str, bytes]:
    """Return the files of an FMU, its description first."""
    # The licence is that of armrs and of everything that is compiled into the library.
    binaries, licence, _ = collected(fmi, libraries)
    description, terminals = slave.compiled.description(fmi)
    icon = resources.files("armrs.fmu").joinpath("icon.png").read_bytes()
    page = documentation(slave)
    listed = {
        "modelDescription.xml": description.encode(),
        **{f"binaries/{place}/{IDENTIFIER}{suffix}": content for (place, suffix), content in binaries.items()},
        _ARM: slave.compiled.json.encode(),
    }
    if terminals is None:
        listed |= {
            "documentation/index.html": page.encode(),
            "documentation/licenses/license.txt": licence,
            "model.png": icon,
        }
    else:
        listed |= {
            "documentation/index.html": page.encode(),
            "documentation/licenses/license.spdx": _SPDX,
            "documentation/licenses/license.txt": licence,
            "terminalsAndIcons/terminalsAndIcons.xml": terminals.encode(),
            "terminalsAndIcons/icon.png": icon,
        }
    return listed


def rows(variables: Iterable[Variable]) -> list[tuple[str, ...]]:
    """Return the table of variables as texts, for documentation."""
    return [(v.name, v.description, v.unit or "", v.causality, v.variability, "" if v.start is None else repr(v.start)) for v in variables]


def documentation(slave: Slave) -> str:
    """Return the HTML page that travels in an FMU."""
    cells = ["".join(f"<td>{html.escape(cell)}</td>" for cell in row) for row in rows(slave.variables.values())]
    table = "\n".join(f"<tr>{row}</tr>" for row in ["".join(f"<th>{name}</th>" for name in _HEAD), *cells])
    ports = {
        "force": "Set <code>handle.F</code>, the force on the arm, before each step; read <code>handle.r</code> and <code>handle.v</code>.",
        "motion": "Set <code>robot.r</code> and <code>robot.v</code> before each step; between communication points the handle goes on "
        "along a straight line. Read <code>contact.F</code>, the force on the robot. Spring and damper are inside.",
    }
    return f"""<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>{html.escape(slave.name)}</title></head>
<body>
<h1>{html.escape(slave.name)}</h1>
<p>A planar arm of {slave.model.n_joints} joints as a co-simulation slave, made by armrs {_armrs.__version__}.</p>
<p>{ports[slave.port]}</p>
<p>y forward, z up, counter-clockwise positive; every force is named by what it acts on. The inner step is fixed,
{slave.internal_step:g} s; communication steps may be any length, and states can be kept, gone back to and written as bytes.
The values of this arm are in <code>resources/arm.json</code> and protected by the token of the description: edit neither.</p>
<table>
{table}
</table>
<p>License: MIT or Apache-2.0.</p>
</body>
</html>
"""
