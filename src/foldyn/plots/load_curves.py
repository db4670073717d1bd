"""Loads and imposed motions of a case: where they act, as curves over time, and in words."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from foldyn import mechanics
from foldyn.cases import Actuate, Case, CreaseMoment, Impose, Pressure, Temperature, resolve_nodes
from foldyn.cases.directions import unit_vector
from foldyn.cases.selection import resolve_creases, resolve_panels
from foldyn.errors import listed
from foldyn.plots.charts import Chart, Curve
from foldyn.structures.discretized import Discretized

if TYPE_CHECKING:
    from foldyn.plots.scene import Points

STEPS = 12  # radius of an arc
NEAR, FAR = 0.15, 1.0  # rad, limits of the angle between a panel and an end of an arc


class Share(NamedTuple):
    """A load on some panels (Pa, K) or creases (N m), with its history."""

    numbers: NDArray[np.int64]
    value: NDArray[np.float64]
    history: Any


def on_panels(case: Case, kind: type[Pressure] | type[Temperature]) -> list[Share]:
    """Pressures (Pa) or temperature changes (K) of panels, a `Share` for each load of a kind."""
    structure, found = case.structure, []
    for place, load in case.loads_of(kind):
        triangles = resolve_panels(structure, load.panels, f"{place}.panels")
        panels = np.unique(structure.triangle_panel[triangles])
        value = load.pressure if kind is Pressure else load.change
        found.append(Share(panels, np.full(len(panels), value), load.history))
    return found


def moments(case: Case) -> list[Share]:
    """Moments of whole creases, a `Share` for each load."""
    found = []
    for place, load in case.loads_of(CreaseMoment):
        creases, moment = load.of_creases(case.structure, place)
        found.append(Share(creases, moment, load.history))
    return found


def panel_middles(structure: Discretized, points: Points, share: Share) -> Points:
    """Means (k, 3) of the corners of each panel."""
    faces = structure.pattern.faces
    return np.array([points[list(faces[panel])].mean(axis=0) for panel in share.numbers])


def panel_arrows(case: Case, points: Points, share: Share) -> tuple[Points, Points]:
    """Means of the corners of panels (k, 3), and pressure vectors (k, 3), Pa, at these points."""
    structure = case.structure
    middles, vectors = [], []
    for panel, pressure in zip(share.numbers, share.value, strict=True):
        corners = points[structure.triangles[structure.triangle_panel == panel]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(normal, axis=1)
        middles.append(area @ corners.mean(axis=1) / area.sum())
        along = normal.sum(axis=0)
        vectors.append(pressure * along / np.linalg.norm(along))
    return np.array(middles), np.array(vectors)


def crease_arcs(case: Case, points: Points, share: Share, radius: float) -> Points:
    """Arcs (m, STEPS, 3) about the middles of creases, two for each crease, each with a head.

    Arcs lie on the front. For a positive moment, which opens the crease, they point towards the
    panels; for a negative moment, away from the panels.
    """
    pieces, arcs = case.structure.body.sheet.fold_hinges(), []
    for crease, moment in zip(share.numbers, share.value, strict=True):
        own = pieces.nodes[pieces.fold == crease]
        ends = points[own[:, :2]].reshape(-1, 3)
        middle = own[np.linalg.norm(points[own[:, :2]].mean(1) - ends.mean(0), axis=1).argmin()]
        j, k, i, _ = points[middle]
        angle = float(mechanics.angles(points - points.mean(0), middle[None].astype(np.uint32))[0])
        axis = (k - j) / np.linalg.norm(k - j)
        wing = (i - j) - axis * ((i - j) @ axis)
        wing = wing / np.linalg.norm(wing)
        turn = np.linspace(max(NEAR, min(FAR, 0.45 * angle)), NEAR, STEPS)
        turn = turn if moment > 0.0 else turn[::-1]
        for way in (turn, angle - turn):
            across = np.outer(np.cos(way), wing) + np.outer(np.sin(way), np.cross(axis, wing))
            arcs.append(ends.mean(axis=0) + radius * across)
    return np.array(arcs).reshape(-1, STEPS, 3)


K = TypeVar("K")
POINTS = 1001  # number of points of a curve
_LISTED = 3
# Most curves of one history; imposed displacements and rest angles may differ everywhere.
_MOST_CURVES = 4


def load_charts(case: Case, start: float, duration: float) -> list[Chart]:
    """Curves of all loads and imposed motions against time (s), a chart for each kind of load.

    A curve shows the largest force at a node, or the largest pressure, temperature or moment among
    the panels or creases.
    """
    time = np.linspace(start, start + duration, POINTS)

    def curve(amplitude: float, text: str, history: Any, offset: float = 0.0) -> Curve:
        factor = np.asarray(history(time), dtype=np.float64)
        values = offset + amplitude * np.broadcast_to(factor, time.shape)
        return Curve(f"{text}: {history_name(history)}", time, values)

    pushed, warm = on_panels(case, Pressure), on_panels(case, Temperature)
    kinds = {
        "force at a node (N)": [(_peak(f), describe(f, "N"), h) for f, h in case.force_terms],
        "pressure (Pa)": [(_most(s.value), describe_pressure(s), s.history) for s in pushed],
        "moment of a crease (N m)": [
            (_most(s.value), describe_moment(s), s.history) for s in moments(case)
        ],
        "temperature (K)": [(_most(s.value), describe_temperature(s), s.history) for s in warm],
        "gravity (m/s2)": [
            (_peak(g), describe_vector("gravity", g, "m/s2"), h) for g, h in case.gravity_terms
        ],
        "imposed displacement (m)": _imposed(case),
        "base displacement (m)": _of_base(case),
    }
    charts = [
        Chart("time (s)", label, [curve(*one) for one in terms], zero=True)
        for label, terms in kinds.items()
        if terms
    ]
    turned = [curve(*one) for one in _rest_angles(case)]
    return [*charts, *([Chart("time (s)", "rest angle (degrees)", turned)] if turned else [])]


def _peak(vectors: np.ndarray) -> float:
    return float(np.linalg.norm(vectors, axis=-1).max())


def _imposed(case: Case) -> list[tuple[float, str, Any]]:
    """Curves of imposed displacements, one for each history, value and axis or direction."""
    found = []
    for _, history in case.prescribed_terms:
        moved: dict[tuple[str, float], list[int]] = {}
        for support in case.supports:
            if isinstance(support, Impose) and support.history == history:
                nodes = resolve_nodes(case.structure, support.nodes).tolist()
                along = support.axis or _direction(unit_vector(support.direction))
                values = np.broadcast_to(np.asarray(support.value, float), (len(nodes),))
                for node, value in zip(nodes, values.tolist(), strict=True):
                    moved.setdefault((along, value), []).append(node)
        for (along, value), nodes, more in _some(moved):
            text = f"moved {value:.4g} m along {along} on {_listed('node', nodes)}{more}"
            found.append((value, text, history))
    return found


def _of_base(case: Case) -> list[tuple[float, str, Any]]:
    """Curves of motions of the base, one for each history and axis."""
    found = []
    for vectors, history in case.base_terms:
        peak = signed_peak(base_vectors(case, vectors)).tolist()
        for axis, value in zip("xyz", peak, strict=True):
            if value:
                found.append((float(value), f"base moved {value:.4g} m along {axis}", history))
    return found


def _rest_angles(case: Case) -> list[tuple[float, str, Any, float]]:
    """Curves of rest angles (degrees), one for each history and pair of first and last angle."""
    found = []
    first = np.degrees(case.structure.fold_rest).round(6)
    for change, history in case.actuation_terms:
        last = np.degrees(case.structure.fold_rest + change).round(6)
        turned: dict[tuple[float, float], list[int]] = {}
        for load in case.loads:
            if isinstance(load, Actuate) and load.history == history:
                for crease in resolve_creases(case.structure, load.creases).tolist():
                    pair = float(first[crease]), float(last[crease])
                    turned.setdefault(pair, []).append(crease)
        for (start, end), creases, more in _some(turned):
            of = f"{_listed('crease', creases)}{more}"
            text = f"rest angle {start:.4g} to {end:.4g} degrees on {of}"
            found.append((end - start, text, history, start))
    return found


def _some(groups: dict[K, list[int]]) -> Iterator[tuple[K, list[int], str]]:
    """The first groups; the name of the last one tells how many are left out."""
    hidden = len(groups) - _MOST_CURVES
    for k, (key, numbers) in enumerate(list(groups.items())[:_MOST_CURVES], 1):
        last = hidden > 0 and k == _MOST_CURVES
        yield key, numbers, f" (and {hidden} more, not drawn)" if last else ""


def base_vectors(case: Case, vectors: np.ndarray) -> np.ndarray:
    """Displacements of a base (n, 3) at held nodes and axes; at all nodes if none is held."""
    alone = np.where(case.fixed, vectors, 0.0)
    return alone if alone.any() else vectors


def signed_peak(vectors: np.ndarray) -> np.ndarray:
    """For each axis, the component of vectors (n, 3) with the largest magnitude, shape (3,)."""
    return vectors[np.abs(vectors).argmax(axis=0), np.arange(3)]


def describe_pressure(share: Share) -> str:
    """Describe a pressure in words: its size and its panels."""
    return f"pressure {_most(share.value):.4g} Pa on {_listed('panel', share.numbers.tolist())}"


def describe_temperature(share: Share) -> str:
    """Describe a change of temperature in words: its size and its panels."""
    value = _most(share.value)
    way = "colder" if value < 0.0 else "warmer"
    return f"{abs(value):.4g} K {way} on {_listed('panel', share.numbers.tolist())}"


def describe_moment(share: Share) -> str:
    """Describe crease moments in words: their size and their creases."""
    creases, low = _listed("crease", share.numbers.tolist()), float(share.value.min())
    if np.ptp(share.value):
        return f"moments {low:.4g} to {share.value.max():.4g} N m of {creases}"
    return f"moment {low:.4g} N m of {creases}"


def _most(values: np.ndarray) -> float:
    """The value with the largest magnitude."""
    return float(values[np.abs(values).argmax()])


def describe_vector(text: str, vector: np.ndarray, unit: str) -> str:
    """Describe a vector (3,) in words, after a text: its size and direction."""
    size = float(np.linalg.norm(vector))
    text = f"{text} {size:.4g} {unit}"
    return f"{text} along {_direction(vector / size)}" if size else text


def describe(vectors: np.ndarray, unit_name: str) -> str:
    """Describe vectors in words: where they act, their direction, and their size at a node."""
    size = np.linalg.norm(vectors, axis=1)
    nodes = np.flatnonzero(size > 0.0)
    unit = vectors[nodes] / size[nodes, None]
    text = f"{size.max():.4g} {unit_name}"
    if nodes.size and np.abs(unit - unit[0]).max() < 1e-9:
        text += f" along {_direction(unit[0])}"
    if nodes.size and np.ptp(size[nodes]) > 1e-9 * size.max():
        text = "up to " + text
    return f"{text} on {_listed('node', nodes.tolist())}"


def _listed(what: str, numbers: list[int]) -> str:
    """List the first of some nodes or creases, as in "nodes 1, 2, 5 and 4 more"."""
    return f"{what}{'s' * (len(numbers) != 1)} {listed(numbers, _LISTED)}"


def _direction(unit: np.ndarray) -> str:
    """Name of an axis, or the components of a unit vector (3,)."""
    axis = int(np.abs(unit).argmax())
    if abs(unit[axis]) > 1.0 - 1e-12:
        return f"{'-' if unit[axis] < 0 else '+'}{'xyz'[axis]}"
    return "(" + ", ".join(f"{c + 0.0:.3g}" for c in unit) + ")"


def history_name(history: Any) -> str:
    """Name a history by its class and parameters, such as "half sine (duration 0.5)"."""
    history = getattr(history, "function", history)  # a function of the user keeps its own name
    kind = type(history)
    if not is_dataclass(history):
        return str(getattr(history, "__name__", kind.__name__)).strip("<>")
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", kind.__name__).lower()
    numbers = []
    for item in fields(history):
        value = getattr(history, item.name)
        if isinstance(value, bool):
            words = f"{item.name} {words}" if value else words
        elif isinstance(value, int | float | np.number):
            numbers.append(f"{item.name} {float(value):.4g}")
    return f"{words} ({', '.join(numbers)})" if numbers else words
