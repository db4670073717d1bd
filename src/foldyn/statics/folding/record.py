"""What folding leaves: the states on the way as a dataset, and the folded pattern."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from foldyn import __version__
from foldyn.errors import ComputationError, FoldynWarning, InputError
from foldyn.patterns import Pattern
from foldyn.statics.folding.energy import FoldEnergy, Shape
from foldyn.statics.folding.ways import PLANE, Way, largest_strain

if TYPE_CHECKING:
    import xarray

SLIVER = 1e-4  # height over length


def path_of(pattern: Pattern, energy: FoldEnergy, way: Way) -> xarray.Dataset:
    """States of a way, each placed where it differs least from the one before."""
    import xarray as xr

    place, positions = pattern.vertices, []
    for shape in way.shapes:
        place = placed(energy.place(shape.x), place)
        positions.append(place)
    strain = [largest_strain(shape) for shape in way.shapes]
    bend = [energy.bent(shape.turns).max(initial=0.0) for shape in way.shapes]
    turns = [energy.creases(shape.turns) for shape in way.shapes]
    return xr.Dataset(
        {
            "position": (
                ("step", "node", "axis"), np.array(positions),
                {"units": "m", "long_name": "position of the vertex"},
            ),
            "fold_angle": (
                ("step", "crease"), np.array(turns),
                {"units": "rad", "long_name": "fold angle, valleys positive"},
            ),
            "strain": ("step", np.array(strain), {"long_name": "largest strain of a bar"}),
            "bend": (
                "step", np.array(bend),
                {"units": "rad", "long_name": "largest turn of a bend within a panel"},
            ),
        },
        {
            "step": np.arange(len(way.shapes)),
            "axis": ["x", "y", "z"],
            "share": ("step", np.array(way.shares), {"long_name": "share of the way"}),
            "crease_vertices": (("crease", "end"), pattern.creases),
        },
        {"foldyn_kind": "folding", "foldyn_version": __version__, "started_from": way.origin},
    )  # fmt: skip


def placed(x: NDArray, near: NDArray) -> NDArray:
    """Points x (n, 3) moved as a rigid body to where they are nearest to others (Kabsch)."""
    middle, target = x.mean(axis=0), near.mean(axis=0)
    left, _, right = np.linalg.svd((x - middle).T @ (near - target))
    way = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return (x - middle) @ (left @ way @ right) + target


def folded_pattern(pattern: Pattern, energy: FoldEnergy, shape: Shape, x: NDArray) -> Pattern:
    """The pattern at positions x (n, 3), panels that have bent cut along their bends.

    Panels that would fall into slivers, as with three corners on a line, stay whole.
    """
    bent = np.abs(shape.turns - energy.rest)[: len(energy.diagonals)] > PLANE
    cut = np.setdiff1d(energy.diagonal_panel[bent], _with_slivers(energy, x))
    faces = [face for number, face in enumerate(pattern.faces) if number not in set(cut.tolist())]
    pieces = energy.triangles[np.isin(energy.triangle_panel, cut)]
    pairs = [(int(a), int(b)) for a, b in pattern.creases]
    letters = dict(zip(pairs, pattern.assignments, strict=True))
    letters |= {(int(a), int(b)): "B" for a, b in pattern.boundary}
    inside = energy.diagonals[np.isin(energy.diagonal_panel, cut)]
    letters |= {(int(a), int(b)): "F" for a, b in np.sort(inside, axis=1)}
    wanted = {
        pair: float(angle)
        for pair, angle in zip(pairs, pattern.fold_angles, strict=True)
        if not np.isnan(angle)
    }
    families = {name: [pairs[k] for k in rows.tolist()] for name, rows in pattern.families.items()}
    with warnings.catch_warnings():
        # creases that turn the wrong way are told once, by `fold`
        warnings.simplefilter("ignore", FoldynWarning)
        try:
            return Pattern(
                x, [*faces, *pieces.tolist()], letters, pattern.name, None, wanted, families,
                pattern.custom, pattern.welds,
            )  # fmt: skip
        except InputError as error:
            raise ComputationError(
                f"the folded state is no sound pattern ({error}): fold it less"
            ) from None


def _with_slivers(energy: FoldEnergy, x: NDArray) -> NDArray[np.int64]:
    """Panels with a triangle that is much longer than wide."""
    corners = x[energy.triangles]
    sides = corners - np.roll(corners, 1, axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    longest = (sides**2).sum(axis=2).max(axis=1)
    return np.unique(energy.triangle_panel[area < SLIVER * longest])
