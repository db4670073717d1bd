"""From a pattern and a sheet to a structure of bars and hinges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.materials import BarLaw, EnhancedLinear, HingeLaw, bar_law, hinge_law
from foldyn.memory import check_memory
from foldyn.patterns import Pattern
from foldyn.structures import calibration as calibrate
from foldyn.structures.mass import check_mass_rule
from foldyn.structures.n4b5 import n4b5
from foldyn.structures.n5b8 import n5b8
from foldyn.structures.options import ModelOptions
from foldyn.structures.sheet import Sheet
from foldyn.structures.structure import Structure, hinge_angles
from foldyn.values import numbers, vector

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
    calibration: Literal["standard", "merlin2"] = "standard",
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
    fold_law, bend_law : {"linear", "superlinear", "enhanced"} or HingeLaw
    calibration : {"standard", "merlin2"}
        "merlin2" assigns bend stiffnesses and bar areas in MERLIN2's order (see
        `foldyn.structures.calibration`).
    crease_stiffness : float or sequence, optional
        Stiffness per length (N m/rad per m) of all creases or of each, instead of the calibration.
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
    if not isinstance(pattern, Pattern):
        raise InputError(f"pattern: got {type(pattern).__name__}, give a Pattern")
    if not isinstance(sheet, Sheet):
        raise InputError(f"sheet: got {type(sheet).__name__}, give a Sheet")
    options = ModelOptions(
        scheme, mass, bar_law, fold_law, bend_law, calibration, crease_stiffness, crease_rest
    )
    _check_laws(options)
    check_mass_rule(mass)
    nodes = len(pattern.vertices) + len(pattern.faces)
    check_memory("pattern", f"a structure of {nodes} nodes", PER_NODE * nodes, "take fewer panels")
    calibrate.check_scale(sheet, edge_lengths(pattern))
    points = _given_centers(centers or {}, pattern, scheme)
    mesh = n5b8(pattern, points) if scheme == "n5b8" else n4b5(pattern)
    calibrate.check_poisson(mesh, pattern, sheet)

    merlin2 = calibration == "merlin2"
    inner_area, edge_area = calibrate.bar_areas(mesh, pattern, sheet, merlin2)
    outer = np.concatenate([pattern.creases, pattern.boundary]).reshape(-1, 2)
    area = np.concatenate([inner_area, [edge_area[a, b] for a, b in outer.tolist()]])

    x = mesh.nodes
    crease_length = np.linalg.norm(x[pattern.creases[:, 1]] - x[pattern.creases[:, 0]], axis=1)
    if crease_stiffness is None:
        fold_stiffness = calibrate.fold_stiffness(crease_length, sheet)
    else:
        per_length = per_crease("crease_stiffness", crease_stiffness, pattern)
        if (per_length < 0.0).any():
            raise InputError("crease_stiffness: must not be negative")
        fold_stiffness = per_length * crease_length
    return Structure(
        nodes=x,
        bars=np.concatenate([mesh.inner, outer]),
        bar_area=area,
        sheet=sheet,
        options=options,
        pattern=pattern,
        folds=mesh.folds,
        fold_stiffness=fold_stiffness,
        fold_rest=fold_rest(crease_rest, mesh.folds, x, pattern),
        bends=mesh.bends,
        bend_stiffness=calibrate.bend_stiffness(mesh, pattern, sheet, merlin2),
        bend_rest=hinge_angles(x, mesh.bends),
        triangles=mesh.triangles,
        triangle_panel=mesh.triangle_panel,
        centers=mesh.centers,
    ).marked()


def _check_laws(options: ModelOptions) -> None:
    bar_law(options.bar_law)
    hinge_law(options.fold_law, "fold_law")
    hinge_law(options.bend_law, "bend_law")


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


def edge_lengths(pattern: Pattern) -> NDArray:
    """Lengths (ne,) of all edges of a pattern, m."""
    x = pattern.vertices
    return np.linalg.norm(x[pattern.edges[:, 1]] - x[pattern.edges[:, 0]], axis=1)


def per_crease(field: str, value: float | Sequence[float], pattern: Pattern) -> NDArray:
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
    """Rest dihedrals (rad) of hinge rows, strictly between closed on either side.

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
    degrees = per_crease("crease_rest", given, pattern)
    if ((degrees <= 0.0) | (degrees >= 360.0)).any():
        bad = degrees[(degrees <= 0.0) | (degrees >= 360.0)][0]
        raise InputError(f"crease_rest = {bad:g}: must lie between 0 and 360 degrees (flat: 180)")
    return np.radians(degrees)[crease]
