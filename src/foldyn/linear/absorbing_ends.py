"""Absorbing ends of a chain: dashpots with the impedance of the rest of the chain.

Long waves move the sections of a chain as rigid bodies, with the coordinates q (k,): the
displacement along the chain and, for a tube, the rotation about its axis. With the mass M of a cell
and the stiffness K against differences of q between cells, M q'' = K (q_n+1 - 2 q_n + q_n-1). So
waves travel at c_j = sqrt(eig(M^-1 K)) cells per second, and the part of the chain that is cut off
would push back with -Z q', with Z the sum over waves of c_j (M q_j)(M q_j)^T and q_j^T M q_j = 1.
Dampers with the impedance Z absorb long waves exactly (J. Lysmer, R. L. Kuhlemeyer, Finite dynamic
model for infinite media, J. Eng. Mech. Div. 95, 1969).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh

from foldyn.arguments import Check, Checked
from foldyn.cases import Case, Dashpot, State
from foldyn.cases.selection import Nodes, resolve_nodes
from foldyn.errors import ComputationError, InputError
from foldyn.linear.bloch import Bloch, null_space
from foldyn.linear.linearized_cell import linearize_cell
from foldyn.linear.unit_cell import UnitCell
from foldyn.linear.wave_solver import Waves, WaveSolver
from foldyn.values import numbers, of_kind, vector

PHASE = 1e-3  # rad per cell: phase of a long wave
LEAST = 0.5  # least share of rigid section motions in the kinetic energy of a wave
LOOKED_AT = 8  # number of waves computed: bending waves are lower than waves along the chain
NEGLIGIBLE = 1e-3  # dashpots that are smaller, relative to the largest coefficient, are left out
ON_AXIS = 1e-6  # distance from the axis, relative to the largest distance, that counts as zero


def _matrix(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return a symmetric matrix (1, 1) or (2, 2), without negative eigenvalues."""
    array = np.atleast_2d(numbers(name, value))
    if array.shape not in ((1, 1), (2, 2)):
        raise InputError(f": shape {array.shape}: give (1, 1), or (2, 2) with rotations", name)
    size = np.sqrt(np.abs(np.outer(*(array.diagonal(),) * 2)))
    if (np.abs(array - array.T) > 1e-6 * size).any() or np.linalg.eigvalsh(array)[0] < 0.0:
        raise InputError(f" = {array.tolist()}: must be symmetric, and not negative", name)
    return 0.5 * (array + array.T)


@dataclass(frozen=True, eq=False)
class LongWaves(Checked):
    """Long waves of a chain, whose cells move as rigid sections along it and about its axis.

    Parameters
    ----------
    axis : sequence of float, shape (3,)
        Direction of the chain, of any length.
    stiffness : array_like, shape (1, 1) or (2, 2)
        K of a cell, from statics: force along the chain (N) and torque about its axis (N m) per
        elongation (m) and twist (rad) of a cell.
    mass : array_like of the same shape
        M of a cell: mass (kg) and, with rotations, moment of inertia (kg m2).
    point : sequence of float, shape (3,)
        Any point on the axis (m), about which sections rotate.

    Examples
    --------
    >>> import foldyn as fd
    >>> fd.linear.LongWaves((0, 0, 1), [[400.0]], [[0.25]]).impedance.tolist()
    [[10.0]]
    """

    axis: Annotated[Sequence[float], Check(vector, nonzero=True)]
    stiffness: Annotated[ArrayLike, Check(_matrix)]
    mass: Annotated[ArrayLike, Check(_matrix)]
    point: Annotated[Sequence[float], Check(vector, unit="m")] = (0.0, 0.0, 0.0)

    def agree(self) -> None:
        """Check that both matrices have the same shape and the mass is positive definite."""
        stiffness, mass = np.asarray(self.stiffness), np.asarray(self.mass)
        if stiffness.shape != mass.shape:
            raise InputError(f": shape {mass.shape}: the stiffness has {stiffness.shape}", "mass")
        if np.linalg.eigvalsh(mass)[0] <= 0.0:
            raise InputError(f" = {mass.tolist()}: must be positive", "mass")

    @property
    def speeds(self) -> NDArray[np.float64]:
        """Speeds (k,), cells per second, slowest first: slopes of bands at the origin, rad/s."""
        return np.sqrt(eigh(self.stiffness, self.mass, eigvals_only=True).clip(min=0.0))

    @property
    def impedance(self) -> NDArray[np.float64]:
        """Impedance Z (k, k): N s/m, with rotations also N s and N m s."""
        _, shapes = eigh(self.stiffness, self.mass)
        momenta = np.asarray(self.mass) @ shapes
        return (momenta * self.speeds) @ momenta.T


def long_waves(cell: UnitCell, state: State | None = None, *, along: int = 0) -> LongWaves:
    """Long waves of a chain, from its bands near the origin of the Brillouin zone.

    Parameters
    ----------
    cell : UnitCell
        Cell of a chain or tube. With a screw, sections also turn; otherwise they only move along
        the chain.
    state : State, optional
        State to linearize about; see `bands`.
    along : int
        Number of the cell's motion along the chain.

    Returns
    -------
    LongWaves

    Raises
    ------
    InputError
        As from `bands`.
    ComputationError
        The cell has no long waves, for instance because it is held.

    Examples
    --------
    >>> import foldyn as fd
    >>> sheet = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.3, thickness=1e-3, density=100.0)
    >>> pattern = fd.patterns.kresling(radius=0.05, height=0.07)
    >>> cell = fd.UnitCell(fd.Case(fd.discretize(pattern, sheet)))
    >>> fd.linear.long_waves(cell).speeds.shape
    (2,)
    """
    along = of_kind("cell", cell, UnitCell).period("along", along)
    if cell.case.structure.linear:
        kind = cell.case.structure.linear
        raise InputError(f": long waves do not support {kind}; take fd.discretize", "cell")
    linear = linearize_cell(cell, state)
    motion = linear.motions[along]
    phase = PHASE * np.eye(cell.dimensions)[along]
    places = (cell.case.structure.nodes + linear.displacement)[linear.patch.first]
    rigid = _rigid(places, motion.unit, np.array(motion.point), motion.turns)
    basis = np.zeros((linear.bloch.size, rigid.shape[2]))
    basis[: 3 * linear.nodes] = rigid.reshape(-1, rigid.shape[2])
    momenta = linear.bloch.mass.sparse_at(linear.bloch.factors(0.0 * phase)).real @ basis
    mass = basis.T @ momenta
    solver = WaveSolver(linear.bloch, _lowest(linear.bloch, phase))

    def rigid_part(waves: Waves) -> tuple[NDArray, NDArray]:
        """Momenta (k, m) of rigid section motions, and their share (m,) in each wave."""
        parts = momenta.T @ waves.shapes
        return parts, np.einsum("ij,ij->j", parts.conj(), np.linalg.solve(mass, parts)).real

    waves, still = solver.waves(phase), solver.waves(0.0 * phase)
    parts, share = rigid_part(waves)
    chosen = np.flatnonzero(share > LEAST)[: len(mass)]
    lowest = waves.values[chosen].min(initial=0.0 if len(chosen) < len(mass) else np.inf)
    free = rigid_part(still)[1][np.abs(still.values) < LEAST * lowest].sum()
    if free < len(mass) - LEAST:
        raise ComputationError(
            f"the sections of the chain do not move freely in {len(mass)} ways as rigid bodies, or "
            "are unstable: hold none of its nodes along the chain"
            f"{' or about it' if motion.turns else ''}, and take a stable state"
        )
    squares = waves.values[chosen] / PHASE**2
    scaled = parts[:, chosen] / np.sqrt(share[chosen])
    stiffness = ((scaled * squares) @ scaled.conj().T).real
    return LongWaves(tuple(motion.unit), stiffness, mass, motion.point)


def absorbing_end(case: Case, nodes: Nodes, *, waves: LongWaves) -> list[Dashpot]:
    """Dashpots that absorb long waves at the end of a chain.

    Parameters
    ----------
    case : Case
        Case of the chain, without absorbing ends.
    nodes : int, sequence of int, or str
        Nodes of the last section of the chain; they share the impedance equally.
    waves : LongWaves
        Long waves of the chain: `long_waves(cell)`, or from a cell's stiffness and mass.

    Returns
    -------
    list of Dashpot
        Dashpots to the ground, one or two per node along fixed directions, to be supports of the
        case. For rigid motions of the section they add up to `waves.impedance`. As the directions
        are fixed, the section must not turn far.

    Raises
    ------
    InputError
        A node does not exist, or lies on the axis of rotating sections.

    Examples
    --------
    >>> import foldyn as fd
    >>> sheet = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.3, thickness=1e-3, density=100.0)
    >>> tower = lambda n: fd.Case(fd.discretize(
    ...     fd.patterns.kresling(radius=0.05, height=0.07, storeys=n), sheet))
    >>> waves = fd.linear.long_waves(fd.UnitCell(tower(1)))
    >>> len(fd.linear.absorbing_end(tower(8), range(48, 54), waves=waves))
    12
    """
    structure = of_kind("case", case, Case).structure
    of_kind("waves", waves, LongWaves)
    chosen = resolve_nodes(structure, nodes, "nodes")
    impedance = waves.impedance
    axis = np.array(waves.axis) / np.linalg.norm(waves.axis)
    points, center = structure.nodes[chosen], np.array(waves.point)
    motions = _rigid(points, axis, center, turns=len(impedance) == 2)
    arms = np.linalg.norm(motions[:, :, -1], axis=1)
    if arms.min() <= ON_AXIS * arms.max():
        raise InputError(
            f": node {chosen[int(arms.argmin())]} lies on the axis and cannot resist rotations; "
            "leave it out",
            "nodes",
        )
    found: list[Dashpot] = []
    for node, motion in zip(chosen.tolist(), motions, strict=True):
        inverse = np.linalg.pinv(motion)
        coefficients, ways = np.linalg.eigh(inverse.T @ (impedance / len(chosen)) @ inverse)
        for c, way in zip(coefficients.tolist(), ways.T.tolist(), strict=True):
            if c > NEGLIGIBLE * coefficients[-1]:
                found.append(Dashpot(c, nodes=[node], direction=tuple(way)))
    return found


def _rigid(points: NDArray, axis: NDArray, center: NDArray, turns: bool) -> NDArray[np.float64]:
    """Rigid motions (n, 3, k) of points (n, 3) of a section: along an axis, and about it."""
    along = np.broadcast_to(axis, points.shape)
    parts: list[Any] = [along, np.cross(axis, points - center)][: 1 + turns]
    return np.stack(parts, axis=2)


def _lowest(bloch: Bloch, phase: NDArray) -> int:
    """Number of waves to compute so that long waves are among them; at most as many as exist."""
    free = WaveSolver(bloch, 1).free
    if bloch.ties.empty:
        return min(LOOKED_AT, len(free))
    return min(LOOKED_AT, null_space(bloch.ties.at(bloch.factors(phase))[:, free]).shape[1])
