"""The figure of gpu.md, from the measurements in gpu_measured.csv.

`python docs/gpu_figure.py` writes images/gpu.png: the speed of a GPU over that of two CPU cores.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from foldyn.plots.style import finish, frame, key, line_style, new_figure

HERE = Path(__file__).parent
KINDS = {"models": "models of 333 dofs", "dofs": "dofs of one sheet"}
METHODS = "rk4", "central_difference"

if __name__ == "__main__":
    rows = np.genfromtxt(HERE / "gpu_measured.csv", delimiter=",", names=True, dtype=None)
    figure = new_figure(8.0, 3.6)
    for axes, (kind, below) in zip(figure.subplots(1, len(KINDS)), KINDS.items(), strict=True):
        frame(axes, below, "times as fast as two cores" if kind == "models" else "", "")
        for k, method in enumerate(METHODS):
            own = np.sort(rows[(rows["kind"] == kind) & (rows["method"] == method)], order="size")
            gain = own["gpu"] / own["cpu"] if kind == "models" else own["cpu"] / own["gpu"]
            axes.plot(own["size"], gain, marker="o", markersize=3, **line_style(k))
        axes.axhline(1.0, color="0.6", linewidth=0.8)
        axes.set_xscale("log")
        axes.set_yscale("log")
    keys = [key(method, **line_style(k)) for k, method in enumerate(METHODS)]
    finish(figure, keys, 2).savefig(HERE / "images" / "gpu.png", dpi=110)
