"""Bands and Bloch modes, as a page shows them."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.linear.band_structure import ALL, band_gaps
from foldyn.patterns.screw import Screw
from foldyn.viewer.arrays import Arrays

OF_SHAPES = 4e-3
"""Error of each Bloch mode, relative to its largest displacement."""
OF_ZONE = 1e-3
"""Error of frequencies in the zone, relative to the largest frequency."""
MOST_NUMBERS = 300_000
"""Largest number of values for the Bloch modes of a page; if there are more, only every k-th wave
vector has modes."""
MOST_TRIANGLES = 6_000
"""Largest number of triangles of all cells shown, unless a single cell has more."""
CELLS = {1: 8, 2: 4}
"""Number of cells shown along each period, by the number of periods."""
EDGES = ("below", "bottom", "top")
PATH = "take phases of cell.path"


def waves(arrays: Arrays, key: str, result: xr.Dataset) -> dict[str, Any]:
    """Describe the bands of one result; its arrays get names that begin with key.

    "frequency" (state, phase, band), Hz; "displacement", Bloch modes of every k-th phase, real and
    imaginary parts (state, band, phase / k, 2, node, axis), scaled to a largest displacement of 1;
    "places" (state, node, axis), m; "maps" (state, period, 3, 4), to the next cell; "gaps", the
    full gaps, as rows of the state, the band below, bottom and top (Hz); if they were computed
    "zone", frequencies (state, band, n, n), "damping" (state, phase, band), "attenuation" (state,
    leg, level) and "levels" (state, level), Hz.
    """
    for name, remedy in (("shape", "compute them with shape=True"), ("distance", PATH)):
        if name not in result:
            raise InputError(f"result: bands without {name} have no page; {remedy}")
    several = result if "state" in result.dims else result.expand_dims("state")
    first = several.transpose("state", "phase", "band", ...)
    if "position" not in first:
        first = first.assign(position=first["rest_position"] + first["displacement"])
    count, phases, bands = (first.sizes[dim] for dim in ("state", "phase", "band"))
    shapes = first["shape"].transpose("state", "band", "phase", "node", "axis").values
    every = min(max(1, -(-2 * shapes.size // MOST_NUMBERS)), max(1, (phases - 1) // 2))
    kept = smooth(shapes[:, :, ::every]).reshape(-1, *shapes.shape[3:])
    about = {
        "frequency": arrays.exact(f"{key}.f", first["frequency"].values, "f4"),
        "displacement": arrays.changing(
            f"{key}.u", np.stack([np.real(kept), np.imag(kept)], axis=1), OF_SHAPES
        ),
        "every": every,
        "sizes": [count, phases, bands],
        "places": arrays.exact(f"{key}.x", first["position"].transpose("state", ...), "f4"),
        "maps": arrays.exact(f"{key}.maps", maps(first), "f4"),
        "gaps": full_gaps(result),
    }
    if "zone_frequency" in result and first.sizes["period"] == 2:
        zone = np.nan_to_num(first["zone_frequency"].transpose("state", "band", "zone").values)
        about["zone"] = arrays.changing(f"{key}.zone", zone.reshape(count * bands, -1), OF_ZONE)
    if "damped_ratio" in result:
        about["damping"] = arrays.exact(f"{key}.damping", first["damped_ratio"].values, "f4")
    if "attenuation" in result:
        decay = first["attenuation"].transpose("state", "leg", "level").values
        levels = first["level_frequency"].transpose("state", "level").values
        about |= {
            "attenuation": arrays.exact(f"{key}.decay", decay, "f4"),
            "levels": arrays.exact(f"{key}.levels", levels, "f4"),
            "legs": [str(leg).replace("G", "Γ") for leg in result["leg"].values],
        }
    return about


def smooth(shapes: NDArray) -> NDArray:
    """Normalize shapes (..., phase, node, axis) to size 1, each in phase with the previous one."""
    size = np.linalg.norm(shapes, axis=-1).max(axis=-1)
    out = shapes / np.where(size > 0.0, size, 1.0)[..., None, None]
    for k in range(1, out.shape[-3]):
        overlap = np.einsum("...na,...na->...", out[..., k - 1, :, :].conj(), out[..., k, :, :])
        turn = np.where(np.abs(overlap) > 0.0, np.exp(-1j * np.angle(overlap)), 1.0)
        out[..., k, :, :] *= turn[..., None, None]
    return out


def maps(result: xr.Dataset) -> NDArray[np.float64]:
    """Affine maps (state, period, 3, 4) from a cell to the next: rotation and translation, m."""
    screw = (result[name] for name in ("vectors", "axes", "points"))
    shift, axis, point = (one.transpose("state", "period", "axis").values for one in screw)
    turn = np.degrees(result["angles"].transpose("state", "period").values)
    out = np.zeros((*turn.shape, 3, 4))
    for at in np.ndindex(turn.shape):
        along = float(shift[at] @ axis[at])
        motion = Screw(tuple(axis[at].tolist()), float(turn[at]), along, tuple(point[at].tolist()))
        out[at][:, :3] = motion.rotation()
        out[at][:, 3] = motion.images(np.zeros((1, 3)))[0]
    return out


def full_gaps(result: xr.Dataset) -> list[list[float]]:
    """Full gaps: number of the state, of the band below, bottom and top (Hz)."""
    if "gap_direction" in result:
        chosen = result.isel(gap=result["gap_direction"].values == ALL)
        rows = [chosen[f"gap_{name}"].values for name in ("state", *EDGES)]
    else:
        found = band_gaps(result)
        found = found.isel(gap=found["direction"].values == ALL)
        rows = [np.zeros(found.sizes["gap"]), *(found[key].values for key in EDGES)]
    return [[float(f"{value:.6g}") for value in row] for row in zip(*rows, strict=True)]


def about_waves(result: xr.Dataset, triangles: int) -> dict[str, Any]:
    """Description shared by all results of a page: the path, the states, the cells shown."""
    periods = result.sizes["period"]
    names = str(result.attrs["tick_labels"]).replace("G", "Γ").split("-")
    along = CELLS[periods]
    while along > 2 and along**periods * triangles > MOST_TRIANGLES:
        along -= 1
    about: dict[str, Any] = {
        "path": np.round(result["distance"].values, 5).tolist(),
        "wave": np.round(result["wave_vector"].values, 5).tolist(),
        "ticks": [[round(float(x), 5), name] for x, name in
                  zip(np.atleast_1d(result.attrs["ticks"]), names, strict=True)],
        "cells": [list(step) for step in np.ndindex(*[along] * periods)],
        "states": [], "varied": "",
    }  # fmt: skip
    if "state" in result.dims:
        own = result["state"].attrs
        word = f" {own['units']}" if "units" in own else ""
        unit = "°" if word == " degrees" else word
        about |= {
            "states": result["state"].values.tolist(), "varied": own["long_name"], "unit": unit,
        }  # fmt: skip
    return about
