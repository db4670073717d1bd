"""The case, the input of a solver: a structure with supports, loads and damping."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.arguments import brief
from foldyn.cases.added_mass import elements_of, fluid_at
from foldyn.cases.air import Air
from foldyn.cases.case_assembly import Damped, Loaded
from foldyn.cases.clamped_edges import supported_points
from foldyn.cases.contact import Contact
from foldyn.cases.damping import Damping, Rayleigh, dampings
from foldyn.cases.history import CONSTANT, History, as_history, factor
from foldyn.cases.latches import Latch, warn_of_company
from foldyn.cases.loads import LOADS, Gravity, Load
from foldyn.cases.masses import PointMass, carried_mass
from foldyn.cases.releases import check_releases
from foldyn.cases.springs import Bar, Cable, Elastic, Made
from foldyn.cases.state import State
from foldyn.cases.stops import Stop
from foldyn.cases.supports import SUPPORTS, Fix, Impose, Link, Support
from foldyn.errors import Faults, InputError, ModelRangeWarning, quietly, warn, within
from foldyn.materials.inelastic_law import VARIABLES
from foldyn.mechanics.air.added_mass import AddedMass
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.contact.board_term import BoardContactTerm
from foldyn.mechanics.contact.boards import BoardSheets
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.mechanics.springs import SpringsTerm
from foldyn.patterns.picture import picture
from foldyn.structures.boundary_elements import BoundaryElements
from foldyn.structures.discretized import Discretized, read_only
from foldyn.structures.inelastic_hinges import Remembering, remembering
from foldyn.structures.mass import center_of_mass, inertia_tensor, row_sums
from foldyn.values import objects, show

ROUNDING = 1e-9  # part of a force that counts as none


@brief
@dataclass(frozen=True, eq=False)
class Case(Loaded, Damped):
    """A structure with supports, loads and damping.

    Parameters
    ----------
    structure : Structure
        The discretized pattern.
    supports : sequence of Fix, Impose, BaseMotion and the other kinds of `SUPPORTS`
        Nodes held at rest, moved as prescribed, tied together, on springs or dashpots, and motions
        of the base. None by default: in dynamics a structure may move freely.
    loads : sequence of Force, Gravity, Actuate and the other kinds of `LOADS`
        Forces, gravity, pressure, self-folding creases; none by default.
    damping : Rayleigh, ModalDamping, CreaseDamping, StrainDamping, or a sequence of them
        Damping; none by default. Several kinds add up.
    masses : sequence of PointMass
        Masses that nodes carry in addition to the sheet; none by default.
    contact : Contact, optional
        Contact between panels, and with planes, in motions and equilibrium paths. Without it
        panels pass through each other.
    air : Air, optional
        The fluid around the sheet; vacuum by default.

    Attributes
    ----------
    rayleigh, modal_damping, crease_damping, dashpots, damped
        See `Damped`.
    fixed : ndarray of bool, shape (n, 3)
        True where a node is held along an axis, by `Fix` or by `Impose`. Mesh points of a clamped
        edge are held along an axis if both ends of the edge are.
    imposed : ndarray of bool, shape (n, 3)
        True where an `Impose` moves a node along an axis.
    constraints : Constraints
        Equations between displacements: held directions, links, rigid panels.
    free_dofs, supported_dofs : ndarray of int64
        Numbers 3 * node + axis of the free dofs, which determine all others, and of the held dofs;
        both increase.
    reaction_dofs : ndarray of int64
        Dofs that supports hold along an axis, or on which they act along a direction; increasing.
    load_terms : tuple of (ndarray of shape (n, 3), History)
        Forces (N) on all nodes with their history; loads with equal histories are one term.
        Forces on held nodes are kept: the reactions carry them.
    force_terms : tuple of (ndarray of shape (n, 3), History)
        The same for forces on nodes only, without gravity.
    following_terms : tuple of (Following, History)
        Forces that depend on the displacement, one term for each load with such forces.
    gravity_terms : tuple of (ndarray of shape (3,), History)
        Accelerations of gravity (m/s2) with their history.
    imposed_terms : tuple of (ndarray of shape (n, 3), History)
        Displacements (m) at factor 1 of imposed dofs, and of dofs that constraints tie to these;
        zero elsewhere. Each has its history; equal histories are one term.
    base_terms : tuple of (ndarray of shape (n, 3), History)
        The same for dofs that `Fix` holds along the axis of a `BaseMotion`: displacements since the
        start of the motion.
    actuation_terms : tuple of (ndarray of shape (nf,), History)
        Changes (rad) of the rest angles of the folds at factor 1, zero for other folds, with their
        history; equal histories are one term.
    rest_terms : tuple of (ndarray of shape (nr,), History)
        The same for all rest angles (`body.sheet.rest_angles`: folds first), from all loads.

    Raises
    ------
    InputError
        A node or crease is out of range; a dof is held and imposed, or imposed twice; a base
        motion has no support to move; a crease is actuated twice; a force acts on held axes only;
        or gravity acts on a structure whose mass is not known.

    Warns
    -----
    FoldynWarning
        A force acts on held axes in part.
    """

    structure: Discretized
    supports: Sequence[Support] = ()
    loads: Sequence[Load] = ()
    damping: Damping | Sequence[Damping] = field(default_factory=Rayleigh)
    masses: Sequence[PointMass] = ()
    contact: Contact | None = None
    air: Air | None = None

    def _repr_html_(self) -> str | None:
        """A picture for notebooks."""
        pattern = self.structure.pattern
        return None if pattern is None else picture(pattern, repr(self))

    def __post_init__(self) -> None:
        """Check the arguments."""
        if not hasattr(self.structure, "nodes"):
            raise InputError(
                f": got {type(self.structure).__name__}, give a structure, as fd.discretize and "
                "fd.shell make it",
                "structure",
            )
        for name, kinds in (("supports", SUPPORTS), ("loads", LOADS), ("masses", (PointMass,))):
            object.__setattr__(self, name, objects(name, getattr(self, name), kinds))
        object.__setattr__(self, "damping", dampings(self.damping))
        if self.contact is not None and not isinstance(self.contact, Contact):
            raise InputError(f"contact = {show(self.contact)}: must be a Contact")
        if self.air is not None and not isinstance(self.air, Air):
            raise InputError(f"air = {show(self.air)}: must be an Air")
        self._check_linear()
        self._check_selections()
        _ = self.base_terms, self.actuation_terms  # check the supports and the creases
        if self.constraints:
            _ = self.imposed_terms
        if check_releases(self):
            return
        for place, load in self._loads():
            if not (self.structure.linear and self._acts_between(load, place)):
                load.check(self.structure, self.fixed, place)
            if isinstance(load, Gravity):
                with within(f"{place}: gravity needs the mass of the structure: "):
                    _ = self.mass

    def _check_linear(self) -> None:
        """Refuse what a linear model with nodes at vertices only leaves out."""
        if self.structure.linear and self.contact is not None:
            raise InputError(
                f"contact: Contact is not supported by {self.structure.linear}; take fd.shell or "
                "fd.discretize"
            )

    def _acts_between(self, load: Load, place: str) -> bool:
        """Whether a load of a linear model acts on panels, creases or edges that move."""
        spread = load.distributed(self.structure, place)
        if spread is None or spread.edges is None:
            return spread is not None
        return any(
            edge not in self.held_edges or _beyond(force, self.held_edges[edge])
            for edge, force in enumerate(spread.edges)
            if force.any()
        )

    def _check_selections(self) -> None:
        """Refuse nodes and creases that do not exist; report all of them together."""
        faults = Faults()
        for place, support in self._supports(Fix, Impose, Link):
            with faults.collected():
                supported_points(self.structure, support, place)
        self._check_damping(faults)
        for name in ("terms", "latches", "carried"):
            with faults.collected():
                getattr(self, name)
        stops = [*self._supports(Stop, Latch)]
        if len(stops) > 1 and not self.structure.linear:
            with faults.collected():
                warn_of_company(stops, self.structure)
        for place, load in self._loads():
            acts = load.distributed if self.structure.linear else load.following
            for part in (load.loaded, load.rest_changes, acts):
                with faults.collected():
                    part(self.structure, place)
        faults.raise_all()

    def altered(self, **changes: Any) -> Case:
        """Copy with other fields, without repeating the warnings of this case."""
        with quietly():
            return replace(self, **changes)

    @cached_property
    def body(self) -> Assembly:
        """The structure with all terms that the case adds to its energy: the input of solvers."""
        body = self.elastic_body
        if self.contact is None:
            return body
        sheets = self.contact.sheets(self.structure, np.all(self.still, axis=1))
        kind = BoardContactTerm if isinstance(sheets, BoardSheets) else ContactTerm
        return body.with_terms(kind(sheets, body))

    @property
    def contact_term(self) -> ContactTerm:
        """The contact term of `body`; only for cases with contact."""
        return self.body.term(ContactTerm)

    @cached_property
    def elastic_body(self) -> Assembly:
        """`body` without contact, for vibrations, damping and critical steps."""
        return self.structure.held(self.held_edges).with_terms(*self.terms)

    def elastic_body_at(self, time: float | None) -> Assembly:
        """`elastic_body` as loads and winches set it at a time (s); None: as constant ones do."""
        body, turns = self.elastic_body.at(lambda own: factor(own, time)), self.rest_terms
        if not turns:
            return body
        turned = sum(change * factor(history, time) for change, history in turns)
        return body.folded(body.sheet.rest_angles + turned)

    @cached_property
    def remembering(self) -> tuple[Remembering, ...]:
        """Hinges with memory, by kind; `body` holds only the elastic parts of their laws."""
        return (*remembering(self.structure, self.body, self.crease_damping), *self.latches)

    @cached_property
    def latches(self) -> tuple[Remembering, ...]:
        """Hinges with latches, for each `Latch`."""
        latches = self._supports(Latch)
        return tuple(latch.remembering(self.structure, place) for place, latch in latches)

    def check_flow(self) -> None:
        """Refuse changes of rest angles for laws that yield or creep relative to the rest angle."""
        for change, _ in self.rest_terms:
            rest = len(change) - self.body.sheet.offsets
            for number in np.flatnonzero(change[:rest]).tolist():
                law = self.body.sheet.rest_law(number)
                if any(part.law is law and not part.law.relaxes for part in self.remembering):
                    raise InputError(
                        f"loads: something turns the rest angle of a hinge with the law "
                        f"{law.name!r}, which yields or creeps away from it: move its panels "
                        "instead (Impose), or take the law prony or an elastic one"
                    )

    def check_movable(self) -> None:
        """Refuse supports that hold every dof; superelements also move between held nodes."""
        if not len(self.free_dofs) and not self.structure.linear:
            raise InputError(
                "supports: hold every node along x, y and z, so that nothing can move: free one"
            )

    def memory_in(self, state: State | None) -> NDArray | str | None:
        """Memory (b, 2) of the laws' branches in a state: as stored, a word, or None (default)."""
        given = None if state is None else state.memory
        if given is None or isinstance(given, str):
            return given
        array = np.array(given, float)
        shape = sum(part.count for part in self.remembering), VARIABLES
        if array.shape != shape:
            raise InputError(
                f"initial: memory of shape {array.shape}: the case has {shape}, branches and "
                "variables; take the state of a result of the same case, or one without memory"
            )
        return array

    @property
    def obstacle_terms(self) -> tuple[tuple[int, History], ...]:
        """Numbers of the contact planes that move, with their histories."""
        planes = enumerate(() if self.contact is None else self.contact.planes)
        return tuple((i, as_history(p.history)) for i, p in planes if p.history is not None)

    def planes_moved(self, shares: Iterable[float]) -> NDArray[np.float64]:
        """Displacements (q, 3), m, of the contact planes, at the factors of `obstacle_terms`."""
        planes = () if self.contact is None else self.contact.planes
        moved = np.zeros((len(planes), 3))
        for (number, _), share in zip(self.obstacle_terms, shares, strict=True):
            moved[number] = share * np.array(planes[number].motion)
        return moved

    @property
    def lines(self) -> SpringsTerm | None:
        """Springs with the bars and cables of the case, whose tensions results hold, if any."""
        some = any(isinstance(support, Bar | Cable) for support in self.supports)
        return self.elastic_body.find(SpringsTerm) if some else None

    def polylines(self) -> list[tuple[str, Elastic, NDArray[np.int64], NDArray[np.float64]]]:
        """Springs between nodes, bars and cables: place, support, nodes and rest positions.

        Nodes (k,) are negative where a point (k, 3), m, stands still.
        """
        found = []
        with quietly():
            for place, part in self._supports(Elastic):
                made = Made(self.structure)
                part.add_to(made, place)
                found += [(place, part, *points) for points in made.points]
        return found

    @cached_property
    def line_places(self) -> tuple[str, ...]:
        """Places of the springs between nodes, bars and cables, one for each line."""
        return tuple(place for place, *_ in self.polylines())

    def bar_loads(self, tension: NDArray) -> NDArray[np.float64]:
        """Shares (k, c) of their buckling loads with which lines are pressed, given tensions, N."""
        assert self.lines is not None  # or there would be no tension
        return -np.asarray(tension) / self.lines.limits

    def pressed(self, tension: NDArray, named: Callable[[int], str]) -> None:
        """Warn of bars beyond their buckling load, given tensions (k, c) in k states."""
        share = self.bar_loads(tension)
        if share.size and share.max() > 1.0:
            at, line = np.unravel_index(share.argmax(), share.shape)
            warn(
                f"bar (line {line}) is pressed with {share.max():.3g} times its buckling load at "
                f"{named(int(at))}: it would bow, which the model leaves out; take stiffer bars, "
                "or smaller loads",
                "supports.md#bars",
                ModelRangeWarning,
            )

    @property
    def wind_terms(self) -> tuple[tuple[NDArray[np.float64], History], ...]:
        """Velocity (3,), m/s, of a varying wind, with its history; empty for constant wind."""
        if self.air is None or not self.air.blows:
            return ()
        history = as_history(self.air.history)
        return () if history.code == CONSTANT else ((np.array(self.air.velocity), history),)

    @property
    def energy_groups(self) -> Mapping[str, str]:
        """Names of the parts of the strain energy, with descriptions."""
        return self.body.energy_groups

    @cached_property
    def mass(self) -> sparse.csr_array:
        """Nodal mass matrix (n, n), kg: structure, point masses and bars.

        Raises
        ------
        InputError
            The sheet has no density, and nodes carry nothing.
        """
        if not self.carried.nnz:
            return self.structure.mass
        try:
            return sparse.csr_array(self.structure.mass + self.carried)
        except InputError:
            if self.structure.sheet.density is not None:
                raise
            return self.carried  # a sheet without mass

    @cached_property
    def free_mass(self) -> sparse.csr_array:
        """Mass matrix of the free nodal dofs, kg, with constraints eliminated."""
        whole = sparse.kron(self.mass, sparse.eye_array(3), format="csr")
        free = self.free_dofs
        return sparse.csr_array(self.constraints.matrix(whole)[free][:, free])

    def added_mass(self, state: State | None = None) -> AddedMass:
        """Mass of the fluid that moves with the sheet in a state, by default at rest.

        Parameters
        ----------
        state : State, optional
            Only the displacement of the state matters.

        Returns
        -------
        AddedMass
            A symmetric operator on displacements (3n,), dof 3 node + axis, in kg: `added @ x`,
            `added.diagonal()`, and for small sheets `added.todense()`. With superelements it acts
            on all of their dofs, at rest; the first 3n are those of the vertices.

        Raises
        ------
        InputError
            The case has no added mass; panels nearly touch; a state of another size.

        Examples
        --------
        >>> import foldyn as fd
        >>> square = fd.Pattern([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2, 3)])
        >>> s = fd.discretize(square, fd.Sheet(1e9, 0.3, 1e-3, 700.0))
        >>> added = fd.Case(s, air=fd.Air(density=1.0, resolution=20)).added_mass()
        >>> lift = [0.0, 0.0, 1.0] * len(s.nodes)
        >>> round(float(lift @ (added @ lift)), 3)  # theory: 0.579 pi/4
        0.453
        """
        shape = self.structure.nodes.shape
        if state is not None and not isinstance(state, State):
            raise InputError(
                f": got {type(state).__name__}; give a State, as fd.initial_state(path)", "state"
            )
        given = np.zeros(shape) if state is None else state.of_nodes("displacement", shape, "state")
        return fluid_at(self, given).on(self.structure.nodes + given)

    @cached_property
    def boundary_elements(self) -> BoundaryElements:
        """Boundary elements of the fluid on the sheet, for a case in air."""
        return elements_of(self)

    @cached_property
    def carried(self) -> sparse.csr_array:
        """Mass matrix (n, n), kg, of point masses and bars."""
        return carried_mass(self.masses, self.supports, self.structure)

    @cached_property
    def point_masses(self) -> NDArray[np.float64]:
        """Mass (n,) that each node carries, kg: point masses, and halves of bars."""
        return read_only(row_sums(self.carried))

    @cached_property
    def nodal_mass(self) -> NDArray[np.float64]:
        """Mass (n,) that moves with each node, kg: the row sums of the mass matrix."""
        return read_only(row_sums(self.mass)) if self.carried.nnz else self.structure.nodal_mass

    @property
    def total_mass(self) -> float:
        """Mass (kg)."""
        return float(self.mass.sum())

    @property
    def center_of_mass(self) -> NDArray[np.float64]:
        """Center of mass (3,) at rest, m."""
        return center_of_mass(self.structure.nodes, self.mass)

    @property
    def inertia(self) -> NDArray[np.float64]:
        """Inertia tensor (3, 3) at rest about the center of mass, kg m2."""
        return inertia_tensor(self.structure.nodes, self.mass)


def _beyond(force: NDArray, held: NDArray) -> bool:
    """Whether a force (3,) also acts normal to directions (h, 3)."""
    left = force - np.linalg.pinv(held) @ (held @ force)
    return bool(np.linalg.norm(left) > ROUNDING * np.linalg.norm(force))
