"""A sweep: the first frequencies of the paper specimen, and what decides about them.

Run it to draw the pictures of docs/sweeps.md: python examples/sweep.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import xarray as xr

import foldyn as fd

CASE = fd.studies.find_case("herkal/specimen-modes")
RULE = {"model.mass": ["circumcenter"]}


def compute(
    grid: int = 4, samples: int = 8, processes: int | None = 1
) -> tuple[fd.Case, dict[str, xr.Dataset]]:
    """How soft creases and how far folded; and how well paper is known."""
    ends = f"{grid}"
    over = {
        "sheet.length_scale_ratio": f"1:8:{ends}:log",
        "pattern.dihedral": f"25:60:{ends}",
        **RULE,
    }
    known = {
        "sheet.length_scale_ratio": "2:4",
        "sheet.youngs_modulus": "1.1e9:1.35e9",
        "sheet.thickness": "2.2e-4:2.6e-4",
        "sheet.density": "640:700",
        **RULE,
    }
    first = fd.sweep(CASE, over, ["frequencies"], processes=processes)
    second = fd.sweep(
        CASE, known, ["frequency[1]"], samples=samples, method="saltelli", processes=processes
    )
    return fd.read_case(CASE).case(), {"grid": first, "design": second}


def check(results: dict[str, xr.Dataset]) -> None:
    """Softer creases lower all frequencies, and the total indices hold the first ones."""
    grid, design = results["grid"], results["design"]
    assert grid.attrs["failed"] == design.attrs["failed"] == 0
    lowest = grid["frequencies"].isel(mode=0, mass=0)
    assert (lowest.diff("length_scale_ratio") < 0.0).all()
    # frequencies go with the root of modulus over density: scale them, and neither decides
    points = design["frequency_1"].values
    scale = np.sqrt(design["youngs_modulus"] / design["density"]).values
    assert np.std(points / scale) / np.mean(points / scale) < np.std(points) / np.mean(points)


if __name__ == "__main__":
    _, found = compute(9, 64, None)
    check(found)
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    indices = fd.results.sobol_indices(found["design"], "frequency_1")
    print(indices)
    plots = fd.plots
    plots.plot_sweep_map(found["grid"], "frequencies", at={"mode": 2}).savefig(
        folder / "sweep-map.png", dpi=90
    )
    plots.plot_sweep_lines(
        found["grid"], "frequencies", "dihedral", "mode", {"length_scale_ratio": 1.0}
    ).savefig(folder / "sweep-lines.png", dpi=90)
    plots.plot_main_effects(found["design"], "frequency_1").savefig(
        folder / "sweep-effects.png", dpi=90
    )
    plots.plot_sobol_indices(indices).savefig(folder / "sweep-indices.png", dpi=90)
