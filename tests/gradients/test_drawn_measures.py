"""Gradients of all measures at designs drawn at random, with each kind of constraint."""

from __future__ import annotations

from collections.abc import Callable, Collection
from itertools import product
from typing import Any

import numpy as np
import pytest
from differences import Design

import foldyn as fd
from foldyn.gradients.measures import DERIVATIVES
from pairwise import beyond

HELD = fd.Fix([0, 1, 3, 4])
TIED: dict[str, tuple[Any, dict[str, Any]]] = {
    "nothing tied": ([HELD], {}),
    "oblique supports": (
        [
            fd.Fix([0, 1, 4]),
            fd.Fix([3], direction=(0.4, 1, 0.3)),
            fd.Fix([6], direction=(2, 1, -1)),
        ],
        {},
    ),
    "a rigid panel": ([HELD], {"rigid": [3]}),
    "nodes linked": ([HELD, fd.Link([5, 8], "yz")], {}),
    "a spring": ([HELD, fd.Spring(40.0, [8], direction=(0, 1, 1))], {}),
}
PRESETS: dict[str, dict[str, Any]] = {
    "merlin2": {"bend_law": "linear"}, "plate": {"membrane": "bars"}, "n5b8e": {},
}  # fmt: skip
VIBRATING = [
    "frequency[1]", "frequency[2]", "effective_mass[1,z]", "effective_mass[2,x]", "mass",
]  # fmt: skip
RESTING = [
    "displacement[8,z]", "largest_displacement", "strain", "strain_energy", "reaction[x]",
]  # fmt: skip
MOVING = [
    "displacement[8,z]", "displacement_at[7,x,0.2]", "velocity[8,z]", "maximum[8,z]",
    "minimum[8,x]", "integral[7,z]", "mean_square[8,z]", "largest_displacement", "strain",
    "strain_energy",
]  # fmt: skip
EXACT = ("oblique supports", "a rigid panel", "nodes linked")
PEAKS = ["peak_frequency[8,z]", "peak_height[8,z]"]
ELSEWHERE = {"clearance", "limit_load", "load_at", "barrier", "barrier_back"}
ELSEWHERE |= {name for name, one in DERIVATIVES.items() if one.beside}
"""Measures of paths that snap, of panels apart, and differenced ones, in tests of their own."""


def drawn(tied: str, preset: Any, seed: int) -> tuple[Callable[..., fd.Case], dict[str, Any]]:
    """A cell with random numbers, and those that are its parameters."""
    supports, given = TIED[tied]
    chance = np.random.default_rng(seed)

    def build(
        thickness: float, stiffness: Any, panel_angle: float, weight: float = 1.2,
        dihedral: float = 115.0, force: float = 0.0, alpha: float = 0.06, beta: float = 1e-3,
        youngs: float = 1e6,
    ) -> fd.Case:  # fmt: skip
        pattern = fd.patterns.miura(a=0.9, b=1.1, panel_angle=panel_angle, dihedral=dihedral)
        made = fd.discretize(
            pattern, fd.Sheet(youngs, 0.25, thickness, 300.0), preset=preset,
            crease_stiffness=stiffness, **PRESETS[preset], **given,
        )  # fmt: skip
        loads = [
            fd.Force([8], (0.3 * force, -0.2 * force, force)),
            fd.Force([5], (0.1, 0.05, -0.4)),
        ]
        masses = [fd.PointMass([8], weight), fd.PointMass([7], 0.4)]
        return fd.Case(
            made, supports, loads if force else [], [fd.Rayleigh(alpha, beta)], masses=masses
        )

    values = {
        "thickness": chance.uniform(0.025, 0.035), "panel_angle": chance.uniform(58.0, 75.0),
        "stiffness": chance.uniform(2.0, 4.0, 4),
    }  # fmt: skip
    if tied == "a rigid panel":  # its shape ties its corners
        angle = values.pop("panel_angle")
        return lambda **own: build(panel_angle=angle, **own), values
    return build, values


def few(others: Collection[Any], every: Collection[str]) -> list[Any]:
    """Some constraints with one of the others in turn; what goes beyond is in the matrix."""
    rows = list(product(TIED, others))
    first = [
        (tied, other)
        for i, tied in enumerate(TIED)
        for j, other in enumerate(others)
        if i % len(others) == j and tied in every
    ]
    return first + beyond([row for row in rows if row not in first])


def agrees(design: Design, closely: float = 1e-5) -> None:
    """Gradients are differences, but for the rounding of these."""
    size = np.abs(design.numbers({}))
    gradient = design.gradient()
    for direction in design.directions():
        expected, ((name, rate),) = design.difference(direction), direction.items()
        found = gradient[name] @ rate if np.ndim(rate) else gradient[name] * rate
        off = np.abs(found - expected) > closely * np.abs(expected) + 1e-6 * size
        wrong = {design.measures[k]: (found[k], expected[k]) for k in np.flatnonzero(off)}
        assert not wrong, (name, wrong)


@pytest.mark.matrix
@pytest.mark.parametrize(("tied", "which"), few([*product((None, "equilibrium"), PRESETS)], EXACT))
def test_modes(tied: str, which: tuple[str | None, str]) -> None:
    state, preset = which
    build, values = drawn(tied, preset, 31)
    measures = VIBRATING if state else [*VIBRATING, "damping_ratio[1]"]
    values |= {"weight": 0.8} | ({"force": 0.7} if state else {"alpha": 0.05})
    design = Design(build, values, measures, {"kind": "modes", "count": 4, "state": state})
    design.step = 1e-3
    agrees(design)


@pytest.mark.matrix
@pytest.mark.parametrize(("tied", "preset"), few(PRESETS, EXACT))
def test_equilibria(tied: str, preset: str) -> None:
    build, values = drawn(tied, preset, 32)
    analysis = {"kind": "statics", "load_factors": [0.5, 1.0]}
    agrees(Design(build, values | {"force": 0.9}, RESTING, analysis))


@pytest.mark.matrix
@pytest.mark.parametrize(("tied", "method"), few(("newmark", "rk4"), EXACT[:2]))
def test_motions(tied: str, method: str) -> None:
    build, values = drawn(tied, "merlin2" if method == "rk4" else "plate", 33)
    step, steps = (1e-3, 40) if method == "rk4" else (1e-2, 4)
    analysis = {
        "kind": "dynamics",
        "method": method,
        "dt": step,
        "duration": 0.4,
        "every_steps": steps,
    }
    soft = lambda **own: build(youngs=1e5, **own)  # noqa: E731
    design = Design(soft, values | {"force": 0.9, "alpha": 0.05}, MOVING, analysis)
    design.step = 1e-3
    agrees(design)


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("tied", "which"), few([*product((13, 201), (None, "equilibrium"))], EXACT[1:])
)
def test_peaks_however_close_the_frequencies(tied: str, which: tuple[int, str | None]) -> None:
    """With close frequencies the peak moves across many of them in a difference."""
    count, state = which
    build, values = drawn(tied, "plate", 34)
    values |= {"stiffness": 3.0, "alpha": 0.1} | ({"force": 0.7} if state else {})
    drive, case = [fd.Force([8], (0.2, 0.3, 1.0))], build(**values)
    lowest = fd.modes(case, 3, state=state)["frequency"].values
    wide = np.linspace(0.6 * lowest[0], 1.2 * lowest[2], 150)
    peaks = fd.linear.peaks_of(fd.frf(case, drive, frequencies=wide, state=state), 8, axis="z")
    near = max(peaks, key=lambda peak: peak.height).frequency
    damped = 0.5 * case.rayleigh.rate(2.0 * np.pi * near) / (2.0 * np.pi * near)
    width = (4.0 if count < 100 else 2.5) * damped
    frequencies = near * np.linspace(1.0 - width, 1.0 + width, count)
    analysis = {"kind": "frf", "drive": drive, "state": state, "frequencies": frequencies}
    design = Design(build, values, PEAKS, analysis)
    design.step = 1e-4 if count < 100 else 5e-4
    agrees(design, 1e-4 if count < 100 else 3e-2)


def test_all_measures_with_a_derivative_are_tested() -> None:
    asked = [*VIBRATING, "damping_ratio[1]", *RESTING, *MOVING, *PEAKS, "response[8,z,1]"]
    assert {text.split("[")[0] for text in asked} | ELSEWHERE == {*DERIVATIVES}
