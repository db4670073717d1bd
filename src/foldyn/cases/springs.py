"""Springs, struts and cables: elastic connections between nodes, or from nodes to the ground."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Key, Placed, Read
from foldyn.cases.connectors import NEAR, Connector
from foldyn.cases.decode import Factor, KindOf, Part, law_from
from foldyn.cases.directions import Direction, Pairs
from foldyn.cases.history import CONSTANT, STEADY, History
from foldyn.cases.reached import Until
from foldyn.cases.selection import Nodes, refuse_linear, resolve_nodes
from foldyn.errors import FoldynWarning, InputError, quietly, warn
from foldyn.materials import BAR_LAWS, BarLaw, bar_law
from foldyn.mechanics.capstan import CapstanTerm
from foldyn.mechanics.lines import GROUND, NO_LAW, Lines
from foldyn.mechanics.springs import Springs, SpringsTerm
from foldyn.structures.discretized import Discretized
from foldyn.values import indices, number, show, single, vector

SLACK = 1.001  # a cable that is this many times as long as its line at rest is said to be slack
above = partial(Check, number, above=0.0)
STEADY_NOW = (0.0, 0.0, 1.0, 0.0)  # see `Lines.now`


class Elastic(Part):
    """Base of frozen data classes that make springs and lines."""

    def add_to(self, made: Made, place: str) -> None:
        """Add the springs and lines of this part to those of a structure."""
        raise NotImplementedError

    @classmethod
    def family(cls) -> type[Part]:
        """See `Part`: all of these kinds make one term."""
        return Elastic

    @classmethod
    def term(cls, parts: Sequence[tuple[str, Any]], structure: Discretized) -> SpringsTerm:
        """See `Part`."""
        made = Made(structure)
        for place, part in parts:
            part.add_to(made, place)
        return SpringsTerm(made.springs(), made.histories, np.array(made.limits))


class Made:
    """Springs and lines as they are collected, with the histories that drive them."""

    def __init__(self, structure: Discretized | None = None) -> None:
        self.structure: Any = structure
        self.histories: list[History] = []
        self.points: list[tuple[NDArray, NDArray]] = []  # nodes (k,) and positions (k, 3), m
        self.limits: list[float] = []  # N, of each line, beyond which it buckles
        self._directed: list[tuple[Any, ...]] = []  # ends, direction, stiffness, row
        self._lines: list[tuple[Any, ...]] = []  # l0, stretch, k, slack, scaled, change
        self._whole: list[tuple[int, ...]] = []  # code, addresses, rows

    def number(self, history: Any) -> int:
        """Row of a history that varies; -1 for a constant one."""
        if history.code == CONSTANT:
            return -1
        if history not in self.histories:
            self.histories.append(history)
        return self.histories.index(history)

    def add_directed(self, ends: NDArray, axes: NDArray, stiffness: float, row: int) -> None:
        """Add springs along each of some axes (k, 3), between ends (s, 2)."""
        self._directed += [(end, axis, stiffness, row) for end in ends for axis in axes]

    def add_line(
        self, node: NDArray, x: NDArray, stiffness: float, natural: float | None,
        change: float = 0.0, rows: tuple[int, int] = (-1, -1), slack: bool = False,
        scaled: bool = False, limit: float = math.inf, law: Any = None,
    ) -> None:  # fmt: skip
        """Add a line over points x (k, 3), which are nodes or `GROUND`.

        stiffness : k (N/m), or EA (N) if `scaled`.
        law : BarLaw, instead of a tension in proportion to l - l0.
        """
        whole = math.fsum(np.linalg.norm(np.diff(x, axis=0), axis=1).tolist())
        own = whole if natural is None else natural
        if rows[0] < 0:  # changed from the start
            own, change = own + change, 0.0
        k = stiffness / own if scaled else stiffness
        self.points.append((node, x))
        self.limits.append(limit)
        self._lines.append((own, whole - own, k, slack, scaled, change))
        code, addresses = (law.code, law.addresses) if law else (NO_LAW, None)
        self._whole.append((code, *(addresses or (0, 0, 0)), *rows))

    def springs(self) -> Springs:
        """All that was added, as arrays."""
        ends, direction, stiffness, row = _columns(self._directed, 4)
        node, end = [own for own, _ in self.points], np.zeros((1, 3))
        vectors = [row for _, x in self.points for row in (np.diff(x, axis=0), end)]
        along = np.concatenate([end[:0], *vectors])
        natural, stretch, k, slack, scaled, change = _columns(self._lines, 6)
        whole = np.array(self._whole, np.int64).reshape(-1, 6)
        lines = Lines(
            np.cumsum([0, *map(len, node)]).astype(np.int64),
            np.concatenate([np.zeros(0, np.int64), *node]),
            along, np.linalg.norm(along, axis=1), natural, stretch, k, slack.astype(bool),
            scaled.astype(bool), change, whole[:, 0].copy(), whole[:, 1:4].copy(),
            whole[:, 4:].copy(), np.tile(STEADY_NOW, (len(k), 1)),
        )  # fmt: skip
        return Springs(
            ends.reshape(-1, 2).astype(np.int64), direction.reshape(-1, 3), stiffness,
            row.astype(np.int64), np.tile([1.0, 0.0], (len(stiffness), 1)), lines,
        )  # fmt: skip


def _columns(rows: Sequence[tuple[Any, ...]], count: int) -> list[NDArray]:
    return [np.array(list(column), float) for column in zip(*rows, strict=True)] or [
        np.zeros(0) for _ in range(count)
    ]


@dataclass(frozen=True)
class Spring(Connector, Elastic):
    """Linear springs: from nodes to the ground, or between nodes.

    A spring to the ground pulls its node back with k (u . d), with u the displacement of the node
    from its rest position and d a direction. The foot of the spring stands still in space, even if
    a base moves.

    A spring between nodes a and b pulls along the current line between them with k (l - l0), with l
    their distance. If a direction d is given, it pulls along d with k (u_b - u_a) . d, for any
    positions.

    Parameters
    ----------
    stiffness : float
        k of each spring (N/m), above 0.
    nodes : int, sequence of int, or str, optional
        Nodes with springs to the ground: numbers, or an expression that selects vertices.
    between : sequence of (int, int), optional
        Pairs of nodes, instead of `nodes`.
    direction : {"x", "y", "z", "-x", "-y", "-z"} or sequence of float, shape (3,), optional
        d, of any length. Without it, springs to the ground act along all three axes, and springs
        between nodes along the line between them.
    rest_length : float, optional
        l0 of springs between nodes without a direction (m); their distance at rest by default.
    change : float
        Change of l0 (m) at factor 1 of the history.
    history : History or callable, optional
        Factor of time of this change; constant by default. In paths, the load factor instead.
    stiffness_history : History or callable, optional
        Factor of time of k, for motions; constant by default.
    until : float or mapping, optional
        When the springs are released; see `Fix`.
    """

    stiffness: Annotated[float, Check(number, above=0.0, unit="N/m")]
    nodes: Nodes | None = None
    between: Pairs | None = None
    direction: Direction | None = None
    rest_length: Annotated[float | None, Check(number, least=0.0, unit="m")] = None
    change: Annotated[float, Check(number, unit="m"), Key("rest_change")] = 0.0
    history: Factor = STEADY
    stiffness_history: Factor = STEADY
    until: Until = None

    missing = {"stiffness": "give it (N/m) for springs, or dashpot (N s/m)"}
    apart = "springs are a support of their own"
    asked = "nodes, for springs to the ground, or between, for springs between nodes"
    no_line = (
        "[{k}] = [{a}, {b}]: these nodes coincide, so that the line between them has no direction; "
        'give direction, as in direction = "x"'
    )

    def agree(self) -> None:
        """Refuse lengths of springs to the ground or along a direction, and idle histories."""
        super().agree()
        for name, idle in (("rest_length", None), ("change", 0.0)):
            length = getattr(self, name)
            if length != idle and (self.between is None or self.direction is not None):
                raise InputError(
                    f" = {length:g}: only for springs along the line between nodes; leave it out, "
                    "or give between and no direction",
                    name,
                )
        _check_winch(self.change, self.history)

    def add_to(self, made: Made, place: str) -> None:
        """See `Elastic`."""
        pairs, axes, stiff = self.ends(made.structure, place), self.directions, self.stiffness
        row = made.number(self.stiffness_history)
        if axes is not None:
            made.add_directed(pairs, axes, stiff, row)
            return
        rows = (made.number(self.history) if self.change else -1, row)
        for pair in pairs:
            x = made.structure.nodes[pair]
            made.add_line(pair, x, stiff, self.rest_length, self.change, rows)


def _check_winch(change: float, history: Any) -> None:
    """Refuse a history without a change."""
    if not change and history != STEADY:
        raise InputError(": a history needs the change of length (m) at its factor 1", "change")


@dataclass(frozen=True)
class Bar(Elastic):
    """Struts: straight elastic bars between nodes, with pinned ends, which pull and push.

    Parameters
    ----------
    between : sequence of int, or of pairs of them
        Two nodes, such as (0, 5), or several pairs with a bar each.
    stiffness : float, optional
        EA of each bar (N), above 0; or give `area` and `modulus`.
    rest_length : float, optional
        Length without force (m), above 0; the distance of the nodes at rest by default.
    bending : float, optional
        EI (N m2) about the weakest axis. With it, paths and motions warn where a bar is pressed
        with more than its buckling load, pi^2 EI / L^2 (Euler).
    mass : float
        Mass (kg) of each bar, spread evenly along it: m/6 [2 1; 1 2] at its ends.
    until : float or mapping, optional
        When the bars are released; see `Fix`.
    area, modulus : float, optional
        Area of the cross-section (m2) and Young's modulus (Pa), above 0, instead of `stiffness`.
    law : {"ogden", "linear"} or BarLaw, optional
        Law as of the bars of a sheet, "linear" in Green strain. Without it, the tension is EA
        (l/l0 - 1), with l the length and l0 that without force.

    Notes
    -----
    With a law, a bar of the stretch lambda = l/l0 has the tension EA lambda S and the energy EA l0
    W, with S the second Piola-Kirchhoff stress and W the energy density per Young's modulus. Of
    "ogden", S = (lambda^3 - 1/lambda)/4 (Liu and Paulino, Proc. R. Soc. A 473, 2017); of "linear",
    S = (lambda^2 - 1)/2 (St. Venant and Kirchhoff).
    """

    between: Annotated[Pairs, Key("bar")]
    stiffness: Annotated[float | None, above(unit="N"), Key("bar_stiffness")] = None
    rest_length: Annotated[float | None, above(unit="m"), Key("bar_length")] = None
    bending: Annotated[float | None, above(unit="N m2"), Key("bar_bending")] = None
    mass: Annotated[float, Check(number, least=0.0, unit="kg"), Key("bar_mass")] = 0.0
    until: Until = None
    area: Annotated[float | None, above(unit="m2"), Key("bar_area")] = None
    modulus: Annotated[float | None, above(unit="Pa"), Key("bar_modulus")] = None
    law: Annotated[
        str | BarLaw | None, Placed(bar_law, field=""), Key("bar_law"),
        Read(KindOf(law_from, BAR_LAWS, named=True, laws=BAR_LAWS)),
    ] = None  # fmt: skip

    either = ("bar_stiffness",), ("bar_area", "bar_modulus")
    apart = "bars are a support of their own"

    def agree(self) -> None:
        """Require EA, or both of its factors."""
        given = self.given("stiffness", "area", "modulus")
        if given not in (["stiffness"], ["area", "modulus"]):
            name = (given or ["stiffness"])[-1]
            raise InputError(": give either EA (N), or both area (m2) and modulus (Pa)", name)

    @property
    def axial_stiffness(self) -> float:
        """EA (N)."""
        return self.stiffness or float(self.area * self.modulus)  # type: ignore[operator]

    def add_to(self, made: Made, place: str) -> None:
        """See `Elastic`."""
        structure = made.structure
        for k, pair in enumerate(np.array(self.between, np.int64)):
            x = structure.nodes[resolve_nodes(structure, pair, f"{place}.between[{k}]")]
            length = float(np.linalg.norm(x[1] - x[0]))
            _refuse_coincident(structure, x, list(map(int, pair)), f"{place}.between[{k}]")
            own = self.rest_length or length
            most = math.pi**2 * self.bending / length**2 if self.bending else math.inf
            made.add_line(pair, x, self.axial_stiffness, own, scaled=True, limit=most, law=self.law)


def _refuse_coincident(
    structure: Discretized, x: NDArray, given: Sequence[Any], place: str
) -> None:
    """Refuse neighbors in one place."""
    apart = np.linalg.norm(np.diff(x, axis=0), axis=1)
    if (meet := np.flatnonzero(apart <= NEAR * np.ptp(structure.nodes, axis=0).max())).size:
        one, other = (show(given[meet[0] + k]) for k in range(2))
        raise InputError(
            f": {one} and {other} are in one place, with no line between them; leave one out", place
        )


def _points(name: str, value: Any) -> tuple[Any, ...]:
    """Return node numbers, and points (m) as tuples of three numbers."""
    found = single(value)
    found = found.tolist() if isinstance(found, np.ndarray) else found
    if not isinstance(found, list | tuple) or len(found) < 2:
        raise InputError(
            f" = {show(value)}: a cable runs over at least two points: give node numbers, or "
            "positions (m) on the ground, as in [3, 8, [0, 0, 1.5]]",
            name,
        )
    return tuple(
        vector(f"{name}[{k}]", one)
        if isinstance(one, list | tuple | np.ndarray)
        else indices(f"{name}[{k}]", one, "node", "or a position (m)")[0]
        for k, one in enumerate(map(single, found))
    )


@dataclass(frozen=True)
class Cable(Elastic):
    """A cable over several points, with the same tension everywhere; slack, it has no force.

    It slides over the points between its ends, without friction as over small pulleys, or with it.
    Its tension is EA (l/l0 - 1), with l the length of the line through the points and l0 its length
    without force, which a winch can change; with friction, this is the mean over its length.

    Parameters
    ----------
    nodes : sequence of int or of (float, float, float)
        At least two points: node numbers, and positions (m) of points that stand still.
    stiffness : float
        EA (N), above 0.
    rest_length : float, optional
        l0 (m), above 0; the length of the line at rest by default.
    pretension : float, optional
        Tension at rest (N), instead of `rest_length`.
    change : float
        Change of l0 (m) at factor 1 of the history: negative to wind the cable in.
    history : History or callable, optional
        Factor of time of this change; constant by default. In paths, the load factor instead.
    friction : float
        Coefficient mu of friction on the points in between, at least 0; for motions. Where the
        cable slides and turns by the angle a, the tensions are in the ratio exp(mu a).
    sliding_speed : float
        Speed (m/s) below which friction fades, above 0: much below it, the cable creeps.
    until : float or mapping, optional
        When the cable is released; see `Fix`.

    Notes
    -----
    With friction, a winch is at the last point.

    A cable that is just taut at rest counts as taut in small vibrations and at the start of paths.
    """

    nodes: Annotated[Sequence[Any], Check(_points), Key("cable")]
    stiffness: Annotated[float, above(unit="N"), Key("cable_stiffness")]
    rest_length: Annotated[float | None, above(unit="m"), Key("cable_length")] = None
    pretension: Annotated[float | None, Check(number, least=0.0, unit="N")] = None
    change: Annotated[float, Check(number, unit="m"), Key("cable_change")] = 0.0
    history: Factor = STEADY
    friction: Annotated[float, Check(number, least=0.0), Key("cable_friction")] = 0.0
    sliding_speed: Annotated[float, above(unit="m/s"), Key("cable_sliding_speed")] = 1e-3
    until: Until = None

    missing = {"cable_stiffness": "give EA (N) of the cable"}
    apart = "a cable is a support of its own"

    def agree(self) -> None:
        """Refuse two lengths, a history without a change, and friction without a point for it."""
        if self.rest_length is not None and self.pretension is not None:
            raise InputError(
                f" = {self.pretension:g}: it follows from rest_length; give one of the two",
                "pretension",
            )
        _check_winch(self.change, self.history)
        if self.friction and len(self.nodes) < 3:
            raise InputError(
                f" = {self.friction:g}: a cable of two points slides over none; leave it out, or "
                "give the points in between",
                "friction",
            )

    def add_to(self, made: Made, place: str) -> None:
        """See `Elastic`."""
        structure = made.structure
        refuse_linear(structure, place, "cables, which can be slack,")
        node, x = self.points(structure, place)
        _refuse_coincident(structure, x, self.nodes, f"{place}.nodes")
        line = float(np.linalg.norm(np.diff(x, axis=0), axis=1).sum())
        own = line / (1.0 + (self.pretension or 0.0) / self.stiffness)
        own = self.rest_length or own
        row = made.number(self.history) if self.change else -1
        if row < 0 and own + self.change <= 0.0:
            raise InputError(
                f" = {self.change:g}: leaves no cable of {own:.6g} m; give a smaller change",
                f"{place}.change",
            )
        if own > SLACK * line and not self.change:
            warn(
                f"{place}: the cable is {own:.6g} m long and its line at rest {line:.6g} m: it is "
                "slack until its points are farther apart",
                "supports.md#cables",
                FoldynWarning,
            )
        made.add_line(node, x, self.stiffness, own, self.change, (row, -1), True, True)

    def points(self, structure: Discretized, place: str) -> tuple[NDArray, NDArray]:
        """Nodes (k,) of the points, `GROUND` for those that stand still, and positions (k, 3)."""
        numbers = [one for one in self.nodes if not isinstance(one, tuple)]
        if not numbers:
            raise InputError(": has no node; a cable moves at least one", f"{place}.nodes")
        resolve_nodes(structure, sorted(set(numbers)), f"{place}.nodes")
        node = np.array([GROUND if isinstance(one, tuple) else one for one in self.nodes])
        fixed = [one if isinstance(one, tuple) else structure.nodes[one] for one in self.nodes]
        return node.astype(np.int64), np.array(fixed, float)


def rubbing(parts: Sequence[tuple[str, Cable]], structure: Discretized) -> CapstanTerm | None:
    """Friction of cables, each with its place; None without any."""
    rubs = [(place, part) for place, part in parts if part.friction]
    if not rubs:
        return None
    with quietly():  # the springs of the case have warned
        springs = Elastic.term(rubs, structure)
    rub = np.array([(part.friction, part.sliding_speed) for _, part in rubs])
    return CapstanTerm(springs, rub)


def _following(case: Any, *keys: str) -> Iterator[str]:
    """Fields of springs and cables that follow a history."""
    for i, support in enumerate(case.supports):
        for key in keys if isinstance(support, Elastic) else ():
            if getattr(support, key, STEADY) != STEADY:
                yield f"supports[{i}].{key}"


def refuse_driven(case: Any, name: str) -> None:
    """Refuse springs and cables that follow a history or rub, for an analysis of this name."""
    refuse_rubbing(case)
    for field in _following(case, "history", "stiffness_history"):
        raise InputError(
            f": springs and cables that follow a history have no place in {name}; leave the "
            "history out, or simulate the motion with bars and hinges or a shell",
            field,
        )


def refuse_rubbing(case: Any) -> None:
    """Refuse cables that rub, where nothing slides."""
    for i, support in enumerate(case.supports):
        if getattr(support, "friction", 0.0):
            raise InputError(
                f" = {support.friction:g}: friction needs a motion, which tells where a cable "
                "slides; leave it out, or take simulate",
                f"supports[{i}].friction",
            )


def refuse_varying(case: Any) -> None:
    """Refuse cables that rub and springs whose stiffness varies, where there is no time."""
    refuse_rubbing(case)
    for field in _following(case, "stiffness_history"):
        raise InputError(
            ": only motions have a time in which a stiffness can vary; leave it out", field
        )


def refuse_cables(case: Any) -> None:
    """Refuse cables in cells of an infinite sheet, where they would have no ends."""
    for i, support in enumerate(case.supports):
        if isinstance(support, Cable):
            raise InputError(
                ": cells take springs and bars, but no cables, which would run through all cells; "
                "leave it out",
                f"supports[{i}]",
            )
