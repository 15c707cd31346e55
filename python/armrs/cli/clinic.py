"""The verbs `spasticity` and `cohort`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..report import console
from .analysis import HistoryFile, SessionDate, day_of, kept
from .common import JsonFile, MaybeFolder, Source, command_line, present, quoted, writable


def spasticity(
    context: typer.Context,
    dataset: Source,
    out: MaybeFolder = None,
    cutoff_hz: Annotated[
        float, typer.Option(help="Cutoff of the low-pass of angles and forces [Hz]; at most 0.4 of the sample rate.")
    ] = 4.0,
    history: HistoryFile = None,
    date: SessionDate = None,
    json: JsonFile = None,
) -> int:
    """Find the stretch reflex of joints that were stretched at several speeds: threshold, gain and latency with intervals.

    Also reports peak moment and work against speed, the catch, and the onset of recorded muscle activity; elastic, viscous and dry
    resistance are separated from the reflex. armrs plan --spasticity proposes the stretches.

    Exit status 1 when no joint shows a reflex.
    """
    from ..io.dataset import load_dataset
    from ..report import clinic_sentences
    from ..report.clinic_figures import spasticity_data, write_spasticity
    from ..workflows.spasticity import spasticity as find_reflexes

    folder = writable(out, json, verb="spasticity")
    data = load_dataset(dataset)
    day = day_of(data, history, date)
    with console.stages("reflexes") as tell:
        result = find_reflexes(data, cutoff=cutoff_hz, progress=tell)
    plain = spasticity_data(result, command_line(context))
    with kept(history, result, day, plain):
        written = write_spasticity(result, plain, folder) if folder else []
        console.warn([*data.warnings, *result.warnings])
        present(lambda: plain, json, lambda: clinic_sentences.show(plain, written))
    return 0 if any(j.reflex.found for j in result.joints) else 1


def cohort(
    context: typer.Context,
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SOURCE", help="Folder with results (JSON of identify, passive, gap, spasticity) or data sets, or a table (CSV)."
        ),
    ],
    out: MaybeFolder = None,
    groups: Annotated[
        Path | None, typer.Option(metavar="FILE", help="CSV with columns subject, group and side of the sessions of a folder.")
    ] = None,
    json: JsonFile = None,
) -> int:
    """Summarise many subjects: mean, scatter between and within subjects, groups and sides compared, norm bands with their uncertainty.

    A table has the columns subject, quantity, value, and optionally unit, std, group, side (left or right), date. Cells are between commas,
    semicolons, tabs or bars. For data sets in a folder, passive moments are computed. Below -o, cohort.csv is the tidy table, one value per
    row, and norms.toml has the norm bands for armrs report --summary --norms, one file for each group.

    Exit status 1 when something was left out.
    """
    from ..report import clinic_sentences
    from ..report.clinic_figures import cohort_data, write_cohort
    from ..report.clinic_norms import in_other_units
    from ..workflows.cohort import cohort as summarise

    folder = writable(out, json, verb="cohort")
    with console.stages("cohort") as tell:
        result = summarise(source, groups=groups, progress=tell)
    plain = cohort_data(result, command_line(context))
    written = write_cohort(result, plain, folder) if folder else []
    warnings = [*result.warnings, *in_other_units(result)]
    console.warn(warnings)
    norms = next((path for path in written if path.name.startswith("norms")), None)
    step = (
        None
        if norms is None
        else f"armrs report RESULT.json --summary --norms {quoted(norms)} -o clinic compares one session with these bands"
    )
    present(lambda: plain, json, lambda: clinic_sentences.show_cohort(plain, written), step)
    return 1 if warnings else 0
