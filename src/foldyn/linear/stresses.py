"""`stresses`: membrane forces, moments and stresses of panels, and moments of creases.

Superelements take small motions with the shapes for stresses, which follow those of their level.
With x the motion on the dofs of the level, embedded in those of the finer shapes, the finer motion
y is the static response to the loads and to the inertia and damping of x:

    K y = f + w^2 M x - i w C x .

So it has the resonances of x, and the shapes that the level lacks are in balance. Bodies that are
free to move take K - s M in place of K, and w^2 - s in place of w^2, with s below 0. In a motion
over time x'' is in place of -w^2 x, and x' in place of i w x.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.eigen import Pencil
from foldyn.algebra.superlu import factorize
from foldyn.cases import Case, History
from foldyn.cases.directions import AXES
from foldyn.condensation import Superelements
from foldyn.dynamics.initial import MODAL, initial_state
from foldyn.dynamics.linear_motion import prepare_linear
from foldyn.dynamics.superposition import Superposition, matrices
from foldyn.errors import InputError, quietly
from foldyn.linear.excitation import Drive, drive_terms
from foldyn.linear.frequency_domain import Direct, damped, direct
from foldyn.linear.frf import quantity_of
from foldyn.linear.linearized import Linearized, linearize
from foldyn.linear.modes import rigid_space, spectrum_of, unresisted
from foldyn.results import case_of
from foldyn.statics.stability import oriented
from foldyn.strength.dataset import stress_dataset
from foldyn.strength.loaded import LoadedSheet, crease_moments
from foldyn.strength.resultants import (
    Resultants,
    SuperelementResultants,
    check_stresses,
    for_stresses,
    has_stresses,
    resultants_of,
)

STEP = 1e-4  # largest displacement in differences about a state, relative to the size of the sheet
TINY = 1e-300
AGREES = 1e-6  # relative difference of modes that are computed again
LINEAR = ("direct", "modal")  # methods of frequency responses
BELOW = 1e-6  # shift of a free body, relative to the scale of its squared frequencies


class SmallStresses(NamedTuple):
    """Forces and moments of panels (s, p, 2, 3), if they have any, and of creases (s, nf)."""

    panels: NDArray | None
    creases: NDArray


def stresses(result: xarray.Dataset) -> xarray.Dataset:
    """Stresses of panels and moments of creases in all states of a result.

    Parameters
    ----------
    result : xarray.Dataset
        A path, a motion, modes, or a linear frequency response, of superelements, a shell, or bars
        and hinges. Of a motion of superelements from its first sample on.

    Returns
    -------
    xarray.Dataset
        Along the dimension of the result (step, time, mode or frequency), at the points of all
        panels in turn (dimension `point`; its coordinates `point_panel`, `point_place` and
        `point_number` say where): the center, the middles of edges, and points one thickness away
        from the corners, toward the center. A vertex itself is singular.

        `membrane_force` N (N/m) and `bending_moment` M (N), with the components xx, yy, xy in the
        panel's own axes: x is along the edge from its first to its second corner, y to the left of
        it, seen from the front. `stress` (Pa) at both faces, N/t -+ 6 M/t2; `von_mises` and
        `principal_stress` (Pa). `crease_moment` (N): the moment that a crease itself transmits per
        length, the mean along it, positive if it is farther open than at rest.

        Of modes, per unit of their shape; of frequency responses, complex, per N of a force or m
        of a base, with the largest von Mises stress in a cycle.

    Raises
    ------
    InputError
        A result of another kind; a law with memory; a part of a motion of superelements.

    Notes
    -----
    The stress is elastic: the part of damping is not in it. Superelements are computed again with
    more shapes on their edges, on which stresses near the corners depend. In bars and hinges that
    bend as plates (`n5b8e`, `plate`) a panel is taken as a small shell that follows its corners and
    center. Bars and hinges of the other presets have moments of creases only.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> s = fd.superelements(pattern, fd.Sheet(1e9, 0.3, thickness=0.01, density=1000.0))
    >>> held = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    >>> path = fd.trace(fd.Case(s, held, [fd.Force([0, 1], (0.1, 0.0, 0.0))]), steps=1)
    >>> found = fd.stresses(path).isel(step=-1)
    >>> found.von_mises.max().item() > 0.0
    True
    """
    return stresses_of(case_of(result), result)


def stresses_of(case: Case, result: xarray.Dataset) -> xarray.Dataset:
    """Stresses in all states of a result of a case; see `stresses`."""
    kind = str(result.attrs["foldyn_result"])
    if kind not in ALONG:
        raise InputError(
            f": a result of the kind {kind!r} has no stresses of its own; give a path, a motion, "
            "modes or a frequency response (fd.random_response(..., stresses=True) has those of "
            "random vibration)",
            "result",
        )
    check_stresses(case, "result")
    first, name, compute = ALONG[kind]
    single = first not in result.dims
    result = result.expand_dims(first) if single else result
    model = resultants_of(case) if has_stresses(case.structure) else None
    found = compute(case, model, result)
    coordinate = {name: (first, np.ravel(result[name].values), result[name].attrs)}
    points = None if model is None else model.points
    made = stress_dataset(case, points, found.panels, found.creases, coordinate, {"of": kind})
    return made.isel({first: 0}) if single else made


def _path(case: Case, model: Resultants | None, result: xarray.Dataset) -> SmallStresses:
    """Stresses at the points of a path."""
    constant = np.isin(np.arange(len(case.loads)), np.ravel(result.attrs.get("constant", ())))
    at, place = np.ravel(result["load_factor"].values), result["displacement"].values
    return _at(case, model, place, np.where(constant, 1.0, at[:, None]))


def _motion(case: Case, model: Resultants | None, result: xarray.Dataset) -> SmallStresses:
    """Stresses at the samples of a motion."""
    time = np.ravel(result["time"].values)
    factors = [np.asarray(own.history(time), float) for own in case.loads]
    factors = np.stack(factors, axis=1) if factors else np.zeros((len(time), 0))
    if isinstance(model, SuperelementResultants):
        return _superposed(case, model, result, factors)
    return _at(case, model, result["displacement"].values, factors)


def _superposed(
    case: Case, model: SuperelementResultants, result: xarray.Dataset, factors: NDArray
) -> SmallStresses:
    """Stresses at the samples of a motion of superelements, which is computed again."""
    facts, time = result.attrs, np.ravel(result["time"].values)
    if len(time) < 2 or time[0] != facts["start"] or facts["method"] != MODAL:
        raise InputError(
            ": keeps the displacements of vertices only, and the motion can be computed again from "
            "its first sample only; find the stresses of the whole motion, then choose samples",
            "result",
        )
    initial = None
    if facts["started_from"] != "rest":
        with quietly():  # without more, panels did start in balance
            initial = initial_state(result, 0)
    motion = prepare_linear(
        case, facts["duration"], MODAL, interval=facts["interval"], start=facts["start"],
        initial=initial, kept=True,
    )  # fmt: skip
    equation, states = motion.again(int(facts["modes"]))
    nodes, chosen = case.structure.nodes.size, iter(np.rint((time - time[0]) / facts["interval"]))
    wanted, kept, apart = next(chosen, None), [], 0.0
    moved = result["displacement"].values.reshape(len(time), -1)
    for k, z in enumerate(states):
        if k == wanted:
            place = equation.both[:nodes] @ equation.amplitudes(z)[0]
            apart = max(apart, float(np.abs(place - moved[len(kept)]).max()))
            kept.append(z.copy())
            wanted = next(chosen, None)
    if len(kept) < len(time) or apart > AGREES * np.abs(moved).max(initial=0.0):
        raise InputError(
            ": its motion comes out differently here, as if another case had moved; compute it "
            "again with fd.simulate",
            "result",
        )
    finer = FinerMotion(case, equation, motion.histories)
    sheet, panels, creases = LoadedSheet(finer.case), [], []
    unit = np.eye(len(case.loads))
    held = np.array([model.at(np.zeros(finer.case.body.size), one).ravel() for one in unit])
    held = held.reshape(len(case.loads), model.rows.shape[0])
    carried = np.zeros((len(motion.histories), model.rows.shape[0]))
    for vector, history in case.base_terms:
        for axis in np.flatnonzero(vector.any(axis=0)):
            size = vector[:, axis][np.abs(vector[:, axis]).argmax()]
            carried[motion.histories.index(history)] += size * model.accelerated(int(axis))
    for (y, bent), own in zip(finer.at(iter(kept)), factors, strict=True):
        panels.append((model.rows @ y + own @ held + bent @ carried).reshape(-1, 2, 3))
        creases.append(crease_moments(finer.case.structure, sheet.body(own), y))
    return SmallStresses(np.array(panels), np.array(creases))


def _at(
    case: Case, model: Resultants | None, displacement: NDArray, factors: NDArray
) -> SmallStresses:
    """Stresses in states with displacements (s, n, 3), m, and factors (s, k) of the loads."""
    case = case if model is None else model.case
    sheet, panels, creases = LoadedSheet(case), [], []
    for place, own in zip(displacement, factors, strict=True):
        q = sheet.dofs(place, own)
        creases.append(crease_moments(case.structure, sheet.body(own), q))
        if model is not None:
            panels.append(model.at(q, own))
    return SmallStresses(np.array(panels) if model is not None else None, np.array(creases))


def _state(result: xarray.Dataset, along: str) -> NDArray[np.float64]:
    """Displacement (n, 3), m, about which a result vibrates."""
    return result["displacement"].isel({along: 0}, missing_dims="ignore").values


def _modes(case: Case, model: Resultants | None, result: xarray.Dataset) -> SmallStresses:
    """Stresses of mode shapes."""
    _refuse_secant(result)
    shape, place = result["shape"].transpose("mode", "node", "axis").values, _state(result, "mode")
    if not isinstance(case.structure, Superelements):
        return _about(case, model, result, place, shape.reshape(len(shape), -1))
    numbers = np.ravel(result["mode"].values)
    again = spectrum_of(case, int(numbers.max()), verify=False, errors=False)
    own = again.result.sel(mode=numbers)
    apart = np.abs(own["shape"].values - shape).max(initial=0.0)
    if apart > AGREES * np.abs(shape).max(initial=0.0):
        raise InputError(
            ": its modes come out differently here (modes of one frequency may turn, and other "
            "processors round otherwise); compute them again with fd.modes",
            "result",
        )
    finer = FinerShapes(again.linear)
    shapes = oriented(again.spectrum.shapes)[:, numbers - 1]
    return small_motions(finer.case, model, place, finer.modes(own["eigenvalue"].values, shapes))


def _response(case: Case, model: Resultants | None, result: xarray.Dataset) -> SmallStresses:
    """Stresses per unit of the drive of a frequency response."""
    _refuse_secant(result)
    method, quantity = result.attrs["method"], quantity_of(result)
    if method not in LINEAR or quantity not in ("receptance", "transmissibility"):
        raise InputError(
            f": a {quantity} by the method {method!r}; give a receptance or transmissibility by "
            f"{' or '.join(LINEAR)}",
            "result",
        )
    moved = result[quantity].transpose("frequency", "node", "axis").values
    place = _state(result, "frequency")
    if not isinstance(case.structure, Superelements):
        return _about(case, model, result, place, moved.reshape(len(moved), -1))
    base = quantity == "transmissibility"
    value = float(result.attrs["drive_displacement" if base else "drive_force"])
    axis = str(result.attrs["base_axis"]) if base else None
    vector = result["drive"].isel({"frequency": 0}, missing_dims="ignore").values
    drive = Drive(float(result.attrs["amplitude"]), vector, value, axis)
    system, frequency = linearize(case), np.ravel(result["frequency"].values)
    answer = direct(system, drive, frequency, Direct(), lambda _: None)
    finer = FinerShapes(system)
    motions = finer.driven(drive, frequency, answer.response.T)
    found = small_motions(finer.case, model, place, motions)
    if axis is None or found.panels is None:
        return found
    assert isinstance(model, SuperelementResultants)
    carried = model.accelerated(AXES.index(axis)).reshape(-1, 2, 3)
    square = (2.0 * np.pi * frequency) ** 2
    return found._replace(panels=found.panels - square[:, None, None, None] * carried)


def _refuse_secant(result: xarray.Dataset) -> None:
    if result.attrs.get("secant") is not None:
        raise InputError(
            ": its superlinear hinges have the slopes of an amplitude (secant), which stresses do "
            "not take; take a law with a slope at rest",
            "result",
        )


def small_motions(
    case: Case, model: Resultants | None, place: NDArray, motions: NDArray[Any],
    at_rest: bool = True,
) -> SmallStresses:  # fmt: skip
    """Stresses in small motions (m, s) of all dofs about a state (n, 3), m.

    Superelements have those with the shapes for stresses.

    model : how panels have their forces; None if they have none.
    at_rest : whether no load acts in the state.
    """
    structure = case.structure
    if isinstance(model, SuperelementResultants):
        panels = (model.rows @ motions).T.reshape(motions.shape[1], -1, 2, 3)
        return SmallStresses(panels, (model.crease_rows @ motions).T)
    factors = np.full(len(case.loads), 0.0 if at_rest else 1.0)
    sheet = LoadedSheet(case)
    body, q = sheet.body(factors), sheet.dofs(place, factors)
    size = STEP * float(np.linalg.norm(np.ptp(structure.nodes, axis=0)))

    def change(motion: NDArray[Any]) -> list[NDArray]:
        """Changes of creases, and of forces and moments, with a motion (m,)."""
        if not np.isfinite(motion).all():
            whole = change(np.zeros(len(motion)))
            return [np.full(own.shape, np.nan, motion.dtype) for own in whole]
        if np.iscomplexobj(motion):
            both = change(np.real(motion).copy()), change(np.imag(motion).copy())
            return [one + 1j * other for one, other in zip(*both, strict=True)]
        step = size / max(float(np.abs(motion[: place.size]).max()), TINY)
        ends = [q + sign * step * motion for sign in (1.0, -1.0)]
        values = [[crease_moments(structure, body, end) for end in ends]]
        if model is not None:
            values.append([model.at(end, factors) for end in ends])
        return [(one - other) / (2.0 * step) for one, other in values]

    creases, *panels = (np.array(each) for each in zip(*map(change, motions.T), strict=True))
    return SmallStresses(panels[0] if panels else None, creases)


def _about(
    case: Case, model: Resultants | None, result: xarray.Dataset, place: NDArray,
    motions: NDArray[Any],
) -> SmallStresses:  # fmt: skip
    """Stresses in small motions (s, 3 n) of nodes about the state of a result."""
    at_rest = str(result.attrs.get("state", "rest")) == "rest"
    sheet, factors = LoadedSheet(case), np.full(len(case.loads), 0.0 if at_rest else 1.0)
    body = sheet.body(factors)
    hidden, first, motion = np.zeros((0, len(motions))), place.size, motions.T
    if len(body.hidden):
        tangent = body.tangent(sheet.dofs(place, factors))
        follows = factorize(tangent[first:, first:].tocsc())
        parts = [np.real(motion), np.imag(motion)] if np.iscomplexobj(motion) else [motion]
        across = tangent[first:, :first]
        real, *other = (-follows.solve(np.ascontiguousarray(across @ part)) for part in parts)
        hidden = real + 1j * other[0] if other else real
    return small_motions(case, model, place, np.concatenate([motion, hidden]), at_rest)


class FinerShapes:
    """A linearized case of superelements beside the one with the shapes for stresses."""

    def __init__(self, system: Linearized) -> None:
        self._coarse, self.case = system, for_stresses(system.case)
        self._fine = fine = linearize(self.case)
        pencil = Pencil(fine.stiffness, fine.mass)
        free = unresisted(fine, rigid_space(fine)).shape[1] > 0
        self._shift = -BELOW * pencil.scale if free else 0.0
        self._factors = pencil.factorize(self._shift)

    def modes(self, values: NDArray, shapes: NDArray) -> NDArray[np.float64]:
        """Motions (m, k) of modes with eigenvalues (k,) and shapes (nf, k) of the level."""
        inertia = self._fine.mass @ self._embedded(shapes)
        return self._fine.whole(self._solved((values - self._shift) * inertia))

    def driven(self, drive: Drive, frequency: NDArray, response: NDArray) -> NDArray:
        """Motions (m, k) of responses (nf, k) of the level, per unit of a drive."""
        moved, terms = self._embedded(response), drive_terms(self._fine, drive)
        loads = np.zeros(moved.shape, complex)
        for k, omega in enumerate(2.0 * np.pi * frequency):
            loads[:, k] = sum(term.shape * term.factor(omega) for term in terms)
            loads[:, k] += (omega**2 - self._shift) * (self._fine.mass @ moved[:, k])
            loads[:, k] -= damped(self._fine, omega, moved[:, k])
        return self._fine.whole(self._solved(loads))

    def _embedded(self, motions: NDArray) -> NDArray:
        """Motions (nf, k) of the level on the free dofs of the finer shapes."""
        own: Any = self._coarse.case.structure
        edges, whole = self.case.held_edges, self._coarse.whole(motions)
        return own.embedded(self.case.structure, whole, edges=edges)[self._fine.free]

    def _solved(self, loads: NDArray) -> NDArray:
        if not np.iscomplexobj(loads):
            return self._factors.solve(np.ascontiguousarray(loads))
        return self._solved(np.real(loads)) + 1j * self._solved(np.imag(loads))


class FinerMotion:
    """The motion of a superposition on the dofs of the finer shapes, in balance with it."""

    def __init__(self, case: Case, equation: Superposition, varying: list[History]) -> None:
        self.case = for_stresses(case)
        own: Any = case.structure
        fine, self._equation = matrices(self.case, varying), equation
        both = own.embedded(self.case.structure, equation.both, edges=case.held_edges)
        ties = fine.ties
        stiffness = sparse.csc_array(ties.T @ fine.stiffness @ ties)
        mass = sparse.csc_array(ties.T @ fine.mass @ ties)
        pencil = Pencil(stiffness, mass)
        shift = -BELOW * pencil.scale if len(equation.basis.rigid) else 0.0
        factors = pencil.factorize(shift)

        def moved(forces: NDArray) -> NDArray[np.float64]:
            """Static motions (m, k) under forces (m, k)."""
            return ties @ factors.solve(np.ascontiguousarray(ties.T @ forces))

        pulled = fine.load - fine.turned - fine.stiffness @ fine.support
        carried = moved(fine.mass @ both)
        self._acting = fine.support + moved(pulled)
        self._motion = np.hstack([-shift * carried, -moved(fine.damped(both)), -carried])

    def at(self, states: Iterator[NDArray]) -> Iterator[tuple[NDArray, NDArray]]:
        """All displacements (m,), m, and second derivatives (h,) of the histories, in states."""
        place_of_factors, count = self._equation.factors, self._acting.shape[1]
        for z in states:
            place, rate, gain = self._equation.amplitudes(z)
            y = self._acting @ z[place_of_factors]
            yield y + self._motion @ np.concatenate([place, rate, gain]), gain[-count - 1 : -1]


Compute = Callable[[Case, Resultants | None, xarray.Dataset], SmallStresses]
ALONG: Mapping[str, tuple[str, str, Compute]] = {
    "path": ("step", "load_factor", _path),
    "trajectory": ("time", "time", _motion),
    "periodic_motion": ("time", "time", _motion),
    "modes": ("mode", "mode", _modes),
    "frf": ("frequency", "frequency", _response),
}
"""Of each kind of result: the dimension of its states, their coordinate, and their stresses."""
