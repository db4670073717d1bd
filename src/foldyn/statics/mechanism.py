"""Mechanisms: motions without resistance, found and named before a path is computed.

Hinges count with their stiffness k whatever their law (superlinear bends have zero slope at rest,
but still resist), and internal forces do not count: the criterion is whether a motion stretches a
bar or turns a hinge at all.

Rigid motions follow from the supports alone, including springs and clamped edges. For others the
stiffness matrix is factorized; only if its smallest eigenvalue is suspicious are its softest modes
computed, and a mode is a mechanism if its strain is round-off. Bars are judged by their
elongations, which are accurate to round-off: soft modes of a large sheet are millions of times
softer than its bars and still not free.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.solvers import factorized
from foldyn.algebra.superlu import Factorization
from foldyn.errors import InputError
from foldyn.mechanics.term import Unstrained
from foldyn.statics.equilibrium import OrigamiProblem
from foldyn.statics.rigid import AXES, name_rigid_motions
from foldyn.statics.stability import softest_modes

SHIFT = 1e-13  # of the diagonal, added so that the matrix of a mechanism can be factorized
SUSPICIOUS = 1e-11  # eigenvalue, of the matrix with a unit diagonal, below which modes are computed
INVERSE_ITERATIONS = 4
MOST_MODES = 12
BAR_STRAIN = 1e-9  # elongations, relative to the largest that their end motions allow
HINGE_STRAIN = 1e-6  # likewise, turns of hinges
MOVED = 0.3  # of the largest motion: nodes beyond it are named
MOST_NAMED = 8


def refuse_mechanisms(problem: OrigamiProblem, factor: float = 0.0) -> None:
    """Refuse a case whose supports or members leave a mechanism, naming its motions.

    factor : load factor at the start, where planes in contact also hold the structure.

    Raises
    ------
    InputError
        The structure can move without strain.
    """
    names = mechanisms(problem, factor)
    if names:
        raise InputError(
            f"the structure can move freely: {'; '.join(names)}. Statics needs supports (and bars "
            "and hinges) that resist every motion: hold what moves, or take inertia_relief = true "
            "for a free body"
        )


def mechanisms(problem: OrigamiProblem, factor: float = 0.0) -> list[str]:
    """Free motions in words: rigid ones, or, if there are none, internal mechanisms."""
    structure = problem.structure
    start = problem.start(factor)
    body = problem.body(start, 0.0)
    x, q = structure.nodes + problem.displacement(start), problem.dofs(start)
    rigid = name_rigid_motions(x, problem.pinned, body.holds(q))
    unstrained = None if rigid else body.unstrained(q)
    if unstrained is None:
        return rigid
    return [_name(mode.reshape(-1, 3)) for mode in free_modes(problem, unstrained).T]


def _name(mode: NDArray) -> str:
    """An internal mechanism (n, 3) in words: its nodes, and its axis if it has one."""
    size = np.linalg.norm(mode, axis=1)
    moving = np.flatnonzero(size > MOVED * size.max())
    moving = moving[np.argsort(-size[moving], kind="stable")]
    nodes = ", ".join(map(str, sorted(moving[:MOST_NAMED].tolist())))
    more = f" and {len(moving) - MOST_NAMED} more" if len(moving) > MOST_NAMED else ""
    share = (mode[moving] ** 2).sum(axis=0)
    axis = int(np.argmax(share))
    along = f" along {AXES[axis]}" if share[axis] > 0.9 * share.sum() else ""
    plural = "s" if len(moving) > 1 else ""
    return f"internal mechanism that moves node{plural} {nodes}{more}{along}"


def free_modes(problem: OrigamiProblem, unstrained: Unstrained) -> NDArray:
    """Orthonormal motions (m, k) of the free dofs that strain nothing."""
    free = problem.free
    ties = problem.case.constraints
    matrix = ties.matrix(unstrained.tangent)[free][:, free].tocsc()
    diagonal = matrix.diagonal()
    if not (diagonal > 0.0).all():
        return _unresisted(problem, diagonal)
    scale = 1.0 / np.sqrt(diagonal)  # scaled so that all pivots are of similar size
    scaled = sparse.csc_array(matrix.multiply(scale[:, None]).multiply(scale[None, :]))
    size = len(free)
    shifted = sparse.csc_array(scaled + SHIFT * sparse.eye_array(size, format="csc"))
    factors = factorized(shifted)
    if _softest(factors, size) > SUSPICIOUS:
        return np.zeros((len(diagonal) + len(problem.held), 0))
    values, vectors = softest_modes(scaled, factors, MOST_MODES, dense=600, shift=-SHIFT)
    vectors = vectors[:, np.argsort(values, kind="stable")[:MOST_MODES]]
    shapes = np.zeros((size + len(problem.held), vectors.shape[1]))
    shapes[free] = vectors * scale[:, None]
    shapes = problem.dofs(shapes)
    kept = [k for k, mode in enumerate(shapes.T) if _strains_nothing(unstrained, mode)]
    return np.linalg.qr(shapes[:, kept])[0] if kept else shapes[:, :0]


def _softest(factors: Factorization, size: int) -> float:
    """Upper bound of the smallest eigenvalue, by a few inverse iterations."""
    value, guess = np.inf, np.random.default_rng(0).standard_normal(size)
    for _ in range(INVERSE_ITERATIONS):
        guess = guess / np.linalg.norm(guess)
        guess = factors.solve(guess)
        value = 1.0 / float(np.linalg.norm(guess))
    return value


def _unresisted(problem: OrigamiProblem, diagonal: NDArray) -> NDArray:
    """Motions of single dofs that no member touches."""
    loose = problem.free[diagonal <= 0.0]
    modes = np.zeros((problem.structure.nodes.size, len(loose)))
    modes[loose, np.arange(len(loose))] = 1.0
    return problem.case.constraints.displacement(modes)


def _strains_nothing(unstrained: Unstrained, mode: NDArray) -> bool:
    """Whether the strain of a mode is round-off."""
    if unstrained.stretch(mode) > BAR_STRAIN:
        return False
    turned = float(mode @ (unstrained.hinges @ mode))
    return turned <= HINGE_STRAIN**2 * float(unstrained.hinges.diagonal() @ mode**2)
