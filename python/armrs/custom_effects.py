"""User-defined effects: a law of angle and speed as a Python callable, simulated and searched for like those of the catalogue."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from . import _armrs, checks
from .catalogue import Parameter, catalogue
from .errors import BadInput, Text
from .model import Effect, Joint, Model, Segment

Law = Callable[..., np.ndarray]

KNEE = 0.01
"""Speed around which the distances of the table begin to grow [rad/s]."""
COUNT = (513, 257)
"""Numbers of angles and speeds of the table."""
_ROUGH = 0.02
"""Error of the table, relative to the largest torque, above which a law is refused."""


@dataclass(frozen=True, eq=False)
class OwnEffect:
    """A kind of effect of one's own.

    Attributes
    ----------
    kind : str
    parameters : tuple of Parameter
    law : callable
    table_error : float
        Largest error of the table that the core works with, half way between its points, relative to the largest torque there.
    """

    kind: str
    parameters: tuple[Parameter, ...]
    law: Law = field(repr=False)
    table_error: float = 0.0


def own_effect(
    kind: str,
    law: Law,
    parameters: Sequence[Parameter],
    *,
    summary: str = "",
    formula: str = "",
    shapes: Mapping[str, Sequence[float]] | None = None,
    angles: tuple[float, float] = (-math.pi, math.pi),
    speed: float = 20.0,
) -> OwnEffect:
    """Declare a kind of joint effect by its law; from then on `Effect(kind, joint, parameters=…)` is one of it.

    Parameters
    ----------
    kind : str
        A name that the catalogue does not have. Declared again, the new law takes the place of the old one.
    law : callable
        `law(angle, speed, **parameters)`: torque with which the joint resists [N m], an array like angle [rad] and speed [rad/s].
    parameters : sequence of Parameter
        Name, unit, bounds and start (`default`), at most six. Those in which the torque is linear come first, at least one: with all of
        them zero the law is zero, and zero lies within their bounds. A search fits them, and refines the others, the shapes, from there.
    summary, formula : str
        For reports.
    shapes : mapping of str to sequence of float, optional
        Values of shapes that a search starts from instead, all combinations.
    angles : (float, float)
        Smallest and largest angle of the table [rad]; beyond, the law keeps the value of the edge.
    speed : float
        Largest speed of the table [rad/s].

    Returns
    -------
    OwnEffect

    Raises
    ------
    BadInput
        For parameters out of order, a law that is not linear where it is declared so, and one that is too rough for the table.

    Notes
    -----
    For each set of shapes and each linear parameter the law is tabulated once, at 513 equally spaced angles and 257 speeds, 7e-4 rad/s
    apart at rest and 7 % beyond, and interpolated with cubics: some ms in NumPy. A jump in the law becomes a slope over one cell.
    """
    listed = checks.instances("parameters", parameters, Parameter)
    for name, said in (("summary", summary), ("formula", formula)):
        checks.instance(name, said, str)
    _check(kind, listed)
    names = [p.name for p in listed]
    count = len([p for p in listed if p.linear])
    _takes(law, names)
    low, high = _ends(angles)
    fastest = checks.number("speed", speed, above=KNEE, most=1e4, unit="rad/s")
    at = _evaluated(kind, law, names)

    def tabulate(q: np.ndarray, qd: np.ndarray, values: np.ndarray) -> np.ndarray:
        angle, rate = np.meshgrid(q, qd, indexing="ij")
        return np.ascontiguousarray([at(angle, rate, _one(values, k, count)) for k in range(count)])

    tried = {} if shapes is None else {n: checks.numbers(f"shapes, {n}", v) for n, v in checks.table("shapes", shapes).items()}
    for name in tried:
        if name not in names[count:]:
            raise BadInput("shapes", name, f"one of the parameters that are not linear: {', '.join(names[count:]) or 'none'}")
    _armrs.declare(
        kind,
        summary or kind,
        formula,
        [(p.name, p.unit, p.min, p.max, p.default, p.linear, [float(v) for v in tried.get(p.name, ())]) for p in listed],
        (low, high, fastest, KNEE, *COUNT),
        tabulate,
    )
    catalogue.cache_clear()
    values = np.array([p.default for p in listed])
    _linear(kind, at, values, count, (low, high))
    error = _table_error(kind, at, values, count, (low, high))
    if error > _ROUGH:
        allowed = f"at most {_ROUGH:.0%} of the largest torque: a smoother law, or narrower angles"
        raise BadInput(f"table of {kind}", Text(f"an error of {error:.1%}"), allowed)
    return OwnEffect(kind, listed, law, error)


def _ends(angles: tuple[float, float]) -> tuple[float, float]:
    """Return the smallest and largest angle of a table [rad]."""
    low, high = checks.pair("angles", angles, least=-50.0, most=50.0, unit="rad", hint="looks like degrees")
    if not low < high:
        raise BadInput("angles", Text(f"{low:g} to {high:g} rad"), "the smaller angle first")
    return low, high


def _evaluated(kind: str, law: Law, names: Sequence[str]) -> Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]:
    """Return a law as a function of angles, speeds and the values of its parameters, which refuses a torque that is not finite."""

    def at(q: np.ndarray, qd: np.ndarray, values: np.ndarray) -> np.ndarray:
        answer = np.asarray(law(q, qd, **dict(zip(names, map(float, values), strict=True))), dtype=float)
        torque = np.broadcast_to(answer, q.shape)
        if not np.isfinite(torque).all():
            bad = np.argwhere(~np.isfinite(torque))[0]
            place = f"{kind}({q[tuple(bad)]:.3g} rad, {qd[tuple(bad)]:.3g} rad/s)"
            raise BadInput(place, Text(str(torque[tuple(bad)])), "a finite torque")
        return torque

    return at


def _check(kind: str, parameters: tuple[Parameter, ...]) -> None:
    checks.text("kind", kind)
    if not parameters or not parameters[0].linear:
        raise BadInput("parameters", Text("none that the torque is linear in"), "one such first: the size of the effect")
    flags = [p.linear for p in parameters]
    if flags != sorted(flags, reverse=True):
        raise BadInput("parameters", Text("one in which the torque is linear after one in which it is not"), "the linear ones first")
    for p in parameters:
        if p.or_zero:
            raise BadInput(p.name, Text("or_zero = True"), "False: the law of an effect of one's own is read within its bounds")
        inside = p.min <= p.default <= p.max
        if not inside or (p.linear and not p.min <= 0.0 <= p.max):
            raise BadInput(
                p.name, Text(f"{p.default:g} within {p.min:g} to {p.max:g}"), "bounds that hold the start, and zero where linear"
            )


def _takes(law: Law, names: Sequence[str]) -> None:
    if not callable(law):
        raise BadInput("law", Text(type(law).__name__), "a callable")
    try:
        inspect.signature(law).bind(None, None, **dict.fromkeys(names))
    except TypeError as error:
        raise BadInput("law", Text(str(error)), f"law(angle, speed, {', '.join(names)})") from None
    except ValueError:
        return


def _one(values: np.ndarray, k: int, count: int) -> np.ndarray:
    """Return the values with one unit of the linear parameter `k` and none of the others."""
    out = np.array(values, dtype=float)
    out[:count] = 0.0
    out[k] = 1.0
    return out


def _places(angles: tuple[float, float], number: int = 4001) -> tuple[np.ndarray, np.ndarray]:
    """Return places all over the table that are on none of its points, by two irrational steps."""
    k = np.arange(1, number)
    q = angles[0] + (angles[1] - angles[0]) * np.mod(k * 0.7548776662466927, 1.0)
    return q, 5.0 * (2.0 * np.mod(k * 0.5698402909980532, 1.0) - 1.0) ** 3


def _linear(kind: str, at: Law, values: np.ndarray, count: int, angles: tuple[float, float]) -> None:
    q, qd = _places(angles, 257)
    size = np.array([0.3 + 0.4 * k for k in range(count)])
    mixed = np.array(values, dtype=float)
    mixed[:count] = size
    expected = sum(s * at(q, qd, _one(values, k, count)) for k, s in enumerate(size))
    apart = float(np.abs(at(q, qd, mixed) - expected).max())
    if apart > 1e-9 * max(float(np.abs(expected).max()), 1e-300):
        raise BadInput(f"law of {kind}", Text("not linear in the parameters that are said to be"), "linear=False for those")


def _table_error(kind: str, at: Law, values: np.ndarray, count: int, angles: tuple[float, float]) -> float:
    """Return the largest error of the core's table relative to the largest torque, of the worst linear parameter."""
    q, qd = _places(angles)
    arm = Model((Segment("arm", 1.0, 1.0, 0.5, 0.1),), (Joint("joint"),))
    worst = 0.0
    for k in range(count):
        one = _one(values, k, count)
        unit = dict(zip((p.name for p in catalogue()[kind].parameters), map(float, one), strict=True))
        table = _armrs.Rig(arm, [Effect(kind, 1, parameters=unit)])
        torque = table.resisting(q[:, None], qd[:, None], np.zeros((len(q), 1)), 0.01)[:, 0]
        exact = at(q, qd, one)
        worst = max(worst, float(np.abs(torque - exact).max()) / max(float(np.abs(exact).max()), 1e-300))
    return worst
