"""Linear pencils of parts that touch through outer unknowns alone, with few motions of each part.

The first unknowns are outer ones; each of the others is inside one part. With K0 and its change K1,
a part follows the outer unknowns by W = -K0_ii^-1 K0_io. Its change moves it further, by
-K0_ii^-1 (K1_io + K1_ii W) for each unit of a factor (modal derivatives: Idelsohn and Cardona,
Comput. Methods Appl. Mech. Eng. 49, 1985). These motions, and those in which the part alone has the
factors nearest to zero, are its own unknowns in a smaller pencil.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from foldyn.algebra.superlu import Factorization, Factorizer, SuperLU

ALONE = 6  # motions of a part alone
ROUGH = 1e-3  # relative residual of these: they only add to a basis
ALIKE = 1e-6  # energy of a motion, after that of others, relative to theirs, below which it is left


class _Part(NamedTuple):
    inside: NDArray  # (i,) unknowns
    outer: NDArray  # (o,) unknowns that it touches
    stiffness: sparse.csc_array  # K0_ii
    factors: Factorization  # of it
    follows: NDArray  # (i, o) W


class Pencil(NamedTuple):
    """The smaller pencil: the outer unknowns first, then those of part after part."""

    stiffness: sparse.csc_array
    change: sparse.csc_array
    motions: list[NDArray]  # of each part's inside, for its own unknowns

    @property
    def first(self) -> NDArray[np.int64]:
        """First own unknown of each part, and the number of all unknowns."""
        own = [motion.shape[1] for motion in self.motions]
        return self.stiffness.shape[0] - sum(own) + np.cumsum([0, *own])


class Substructures:
    """K0 (m, m), symmetric, factorized by parts.

    Parameters
    ----------
    matrix : csr_array
        K0.
    owner : (m - k,)
        The part of each unknown after the k outer ones.
    factorize : callable
        Factorizes the matrix (k, k) of the outer unknowns.
    """

    def __init__(self, matrix: sparse.csr_array, owner: NDArray, factorize: Factorizer) -> None:
        self.size = matrix.shape[0]
        self.count = k = self.size - len(owner)
        self._parts, blocks = [], []
        for number in np.unique(owner):
            inside = k + np.flatnonzero(owner == number)
            rows = matrix[inside]
            touched = sparse.csc_array(rows[:, :k])
            outer = np.flatnonzero(np.diff(touched.indptr))
            between = touched[:, outer].toarray()
            own = sparse.csc_array(rows[:, inside])
            factors = SuperLU(own)
            follows = -factors.solve(between)
            self._parts.append(_Part(inside, outer, own, factors, follows))
            blocks.append((outer, between.T @ follows))
        self.stiffness = _assembled(blocks, k, matrix[:k, :k])
        self.outer = factorize(self.stiffness)

    def solve(self, force: NDArray) -> NDArray[np.float64]:
        """Solution (m,) of K0 x = f."""
        left, out = force[: self.count].copy(), np.zeros(self.size)
        for part in self._parts:
            np.add.at(left, part.outer, part.follows.T @ force[part.inside])
        out[: self.count] = self.outer.solve(left)
        for part in self._parts:
            own = part.factors.solve(force[part.inside])
            out[part.inside] = own + part.follows @ out[part.outer]
        return out

    def pencil(self, change: sparse.csr_array) -> Pencil:
        """The smaller pencil, with the change K1 (m, m) of K0, symmetric."""
        k, blocks, motions, size = self.count, [], [], self.count
        for part in self._parts:
            rows = change[part.inside]
            own = sparse.csr_array(rows[:, part.inside])
            moved = rows[:, part.outer].toarray() + own @ part.follows
            basis = _basis(part, own, moved)
            motions.append(basis)
            pushed = rows[:, part.outer].T @ part.follows
            both, once = part.follows.T @ moved + pushed, moved.T @ basis
            block = np.block([[both, once], [once.T, basis.T @ (own @ basis)]])
            blocks.append((np.append(part.outer, size + np.arange(basis.shape[1])), block))
            size += basis.shape[1]
        more = sparse.eye_array(size - k)
        stiffness = sparse.csc_array(sparse.block_diag([self.stiffness, more]))
        return Pencil(stiffness, _assembled(blocks, size, change[:k, :k]), motions)

    def whole(self, pencil: Pencil, motions: NDArray) -> NDArray[np.float64]:
        """Motions (m, j) of all unknowns, from those of a smaller pencil."""
        out, first = np.zeros((self.size, motions.shape[1])), pencil.first
        out[: self.count] = motions[: self.count]
        for number, part in enumerate(self._parts):
            own = motions[first[number] : first[number + 1]]
            out[part.inside] = part.follows @ motions[part.outer] + pencil.motions[number] @ own
        return out


def _basis(part: _Part, change: sparse.csr_array, moved: NDArray) -> NDArray[np.float64]:
    """Motions (i, n), orthonormal in K0_ii: answers to forces `moved` (i, o), and a part's own."""
    found = [part.factors.solve(moved)]
    if change.nnz and abs(change).max() > 0.0:
        start = np.random.default_rng(0).standard_normal(len(moved))
        inverse = LinearOperator(change.shape, matvec=part.factors.solve, dtype=float)
        try:
            own = eigsh(
                change, min(ALONE, len(moved) - 2), M=part.stiffness, Minv=inverse, which="BE",
                tol=ROUGH, v0=start,
            )[1]  # fmt: skip
        except ArpackNoConvergence as error:
            own = error.eigenvectors
        found.append(own)
    motions = np.hstack(found)
    energy = np.einsum("ik,ik->k", motions, part.stiffness @ motions)
    motions = motions[:, energy > 0.0] / np.sqrt(energy[energy > 0.0])
    values, ways = eigh(motions.T @ (part.stiffness @ motions))
    kept = values > ALIKE * values.max(initial=0.0)
    return motions @ (ways[:, kept] / np.sqrt(values[kept]))


def _assembled(
    blocks: list[tuple[NDArray, NDArray]], size: int, outer: sparse.csr_array
) -> sparse.csc_array:
    """Symmetric matrix (size, size): that of the outer unknowns, and blocks on unknowns."""
    row = np.concatenate([np.repeat(at, len(at)) for at, _ in blocks])
    column = np.concatenate([np.tile(at, len(at)) for at, _ in blocks])
    value = np.concatenate([block.ravel() for _, block in blocks])
    whole = sparse.coo_array((value, (row, column)), shape=(size, size)).tocsr()
    whole = whole + sparse.coo_array((outer.tocoo().data, outer.tocoo().coords), shape=whole.shape)
    return sparse.csc_array(0.5 * (whole + whole.T))
