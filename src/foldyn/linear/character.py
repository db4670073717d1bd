"""Character of a mode, in numbers and a name: axial, bending, torsion along a main axis.

A shape is compared with the motions of a beam along the axis. At stations along the axis the
sections move by t and turn by w; between stations both are linear. With s the coordinate along the
axis a, c(s) the center of mass of the section, and b and c the other two axes:

    phi(x) ~ t(s) + w(s) x (x - c(s))

t and w follow from least squares, weighted by mass. The fitted motion is the sum of its parts:

    axial        t_a             bending along b    t_b and w_c
    torsion      w_a             bending along c    t_c and w_b

and phi' M (part) / phi' M phi is the share of each part; the rest is distortion of the sections.
The shares add up to 1; a share can be slightly negative if sections are not symmetric. A mode is
named after the part with more than half of the motion; a mode without such a part is mixed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.cases import Case, resolve_nodes
from foldyn.cases.directions import AXES, check_axis
from foldyn.errors import InputError
from foldyn.results import case_of, check_result
from foldyn.values import whole

NODES_PER_STATION = 12
MOST_STATIONS = 9
AWAY = 0.2  # distance of the supports' center from the sheet's, as a fraction of its extent
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth")


def character(
    modes: xarray.Dataset,
    axis: str | None = None,
    *,
    nodes: Any = None,
    stations: int | None = None,
    case: Case | None = None,
) -> xarray.Dataset:
    """Name modes by their shares of beam motions along a main axis.

    Parameters
    ----------
    modes : xarray.Dataset
        From `foldyn.modes`.
    axis : {"x", "y", "z"}, optional
        Main axis of the structure; by default `main_axis` of the case.
    nodes : int, sequence of int, or str, optional
        Consider only the motion of these nodes, such as a loaded edge; all by default.
    stations : int, optional
        Sections along the axis, 1 for a single one; by default one per dozen nodes, from 2 to 9.
    case : Case, optional
        The case of the modes; needed if it cannot be rebuilt from the modes (`foldyn.case_of`).

    Returns
    -------
    xarray.Dataset
        `share` (mode, kind) with the kinds axial, bending along each of the other two axes,
        torsion, distortion; `kind_of` (mode), the kind with more than half of the motion, else
        "mixed", or "rigid"; `order` (mode), the number of the mode among the modes of its kind in
        this set; `name` (mode) in words, such as "second bending along y", or, with the two largest
        shares, "mixed: torsion, bending along y".

    Raises
    ------
    InputError
        Not modes, no such axis or nodes, or a shape that does not move the nodes.
    """
    check_result(modes, "modes: ")
    if modes.attrs["foldyn_result"] != "modes":
        raise InputError(f"modes: is a {modes.attrs['foldyn_result']}; give modes")
    case = case_of(modes) if case is None else case
    structure, axis = case.structure, main_axis(case) if axis is None else check_axis("axis", axis)
    chosen = np.arange(len(structure.nodes)) if nodes is None else resolve_nodes(structure, nodes)
    if stations is None:
        count = max(2, min(MOST_STATIONS, len(chosen) // NODES_PER_STATION))
    else:
        count = whole("stations", stations, least=1)
    weight = case.nodal_mass[chosen]
    x = (structure.nodes + modes["displacement"].values)[chosen]
    parts = _beam_parts(x, weight, AXES.index(axis), count)
    share = _shares(modes["shape"].values[:, chosen], np.repeat(weight, 3), parts)
    kinds = np.array([*parts, "distortion"])
    ranked = kinds[np.argsort(-share, axis=1, kind="stable")]
    kind = np.where(share.max(axis=1) > 0.5, ranked[:, 0], "mixed").astype("<U20")
    kind[modes["rigid"].values] = "rigid"
    order = np.array([int((kind[: k + 1] == kind[k]).sum()) for k in range(len(kind))])
    names = [
        f"mixed: {first}, {second}" if what == "mixed" else f"{_ordinal(n)} {what}"
        for n, what, (first, second, *_) in zip(order, kind, ranked, strict=True)
    ]
    return xarray.Dataset(
        {
            "share": (("mode", "kind"), share, {"long_name": "share of the mode's motion"}),
            "kind_of": ("mode", kind, {"long_name": "what the mode does"}),
            "order": ("mode", order, {"long_name": "number among the modes of its kind"}),
            "name": ("mode", names, {"long_name": "what the mode does"}),
        },
        {"mode": modes["mode"], "kind": kinds},
        {"axis": axis},
    )


def main_axis(case: Case) -> str:
    """Axis from the supports to the rest of a structure if distinct, else its longest axis."""
    nodes = case.structure.nodes
    extent = np.ptp(nodes, axis=0)
    held = case.fixed.sum(axis=1)
    if held.any():
        away = np.abs(nodes.mean(axis=0) - held @ nodes / held.sum())
        if away.max() > AWAY * extent.max():
            return AXES[int(away.argmax())]
    return AXES[int(extent.argmax())]


def _beam_parts(x: NDArray, weight: NDArray, a: int, stations: int) -> dict[str, NDArray]:
    """Motions (3n, k) of each part of a beam at points x (n, 3)."""
    hats = _hats(x[:, a], stations)
    loads = hats * weight[:, None]
    total = loads.sum(axis=0)
    centers = (loads.T @ x) / np.where(total > 0.0, total, 1.0)[:, None]
    arm = x - hats @ centers
    arm[:, a] = 0.0  # sections are plane: turns about b and c move points along a only
    b, c = (a + 1) % 3, (a + 2) % 3
    unit = np.eye(3)

    def field(motion: NDArray) -> NDArray:
        return np.einsum("nk,na->nak", hats, motion).reshape(-1, hats.shape[1])

    def shift(axis: int) -> NDArray:
        return field(np.broadcast_to(unit[axis], x.shape))

    def turn(axis: int) -> NDArray:
        return field(np.cross(unit[axis], arm))

    across = {
        f"bending along {AXES[b]}": np.hstack([shift(b), turn(c)]),
        f"bending along {AXES[c]}": np.hstack([shift(c), turn(b)]),
    }
    return {"axial": shift(a), **dict(sorted(across.items())), "torsion": turn(a)}


def _hats(along: NDArray, stations: int) -> NDArray:
    """Piecewise linear functions, each 1 at one station, as values (n, k) at coordinates (n,)."""
    extent = float(np.ptp(along))
    if stations == 1 or extent == 0.0:
        return np.ones((len(along), 1))
    place = (along - along.min()) / extent * (stations - 1)
    return np.maximum(0.0, 1.0 - np.abs(place[:, None] - np.arange(stations)))


def _shares(shapes: NDArray, weight: NDArray, parts: dict[str, NDArray]) -> NDArray:
    """Shares (modes, kinds) of the parts, then of the remainder."""
    root = np.sqrt(weight)
    flat = shapes.reshape(len(shapes), -1).T * root[:, None]
    whole = (flat**2).sum(axis=0)
    if not whole.all():
        raise InputError(
            f"nodes: mode {int(np.argmin(whole)) + 1} does not move them; choose other nodes"
        )
    basis = np.hstack(list(parts.values())) * root[:, None]
    fitted = np.linalg.lstsq(basis, flat, rcond=1e-9)[0]
    shares, start = [], 0
    for part in parts.values():
        rows = slice(start, start + part.shape[1])
        shares.append(((basis[:, rows] @ fitted[rows]) * flat).sum(axis=0) / whole)
        start = rows.stop
    return np.stack([*shares, 1.0 - np.sum(shares, axis=0)], axis=1)


def _ordinal(number: int) -> str:
    return ORDINALS[number - 1] if number <= len(ORDINALS) else f"{number}th"
