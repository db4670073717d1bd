"""Loads of a case and the motions it imposes as curves over time, and in words."""

from __future__ import annotations

import re
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Actuate, Case, Impose, Pressure, Temperature, resolve_nodes
from foldyn.cases.directions import unit_vector
from foldyn.cases.selection import resolve_creases
from foldyn.plots.charts import Chart, Curve
from foldyn.plots.following import Share, moments, on_panels

POINTS = 1001
"""Of a curve."""
_LISTED = 3
_MOST_CURVES = 4
"""Curves of one history at most; imposed displacements and rest angles may differ at each place."""


class _LoadCurve(NamedTuple):
    """A quantity over time: offset + amplitude * factor."""

    amplitude: float
    text: str
    history: Any
    offset: float = 0.0

    @property
    def label(self) -> str:
        """What it is, with its history."""
        return f"{self.text}: {history_name(self.history)}"

    def values(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """The quantity at times (s)."""
        factor = np.asarray(self.history(time), dtype=np.float64)
        return self.offset + self.amplitude * np.broadcast_to(factor, time.shape)


def load_charts(case: Case, start: float, duration: float) -> list[Chart]:
    """Curves of all loads and imposed motions over time (s), a chart for each of their kinds.

    Forces are the largest at a node, pressures, temperatures and moments the largest of their
    panels or creases.
    """
    forces = [_LoadCurve(_peak(f), describe_load(f), h) for f, h in case.force_terms]
    gravity = [_LoadCurve(_peak(g), describe_gravity(g), h) for g, h in case.gravity_terms]
    pushed, warm = on_panels(case, Pressure), on_panels(case, Temperature)
    pressure = [_LoadCurve(_most(s.value), describe_pressure(s), s.history) for s in pushed]
    moment = [_LoadCurve(_most(s.value), describe_moment(s), s.history) for s in moments(case)]
    warmth = [_LoadCurve(_most(s.value), describe_temperature(s), s.history) for s in warm]
    panels = [
        ("force at a node (N)", forces),
        ("pressure (Pa)", pressure),
        ("moment of a crease (N m)", moment),
        ("temperature (K)", warmth),
        ("gravity (m/s2)", gravity),
        ("imposed displacement (m)", _imposed_curves(case)),
        ("base displacement (m)", _base_curves(case)),
        ("rest angle (degrees)", _angle_curves(case)),
    ]
    time = np.linspace(start, start + duration, POINTS)
    return [
        Chart("time (s)", label, [Curve(one.label, time, one.values(time)) for one in curves],
              zero=not any(one.offset for one in curves))
        for label, curves in panels
        if curves
    ]  # fmt: skip


def _peak(vectors: np.ndarray) -> float:
    return float(np.linalg.norm(vectors, axis=-1).max())


def _imposed_curves(case: Case) -> list[_LoadCurve]:
    """Curves of imposed displacements, one for each history, value and axis or direction."""
    curves = []
    for _, history in case.prescribed_terms:
        groups: dict[tuple[str, float], list[int]] = {}
        for support in case.supports:
            if isinstance(support, Impose) and support.history == history:
                nodes = resolve_nodes(case.structure, support.nodes).tolist()
                along = support.axis or _direction(unit_vector(support.direction))
                values = np.broadcast_to(np.asarray(support.value, float), (len(nodes),))
                for node, value in zip(nodes, values.tolist(), strict=True):
                    groups.setdefault((along, value), []).append(node)
        curves += _some(
            [
                _LoadCurve(
                    value,
                    f"moved {value:.4g} m along {along} on {_listed('node', nodes)}",
                    history,
                )
                for (along, value), nodes in groups.items()
            ]
        )
    return curves


def _base_curves(case: Case) -> list[_LoadCurve]:
    """Curves of a base that moves, one for each history and axis."""
    return [
        _LoadCurve(value, f"base moved {value:.4g} m along {axis}", history)
        for vectors, history in case.base_terms
        for axis, value in zip(
            "xyz", signed_peak(base_vectors(case, vectors)).tolist(), strict=True
        )
        if value
    ]


def _angle_curves(case: Case) -> list[_LoadCurve]:
    """Curves of rest angles (degrees), one for each history and pair of first and last angle."""
    curves = []
    for change, history in case.actuation_terms:
        first = np.degrees(case.structure.fold_rest)
        last = first + np.degrees(change)
        groups: dict[tuple[float, float], list[int]] = {}
        for load in case.loads:
            if isinstance(load, Actuate) and load.history == history:
                for crease in resolve_creases(case.structure, load.creases).tolist():
                    pair = round(float(first[crease]), 6), round(float(last[crease]), 6)
                    groups.setdefault(pair, []).append(crease)
        curves += _some(
            [
                _LoadCurve(
                    end - start,
                    f"rest angle {start:.4g} to {end:.4g} degrees on {_listed('crease', creases)}",
                    history,
                    start,
                )
                for (start, end), creases in groups.items()
            ]
        )
    return curves


def _some(curves: list[_LoadCurve]) -> list[_LoadCurve]:
    """The first curves; the last of them says how many are left out."""
    hidden = len(curves) - _MOST_CURVES
    if hidden <= 0:
        return curves
    *kept, last = curves[:_MOST_CURVES]
    return [*kept, last._replace(text=f"{last.text} (and {hidden} more, not drawn)")]


def base_vectors(case: Case, vectors: np.ndarray) -> np.ndarray:
    """Displacements of a base (n, 3) at the nodes held along axes, if there are such."""
    alone = np.where(case.fixed, vectors, 0.0)
    return alone if alone.any() else vectors


def signed_peak(vectors: np.ndarray) -> np.ndarray:
    """Component (3,) of the largest magnitude along each axis of vectors (n, 3)."""
    return vectors[np.abs(vectors).argmax(axis=0), np.arange(3)]


def describe_load(vectors: np.ndarray) -> str:
    """Say in words where a load acts, in which direction, and how large it is at a node."""
    return _describe(vectors, "N")


def describe_pressure(share: Share) -> str:
    """Say in words how large a pressure is, and on which panels it acts."""
    return f"pressure {_most(share.value):.4g} Pa on {_listed('panel', share.numbers.tolist())}"


def describe_temperature(share: Share) -> str:
    """Say in words how much warmer panels are, and which."""
    value = _most(share.value)
    way = "colder" if value < 0.0 else "warmer"
    return f"{abs(value):.4g} K {way} on {_listed('panel', share.numbers.tolist())}"


def describe_moment(share: Share) -> str:
    """Say in words how large moments of creases are, and of which."""
    creases, low = _listed("crease", share.numbers.tolist()), float(share.value.min())
    if np.ptp(share.value):
        return f"moments {low:.4g} to {share.value.max():.4g} N m of {creases}"
    return f"moment {low:.4g} N m of {creases}"


def _most(values: np.ndarray) -> float:
    """Value of the largest magnitude."""
    return float(values[np.abs(values).argmax()])


def describe_imposed(vectors: np.ndarray) -> str:
    """Say in words which nodes are moved, in which direction, and how far."""
    return f"moved {_describe(vectors, 'm')}"


def describe_base(vector: np.ndarray) -> str:
    """Say in words how far the base moves (3,) and where to."""
    return _toward("base moved", vector, "m")


def describe_gravity(acceleration: np.ndarray) -> str:
    """Say in words how large an acceleration of gravity (3,) is and where it points."""
    return _toward("gravity", acceleration, "m/s2")


def _toward(text: str, vector: np.ndarray, unit: str) -> str:
    size = float(np.linalg.norm(vector))
    text = f"{text} {size:.4g} {unit}"
    return f"{text} along {_direction(vector / size)}" if size else text


def _describe(vectors: np.ndarray, unit_name: str) -> str:
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
    """Name the first of some nodes or creases, "nodes 1, 2, 5 and 4 more"."""
    listed = ", ".join(str(number) for number in numbers[:_LISTED])
    if len(numbers) > _LISTED:
        listed += f" and {len(numbers) - _LISTED} more"
    return f"{what} {listed}" if len(numbers) == 1 else f"{what}s {listed}"


def _direction(unit: np.ndarray) -> str:
    """Name of an axis, or the components of a unit vector (3,)."""
    axis = int(np.abs(unit).argmax())
    if abs(unit[axis]) > 1.0 - 1e-12:
        return f"{'-' if unit[axis] < 0 else '+'}{'xyz'[axis]}"
    return "(" + ", ".join(f"{c + 0.0:.3g}" for c in unit) + ")"


def history_name(history: Any) -> str:
    """Name a history by its class and numbers, "half sine (duration 0.5)"."""
    history = getattr(history, "function", history)  # a user's function is known by its own name
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
