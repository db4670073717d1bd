"""Structures and cases in other units: the same physics, told in other numbers.

A `Units` says how long a meter, how heavy a kilogram and how long a second is in the numbers of a
case. Results divided by their unit must not depend on them: no number with a dimension is hidden
anywhere. With powers of two even rounding is the same, so results agree bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import foldyn as fd
from named_models import named

DECADES = (-9.0, 3.0)


@dataclass(frozen=True)
class Units:
    """Units as multiples of m, kg and s; derived ones as attributes."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    @property
    def velocity(self) -> float:
        return self.length / self.time

    @property
    def acceleration(self) -> float:
        return self.velocity / self.time

    @property
    def force(self) -> float:
        return self.mass * self.acceleration

    @property
    def energy(self) -> float:
        return self.force * self.length

    @property
    def stress(self) -> float:
        return self.force / self.length**2

    @property
    def density(self) -> float:
        return self.mass / self.length**3


ONE = Units()


def drawn(seed: int, base: float = 10.0) -> Units:
    """Random units within `DECADES`; with base 4 powers of four,
    by which rounding does not show."""
    low, high = (np.log(10.0**d) / np.log(base) for d in DECADES)
    exponents = np.random.default_rng(seed).uniform(low, high, 3)
    if base != 10.0:
        exponents = np.rint(exponents)
    return Units(*(base**exponents).tolist())


def sheet(by: Units, thickness: float = 0.01, density: float = 1.0) -> fd.Sheet:
    """The sheet of the case studies."""
    return fd.Sheet(
        1e6 * by.stress, 0.25, thickness * by.length, density * by.density, length_scale_ratio=2.0
    )


def miura(by: Units, **model) -> fd.Structure:
    """A Miura unit cell."""
    pattern = fd.patterns.miura((1, 1), by.length, b=1.1 * by.length, panel_angle=60, dihedral=60)
    return fd.discretize(pattern, sheet(by), **named(model))


def fold(by: Units, **model) -> fd.Structure:
    """Two panels."""
    pattern = fd.patterns.simple_fold(by.length, 1.2 * by.length, dihedral=60)
    return fd.discretize(pattern, sheet(by), **named(model))


def shell(by: Units, divisions: int = 3, **model) -> fd.Shell:
    """The same two panels as a shell."""
    pattern = fd.patterns.simple_fold(by.length, 1.2 * by.length, dihedral=60)
    return fd.shell(pattern, sheet(by, thickness=0.02), divisions=divisions, **model)


MIURA_SUPPORTS = (fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y"))
FOLD_SUPPORTS = (fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z"))


def push(by: Units, history=None, size: float = 1e-3) -> fd.Force:
    """A load on the two free corners of `fold`."""
    return fd.Force([0, 1], (-size * by.force, 0.0, 0.0), history)


def damping(by: Units, alpha: float = 0.5, beta: float = 0.0, state: str = "rest") -> fd.Rayleigh:
    return fd.Rayleigh(alpha / by.time, beta * by.time, state)


ENERGIES = (
    "kinetic", "dissipated", "work", "strain_bars", "strain_folds", "strain_bends",
    "strain_membrane", "strain_bending",
)  # fmt: skip
PLAIN = (
    "load_factor", "negative_eigenvalues", "damping_ratio", "transmissibility", "swing",
    "rigid_share",
)  # fmt: skip


def in_units(result, by: Units) -> dict[str, np.ndarray]:
    """Numbers of a result without dimension."""
    per = {
        **dict.fromkeys(PLAIN, 1.0),
        **dict.fromkeys(ENERGIES, by.energy),
        "displacement": by.length,
        "velocity": by.velocity,
        "reaction": by.force,
        "time": by.time,
        "frequency": 1.0 / by.time,
        "eigenvalue": by.time**-2.0,
        "shape": by.mass**-0.5,
        "receptance": by.length / by.force,
        "participation": by.mass**0.5,
        "effective_mass": by.mass,
    }
    names = per.keys() & result.variables.keys()
    return {name: np.asarray(result[name].values) / per[name] for name in names}


def largest_difference(one: dict, other: dict) -> tuple[float, str]:
    """Largest difference of two results, each number relative to the largest of its kind."""
    assert one.keys() == other.keys() and one
    worst = (0.0, "")
    for name, a in one.items():
        b = other[name]
        if a.shape != b.shape:
            return np.inf, f"{name}: shapes {a.shape} and {b.shape}"
        if not np.array_equal(np.isnan(a), np.isnan(b)):
            return np.inf, f"{name}: other entries are missing"
        size = np.nanmax(np.abs(a), initial=0.0)
        gap = float(np.nanmax(np.abs(a - b), initial=0.0)) / size if size > 0.0 else 0.0
        if size == 0.0 and np.nanmax(np.abs(b), initial=0.0) > 0.0:
            gap = np.inf
        worst = max(worst, (gap, name))
    return worst
