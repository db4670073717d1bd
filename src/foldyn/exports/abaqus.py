"""Abaqus: an input deck of a creased shell, for its frequencies and its statics.

Triangles are ``STRI3``, flat facets of thin shells, or ``S3``. ``*EQUATION`` gives coincident nodes
equal displacements. A further equation sets the first displacement of an extra node equal to their
relative rotation about the crease (in its position at rest); a spring ``SPRING1`` resists that
displacement. CalculiX, whose springs have no rotations, reads this too. Keywords follow the Abaqus
Keywords Reference Guide; numbers have at most 20 columns, as it requires.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.exports.creased_shell import CreasedShell, write_deck
from foldyn.exports.sections import line, section
from foldyn.structures import Ply, Sheet
from foldyn.structures.ply import pair
from foldyn.values import choice
from foldyn.writing import write_text

ELEMENTS = ("STRI3", "S3")
SHEET = "SHEET"
ALIKE = 9  # decimals of directions that count as equal


def write(
    result: Any,
    path: Path,
    case: Case,
    *,
    divisions: int | None = None,
    modes: int | None = None,
    element: str | None = None,
) -> list[Path]:
    """Write a deck: a frequency step at rest, then a static step under all loads.

    Parameters
    ----------
    result : Any
        Needed only of `foldyn.effective`, of which the section or material is written instead.
    path : Path
    case : Case
    divisions : int, optional
        Divisions of every edge, unless the case is a shell already; 16 by default.
    modes : int, optional
        How many frequencies; 6 by default.
    element : {"STRI3", "S3"}, optional
        Kind of the triangles; STRI3 is a thin shell, as in Foldyn.
    """
    if isinstance(result, xarray.Dataset) and result.attrs["foldyn_result"] == "effective":
        write_text("\n".join([*section(result), ""]), path)
        return [path]
    kind = ELEMENTS[0] if element is None else choice("element", element, ELEMENTS)
    return write_deck(case, path, divisions, modes, partial(_deck, kind=kind))


def _deck(shell: CreasedShell, count: int, kind: str) -> Iterator[str]:
    yield "*HEADING"
    yield "A creased shell, made by Foldyn"
    yield "** SI units. Node k + 1 is node k of Foldyn, vertices first; further nodes are those of"
    yield "** other panels at the same place. Damping and histories play no part."
    yield f"*NODE, NSET={SHEET}"
    for number, point in enumerate(shell.nodes.tolist(), 1):
        yield line(number, *point)
    yield from _panels(shell, kind)
    yield from _ties(shell)
    yield from _creases(shell)
    yield from _masses(shell)
    yield from _supports(shell)
    yield from ("*STEP", "*FREQUENCY", f"{count}", "*END STEP")
    if shell.forces:
        yield from _statics(shell)


def _panels(shell: CreasedShell, kind: str) -> Iterator[str]:
    for number, sheet in enumerate(shell.sheets, 1):
        own = np.flatnonzero(shell.kind == number - 1)
        if len(own) == 0:
            continue
        for k, part in enumerate(sheet.plies or [sheet], 1):
            yield f"*MATERIAL, NAME=MATERIAL_{_name(number, k if sheet.plies else 0)}"
            yield from _elastic(part)
            yield from ("*DENSITY", line(part.density))
        # orthotropic panels are a section for each direction
        axes = np.round(shell.axes[own], ALIKE) if sheet.orthotropic else np.zeros((len(own), 2, 3))
        ways, way = np.unique(axes, axis=0, return_inverse=True)
        for k, both in enumerate(ways):
            name, some = _name(number, k + 1 if sheet.orthotropic else 0), own[way.ravel() == k]
            yield f"*ELEMENT, TYPE={kind}, ELSET=PANELS_{name}"
            for row in (np.column_stack([some, shell.triangles[some]]) + 1).tolist():
                yield line(*row)
            yield from _section(sheet, number, name, both)


def _name(number: int | str, part: int) -> str:
    """Name of a part, counted from 1; 0 if there is one only."""
    return f"{number}_{part}" if part else f"{number}"


def _section(sheet: Sheet, number: int, name: str, axes: NDArray) -> Iterator[str]:
    """Thickness and material of a set of elements, with directions 1 and 2 (2, 3)."""
    section = f"*SHELL SECTION, ELSET=PANELS_{name}"
    if not sheet.orthotropic:
        yield from (f"{section}, MATERIAL=MATERIAL_{number}", line(sheet.thickness))
        return
    angles = [math.radians(ply.angle) for ply in sheet.plies or ()] or [0.0]
    for k, angle in enumerate(angles, 1):
        c, s = math.cos(angle), math.sin(angle)
        turned = np.array([[c, s], [-s, c]]) @ axes
        yield f"*ORIENTATION, NAME=AXES_{_name(name, k if sheet.plies else 0)}"
        yield from (line(*turned.ravel().tolist()), line(3, 0.0))
    if sheet.plies:
        yield f"{section}, COMPOSITE"
        for k, ply in enumerate(sheet.plies, 1):
            yield f"{line(ply.thickness)}, 3, MATERIAL_{number}_{k}, AXES_{name}_{k}"
    else:
        yield f"{section}, MATERIAL=MATERIAL_{number}, ORIENTATION=AXES_{name}"
        yield line(sheet.thickness)


def _elastic(part: Sheet | Ply) -> Iterator[str]:
    """Elastic constants; an orthotropic sheet has those of direction 2 along its normal, too."""
    first, second = pair(part.youngs_modulus)
    if part.shear_modulus is None:
        yield from ("*ELASTIC", line(first, part.poissons_ratio))
        return
    yield "*ELASTIC, TYPE=ENGINEERING CONSTANTS"
    shear = part.shear_modulus
    yield line(first, second, second, part.poissons_ratio, 0.0, 0.0, shear, shear)
    yield line(shear)


def _ties(shell: CreasedShell) -> Iterator[str]:
    """Equal displacements of coincident nodes, along axes that are not held."""
    for first, *others in shell.places:
        for node in others:
            for axis in np.flatnonzero(~shell.held[node]).tolist():
                yield "*EQUATION"
                yield "2"
                yield line(node + 1, axis + 1, 1.0, first + 1, axis + 1, -1.0)


def _creases(shell: CreasedShell) -> Iterator[str]:
    """Extra nodes for crease rotations, their equations, and springs on them."""
    pairs = np.concatenate([np.zeros((0, 2), int), *(joint.nodes for joint in shell.joints)])
    node, element = len(shell.nodes), len(shell.triangles)
    if len(pairs):
        yield "*NODE, NSET=TURNS"
        for number, point in enumerate(shell.nodes[pairs[:, 0]].tolist(), node + 1):
            yield line(number, *point)
    for crease, joint in enumerate(shell.joints, 1):
        turns = node + 1 + np.arange(len(joint.nodes))
        for turn, (first, second) in zip(turns.tolist(), (joint.nodes + 1).tolist(), strict=True):
            yield from _turn(turn, first, second, joint.axis)
        for part, stiffness in enumerate(np.unique(joint.stiffness).tolist(), 1):
            own = joint.stiffness == stiffness
            yield f"*ELEMENT, TYPE=SPRING1, ELSET=SPRINGS_{crease}_{part}"
            for number, turn in enumerate(turns[own].tolist(), element + 1):
                yield line(number, turn)
            yield f"*SPRING, ELSET=SPRINGS_{crease}_{part}"
            yield from ("1", line(stiffness))
            element += int(own.sum())
        node += len(turns)


def _turn(turn: int, first: int, second: int, axis: NDArray) -> Iterator[str]:
    """Rotation of the second node relative to the first about an axis, four terms per line."""
    terms = []
    for dof, part in enumerate(axis.tolist(), 4):
        if part != 0.0:
            terms += [(second, dof, -part), (first, dof, part)]
    yield "*EQUATION"
    yield f"{len(terms) + 1}"
    rows = [(turn, 1, 1.0), *terms]
    for k in range(0, len(rows), 4):
        yield line(*chain.from_iterable(rows[k : k + 4]))


def _masses(shell: CreasedShell) -> Iterator[str]:
    element = len(shell.triangles) + sum(len(joint.nodes) for joint in shell.joints)
    for number, node in enumerate(np.flatnonzero(shell.masses).tolist(), 1):
        yield f"*ELEMENT, TYPE=MASS, ELSET=MASS_{number}"
        yield line(element + number, node + 1)
        yield from (f"*MASS, ELSET=MASS_{number}", line(float(shell.masses[node])))


def _supports(shell: CreasedShell) -> Iterator[str]:
    yield "*BOUNDARY"
    if shell.joints:
        yield line("TURNS", 2, 3)
    for node, held in enumerate(shell.held.tolist(), 1):
        yield from (line(node, axis, axis) for axis in range(1, 4) if held[axis - 1])
    yield from (line(node + 1, 4, 6) for node in np.flatnonzero(shell.clamped).tolist())


def _statics(shell: CreasedShell) -> Iterator[str]:
    """All loads at full value, in increments that the program chooses; print displacements."""
    yield from ("*STEP, NLGEOM, INC=1000", "*STATIC", line(0.1, 1.0), "*CLOAD")
    force = np.sum(shell.forces, axis=0)
    for node, axis in np.argwhere(force).tolist():
        yield line(node + 1, axis + 1, float(force[node, axis]))
    yield from (f"*NODE PRINT, NSET={SHEET}", "U", "*END STEP")
