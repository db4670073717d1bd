"""Modal assurance criterion: similarity of the shapes of two sets of modes.

MAC_ij = |a_i^H W b_j|^2 / ((a_i^H W a_i) (b_j^H W b_j)): 1 for the same shape of any size and sign,
0 for orthogonal shapes. W is the mass, or the identity (Allemang and Brown, Proc. 1st Int. Modal
Analysis Conf., 1982; with weights Allemang, Sound and Vibration 37, 2003).

Modes of nearly equal frequency mix at the slightest disturbance, so `pairs` compares a cluster of
such modes as a space: the mean squared cosine between two spaces replaces the MAC of every pair of
modes in them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from foldyn.errors import InputError
from foldyn.values import numbers

NEAR = 3e-3  # largest relative distance of neighboring frequencies in a cluster
SAME_PLACE = 1e-6  # largest distance of a matching node, relative to the size of the pattern
FREQUENCY_WEIGHT = 0.05  # factor of |log(f_b / f_a)| in a pair's cost, in addition to 1 - MAC


def mac(a: Any, b: Any, *, mass: Any = None, nodes: Any = None) -> NDArray[np.float64]:
    """Modal assurance criteria between two sets of shapes.

    Parameters
    ----------
    a, b : xarray.Dataset or array_like, shapes (ka, n, 3) and (kb, n, 3)
        Modes from `foldyn.modes`, or other shapes, also complex (measured, or of a damped
        structure). Arrays (k, n) are shapes with one component per node.
    mass : array_like or sparse matrix, optional
        Weights: nodal masses (n,) or the nodal mass matrix (n, n) of the compared nodes, such as
        `Case.mass`. With the mass, modes of one structure are orthogonal: the matrix of a set with
        itself is the identity. Without it, all nodes count equally.
    nodes : array_like of int, or a pair of them, optional
        Nodes to compare: numbers that refer to the same node in both sets, or (numbers in a,
        numbers in b) for models that share only some nodes. All nodes by default.

    Returns
    -------
    ndarray, shape (ka, kb)
        Numbers from 0 to 1; nan if a shape does not move the compared nodes.

    Raises
    ------
    InputError
        The sets have different nodes, or the mass does not belong to them.
    """
    first, second = _chosen(_shapes("a", a), _shapes("b", b), nodes)
    left, right = (shapes.reshape(len(shapes), -1) for shapes in (first, second))
    heavy_left, heavy_right = _weighted(first, mass), _weighted(second, mass)
    cross = np.abs(left.conj() @ heavy_right.T) ** 2
    own_left = np.einsum("ki,ki->k", left.conj(), heavy_left).real
    own_right = np.einsum("ki,ki->k", right.conj(), heavy_right).real
    own = np.outer(own_left, own_right)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.minimum(np.where(own > 0.0, cross / own, np.nan), 1.0)


class Pairs(NamedTuple):
    """Paired modes of two sets, numbered from 0 like the rows of the sets."""

    first: NDArray[np.int64]  # (k,) increasing
    second: NDArray[np.int64]  # (k,) partners of `first`
    mac: NDArray[np.float64]  # (k,)


def pair_modes(values: ArrayLike, least: float = 0.0) -> Pairs:
    """Pair the modes of two sets so that the sum of their MAC is greatest.

    Each mode has at most one partner. Two modes of equal frequency, whose shapes may mix, are
    better compared as a pair than mode by mode.

    Parameters
    ----------
    values : array_like, shape (ka, kb)
        From `mac`.
    least : float
        Pairs with a smaller MAC are left out.

    Returns
    -------
    Pairs
        Numbers of the modes in the first set, of their partners in the second, and their MAC.
    """
    from scipy.optimize import linear_sum_assignment

    matrix = np.asarray(values, float)
    if matrix.ndim != 2 or not matrix.size:
        raise InputError(f"values: shape {matrix.shape}: give the matrix of mac(a, b)")
    known = np.nan_to_num(matrix, nan=0.0)
    first, second = linear_sum_assignment(known, maximize=True)
    kept = known[first, second] >= least
    first, second = first[kept], second[kept]
    return Pairs(first, second, matrix[first, second])


def _shapes(name: str, given: Any) -> NDArray:
    """Shapes (k, n, components) of a dataset or an array."""
    if hasattr(given, "data_vars"):
        if "shape" not in given:
            raise InputError(f"{name}: the dataset has no shapes; give modes from foldyn.modes")
        given = given["shape"].transpose("mode", "node", "axis").values
    try:
        array = np.asarray(given)
    except ValueError:
        raise InputError(f"{name}: the shapes have different lengths") from None
    if array.ndim == 2:
        array = array[:, :, None]
    if array.ndim != 3 or not array.size or array.dtype.kind not in "fciu":
        raise InputError(
            f"{name}: shape {array.shape}: give shapes (modes, nodes, axes) or modes from "
            "foldyn.modes"
        )
    return array if array.dtype.kind == "c" else array.astype(float)


def _chosen(first: NDArray, second: NDArray, nodes: Any) -> tuple[NDArray, NDArray]:
    """The shapes of both sets at the compared nodes."""
    if nodes is not None:
        pair = nodes if isinstance(nodes, tuple) and len(nodes) == 2 else (nodes, nodes)
        first, second = (_at(s, n) for s, n in zip((first, second), pair, strict=True))
    if first.shape[1:] != second.shape[1:]:
        raise InputError(
            f"a has {first.shape[1]} nodes with {first.shape[2]} components, b "
            f"{second.shape[1]} with {second.shape[2]}: give nodes = (numbers in a, numbers in b) "
            "of the nodes that they share"
        )
    return first, second


def _at(shapes: NDArray, nodes: Any) -> NDArray:
    try:
        chosen: NDArray = np.asarray(nodes)
    except ValueError:  # lists of different lengths
        chosen = np.zeros(0)
    if chosen.ndim != 1 or not chosen.size or chosen.dtype.kind not in "iu":
        raise InputError(f"nodes = {nodes!r}: give numbers of nodes, or a pair of such lists")
    beyond = chosen[(chosen < 0) | (chosen >= shapes.shape[1])]
    if beyond.size:
        raise InputError(f"nodes: there is no node {beyond[0]}; there are {shapes.shape[1]}")
    return shapes[:, chosen]


def _weighted(shapes: NDArray, mass: Any) -> NDArray:
    """Flat shapes (k, nodes * components), multiplied by the mass."""
    count, nodes, components = shapes.shape
    if mass is None:
        return shapes.reshape(count, -1)
    matrix = mass if sparse.issparse(mass) else numbers("mass", mass)
    if matrix.shape == (nodes,):
        matrix = sparse.diags_array(matrix)
    if matrix.shape != (nodes, nodes):
        raise InputError(
            f"mass: shape {matrix.shape}: give masses ({nodes},) or a matrix ({nodes}, {nodes}) "
            "of the nodes that are compared"
        )
    product = matrix @ shapes.transpose(1, 0, 2).reshape(nodes, -1)
    return product.reshape(nodes, count, components).transpose(1, 0, 2).reshape(count, -1)


def same_places(points: NDArray, nodes: NDArray, size: float) -> tuple[NDArray, NDArray]:
    """Numbers (j,) of the nodes (n, 3) that lie on points (p, 3), and of these points (j,).

    size : size of the pattern, m.
    """
    from scipy.spatial import cKDTree

    apart, place = cKDTree(points).query(nodes)
    seen = np.flatnonzero(apart < SAME_PLACE * size)
    return seen, place[seen]


def clusters(frequency: NDArray) -> NDArray:
    """Number (k,) of the cluster to which each frequency (k,) belongs; frequencies increase."""
    return np.concatenate([[0], np.cumsum(np.diff(frequency) > NEAR * frequency[1:])])


def likeness(fa: NDArray, a: NDArray, fb: NDArray, b: NDArray, mass: NDArray) -> NDArray:
    """MAC (ka, kb) of shapes (ka, n, 3) and (kb, n, 3), averaged over clusters."""
    # shapes that do not move these nodes have no similar shape
    values = np.nan_to_num(mac(a, b, mass=mass))
    left, right = (own == np.unique(own)[:, None] for own in (clusters(fa), clusters(fb)))
    fewest = np.minimum.outer(left.sum(axis=1), right.sum(axis=1))
    return np.minimum(left.T @ (left @ values @ right.T / fewest) @ right, 1.0)


def pairs(fa: NDArray, a: NDArray, fb: NDArray, b: NDArray, mass: NDArray) -> Pairs:
    """Pairs of modes, in the order of the first set.

    Parameters
    ----------
    fa, fb : (ka,), (kb,)
        Frequencies (Hz, increasing).
    a, b : (ka, n, 3), (kb, n, 3)
        Shapes.
    mass : (n,)
        Weights of the nodes.
    """
    from scipy.optimize import linear_sum_assignment

    if not len(fa) or not len(fb):
        return Pairs(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))
    alike = likeness(fa, a, fb, b, mass)
    cost = 1.0 - alike + FREQUENCY_WEIGHT * np.abs(np.log(fb[None, :] / fa[:, None]))
    first, second = linear_sum_assignment(cost)
    return Pairs(first, second, alike[first, second])
