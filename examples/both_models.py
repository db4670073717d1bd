"""One case file, two models: case study 1 of Herkal et al. as a shell and as bars and hinges.

Run it to draw the picture of the page on shells:  python examples/both_models.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd

FREE_EDGE = [0, 1]


def compute() -> tuple[object, dict]:
    """The shipped case file read for each model, and the motions."""
    path = fd.studies.find_case("herkal/case1")
    shell, reduced = fd.read_case(path, model="shell", divisions=4), fd.read_case(path)
    return shell, {
        "shell": shell.run(duration=5.0),
        "bars and hinges": reduced.run("circumcenter", duration=5.0),
    }


def check(motions: dict) -> None:
    """Energy is kept, both ends of the edge move alike, and both models swing alike by 8 %."""
    highest, crossing = {}, {}
    for name, motion in motions.items():
        assert motion.attrs["energy_error"] < 1e-4, name
        x = motion.displacement.sel(node=FREE_EDGE, axis="x").values
        assert np.abs(x[:, 0] - x[:, 1]).max() < 1e-3 * np.abs(x).max(), name
        highest[name] = np.abs(x[:, 0]).max()
        back = np.flatnonzero((x[1:, 0] > 0.0) & (x[:-1, 0] <= 0.0))[0]
        crossing[name] = float(motion.time[back])
    for found in (highest, crossing):
        shell, reduced = found.values()
        assert abs(reduced / shell - 1.0) < 0.08, found


def draw(motions: dict, folder: Path) -> None:
    """The motion of the free edge and its frequency content with both models."""
    figure = fd.plots.plot_history(motions, FREE_EDGE[:1], axes="x", max_frequency=5.0)
    figure.savefig(folder / "both-models.png", dpi=110)


if __name__ == "__main__":
    _, results = compute()
    check(results)
    draw(results, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
