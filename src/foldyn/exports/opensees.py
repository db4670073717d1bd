"""OpenSees: a creased shell as a list of commands, which can be run or written as Tcl.

Triangles are ``ASDShellT3 -corotational``: MITC3 with drilling rotations, a third of their mass at
each corner. Coincident nodes are tied by stiff springs of a ``zeroLength`` element; its fourth
direction is the rotation about the crease, in the crease's position at rest.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.exports.creased_shell import CreasedShell, Joint, write_deck
from foldyn.structures.ply import pair
from foldyn.structures.sheet import Sheet

Command = tuple[Any, ...]
"""Name of an OpenSees command, followed by its arguments."""

TIE = 100.0  # stiffness of the springs that tie nodes, relative to the membrane stiffness E t (N/m)
TOLERANCE = 1e-7  # m and rad: norm of the last correction in a step
ITERATIONS = 60
TIE_MATERIAL = 1
MOVES, TURN = (1, 2, 3), 4  # directions of a spring: along its three axes; rotation about the first
EIGEN = "-genBandArpack"


def model(shell: CreasedShell, tie: float = TIE) -> Iterator[Command]:
    """Commands for nodes, elements, springs, supports and point masses; node k has number k + 1."""
    for number, point in enumerate(shell.nodes.tolist(), 1):
        yield "node", number, *point
    for number, sheet in enumerate(shell.sheets, 1):
        yield from _section(number, sheet)
    for number, (own, kind) in enumerate(zip(shell.triangles + 1, shell.kind, strict=True), 1):
        turned = shell.sheets[kind].orthotropic
        axes = ("-local", *shell.axes[number - 1, 0].tolist()) if turned else ()
        yield "element", "ASDShellT3", number, *own.tolist(), int(kind) + 1, "-corotational", *axes
    yield "uniaxialMaterial", "Elastic", TIE_MATERIAL, tie * shell.membrane
    yield from _springs(shell)
    for node in np.flatnonzero(shell.held.any(axis=1) | shell.clamped).tolist():
        turns = 3 * [int(shell.clamped[node])]
        yield "fix", node + 1, *shell.held[node].astype(int).tolist(), *turns
    for node in np.flatnonzero(shell.masses).tolist():
        yield "mass", node + 1, *3 * [float(shell.masses[node])], 0.0, 0.0, 0.0


def _section(number: int, sheet: Sheet) -> Iterator[Command]:
    """Section of a sheet; an orthotropic one has stiffness 2 along its normal, too."""
    density = sheet.density or 0.0
    if sheet.plies:
        raise InputError(
            ": OpenSees has no section of turned plies; export to Abaqus or CalculiX", "sheet.plies"
        )
    if not sheet.orthotropic:
        yield (
            "section", "ElasticMembranePlateSection", number, sheet.youngs_modulus,
            sheet.poissons_ratio, sheet.thickness, density,
        )  # fmt: skip
        return
    first, second = pair(sheet.youngs_modulus)
    shears = 3 * [sheet.shear_modulus]
    yield (
        "nDMaterial", "ElasticOrthotropic", 2 * number - 1, first, second, second,
        sheet.poissons_ratio, 0.0, 0.0, *shears, density,
    )  # fmt: skip
    yield "nDMaterial", "PlateFiber", 2 * number, 2 * number - 1
    yield "section", "PlateFiber", number, 2 * number, sheet.thickness


def _springs(shell: CreasedShell) -> Iterator[Command]:
    """Springs about creases, and springs that tie nodes."""
    material = TIE_MATERIAL
    for joint, first in zip(shell.joints, first_springs(shell), strict=False):
        values, which = np.unique(joint.stiffness, return_inverse=True)
        for number, stiffness in enumerate(values.tolist(), material + 1):
            yield "uniaxialMaterial", "Elastic", number, stiffness
        for place, (nodes, own) in enumerate(zip((joint.nodes + 1).tolist(), which, strict=True)):
            yield (
                "element", "zeroLength", first + place, *nodes,
                "-mat", material + 1 + int(own), *[TIE_MATERIAL] * len(MOVES),
                "-dir", TURN, *MOVES, "-orient", *_frame(joint),
            )  # fmt: skip
        material += len(values)
    for number, (a, b) in enumerate(shell.loose, first_springs(shell)[-1]):
        ties = [TIE_MATERIAL] * len(MOVES)
        yield "element", "zeroLength", number, a + 1, b + 1, "-mat", *ties, "-dir", *MOVES


def first_springs(shell: CreasedShell) -> list[int]:
    """Number of the first spring of each joint, and the number after the last spring."""
    counts = [len(joint.nodes) for joint in shell.joints]
    return np.cumsum([len(shell.triangles) + 1, *counts]).tolist()


def _frame(joint: Joint) -> list[float]:
    """The axis of a crease and a vector across it."""
    across = np.cross(np.eye(3)[np.abs(joint.axis).argmin()], joint.axis)
    return [*joint.axis.tolist(), *across.tolist()]


def load(number: int, force: NDArray, *series: Any) -> Iterator[Command]:
    """Nodal forces (n, 3), N, times a time series, which is given by its kind and arguments."""
    kind, *rest = series
    yield "timeSeries", kind, number, *rest
    yield "pattern", "Plain", number, number
    for node in np.flatnonzero(force.any(axis=1)).tolist():
        yield "load", node + 1, *force[node].tolist(), 0.0, 0.0, 0.0


def solver(algorithm: str, tolerance: float = TOLERANCE) -> Iterator[Command]:
    """Plain constraints and an unsymmetric solver, because the tangent is not symmetric."""
    yield "constraints", "Plain"
    yield "numberer", "RCM"
    yield "system", "UmfPack"
    yield "test", "NormDispIncr", tolerance, ITERATIONS, 0
    yield "algorithm", algorithm


def run(domain: Any, commands: Iterable[Command]) -> None:
    """Execute commands in an OpenSees model."""
    for name, *arguments in commands:
        getattr(domain, name)(*arguments)


# ------------------------------------------------------------------ files
def write(
    result: Any, path: Path, case: Case, *, divisions: int | None = None, modes: int | None = None
) -> list[Path]:
    """Write a deck in Tcl: frequencies at rest, then statics under all loads.

    Parameters
    ----------
    result : Any
        Not needed.
    path : Path
    case : Case
    divisions : int, optional
        Divisions of every edge, unless the case is a shell already; 16 by default.
    modes : int, optional
        How many frequencies; 6 by default.
    """
    vertices = len(case.structure.pattern.vertices)
    return write_deck(case, path, divisions, modes, partial(_script, vertices=vertices))


def _script(shell: CreasedShell, count: int, vertices: int) -> Iterator[str]:
    yield "# A creased shell, in SI units. Node k + 1 is node k of Foldyn, vertices first; further"
    yield "# nodes are those of other panels at the same place. Damping and histories play no part."
    yield "model basic -ndm 3 -ndf 6"
    yield from map(_tcl, model(shell))
    yield from map(_tcl, solver("Newton"))
    yield f"foreach value [eigen {EIGEN} {count}] " + "{"
    yield '  puts "frequency [expr {sqrt($value) / (2.0 * acos(-1.0))}]"'
    yield "}"
    if not shell.forces:
        return
    for number, force in enumerate(shell.forces, 1):
        series, pattern, *loads = load(number, force, "Linear")
        yield _tcl(series)
        yield f"{_tcl(pattern)} " + "{"
        yield from (f"  {_tcl(one)}" for one in loads)
        yield "}"
    yield "integrator LoadControl 0.1"
    yield "analysis Static"
    yield "if {[analyze 10] != 0} {error {no balance was found}}"
    yield f"for {{set node 1}} {{$node <= {vertices}}} {{incr node}} " + "{"
    yield '  puts "displacement $node [nodeDisp $node 1] [nodeDisp $node 2] [nodeDisp $node 3]"'
    yield "}"


def _tcl(command: Command) -> str:
    return " ".join(map(str, command))
