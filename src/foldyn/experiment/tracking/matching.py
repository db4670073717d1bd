"""Match corners to nodes: project the model, assign corners to nodes, search for all nodes.

A folded sheet looks much the same when shifted by one cell. So placements are ranked by the number
of nodes confirmed in the picture, where edges meet at the node's predicted position.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from foldyn.arguments import brief
from foldyn.errors import InputError
from foldyn.experiment.camera import axes_of_view
from foldyn.experiment.tracking.corners import refine
from foldyn.experiment.tracking.follow import Array, by_neighbors, distances
from foldyn.experiment.tracking.view import View, fit_view, hidden_nodes
from foldyn.values import number

_TURNS = np.radians(np.arange(-12.0, 12.1, 4.0))  # rotations of the image about the line of sight
# unknown scales are tried relative to an estimate from the size
_SCALES = np.exp(np.linspace(-0.35, 0.35, 15))
_STATES = 9  # number of states of a path that are tried before the best is refined
_BEST = 6  # number of placements that are refined
_FEWEST = 6  # with fewer matched nodes, a placement is due to chance
_LEAST_SHARE = 0.5  # smallest share of the visible nodes that must be found
_NEIGHBORS, _FIRMNESS = 6, 0.1  # number of neighbors and firmness in `by_neighbors`
_STRAY = 0.2  # largest deviation from the neighbors' prediction, relative to node spacing


@dataclass(frozen=True)
class Placing:
    """What the user knows about how the camera sees the model.

    Attributes
    ----------
    up, facing : str
        Directions of the model that point up in the image and towards the camera.
    metres_per_pixel : float or None
        Scale in the plane of the model nearest to the camera; if None, it is fitted.
    distance : float or None
        Distance of that plane from the camera (m); if None, it is fitted.
    axis : tuple of float or None
        Pixel on the camera's axis; None means the middle of the whole image.
    """

    up: str = "-x"
    facing: str = "z"
    metres_per_pixel: float | None = None
    distance: float | None = None
    axis: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        axes_of_view(self.up, self.facing)
        if self.distance is not None:
            number("--distance", self.distance, above=0.0, unit="m")


@brief
@dataclass(frozen=True)
class Match:
    """Nodes that were recognized in a picture.

    Attributes
    ----------
    node : ndarray of int, shape (m,)
        Numbers of the nodes, increasing.
    uv : ndarray, shape (m, 2)
        Pixels of these nodes.
    view : View
    positions : ndarray, shape (n, 3)
        Positions of all nodes (m) in the state that fits best.
    state : float
        Position of that state among the states: 2.5 is halfway between states 2 and 3.
    rms : float
        Root mean square distance between seen and projected nodes (pixels): how far the specimen
        differs from the model.
    seen : ndarray of bool, shape (n,)
        Nodes that no panel hides.
    expected : ndarray, shape (n, 2)
        Pixel of each node, measured or not, as predicted by its neighbors.
    """

    node: NDArray[np.int64]
    uv: Array
    view: View
    positions: Array
    state: float
    rms: float
    seen: NDArray[np.bool_]
    expected: Array


def match_nodes(
    image: NDArray[np.uint8],
    corners: Array,
    *,
    states: Array,
    triangles: NDArray[np.int64],
    nodes: NDArray[np.int64],
    placing: Placing,
    reach: float,
    place: str = "the picture",
) -> Match:
    """Recognize the nodes of a model in a picture.

    The model is placed on the corners in every way that `placing` leaves open. The placements with
    most nodes on corners are refined by alternating the assignment of nodes to corners (shortest
    total distance) and a fit of the view and the state. Nodes without a corner are searched for at
    their neighbors' prediction. The placement with most nodes wins.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width)
    corners : ndarray, shape (p, 2)
        Corners found in the image (pixels).
    states : ndarray, shape (k, n, 3)
        Positions of all nodes (m) in the possible states of the model, in the order of a path.
    triangles : ndarray, shape (m, 3)
        Panels, which may hide nodes.
    nodes : ndarray of int
        Nodes that may be seen: the vertices of the pattern.
    placing : Placing
    reach : float
        Length of the edges that make a corner (pixels).
    place : str
        Name of the picture in messages.

    Returns
    -------
    Match

    Raises
    ------
    InputError
        There are too few corners, or no placement has enough confirmed nodes.
    """
    if len(corners) < _FEWEST:
        raise InputError(
            f"{place}: {len(corners)} corners found in it; at least {_FEWEST} are needed to "
            "recognize nodes of the model"
        )
    tried = [
        _refined(image, corners, states, index, view, triangles, nodes, placing, reach)
        for view, index in _placements(corners, states[:, nodes], placing)
    ]
    best = max(filter(None, tried), key=lambda one: (len(one.node), -one.rms), default=None)
    count = 0 if best is None else len(best.node)
    if best is None or count < max(_FEWEST, _LEAST_SHARE * best.seen[nodes].sum()):
        raise InputError(
            f"{place}: the model's nodes do not fall on the {len(corners)} corners found there (at "
            f"best {count} of {len(nodes)}): check --roi, --up, --facing and --scale, choose the "
            "frame by --match, or give the path of a statics case as --model, whose states are "
            "tried"
        )
    return best


def _placements(uv: Array, states: Array, placing: Placing) -> list[tuple[View, int]]:
    """Best placements of the model on the points, ranked by nodes that fall on a point."""
    tree = cKDTree(uv)
    axes = axes_of_view(placing.up, placing.facing)
    chosen = np.unique(np.linspace(0, len(states) - 1, _STATES).round().astype(int))
    ranked = []
    for index in chosen.tolist():
        seen = (states[index] - states[index].mean(axis=0)) @ axes.T
        spacing = _spacing(seen[:, :2])
        for scale in _scales(uv, seen, placing):
            for turn in _TURNS:
                c, s = np.cos(turn), np.sin(turn)
                flat = seen[:, :2] @ np.array([[c, s], [-s, c]]) / scale
                tolerance = 0.3 * spacing / scale
                shift = _most_votes(uv, flat, tolerance)
                distance, partner = tree.query(flat + shift, distance_upper_bound=tolerance)
                hits = np.isfinite(distance)
                count = len(np.unique(partner[hits]))
                rest = float(distance[hits].mean() / tolerance) if hits.any() else 1.0
                ranked.append((count - rest, index, scale, turn, shift))
    ranked.sort(key=lambda one: -one[0])
    return [
        (_view_of(states[index], axes, scale, turn, shift, placing), index)
        for _, index, scale, turn, shift in ranked[:_BEST]
    ]


def _scales(uv: Array, seen: Array, placing: Placing) -> Array:
    """Scales to try (metres per pixel), in the middle plane of the model."""
    if placing.metres_per_pixel is not None:
        near = -seen[:, 2].min()
        deeper = 1.0 if placing.distance is None else 1.0 + near / placing.distance
        return placing.metres_per_pixel * deeper * np.array([0.98, 1.0, 1.02])
    size = np.linalg.norm(np.ptp(np.quantile(uv, [0.02, 0.98], axis=0), axis=0))
    return float(np.linalg.norm(np.ptp(seen[:, :2], axis=0))) / float(size) * _SCALES


def _most_votes(uv: Array, flat: Array, tolerance: float) -> Array:
    """Shift that puts most nodes on points; every pair of node and point votes for its shift."""
    votes = (uv[:, np.newaxis] - flat).reshape(-1, 2)
    cell = np.floor((votes - votes.min(axis=0)) / tolerance).astype(np.int64)
    width = cell[:, 0].max() + 2
    table = np.bincount(cell[:, 1] * width + cell[:, 0], minlength=width * (cell[:, 1].max() + 2))
    table = np.pad(table, (0, -len(table) % width)).reshape(-1, width)
    block = table[:-1, :-1] + table[1:, :-1] + table[:-1, 1:] + table[1:, 1:]
    row, column = np.unravel_index(int(block.argmax()), block.shape)
    own = ((cell - [column, row] >= 0) & (cell - [column, row] <= 1)).all(axis=1)
    return np.median(votes[own], axis=0)


def _spacing(flat: Array) -> float:
    """Median distance of a node to its nearest neighbor in the picture."""
    return float(np.median(distances(flat).min(axis=1)))


def _view_of(
    points: Array, axes: Array, scale: float, turn: float, shift: Array, placing: Placing
) -> View:
    """View of a placement, with the scale in the plane of the model nearest to the camera."""
    middle = points.mean(axis=0)
    nearest = ((points - middle) @ axes[2]).min()
    distance = placing.distance or 1e3 * float(np.ptp(points, axis=0).max())
    c, s = np.cos(turn), np.sin(turn)
    spin = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    axis = shift if placing.axis is None else np.asarray(placing.axis, dtype=np.float64)
    front = middle + nearest * axes[2]
    ratio = 1.0 - nearest / distance
    known = placing.metres_per_pixel
    center = axis + (shift - axis) * ratio
    return View(spin @ axes, front, center, known or scale / ratio, distance, axis)


def _refined(
    image: NDArray[np.uint8],
    corners: Array,
    states: Array,
    index: int,
    view: View,
    triangles: NDArray[np.int64],
    nodes: NDArray[np.int64],
    placing: Placing,
    reach: float,
) -> Match | None:
    """Alternate assignment and fit, then search for all nodes."""
    state, positions = float(index), states[index]
    known = placing.metres_per_pixel is not None, placing.distance is not None
    for part in (0.45, 0.35, 0.3, 0.25):
        asked = nodes[~hidden_nodes(positions, triangles, view)[nodes]]
        flat = view.project(positions[asked])
        row, point = assign(flat, corners, part * _spacing(flat))
        if len(row) < _FEWEST:
            return None
        view, state, positions, _ = _fitted(view, states, state, asked[row], corners[point], known)
    place = np.full((len(positions), 2), np.nan)
    place[asked[row]] = corners[point]
    for _ in range(3):
        seen = ~hidden_nodes(positions, triangles, view)
        place = _looked_up(image, place, view.project(positions), nodes[seen[nodes]], reach)
        node = np.flatnonzero(np.isfinite(place[:, 0]))
        if len(node) < _FEWEST:
            return None
        view, state, positions, rms = _fitted(view, states, state, node, place[node], known)
    flat = view.project(positions)
    expected = by_model(place, flat, np.arange(len(flat)))
    expected = np.where(np.isfinite(expected), expected, flat)
    return Match(node, place[node], view, positions, state, rms, seen, expected)


def _fitted(
    view: View,
    states: Array,
    state: float,
    node: NDArray[np.int64],
    uv: Array,
    known: tuple[bool, bool],
) -> tuple[View, float, Array, float]:
    """View, state, positions of all nodes in this state, and the residual (pixels, rms)."""
    last = len(states) - 1
    ends = max(state - 3.0, 0.0), min(state + 3.0, float(last))
    around = np.stack([_between(states, end)[node] for end in ends]) if last else None
    view, step, rms = fit_view(view, _between(states, state)[node], uv, *known, around)
    state += abs(step) * ((ends[1] if step > 0.0 else ends[0]) - state)
    return view, state, _between(states, state), rms


def _looked_up(
    image: NDArray[np.uint8], place: Array, flat: Array, asked: NDArray[np.int64], reach: float
) -> Array:
    """Positions of requested nodes, found where edges meet near their neighbors' prediction."""
    kept = _without_strays(place, flat, asked)
    missing = np.where(np.isfinite(kept), np.nan, by_model(kept, flat, asked))
    junctions = refine(image, missing, reach=reach, moved=0.6 * reach)
    for node in np.flatnonzero(np.isfinite(junctions.position[:, 0]) & (junctions.error < 0.5)):
        apart = np.hypot(*(kept - junctions.position[node]).T)
        if not (apart < 0.5 * reach).any():  # otherwise the corner belongs to another node
            kept[node] = junctions.position[node]
    return kept


def _without_strays(place: Array, flat: Array, asked: NDArray[np.int64]) -> Array:
    """Positions of nodes, without positions that contradict their neighbors.

    Contradicting positions are removed one by one, worst first, because a wrong position also
    disturbs its neighbors' prediction.
    """
    kept = np.full(place.shape, np.nan)
    kept[asked] = place[asked]
    limit = max(_STRAY * _spacing(flat[asked]), 2.0)
    for _ in range(len(asked)):
        stray = np.hypot(*(kept - by_model(kept, flat, asked)).T)
        if not np.isfinite(stray).any():
            break
        allowed = min(limit, max(6.0 * float(np.nanmedian(stray)), 1.5))
        worst = int(np.nanargmax(stray))
        if stray[worst] <= allowed:
            break
        kept[worst] = np.nan
    return kept


def by_model(place: Array, flat: Array, asked: NDArray[np.int64]) -> Array:
    """Predict nodes (n, 2) from the deviation of their neighbors from the projected model, `flat`.

    NaN for nodes not in `asked`, and if fewer than four neighbors are known.
    """
    reference = np.broadcast_to(flat, (len(flat), *flat.shape))
    return by_neighbors(reference, place, asked, _NEIGHBORS, _FIRMNESS, robust=True)[0]


def _between(states: Array, state: float) -> Array:
    """State interpolated between two states of a path."""
    if len(states) == 1:
        return states[0]
    low = min(int(state), len(states) - 2)
    return states[low] + (state - low) * (states[low + 1] - states[low])


def assign(nodes: Array, points: Array, limit: float) -> tuple[NDArray, NDArray]:
    """Pairs of nodes and points (pixels), none beyond a limit, of shortest total distance."""
    distance = np.hypot(*(nodes[:, np.newaxis] - points).transpose(2, 0, 1))
    # an unpaired node costs the limit, so no pair is farther apart
    padded = np.concatenate([np.minimum(distance, 1e6), np.full((len(nodes),) * 2, limit)], axis=1)
    rows, columns = linear_sum_assignment(padded)
    paired = columns < len(points)
    return rows[paired], columns[paired]
