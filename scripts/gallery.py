"""Draw the pictures of docs/gallery.md into docs/images, from runs on built-in data.

Run with the project's own Python after a build: `.venv/bin/python scripts/gallery.py`. A palette halves the pictures.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from PIL import Image

from armrs import cli

IMAGES = Path(__file__).parent.parent / "docs" / "images"
PLAN = ["--angles-deg=-80:-20,30:90"]
TAKEN = {
    "gap-report.png": "demo/gap/figures/summary.png",
    "gap-before-and-after.png": "demo/gap/figures/before-and-after.png",
    "gap-effect.png": "demo/gap/figures/effect-1-coulomb-friction-in-joint-2.png",
    "identified-parameters.png": "demo/identified/figures/parameters.png",
    "identified-torques.png": "demo/identified/figures/torques-between.png",
    "passive-moments.png": "demo/passive/figures/passive-between.png",
    "simulated.png": "simulated/figures/simulated.png",
    "plan-predictions.png": "plan/figures/predictions.png",
}
"""Pictures by the files that they are taken from."""


def main() -> None:
    """Run what is shown, and store its pictures."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        truth = str(out / "demo" / "truth.toml")
        cli.main(["demo", "-o", str(out / "demo")])
        cli.main(["simulate", truth, "--trial", str(out / "demo/data/trials/between_1.csv"), "-o", str(out / "simulated")])
        cli.main(["plan", truth, *PLAN, "-o", str(out / "plan")])
        for name, source in TAKEN.items():
            with Image.open(out / source) as picture:
                picture.convert("RGB").quantize(48, dither=Image.Dither.NONE).save(IMAGES / name, optimize=True)
        shutil.rmtree(out / "demo")


if __name__ == "__main__":
    main()
