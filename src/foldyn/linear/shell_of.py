"""The shell equivalent of a case of bars and hinges: same pattern, sheet, supports and loads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from foldyn.cases import Case, Rayleigh
from foldyn.condensation import SuperelementsOptions, superelements
from foldyn.errors import InputError, warn, within
from foldyn.patterns import Pattern
from foldyn.shells import ShellOptions, shell
from foldyn.structures import Structure
from foldyn.structures.discretized import Discretized
from foldyn.values import of_kind, show, whole

DIVISIONS = (6, 12)  # pieces of every edge in the two finer meshes
MOST_TRIANGLES = 15_000
"""Most triangles of a default shell: its modes take ten to twenty seconds."""
GRADED = (8, 12)
"""Divisions of the two finer meshes with a vertex radius; the coarsest mesh has 4."""
MESH = {"divisions", "level", "mass", "vertex_radius"}
"""Options of shells and superelements that bars and hinges lack."""


def check_reduced(case: Any, *others: str) -> None:
    """Refuse anything but a case of bars and hinges that has a shell equivalent.

    others : kinds of models that will do, too.

    Raises
    ------
    InputError
        Not a case, a shell, a structure that `discretize` did not make, a sheet without density,
        or a support, load or mass at the center of a panel.
    """
    of_kind("case", case, Case)
    structure = case.structure
    if structure.kind not in (Structure.kind, *others):
        raise InputError(
            f": its model is {structure.kind}, and the shell is made from bars and hinges; make "
            'its structure with fd.discretize (in a case file model.kind = "bars_and_hinges")',
            "case",
        )
    if structure.pattern is None or not structure.as_made:
        raise InputError(
            ": its structure was changed after fd.discretize made it, and has no equivalent shell; "
            "give the changes to fd.discretize",
            "case",
        )
    if structure.sheet.density is None:
        raise InputError(": missing; frequencies need it (kg/m3)", "sheet.density")
    _check_nodes(case)


def _check_nodes(case: Case) -> None:
    """Refuse nodes other than vertices: in a shell their numbers refer to other places."""
    count = len(case.structure.pattern.vertices)
    for place, nodes in _numbered(case):
        beyond = [node for node in nodes if node >= count]
        if beyond:
            panel = np.flatnonzero(case.structure.centers == beyond[0])
            what = f"is the center of panel {panel[0]}" if len(panel) else "is no vertex"
            raise InputError(
                f": node {beyond[0]} {what}, where the shell has no node of this number; name "
                f"vertices, 0 to {count - 1}",
                place,
            )


def _numbered(case: Case) -> Iterator[tuple[str, list[int]]]:
    """Fields of a case that name nodes by number, and these nodes."""
    for name in ("supports", "loads", "masses"):
        for i, part in enumerate(getattr(case, name)):
            for key in ("nodes", "between", "to"):
                given = getattr(part, key, None)
                if given is not None and not isinstance(given, str):
                    found = (np.ravel(one) for one in np.atleast_1d(np.array(given, object)))
                    nodes = [one[0] for one in found if len(one) == 1]  # no points
                    yield f"{name}[{i}].{key}", nodes


def shell_of(case: Case, divisions: int, vertex_radius: float | None = None) -> Case:
    """The case with a shell of the same pattern, sheet, creases and panels, without damping.

    The first nodes of the shell are the vertices, so that supports, loads and masses apply to both.
    """
    structure = case.structure
    with within("shell: "):
        mesh = shell(
            structure.pattern, structure.sheet, divisions=divisions, mass="consistent",
            vertex_radius=vertex_radius, **shared_options(structure, ShellOptions),
        )  # fmt: skip
    return with_structure(case, mesh)


def superelements_of(case: Case, **options: Any) -> Case:
    """The case with superelements; other arguments as in `superelements`."""
    structure = case.structure
    with within("superelements: "):
        other = superelements(
            structure.pattern, structure.sheet, **options,
            **shared_options(structure, SuperelementsOptions),
        )  # fmt: skip
    return with_structure(case, other)


def shared_options(structure: Discretized, options: type) -> dict[str, Any]:
    """Options of bars and hinges that another model takes, too: creases, clamps, rigid panels."""
    known = {item.name for item in fields(options)} - MESH
    return {name: value for name, value in vars(structure.options).items() if name in known}


def with_structure(case: Case, structure: Discretized) -> Case:
    """The case with another structure and without damping, which modes at rest do not need."""
    return case.altered(structure=structure, damping=Rayleigh())


def triangle_count(pattern: Pattern, divisions: int) -> int:
    """Triangles of a shell: two for each cell of a quadrilateral, fans in larger polygons."""
    fans = {3: 1, 4: 2}
    return divisions**2 * sum(fans.get(len(face), len(face)) for face in pattern.faces)


def meshes(pattern: Pattern, given: Sequence[int] | None) -> tuple[int, int]:
    """Divisions of the two shells: as given, or up to `DIVISIONS` within a size limit.

    Raises
    ------
    InputError
        Not two increasing numbers; or so many panels that even the coarsest meshes are large.

    Warns
    -----
    FoldynWarning
        The meshes are coarser than `DIVISIONS`.
    """
    if given is not None:
        return checked_divisions(given)
    whole_size = triangle_count(pattern, DIVISIONS[1])
    for half in range(DIVISIONS[0], 1, -1):
        size = triangle_count(pattern, 2 * half)
        if size > MOST_TRIANGLES:
            continue
        if half < DIVISIONS[0]:
            warn(
                f"the shell with {DIVISIONS[1]} divisions would have {whole_size} triangles: it "
                f"has {2 * half} divisions and {size} triangles; divisions = {DIVISIONS} gives "
                "the finer shell, which takes longer",
                "fidelity.md#your-own-pattern",
            )
        return half, 2 * half
    raise InputError(
        f": the shell of {len(pattern.faces)} panels would have "
        f"{triangle_count(pattern, 4)} triangles even with 4 divisions, more than "
        f"{MOST_TRIANGLES}; compare fewer cells of the pattern, or give divisions = (2, 4), "
        "which takes long",
        "divisions",
    )


def graded_meshes(given: Sequence[int] | None) -> tuple[int, int]:
    """Divisions of the two finer shells with a vertex radius; the third is half as fine.

    Raises
    ------
    InputError
        Not two increasing numbers, or not multiples that graded meshes need.
    """
    coarse, fine = checked_divisions(GRADED if given is None else given)
    if coarse % 8 or fine % 4:
        raise InputError(
            f" = {show(given)}: with a vertex_radius the first is a multiple of 8, since a "
            f"mesh half as fine is also made, and the second one of 4, as in {GRADED}",
            "divisions",
        )
    return coarse, fine


def checked_divisions(given: Any, name: str = "divisions") -> tuple[int, int]:
    """Two increasing whole numbers, at least 2, since a mesh of half the first is also made."""
    if isinstance(given, str) or not isinstance(given, Sequence) or len(given) != 2:
        raise InputError(f" = {show(given)}: give two numbers, as in (6, 12)", name)
    coarse, fine = (whole(name, value, least=2) for value in given)
    if coarse >= fine:
        raise InputError(f" = {show(given)}: the second mesh must be the finer one", name)
    return coarse, fine
