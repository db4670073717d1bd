"""What a state reaches: a displacement, an angle or a tension, that ends a path or releases."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check
from foldyn.cases.decode import Part, PartOf
from foldyn.cases.directions import AXES, Axis
from foldyn.cases.selection import in_range
from foldyn.errors import InputError
from foldyn.json_schema import Schema, any_of
from foldyn.mechanics.springs import SpringsTerm
from foldyn.structures.mesh import hinge_angles
from foldyn.values import number, whole

Factors = Callable[[Any], float]
"""Current factor of each history."""


class Reached(Part):
    """Base of frozen data classes that name a quantity and a value that it reaches.

    It has reached the value once it is as far from rest as the value, on the same side, or farther.

    Attributes
    ----------
    goal : str
        Argument with the value.
    """

    goal: ClassVar[str]
    apart = "a release, or the end of a path, waits for one thing"

    def check(self, case: Any) -> None:
        """Refuse numbers that the case does not have."""
        raise NotImplementedError

    def measured(
        self, case: Any, displacement: NDArray, factors: Factors, gone: Collection[str]
    ) -> float:
        """The quantity at displacements (n, 3), m; gone : places of what is released."""
        raise NotImplementedError

    def at_rest(self, case: Any) -> float:
        """The quantity at rest."""
        return self.measured(case, np.zeros_like(case.structure.nodes), lambda history: 0.0, ())

    def share(self, case: Any) -> Callable[..., float]:
        """Share of the way from rest: 1 where the value is reached.

        The function returned takes displacements (n, 3), m, factors of histories, and the places of
        what is released.
        """
        self.check(case)
        rest, goal = self.at_rest(case), getattr(self, self.goal)
        if math.isclose(goal, rest):
            raise InputError(f" = {goal:g}: is the value at rest; give another", self.goal)

        def share(u: NDArray, factors: Factors, gone: Collection[str] = ()) -> float:
            return (self.measured(case, u, factors, gone) - rest) / (goal - rest)

        return share


@dataclass(frozen=True)
class ReachedDisplacement(Reached):
    """A displacement of a node.

    Parameters
    ----------
    node : int
        Number of the node.
    axis : {"x", "y", "z"}
        Axis along which it moves.
    displacement : float
        Displacement (m) from the rest position, not zero.
    """

    node: Annotated[int, Check(whole)]
    axis: Axis
    displacement: Annotated[float, Check(number, unit="m")]

    goal = "displacement"

    def check(self, case: Any) -> None:
        """See `Reached`."""
        in_range("node", self.node, len(case.structure.nodes), "node")

    def measured(
        self, case: Any, displacement: NDArray, factors: Factors, gone: Collection[str]
    ) -> float:
        """See `Reached`."""
        return float(displacement[self.node, AXES.index(self.axis)])


@dataclass(frozen=True)
class ReachedAngle(Reached):
    """An angle of a crease.

    Parameters
    ----------
    crease : int
        Number in the order of `pattern.creases`.
    angle : float
        Dihedral (degrees, between 0 and 360, flat 180), other than at rest.
    """

    crease: Annotated[int, Check(whole)]
    angle: Annotated[float, Check(number, above=0.0, below=360.0, unit="degrees")]

    goal = "angle"

    def check(self, case: Any) -> None:
        """See `Reached`."""
        in_range("crease", self.crease, len(case.structure.folds), "crease")

    def measured(
        self, case: Any, displacement: NDArray, factors: Factors, gone: Collection[str]
    ) -> float:
        """See `Reached`."""
        hinge = case.structure.folds[[self.crease]]
        return float(np.degrees(hinge_angles(case.structure.nodes + displacement, hinge))[0])


@dataclass(frozen=True)
class ReachedTension(Reached):
    """A tension of a spring, bar or cable.

    Parameters
    ----------
    line : int
        Number of the spring between nodes, bar or cable, as in `tension` of results.
    tension : float
        Tension (N), other than at rest; negative where a bar pushes.
    """

    line: Annotated[int, Check(whole, least=0)]
    tension: Annotated[float, Check(number, unit="N")]

    goal = "tension"

    def check(self, case: Any) -> None:
        """See `Reached`."""
        term = case.elastic_body.find(SpringsTerm)
        slack = () if term is None else term.springs.lines.slack
        if self.line >= len(slack):
            raise InputError(
                f" = {self.line}: the case has {len(slack)} springs between nodes, bars and "
                "cables, counted from 0",
                "line",
            )
        if self.tension < 0.0 and slack[self.line]:
            raise InputError(f" = {self.tension:g}: a cable does not push; give more", "tension")

    def measured(
        self, case: Any, displacement: NDArray, factors: Factors, gone: Collection[str]
    ) -> float:
        """See `Reached`."""
        if gone and case.line_places[self.line] in gone:
            return 0.0
        return float(case.elastic_body.term(SpringsTerm).at(factors).pulls(displacement)[self.line])


REACHED = PartOf(
    (ReachedDisplacement, ReachedAngle, ReachedTension), "",
    "node, axis and displacement, crease and angle, or line and tension",
)  # fmt: skip
"""What a path reaches at its end, in a case file and as an argument."""


class _Until(PartOf):
    """A time, or what is reached then."""

    def schema(self, hint: Any, definitions: dict[str, Schema]) -> Schema:
        """See `Check`."""
        return any_of(
            [{"type": "number", "exclusiveMinimum": 0.0}, super().schema(hint, definitions)]
        )

    def _made(self, name: str, value: Any, folder: Any) -> Any:
        if isinstance(value, Reached):
            return value
        if isinstance(value, Mapping):
            return super()._made(name, value, folder)
        return number(name, value, above=0.0, unit="s")


Until = Annotated[
    float | Reached | Mapping[str, Any] | None, _Until(REACHED.kinds, "", REACHED.asked)
]
"""Time (s), or what is reached, at which a part of a case is released; see `releases`."""
