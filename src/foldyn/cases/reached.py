"""What a state reaches: a displacement, an angle or a tension, that ends a path or releases."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check
from foldyn.cases.decode import Part, PartOf
from foldyn.cases.directions import AXES, Axis
from foldyn.cases.selection import resolve_creases, resolve_nodes
from foldyn.errors import InputError
from foldyn.json_schema import Schema, any_of
from foldyn.structures.mesh import hinge_angles
from foldyn.values import number, whole

Factors = Callable[[Any], float]
"""Current factor of each history."""


class Reached(Part):
    """Base of frozen data classes that name a quantity and a value that it reaches.

    It has reached the value once it is at least as far from its value at rest, on the same side.

    Attributes
    ----------
    goal : str
        Argument with the value.
    """

    goal: ClassVar[str]

    def check(self, case: Any) -> None:
        """Refuse numbers that the case does not have."""
        raise NotImplementedError

    def measured(self, case: Any, displacement: NDArray, factors: Factors) -> float:
        """The quantity at displacements (n, 3), m."""
        raise NotImplementedError

    def share(self, case: Any) -> Callable[[NDArray, Factors], float]:
        """Function of displacements (n, 3), m, and factors: 0 at rest, 1 where it is reached."""
        self.check(case)
        rest = self.measured(case, np.zeros_like(case.structure.nodes), lambda history: 0.0)
        goal = getattr(self, self.goal)
        if math.isclose(goal, rest):
            raise InputError(f" = {goal:g}: is reached at rest; give another", self.goal)
        return lambda u, factors: (self.measured(case, u, factors) - rest) / (goal - rest)


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
        resolve_nodes(case.structure, (self.node,), "node")

    def measured(self, case: Any, displacement: NDArray, factors: Factors) -> float:
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
        resolve_creases(case.structure, (self.crease,), "crease")

    def measured(self, case: Any, displacement: NDArray, factors: Factors) -> float:
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
        count = 0 if case.lines is None else len(case.lines.limits)
        if self.line >= count:
            raise InputError(
                f" = {self.line}: the case has {count} springs, bars and cables with a tension, "
                "counted from 0, and needs a bar or cable among them",
                "line",
            )

    def measured(self, case: Any, displacement: NDArray, factors: Factors) -> float:
        """See `Reached`."""
        return float(case.lines.at(factors).pulls(displacement)[self.line])


REACHED = PartOf(
    (ReachedDisplacement, ReachedAngle, ReachedTension), "analysis.until",
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
    float | Reached | Mapping[str, Any] | None, _Until(REACHED.kinds, "supports", REACHED.asked)
]
"""Time (s), or what is reached, at which a part of a case is released; see `releases`."""
