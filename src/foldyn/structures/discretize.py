"""From a pattern and a sheet to a structure of bars and hinges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn import materials
from foldyn.errors import InputError
from foldyn.materials import BarLaw, EnhancedLinear, HingeLaw, PlateSuperlinear
from foldyn.materials.plate_superlinear import plate_onset
from foldyn.memory import check_memory
from foldyn.patterns import Pattern
from foldyn.structures import calibration as calibrate
from foldyn.structures import plate
from foldyn.structures.mass import MASS_RULES
from foldyn.structures.mesh import lengths, n4b5, n5b8
from foldyn.structures.sheet import Sheet
from foldyn.structures.structure import ModelOptions, Structure, hinge_angles
from foldyn.values import choice, numbers, vector

PER_NODE = 5000.0
"""Bytes a node with its tangent: 5200 and 4900 measured with 20,000 and 80,000 nodes."""


def discretize(
    pattern: Pattern,
    sheet: Sheet,
    scheme: Literal["n5b8", "n4b5"] = "n5b8",
    mass: str = "mixed_voronoi",
    bar_law: str | BarLaw = "ogden",
    fold_law: str | HingeLaw = EnhancedLinear(),
    bend_law: str | HingeLaw = "superlinear",
    calibration: Literal["standard", "merlin2", "plate"] = "standard",
    crease_stiffness: float | Sequence[float] | None = None,
    crease_rest: float | Sequence[float] | None = None,
    centers: Mapping[int, ArrayLike] | None = None,
) -> Structure:
    """Discretize a pattern as bars and hinges.

    Parameters
    ----------
    pattern : Pattern
    sheet : Sheet
    scheme : {"n5b8", "n4b5"}
        A center node and spokes in each panel of more than three corners, or cuts along the
        shortest diagonals.
    mass : str
        Mass rule, one of `foldyn.structures.MASS_RULES`.
    bar_law : {"ogden", "linear"} or BarLaw
    fold_law, bend_law : {"linear", "superlinear", "enhanced", "plate_superlinear"} or HingeLaw
    calibration : {"standard", "merlin2", "plate"}
        "merlin2" assigns bend stiffnesses and bar areas in MERLIN2's order (see
        `foldyn.structures.calibration`); "plate" makes panels bend and twist as thin plates do, for
        small vibrations (see `foldyn.structures.plate`).
    crease_stiffness : float or sequence, optional
        Stiffness per length (N m/rad per m) of all creases or of each, instead of the calibration.
        With "plate" the panels beside a crease still give way to its moment.
    crease_rest : float or sequence, optional
        Rest dihedral (degrees, between 0 and 360) of all creases or of each, in the order of
        `pattern.creases`, instead of the pattern's own.
    centers : mapping, optional
        Center points (3,) by panel number, instead of the computed ones (N5B8).

    Returns
    -------
    Structure

    Raises
    ------
    InputError
        An argument out of range, a panel that cannot be cut, a crease closed at rest.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> sheet = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.25, thickness=0.01)
    >>> fd.discretize(pattern, sheet).fold_stiffness.round(4).tolist()
    [0.0639]
    """
    check_kinds(pattern, sheet)
    options = ModelOptions(
        scheme, mass, bar_law, fold_law, bend_law, calibration, crease_stiffness, crease_rest
    )
    materials.bar_law(bar_law)
    materials.hinge_law(fold_law, "fold_law")
    bending = materials.hinge_law(bend_law, "bend_law")
    if isinstance(bending, PlateSuperlinear) and bending.onset is None and calibration != "plate":
        raise InputError(
            ' = "plate_superlinear": has a plate\'s stiffness for small turns, which only '
            'calibration = "plate" gives to bends; set it, or give PlateSuperlinear(onset=...)',
            "bend_law",
        )
    choice("mass", mass, MASS_RULES)
    nodes = len(pattern.vertices) + len(pattern.faces)
    check_memory("pattern", f"a structure of {nodes} nodes", PER_NODE * nodes, "take fewer panels")
    calibrate.check_scale(sheet, pattern)
    points = _given_centers(centers or {}, pattern, scheme)
    mesh = n5b8(pattern, points) if scheme == "n5b8" else n4b5(pattern)
    merlin2 = calibration == "merlin2"
    inner_area, edge_area = calibrate.bar_areas(mesh, pattern, sheet, merlin2)
    outer = np.concatenate([pattern.creases, pattern.boundary]).reshape(-1, 2)
    area = np.concatenate([inner_area, [edge_area[a, b] for a, b in outer.tolist()]])

    folds = fold_stiffness(crease_stiffness, pattern, sheet)
    bends, onset = calibrate.bend_stiffness(mesh, pattern, sheet, merlin2), np.zeros(0)
    if calibration == "plate":
        folds = plate.fold_stiffness(folds, pattern, sheet)
        bends, large = plate.bend_stiffness(mesh, pattern, sheet), bends
        onset = plate_onset(bends, large)

    x = mesh.nodes
    return Structure(
        nodes=x,
        bars=np.concatenate([mesh.inner, outer]),
        bar_area=area,
        sheet=sheet,
        options=options,
        pattern=pattern,
        folds=mesh.folds,
        fold_stiffness=folds,
        fold_rest=fold_rest(crease_rest, mesh.folds, x, pattern),
        bends=mesh.bends,
        bend_stiffness=bends,
        bend_rest=hinge_angles(x, mesh.bends),
        bend_onset=onset,
        triangles=mesh.triangles,
        triangle_panel=mesh.triangle_panel,
        centers=mesh.centers,
    ).marked()


def check_kinds(pattern: Any, sheet: Any) -> None:
    """Refuse what is not a pattern and a sheet."""
    for name, value, kind in (("pattern", pattern, Pattern), ("sheet", sheet, Sheet)):
        if not isinstance(value, kind):
            raise InputError(f"{name}: got {type(value).__name__}, give a {kind.__name__}")


def _given_centers(
    centers: Mapping[int, ArrayLike], pattern: Pattern, scheme: str
) -> dict[int, NDArray]:
    """Center points by panel number, each of a panel that has a center node."""
    points = {}
    for panel, point in centers.items():
        known = isinstance(panel, int | np.integer) and 0 <= panel < len(pattern.faces)
        if not known or len(pattern.faces[panel]) < 4 or scheme != "n5b8":
            raise InputError(
                f"centers: panel {panel!r} has no center node; only N5B8 panels of more than "
                f"three corners have one ({len(pattern.faces)} panels, scheme {scheme})"
            )
        points[int(panel)] = np.array(vector(f"centers: panel {panel}", point))
    return points


def fold_stiffness(
    given: float | Sequence[float] | None, pattern: Pattern, sheet: Sheet
) -> NDArray:
    """Stiffness of whole creases (nf,), N m/rad, calibrated or from that `given` per length."""
    length = lengths(pattern.vertices, pattern.creases)
    if given is None:
        return calibrate.fold_stiffness(length, sheet)
    per_length = _per_crease("crease_stiffness", given, pattern)
    if (per_length < 0.0).any():
        raise InputError("crease_stiffness: must not be negative")
    return per_length * length


def _per_crease(field: str, value: float | Sequence[float], pattern: Pattern) -> NDArray:
    """One number for each crease (nf,) from a number, or from one for each."""
    n = len(pattern.creases)
    array = numbers(field, value)
    if array.ndim > 1 or (array.ndim == 1 and len(array) != n):
        raise InputError(f"{field}: {array.size} values for {n} creases: give one, or one for each")
    return np.broadcast_to(array, (n,)).copy()


def fold_rest(
    given: float | Sequence[float] | None,
    folds: NDArray,
    x: NDArray,
    pattern: Pattern,
    crease: NDArray | None = None,
) -> NDArray:
    """Rest dihedrals (rad) of hinge rows, none of them closed.

    crease : crease that each row lies on; the creases in order unless given.
    """
    crease = np.arange(len(folds)) if crease is None else crease
    if given is None:
        rest = hinge_angles(x, folds)
        closed = np.flatnonzero((rest < 1e-9) | (rest > 2.0 * np.pi - 1e-9) | np.isnan(rest))
        if len(closed):
            number = crease[closed[0]]
            low, high = pattern.creases[number]
            raise InputError(
                f"crease {number} (vertices {low}, {high}) is folded flat upon itself: open "
                "the pattern, or give crease_rest and start from an opened one"
            )
        return rest
    degrees = _per_crease("crease_rest", given, pattern)
    closed = degrees[(degrees <= 0.0) | (degrees >= 360.0)]
    if closed.size:
        raise InputError(
            f"crease_rest = {closed[0]:g}: must lie between 0 and 360 degrees (flat: 180)"
        )
    return np.radians(degrees)[crease]
