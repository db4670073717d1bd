"""The figure of large motions in fidelity.md, from the stored results.

`python -m docs.fidelity_figure` writes images/fidelity-motions.png: the frequency of each cycle.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from foldyn.plots.style import BLACK, finish, frame, key, line_style, new_figure
from verification.fidelity.motion_results import SHELL, Run, grouped, read

IMAGES = Path(__file__).with_name("images")
CASES = {
    "simple_fold, a 1, b 1, dihedral 60, case 1, L* 1": "Simple fold",
    "miura, cells 1x1, a 1, b 1, panel_angle 60, dihedral 100, panel, L* 1": "Miura-ori",
}
STARTS = ("5", "20", "50")


def curve(axes: Axes, run: Run, look: dict) -> None:
    """Frequency of each cycle at its middle; the shell's without the error of its mesh."""
    period = np.array(run.period) * (run.mesh if run.model == SHELL else 1.0)
    middle = np.cumsum(period) - period / 2.0
    axes.plot(middle, 1.0 / period, marker="o", markersize=2.5, **look)


if __name__ == "__main__":
    found = grouped(read())
    figure = new_figure(8.0, 4.4)
    every = figure.subplots(len(CASES), len(STARTS), sharey="row", squeeze=False)
    models = list(found[next(iter(CASES)), STARTS[0]])
    looks = {model: line_style(k - 1) for k, model in enumerate(models)}
    looks[SHELL] = {"color": BLACK, "linestyle": "solid", "linewidth": 1.1}
    for k, (case, name) in enumerate(CASES.items()):
        for axes, start in zip(every[k], STARTS, strict=True):
            below = "time (s)" if k == len(CASES) - 1 else ""
            left = "frequency (Hz)" if start == STARTS[0] else ""
            frame(axes, below, left, f"{name}, {start}°")
            for model, run in found[case, start].items():
                curve(axes, run, looks[model])
            axes.set_xlim(left=0.0)
    keys = [key(model, **look) for model, look in looks.items()]
    finish(figure, keys, 4).savefig(IMAGES / "fidelity-motions.png", dpi=110)
