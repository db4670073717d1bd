"""From pixels to displacements in metres along the model's axes."""

from __future__ import annotations

import numpy as np
import xarray as xr

from foldyn.experiment.camera import axes_of_view
from foldyn.experiment.tracking.matching import Match, Placing
from foldyn.experiment.tracking.models import Model


def add_displacements(
    ds: xr.Dataset, model: Model, match: Match | list[Match], placing: Placing
) -> xr.Dataset:
    """Displacements from rest of the nodes that were tracked.

    Each node is taken to stay as far from the camera as it was where the model was recognized;
    the component along the line of sight is unknown (NaN). The camera must stand still.

    Parameters
    ----------
    ds : xarray.Dataset
        With `position_px` and `node_of_point`.
    model : Model
    match : Match or list of Match
        The one of the film, or one for each photograph.
    placing : Placing

    Returns
    -------
    xarray.Dataset
        With `displacement` (m), `rest_position`, `tracked` (share of frames in which a node was
        measured), `longest_gap` (frames), `error` (m, root mean square of the standard errors),
        and, for pictures, `projected_px` of the model as it was recognized and its `edges`.
    """
    along = "photo" if "photo" in ds.dims else "time"
    origin = np.asarray(ds.attrs.get("roi", [0, 0])[:2], dtype=np.float64)
    matches = match if isinstance(match, list) else [match]
    count, vertices = ds.sizes[along], model.vertices
    node = ds["node_of_point"].values
    point = np.flatnonzero(node >= 0)
    seen = np.full((count, vertices, 2), np.nan)
    seen[:, node[point]] = ds["position_px"].values[:, point] - origin
    places = np.empty((count, vertices, 3))
    first = matches[0]  # the camera stands still: one view serves all photographs
    for k, one in enumerate(matches):
        some = slice(k, k + 1) if len(matches) > 1 else slice(None)
        depth = first.view.depth(one.positions[:vertices])
        places[some] = first.view.back(seen[some], depth)
    moved = places - model.rest[:vertices]
    moved[..., int(np.argmax(np.abs(axes_of_view(placing.up, placing.facing)[2])))] = np.nan
    measured = np.isfinite(seen[..., 0])
    out = ds.assign(
        displacement=((along, "node", "axis"), moved, {"units": "m"}),
        rest_position=(("node", "axis"), model.rest[:vertices], {"units": "m"}),
        tracked=(("node",), measured.mean(axis=0)),
        longest_gap=(("node",), _longest_gaps(measured)),
    ).assign_coords(node=np.arange(vertices), axis=["x", "y", "z"])
    if "error_px" in ds:
        error = np.full((count, vertices), np.nan)
        error[:, node[point]] = ds["error_px"].values[:, point]
        with np.errstate(invalid="ignore"):
            square = np.nansum(error**2, axis=0) / np.maximum(measured.sum(axis=0), 1)
        rms = np.where(measured.any(axis=0), np.sqrt(square), np.nan)
        out["error"] = (("node",), rms * first.view.metres_per_pixel, {"units": "m"})
    projected = np.array([one.view.project(one.positions[:vertices]) for one in matches]) + origin
    several = len(matches) > 1
    out["projected_px"] = (
        ((along,) if several else ()) + ("node", "uv"),
        projected if several else projected[0],
        {"units": "pixel"},
    )
    out["edges"] = (("edge", "end"), model.edges)
    out.attrs |= {
        "metres_per_pixel": float(first.view.metres_per_pixel),
        "camera_distance": float(first.view.distance),
        "match_rms_px": np.array([one.rms for one in matches]),
        "match_state": np.array([one.state for one in matches]),
        "matched_nodes": np.array([len(one.node) for one in matches]),
        "up": placing.up,
        "facing": placing.facing,
    }
    return out


def _longest_gaps(measured: np.ndarray) -> np.ndarray:
    """Most frames in a row in which a node was not measured, shape (n,)."""
    longest = np.zeros(measured.shape[1], np.int64)
    running = np.zeros(measured.shape[1], np.int64)
    for row in measured:
        running = np.where(row, 0, running + 1)
        longest = np.maximum(longest, running)
    return longest
