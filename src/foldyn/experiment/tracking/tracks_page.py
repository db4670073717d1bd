"""The page of `foldyn track`: the tracked sheet in motion, its nodes over time, the camera."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn import __version__
from foldyn.analyses.provenance import Call, cost_rows, inputs_table
from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.plots.readings import AXES, way
from foldyn.plots.track_charts import track_charts
from foldyn.report.page import write_report
from foldyn.report.sections import Charts, Heading, Picture, Section, Table, Text, cell
from foldyn.shells import shell
from foldyn.viewer import Backdrop, Stage, projection, stage

MOST = 3  # largest number of nodes in charts
ROOM = 4_000_000  # largest size of all pictures of a page, in bytes
SEEN = 0.9  # nodes measured in a smaller share of the best node's frames are not shown
FILLED = (
    "Dots are what was measured. The sheet in three dimensions is filled where nothing was: a node "
    "that was lost for some frames moves evenly between them, one that was never seen moves as its "
    "neighbors do on average, and nothing is known along the line of sight, {axis}."
)


@dataclass(frozen=True)
class Footage:
    """Film or photographs that were tracked.

    Parameters
    ----------
    files : sequence of str
    pictures : mapping of int to bytes
        Pictures (JPEG or PNG), by the number of the frame or photograph.
    figures : sequence of Picture
        Figures of the model over the pictures.
    case : Case, optional
        The recognized model.
    settings : mapping of str to str
        Scale, region and other settings, in words.
    """

    files: Sequence[str]
    pictures: Mapping[int, bytes] = field(default_factory=dict)
    figures: Sequence[Picture] = ()
    case: Case | None = None
    settings: Mapping[str, str] = field(default_factory=dict)


def write_tracks_page(
    tracks: xr.Dataset, path: Path, footage: Footage, call: Call | None = None
) -> Path:
    """Write the page of tracks to the file with the suffix .html; return its path."""
    sections: list[Section | Stage] = []
    title = f"Tracks of {', '.join(Path(name).name for name in footage.files)}"
    if footage.case is not None and "displacement" in tracks:
        nodes = most_moved(tracks)
        shown = _stage(tracks, footage.case, nodes, title, footage.pictures)
        sections += [shown, Heading("What was measured")]
        sections.append(Charts(track_charts(tracks, nodes, AXES)))
        sections += [Text(FILLED.format(axis=_hidden(tracks))), _nodes(tracks)]
    sections += [Heading("What the camera saw"), *footage.figures] if footage.figures else []
    rows = [("seen", ", ".join(map(str, footage.files))), *footage.settings.items()]
    sections += [Heading("How it was computed"), inputs_table([*rows, *_found(tracks)])]
    sections.append(inputs_table(cost_rows(__version__, call or Call())))
    return write_report(sections, path.with_suffix(".html"), title=title)


def spread(count: int, encoded: Callable[[int], bytes]) -> dict[int, bytes]:
    """Pictures spread evenly over a film, as many as a page has room for, by number.

    encoded : function of a frame number that returns the encoded picture.
    """
    first = encoded(0)
    kept = min(count, max(2, ROOM // max(len(first), 1)))
    numbers = np.unique(np.linspace(0, count - 1, kept).round().astype(int)).tolist()
    return {number: encoded(number) for number in numbers}


def most_moved(tracks: xr.Dataset) -> list[int]:
    """Nodes that move most among the nodes that were measured most of the time."""
    moved = tracks["displacement"].values
    high = np.nanmax(moved, axis=0, initial=-np.inf)
    low = np.nanmin(moved, axis=0, initial=np.inf)
    span = np.where(np.isfinite(high - low), high - low, 0.0).max(axis=1)
    span[tracks["tracked"].values < SEEN * tracks["tracked"].values.max()] = -1.0
    return sorted(int(node) for node in np.argsort(-span)[:MOST])


def filled(tracks: xr.Dataset) -> NDArray[np.float64]:
    """Displacements (m) of all nodes at all samples, gaps filled, shape (samples, n, 3).

    Gaps are filled linearly in time, then by the mean of neighboring nodes, and by 0 along the line
    of sight.
    """
    moved = np.array(tracks["displacement"].transpose(..., "node", "axis").values)
    samples = np.arange(len(moved))
    seen = np.asarray(np.isfinite(moved).any(axis=(0, 2)))
    out = np.zeros(moved.shape)
    for node in np.flatnonzero(seen):
        for axis in range(3):
            known = np.isfinite(moved[:, node, axis])
            if known.any():
                out[:, node, axis] = np.interp(samples, samples[known], moved[known, node, axis])
    if seen.all() or not seen.any():
        return out
    i, j = tracks["edges"].values.T
    ones, shape = np.ones(len(i)), (len(seen), len(seen))
    near = sparse.coo_array((ones, (i, j)), shape=shape).tocsr()
    near = near + near.T
    far = sparse.diags_array(near.sum(axis=1) + 1e-9) - near  # nodes without neighbors stay at rest
    lost = np.flatnonzero(~seen)
    flat = out.transpose(1, 0, 2).reshape(len(seen), -1)
    flat[lost] = splu(far[lost][:, lost].tocsc()).solve(near[lost] @ flat)
    return flat.reshape(len(seen), len(moved), 3).transpose(1, 0, 2)


def _stage(
    tracks: xr.Dataset, case: Case, nodes: list[int], title: str, pictures: Mapping[int, bytes]
) -> Stage:
    """Stage of the tracked sheet, made of the pattern's vertices; a path for photographs.

    The camera of the stage is the camera fitted when the model was recognized.
    """
    pattern, sheet = case.structure.pattern, case.structure.sheet
    vertices = Case(shell(pattern, sheet, divisions=1))
    along, coords = "time", {"node": tracks["node"], "axis": list(AXES)}
    data: dict[str, Any] = {}
    if "photo" in tracks.dims:
        along, count = "step", tracks.sizes["photo"]
        load = tracks["load"].values if "load" in tracks.coords else np.arange(count)
        data["negative_eigenvalues"] = along, np.full(count, -1)
        coords["load_factor"] = along, load / (np.abs(load).max() or 1.0)
    else:
        coords["time"] = tracks["time"].values
    displacement = filled(tracks)
    data["displacement"] = (along, "node", "axis"), displacement, {"units": "m"}
    result = xr.Dataset(data, coords)
    moments = result["time"].values if along == "time" else way(result)
    places = tracks["rest_position"].values + displacement
    seen, at = tracks["projected_px"].values, int(tracks.attrs.get("match_frame", 0))
    whole = places if along == "step" else places[at]
    backdrop = None
    with suppress(InputError):  # a flat sheet does not determine the camera
        width, height = (int(size) for size in tracks.attrs["size"])
        taken = {float(moments[number]): content for number, content in pictures.items()}
        camera = projection(whole.reshape(-1, 3), seen.reshape(-1, 2))
        backdrop = Backdrop(taken, (width, height), camera)
    return stage({"tracked": result}, {"tracked": vertices}, title, nodes, backdrop)


def _hidden(tracks: xr.Dataset) -> str:
    """Axis along the line of sight."""
    moved = tracks["displacement"].transpose(..., "node", "axis").values
    return ", ".join(np.array(AXES)[~np.isfinite(moved).any(axis=(0, 1))])


def _nodes(tracks: xr.Dataset) -> Table:
    """Table of the quality of each node's track."""
    error = tracks["error"].values if "error" in tracks else np.full(tracks.sizes["node"], np.nan)
    rows = [
        [node, 100.0 * share, gap, cell(1e3 * off)]
        for node, share, gap, off in zip(
            tracks["node"].values.tolist(), tracks["tracked"].values.tolist(),
            tracks["longest_gap"].values.tolist(), error.tolist(), strict=True,
        )
        if share > 0.0
    ]  # fmt: skip
    header = ["node", "measured (%)", "longest gap (frames)", "error, rms (mm)"]
    text = f"The {len(rows)} of {tracks.sizes['node']} nodes that were measured."
    return Table(header, rows, text, digits=3)


def _found(tracks: xr.Dataset) -> list[tuple[str, str]]:
    """Facts on the camera and on the recognition of the model."""
    a, along = tracks.attrs, "photo" if "photo" in tracks.dims else "time"
    count, what = tracks.sizes[along], "photographs" if along == "photo" else "frames"
    width, height = (int(size) for size in a["size"])
    rows = [("pictures", f"{count} {what} of {width} x {height} pixels")]
    if along == "time" and count > 1:
        lasted = float(np.ptp(tracks["time"].values))
        rows.append(("rate", f"{(count - 1) / lasted:.6g} frames per second over {lasted:.4g} s"))
    rows.append(("region", f"x, y, width, height {[int(part) for part in a['roi']]} pixels"))
    if "metres_per_pixel" in a:
        rows.append(("scale", f"{a['metres_per_pixel']:.5g} m per pixel in the front plane"))
    if "displacement" in tracks:
        rms = ", ".join(f"{value:.2g}" for value in np.atleast_1d(a["match_rms_px"]))
        nodes = ", ".join(f"{value}" for value in np.atleast_1d(a["matched_nodes"]))
        away = f"{a['camera_distance']:.4g} m away; up {a['up']}, towards it {a['facing']}"
        rows.append(("camera", away))
        rows.append(("recognized", f"{nodes} nodes, {rms} pixels rms from the model"))
    return rows
