"""Patterns derived from other patterns: scaled, moved, rotated, mirrored, repeated, joined."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from inspect import signature
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError, quietly, warn
from foldyn.patterns.boards import Boards
from foldyn.patterns.generators.arguments import check_size, two_counts
from foldyn.patterns.geometry import FaceGeometry
from foldyn.patterns.screw import direction
from foldyn.patterns.tiling import glue, half_edges
from foldyn.patterns.tiling import periods as periods_of
from foldyn.patterns.topology import Topology, around, edge_lookup, edge_of
from foldyn.values import flag, number, numbers, show, vector

REMEDY = "its panels are thick; repeat or join the thin pattern first"
FLAT = 1e-6  # rad: a crease between copies within this angle from pi gets no letter
TURNED = {"M": "V", "V": "M"}
# Key, in a pattern's custom data, of the order of its layers, as in the FOLD format.
FACE_ORDERS = "faceOrders"


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Transforms(Topology, FaceGeometry):
    """Fields of a `Pattern`, and transformations, which return a new pattern."""

    vertices: NDArray[np.float64]
    assignments: tuple[str, ...]
    name: str
    boards: Boards | None
    fold_angles: NDArray[np.float64]
    families: Mapping[str, NDArray[np.int64]]
    custom: Mapping[str, Any]
    periods: tuple[NDArray[np.int64], ...]
    rim_families: Mapping[str, NDArray[np.int64]]
    unlettered: NDArray[np.bool_]
    dihedrals: NDArray[np.float64]
    weld_dihedrals: NDArray[np.float64]
    flat_dihedrals: NDArray[np.float64]
    size: float

    def scaled(self, factor: float) -> Self:
        """Return the pattern with all lengths scaled, including its boards.

        Parameters
        ----------
        factor : float
            Factor on all lengths, greater than 0.
        """
        factor = number("factor", factor, above=0.0)
        return self._placed(lambda x: factor * x, factor)

    def moved(self, shift: ArrayLike) -> Self:
        """Return the pattern moved.

        Parameters
        ----------
        shift : array_like, shape (3,)
            Displacement (m).
        """
        step = np.array(vector("shift", shift))
        return self._placed(lambda x: x + step)

    def rotated(
        self, angle: float, axis: str | ArrayLike = "z", about: ArrayLike = (0.0, 0.0, 0.0)
    ) -> Self:
        """Return the pattern rotated, by the right-hand rule.

        Parameters
        ----------
        angle : float
            Angle (degrees).
        axis : {"x", "y", "z"} or array_like, shape (3,)
            Direction of the axis.
        about : array_like, shape (3,)
            A point on the axis (m).
        """
        from scipy.spatial.transform import Rotation

        turn = np.radians(number("angle", angle, unit="degrees"))
        center, about_axis = np.array(vector("about", about)), turn * _direction("axis", axis)
        rotation = Rotation.from_rotvec(about_axis).as_matrix()
        return self._placed(lambda x: (x - center) @ rotation.T + center)

    def mirrored(self, normal: str | ArrayLike = "x", about: ArrayLike = (0.0, 0.0, 0.0)) -> Self:
        """Return the mirror image of the pattern.

        The front is mirrored too: the winding of panels is reversed, so that a valley seen from the
        front stays a valley, with its dihedral and fold angle. A flat sheet that is mirrored in a
        plane perpendicular to it shows the same side with the same letters.

        Parameters
        ----------
        normal : {"x", "y", "z"} or array_like, shape (3,)
            Normal of the mirror plane.
        about : array_like, shape (3,)
            A point on the mirror plane (m).
        """
        unit = _direction("normal", normal)
        center = np.array(vector("about", about))
        reflection = np.eye(3) - 2.0 * np.outer(unit, unit)
        return self._placed(lambda x: (x - center) @ reflection.T + center, turned=True)

    def repeated(
        self, counts: Sequence[int], periods: ArrayLike | None = None, tolerance: float = 1e-6
    ) -> Self:
        """Return copies of the pattern side by side as one sheet, glued edge to edge.

        Parameters
        ----------
        counts : sequence of two int
            Number of copies along the first and the second period, at least 1.
        periods : array_like, shape (2, 3), optional
            Translations (m) from one copy to the next. By default they match the longest parts of
            the boundary; the first is the one with the direction closer to the x axis.
        tolerance : float
            Distance, as a fraction of the pattern's size, within which edges coincide.

        Returns
        -------
        Pattern
            The glued sheet. Copies are numbered along the second period first. Creases keep
            letters, fold angles and families; creases between copies get the letter that fits their
            dihedral, "U" if flat.

        Raises
        ------
        InputError
            No periods are found, copies do not meet along edges, or panels are thick.
        """
        first, second = two_counts("counts", counts, "numbers, as in (3, 2)")
        refuse_boards(self)
        check_size("counts", first * second * len(self.vertices))
        near = number("tolerance", tolerance, above=0.0) * self.size
        rim = half_edges(self.faces, self.boundary)
        steps = periods_of(self.vertices, rim, near) if periods is None else _given(periods)
        shifts = [i * steps[0] + j * steps[1] for i in range(first) for j in range(second)]
        made, joined = _joined(self, [(self, shift) for shift in shifts], near)
        if joined < first * (second - 1) + second * (first - 1):
            raise InputError(
                ": copies do not meet along edges; give the translations from one copy to the "
                "next, or a larger tolerance",
                "periods",
            )
        return made

    def joined(self, other: Self, tolerance: float = 1e-6, *, inner: bool = False) -> Self:
        """Return two patterns as one, glued along coincident boundary edges.

        The front is the front of this pattern. If the back of the other pattern is on this side,
        its mountains and valleys swap. Edges that more than two panels then share are junctions,
        see `Pattern`.

        Parameters
        ----------
        other : Pattern
        tolerance : float
            Distance, as a fraction of the larger size, within which edges coincide.
        inner : bool
            Whether to glue all edges, as those of layers that touch along creases.

        Returns
        -------
        Pattern
            The glued pattern, with the vertices and panels of this pattern first. Creases between
            the two get the letter that fits their dihedral, "U" if flat.

        Raises
        ------
        InputError
            Not a pattern, thick panels, or panels in the same place.

        Warns
        -----
        FoldynWarning
            The two patterns share no edge.
        """
        if not isinstance(other, Transforms):
            raise InputError(f" = {show(other)}: give a Pattern", "other")
        refuse_boards(self)
        refuse_boards(other)
        near = number("tolerance", tolerance, above=0.0) * max(self.size, other.size)
        zero = np.zeros(3)
        made, joined = _joined(self, [(self, zero), (other, zero)], near, flag("inner", inner))
        if not joined:
            warn(
                "other: the patterns share no edge and are two parts of one; move one of them so "
                "that boundary edges coincide, or give a larger tolerance",
                "patterns.md#your-own-patterns",
            )
        return made

    def changed(self, **values: Any) -> Self:
        """Return the pattern with some arguments changed; see `Pattern`.

        Warnings from the pattern's construction are not repeated. If the faces change, the order of
        layers is dropped unless it is given.

        Parameters
        ----------
        **values
            New arguments of `Pattern`.
        """
        own = {name: getattr(self, name) for name in signature(type(self)).parameters}
        own["families"] = {name: self.creases[rows] for name, rows in self.families.items()}
        own["rim_families"] = self._rim()
        if "faces" in values:
            own["custom"] = {k: v for k, v in self.custom.items() if k != FACE_ORDERS}
            own["rim_families"] = _still_at_the_rim(self._rim(), values["faces"])
        if len(values.get("vertices", self.vertices)) != len(self.vertices):
            own["periods"] = ()  # they refer to vertex numbers
        with quietly():
            changed = type(self)(**{**own, **values})
        if "assignments" not in values:
            object.__setattr__(changed, "unlettered", self.unlettered)
        return changed

    def _rim(self) -> dict[str, NDArray[np.int64]]:
        """Boundary edges (m, 2) of each family."""
        return {name: self.boundary[rows] for name, rows in self.rim_families.items()}

    def _placed(self, place: Any, factor: float = 1.0, turned: bool = False) -> Self:
        """The pattern with all points mapped by `place`, and the winding reversed if `turned`."""
        boards, faces = self.boards, self.faces
        if turned:
            faces = [(face[0], *face[:0:-1]) for face in faces]
        if boards is not None:
            corners = [boards.of(panel) for panel in range(len(faces))]
            if turned:
                corners = [np.roll(own[::-1], 1, axis=0) for own in corners]
            points = place(np.concatenate(corners))
            boards = Boards(boards.offsets, points, factor * boards.thickness)
        return self.changed(
            vertices=place(self.vertices), faces=faces, boards=boards, custom=self.custom,
            rim_families=self._rim(),
        )  # fmt: skip


def _still_at_the_rim(
    families: Mapping[str, NDArray], faces: Any
) -> dict[str, list[list[int]]] | None:
    """Families of boundary edges, reduced to edges that are still on the boundary of `faces`."""
    if not families:
        return None
    try:
        count = Counter(edge_of(a, b) for face in faces for a, b in around(list(face)))
    except (TypeError, IndexError):  # `Pattern` refuses these by name
        return None
    return {
        name: [pair for pair in pairs.tolist() if count[pair[0], pair[1]] == 1]
        for name, pairs in families.items()
    }


def _joined(
    first: Transforms, sheets: Sequence[tuple[Transforms, NDArray]], near: float,
    inner: bool = False,
) -> tuple[Any, int]:  # fmt: skip
    """Join sheets, each with a shift, into one pattern; also return the number of glued edges.

    inner : whether to glue edges inside the sheets, too.
    """
    points = [sheet.vertices + shift for sheet, shift in sheets]
    rims = [one.edges if inner else half_edges(one.faces, one.boundary) for one, _ in sheets]
    glued = glue(points, rims, near)
    faces: list[tuple[int, ...]] = []
    letters: dict[tuple[int, int], str] = {}
    angles: dict[tuple[int, int], float] = {}
    families: dict[str, list[tuple[int, int]]] = {}
    custom: dict[str, Any] = {}
    welds: list[tuple[int, int]] = []
    starts = []
    for (sheet, _), numbers_ in zip(sheets, glued.numbers, strict=True):
        starts.append(len(faces))
        faces += [tuple(numbers_[list(face)].tolist()) for face in sheet.faces]
        welds += numbers_[sheet.welds].tolist()
    bare = first.changed(
        vertices=glued.vertices, faces=faces, assignments=None, fold_angles=None,
        families=None, custom=None, welds=welds, periods=(), rim_families=None,
    )  # fmt: skip
    flat = np.abs(bare.dihedrals - np.pi) < FLAT
    for k, pair in enumerate(bare.creases.tolist()):
        letters[pair[0], pair[1]] = "U" if flat[k] else bare.assignments[k]
    for (sheet, _), numbers_, start in zip(sheets, glued.numbers, starts, strict=True):
        custom = {**sheet.custom, **custom}
        pairs = [edge_of(*pair) for pair in numbers_[sheet.creases].tolist()]
        turned = np.array(bare.flipped)[start + sheet.crease_faces[:, 0]]
        for k, pair in enumerate(pairs):
            letter, angle = sheet.assignments[k], float(sheet.fold_angles[k])
            letters[pair] = TURNED.get(letter, letter) if turned[k] else letter
            angles[pair] = -angle if turned[k] else angle
        for name, rows in sheet.families.items():
            families.setdefault(name, []).extend(pairs[k] for k in rows.tolist())
    custom.pop(FACE_ORDERS, None)
    known = edge_lookup(bare.creases)  # others are welds of one of the sheets
    letters = {pair: letter for pair, letter in letters.items() if pair in known}
    angles = {pair: angle for pair, angle in angles.items() if pair in known}
    families = {name: [pair for pair in own if pair in known] for name, own in families.items()}
    made = bare.changed(assignments=letters, fold_angles=angles, families=families, custom=custom)
    return made, glued.joined


def _given(steps: Any) -> NDArray[np.float64]:
    """Check given translations (2, 3)."""
    array = numbers("periods", steps)
    if array.shape != (2, 3):
        raise InputError(
            f" = {show(steps)}: give two translations, as in [(0.1, 0, 0), (0, 0.1, 0)]", "periods"
        )
    return array


def refuse_boards(pattern: Transforms, why: str = REMEDY) -> None:
    """Refuse a pattern with thick panels, with a reason and a remedy."""
    if pattern.boards is not None:
        raise InputError(f": {why}", "pattern")


def _direction(name: str, given: Any) -> NDArray[np.float64]:
    """Unit vector (3,) of an axis given by name or coordinates."""
    along = np.array(direction(name, given))
    return along / np.linalg.norm(along)
