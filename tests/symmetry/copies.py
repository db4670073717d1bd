"""Copies of a case that must move as it does: turned, mirrored, renumbered, split.

A `Symmetry` says where points go, whether fronts become backs, and the new numbers of vertices and
panels. `copied` applies one to a case, `split` makes two of each load, spring, point mass and
damping. What either does to a field of a part, of a law or of the options of a model is told once,
by the field's name, in `FIELDS` and `HALVED`: a new kind whose fields are known needs no line here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.cases.directions import unit_vector
from foldyn.cases.reached import ReachedAngle
from foldyn.materials import BAR_LAWS, HINGE_LAWS

EARLIER = 1e-9  # s, between the histories of the halves of a load


@dataclass(frozen=True)
class Symmetry:
    """Points x go to matrix @ x + shift; what was number i gets the number vertices[i], panels[i].

    `over` tells whether fronts become backs: mountains are valleys then, and what is positive
    towards the front is negative.
    """

    matrix: np.ndarray
    shift: np.ndarray
    over: bool
    vertices: np.ndarray
    panels: np.ndarray

    @property
    def along_axes(self) -> bool:
        """Whether axes go to axes."""
        return bool(np.isin(np.abs(self.matrix), (0.0, 1.0)).all())


# ------------------------------------------------------------------ the symmetries of a case
def unchanged(case: fd.Case) -> Symmetry:
    pattern = case.structure.pattern
    here = np.arange(len(pattern.vertices)), np.arange(len(pattern.faces))
    return Symmetry(np.eye(3), np.zeros(3), False, *here)


def symmetries(case: fd.Case) -> tuple[Callable[..., Symmetry], ...]:
    """Those of a case: MERLIN2's order, as published, is that of the corners as they are listed."""
    ordered = getattr(case.structure.options, "calibration", "") == "merlin2"
    if ordered and any(len(face) > 3 for face in case.structure.pattern.faces):
        return (turned,)
    return turned, mirrored, renumbered


def turned(case: fd.Case, rng) -> Symmetry:
    """Turned about any axis and moved; about the coordinate axes where links name them."""
    matrix = Rotation.random(rng=rng).as_matrix()
    if any(isinstance(part, fd.Link) and part.axes not in (None, "xyz") for part in case.supports):
        matrix = np.round(Rotation.create_group("O")[int(rng.integers(1, 24))].as_matrix())
    shift = case.structure.pattern.size * rng.uniform(-1.0, 1.0, 3)
    return replace(unchanged(case), matrix=matrix, shift=shift)


def mirrored(case: fd.Case, rng) -> Symmetry:
    """Mirrored, and turned as above; fronts become backs in half of the cases."""
    turn = turned(case, rng)
    flipped = turn.matrix @ np.diag([-1.0, 1.0, 1.0])
    return replace(turn, matrix=flipped, over=bool(rng.integers(2)))


def renumbered(case: fd.Case, rng) -> Symmetry:
    """The same with other numbers of vertices and panels, and other corners of these first."""
    same = unchanged(case)
    vertices, panels = (rng.permutation(len(old)) for old in (same.vertices, same.panels))
    return replace(same, vertices=vertices, panels=panels)


# ------------------------------------------------------------------ copies of its parts
class Copy:
    """A case and its pattern under a symmetry."""

    def __init__(self, case: fd.Case, symmetry: Symmetry) -> None:
        self.symmetry, self.old = symmetry, case.structure.pattern
        self.sign = -1.0 if symmetry.over else 1.0
        # angles at a junction, the only creases of its pattern, are between panels, not fronts
        self.folds_over = symmetry.over and not len(self.old.junctions)
        self.pattern = self._pattern()
        self.crease = self._creases()
        options = {name: self.of("", name, v) for name, v in vars(case.structure.options).items()}
        sheet = self.part(case.structure.sheet)
        self.structure = remade(case.structure, self.pattern, sheet, options)
        self.node = self._nodes(case.structure.nodes, self.structure.nodes)

    def _pattern(self) -> fd.Pattern:
        s, old = self.symmetry, self.old
        backwards = s.over != (np.linalg.det(s.matrix) < 0.0)  # else the winding goes along
        faces = [()] * len(old.faces)
        for panel, face in enumerate(old.faces):
            new = s.vertices[list(face)].tolist()
            start = int(s.panels[panel] - panel) % len(new)  # another corner may come first
            new = new[start:] + new[:start]
            faces[s.panels[panel]] = tuple(new[::-1] if backwards else new)
        letters = {"M": "V", "V": "M"} if self.folds_over else {}
        pairs = [tuple(pair) for pair in s.vertices[old.creases].reshape(-1, 2).tolist()]
        given = zip(pairs, old.assignments, strict=True)
        vertices = np.empty_like(old.vertices)
        vertices[s.vertices] = old.vertices @ s.matrix.T + s.shift
        families = {name: [pairs[k] for k in rows] for name, rows in old.families.items()}
        return fd.Pattern(
            vertices, faces, {pair: letters.get(a, a) for pair, a in given}, families=families,
            welds=s.vertices[old.welds].reshape(-1, 2).tolist(),
        )  # fmt: skip

    def _creases(self) -> np.ndarray:
        """New number of each crease: that between the same panels at the same edge."""
        new, s = self.pattern, self.symmetry
        edges = [
            new.creases.tolist(),
            np.sort(s.vertices[self.old.creases].reshape(-1, 2)).tolist(),
        ]
        panels = [new.crease_faces, s.panels[self.old.crease_faces].reshape(-1, 2)]
        found, wanted = (
            [(*edge, *both) for edge, both in zip(one, np.sort(two).tolist(), strict=True)]
            for one, two in zip(edges, panels, strict=True)
        )
        return np.array([found.index(key) for key in wanted], np.int64)

    def _nodes(self, old: np.ndarray, new: np.ndarray) -> np.ndarray:
        """New number of each node: of vertices the given one, of others that at its place."""
        s = self.symmetry
        first = len(s.vertices)
        if len(old) == first:
            return s.vertices
        apart, found = cKDTree(new[first:]).query(old[first:] @ s.matrix.T + s.shift)
        assert apart.max() < 1e-9 * self.old.size
        return np.concatenate([s.vertices, first + found])

    def field(self, values: np.ndarray) -> np.ndarray:
        """Vectors (..., n, 3) of all nodes."""
        out = np.empty_like(values)
        out[..., self.node, :] = values @ self.symmetry.matrix.T
        return out

    # of fields
    def same(self, value: Any) -> Any:
        return value

    def vertices(self, value: Any) -> Any:
        return self.node[np.array(value, np.int64)].tolist()

    def line(self, value: Any) -> Any:
        return [self.point(one) if np.ndim(one) else int(self.node[one]) for one in value]

    def edges(self, value: Any) -> Any:
        return self.symmetry.vertices[np.array(value, np.int64).reshape(-1, 2)].tolist()

    def guided(self, value: Any) -> Any:
        return [(*self.edges([edge])[0], axis) for *edge, axis in value]

    def panels_of(self, value: Any) -> Any:
        return value if isinstance(value, str) else self.symmetry.panels[list(value)].tolist()

    def creases(self, value: Any) -> Any:
        if isinstance(value, str):
            swapped = {"mountain": "valley", "valley": "mountain"} if self.folds_over else {}
            return swapped.get(value, value)
        return self.crease[list(value)].tolist()

    def vector(self, value: Any) -> Any:
        return tuple((self.symmetry.matrix @ value).tolist())

    def direction(self, value: Any) -> Any:
        return self.vector(unit_vector(value))

    def point(self, value: Any) -> Any:
        return tuple((self.symmetry.matrix @ value + self.symmetry.shift).tolist())

    def to_front(self, value: Any) -> Any:
        """What is positive towards the front."""
        return (self.sign * np.array(value)).tolist()

    def of_fold(self, value: Any) -> Any:
        """What is positive where a valley opens or folds."""
        return (-np.array(value)).tolist() if self.folds_over else value

    def dihedral(self, value: Any) -> Any:
        return (360.0 - np.array(value)).tolist() if self.folds_over else value

    def until(self, value: Any) -> Any:
        if not isinstance(value, ReachedAngle):
            return value
        (crease,), angle = self.creases([value.crease]), self.dihedral(value.angle)
        return ReachedAngle(crease, float(angle))

    def side(self, value: Any) -> Any:
        swapped = {"below": "above", "above": "below"} if self.folds_over else {}
        return swapped.get(value, value)

    def layers(self, value: Any) -> Any:
        return tuple(value[::-1]) if self.symmetry.over else value

    def per_crease(self, value: Any) -> Any:
        if np.ndim(value) == 0:
            return value
        out = np.empty(len(self.crease), object)
        out[self.crease] = value
        return out.tolist()

    def rest_per_crease(self, value: Any) -> Any:
        return self.dihedral(self.per_crease(value))

    def law(self, value: Any) -> Any:
        return value if isinstance(value, str) else self.part(value)

    def laws(self, value: Any) -> Any:
        several = isinstance(value, tuple | list)
        return self.per_crease([*map(self.law, value)]) if several else self.law(value)

    def parts(self, value: Any) -> Any:
        return tuple(self.part(part) for part in value)

    def of(self, kind: str, name: str, value: Any) -> Any:
        """A field of a kind of part."""
        if value is None:
            return None
        number = Copy.same if kind in LAWS else None  # of a law: no symmetry changes it
        known = FIELDS.get(f"{kind}.{name}", FIELDS.get(name, number))
        assert known is not None, f"say in FIELDS what a symmetry does to {kind}.{name}"
        return known(self, value)

    def part(self, part: Any) -> Any:
        """A data class with all its fields."""
        kind = type(part).__name__
        own = {item.name: getattr(part, item.name) for item in fields(part) if item.init}
        if {"theta1", "theta2"} <= own.keys():  # the two ends of a range change places
            ends = sorted(self.dihedral([own["theta1"], own["theta2"]]))
            return replace(part, theta1=ends[0], theta2=ends[1])
        return replace(part, **{name: self.of(kind, name, value) for name, value in own.items()})

    def supports(self, supports: Iterable[Any]) -> list[Any]:
        """Supports; those along axes have directions where these turn."""
        if np.array_equal(self.symmetry.matrix, np.eye(3)):
            return [self.part(support) for support in supports]
        return [self.part(one) for support in supports for one in self._directed(support)]

    def _directed(self, support: Any) -> list[Any]:
        matrix = self.symmetry.matrix
        if isinstance(support, fd.BaseMotion):  # a vector: one along each of the axes now
            along = support.value * matrix[:, "xyz".index(support.axis)]
            return [
                replace(support, axis=axis, value=float(value))
                for axis, value in zip("xyz", along, strict=True)
                if value
            ]
        if isinstance(support, fd.Link) and support.axes not in (None, "xyz"):
            rows = [int(np.flatnonzero(matrix[:, "xyz".index(a)])[0]) for a in support.axes]
            return [replace(support, axes="".join(sorted("xyz"[row] for row in rows)))]
        if isinstance(support, fd.Fix) and support.axes not in (None, "xyz"):
            return [replace(support, axes=None, direction=axis) for axis in support.axes]
        if isinstance(support, fd.Impose) and support.axis is not None:
            return [replace(support, axis=None, direction=support.axis)]
        return [support]


LAWS = {law.__name__ for law in (*BAR_LAWS.values(), *HINGE_LAWS.values())}
FIELDS: Mapping[str, Callable[[Copy, Any], Any]] = {
    **dict.fromkeys(("nodes", "between", "to"), Copy.vertices),
    **dict.fromkeys(("edges", "clamped", "straight"), Copy.edges),
    "Cable.nodes": Copy.line,
    "guided": Copy.guided,
    **dict.fromkeys(("panels", "rigid"), Copy.panels_of),
    "creases": Copy.creases,
    **dict.fromkeys(("vector", "total", "force_per_length", "acceleration"), Copy.vector),
    **dict.fromkeys(("normal", "motion", "velocity"), Copy.vector),
    "point": Copy.point,
    "direction": Copy.direction,
    **dict.fromkeys(("pressure", "curvature"), Copy.to_front),
    **dict.fromkeys(("moment", "fold_angle"), Copy.of_fold),
    "angle": Copy.dihedral,
    "until": Copy.until,
    "layers": Copy.layers,
    "side": Copy.side,
    "crease_stiffness": Copy.per_crease,
    "crease_rest": Copy.rest_per_crease,
    **dict.fromkeys(("law", "bend_law"), Copy.law),
    "fold_law": Copy.laws,
    **dict.fromkeys(("Sheet.panels", "planes"), Copy.parts),
    # what no symmetry changes
    **dict.fromkeys(("history", "value", "axes", "axis", "name", "rest", "state"), Copy.same),
    **dict.fromkeys(("count", "scheme", "mass", "bar_law", "calibration", "divisions"), Copy.same),
    **dict.fromkeys(("membrane", "vertex_radius", "along"), Copy.same),
    **dict.fromkeys(("youngs_modulus", "poissons_ratio", "thickness", "density"), Copy.same),
    **dict.fromkeys(("length_scale_ratio", "fraction", "change", "expansion"), Copy.same),
    **dict.fromkeys(("stiffness", "rest_length", "coefficient", "alpha", "beta"), Copy.same),
    **dict.fromkeys(("bending", "pretension", "stiffness_history", "release"), Copy.same),
    **dict.fromkeys(("Stop.damping", "sliding_speed", "Bar.area"), Copy.same),
    **dict.fromkeys(("Bar.modulus", "Bar.law"), Copy.same),
    **dict.fromkeys(("ratios", "times", "onset", "yield_moment", "isotropic"), Copy.same),
    **dict.fromkeys(("kinematic", "barrier_moment", "rate", "friction"), Copy.same),
    **dict.fromkeys(("added_mass", "drag", "drag_coefficient", "resolution"), Copy.same),
    "Contact.panels": Copy.same,
}  # fmt: skip


def remade(structure: Any, pattern: fd.Pattern, sheet: fd.Sheet, options: dict) -> Any:
    """A structure of the kind of another."""
    make = fd.shell if structure.kind == "shell" else fd.discretize
    return make(pattern, sheet, **options)


def copied(case: fd.Case, symmetry: Symmetry) -> tuple[fd.Case, Copy]:
    """The case under a symmetry, and what else this does."""
    copy = Copy(case, symmetry)
    contact, air = (part and copy.part(part) for part in (case.contact, case.air))
    return fd.Case(
        copy.structure, copy.supports(case.supports), copy.parts(case.loads),
        copy.parts(case.dampings), copy.parts(case.masses), contact, air,
    ), copy  # fmt: skip


# ------------------------------------------------------------------ halves
HALVED = {
    "vector", "total", "force_per_length", "acceleration", "pressure", "moment", "change",
    "PointMass.mass", "Spring.stiffness", "Bar.stiffness", "Bar.area", "Cable.stiffness",
    "Stop.stiffness", "Latch.stiffness", "coefficient", "BaseMotion.value",
}  # fmt: skip
"""Fields in proportion to which a part acts; a part that has none of them is not split."""


def earlier(history: Any) -> Any:
    """A history that differs by as good as nothing, but is another."""
    for item in fields(history):
        value = getattr(history, item.name)
        if not isinstance(value, bool | str):
            return replace(history, **{item.name: value - EARLIER})
    return fd.Step(-1.0)  # constant from then on


def halves(part: Any) -> list[Any]:
    """Two parts that together act as one does."""
    kind = type(part).__name__
    for item in fields(part):
        value = getattr(part, item.name)
        if value is not None and {item.name, f"{kind}.{item.name}"} & HALVED:
            half = replace(part, **{item.name: (0.5 * np.array(value)).tolist()})
            for other in ("pretension", "release", "damping", "mass"):
                if getattr(part, other, None) is not None:
                    half = replace(half, **{other: 0.5 * getattr(part, other)})
            if getattr(part, "history", None) is None or isinstance(part, fd.Spring | fd.Cable):
                return [half, half]
            return [half, replace(half, history=earlier(part.history))]
    return [part]


def split(case: fd.Case) -> fd.Case:
    """The case with all that can be split in two."""

    def each(parts):
        return [half for part in parts for half in halves(part)]

    return case.altered(
        supports=each(case.supports), loads=each(case.loads), damping=each(case.dampings),
        masses=each(case.masses),
    )  # fmt: skip
