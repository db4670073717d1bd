"""Figures of the page on tracking: `python docs/tracking_figures.py FOLDER`.

FOLDER holds what `benchmarks/tracking.py FOLDER` made.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import xarray as xr

import foldyn as fd
from foldyn import experiment, plots, signals

IMAGES = Path(__file__).with_name("images")
NODE, START = 8, 0.14  # s: before, the film is too blurred where this node is


def steps(tracks: xr.Dataset) -> dict:
    """The history of a node after each step of its preparation."""
    time = tracks["time"].values
    x = tracks["displacement"].sel(node=NODE, axis="x").values
    done = {"as measured": (time, x)}
    time, x = signals.choose_window(time, x, start=START, stop=START + 1.2)
    x = signals.fill_gaps(x, longest=8)
    done["window of 1.2 s, short gaps filled"] = time, x
    turn = signals.first_turning_point(x)
    time, x = time[turn:], x[turn:]
    done["from the first turning point"] = time, x
    x = signals.subtract_final(x)
    done["without the final position"] = time, x
    done["without a linear trend"] = time, signals.remove_trend(x)
    return done


def main(folder: Path) -> None:
    """Write the images."""
    sharp = experiment.load_tracks(folder / "sharp-tracks.nc")
    film = experiment.open_film(folder / "sharp.mkv")
    overlay = plots.draw_overlay(film.picture(0), sharp)
    overlay.savefig(IMAGES / "tracking-overlay.png", dpi=100)
    blurred = experiment.load_tracks(folder / "blurred-tracks.nc")
    truth = xr.load_dataset(folder / "blurred.nc", engine="h5netcdf")
    rest = fd.load(folder / "motion.nc")["rest_position"]
    moved = truth["position"] - rest
    nodes = [3, NODE, 29]
    true = {node: moved.sel(node=node, axis="x").values for node in nodes}
    shown = blurred.sel(time=slice(0.0, 0.8))
    count = shown.sizes["time"]
    figure = plots.plot_tracks(
        shown, nodes, axis="x", truth={n: np.asarray(t)[:count] for n, t in true.items()}
    )
    figure.savefig(IMAGES / "tracking-history.png", dpi=100)
    plots.plot_steps(steps(blurred)).savefig(IMAGES / "tracking-steps.png", dpi=100)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "tracking-films"))
