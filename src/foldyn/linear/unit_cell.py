"""`UnitCell`: a case that repeats under translations or a screw motion, and its Brillouin zone.

The pattern repeats under one to three commuting motions g_1, g_2, g_3. Each vertex v is a copy of a
representative u of its kind, v = g^R u with integers R: two vertices of the same kind are one
vertex of the repeated sheet, and edges between them one edge. Wave vectors are phases k (rad) per
period: a Bloch wave moves copy R of a vertex as Q^R a exp(i k . R), with Q the rotation of the
motion (F. Bloch, Z. Phys. 52, 1929; with rotations, C. T. White, D. H. Robertson, J. W. Mintmire,
Phys. Rev. B 47, 1993).
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations, pairwise, product
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import ArrayLike, NDArray

from foldyn.cases import Case
from foldyn.errors import InputError, listed
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.screw import Screw, motion_between, translation
from foldyn.patterns.tiling import half_edges
from foldyn.patterns.tiling import periods as translations_of
from foldyn.patterns.topology import components, walk
from foldyn.ram_limit import check_memory
from foldyn.values import number, numbers, of_kind, show, whole

NEAR_MISS = 0.05  # a vertex this close to a partner, relative to the pattern's size, is reported
Step = tuple[int, ...]  # R
Vertex = tuple[Step, int]  # cell and kind
COMMUTE = 10.0  # largest distance that the order of two motions may make, in tolerances
HEXAGONAL = 1e-6  # tolerance for lengths and angle of a hexagonal lattice


class Copies(NamedTuple):
    """Each vertex as a copy of the representative of its kind.

    Attributes
    ----------
    kind : ndarray of int, shape (n,)
        Number of the kind of each vertex, in the order of the representatives.
    offset : ndarray of int, shape (n, d)
        R: powers of the motions that take the representative to the vertex.
    first : ndarray of int, shape (m,)
        The representative of each kind.
    """

    kind: NDArray[np.int64]
    offset: NDArray[np.int64]
    first: NDArray[np.int64]

    @property
    def named(self) -> list[Vertex]:
        """R and kind of each vertex."""
        return list(zip(map(tuple, self.offset.tolist()), self.kind.tolist(), strict=True))

    def panels(self, pattern: Pattern) -> list[tuple[Step, list[Vertex]]]:
        """R of each panel, and its corners, moved so that the lowest of them is in cell 0.

        Raises
        ------
        InputError
            Panels that are copies of each other.
        """
        vertices, found = self.named, []
        twins: dict[tuple[Vertex, ...], int] = {}
        for f, face in enumerate(pattern.faces):
            corners = [vertices[v] for v in face]
            base = min(corners)[0]
            moved = [(minus(step, base), kind) for step, kind in corners]
            twin = twins.setdefault(tuple(sorted(moved)), f)
            if twin != f:
                raise InputError(
                    f": panels {twin} and {f} are copies of each other under these motions, so "
                    "that the pattern is more than one cell; give longer motions, or one cell",
                    "case",
                )
            found.append((base, moved))
        return found


def minus(one: Step, two: Step) -> Step:
    """Difference of two R."""
    return tuple(a - b for a, b in zip(one, two, strict=True))


@dataclass(frozen=True, eq=False, repr=False)
class UnitCell:
    """A case that is repeated to form a sheet, a chain or a tube.

    Supports, point masses, springs, dashpots and damping repeat with the cell. A support or mass at
    a node also applies to the node's partners on other sides of the cell: together they are one
    node of the repeated sheet, which counts once even if a support or mass names several of them.
    Loads matter only for the state.

    Parameters
    ----------
    case : Case
        Case whose structure is made by `discretize`, `shell` or `superelements`. Creases between
        cells have the stiffness and law of other creases, and letters from their dihedrals.
    vectors : sequence of sequences of float, shape (d, 3), optional
        One to three translations (m) from a cell to the next: a chain, a sheet or a cellular solid.
    screw : Screw, optional
        Screw motion from a cell to the next, for tubes and rings: instead of `vectors`, or in
        addition to one vector.
    tolerance : float
        Distance below which vertices coincide, as a fraction of the pattern's size (below 0.05).

    Attributes
    ----------
    motions : tuple of Screw
        Motions from a cell to the next; without vectors or screw, the periods of the
        pattern (`Pattern.periods`), or two translations found from its boundary.
    vectors : ndarray, shape (d, 3)
        Shifts of the motions (m).
    dimensions : int
        Number d of motions.
    copies : Copies
        Each vertex as a copy of the representative of its kind.

    Raises
    ------
    InputError
        The pattern does not repeat, or not under the given motions: the message names vertices
        without a partner.

    Examples
    --------
    >>> import foldyn as fd
    >>> sheet = fd.Sheet(youngs_modulus=1e9, poissons_ratio=0.3, thickness=1e-3, density=1000.0)
    >>> pattern = fd.patterns.miura(a=0.03, b=0.03)
    >>> cell = fd.UnitCell(fd.Case(fd.discretize(pattern, sheet)))
    >>> cell.vectors.round(4).tolist()
    [[0.0393, 0.0, 0.0], [0.0, 0.0397, 0.0]]
    >>> fd.bands(cell, cell.path("X-M", 3), count=2).frequency.shape
    (3, 2)
    """

    case: Case
    vectors: Any = None
    screw: Screw | None = None
    tolerance: float = 1e-6
    motions: tuple[Screw, ...] = field(init=False)
    copies: Copies = field(init=False)

    def __post_init__(self) -> None:
        pattern = of_kind("case", self.case, Case).structure.pattern
        if pattern is None:
            raise InputError(": its structure has no pattern that could repeat", "case")
        tolerance = number("tolerance", self.tolerance, above=0.0, below=NEAR_MISS)
        object.__setattr__(self, "tolerance", tolerance)
        near = tolerance * pattern.size
        motions, pairs = self._found(pattern, near)
        check_commuting(pattern.vertices, motions, near, "screw" if self.screw else "vectors")
        pairs += _partners(pattern, motions, near, {v for rows in pairs for v in rows[:2]})
        _check_all(pattern, motions, pairs, near, "screw" if self.screw else "vectors")
        object.__setattr__(self, "motions", motions)
        object.__setattr__(self, "vectors", np.array([motion.vector for motion in motions]))
        object.__setattr__(self, "copies", _copies(len(pattern.vertices), len(motions), pairs))
        self.copies.panels(pattern)  # refuses more than one cell

    def __repr__(self) -> str:
        """One line: size of the cell and its motions."""
        ways = ["screw" if motion.turns else "translation" for motion in self.motions]
        return (
            f"<UnitCell: {self.kinds} vertices, {len(self.case.structure.pattern.faces)} panels, "
            f"{' and '.join(ways)}>"
        )

    def with_case(self, case: Case) -> UnitCell:
        """The cell with another case of the same pattern."""
        out = copy(self)
        object.__setattr__(out, "case", case)
        return out

    def _found(self, pattern: Pattern, near: float) -> tuple[tuple[Screw, ...], list[tuple]]:
        """The motions, and pairs of vertices that are known to be copies."""
        if self.vectors is not None or self.screw is not None:
            given = [] if self.vectors is None else list(map(translation, _steps(self.vectors)))
            if self.screw is not None:
                given.append(of_kind("screw", self.screw, Screw))
            if self.screw is not None and len(given) > 2:
                raise InputError(": give at most two, or one with a screw", "vectors")
            return tuple(given), []
        if not pattern.periods:
            try:
                rim = half_edges(pattern.faces, pattern.boundary)
                steps = translations_of(pattern.vertices, rim, near)
            except InputError:
                raise InputError(
                    ": the pattern does not say how it repeats, and no two translations bring its "
                    "boundary together; give them, or one for a chain, as in "
                    "vectors=[(0.1, 0, 0)], or screw=fd.Screw(...)",
                    "vectors",
                ) from None
            return tuple(map(translation, steps)), []
        return self._marked(pattern, near)

    def _marked(self, pattern: Pattern, near: float) -> tuple[tuple[Screw, ...], list[tuple]]:
        """The motions and pairs named by the pattern; pairs of a seam are one vertex."""
        motions, found = [], []
        for k, rows in enumerate(pattern.periods):
            points, ends = pattern.vertices[rows[:, 0]], pattern.vertices[rows[:, 1]]
            if np.abs(ends - points).max() <= near:
                found.append((rows, None))
                continue
            motion, off = motion_between(points, ends, near)
            wrong = rows[off > near]
            if len(wrong):
                one, other = (listed(row) for row in wrong.T.tolist())
                raise InputError(
                    f": no motion brings vertices {one} to {other}, which the pattern says is its "
                    f"period {k}: they are off by up to {off.max():.2g} m; this shape does not "
                    "repeat",
                    "case",
                )
            found.append((rows, len(motions)))
            motions.append(motion)
        if not motions:
            raise InputError(": the pattern closes on itself, and has no period", "case")
        pairs = []
        for rows, k in found:
            step = tuple(int(j == k) for j in range(len(motions)))
            pairs += [(v, w, step) for v, w in rows.tolist()]
        return tuple(motions), pairs

    @property
    def near(self) -> float:
        """Distance (m) below which points coincide."""
        return self.tolerance * self.case.structure.pattern.size

    @property
    def dimensions(self) -> int:
        """Number of motions that repeat the cell."""
        return len(self.motions)

    def period(self, name: str, value: Any) -> int:
        """Checked number of one of the motions, given as the argument `name`."""
        number_ = whole(name, value, least=0)
        if number_ >= self.dimensions:
            last = self.dimensions - 1
            known = f"{last + 1} periods, 0 to {last}" if last else "1 period, 0"
            raise InputError(f" = {number_}: the cell has {known}", name)
        return number_

    # ------------------------------------------------------------------ copies
    def images(self, points: ArrayLike, step: Sequence[int]) -> NDArray[np.float64]:
        """Positions (n, 3), m, of points (n, 3) in cell R of the repeated sheet, R = step (d,)."""
        return images(self.motions, points, step)

    @cached_property
    def kinds(self) -> int:
        """Vertices of a cell of the repeated sheet, each counted once."""
        return len(self.copies.first)

    # ------------------------------------------------------------------ Brillouin zone
    def path(self, points: str, count: int = 60) -> xarray.DataArray:
        """Phases along a path through the Brillouin zone.

        Parameters
        ----------
        points : str
            Names of points joined by "-": "G" (no phase), "X" (pi along the first period), "Y" (pi
            along the second) and "M" (pi along both) of a sheet; "G" and "X" of a chain or tube. A
            hexagonal lattice has "K" too, the corner of its zone, and a cellular solid "Z" (pi
            along the third period), "U" (X and Z), "T" (Y and Z) and "R" (all).
        count : int
            Total number of phases, including corners.

        Returns
        -------
        xarray.DataArray
            Phases (phase, period), rad, with the coordinate `distance` along the path, rad, and
            the attributes `ticks` (values of `distance` at the points) and `tick_labels`.

        Raises
        ------
        InputError
            An unknown point, or fewer phases than points.
        """
        known = special_points(self.vectors)
        if not isinstance(points, str):
            raise InputError(f' = {show(points)}: give names, as in "G-X-M-G"', "points")
        names = [name.strip().replace("Γ", "G") for name in points.split("-")]
        unknown = [name for name in names if name not in known]
        if unknown or len(names) < 2:
            what = f"{show(unknown[0])} is no point" if unknown else "give at least two points"
            raise InputError(
                f" = {show(points)}: {what}; this cell has {', '.join(known)}, as in "
                f'"{"G-X-M-G" if self.dimensions > 1 else "G-X"}"',
                "points",
            )
        count = whole("count", count, least=len(names))
        _check_memory(count, self.dimensions)
        corners = np.array([known[name] for name in names])
        lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        if not lengths.all():
            raise InputError(f" = {show(points)}: names a point twice in a row", "points")
        ends = np.concatenate([[0.0], np.cumsum(lengths)])
        marks = np.round(ends / ends[-1] * (count - 1)).astype(int)
        marks = np.maximum.accumulate(np.maximum(marks, np.arange(len(marks))))
        for k in range(len(marks) - 1, 0, -1):  # leave room for the remaining corners
            marks[k] = min(marks[k], count - len(marks) + k)
        rows = [
            corners[k]
            + np.linspace(0.0, 1.0, b - a, endpoint=False)[:, None] * (corners[k + 1] - corners[k])
            for k, (a, b) in enumerate(pairwise(marks.tolist()))
        ]
        phases = np.concatenate([*rows, corners[-1:]])
        distance = np.concatenate([[0.0], np.linalg.norm(np.diff(phases, axis=0), axis=1).cumsum()])
        named = {"units": "rad", "long_name": "along the path"}
        return xarray.DataArray(
            phases, dims=("phase", "period"), coords={"distance": ("phase", distance, named)},
            attrs={"units": "rad", "ticks": distance[marks], "tick_labels": "-".join(names)},
        )  # fmt: skip

    def grid(self, count: int = 24) -> xarray.DataArray:
        """Phases covering the Brillouin zone, from -pi to pi along each period.

        Parameters
        ----------
        count : int
            Number of phases along each period, at least 2; without pi, which is equivalent to -pi.

        Returns
        -------
        xarray.DataArray
            Phases (phase, period), rad; the attribute `grid` holds their number along each period.
        """
        count = whole("count", count, least=2)
        _check_memory(count**self.dimensions, self.dimensions)
        along = -np.pi + 2.0 * np.pi / count * np.arange(count)
        phases = np.stack(np.meshgrid(*[along] * self.dimensions, indexing="ij"), axis=-1)
        return xarray.DataArray(
            phases.reshape(-1, self.dimensions), dims=("phase", "period"),
            attrs={"units": "rad", "grid": np.array([count] * self.dimensions)},
        )  # fmt: skip


def images(
    motions: Sequence[Screw], points: ArrayLike, step: Sequence[int] | NDArray[np.int64]
) -> NDArray[np.float64]:
    """Points (n, 3), m, moved by each motion as often as its number in `step` says."""
    out = np.asarray(points, float)
    for motion, power in zip(motions, step, strict=True):
        out = motion.images(out, int(power))
    return out


def rotation(
    motions: Sequence[Screw], step: Sequence[int] | NDArray[np.int64]
) -> NDArray[np.float64]:
    """Rotation (3, 3) of all motions, each applied as often as its number in `step` says."""
    out = np.eye(3)
    for motion, power in zip(motions, step, strict=True):
        out = motion.rotation(int(power)) @ out
    return out


def _steps(vectors: Any) -> NDArray[np.float64]:
    """Checked translations (d, 3), one to three that span as many directions."""
    array = numbers("vectors", vectors)
    array = array[None] if array.ndim == 1 else array
    if array.ndim != 2 or array.shape[1] != 3 or len(array) > 3 or not len(array):
        raise InputError(
            f" = {show(vectors)}: give one to three translations, as in [(0.1, 0, 0), (0, 0.1, 0)]",
            "vectors",
        )
    sizes = np.linalg.svd(array, compute_uv=False)
    if sizes[-1] <= 1e-9 * sizes[0] or sizes[0] == 0.0:
        what = "parallel" if len(array) < 3 else "in one plane"
        raise InputError(f" = {show(vectors)}: must not be zero or {what}", "vectors")
    return array


def check_commuting(vertices: NDArray, motions: Sequence[Screw], near: float, field: str) -> None:
    """Refuse motions that do not commute."""
    for one, two in combinations(motions, 2):
        apart = one.images(two.images(vertices)) - two.images(one.images(vertices))
        if np.abs(apart).max() > COMMUTE * near:
            raise InputError(
                ": the two motions lead to different places in the two orders, and a lattice needs "
                "motions that commute: translations, or a screw and a translation along its axis",
                field,
            )


def _partners(
    pattern: Pattern, motions: Sequence[Screw], near: float, known: set[int]
) -> list[tuple[int, int, tuple[int, ...]]]:
    """Pairs of vertices (v, w, R), w = g^R v, at edges that meet edges of other cells.

    They are boundary edges of sheets, but layers and walls may meet along any edges.

    known : vertices with known partners.
    """
    from scipy.spatial import cKDTree

    rim = np.concatenate([pattern.edges, pattern.edges[:, ::-1]])
    rim = rim[[not (a in known and b in known) for a, b in rim.tolist()]]
    if not len(rim):
        return []
    points = pattern.vertices
    tree, pairs = cKDTree(points[rim[:, ::-1]].reshape(-1, 6)), []
    for step in product((-1, 0, 1), repeat=len(motions)):
        if step <= (0,) * len(motions):
            continue
        moved = images(motions, points, step)[rim].reshape(-1, 6)
        for e, matches in enumerate(tree.query_ball_point(moved, near * np.sqrt(2.0))):
            for f in matches:
                pairs += [(int(v), int(w), step) for v, w in zip(rim[e], rim[f][::-1], strict=True)]
    return pairs


def _check_all(
    pattern: Pattern, motions: Sequence[Screw], pairs: Sequence[tuple], near: float, field: str
) -> None:
    """Refuse motions under which no edges meet, or vertices narrowly miss their partners."""
    from scipy.spatial import cKDTree

    rim = np.unique(pattern.boundary)
    tree = cKDTree(pattern.vertices[rim])
    neighbors: dict[int, set[int]] = {}
    for a, b in pattern.boundary.tolist():
        neighbors.setdefault(a, set()).add(b)
        neighbors.setdefault(b, set()).add(a)
    for k, motion in enumerate(motions):
        distance, nearest = tree.query(motion.images(pattern.vertices[rim]))
        starts = {v for v, _, step in pairs if step[k] > 0} | set(rim[distance <= near].tolist())
        missed = [
            (v, w, gap)
            for v, w, gap in zip(rim.tolist(), rim[nearest].tolist(), distance, strict=True)
            if near < gap < NEAR_MISS * pattern.size and w != v and v not in starts
            and neighbors[v] & starts
        ]  # fmt: skip
        if missed:
            raise InputError(
                f": vertices {listed([v for v, _, _ in missed])} have no partner under motion {k}: "
                f"they come near {listed([w for _, w, _ in missed])}, but are off by up to "
                f"{max(gap for _, _, gap in missed):.2g} m; correct the pattern or the motion, or "
                "give a larger tolerance",
                field,
            )
        if any(step[k] for _, _, step in pairs):
            continue
        best = int(distance.argmin())
        a, b = rim[best], rim[nearest[best]]
        if distance[best] <= near:
            raise InputError(
                f": motion {k} brings vertex {a} to {b}, but no edge of the pattern to another: "
                "copies touch at points alone; give motions that put copies next to each other",
                field,
            )
        raise InputError(
            f": motion {k} brings no boundary edge of the pattern to another one; its nearest "
            f"vertices, {a} and {b}, stay {distance[best]:.3g} m apart; give the motion from a "
            "cell to the next",
            field,
        )


def _copies(count: int, dimensions: int, pairs: Sequence[tuple]) -> Copies:
    """Kinds of vertices from pairs (v, w, R) with w = g^R v."""
    ends = np.array([pair[:2] for pair in pairs], np.int64).reshape(-1, 2)
    steps = np.array([step for _, _, step in pairs], np.int64).reshape(-1, dimensions)
    offset = np.zeros((count, dimensions), np.int64)
    for v, w, row, way in walk(ends, count):
        offset[w] = offset[v] + way * steps[row]
    apart = (offset[ends[:, 1]] != offset[ends[:, 0]] + steps).any(axis=1)
    if apart.any():
        v, w = ends[apart.argmax()]
        raise InputError(
            f": vertices {v} and {w} belong together in two ways; a vertex must not be its own "
            "copy: the motions are too short, or lead to the axis",
            "case",
        )
    kind = components(ends, count)
    return Copies(kind, offset, np.unique(kind, return_index=True)[1])


def _check_memory(count: int, dimensions: int) -> None:
    """Refuse more phases than memory can hold; making them takes twice their memory."""
    needed = 16.0 * count * (dimensions + 1)
    check_memory("count", f"a list of {count:g} phases", needed, "take fewer")


def special_points(vectors: NDArray) -> dict[str, NDArray]:
    """Points (d,) of high symmetry by name, rad."""
    pi = np.pi
    if len(vectors) == 1:
        return {"G": np.zeros(1), "X": np.full(1, pi)}
    corners = {"G": (0.0, 0.0), "X": (pi, 0.0), "Y": (0.0, pi), "M": (pi, pi)}
    found = {name: np.array(corner) for name, corner in corners.items()}
    if len(vectors) == 3:
        found = {name: np.append(corner, 0.0) for name, corner in found.items()}
        above = {"G": "Z", "X": "U", "Y": "T", "M": "R"}
        return found | {above[name]: found[name] + [0.0, 0.0, pi] for name in above}
    lengths = np.linalg.norm(vectors, axis=1)
    if lengths.all():
        cosine = vectors[0] @ vectors[1] / lengths.prod()
        alike = abs(lengths[0] / lengths[1] - 1.0) < HEXAGONAL
        if alike and abs(abs(cosine) - 0.5) < HEXAGONAL:
            found["K"] = 2.0 * pi / 3.0 * np.array([1.0, -1.0 if cosine > 0.0 else 1.0])
    return found


def checked_phases(phases: object, dimensions: int) -> NDArray[np.float64]:
    """Phases (n, d), rad, checked; for d = 1 they may be a list of numbers."""
    array = numbers("phases", phases.values if isinstance(phases, xarray.DataArray) else phases)
    if array.ndim == 1 and dimensions == 1:
        array = array[:, None]
    if array.ndim != 2 or array.shape[1] != dimensions or not len(array):
        raise InputError(
            f": shape {array.shape}: give (n, {dimensions}), rad per period, as cell.path makes "
            "them",
            "phases",
        )
    return array
