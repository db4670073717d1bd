"""A sheet with its supports and loads, as a page draws them."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases import Case, Latch, Stop
from foldyn.cases.releases import released
from foldyn.cases.selection import resolve_creases
from foldyn.patterns import Pattern
from foldyn.patterns.topology import Lines
from foldyn.structures.discretized import Discretized
from foldyn.structures.mesh import Mesh, n4b5
from foldyn.viewer.arrays import Arrays

KINDS = "MVFUB"
"""Kinds of edges by number: mountain, valley, flat, unassigned, boundary."""


def sheet(arrays: Arrays, key: str, case: Case) -> dict[str, Any]:
    """Describe a case's sheet at rest; its arrays get names that begin with key.

    "nodes" (n, 3), m; "triangles" (t, 3) and the "panel" of each; "edges" (k, 2), pieces of the
    pattern's edges, with their "kind", their "crease", and "along" (k, 2), the positions of their
    ends along that crease, m; "bars" (b, 2) of bars and hinges; "held", "loads", "lines" and
    "catches", see below.
    """
    structure = case.structure
    out = _surface(arrays, key, structure.pattern, structure, structure.edge_nodes)
    out |= {"held": held(case), "loads": load_arrows(case), "lines": lines(case)}
    out["catches"] = catches(case)
    if structure.bar_law is not None:
        out["bars"] = arrays.exact(f"{key}.bars", structure.bars, "u4")
    return out


def bare_sheet(arrays: Arrays, key: str, pattern: Pattern) -> dict[str, Any]:
    """Describe a pattern, whose nodes are its vertices, in the same way."""
    bare = {"held": [], "loads": [], "lines": [], "catches": []}
    return _surface(arrays, key, pattern, n4b5(pattern), pattern.lines) | bare


def _surface(
    arrays: Arrays, key: str, pattern: Pattern, mesh: Discretized | Mesh, edge_nodes: NDArray
) -> dict[str, Any]:
    """Describe the triangles and edges of a sheet."""
    pairs, kind, edge, along = edge_pieces(pattern, mesh.nodes, edge_nodes)
    return {
        "nodes": arrays.exact(f"{key}.nodes", mesh.nodes, "f4"),
        "triangles": arrays.exact(f"{key}.triangles", mesh.triangles, "u4"),
        "panel": arrays.exact(f"{key}.panel", mesh.triangle_panel, "u4"),
        "edges": arrays.exact(f"{key}.edges", pairs, "u4"),
        "kind": arrays.exact(f"{key}.kind", kind, "u1"),
        "crease": arrays.exact(f"{key}.crease", edge, "u4"),
        "along": arrays.exact(f"{key}.along", along, "f4"),
        "vertices": len(pattern.vertices),
        "creases": pattern.creases.tolist(),
    }


def edge_pieces(
    pattern: Pattern, nodes: NDArray, edge_nodes: NDArray
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Pieces (k, 2) of the pattern's edges; each with its kind, its crease and its ends along it.

    Welds are left out. Junctions count as unassigned, and as the first of their creases.
    """
    lines, count = Lines.of(pattern.creases), len(pattern.boundary)
    letters = [*lines.letters(pattern.assignments).tolist(), *"B" * count]
    crease = np.append(lines.first, len(pattern.creases) + np.arange(count))
    rows = np.asarray(edge_nodes)[: len(letters)]
    pairs = np.stack([rows[:, :-1], rows[:, 1:]], axis=2)
    length = np.linalg.norm(np.diff(nodes[pairs], axis=2)[:, :, 0], axis=2)
    end = np.cumsum(length, axis=1)
    edge = np.repeat(np.arange(len(rows)), pairs.shape[1])
    kind = np.array([KINDS.index(letter) for letter in letters])[edge]
    along = np.stack([end - length, end], axis=2).reshape(-1, 2)
    return pairs.reshape(-1, 2), kind, crease[edge], along


def held(case: Case) -> list[list[Any]]:
    """Nodes held or moved by supports, with their axes: [[4, "xz"], ...]."""
    fixed = np.asarray(case.fixed).reshape(-1, 3)
    axes = np.array(["x", "y", "z"])
    return [[int(node), "".join(axes[fixed[node]])] for node in np.flatnonzero(fixed.any(axis=1))]


def gone(case: Case, result: xr.Dataset) -> dict[str, Any]:
    """Samples from which lines are released, and held nodes; empty if nothing is."""
    if not result.attrs.get("releases"):
        return {}
    places = [text.partition(" ")[0] for text in result.attrs["releases"].split("; ")]
    first = dict(zip(places, np.atleast_1d(result.attrs["released_from"]).tolist(), strict=True))
    nodes: dict[int, int] = {}
    for sample in sorted({*first.values()}):
        still = dict(held(released(case, [place for place in first if first[place] <= sample])))
        for node, _ in held(case):
            nodes |= {} if node in still or node in nodes else {node: sample}
    return {"gone": {"held": nodes, "lines": [first.get(place) for place in case.line_places]}}


def lines(case: Case) -> list[list[Any]]:
    """Springs between nodes, bars and cables, by nodes and points that stand still, m."""
    return [
        [int(one) if one >= 0 else point.tolist() for one, point in zip(node, x, strict=True)]
        for *_, node, x in case.polylines()
    ]


def catches(case: Case) -> list[list[int]]:
    """Vertices at the ends of creases with end stops or latches."""
    some = (one for one in case.supports if isinstance(one, Stop | Latch))
    chosen = [resolve_creases(case.structure, one.creases) for one in some]
    creases = case.structure.pattern.creases
    return creases[np.unique(np.concatenate(chosen))].tolist() if chosen else []


def load_arrows(case: Case) -> list[list[Any]]:
    """Nodal forces, divided by the largest: [[7, [1.0, 0.0, 0.0]], ...]; without gravity."""
    forces = sum((force for force, _ in case.force_terms), np.zeros_like(case.structure.nodes))
    size = np.linalg.norm(forces, axis=1)
    relative = (forces / (size.max(initial=0.0) or 1.0)).round(4)
    return [[int(node), relative[node].tolist()] for node in np.flatnonzero(size)]
