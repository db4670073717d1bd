"""A structure of Foldyn as plain arrays: what every twin starts from.

The arrays are taken from the public attributes of the structure, not from Foldyn's packed model,
and numbered anew: nodes along the sheet, elements by their lowest node, hinges with equal laws in
one run. This is the order in which the twins run best; Foldyn keeps its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import foldyn as fd

LINEAR, SUPERLINEAR, ENHANCED = 0, 1, 2
CODES = {"linear": LINEAR, "superlinear": SUPERLINEAR, "enhanced": ENHANCED}
# name of the set: (fold law, bend law)
LAWS = {
    "enhanced": (fd.EnhancedLinear(), fd.EnhancedLinear()),
    "superlinear": (fd.EnhancedLinear(), "superlinear"),
    "locking": (fd.EnhancedLinear(75.0, 285.0), fd.EnhancedLinear(75.0, 285.0)),
}
ALPHA = 0.0628  # 1/s
LOAD = 1e-4  # N at each node of the loaded edge
SHAKE = 1e-3  # m, of the initial displacement
STEP = 0.2  # of the critical step of a small sheet


class Run(NamedTuple):
    """Hinges from start to end, of one law; theta1 and theta2 in rad."""

    start: int
    end: int
    law: int
    theta1: float
    theta2: float


@dataclass(frozen=True, eq=False)
class Problem:
    """Arrays of a motion, n nodes, nb bars, nh hinges (SI); nodal ones in the twins' order."""

    case: fd.Case
    order: NDArray  # (n,) Foldyn's number of each node
    rest: NDArray  # (n, 3)
    bars: NDArray  # (nb, 2)
    bar_vector: NDArray  # (nb, 3)
    bar_per_length2: NDArray
    bar_stiffness: NDArray
    hinges: NDArray  # (nh, 4) axis j, k, wings i, l
    hinge_stiffness: NDArray
    hinge_rest: NDArray
    hinge_offset: NDArray  # moment / k = law - offset
    runs: tuple[Run, ...]
    inverse_mass: NDArray  # (n, 3), 0 on fixed dofs
    load: NDArray  # (n, 3)
    start: NDArray  # (n, 3) initial displacement
    dt: float

    @property
    def dofs(self) -> int:
        """Three per node, the fixed ones included."""
        return self.rest.size

    @cached_property
    def flop(self) -> int:
        """Floating-point operations of an RK4 step; roots, powers and selections count as one."""
        per_bar, per_hinge, per_dof = 44, 222, 12
        return 4 * (per_bar * len(self.bars) + per_hinge * len(self.hinges) + per_dof * self.dofs)

    @cached_property
    def traffic(self) -> int:
        """Bytes that an RK4 step must move when nothing stays in a cache between its sweeps.

        Element data is read once a stage. Of nodal arrays a stage reads position, displacement,
        force, velocity, state, sums, rest, mass and load, and writes all but the last four.
        """
        per_bar, per_hinge, per_dof = 2 * 4 + 5 * 8, 4 * 4 + 3 * 8, 8 * (3 + 9 + 6)
        return 4 * (per_bar * len(self.bars) + per_hinge * len(self.hinges) + per_dof * self.dofs)


def case_of(cells: tuple[int, int], laws: str) -> fd.Case:
    """Miura sheet with N5B8 panels, fixed along one edge, loaded at the other."""
    fold_law, bend_law = LAWS[laws]
    pattern = fd.patterns.miura(cells, panel_angle=60.0, dihedral=120.0)
    sheet = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
    structure = fd.discretize(pattern, sheet, fold_law=fold_law, bend_law=bend_law, preset="herkal")
    edge = np.flatnonzero(pattern.vertices[:, 0] <= 1e-9)
    far = np.flatnonzero(pattern.vertices[:, 0] >= pattern.vertices[:, 0].max() - 1e-9)
    return fd.Case(
        structure,
        supports=[fd.Fix(edge)],
        loads=[fd.Force(far, (0.0, 0.0, -LOAD))],
        damping=fd.Rayleigh(alpha=ALPHA),
    )


def make(cells: tuple[int, int], laws: str) -> Problem:
    """Such a sheet, shaken at the start."""
    case = case_of(cells, laws)
    return _pack(case, np.asarray(case.structure.nodes))


def _pack(case: fd.Case, x: NDArray) -> Problem:
    structure = case.structure
    order = np.lexsort((x[:, 1], np.round(x[:, 0], 9)))
    number = np.empty(len(x), np.int64)
    number[order] = np.arange(len(x))

    bars = number[structure.bars]
    by_node = np.argsort(bars.min(axis=1), kind="stable")
    bars = bars[by_node]
    vector = x[order][bars[:, 1]] - x[order][bars[:, 0]]
    stiffness = structure.sheet.youngs_modulus * structure.bar_area / structure.bar_length

    groups = [
        (structure.folds, structure.fold_stiffness, structure.fold_rest, structure.fold_law),
        (structure.bends, structure.bend_stiffness, structure.bend_rest, structure.bend_law),
    ]
    if groups[0][3] == groups[1][3]:
        together = [
            np.concatenate([a, b]) for a, b in zip(groups[0][:3], groups[1][:3], strict=True)
        ]
        groups = [(*together, groups[0][3])]
    parts, runs, start = [], [], 0
    for rows, k, rest, law in groups:
        rows = number[rows]
        sort = np.argsort(rows.min(axis=1), kind="stable")
        parts.append((rows[sort], k[sort], rest[sort], _offset(law, rest[sort])))
        runs.append(_run(start, start + len(rows), law))
        start += len(rows)
    hinges, hinge_stiffness, hinge_rest, hinge_offset = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )

    mass = structure.mass.diagonal()[:, None]
    shake = SHAKE * np.random.default_rng(0).standard_normal(x.shape)
    load = sum((vector * history(0.0) for vector, history in case.load_terms), np.zeros_like(x))
    return Problem(
        case=case,
        order=order,
        rest=np.ascontiguousarray(x[order]),
        bars=bars.astype(np.uint32),
        bar_vector=vector,
        bar_per_length2=1.0 / np.einsum("ij,ij->i", vector, vector),
        bar_stiffness=stiffness[by_node],
        hinges=hinges.astype(np.uint32),
        hinge_stiffness=hinge_stiffness,
        hinge_rest=hinge_rest,
        hinge_offset=hinge_offset,
        runs=tuple(runs),
        inverse_mass=np.where(case.fixed, 0.0, 1.0 / mass)[order],
        load=np.where(case.fixed, 0.0, load)[order],
        start=np.where(case.fixed, 0.0, shake)[order],
        dt=STEP * _critical_step(),
    )


def _run(start: int, end: int, law: fd.HingeLaw) -> Run:
    angles = (getattr(law, name, 180.0) for name in ("theta1", "theta2"))
    return Run(start, end, CODES[law.name], *np.radians(list(angles)).tolist())


def _offset(law: fd.HingeLaw, rest: NDArray) -> NDArray:
    """Moment / k that a law subtracts, so that the structure is free of stress at rest."""
    if getattr(law, "rest", None) != "stress_free":
        return np.zeros(len(rest))
    published = fd.EnhancedLinear(law.theta1, law.theta2, rest="as_published")
    return published.moment(rest, rest)


_STEPS: list[float] = []


def _critical_step() -> float:
    """Critical step of a sheet of 2 x 2 cells: the same for all sizes of these sheets."""
    if not _STEPS:
        pattern = fd.patterns.miura((2, 2), panel_angle=60.0, dihedral=120.0)
        sheet = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
        structure = fd.discretize(pattern, sheet, preset="herkal")
        _STEPS.append(fd.critical_step(fd.Case(structure)))
    return _STEPS[0]
