"""Text exports of Delsys (EMGworks, Trigno Discover): refused, since each channel has a clock of its own and none of them shows the arm."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...errors import BadInput, Text
from .table import RawTable


def recognises(lines: Sequence[str]) -> bool:
    """Whether a text begins as EMGworks or Trigno Discover writes it."""
    head = lines[:12]
    return any(line.lstrip('"').startswith("X[s]") for line in head) or any("Trigno Discover" in line for line in head[:3])


def read(path: Path, lines: Sequence[str]) -> RawTable:
    """Refuse the file, with what to do.

    Raises
    ------
    BadInput
        Always. Without the file's name in it.
    """
    found = Text("an export of Delsys: muscle activity on clocks of its own, without the movement")
    allowed = "EMG in the recording of the angles"
    hint = "record it with the motion capture (C3D, Vicon), or add columns emg_NAME to the table of angles, on their clock"
    raise BadInput("file", found, allowed, hint=hint)
