"""The results of folding: a dataset of the states on the way, and the folded pattern."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import ComputationError, InputError
from foldyn.patterns import Pattern
from foldyn.results import folding_dataset
from foldyn.statics.folding.energy import FoldEnergy, Shape
from foldyn.statics.folding.subdivision import are_slivers
from foldyn.statics.folding.ways import PLANE, Way, largest_strain

if TYPE_CHECKING:
    import xarray


def path_of(pattern: Pattern, energy: FoldEnergy, way: Way) -> xarray.Dataset:
    """States of a way, each placed as close as possible to the previous one."""
    place, positions = pattern.vertices, []
    for shape in way.shapes:
        place = placed(energy.place(shape.x), place)
        positions.append(place)
    strain = [largest_strain(shape) for shape in way.shapes]
    bend = [energy.bent(shape.turns).max(initial=0.0) for shape in way.shapes]
    turns = [energy.creases(shape.turns) for shape in way.shapes]
    values = {
        "displacement": np.array(positions) - pattern.vertices,
        "position": positions,
        "fold_angle": turns,
        "strain": strain,
        "bend": bend,
    }
    return folding_dataset(pattern, way.shares, values, {"started_from": way.origin})


def placed(x: NDArray, near: NDArray) -> NDArray:
    """Points x (n, 3), moved as a rigid body as close as possible to `near` (Kabsch)."""
    middle, target = x.mean(axis=0), near.mean(axis=0)
    left, _, right = np.linalg.svd((x - middle).T @ (near - target))
    way = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return (x - middle) @ (left @ way @ right) + target


def folded_pattern(pattern: Pattern, energy: FoldEnergy, shape: Shape, x: NDArray) -> Pattern:
    """The pattern at positions x (n, 3), with bent panels cut along their bends.

    Panels that would leave slivers, such as with three corners on a line, stay whole.
    """
    bent = np.abs(shape.turns - energy.rest)[: len(energy.diagonals)] > PLANE
    cut = np.setdiff1d(energy.diagonal_panel[bent], _with_slivers(energy, x))
    whole = np.ones(len(pattern.faces), bool)
    whole[cut] = False
    faces = [face for face, kept in zip(pattern.faces, whole, strict=True) if kept]
    pieces = energy.triangles[np.isin(energy.triangle_panel, cut)]
    inside = np.sort(energy.diagonals[np.isin(energy.diagonal_panel, cut)], axis=1)
    welds = np.concatenate([pattern.welds, inside])
    try:
        return pattern.changed(vertices=x, faces=[*faces, *pieces.tolist()], welds=welds)
    except InputError as error:
        raise ComputationError(
            f"the folded state is no sound pattern ({error}): fold it less"
        ) from None


def _with_slivers(energy: FoldEnergy, x: NDArray) -> NDArray[np.int64]:
    """Panels with a triangle much longer than wide."""
    return np.unique(energy.triangle_panel[are_slivers(x[energy.triangles])])
