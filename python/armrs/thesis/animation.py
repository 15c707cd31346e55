"""Stick figures that move: plain data, and how they stand in a page (SVG, moved by a few lines of script)."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..report.pages import escape

FRAMES = 25.0
"""Pictures a second."""
GHOSTS = 7
"""Poses that are shown all the time, over the whole movement."""
_MARGIN = 0.06


def film(title: str, text: str, t: np.ndarray, chains: Mapping[str, tuple[str, np.ndarray]]) -> dict[str, Any]:
    """Return a moving picture as plain data.

    Parameters
    ----------
    title, text : str
    t : ndarray, shape (n,)
        Evenly spaced times [s].
    chains : mapping
        Name -> colour and points, shape (n, k, 2) [m].
    """
    every = max(1, round(1.0 / (FRAMES * float(t[1] - t[0]))))
    return {
        "title": title,
        "text": text,
        "t_s": np.round(t[::every], 3).tolist(),
        "chains": [
            {"name": name, "colour": colour, "points_m": np.round(points[::every], 4).tolist()} for name, (colour, points) in chains.items()
        ],
    }


def html(data: Mapping[str, Any], number: int) -> str:
    """Return the picture with its controls; without scripts the poses over the movement are there."""
    chains = [(chain, np.asarray(chain["points_m"])) for chain in data["chains"]]
    every = np.concatenate([points.reshape(-1, 2) for _, points in chains])
    low, high = every.min(axis=0) - _MARGIN, every.max(axis=0) + _MARGIN
    size = high - low
    shapes = []
    for chain, points in chains:
        ghosts = np.linspace(0, len(points) - 1, GHOSTS).astype(int)
        shapes += [_line("ghost", chain, _path(points[k], low, high)) for k in ghosts]
    shapes += [_line("stick", chain, _path(points[0], low, high)) for chain, points in chains]
    shapes.append(_scale(size))
    frames = [[[_path(pose, low, high) for pose in points] for _, points in chains], data["t_s"]]
    key = " ".join(f'<span style="color:{chain["colour"]}">▬ {escape(chain["name"])}</span>' for chain, _ in chains)
    stored = json.dumps(frames, separators=(",", ":"))
    return (
        f'<figure class="film" id="film-{number}"><div><svg viewBox="0 0 {size[0]:.3f} {size[1]:.3f}" role="img" '
        f'aria-label="{escape(data["title"])}">{"".join(shapes)}</svg></div>\n'
        f'<p class="controls"><button type="button">Pause</button> <input type="range" min="0" max="{len(data["t_s"]) - 1}" value="0" '
        f'aria-label="time"> <output>0.00 s</output> <span class="key">{key}</span></p>\n'
        f'<script type="application/json">{stored}</script>\n'
        f"<figcaption><strong>{escape(data['title'])}.</strong> {escape(data['text'])}</figcaption></figure>\n"
    )


def _scale(size: np.ndarray) -> str:
    """Return a bar of 0.1 m and the direction of gravity, in the lower left corner of a picture of that size [m]."""
    left, foot = 0.02, size[1] - 0.02
    return (
        f'<g class="scale"><path d="M{left:.3f} {foot:.3f}h.1m0 -.01v.02m-.1 0v-.02M{left + 0.15:.3f} {foot - 0.07:.3f}v.07m-.012 '
        f'-.018l.012 .018l.012 -.018"/><text x="{left + 0.015:.3f}" y="{foot - 0.015:.3f}">0.1 m</text>'
        f'<text x="{left + 0.17:.3f}" y="{foot - 0.02:.3f}">g</text></g>'
    )


def _line(kind: str, chain: Mapping[str, Any], path: str) -> str:
    return f'<polyline class="{kind}" stroke="{chain["colour"]}" points="{path}"/>'


def _path(pose: Sequence[Sequence[float]] | np.ndarray, low: np.ndarray, high: np.ndarray) -> str:
    """Return a pose as SVG has it, where z grows downwards."""
    return " ".join(f"{y - low[0]:.3f},{high[1] - z:.3f}" for y, z in np.asarray(pose))


CSS = """
.film svg { display: block; width: 100%; max-height: 26rem; }
.film polyline { fill: none; stroke-linejoin: round; stroke-linecap: round; }
.film .stick { stroke-width: .014; }
.film .scale path { fill: none; stroke: var(--soft); stroke-width: .003; }
.film .scale text { font-size: .024px; fill: var(--soft); }
.film .ghost { stroke-width: .005; opacity: .22; }
.controls { display: flex; gap: .7rem; align-items: center; flex-wrap: wrap; max-width: none; }
.controls input { flex: 1; min-width: 8rem; }
.controls output { min-width: 4.5rem; font-variant-numeric: tabular-nums; }
"""

SCRIPT = """
document.querySelectorAll(".film").forEach(film => {
  const [chains, times] = JSON.parse(film.querySelector("script").textContent);
  const sticks = film.querySelectorAll(".stick"), slider = film.querySelector("input");
  const button = film.querySelector("button"), clock = film.querySelector("output");
  let frame = 0, playing = !matchMedia("(prefers-reduced-motion: reduce)").matches, before = 0;
  const show = () => {
    chains.forEach((poses, k) => sticks[k].setAttribute("points", poses[frame]));
    slider.value = frame;
    clock.textContent = times[frame].toFixed(2) + " s";
    button.textContent = playing ? "Pause" : "Play";
  };
  const step = now => {
    const wait = 1000 * (times[1] - times[0]);
    if (playing && film.offsetParent !== null && now - before >= wait) {
      frame = (frame + 1) % times.length; before = now; show();
    }
    requestAnimationFrame(step);
  };
  button.addEventListener("click", () => { playing = !playing; show(); });
  slider.addEventListener("input", () => { playing = false; frame = +slider.value; show(); });
  show();
  requestAnimationFrame(step);
});
"""
