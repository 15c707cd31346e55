"""The result of the gap workflow: that of the core, with its data set."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from ... import _armrs
from ..._armrs import Absorbed, ChannelGap, GapResult, Limit, Missing, Place, SearchStep, SimulatedTrial
from ...io.dataset import Dataset
from ...model import Model
from ...tabular import Labelled, Series, Tabular, Tidy, over_trials
from ..identify import Estimate


@dataclass(frozen=True, eq=False)
class GapFound(Tabular, Series):
    """The result of the gap workflow.

    Attributes
    ----------
    result : GapResult
        What the core found: everything below, and every trial as it was measured and simulated.
    dataset : Dataset
        What it was found in.
    verdict : {"explained", "nothing_missing", "unexplained"}
    effects : tuple of Missing
        What the model lacks, that which explains most first.
    where : tuple of Place
        Where the calibrated model and the fit trials disagree, the clearest first.
    gap : mapping of str to ChannelGap
        By channel, on the test trials.
    would_have_seen : tuple of Limit
    unexplained : float
        Share of what the calibrated model left beyond noise that is still there.
    looks_like : str or None
        Shape of what is left.
    absorbed : tuple of Absorbed
    lack : ((float, float), (float, float))
        Lack of fit, ratio and z, of the calibrated and of the amended model; NaN without repeats.
    search_trace : tuple of SearchStep
        Rounds of the search.
    warnings : tuple of str
    model : Model
        The model with the named effects, everything refitted.
    """

    result: GapResult = field(repr=False)
    dataset: Dataset

    method: ClassVar[str] = "gap"
    level: ClassVar[float] = 0.95

    @property
    def verdict(self) -> str:
        """What the search came to."""
        return self.result.verdict

    @cached_property
    def effects(self) -> tuple[Missing, ...]:
        """What the model lacks, that which explains most first."""
        return self.result.effects

    @cached_property
    def where(self) -> tuple[Place, ...]:
        """Where the calibrated model and the fit trials disagree, the clearest first."""
        return self.result.places

    @cached_property
    def gap(self) -> Mapping[str, ChannelGap]:
        """The gap by channel, on the test trials."""
        return self.result.gap

    @cached_property
    def would_have_seen(self) -> tuple[Limit, ...]:
        """What was tested and not named."""
        return self.result.would_have_seen

    @property
    def unexplained(self) -> float:
        """Share of what the calibrated model left beyond noise that is still there."""
        return self.result.unexplained

    @property
    def looks_like(self) -> str | None:
        """Shape of what is left."""
        return self.result.looks_like

    @cached_property
    def absorbed(self) -> tuple[Absorbed, ...]:
        """Small imperfections that were refitted."""
        return self.result.absorbed

    @property
    def lack(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Lack of fit, ratio and z, of the calibrated and of the amended model; NaN without repeats."""
        return self.result.lack

    @cached_property
    def search_trace(self) -> tuple[SearchStep, ...]:
        """Rounds of the search."""
        return self.result.search_trace

    @property
    def warnings(self) -> tuple[str, ...]:
        """Remarks on the data."""
        return self.result.warnings

    @cached_property
    def model(self) -> Model:
        """The model with the named effects, everything refitted."""
        return self.result.model

    @cached_property
    def trials(self) -> tuple[SimulatedTrial, ...]:
        """Every trial of the data set, as it was measured and simulated."""
        return self.result.trials

    def __repr__(self) -> str:
        named = ", ".join(f"{e.kind}{'' if e.joint is None else f' in joint {e.joint}'}" for e in self.effects) or "no effect named"
        complete = ((name, g.before, g.after, g.floor) for name, g in self.gap.items())
        shown = (
            f"{name} {before:.3g} → {after:.3g} (floor {floor:.3g})"
            for name, before, after, floor in complete
            if before is not None and after is not None and floor is not None
        )
        return f"GapFound({self.dataset.name!r}: {self.verdict}; {named}; gap on test trials: {', '.join(shown) or 'not measured'})"

    def followed(self) -> tuple[Estimate, ...]:
        """Return what a history keeps: the fitted parameters of the effects that are in all trials and were decided."""
        lasting = [e for e in self.effects if e.decided and e.trial is None]
        return tuple(
            Estimate(f"{name} of {e.channel}" if e.channel else name, e.joint, e.kind, v.value, v.std, v.unit, v.interval, "data")
            for e in lasting
            for name, v in e.parameters.items()
            if v.std is not None and v.interval is not None
        )

    def tidy(self) -> Tidy:
        """Return the parameters of the named effects, one a row."""
        rows = [(e, name, value) for e in self.effects for name, value in e.parameters.items()]
        columns: dict[str, list[Any]] = {name: [getattr(e, name) for e, _, _ in rows] for name in ("kind", "joint", "channel")}
        columns |= {"parameter": [name for _, name, _ in rows]}
        columns |= {name: [getattr(value, name) for _, _, value in rows] for name in ("value", "std", "unit")}
        return Tidy(columns | {"p_value": [e.p_value for e, _, _ in rows], "share": [e.share for e, _, _ in rows]}, {})

    def labelled(self) -> tuple[Mapping[str, Any], Mapping[str, Labelled]]:
        """Return the channels of every trial, as measured and as simulated with each model; units stand in the names of the channels."""
        models = list(dict.fromkeys(name for trial in self.trials for name in trial.shown))
        nothing = [np.full_like(trial.measured, np.nan) for trial in self.trials]
        shown = {
            name: [
                empty if (course := trial.shown.get(name)) is None else course for trial, empty in zip(self.trials, nothing, strict=True)
            ]
            for name in models
        }
        stacked = over_trials([t.t - t.t[0] for t in self.dataset.trials], {"measured": [t.measured for t in self.trials], **shown})
        n_joints, n_channels = self.dataset.model.n_joints, stacked["measured"].shape[-1]
        # Angles and forces, or joint torques: also of a session with a robot, where the closed chain cannot be simulated.
        names = next(names for led in (True, False) if len(names := _armrs.channel_names(n_joints, led)) == n_channels)
        over = ("trial", "sample")
        quantities = {"time": Labelled(over, stacked["time"], "s"), "measured": Labelled((*over, "channel"), stacked["measured"], "")}
        if models:
            simulated = np.stack([stacked[name] for name in models])
            quantities["simulated"] = Labelled(("model", *over, "channel"), simulated, "")
        return {"trial": [t.file for t in self.trials], "channel": names, "model": models}, quantities

    def to_dict(self) -> dict[str, Any]:
        """Return the result as it is written to JSON."""
        return self.result.to_dict()
