"""Loads on edges, panels and creases: forces to share, pressure, moments, temperature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Key
from foldyn.cases.decode import Factor
from foldyn.cases.history import STEADY
from foldyn.cases.load import Load, check_held
from foldyn.cases.selection import (
    Creases,
    Edges,
    Nodes,
    Panels,
    area_at_nodes,
    length_at_nodes,
    resolve_creases,
    resolve_edges,
    resolve_nodes,
    resolve_panels,
    tributary_area,
)
from foldyn.errors import InputError, within
from foldyn.mechanics.following import Following, joined, moments, pressures, pushes
from foldyn.mechanics.sheet_term import NO_DOF
from foldyn.patterns.topology import edge_lookup
from foldyn.structures import Laminate
from foldyn.structures.discretized import Discretized, Distributed
from foldyn.structures.material_axes import free_strains
from foldyn.structures.ply import one_or_two
from foldyn.structures.sheet import check_layers
from foldyn.structures.swelling import Swelling
from foldyn.values import number, number_or_list, one_or_each, show, vector


def _chosen(structure: Discretized, panels: Panels, place: str) -> NDArray[np.bool_]:
    """Whether each panel (np,) of a structure with a pattern is among the given ones."""
    chosen = np.zeros(len(structure.pattern.faces), bool)
    triangles = resolve_panels(structure, panels, f"{place}.panels")
    chosen[structure.triangle_panel[triangles]] = True
    return chosen


class Spread(Load):
    """A force that nodes share in proportion to their length or area."""

    arrows = True

    def measure(self, structure: Discretized, place: str) -> NDArray[np.float64]:
        """Length (m) or area (m2) that belongs to each node (n,)."""
        raise NotImplementedError

    def total_of(self, measure: float) -> NDArray[np.float64]:
        """Total force (3,), N, on a length (m) or an area (m2)."""
        raise NotImplementedError

    def loaded(self, structure: Discretized, place: str) -> NDArray[np.int64]:
        """See `Load`; only vertices of the pattern, if there is one."""
        nodes = np.flatnonzero(self.measure(structure, place))
        pattern = structure.pattern
        return nodes if pattern is None else nodes[nodes < len(pattern.vertices)]

    def forces(self, structure: Discretized, place: str) -> NDArray[np.float64]:
        """See `Load`."""
        measure = self.measure(structure, place)
        whole = float(measure.sum())
        return (measure / whole)[:, None] * self.total_of(whole)

    def on_edges(self, structure: Discretized, edges: Edges, place: str) -> Distributed:
        """The force, spread evenly over edges."""
        along, lines = resolve_edges(structure, edges, f"{place}.edges"), structure.pattern.lines
        number = edge_lookup(lines)
        chosen = [number[low, high] for low, high in along[:, [0, -1]].tolist()]
        whole = float(self.measure(structure, place).sum())
        per_length = np.zeros((len(lines), 3))
        per_length[chosen] = self.total_of(whole) / whole
        return Distributed(edges=per_length)


@dataclass(frozen=True)
class TotalForce(Spread):
    """A total force, shared by nodes, edges or panels, times a history.

    Parameters
    ----------
    total : sequence of float, shape (3,)
        Sum of the forces (N).
    nodes : int, sequence of int, or str, optional
        Vertices by number, or an expression ("xmin"). Each vertex gets a part in proportion to its
        area: the area of a panel is divided equally among its corners.
    edges : sequence of (vertex, vertex), or str, optional
        Edges of the pattern; an expression selects edges by both of their ends. The force is
        distributed evenly over their length: half of each piece of an edge goes to either end.
    panels : int, sequence of int, or "all", optional
        Panels by number. The force is distributed evenly over their area at rest: a third of each
        triangle of a panel goes to each corner.
    history : History or callable, optional
        Factor of time; constant by default.

    Raises
    ------
    InputError
        Not exactly one of nodes, edges and panels is given.

    Examples
    --------
    >>> import foldyn as fd
    >>> fd.TotalForce((0, 0, -2.0), edges="xmax")
    TotalForce(total=(0.0, 0.0, -2.0), edges='xmax', history=Constant())
    """

    total: Annotated[Sequence[float], Check(vector, unit="N")]
    nodes: Nodes | None = None
    edges: Edges | None = None
    panels: Panels | None = None
    history: Factor = STEADY

    apart = "a total force is a load of its own"

    def agree(self) -> None:
        """Require exactly one of nodes, edges and panels."""
        given = self.given("nodes", "edges", "panels")
        if len(given) != 1:
            what = "is given" if not given else f"are given, {' and '.join(given)}"
            raise InputError(
                f": give one of nodes, edges and panels; {len(given) or 'none'} {what}", "total"
            )

    def measure(self, structure: Discretized, place: str) -> NDArray[np.float64]:
        """See `Spread`."""
        if self.edges is not None:
            along = resolve_edges(structure, self.edges, f"{place}.edges")
            return length_at_nodes(structure, along)
        if self.panels is not None:
            triangles = resolve_panels(structure, self.panels, f"{place}.panels")
            return area_at_nodes(structure, triangles)
        nodes = resolve_nodes(structure, self.nodes, f"{place}.nodes")  # type: ignore[arg-type]
        area, out = tributary_area(structure), np.zeros(len(structure.nodes))
        without = nodes[area[nodes] == 0.0]
        if without.size:
            raise InputError(
                f" = {show(self.nodes)}: no part of the sheet belongs to node {without[0]}; give "
                "vertices of panels, or edges or panels in place of nodes",
                f"{place}.nodes",
            )
        out[nodes] = area[nodes]
        return out

    def total_of(self, measure: float) -> NDArray[np.float64]:
        """See `Spread`."""
        return np.array(self.total)

    def distributed(self, structure: Discretized, place: str) -> Distributed | None:
        """See `Load`."""
        if self.edges is not None:
            return self.on_edges(structure, self.edges, place)
        if self.panels is None:
            return None
        chosen = _chosen(structure, self.panels, place)
        area = float(structure.pattern.face_areas[chosen].sum())
        return Distributed(panels=np.outer(chosen, self.total) / area)

    def check(self, structure: Discretized, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse a force that acts only on held axes; warn if some axes of its nodes are held."""
        nodes = np.flatnonzero(self.measure(structure, place))
        what, acts = f"the force {show(self.total)}", np.flatnonzero(self.total)
        check_held(what, nodes, acts, fixed, place, told=self.nodes is not None)


@dataclass(frozen=True)
class LineLoad(Spread):
    """A force per length along edges, times a history.

    Parameters
    ----------
    edges : sequence of (vertex, vertex), or str
        Edges of the pattern; an expression ("xmin") selects edges by both of their ends.
    force_per_length : sequence of float, shape (3,)
        Force per length at rest (N/m); half of the force on each piece of an edge goes to either
        end.
    history : History or callable, optional
        Factor of time; constant by default.

    Examples
    --------
    >>> import foldyn as fd
    >>> fd.LineLoad([[0, 1]], (0, 0, -5.0))
    LineLoad(edges=((0, 1),), force_per_length=(0.0, 0.0, -5.0), history=Constant())
    """

    edges: Edges
    force_per_length: Annotated[Sequence[float], Check(vector, unit="N/m"), Key("per_length")]
    history: Factor = STEADY

    apart = "acts along edges"

    def measure(self, structure: Discretized, place: str) -> NDArray[np.float64]:
        """See `Spread`."""
        return length_at_nodes(structure, resolve_edges(structure, self.edges, f"{place}.edges"))

    def total_of(self, measure: float) -> NDArray[np.float64]:
        """See `Spread`."""
        return measure * np.array(self.force_per_length)

    def distributed(self, structure: Discretized, place: str) -> Distributed:
        """See `Load`."""
        return self.on_edges(structure, self.edges, place)

    def check(self, structure: Discretized, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse a load that acts only on held axes."""
        nodes = np.flatnonzero(self.measure(structure, place))
        what = f"the force per length {show(self.force_per_length)}"
        check_held(what, nodes, np.flatnonzero(self.force_per_length), fixed, place, told=False)


@dataclass(frozen=True)
class Pressure(Load):
    """Pressure on panels, always normal to them, times a history.

    It acts along the normal of the panels' fronts: a positive pressure inflates a closed body whose
    panels have their fronts outside. The force on a triangle is the pressure times its current
    area.

    Parameters
    ----------
    pressure : float
        Pressure (Pa); if negative, it pushes on the fronts.
    panels : int, sequence of int, or "all"
        Panels by number; all by default.
    history : History or callable, optional
        Factor of time; constant by default.
    """

    pressure: Annotated[float, Check(number, unit="Pa")]
    panels: Panels = "all"
    history: Factor = STEADY

    apart = "a pressure acts on panels"

    def following(self, structure: Discretized, place: str) -> Following:
        """See `Load`."""
        chosen = resolve_panels(structure, self.panels, f"{place}.panels")
        pressure = np.full(len(chosen), self.pressure)
        return pressures(structure.nodes, structure.triangles[chosen], pressure)

    def distributed(self, structure: Discretized, place: str) -> Distributed:
        """See `Load`."""
        chosen = _chosen(structure, self.panels, place)
        return Distributed(panels=self.pressure * chosen[:, None] * structure.pattern.face_normals)

    def check(self, structure: Discretized, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse a pressure on panels whose nodes are all held."""
        if fixed[np.unique(self.following(structure, place).triangles)].all():
            raise InputError(
                f".panels = {show(self.panels)}: supports hold all nodes of these panels along "
                "all axes; load other panels, or free these",
                place,
            )


@dataclass(frozen=True)
class CreaseMoment(Load):
    """Moments about creases, times a history: equal and opposite moments on both panels.

    A positive moment does work as the dihedral grows: it opens a valley. A crease with a linear
    fold law, M = k (angle - rest), is in equilibrium at rest + moment / k.

    Parameters
    ----------
    creases : int, sequence of int, or str
        Numbers in the order of `pattern.creases`, or a name: "mountain", "valley", "all" (all
        except flat creases), or a family of the pattern (`Pattern.families`), such as "zigzag".
    moment : float or sequence of float
        Moment of each whole crease (N m): one for all creases, or one for each.
    history : History or callable, optional
        Factor of time; constant by default.
    """

    creases: Creases
    moment: Annotated[float | Sequence[float], Check(number_or_list, what="crease", unit="N m")]
    history: Factor = STEADY

    apart = "acts on creases"

    def of_creases(self, structure: Discretized, place: str) -> tuple[NDArray, NDArray]:
        """The loaded creases (k,) and their moments (k,), N m."""
        creases = resolve_creases(structure, self.creases, f"{place}.creases")
        return creases, one_or_each(f"{place}.moment", self.moment, len(creases), "creases")

    def _each(self, structure: Discretized, place: str) -> NDArray[np.float64]:
        """Moment (nf,), N m, of each fold."""
        creases, moment = self.of_creases(structure, place)
        each = np.zeros(len(structure.folds))
        each[creases] = moment
        return each

    def following(self, structure: Discretized, place: str) -> Following:
        """See `Load`; in a shell, pieces of a crease share its moment in proportion to length."""
        (creases, _), each = self.of_creases(structure, place), self._each(structure, place)
        pieces = structure.body.sheet.fold_hinges()
        chosen = np.isin(pieces.fold, creases)
        part = (each[pieces.fold] * pieces.share)[chosen]
        nodal = np.where(pieces.alone[chosen], 0.0, part)
        turning = moments(pieces.corners[chosen], pieces.nodes[chosen], nodal)
        hidden, back = pieces.hidden[chosen], -part[:, None] * pieces.hidden_turn[chosen]
        there = hidden != NO_DOF
        return joined([(turning, 0), (pushes(hidden[there], back[there]), 0)])

    def distributed(self, structure: Discretized, place: str) -> Distributed:
        """See `Load`."""
        return Distributed(creases=self._each(structure, place))

    def turns(self, structure: Discretized, place: str) -> NDArray | None:
        """See `Load`: compliant panels at a crease turn under the whole moment."""
        sheet = structure.body.sheet
        if not sheet.offsets:
            return None
        angles = np.zeros(len(sheet.rest_angles) - sheet.offsets)
        return np.append(angles, sheet.offsets_under(self._each(structure, place)))

    def check(self, structure: Discretized, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse moments of creases between held panels."""
        creases, _ = self.of_creases(structure, place)
        pieces = structure.body.sheet.fold_hinges()
        held = fixed[pieces.nodes].all(axis=(1, 2)) & (pieces.hidden == NO_DOF).all(axis=1)
        still = np.intersect1d(creases, pieces.fold[held])
        if still.size:
            raise InputError(
                f".creases = {show(self.creases)}: supports hold the panels on both sides of "
                f"crease {still[0]}; leave it out, or free these",
                place,
            )


PLIES = "plies"
MOST_STRAIN = 0.2  # largest free strain for which the laws of the sheet hold


def _expansion(name: str, value: Any, unit: str) -> float | tuple[float, float] | str:
    """Return an expansion, two of them, or `PLIES`."""
    return PLIES if isinstance(value, str) and value == PLIES else one_or_two(name, value, unit)


@dataclass(frozen=True)
class Temperature(Load):
    """A change of temperature of panels, times a history.

    Free panels stretch by `expansion` times the change and curl toward their front by `curvature`
    times the change, without stress; constrained panels are under stress. Other causes of free
    strain act in the same way: moisture, growth, swelling of a gel.

    Bars and hinges get the rest angles of a paraboloid with this curvature; like the shell, they
    are exact for small slopes. Between the factors 0 and 1 the free strain is proportional to the
    factor, to first order in the strain.

    Parameters
    ----------
    change : float
        Temperature change, K, at factor 1.
    expansion : float, (float, float) or "plies"
        Free strain per kelvin, 1/K; two of an orthotropic sheet, along its direction and across;
        or those that the plies of a laminate have.
    curvature : float
        Free curvature per kelvin, 1/(m K), positive if the sheet bends like a valley.
    panels : int, sequence of int, or "all"
        Panels by number; all by default.
    layers : sequence of (float, float, float), optional
        Instead of expansion and curvature: thickness (m), Young's modulus (Pa) and expansion (1/K)
        of bonded layers from the back to the front, as for `Laminate`. The stiffness of the panels
        stays that of their sheet; `Laminate.sheet` returns a sheet with the stiffness of the
        layers.
    history : History or callable, optional
        Factor of time; constant by default.
    """

    change: Annotated[float, Check(number, unit="K"), Key("temperature")]
    expansion: Annotated[
        float | Sequence[float] | str | None, Check(_expansion, unit="1/K", words=(PLIES,))
    ] = None
    curvature: Annotated[float | None, Check(number, unit="1/(m K)")] = None
    panels: Panels = "all"
    layers: Annotated[Sequence[Sequence[float]] | None, Check(check_layers)] = None
    history: Factor = STEADY

    apart = "a temperature acts on panels"

    def agree(self) -> None:
        """Require expansion, curvature or layers, and refuse too large strains."""
        given = self.given("expansion", "curvature")
        if self.layers is not None and given:
            raise InputError(f": the layers give the {given[0]}; leave it out", given[0])
        if self.layers is None and not given:
            raise InputError(
                ": give expansion (1/K), curvature (1/(m K)), or both, or the layers", "expansion"
            )
        if self.expansion != PLIES:
            self._stretched(np.array(self._per_kelvin[0]))

    @property
    def _per_kelvin(self) -> tuple[Any, float]:
        """Expansion (1/K), one or two or `PLIES`, and curvature (1/(m K))."""
        if self.layers is not None:
            laminate = Laminate(self.layers)
            return laminate.expansion, laminate.curvature
        return self.expansion or 0.0, self.curvature or 0.0

    def _stretched(self, expansion: NDArray) -> NDArray[np.float64]:
        """Free strains, unless they are too large."""
        strain = self.change * expansion
        if np.abs(strain).max() > MOST_STRAIN:
            raise InputError(
                f" = {self.change:g}: a free strain of {np.abs(strain).max():.3g}; the laws of the "
                f"sheet hold up to about {MOST_STRAIN:g}: check the units (K, 1/K)",
                "change",
            )
        return strain

    def swelling(self, structure: Discretized, place: str) -> Swelling:
        """See `Load`."""
        if structure.pattern is None:
            raise InputError(f"{place}: this structure has no pattern with panels")
        return structure.swollen(*self._free(structure, place))

    def distributed(self, structure: Discretized, place: str) -> Distributed:
        """See `Load`."""
        strain, curvature = self._free(structure, place)
        return Distributed(strain=strain, curvature=curvature)

    def _free(self, structure: Discretized, place: str) -> tuple[NDArray, NDArray]:
        """Free strain (np, 3, 3) and curvature (np,), 1/m, of each panel."""
        chosen, (expansion, curvature) = _chosen(structure, self.panels, place), self._per_kelvin
        if isinstance(expansion, float):
            each = expansion * chosen[:, None, None] * np.eye(3)
        else:
            with within(f"{place}."):
                two = None if expansion == PLIES else expansion
                each = free_strains(structure.pattern, structure.sheet, chosen, two)
        return self._stretched(each), self.change * curvature * chosen

    def following(self, structure: Discretized, place: str) -> Following:
        """See `Load`."""
        return self.swelling(structure, place).forces

    def turns(self, structure: Discretized, place: str) -> NDArray[np.float64]:
        """See `Load`."""
        return self.swelling(structure, place).turns
