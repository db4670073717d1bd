"""Two hundred sheets that differ in thickness and dihedral, all at once: which swings farthest."""

from __future__ import annotations

import numpy as np
import xarray

import foldyn as fd

THICKNESSES = np.linspace(2e-4, 4e-4, 20)  # m
DIHEDRALS = np.linspace(90.0, 140.0, 10)  # degrees
GRID = [(float(t), float(d)) for t in THICKNESSES for d in DIHEDRALS]


def sheet(thickness: float, dihedral: float) -> fd.Case:
    """A Miura cell, held at one end and pushed at the other."""
    pattern = fd.patterns.miura((1, 1), a=0.05, b=0.05, panel_angle=60, dihedral=dihedral)
    paper = fd.Sheet(1.2e9, 0.2, thickness, density=690.0)
    structure = fd.discretize(pattern, paper, mass="mixed_voronoi")
    push = fd.Force([6, 7, 8], (0, 0, -1e-4), fd.HalfSine(duration=2e-3))
    return fd.Case(structure, [fd.Fix([0, 1, 2])], [push], fd.Rayleigh(alpha=20.0))


def compute() -> tuple[list[fd.Case], dict[str, xarray.Dataset]]:
    """Cases, and their motions."""
    cases = [sheet(*point) for point in GRID]
    return cases, {"motions": fd.simulate_many(cases, duration=4e-3, every=1e-4)}


def swings(many: xarray.Dataset) -> np.ndarray:
    """Largest displacement (m) along z of each."""
    return np.abs(many.displacement.sel(axis="z")).max(("time", "node")).to_numpy()


def check(results: dict[str, xarray.Dataset]) -> None:
    """The thinnest sheet swings farthest, and each as it does alone."""
    many = results["motions"]
    assert (many.outcome == "done").all()
    assert many.attrs["energy_error"] < 1e-2
    assert GRID[int(swings(many).argmax())][0] == THICKNESSES[0]
    k = 57
    alone = fd.simulate(sheet(*GRID[k]), 4e-3, "central_difference", dt=float(many.dt), every=1e-4)
    apart = np.abs(many.displacement[k] - alone.displacement).max()
    assert apart < 1e-12 * np.abs(alone.displacement).max()


if __name__ == "__main__":
    _, found = compute()
    check(found)
    many, swing = found["motions"], swings(found["motions"])
    thickness, dihedral = GRID[int(swing.argmax())]
    print(f"{many.sizes['model']} motions of {many.attrs['steps']} steps")
    print(f"the farthest: {1e3 * swing.max():.3g} mm, {thickness:.2g} m thick, {dihedral:.0f} deg")
