"""A creased shell in the form that finite-element programs need.

Shells of these programs have rotations at nodes, and two panels that meet at a crease cannot share
them. So each panel has its own nodes. Coincident nodes move together and may rotate relative to
each other about the crease; a spring with their share of the crease stiffness resists that
rotation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.condensation import Superelements
from foldyn.errors import InputError, warn
from foldyn.linear.shell_of import check_reduced, shell_of
from foldyn.patterns.topology import Lines, components
from foldyn.shells import Shell
from foldyn.structures import Sheet
from foldyn.structures.discretized import Discretized
from foldyn.structures.material_axes import material_axes, panel_axes
from foldyn.values import whole
from foldyn.writing import write_text

DIVISIONS = 16  # gives frequencies of the case studies within 1 %


@dataclass(frozen=True, eq=False)
class Joint:
    """A crease, where two panels meet.

    Attributes
    ----------
    axis : (3,)
        Unit vector from the lower to the higher vertex.
    nodes : (m, 2)
        Pairs of coincident nodes: first of the panel whose outline, counter-clockwise from the
        front, runs along the axis, then of the other panel. The dihedral grows as the second node
        rotates relative to the first about the axis.
    stiffness : (m,)
        Stiffness of each pair, N m/rad.
    """

    axis: NDArray
    nodes: NDArray
    stiffness: NDArray


@dataclass(frozen=True, eq=False)
class CreasedShell:
    """Panels with their own nodes, joined along creases, with supports and loads.

    Attributes
    ----------
    nodes : (n, 3)
        m.
    triangles, kind : (nt, 3), (nt,)
        Nodes, counter-clockwise seen from the front; index of each triangle's sheet in `sheets`.
    sheets : tuple of Sheet
    axes : (nt, 2, 3)
        Directions 1 and 2 of orthotropic sheets in the triangles' planes.
    joints : tuple of Joint
    places : tuple of tuples of int
        Groups of coincident nodes.
    held : (n, 3)
        Whether a node is held along each axis.
    clamped : (n,)
        Whether a node's rotations are held too.
    forces : tuple of (n, 3)
        Nodal forces of each load, N.
    masses : (n,)
        Point masses, kg.
    """

    nodes: NDArray
    triangles: NDArray
    kind: NDArray
    sheets: tuple[Sheet, ...]
    axes: NDArray
    joints: tuple[Joint, ...]
    places: tuple[tuple[int, ...], ...]
    held: NDArray
    clamped: NDArray
    forces: tuple[NDArray, ...]
    masses: NDArray

    @property
    def membrane(self) -> float:
        """Largest membrane stiffness E t among the sheets, N/m."""
        return max(max(sheet.moduli) * sheet.thickness for sheet in self.sheets)

    @property
    def loose(self) -> list[tuple[int, int]]:
        """Pairs of coincident nodes that no chain of joints connects."""
        pairs = np.concatenate([np.zeros((0, 2), int), *(joint.nodes for joint in self.joints)])
        part = components(pairs, len(self.nodes))
        found = []
        for place in self.places:
            first = {part[place[0]]: place[0]}
            for node in place[1:]:
                if part[node] not in first:
                    first[part[node]] = node
                    found.append((place[0], node))
        return found


def creased_shell(case: Case, divisions: int | None = None) -> CreasedShell:
    """Creased shell of a case; node k stands where node k of the case's shell does.

    Parameters
    ----------
    case : Case
        A shell, or bars and hinges, whose pattern and sheet are turned into a shell.
    divisions : int, optional
        Divisions of every edge of that shell; 16 by default.

    Raises
    ------
    InputError
        The case has features that other programs would not compute alike.

    Warns
    -----
    FoldynWarning
        Nonlinear folds are linearized about rest; dashpots and motions of the base are left out.
    """
    held = _shell_case(case, divisions)
    _check(held)
    shell = held.structure
    assert isinstance(shell, Shell)
    sheets, kind = shell.sheet.kinds(len(shell.pattern.faces))
    axes, fibers = panel_axes(shell.pattern), material_axes(shell.pattern, shell.sheet)
    if fibers is not None:
        axes = np.stack([fibers, np.cross(shell.pattern.face_normals, fibers)], axis=1)
    split = _Split(shell, components(shell.pattern.weld_faces, len(shell.pattern.faces)))
    clamped = np.zeros(len(split.origin), bool)
    for edge, row in zip(shell.options.clamped, shell.clamped_nodes, strict=True):
        panel = next(k for k, face in enumerate(shell.pattern.faces) if set(edge) <= set(face))
        clamped[split.of(panel, row)] = True
    share = 1.0 / np.bincount(split.origin)[split.origin]
    return CreasedShell(
        nodes=shell.nodes[split.origin],
        triangles=split.triangles,
        kind=kind[shell.triangle_panel],
        sheets=tuple(sheets),
        axes=axes[shell.triangle_panel],
        joints=_joints(shell, split),
        places=split.places,
        held=held.fixed[split.origin],
        clamped=clamped,
        forces=tuple(force[split.origin] * share[:, None] for force, _ in held.load_terms),
        masses=held.point_masses[split.origin] * share,
    )


def write_deck(
    case: Case, path: Path, divisions: int | None, modes: int | None,
    lines: Callable[[CreasedShell, int], Iterator[str]],
) -> list[Path]:  # fmt: skip
    """Write the lines that a function makes of the creased shell and a number of frequencies."""
    count = 6 if modes is None else whole("modes", modes, least=1)
    write_text("\n".join([*lines(creased_shell(case, divisions), count), ""]), path)
    return [path]


def shares(count: int) -> NDArray:
    """Shares (count,) of a total for evenly spaced points; the end points get half as much."""
    share = np.full(count, 1.0 / (count - 1))
    share[[0, -1]] *= 0.5
    return share


class _Split:
    """Nodes of a shell (n,), duplicated for each group of panels that are joined without a crease.

    Nodes keep their number in the first group that uses them; duplicates are numbered after all.
    """

    def __init__(self, shell: Discretized, part: NDArray) -> None:
        self._part, count = part, len(shell.nodes)
        key = part[shell.triangle_panel][:, None] + shell.triangles * (part.max() + 1)
        found, inverse = np.unique(key, return_inverse=True)
        node = found // (part.max() + 1)
        first = np.diff(node, prepend=-1) > 0
        number = np.where(first, node, count + np.cumsum(~first) - 1)
        if first.sum() < count:
            lost = np.setdiff1d(np.arange(count), node)[0]
            raise InputError(f": vertex {lost} belongs to no panel; leave it out", "pattern")
        self._number = dict(zip(found.tolist(), number.tolist(), strict=True))
        self.triangles = number[inverse.reshape(shell.triangles.shape)]
        self.origin = np.concatenate([np.arange(count), node[~first]])
        own = np.split(number, np.flatnonzero(first)[1:])
        self.places = tuple(tuple(nodes.tolist()) for nodes in own if len(nodes) > 1)

    def of(self, panel: int, nodes: NDArray) -> list[int]:
        """New node numbers for a panel."""
        keys = self._part[panel] + nodes * (self._part.max() + 1)
        return [self._number[key] for key in keys.tolist()]


def _joints(shell: Shell, split: _Split) -> tuple[Joint, ...]:
    """Joints of all creases; each pair of nodes has its share of the crease's stiffness."""
    pattern, slope = shell.pattern, fold_slopes(shell)
    lines, found = Lines.of(pattern.creases).number, []
    for crease, (low, high) in enumerate(pattern.creases.tolist()):
        axis = pattern.vertices[high] - pattern.vertices[low]
        row = shell.edge_nodes[lines[crease]]
        both = [split.of(panel, row) for panel in pattern.crease_faces[crease].tolist()]
        if both[0] == both[1]:
            raise InputError(
                f": the panels on both sides of crease {crease} are joined elsewhere by welds, so "
                "they cannot have separate nodes at the crease",
                "pattern",
            )
        stiffness = shell.fold_stiffness[crease] * slope[crease] * shares(len(row))
        found.append(Joint(axis / np.linalg.norm(axis), np.transpose(both), stiffness))
    return tuple(found)


def fold_slopes(structure: Discretized) -> NDArray:
    """Slope (nf,) of the law of each fold at rest, divided by the stiffness of the fold.

    Raises
    ------
    InputError
        A fold has no slope at rest, or has a moment at rest.

    Warns
    -----
    FoldynWarning
        Folds that are not linear about rest.
    """
    law, rest = structure.fold_law, structure.fold_rest
    if law.elastic is not law:
        raise InputError(f" = {law}: springs have no memory; take its elastic part", "fold_law")
    slope, moment = law.slope(rest, rest), law.moment(rest, rest)
    if not (slope > 0.0).all() or np.abs(moment).max(initial=0.0) > 0.0:
        raise InputError(
            f" = {law}: a spring can replace only a fold that has stiffness and no moment at rest; "
            'take "linear" or "enhanced"',
            "fold_law",
        )
    low, high = law.each(
        lambda own, rows: np.repeat(
            np.reshape(own.linear_between or (np.nan, np.nan), (2, 1)), len(rest[rows]), axis=1
        )
    )
    curved = np.flatnonzero(~((low < rest) & (rest < high)))
    if len(curved):
        warn(
            f"fold_law = {law}: {len(curved)} of {len(rest)} folds are not linear about rest; they "
            "become linear springs with the slope at rest: frequencies are right, statics are not",
            "exports.md#input-decks",
        )
    return slope


# ------------------------------------------------------------------ what is refused
def _shell_case(case: Case, divisions: int | None) -> Case:
    """The case with a shell as its structure; a case that has one is returned unchanged."""
    if case.structure.kind == Shell.kind:
        if divisions is not None:
            raise InputError(
                f" = {divisions}: the case is a shell already, with "
                f"{case.structure.options.divisions} divisions; change them there",
                "divisions",
            )
        return case
    count = DIVISIONS if divisions is None else whole("divisions", divisions, least=1)
    check_reduced(case, Superelements.kind)
    return shell_of(case, count)


def _check(case: Case) -> None:
    """Refuse anything that springs, plain supports and constant forces cannot represent."""
    structure: Discretized = case.structure
    wrong = (
        (structure.sheet.density is None, "sheet.density", "is missing; give it (kg/m3)"),
        (structure.pattern.boards is not None, "pattern", "has thick panels; give the thin one"),
        (
            structure.options.vertex_radius is not None,
            "vertex_radius",
            "panels do not stretch about vertices; leave it out",
        ),
        (structure.options.rigid is not None, "rigid", "panels are rigid; let them bend"),
        (
            structure.options.crease_rest is not None,
            "crease_rest",
            "folds with another rest angle are under stress; give the pattern as it is at rest",
        ),
        (case.imposed.any(), "supports", "move nodes; hold them with Fix, and load them"),
        (case.constraints, "supports", "hold oblique directions or tie nodes; hold axes"),
        (
            case.terms or case.latches,
            "supports",
            "have springs, bars, cables, end stops or latches; leave them out",
        ),
        (case.following_terms, "loads", "follow the sheet or come from temperature; give forces"),
        (case.contact, "contact", "leave it out: decks have no contact"),
        (case.air, "air", "leave it out: decks have no air"),
        (case.rest_terms, "loads", "fold creases; give the folded pattern, and forces"),
    )
    for is_wrong, field, text in wrong:
        if is_wrong:
            raise InputError(f": {text} (an input deck has no place for this)", field)
    held = np.all(case.fixed, axis=1)
    if not all(held[row].all() for row in structure.clamped_nodes):
        raise InputError(
            ": a deck has no clamps that move or slide; hold both ends along all axes", "clamped"
        )
    silent = {"dashpots": case.dashpots, "motions of the base": case.base_terms}
    left = [name for name, parts in silent.items() if parts]
    if left:
        warn(
            f"{' and '.join(left)} are left out: they change neither frequencies nor statics",
            "exports.md#input-decks",
        )
