"""A case as arrays: M a + C v + F_int(u, rest angles) = sum of load vectors times factors.

With moving supports, displacements are u = q + S f(t) and velocities v = w + S f'(t), with f the
factors of the histories. The columns of S are displacements: the prescribed ones at supports, and
-M_ff^-1 M_fs times the prescribed ones at free nodes (zero with a lumped matrix). Then
M_ff q'' = -(F_int + C v - p)_f does not contain the acceleration of the supports, even where their
velocity jumps, and every integrator advances q and w as if the supports were fixed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case, History, Origin
from foldyn.cases.heat import heat_of
from foldyn.cases.history import CONSTANT
from foldyn.cases.waveforms import Callbacks, Waveforms, evaluate
from foldyn.cases.waveforms import pack as pack_waveforms
from foldyn.dynamics.actuation import Actuators, actuators
from foldyn.dynamics.added_mass import AddedMass, added_mass
from foldyn.dynamics.dampers import air_terms, damping_terms
from foldyn.dynamics.hereditary import with_memory
from foldyn.dynamics.inertia import Inertia, inertia, lightness, substitute, times_mass
from foldyn.dynamics.modal_damping import ModalRows, modal_rows
from foldyn.dynamics.ties import Ties, ties_of
from foldyn.jit.compiled import inner
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.assembly import Assembly, Numbering
from foldyn.mechanics.following import Following, joined
from foldyn.mechanics.heat import Heat

NO_INERTIA = np.zeros(0)
ROUNDING = 1e-14  # motions of other nodes below this share of support motion are zero


class Entries(NamedTuple):
    """Nodal vectors times histories: value[k] acts on dof[k] and belongs to history row[k]."""

    dof: NDArray  # (l,) 3 place + axis, in increasing order
    value: NDArray  # (l,)
    row: NDArray  # (l,) row of the waveforms


class System(NamedTuple):
    """Data for compiled integrators in addition to the model: n nodes, h histories, s supports."""

    varies: bool  # whether some histories are not constant
    moves: bool  # whether supports move
    turns: bool  # whether rest angles change
    follows: bool  # whether loads depend on the displacement
    touches: bool  # whether there is contact
    presses: bool  # whether obstacles move, a wind varies, or springs follow histories
    rows: int  # rows of arrays: n, plus rows for hidden dofs
    energies: int  # number of strain energy groups
    order: NDArray  # (n,) node number of each place in memory
    supported: NDArray  # (s,) supported dofs 3 place + axis, in the case's order
    waves: Waveforms
    loads: Entries  # N
    moved: Entries  # S, m
    moved_mass: NDArray  # (h, h) S_k M S_l, kg m2
    actuators: Actuators
    following: Following
    ties: Ties
    alpha: float  # factor of the drag alpha M v, 1/s
    lightness: NDArray  # (n,) 1 / mass of each node, 1/kg; (0,) without contact


class Scratch(NamedTuple):
    """Scratch arrays of the equation of motion on one thread.

    Threads share the arrays, except for histories, powers, `line`, and the ranges of their nodes.
    """

    force: NDArray  # (n, 3) F_int + beta K0 v - p
    product: NDArray  # (n, 3) the mass matrix times a vector
    line: NDArray  # (n,), or (3 n,) with constraints
    energy: NDArray  # (groups,) strain energies, J
    time: NDArray  # (1,) time of the last evaluation of the histories, s
    factor: NDArray  # (h, 3) factors of the histories and their first two derivatives
    displacement: NDArray  # (n, 3) u; updated at every evaluation if supports move
    velocity: NDArray  # (n, 3) v, updated in the same way
    moving: NDArray  # (n, 3) acceleration including support motion, at samples
    stage: NDArray  # (3, n, 3) for methods of several stages
    loads: NDArray  # (2,) first and last + 1 of the loads on the thread's own nodes
    moved: NDArray  # (2,) first and last + 1 of the moving supports there
    turned: NDArray  # (2,) first and last + 1 of the actuators there
    powers: NDArray  # (3,) powers in, out and to the air at the last step, if stored, W
    pushed: NDArray  # (n, 3) displacement-dependent loads, N; (0, 3) if there are none


class PackedCase(NamedTuple):
    """A case for compiled integrators; `callbacks` must outlive the other fields."""

    body: Assembly
    system: System
    mass: Inertia
    callbacks: Callbacks
    numbering: Numbering
    modal: ModalRows  # modal damping, in the case's dof order
    added: AddedMass
    heat: Heat | None

    @property
    def model(self) -> Any:
        """Arrays of the sheet."""
        return self.body.sheet.model

    def begun(self) -> PackedCase:
        """Copy for a new motion, with a separate record of the heat at play."""
        if self.heat is None:
            return self
        return self._replace(heat=self.heat._replace(seen=np.array([np.nan, 0.0])))


def pack(
    case: Case, span: float, start: Origin | None = None, modal: ModalRows | None = None,
    hidden: NDArray = NO_INERTIA,
) -> PackedCase:  # fmt: skip
    """Pack a case into arrays; `span` (s) is a time in which loads hardly change.

    start : origin of the motion, the reference state of damping; rest by default.
    modal : modal damping of a motion from `start`, if known.
    hidden : inertia (h,), kg, of the dofs without mass, if the method gives them one.
    """
    histories: list[History] = []
    forces, supports = (*case.load_terms, *case.following_terms), case.imposed_terms
    others = (*case.base_terms, *case.rest_terms, *case.obstacle_terms, *case.wind_terms)
    driving = case.elastic_body.histories
    for history in (*(own for _, own in (*forces, *supports, *others)), *driving):
        if history not in histories:
            histories.append(history)
    modal = modal_rows(case, start) if modal is None else modal
    terms = [*damping_terms(case, start, modal), *air_terms(case, histories)]
    body, by = _driven(case, histories, terms).renumbered()
    nodal = by.matrix(case.mass)
    ties = ties_of(case.constraints, by)
    mass = inertia(nodal, by.held(case.fixed), ties, hidden)
    driven = (*case.imposed_terms, *case.base_terms)
    moves = [(carry_supports(mass, by.inward(shape)), history) for shape, history in driven]
    loads = [(by.inward(vector), history) for vector, history in case.load_terms]
    parts = [(part, histories.index(history)) for part, history in case.following_terms]
    following = joined(parts).placed(by.rank)
    callbacks = Callbacks()
    turns = _entries(case.rest_terms, histories)
    body, turned = actuators(body, *turns)
    body = with_memory(case, body, by)
    system = System(
        varies=any(history.code != CONSTANT for history in histories),
        moves=bool(moves),
        turns=len(turned.hinge) > 0,
        follows=following.acts,
        touches=case.contact is not None,
        presses=bool(case.obstacle_terms or case.wind_terms or driving),
        rows=by.rows,
        energies=len(body.energy_groups),
        order=by.order,
        supported=by.dofs(case.supported_dofs),
        waves=pack_waveforms(histories, callbacks, span),
        loads=_ordered(_entries(loads, histories)),
        moved=_ordered(_entries(moves, histories)),
        moved_mass=_moved_mass(nodal, moves, histories),
        actuators=turned,
        following=following,
        ties=ties,
        alpha=float(case.rayleigh.alpha),
        lightness=lightness(mass) if case.contact is not None else np.zeros(0),
    )
    place = start and start.displacement
    added = added_mass(case, place, by.rank, by.rows, len(body.hinges), histories)
    heated = [(own, histories.index(history)) for own, history in case.swellings]
    heat = heat_of(case.structure, heated, len(histories))
    if heat is not None:
        heat = heat._replace(loads=heat.loads.placed(by.rank))
    return PackedCase(body, system, mass, callbacks, by, modal, added, heat)


def _driven(case: Case, histories: list[History], terms: Sequence[Any]) -> Assembly:
    """Body of a case with more terms, whose springs and obstacles follow the given histories."""
    rows = {plane: histories.index(history) for plane, history in case.obstacle_terms}
    body = case.body if not rows else case.elastic_body.with_terms(case.contact_term.driven(rows))
    body = body.with_terms(*terms)
    return body.driven_by(histories) if body.histories else body


def _entries(terms, histories) -> Entries:
    parts = [(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64))]
    for vector, history in terms:
        entries = np.ravel(vector)
        where = np.flatnonzero(entries)
        parts.append((where, entries[where], np.full(len(where), histories.index(history))))
    return Entries(*map(np.concatenate, zip(*parts, strict=True)))


def _ordered(entries: Entries) -> Entries:
    """Entries sorted by dof."""
    order = np.argsort(entries.dof, kind="stable")
    return Entries(*(column[order] for column in entries))


def carry_supports(mass: Inertia, shape: NDArray) -> NDArray:
    """Motion (n, 3) of all nodes as supports move by `shape`; see S in the module docstring.

    shape : (n, 3), including nodes tied to supports by constraints.
    """
    if mass.lumped or not shape.any():
        return shape
    product, out = np.empty_like(shape), np.empty_like(shape)
    times_mass(mass, shape, product)
    substitute(mass, product, out, np.zeros(shape.size))
    moved = shape - out
    moved[np.abs(moved) <= ROUNDING * np.abs(shape).max()] = 0.0  # removes rounding noise
    return moved


def _moved_mass(mass: sparse.csr_array, moves, histories) -> NDArray:
    out = np.zeros((len(histories), len(histories)))
    for one, first in moves:
        for other, second in moves:
            value = float((one * (mass @ other)).sum())
            out[histories.index(first), histories.index(second)] += value
    return out


def scratch(system: System) -> Scratch:
    """Scratch arrays of a single thread."""
    return scratches(system, [np.array([0, system.rows])])[0]


def scratches(system: System, owned: Sequence[NDArray]) -> list[Scratch]:
    """Scratch arrays for each thread; thread k owns the rows owned[k][0] to owned[k][1] - 1."""
    rows, histories = system.rows, len(system.waves.code)
    force, product, displacement, velocity, moving = np.zeros((5, rows, 3))
    energy, stage = np.zeros(system.energies), np.zeros((3, rows, 3))
    pushed = np.zeros((rows if system.follows else 0, 3))
    return [
        Scratch(
            force=force,
            product=product,
            line=np.zeros(3 * rows if len(system.ties.slave) else rows),
            energy=energy,
            time=np.full(1, np.nan),
            factor=np.tile([1.0, 0.0, 0.0], (histories, 1)),
            displacement=displacement,
            velocity=velocity,
            moving=moving,
            stage=stage,
            loads=np.searchsorted(system.loads.dof, 3 * own),
            moved=np.searchsorted(system.moved.dof, 3 * own),
            turned=np.searchsorted(system.actuators.lowest, own),
            powers=np.zeros(3),
            pushed=pushed,
        )
        for own in owned
    ]


def place(system: System, q: NDArray, w: NDArray, t: float, s: Scratch) -> None:
    """Put displacement q + S f and velocity w + S f' at time t into `s`."""
    if system.varies:
        evaluate(system.waves, t, True, s.factor)
    s.time[0] = t
    s.displacement[:] = carried(system.moved, s.factor[:, 0], q)
    s.velocity[:] = carried(system.moved, s.factor[:, 1], w)


def carried(moved: Entries, factor: NDArray, still: NDArray) -> NDArray:
    """Motion `still` (n, 3) plus support motion, for factors (h,) or a time derivative of them."""
    if not len(moved.dof):
        return still
    out = still.copy()
    np.add.at(out.reshape(-1), moved.dof, moved.value * factor[moved.row])
    return out


@inner
def carry(moved, factor, still, out):
    """out = `still` plus support motion; see `carried`."""
    values, rest = flat(out), flat(still)
    carry_part(moved, factor, rest, values, (0, values.size), (0, moved.dof.size))


@inner
def carry_part(moved, factor, rest, values, dofs, supports):
    """Add the motion of a range of supports on the dofs from dofs[0] to dofs[1] - 1."""
    for i in range(dofs[0], dofs[1]):
        values[i] = rest[i]
    for k in range(supports[0], supports[1]):
        values[moved.dof[k]] += moved.value[k] * factor[moved.row[k]]


@inner
def power_of_moved(moved, force, factor, first, last):
    """Power (W) of moving supports first to last - 1 against the bracket of forces."""
    power, bracket = 0.0, flat(force)
    for k in range(first, last):
        power += bracket[moved.dof[k]] * moved.value[k] * factor[moved.row[k], 1]
    return power
