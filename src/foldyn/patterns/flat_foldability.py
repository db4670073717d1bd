"""Local flat-foldability of a pattern's vertices, and the nearest pattern with this property.

The conditions of Maekawa and Kawasaki are necessary at each interior vertex, but not sufficient for
the whole pattern, because its layers may collide. Maekawa's condition: the number of mountains
minus the number of valleys is 2 or -2. Kawasaki's condition: the angles between neighboring
creases, taken with alternating signs, add up to zero (T. Hull, On the mathematics of flat origamis,
Congressus Numerantium 100, 1994).

`flat_foldable` repairs small errors of a drawing by two conditions. First, Kawasaki's alternating
sum of angles must vanish; it is twice the alternating sum of the crease directions f. Second, where
four creases meet, the fold angles g of neighboring creases have a fixed ratio of tan(g/2); a panel
between such vertices stays plane if the product of the ratios at its corners is 1 (T. Tachi,
Generalization of rigid-foldable quadrilateral-mesh origami, J. IASS 50, 2009). Both conditions
depend on directions only. If the ends a and b of a crease move, its direction changes by
df = (e x d(b - a)) / l, where e is the unit vector along the crease and l its length. Newton's
method finds the vertices x that satisfy the conditions and are nearest to the drawn vertices x0:
each step solves the conditions, linearized at x, with the least x - x0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.errors import ComputationError, InputError
from foldyn.patterns.pattern import Pattern, pattern_of
from foldyn.patterns.topology import Edge, around, edge_of
from foldyn.patterns.transforms import refuse_boards


@dataclass(frozen=True, eq=False, repr=False)
class FlatFoldability:
    """Flat-foldability of a pattern, with one row for each interior vertex.

    Attributes
    ----------
    vertices : ndarray of int, shape (k,)
        Numbers of the interior vertices: vertices that panels surround completely.
    mountains, valleys, unassigned : ndarray of int, shape (k,)
        Number of creases of each kind at each vertex; flat creases ("F") do not count.
    deficits : ndarray, shape (k,)
        Angle deficit (rad): a full turn minus the sum of panel angles; 0 at developable vertices.
    alternating : ndarray, shape (k,)
        Kawasaki's alternating sum (rad, not negative) of the angles between folded creases; NaN if
        the number of folded creases is odd, 0 if no crease folds.
    """

    vertices: NDArray[np.int64]
    mountains: NDArray[np.int64]
    valleys: NDArray[np.int64]
    unassigned: NDArray[np.int64]
    deficits: NDArray[np.float64]
    alternating: NDArray[np.float64]

    def __repr__(self) -> str:
        """One line."""
        return f"<FlatFoldability of {len(self.vertices)} vertices>"

    @property
    def degrees(self) -> NDArray[np.int64]:
        """Number of folded creases at each vertex (k,)."""
        return self.mountains + self.valleys + self.unassigned

    @property
    def maekawa(self) -> NDArray[np.bool_]:
        """Whether mountains minus valleys are 2 or -2 (k,), or can be once all have letters."""
        least = self.mountains - self.valleys - self.unassigned
        most = self.mountains - self.valleys + self.unassigned
        reached = ((least <= 2) & (most >= 2)) | ((least <= -2) & (most >= -2))
        return (self.degrees == 0) | ((self.degrees % 2 == 0) & reached)

    def kawasaki(self, tolerance: float) -> NDArray[np.bool_]:
        """Whether the alternating sum is zero within a tolerance (rad) (k,)."""
        return self.alternating <= tolerance  # False for NaN

    def developable(self, tolerance: float) -> NDArray[np.bool_]:
        """Whether the angles add up to a full turn within a tolerance (rad) (k,)."""
        return np.abs(self.deficits) <= tolerance


def flat_foldability(pattern: Pattern) -> FlatFoldability:
    """Conditions of Maekawa and Kawasaki, and developability, at interior vertices.

    Parameters
    ----------
    pattern : Pattern
        Flat or folded; only the corner angles of panels matter, and folding preserves them.

    Returns
    -------
    FlatFoldability
        One row for each interior vertex.
    """
    letter = dict(zip(map(tuple, pattern.creases.tolist()), pattern.assignments, strict=True))
    letter |= dict.fromkeys(map(tuple, pattern.welds.tolist()), "F")  # nothing folds there
    outer = set(pattern.boundary.ravel().tolist())
    rows = []
    for vertex, corners in _corners(pattern).items():
        if vertex in outer:
            continue
        around = _around(corners)
        if len(around) < len(corners):
            continue  # panels that touch only at this vertex
        angles = np.array([corners[after][1] for after in around])
        kinds = [letter[min(vertex, after), max(vertex, after)] for after in around]
        folds = np.array([kind != "F" for kind in kinds])
        counts = [kinds.count(kind) for kind in "MVU"]
        rows.append((vertex, *counts, 2 * np.pi - angles.sum(), _alternating(angles, folds)))
    columns = np.array(sorted(rows), dtype=np.float64).reshape(-1, 6).T
    return FlatFoldability(*columns[:4].astype(np.int64), *columns[4:])


def _corners(pattern: Pattern) -> dict[int, dict[int, tuple[int, float]]]:
    """For each vertex, its face corners: a mapping from next vertex to (previous vertex, angle)."""
    faces = pattern.faces
    vertex = np.array([v for face in faces for v in face])
    following = np.array([v for face in faces for v in (*face[1:], face[0])])
    previous = np.array([v for face in faces for v in (face[-1], *face[:-1])])
    normal = np.repeat(pattern.face_normals, [len(face) for face in faces], axis=0)
    after = pattern.vertices[following] - pattern.vertices[vertex]
    before = pattern.vertices[previous] - pattern.vertices[vertex]
    sine = np.einsum("ij,ij->i", np.cross(after, before), normal)
    angle = np.arctan2(sine, np.einsum("ij,ij->i", after, before)) % (2 * np.pi)
    corners: dict[int, dict[int, tuple[int, float]]] = {}
    rows = zip(vertex.tolist(), following.tolist(), previous.tolist(), angle.tolist(), strict=True)
    for v, after_v, before_v, angle_v in rows:
        corners.setdefault(v, {})[after_v] = (before_v, angle_v)
    return corners


def _around(corners: dict[int, tuple[int, float]]) -> list[int]:
    """Neighbors of a vertex counter-clockwise, each before the corner that follows it."""
    first = after = min(corners)
    found = []
    while after in corners:
        found.append(after)
        after = corners[after][0]
        if after == first:
            return found
    return []


def _alternating(angles: NDArray[np.float64], folds: NDArray[np.bool_]) -> float:
    """Kawasaki's sum of the angles after each crease, merged across flat creases."""
    count = int(folds.sum())
    if count == 0:
        return 0.0
    if count % 2:
        return np.nan
    sector = (np.cumsum(folds) - 1) % count  # sector 0 starts at the first fold
    return abs(float(np.sum(np.where(sector % 2 == 0, angles, -angles))))


NEARLY = np.radians(2.0)  # largest Kawasaki sum (rad) that counts as a drawing error
NEARLY_PLANE = 0.1  # largest sum of log ratios around a panel that is meant to stay plane
EXACT = 1e-6  # Kawasaki's sum (rad) that counts as zero, before and after a repair
FARTHEST = 0.01  # largest move of a vertex, relative to its shortest edge
_STEPS = 20
_CONVERGED = 1e-12  # rad, largest sum at convergence
_LEAST = 1e-13  # relative increase of the diagonal, so that redundant conditions do no harm
_PLANE = 1e-9  # largest height of a flat pattern, relative to its size


def slips(vertices: FlatFoldability) -> NDArray[np.int64]:
    """Rows of interior vertices that nearly fold flat, if most do and some are slightly off."""
    known = (vertices.degrees > 2) & ~np.isnan(vertices.alternating)
    near = np.flatnonzero(known & (vertices.alternating <= NEARLY))
    meant = 2 * len(near) > known.sum() and (vertices.alternating[near] > EXACT).any()
    return near if meant else near[:0]


def flat_foldable(pattern: Pattern) -> Pattern:
    """Pattern with vertices moved to the nearest positions that fold flat.

    Interior vertices that violate Kawasaki's condition by at most 2 degrees count as drawing
    errors, and satisfy it to rounding afterwards; larger violations remain. Panels that nearly stay
    plane while folding, between degree-four vertices with letters, afterwards stay exactly plane.
    All vertices may move, including the outline, with the least sum of squared moves.

    Parameters
    ----------
    pattern : Pattern
        A flat pattern.

    Returns
    -------
    Pattern
        The repaired pattern; the given pattern itself if no sum exceeds 1e-6 rad.

    Raises
    ------
    InputError
        The pattern is not flat, or has thick panels.
    ComputationError
        A vertex would move by more than a hundredth of its shortest edge.

    Examples
    --------
    >>> import foldyn as fd
    >>> flat = fd.patterns.miura(cells=(1, 1), dihedral=180).changed(assignments="MVVV")
    >>> drawn = flat.vertices.copy()
    >>> drawn[4, 0] += 0.002
    >>> mended = fd.flat_foldable(flat.changed(vertices=drawn))
    >>> print(abs(mended.vertices - drawn).max().round(4))
    0.0004
    """
    pattern = pattern_of(pattern)
    refuse_boards(pattern, "has thick panels; move the vertices of the thin pattern")
    height = float(np.ptp(pattern.vertices[:, 2]))
    if height > _PLANE * pattern.size or (np.abs(pattern.dihedrals - np.pi) > EXACT).any():
        raise InputError(": is folded; mend the flat drawing, and fold that", "pattern")
    vertices = flat_foldability(pattern)
    rows = slips(vertices)
    if not rows.size:
        return pattern
    drawn, place = np.unique(pattern.vertices[:, :2], axis=0, return_inverse=True)
    place = place.ravel()
    conditions = _Conditions(pattern, vertices.vertices[rows], drawn, place)
    x = drawn
    for _ in range(_STEPS):
        sums, slopes = conditions.at(x)
        if np.abs(sums).max() < _CONVERGED:
            break
        gap = sums - slopes @ (x - drawn).ravel()
        square = (slopes @ slopes.T).tocsc()
        square += _LEAST * sparse.diags_array(square.diagonal(), format="csc")
        x = drawn - (slopes.T @ splu(square).solve(gap)).reshape(-1, 2)
    moved = np.linalg.norm(x - drawn, axis=1)[place]
    _check(pattern, moved, float(np.abs(conditions.at(x)[0]).max()))
    return pattern.changed(vertices=np.column_stack([x[place], pattern.vertices[:, 2]]))


def _check(pattern: Pattern, moved: NDArray, left: float) -> None:
    """Refuse moves that are too large for drawing errors, and sums (rad) that remain."""
    ends = pattern.edges
    length = np.linalg.norm(np.diff(pattern.vertices[ends], axis=1)[:, 0], axis=1)
    shortest = np.full(len(pattern.vertices), np.inf)
    np.minimum.at(shortest, ends.ravel(), np.repeat(length, 2))
    worst = int(np.argmax(moved / shortest))
    if not left < EXACT or moved[worst] > FARTHEST * shortest[worst]:
        raise ComputationError(
            f"no flat-foldable pattern is close enough: vertex {worst} would move by "
            f"{moved[worst]:.3g} m, and its shortest edge is {shortest[worst]:.3g} m long"
        )


class _Conditions:
    """Kawasaki's sums at vertices, and sums of log ratios around the panels between them.

    drawn : positions (k, 2) of the vertices of a flat pattern.
    place : row of each vertex in `drawn`.
    """

    def __init__(self, pattern: Pattern, vertices: NDArray, drawn: NDArray, place: NDArray) -> None:
        letter = dict(zip(map(tuple, pattern.creases.tolist()), pattern.assignments, strict=True))
        beside: dict[int, list[int]] = {vertex: [] for vertex in vertices.tolist()}
        for (a, b), kind in letter.items():
            for one, other in ((a, b), (b, a)):
                if kind != "F" and one in beside:
                    beside[one].append(other)
        spokes: dict[Edge, int] = {}  # row of each direction, by its start and end vertex
        entries = []
        for k, (vertex, others) in enumerate(beside.items()):
            x, y = (drawn[place[others]] - drawn[place[vertex]]).T
            others[:] = [others[turn] for turn in np.argsort(np.arctan2(y, x)).tolist()]
            for rank, other in enumerate(others):
                entries.append((k, len(spokes), 2.0 - 4.0 * (rank % 2)))
                spokes[vertex, other] = len(spokes)
        rows, columns, signs = np.array(entries).T
        self.ends, self.count = place[np.array(list(spokes))], len(drawn)
        self.kawasaki = sparse.csr_array((signs, (rows.astype(int), columns.astype(int))))
        corners = []
        for face in pattern.faces:
            found = [_corner(edge, beside, spokes, letter) for edge in around(face)]
            corners += [(len(corners), *corner) for corner in found if corner and None not in found]
        self.panel, *self.turns = np.array(corners, np.int64).reshape(-1, 5).T
        _, self.panel = np.unique(self.panel, return_inverse=True)
        kept = np.abs(self.at(drawn)[0][len(vertices) :])[self.panel] < NEARLY_PLANE
        _, self.panel = np.unique(self.panel[kept], return_inverse=True)
        self.turns = [column[kept] for column in self.turns]

    def at(self, x: NDArray) -> tuple[NDArray, sparse.csr_array]:
        """Sums (m,), and derivatives (m, 2 k), per m, with respect to positions x (k, 2)."""
        along = x[self.ends[:, 1]] - x[self.ends[:, 0]]
        across = np.column_stack([-along[:, 1], along[:, 0]]) / (along**2).sum(axis=1)[:, None]
        directions = np.arctan2(along[:, 1], along[:, 0])
        columns = 2 * self.ends[:, [1, 1, 0, 0]] + [0, 1, 0, 1]
        entries = np.column_stack([across, -across]).ravel(), columns.ravel()
        rows = np.repeat(np.arange(len(across)), 4)
        turned = sparse.csr_array((entries[0], (rows, entries[1])), (len(across), 2 * self.count))
        sums = (self.kawasaki @ directions + np.pi) % (2.0 * np.pi) - np.pi  # remove full turns
        ratios, slopes = self._ratios(directions)
        return np.concatenate([sums, ratios]), sparse.vstack([self.kawasaki, slopes]) @ turned

    def _ratios(self, directions: NDArray) -> tuple[NDArray, sparse.csr_array]:
        """Sums (p,) of log |tan(g2/2) / tan(g1/2)| around panels, and their derivatives to f.

        Let f1, f2, f3 be the directions f of three neighboring creases; the panel's corner lies
        between f1 and f2. The ratio is h((f3 - f1) / 2) / h(f2 - (f1 + f3) / 2), where h is the
        sine if creases 1 and 3 fold opposite ways, else the cosine.
        """
        one, two, three, opposite = self.turns
        half = 0.5 * (directions[three] - directions[one])
        off = directions[two] - 0.5 * (directions[one] + directions[three])

        def logarithm(angle: NDArray) -> tuple[NDArray, NDArray]:
            value = np.where(opposite, np.sin(angle), np.cos(angle))
            return np.log(np.abs(value)), np.where(opposite, np.cos(angle), -np.sin(angle)) / value

        with np.errstate(divide="ignore", invalid="ignore"):
            (over, rising), (under, falling) = logarithm(half), logarithm(off)
            sums = np.bincount(self.panel, over - under)
        slopes = 0.5 * np.concatenate([falling - rising, -2.0 * falling, rising + falling])
        at = np.tile(self.panel, 3), np.concatenate([one, two, three])
        return sums, sparse.csr_array((slopes, at), shape=(len(sums), len(directions)))


def _corner(
    edge: Edge, beside: Mapping[int, list[int]], spokes: Mapping[Edge, int],
    letter: Mapping[Edge, str],
) -> tuple[int, int, int, int] | None:  # fmt: skip
    """Rows of three directions at a panel's corner; 1 if creases 1 and 3 fold opposite ways.

    The first direction is along `edge`. None unless three mountains and a valley, or three valleys
    and a mountain, meet at the corner.
    """
    vertex, following = edge
    others = beside.get(vertex, [])
    if len(others) != 4 or following not in others:
        return None
    first = others.index(following)
    others = others[first:] + others[:first]
    kinds = [letter[edge_of(vertex, other)] for other in others]
    if sorted(kinds) not in (["M", "M", "M", "V"], ["M", "V", "V", "V"]):
        return None
    one, two, three = (spokes[vertex, other] for other in others[:3])
    return one, two, three, int(kinds[0] != kinds[2])
