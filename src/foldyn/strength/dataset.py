"""Datasets of stresses: forces, moments, stresses at both faces, and what follows from them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.results.dataset import result_dataset
from foldyn.results.quantities import STRESSES, variables
from foldyn.shells.recovery import StressPoints
from foldyn.strength.resultants import without_rigid

MISES = np.array([[1.0, -0.5, 0.0], [-0.5, 1.0, 0.0], [0.0, 0.0, 3.0]])
"""s' MISES s is the square of the von Mises stress, with s = (xx, yy, xy) in plane stress."""
COMPONENTS, FACES = ("xx", "yy", "xy"), ("back", "front")


def face_stresses(resultants: NDArray, thickness: NDArray) -> NDArray[Any]:
    """Stresses (..., p, 2, 3), Pa, at back and front, from forces and moments (..., p, 2, 3)."""
    force, moment = np.moveaxis(resultants, -2, 0)
    membrane, bending = force / thickness[:, None], 6.0 * moment / thickness[:, None] ** 2
    return np.stack([membrane - bending, membrane + bending], axis=-2)


def von_mises(stress: NDArray) -> NDArray[np.float64]:
    """Von Mises stress (...,), Pa, of stresses (..., 3); of complex ones the largest in a cycle.

    With s(t) = Re(s exp(i w t)), its square is s* Q s / 2 + Re(s' Q s exp(2 i w t)) / 2.
    """
    square = np.einsum("...a,ab,...b->...", stress.conj(), MISES, stress).real
    if np.iscomplexobj(stress):
        twice = np.einsum("...a,ab,...b->...", stress, MISES, stress)
        square = 0.5 * (square + np.abs(twice))
    return np.sqrt(square.clip(min=0.0))


def principal(stress: NDArray) -> NDArray[np.float64]:
    """Largest and smallest principal stress (..., 2), Pa, in the plane, of stresses (..., 3)."""
    xx, yy, xy = np.moveaxis(stress, -1, 0)
    mean, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    return np.stack([mean + radius, mean - radius], axis=-1)


def stress_dataset(
    case: Case, points: StressPoints | None, resultants: NDArray | None, crease: NDArray,
    along: Mapping[str, Any], statistics: Mapping[str, Any],
) -> xarray.Dataset:  # fmt: skip
    """Dataset of stresses, with the case.

    Parameters
    ----------
    case : Case
    points, resultants : StressPoints, and (s, p, 2, 3), optional
        Forces and moments of panels in s states.
    crease : (s, nf)
        Moments of creases per length.
    along : mapping
        Coordinates of the states; the first names their dimension.
    statistics : mapping
        Facts, each stored as an attribute.
    """
    first = next(iter(along.values()))[0]
    values: dict[str, NDArray] = {"crease_moment": crease}
    coordinates = dict(along)
    if points is not None and resultants is not None:
        resultants = without_rigid(case, points, resultants)
        stress = face_stresses(resultants, points.thickness)
        values["membrane_force"], values["bending_moment"] = np.moveaxis(resultants, -2, 0)
        values |= {"stress": stress, "von_mises": von_mises(stress)}
        if not np.iscomplexobj(stress):
            values["principal_stress"] = principal(stress)
        coordinates |= point_coordinates(points)
    data = variables(STRESSES, first, values)
    coordinates["crease_vertices"] = (("crease", "end"), case.structure.pattern.creases)
    return result_dataset("stresses", case, data, coordinates, statistics)


def largest_of_panels(found: xarray.Dataset, values: NDArray) -> NDArray[np.float64]:
    """Largest magnitudes (..., np) of panels, of values (..., p, 2) at both faces of the points."""
    panel = found["point_panel"].values
    points = np.moveaxis(np.abs(values).max(axis=-1), -1, 0)
    out = np.zeros((panel.max() + 1, *points.shape[1:]))
    np.maximum.at(out, panel, points)
    return np.moveaxis(out, 0, -1)


def point_coordinates(points: StressPoints) -> dict[str, Any]:
    """Coordinates of the points of panels, and of components and faces."""
    return {
        "point_panel": ("point", points.panel),
        "point_place": ("point", points.place),
        "point_number": ("point", points.number),
        "point_position": (("point", "axis"), points.position, {"units": "m"}),
        "panel_axes": (("panel", "direction", "axis"), points.axes),
        "component": ("component", list(COMPONENTS)),
        "face": ("face", list(FACES)),
    }
