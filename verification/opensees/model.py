"""A pattern in OpenSees: corotational three-node shells, joined by springs along creases.

Each panel has its own nodes. Coincident nodes of a crease are tied by stiff springs, and rotate
relative to each other about the crease against their share of its stiffness; `exports.opensees`
provides the commands. None of Foldyn's mechanics is used: geometry, supports, loads and damping
come from the case, mesh and stiffness are made here.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, Fix, Force, Rayleigh
from foldyn.errors import ComputationError, InputError, optional
from foldyn.exports import opensees
from foldyn.exports.creased_shell import CreasedShell, Joint, shares
from foldyn.exports.opensees import TIE, TOLERANCE
from foldyn.materials import MemoryLaw
from foldyn.patterns import Pattern

ALIKE = 1e-9  # relative difference below which diagonals count as equal


@dataclass(frozen=True, eq=False)
class Crease:
    """A crease between two panels.

    Attributes
    ----------
    axis, length
        Unit vector from the lower to the higher vertex, and the distance between them (m).
    nodes : (n + 1, 2)
        Pairs of coincident nodes, as in `Joint`.
    """

    axis: NDArray
    length: float
    nodes: NDArray


@dataclass(frozen=True, eq=False)
class PanelMesh:
    """Triangles of all panels.

    Attributes
    ----------
    points : (n, 3)
        Nodes, m.
    triangles : (nt, 3)
        Counter-clockwise from the front.
    corners : tuple of tuples of int
        Nodes at each vertex of the pattern, one for every panel there.
    creases : tuple of Crease
        In the order of `pattern.creases`.
    """

    points: NDArray
    triangles: NDArray
    corners: tuple[tuple[int, ...], ...]
    creases: tuple[Crease, ...]


def panel_mesh(pattern: Pattern, divisions: int) -> PanelMesh:
    """Cut panels with four corners into 2 `divisions`^2 triangles each.

    Cells are cut along their shorter diagonal, alternately if both are equal.

    Raises
    ------
    InputError
        A panel does not have four corners.
    """
    per_panel = (divisions + 1) ** 2
    points, triangles, sides = [], [], {}
    corners: list[list[int]] = [[] for _ in pattern.vertices]
    for number, face in enumerate(pattern.faces):
        if len(face) != 4:
            raise InputError(f"panel {number} has {len(face)} corners: this model takes four")
        at = pattern.vertices[list(face)]
        node = number * per_panel + np.arange(per_panel).reshape(divisions + 1, divisions + 1)
        points.append(_bilinear(at, divisions))
        triangles.append(_cut(node, at))
        for vertex, own in zip(face, node[[0, -1, -1, 0], [0, 0, -1, -1]].tolist(), strict=True):
            corners[vertex].append(own)
        around = (node[:, 0], node[-1], node[::-1, -1], node[0, ::-1])
        for a, b, side in zip(face, (*face[1:], face[0]), around, strict=True):
            sides[a, b] = side
    creases = tuple(_crease(pattern.vertices, a, b, sides) for a, b in pattern.creases.tolist())
    return PanelMesh(
        np.concatenate(points), np.concatenate(triangles), tuple(map(tuple, corners)), creases
    )


def _bilinear(corners: NDArray, n: int) -> NDArray:
    """Points ((n + 1)^2, 3) of a grid between four corners; the second index runs along 0-3."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    weights = np.stack([(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y], axis=-1)
    return (weights @ corners).reshape(-1, 3)


def _cut(node: NDArray, corners: NDArray) -> NDArray:
    """Two triangles (2 n^2, 3) of each cell of a grid of nodes."""
    cell = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1)
    first, second = (np.linalg.norm(corners[k + 2] - corners[k]) for k in (0, 1))
    if abs(first - second) <= ALIKE * first:
        from_0 = np.indices(cell.shape[:2]).sum(axis=0) % 2 == 0
    else:
        from_0 = np.full(cell.shape[:2], first < second)
    along_0 = cell[from_0][:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    along_1 = cell[~from_0][:, [[0, 1, 3], [1, 2, 3]]].reshape(-1, 3)
    return np.concatenate([along_0, along_1])


def _crease(vertices: NDArray, a: int, b: int, sides: dict[tuple[int, int], NDArray]) -> Crease:
    across = vertices[b] - vertices[a]
    length = float(np.linalg.norm(across))
    return Crease(across / length, length, np.stack([sides[a, b], sides[b, a][::-1]], axis=1))


@dataclass(frozen=True, eq=False)
class Answer:
    """A path or a motion.

    Attributes
    ----------
    at : (m,)
        Load factors, or times (s).
    displacement : (m, v, 3)
        Displacement of the pattern's vertices, m.
    iterations : int
        Total number of corrections.
    seconds : float
        Processor time of the steps.
    """

    at: NDArray
    displacement: NDArray
    iterations: int
    seconds: float


@dataclass(frozen=True, eq=False)
class PanelShells:
    """A case as OpenSees shells.

    Parameters
    ----------
    case : Case
        Provides the pattern, the sheet and the law of the folds. Supports must be `Fix` and loads
        `Force`, both on vertices of the pattern.
    divisions : int
        Divisions of each edge of a panel.
    tie : float
        Stiffness of the springs that tie nodes, in units of E t.
    tolerance : float
        Norm (m and rad) of the last correction of a step.

    Raises
    ------
    InputError
        The case has features that this model does not support.
    """

    case: Case
    divisions: int
    tie: float = TIE
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        case, options = self.case, self.case.structure.options
        if not all(isinstance(one, Fix) for one in case.supports):
            raise InputError("supports: this model takes `Fix` alone")
        if case.constraints:
            raise InputError("supports: this model takes axes, and panels that bend, alone")
        if not all(isinstance(one, Force) for one in case.loads):
            raise InputError("loads: this model takes `Force` alone")
        if case.masses or options.clamped or options.rigid is not None:
            raise InputError("masses, clamped, rigid: this model takes none of them")
        if case.rayleigh.beta:
            raise InputError(f"damping: beta = {case.rayleigh.beta}: this model takes alpha alone")
        if not all(isinstance(part, Rayleigh) for part in case.dampings):
            raise InputError("damping: this model takes Rayleigh's alone")
        if options.crease_stiffness is not None or options.crease_rest is not None:
            raise InputError("crease_stiffness, crease_rest: this model has those of the sheet")
        if case.structure.sheet.panels or case.structure.pattern.boards is not None:
            raise InputError("sheet, pattern: this model has one thin sheet for all panels")
        inner = slice(len(case.structure.pattern.vertices), None)
        if case.fixed[inner].any() or any(force[inner].any() for force, _ in case.load_terms):
            raise InputError("supports and loads: this model takes vertices of the pattern alone")
        _ = self.linear_range

    @cached_property
    def mesh(self) -> PanelMesh:
        """Triangles and creases."""
        return panel_mesh(self.case.structure.pattern, self.divisions)

    @cached_property
    def linear_range(self) -> NDArray:
        """Least and largest change of each dihedral (nc, 2), rad, for which folds are linear."""
        structure = self.case.structure
        law, rest = structure.fold_law, structure.pattern.dihedrals
        if law.linear_between is not None and not isinstance(law, MemoryLaw):
            found = np.array(law.linear_between) - rest[:, None]
            if (found[:, 0] < 0.0).all() and (found[:, 1] > 0.0).all():
                return found
        raise InputError(f"fold_law = {law}: this model takes folds that are linear at rest")

    @cached_property
    def shell(self) -> CreasedShell:
        """Creased shell for OpenSees."""
        mesh, sheet, count = self.mesh, self.case.structure.sheet, len(self.mesh.points)
        held = np.zeros((count, 3), bool)
        forces = [np.zeros((count, 3)) for _ in self.case.load_terms]
        for vertex, nodes in enumerate(map(list, mesh.corners)):
            held[nodes] = self.case.fixed[vertex]
            for spread, (force, _) in zip(forces, self.case.load_terms, strict=True):
                spread[nodes] = force[vertex] / len(nodes)
        joints = tuple(
            Joint(one.axis, one.nodes, crease_stiffness(one.length, sheet) * shares(len(one.nodes)))
            for one in mesh.creases
        )
        return CreasedShell(
            nodes=mesh.points,
            triangles=mesh.triangles,
            kind=np.zeros(len(mesh.triangles), np.int64),
            sheets=(sheet,),
            axes=np.zeros((len(mesh.triangles), 2, 3)),  # of isotropic sheets
            joints=joints,
            places=mesh.corners,
            held=held,
            clamped=np.zeros(count, bool),
            forces=tuple(forces),
            masses=np.zeros(count),
        )

    def path(self, steps: int = 10) -> Answer:
        """Equilibria under load factors 0, 1/steps, ..., 1."""
        domain = self._domain()
        for number, force in enumerate(self.shell.forces, 1):
            opensees.run(domain, opensees.load(number, force, "Linear"))
        self._prepare(domain, "Newton")
        domain.integrator("LoadControl", 1.0 / steps)
        domain.analysis("Static")
        return self._run(domain, np.arange(steps + 1) / steps, 1, ())

    def frequencies(self, count: int = 5) -> NDArray:
        """Lowest natural frequencies (Hz) at rest."""
        domain = self._domain()
        self._prepare(domain, "Newton")
        return np.sqrt(np.array(domain.eigen(opensees.EIGEN, count))) / (2.0 * np.pi)

    def motion(self, duration: float, dt: float, every: int = 1) -> Answer:
        """Motion from rest by Newmark's average acceleration, sampled at each `every`-th step.

        Histories are evaluated at the ends of the steps.
        """
        domain, steps = self._domain(), round(duration / dt)
        times = dt * np.arange(steps + 1)
        pairs = zip(self.shell.forces, self.case.load_terms, strict=True)
        for number, (force, (_, history)) in enumerate(pairs, 1):
            factors = [float(history(t)) for t in (*times, times[-1] + dt)]
            series = ("Path", "-dt", dt, "-values", *factors)
            opensees.run(domain, opensees.load(number, force, *series))
        self._prepare(
            domain, "ModifiedNewton"
        )  # one tangent per step: the same result in half the time
        domain.rayleigh(self.case.rayleigh.alpha, 0.0, 0.0, 0.0)
        domain.integrator("Newmark", 0.5, 0.25)
        domain.analysis("Transient")
        return self._run(domain, times, every, (dt,))

    def _domain(self) -> Any:
        """Nodes, elements and supports; node k of the mesh has number k + 1."""
        domain = _opensees()(ndm=3, ndf=6)
        opensees.run(domain, opensees.model(self.shell, self.tie))
        return domain

    def _prepare(self, domain: Any, algorithm: str) -> None:
        opensees.run(domain, opensees.solver(algorithm, self.tolerance))

    def _run(self, domain: Any, at: NDArray, every: int, step: tuple[float, ...]) -> Answer:
        moved, iterations, start = [self._moved(domain)], 0, time.process_time()
        for number in range(1, len(at)):
            if domain.analyze(1, *step):
                raise ComputationError(f"OpenSees found no balance at {at[number]:g}")
            iterations += domain.testIter()
            if number % every == 0:
                moved.append(self._moved(domain))
                self._check_folds(domain, at[number])
        spent = time.process_time() - start
        return Answer(at[::every], np.array(moved), iterations, spent)

    def _moved(self, domain: Any) -> NDArray:
        """Displacements (v, 3) of the vertices, averaged over their nodes."""
        return np.array(
            [
                np.mean([domain.nodeDisp(node + 1)[:3] for node in nodes], axis=0)
                for nodes in self.mesh.corners
            ]
        )

    def _check_folds(self, domain: Any, at: float) -> None:
        """Refuse a state in which a fold is outside the range of its linear law."""
        first = opensees.first_springs(self.shell)
        for number, (low, high) in enumerate(self.linear_range):
            for place in range(self.divisions + 1):
                turn = domain.eleResponse(first[number] + place, "deformation")[0]
                if not low <= turn <= high:
                    raise ComputationError(
                        f"crease {number} turned by {np.degrees(turn):.1f} degrees at {at:g}: "
                        "beyond the range in which its fold is linear"
                    )


def crease_stiffness(length: float, sheet: Any) -> float:
    """Stiffness (N m/rad) of a whole crease: 1/k = Ls/G + 1/(0.55 G (L/t)^(1/3)).

    With G = E t^3 / 12 (1 - nu^2) and Ls the length-scale ratio; reimplemented here, so that the
    check is independent.
    """
    E, nu, t = sheet.youngs_modulus, sheet.poissons_ratio, sheet.thickness
    bending = E * t**3 / (12.0 * (1.0 - nu**2))
    softness = sheet.length_scale_ratio + 1.0 / (0.55 * (length / t) ** (1.0 / 3.0))
    return bending / softness


def _opensees() -> Callable[..., Any]:
    """The class of models of OpenSees."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    return optional("opensees.openseespy", "the check needs OpenSees", "foldyn[opensees]").Model
