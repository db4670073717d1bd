"""Quasi-static tests in a fit: forces and shapes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.analyses.sections import one_of
from foldyn.arguments import Check
from foldyn.cases import Case
from foldyn.cases.directions import AXES, check_axes
from foldyn.errors import InputError, within
from foldyn.experiment.calibration.measurement import AtNodes, Measurement, NodeValues, column
from foldyn.sweeps.measure import Asked, asked
from foldyn.sweeps.measures import MEASURES
from foldyn.values import show

IMPOSED = "imposed"  # as `nodes`: all nodes that supports of the case move along the axis
QUANTITIES = ("displacement", "position")
OF_STATES = (
    "von_mises", "crease_moment", "margin", "strain", "strain_energy", "reaction", "displacement",
    "largest_displacement", "clearance",
)  # fmt: skip
MOST = 8  # largest number of nodes, and of shapes, in pages and figures
POINTS = 25  # number of points of the curve drawn through measured forces


@dataclass(frozen=True, eq=False, kw_only=True)
class ForceDisplacement(AtNodes):
    """Forces at displacements imposed by supports of the case.

    Parameters
    ----------
    nodes : sequence of int, or str
        Nodes of the structure, as in every measurement; "imposed", the default, means all nodes
        that supports move along the axis.
    displacement : array_like, shape (n,)
        Mean displacements of the nodes along the axis (m); with yielding creases their order
        matters.
    force : array_like, shape (n,)
        Total force on the nodes along the axis (N), positive along the axis.
    axis : {"x", "y", "z"}
    """

    nodes: Any = IMPOSED
    displacement: Annotated[Any, Check(column)] = ()
    force: Any = ()
    axis: Annotated[str, one_of(AXES)] = "x"
    kind: ClassVar[str] = "force_displacement"
    analysis: ClassVar[str] = "statics"
    word: ClassVar[str] = IMPOSED
    unit: ClassVar[str] = "N"

    def agree(self) -> None:
        """Check the values."""
        super().agree()
        self._set(force=column("force", self.force, len(self.displacement)))

    def observed(self) -> NDArray[np.float64]:
        """Measured values, flattened."""
        return self.force

    def where(self, case: Case) -> NDArray[np.int64]:
        """Numbers of the nodes."""
        if self.nodes == IMPOSED:
            return np.flatnonzero(case.imposed[:, AXES.index(self.axis)])
        return super().where(case)

    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """Refuse a case that cannot predict these values."""
        if not len(self.where(case)):
            raise InputError(f"{self._of('nodes')}: no support moves any node along {self.axis}")
        held = case.imposed[self.where(case), AXES.index(self.axis)]
        if not held.all():
            free = self.where(case)[~held][0]
            raise InputError(
                f"{self._of('nodes')}: no support of the case moves node {free} along {self.axis}; "
                "forces are compared where displacements are imposed (to compare displacements "
                'under given forces use kind = "shapes")'
            )
        if self._full(case) == 0.0:
            raise InputError(f"{self._of('nodes')}: the supports move these nodes by 0")

    def factors(self, case: Case) -> NDArray[np.float64]:
        """Load factors at which the path is needed."""
        return self.displacement / self._full(case)

    def at(self, displacement: NDArray[np.float64]) -> ForceDisplacement:
        """The same test at other displacements, where forces are unknown."""
        return replace(self, displacement=displacement, force=np.zeros(len(displacement)))

    def _full(self, case: Case) -> float:
        """Mean displacement of the nodes at the load factor 1."""
        nodes, axis = self.where(case), AXES.index(self.axis)
        return float(sum(np.mean(term[nodes, axis]) for term, _ in case.imposed_terms))

    def predicted(self, result: xr.Dataset, case: Case) -> NDArray[np.float64]:
        """Predictions of the measured values, in the order of `observed`."""
        nodes = np.isin(result["support_node"].values, self.where(case))
        chosen = nodes & (result["support_axis"].values == self.axis)
        return result["reaction"].values[:, chosen].sum(axis=1)[_steps(result, self.factors(case))]


@dataclass(frozen=True, eq=False, kw_only=True)
class Shapes(NodeValues):
    """Displacements or positions of nodes at load factors.

    Parameters
    ----------
    load_factor : array_like, shape (s,)
    values : array_like, shape (s, m, a)
        Values of each node along each axis (m); NaN if not seen.
    axes : str
        The measured axes, such as "xz" for a picture from the side.
    quantity : {"displacement", "position"}
    """

    load_factor: Annotated[Any, Check(column)] = ()
    axes: Annotated[str, Check(check_axes)] = "xyz"
    quantity: Annotated[str, one_of(QUANTITIES)] = "displacement"
    kind: ClassVar[str] = "shapes"
    analysis: ClassVar[str] = "statics"

    def agree(self) -> None:
        """Check the values."""
        super().agree()
        values = np.array(self.values, dtype=np.float64)
        if values.ndim != 3 or values.shape[::2] != (len(self.load_factor), len(self.axes)):
            raise InputError(
                f"values: shape {values.shape}: must be (steps, nodes, axes), here "
                f"({len(self.load_factor)}, nodes, {len(self.axes)})"
            )
        if not np.isfinite(values).any() or np.isinf(values).any():
            raise InputError("values: must be numbers, NaN where a node is not seen")
        self._set(values=values)

    def factors(self, case: Case) -> NDArray[np.float64]:
        """Load factors at which the path is needed."""
        return self.load_factor

    def modelled(self, result: xr.Dataset, case: Case) -> NDArray[np.float64]:
        """Values of a result at all nodes, seen or not, shape (s, m, a)."""
        nodes, axes = self.where(case), [AXES.index(axis) for axis in self.axes]
        moved = result["displacement"].values[_steps(result, self.load_factor)][:, nodes][..., axes]
        if self.quantity == "displacement":
            return moved
        return moved + case.structure.nodes[nodes][:, axes]


@dataclass(frozen=True, eq=False, kw_only=True)
class Measured(Measurement):
    """Values of a measure of sweeps in states of a path: stresses, moments of creases, energies.

    Derivatives by parameters are quotients of whole runs.

    Parameters
    ----------
    measure : str
        As in sweeps, such as "crease_moment[3]", "von_mises[0]" or "reaction[z]".
    load_factor : array_like, shape (s,)
    values : array_like, shape (s,)
        Value of the measure at each load factor, SI units.
    """

    measure: str = ""
    load_factor: Annotated[Any, Check(column)] = ()
    values: Any = ()
    kind: ClassVar[str] = "measure"
    analysis: ClassVar[str] = "statics"

    def agree(self) -> None:
        """Check the values."""
        super().agree()
        with within("measure"):
            found = asked(self.measure, MEASURES)
        if found.measure.name not in OF_STATES:
            raise InputError(
                f" = {show(self.measure)}: a fit compares states, by {', '.join(OF_STATES)}",
                "measure",
            )
        self._set(values=column("values", self.values, len(self.load_factor)))

    @property
    def asked(self) -> Asked:
        """The measure with its arguments."""
        return asked(self.measure, MEASURES)

    @property
    def unit(self) -> str:  # type: ignore[override]
        """Unit of the values."""
        return self.asked.measure.units.removesuffix("1")

    def observed(self) -> NDArray[np.float64]:
        """Measured values."""
        return self.values

    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """Refuse a case that cannot predict these values."""
        self.asked.check_numbers(case)

    def factors(self, case: Case) -> NDArray[np.float64]:
        """Load factors at which the path is needed."""
        return self.load_factor

    def predicted(self, result: xr.Dataset, case: Case) -> NDArray[np.float64]:
        """Predictions of the measured values, in the order of `observed`."""
        own, through = self.asked, self.asked.measure.through
        states = through(result, case) if through else result
        each = (states.isel(step=[k]) for k in _steps(result, self.load_factor))
        return np.array([own.measure.function(one, case, **own.arguments) for one in each])


def _steps(result: xr.Dataset, factors: NDArray[np.float64]) -> NDArray[np.int64]:
    """Steps of a path at requested load factors: in the same order, or else the nearest steps."""
    place, found = np.cumsum(np.append(0, np.diff(factors) != 0.0)), result["load_factor"].values
    if len(found) > place[-1] and np.array_equal(found[place], factors):
        return place  # works for paths that pass a load factor several times
    return np.abs(found[None] - factors[:, None]).argmin(axis=1)


def dense_curve(one: ForceDisplacement) -> ForceDisplacement:
    """The same test at more displacements, from 0 to beyond the measured ones, to draw a curve."""
    ends = min(0.0, one.displacement.min()), max(0.0, one.displacement.max())
    return one.at(np.union1d(np.linspace(*ends, POINTS), one.displacement))


def picture_plane(one: Shapes, case: Case) -> tuple[int, int]:
    """Indices in `axes` of the horizontal and vertical directions of pictures.

    These are the axes along which the nodes extend farthest.
    """
    rest = case.structure.nodes[one.where(case)]
    spans = [np.ptp(rest[:, AXES.index(axis)]) for axis in one.axes]
    first, second = sorted(np.argsort(spans)[-2:].tolist())
    return (second, first) if one.axes[first] == "x" else (first, second)
