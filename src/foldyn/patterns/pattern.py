"""`Pattern`: the geometry of an origami structure at rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError, warn
from foldyn.patterns import crease_data
from foldyn.patterns.boards import Boards
from foldyn.patterns.geometry import crease_dihedrals, face_geometry, seams
from foldyn.patterns.picture import picture
from foldyn.patterns.topology import (
    Edge,
    Lines,
    Topology,
    at_junctions,
    build_topology,
    checked_faces,
    edge_lookup,
    edge_rows,
    vertex_pair,
)
from foldyn.patterns.transforms import Transforms
from foldyn.values import LONGEST, SHORTEST, single

_FLAT = 1e-6  # rad: an unassigned crease within this angle from pi counts as flat
_CONTRADICTION = 1e-3  # rad: an angle this far from pi on the wrong side contradicts the letter
_LETTERS = ("M", "V", "F", "U")


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Pattern(Transforms):
    """Vertices, panels and creases of an origami structure at rest, flat or folded.

    Parameters
    ----------
    vertices : array_like, shape (n, 3) or (n, 2)
        Coordinates (m); two columns mean z = 0. They are stored read-only, with three columns.
    faces : sequence of sequences of int
        Panels with any number of corners, each as a list of vertex numbers in order around it,
        counter-clockwise seen from the front. The winding is made consistent: in each
        connected part the lowest-numbered face decides where the front is.
    assignments : mapping, sequence or None
        "M" (mountain), "V" (valley), "F" (flat) or "U" (unassigned), either for each crease in the
        order of `creases` or as a mapping from vertex pairs and families, such as {(a, b): "M",
        "zigzag": "V"}, where pairs override families. A mapping may also hold "B" for boundary
        edges. Creases without an entry get the letter that fits their dihedral; with None, all
        creases do, and those of junctions always.
    name : str
        Name of the pattern.
    boards : Boards, optional
        The boards of thick panels; see `thicken`.
    fold_angles : mapping, sequence or None
        The state to fold to: an angle (rad) from -pi to pi for each crease in the order of
        `creases`, positive on valleys, 0 for a flat crease, NaN or None for a free crease. Or a
        mapping from vertex pairs, and from "mountain", "valley", "all" and families. Angles given
        for such words are magnitudes, and the letter of each crease gives the sign; pairs override
        words.
    families : mapping, optional
        Names for groups of creases, given by vertex pairs: {"zigzag": [(0, 1), (1, 2)]}.
    custom : mapping, optional
        Further data of a file that Foldyn does not use, kept for writing.
    welds : sequence of (vertex, vertex)
        Edges of two panels across which the sheet is continuous: not creases, but lines in the
        sheet, such as the facets of a curved panel; see `welded`.
    rim_families : mapping, optional
        Families that boundary edges will join once another panel is attached to them, given by
        vertex pairs.
    periods : sequence of sequences of (vertex, vertex)
        One or two motions that map the pattern to a neighboring copy. Each is given by pairs of a
        vertex and the vertex onto which it moves; these pairs hold in every folded state. See
        `foldyn.UnitCell`.

    Attributes
    ----------
    assignments : tuple of str
        The letter of each crease.
    unlettered : ndarray of bool, shape (nc,)
        Creases without a given letter; they have the letter that fits their dihedral.
    fold_angles : ndarray, shape (nc,)
        Angle (rad, pi minus the dihedral) to which each crease is to fold; NaN if not given.
    families, rim_families : mapping
        Row numbers in `creases` and in `boundary`, by the name of the family.
    flipped : tuple of bool
        For each face, whether its winding was reversed. A reversed face keeps its first
        vertex: (v1, v2, v3, v4) becomes (v1, v4, v3, v2).
    edges, creases, boundary : ndarray of int, shape (m, 2)
        All edges; edges shared by faces, except welds; and edges of one face only. Each is a
        (low, high) vertex pair, in lexicographic order. An edge of m > 2 faces, a junction, is m
        creases, one between each two neighbors in the order of angles about it.
    crease_faces : ndarray of int, shape (nc, 2)
        The face that runs along the crease from low to high, and the face that runs from high to
        low; at junctions see `dihedrals`.
    crease_ways : ndarray of int, shape (nc, 2)
        1, or at junctions -1 for faces that run the other way along the crease.
    welds, weld_faces, weld_ways, weld_dihedrals
        Like `creases`, `crease_faces`, `crease_ways` and `dihedrals`, for welds. A junction of m
        faces is m (m - 1) / 2 welds, of each two faces.
    junctions : ndarray of int, shape (nj, 2)
        Edges of more than two faces.
    dihedrals : ndarray, shape (nc,)
        Angle between the two panels across each crease (rad, 0 to 2 pi) seen from the front:
        pi when flat, below pi on a valley, above on a mountain. Where panels coincide within
        1e-3 rad the letter decides between 0 and 2 pi; exactly closed creases without a letter
        have 0. At junctions it is the angle from the first to the second panel of the crease, by
        the right-hand rule about the direction from low to high.
    flat_dihedrals : ndarray, shape (nc,)
        Dihedral (rad) at which the two panels lie flat: pi for thin panels; for thick panels it may
        differ, since boards can be tilted relative to the planes through their hinge lines.
    face_areas : ndarray, shape (m,)
        Areas (m2).
    face_normals : ndarray, shape (m, 3)
        Unit normals towards the front.
    face_planarity : ndarray, shape (m,)
        Largest distance of a corner from the face's mean plane, divided by the face's diameter.
    size : float
        Diagonal of the bounding box of all vertices (m).

    Raises
    ------
    InputError
        Bad vertices, faces or assignments; a one-sided surface.

    Warns
    -----
    FoldynWarning
        A given "M" or "V" contradicts the geometry by more than 1e-3 rad; or two boundary edges in
        the same place are not joined, and not given as "B".

    Notes
    -----
    A vertex that no face uses is kept.
    """

    def __init__(
        self,
        vertices: ArrayLike,
        faces: Sequence[Sequence[int]] | NDArray[np.integer],
        assignments: Mapping[Edge, str] | Mapping[Edge | str, str] | Sequence[str] | None = None,
        name: str = "",
        boards: Boards | None = None,
        fold_angles: Mapping[Edge, float] | Mapping[Edge | str, float] | ArrayLike | None = None,
        families: Mapping[str, Sequence[tuple[int, int]]] | None = None,
        custom: Mapping[str, Any] | None = None,
        welds: Sequence[tuple[int, int]] | NDArray[np.integer] = (),
        periods: Sequence[Sequence[tuple[int, int]] | NDArray[np.integer]] = (),
        rim_families: Mapping[str, Sequence[tuple[int, int]]] | None = None,
    ) -> None:
        if not isinstance(name, str):
            raise InputError(f"name = {name!r}: give a string.")
        points = _checked_vertices(vertices)
        topology = build_topology(checked_faces(faces, len(points)), points, welds)
        geometry = face_geometry(points, topology.faces)
        normals = geometry.face_normals
        named = crease_data.families(families, topology.creases)
        by_pair = crease_data.letters_by_pair(assignments, named, topology.creases)
        given, open_edges = _given_letters(by_pair, topology)
        given[at_junctions(topology.creases)] = ""  # the panels there have no common front
        graph = topology.creases, topology.crease_faces, topology.crease_ways, given
        dihedrals, _ = crease_dihedrals(points, normals, *graph)
        flat_there = np.full(len(topology.welds), "F")
        joined = topology.welds, topology.weld_faces, topology.weld_ways, flat_there
        bent, shut = crease_dihedrals(points, normals, *joined)
        if shut.any():
            raise InputError(
                f": the panels at {tuple(topology.welds[shut][0].tolist())} lie upon each other; "
                "a sheet cannot run on there: make it a crease",
                "welds",
            )
        apart, flat = dihedrals, np.full(len(dihedrals), np.pi)
        if boards is not None:
            boards.check(topology.faces)
            apart, _ = crease_dihedrals(points, boards.normals, *graph)
            flat = np.pi + dihedrals - apart
        _warn_of_contradictions(given, topology.creases, apart)
        _warn_of_seams(seams(points, topology.faces, normals, topology.boundary), open_edges)
        letters = tuple(np.where(given == "", _letters(apart), given).tolist())
        words = crease_data.Named(letters, named)
        folded = crease_data.fold_angles(fold_angles, topology.creases, words)
        folded[at_junctions(topology.creases)] = np.nan  # `fold` takes single sheets
        values: dict[str, Any] = {
            **vars(topology),
            **vars(geometry),
            "vertices": points,
            "assignments": letters,
            "unlettered": given == "",
            "name": name,
            "boards": boards,
            "fold_angles": folded,
            "families": named,
            "custom": dict(custom or {}),
            "rim_families": crease_data.families(
                rim_families, topology.boundary, "rim_families", "a boundary edge"
            ),
            "periods": crease_data.periods(periods, len(points)),
            "dihedrals": dihedrals,
            "weld_dihedrals": bent,
            "flat_dihedrals": flat,
            "size": float(np.linalg.norm(np.ptp(points, axis=0))),
        }
        for key, value in values.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, key, value)

    @property
    def lines(self) -> NDArray[np.int64]:
        """All edges by kind, each once, shape (m, 2): creases, then boundary edges, then welds."""
        creases, welds = (each[Lines.of(each).first] for each in (self.creases, self.welds))
        return np.concatenate([creases, self.boundary, welds]).reshape(-1, 2)

    @cached_property
    def junctions(self) -> NDArray[np.int64]:
        """Edges (nj, 2) of more than two faces."""
        both = np.concatenate([self.creases, self.welds])
        return np.unique(both[at_junctions(both)], axis=0)

    @cached_property
    def sides(self) -> list[NDArray[np.float64]]:
        """Lengths (m) of the sides of each face, from each corner to the next."""
        x, sizes = self.vertices, [len(face) for face in self.faces]
        here = np.concatenate(self.faces)
        there = np.concatenate([(*face[1:], face[0]) for face in self.faces])
        return np.split(np.linalg.norm(x[here] - x[there], axis=1), np.cumsum(sizes)[:-1])

    def __repr__(self) -> str:
        """One line: name and counts."""
        label = f"{self.name!r}: " if self.name else ""
        welds = f", {len(self.welds)} welds" if len(self.welds) else ""
        return (
            f"<Pattern {label}{len(self.vertices)} vertices, {len(self.faces)} faces, "
            f"{len(self.creases)} creases{welds}>"
        )

    def _repr_html_(self) -> str | None:
        """A picture for notebooks."""
        return picture(self, repr(self))


class Patterned(Protocol):
    """An object with a pattern, such as a folding, a structure or a diagnosed file."""

    @property
    def pattern(self) -> Pattern | None:
        """The object's pattern."""
        ...


def pattern_of(given: Any, name: str = "pattern") -> Pattern:
    """Return a pattern, or the pattern of an object that has one."""
    found = getattr(given, "pattern", given)
    if isinstance(found, Pattern):
        return found
    raise InputError(f": got {type(given).__name__}, give a Pattern", name)


def refuse_junctions(pattern: Pattern, why: str, field: str = "pattern") -> None:
    """Refuse a pattern with edges of more than two panels, with a reason and a remedy."""
    if len(pattern.junctions):
        a, b = pattern.junctions[0].tolist()
        raise InputError(f": more than two panels meet at edge ({a}, {b}), {why}", field)


def _checked_vertices(vertices: ArrayLike) -> NDArray[np.float64]:
    try:
        points = np.array(vertices)
    except ValueError:
        raise InputError(
            "vertices: the rows have different lengths; give 3 coordinates for each vertex "
            "(or 2, for z = 0)."
        ) from None
    if points.dtype.kind not in "iuf":
        raise InputError("vertices: not all entries are real numbers; give coordinates in meters.")
    if points.ndim != 2 or points.shape[1] not in (2, 3) or len(points) < 3:
        raise InputError(
            f"vertices has shape {points.shape}: give at least 3 rows of 3 coordinates each "
            "(or 2, for z = 0)."
        )
    for usable, what in (
        (np.isfinite(points), "finite numbers"),
        (np.abs(points.astype(np.float64)) <= LONGEST, f"at most {LONGEST:g} m"),
    ):
        if not usable.all():
            v = int(np.flatnonzero(~usable.all(axis=1))[0])
            raise InputError(f"vertices[{v}] = {points[v].tolist()}: coordinates must be {what}.")
    result = np.zeros((len(points), 3))
    result[:, : points.shape[1]] = points
    size = float(np.ptp(result, axis=0).max())
    if 0.0 < size < SHORTEST:
        raise InputError(
            f"vertices: they span {size:.3g} m: give coordinates that span at least {SHORTEST:g} m."
        )
    return result


def _letters(dihedrals: NDArray[np.float64]) -> NDArray[np.str_]:
    """Letter that fits the dihedral of each crease."""
    return np.select([dihedrals < np.pi - _FLAT, dihedrals > np.pi + _FLAT], ["V", "M"], "F")


def _given_letters(assignments: Any, topology: Topology) -> tuple[NDArray[np.str_], set[Edge]]:
    """Letter given for each crease ("" if none is), and the edges that are given as "B"."""
    creases = topology.creases
    given = np.full(len(creases), "", dtype="<U1")
    boundary_edges: set[Edge] = set()
    if assignments is None:
        return given, boundary_edges
    if isinstance(assignments, Mapping):
        row, rim = edge_rows(creases), edge_lookup(topology.boundary)
        welds = edge_lookup(topology.welds)
        before: dict[Edge, Any] = {}
        for key, letter in assignments.items():
            pair = vertex_pair("assignments", key)
            if before.setdefault(pair, letter) != letter:
                raise InputError(
                    f"assignments: edge {pair} is given both {before[pair]!r} and {letter!r}; "
                    "give it once."
                )
            if pair in row:
                given[row[pair]] = _checked_letter(letter, pair)
            elif pair in welds:
                if letter != "F":
                    raise InputError(
                        f'assignments: edge {pair} is {letter!r} but welded; give "F", leave it '
                        "out, or take it from the welds."
                    )
            elif pair not in rim:
                raise InputError(
                    f"assignments: {pair} is not an edge of any face; name the two vertices of "
                    "a crease."
                )
            elif letter != "B":
                raise InputError(
                    f'assignments: edge {pair} is {letter!r} but only one face has it; give "B" '
                    "or leave it out."
                )
            else:
                boundary_edges.add(pair)
        return given, boundary_edges
    assignments = single(assignments)
    if not isinstance(assignments, Sequence | np.ndarray):
        raise InputError(
            f"assignments = {assignments!r}: give a mapping from vertex pairs, a letter for each "
            "crease, or None."
        )
    if len(assignments) != len(creases):
        raise InputError(
            f"assignments has {len(assignments)} letters for {len(creases)} creases: give one for "
            "each, or a mapping from vertex pairs."
        )
    for k, letter in enumerate(assignments):
        given[k] = _checked_letter(letter, (int(creases[k, 0]), int(creases[k, 1])))
    return given, boundary_edges


def _checked_letter(letter: Any, pair: Edge) -> str:
    if letter in _LETTERS:
        return str(letter)
    remedy = 'give "M", "V", "F" or "U"'
    if letter == "B":
        raise InputError(
            f'assignments: edge {pair} is "B" (boundary) but two faces share it; {remedy}.'
        )
    if letter in ("C", "J"):
        what = "a cut" if letter == "C" else "a join of cut edges"
        raise InputError(
            f'assignments: edge {pair} is "{letter}" ({what}) but two faces share it; give the '
            f"faces vertices of their own there, or {remedy}."
        )
    raise InputError(f"assignments: edge {pair} is {letter!r}; {remedy}.")


def _warn_of_contradictions(given: NDArray, creases: NDArray, dihedrals: NDArray) -> None:
    off = dihedrals - np.pi
    wrong = (given == "M") & (off < -_CONTRADICTION) | (given == "V") & (off > _CONTRADICTION)
    wrong = np.flatnonzero(wrong)
    if len(wrong):
        k = int(wrong[0])
        a, b = creases[k].tolist()
        more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
        warn(
            f'assignments: crease ({a}, {b}){more} is given as "{given[k]}", but its dihedral '
            f"is {np.degrees(dihedrals[k]):.1f} degrees seen from the front (valleys are below "
            "180, mountains above): the letter is kept; turn the faces over or correct it",
            "patterns.md#your-own-patterns",
        )


def _warn_of_seams(pairs: list[tuple[Edge, Edge]], open_edges: set[Edge]) -> None:
    doubtful = [pair for pair in pairs if not open_edges.intersection(pair)]
    if doubtful:
        one, other = doubtful[0]
        more = f" (and {len(doubtful) - 1} more such pairs)" if len(doubtful) > 1 else ""
        warn(
            f"vertices: the boundary edges {one} and {other}{more} lie in the same place but are "
            "not joined, so that the panels part there: for a crease give both panels the same "
            f'vertices; for a cut give assignments = {{{one}: "B"}}, or "C" in a FOLD file',
            "patterns.md#your-own-patterns",
        )
