"""`stresses`: membrane forces, moments and stresses of panels, and moments of creases."""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.algebra.superlu import factorize
from foldyn.cases import Case
from foldyn.condensation import Superelements
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear.excitation import Drive
from foldyn.linear.frequency_domain import Direct, direct
from foldyn.linear.frf import quantity_of
from foldyn.linear.linearized import linearize
from foldyn.linear.modes import spectrum_of
from foldyn.results import case_of
from foldyn.statics import Settings, trace
from foldyn.statics.stability import oriented
from foldyn.strength.creases import crease_moments
from foldyn.strength.dataset import stress_dataset
from foldyn.strength.loaded import LoadedSheet
from foldyn.strength.resultants import (
    SuperelementResultants,
    for_stresses,
    has_stresses,
    resultants_of,
)

STEP = 1e-4  # largest displacement in differences about a state, relative to the size of the sheet
TINY = 1e-300
SPARE = 2  # modes that are computed in addition, among which those of a result are sought
MOVING = ("trajectory", "periodic_motion")
LINEAR = ("direct", "modal")  # methods of frequency responses


class SmallStresses(NamedTuple):
    """Forces and moments of panels (s, p, 2, 3), if they have any, and of creases (s, nf)."""

    panels: NDArray | None
    creases: NDArray


def stresses(result: xarray.Dataset) -> xarray.Dataset:
    """Stresses of panels and moments of creases in all states of a result.

    Parameters
    ----------
    result : xarray.Dataset
        A path, a motion, modes, or a linear frequency response, with the model superelements (not
        motions), the shell, or bars and hinges.

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
        A result of another kind; a law with memory; a motion of superelements.

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
    case = case_of(result)
    kind = result.attrs["foldyn_result"]
    check_stresses(case, kind in MOVING, "result")
    if kind == "path":
        found, along = _path(case, result), ("step", "load_factor")
    elif kind in MOVING:
        found, along = _motion(case, result), ("time", "time")
    elif kind == "modes":
        found, along = _modes(case, result), ("mode", "mode")
    elif kind == "frf":
        found, along = _response(case, result), ("frequency", "frequency")
    else:
        raise InputError(
            f": a result of the kind {kind!r} has no stresses of its own; give a path, a motion, "
            "modes or a frequency response (fd.random_response(..., stresses=True) has those of "
            "random vibration)",
            "result",
        )
    first, name = along
    coordinate = {name: (first, result[name].values, result[name].attrs)}
    points = resultants_of(case).points if found.panels is not None else None
    facts = {"of": kind}
    return stress_dataset(case, points, found.panels, found.creases, coordinate, facts)


def check_stresses(case: Case, moving: bool, field: str) -> None:
    """Refuse a case whose results, or motions, have no stresses."""
    if case.structure.pattern is None:
        raise InputError(": the structure has no pattern, and so no panels", field)
    if case.remembering:
        raise InputError(
            ": the creases have a law with memory, which stresses do not follow: take an elastic "
            "law",
            field,
        )
    if moving and case.structure.linear:
        raise InputError(
            f": motions of {case.structure.linear} keep the displacements of vertices only, from "
            "which stresses do not follow; take a frequency response, modes or random vibration, "
            "or a motion of the shell",
            field,
        )


def _path(case: Case, result: xarray.Dataset) -> SmallStresses:
    """Stresses at the points of a path."""
    constant = np.isin(np.arange(len(case.loads)), np.ravel(result.attrs.get("constant", ())))
    at, place = result["load_factor"].values, result["displacement"].values
    if isinstance(case.structure, Superelements):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)  # the path has told them
            again = trace(
                for_stresses(case), load_factors=[0.0, 1.0], settings=Settings(stability=False),
                constant=np.flatnonzero(constant).tolist(),
            )["displacement"].values  # fmt: skip
        place = again[0] + at[:, None, None] * (again[1] - again[0])
    return _at(case, place, np.where(constant, 1.0, at[:, None]))


def _motion(case: Case, result: xarray.Dataset) -> SmallStresses:
    """Stresses at the samples of a motion."""
    time = result["time"].values
    factors = [np.asarray(own.history(time), float) for own in case.loads]
    factors = np.stack(factors, axis=1) if factors else np.zeros((len(time), 0))
    return _at(case, result["displacement"].values, factors)


def _at(case: Case, displacement: NDArray, factors: NDArray) -> SmallStresses:
    """Stresses in states with displacements (s, n, 3), m, and factors (s, k) of the loads."""
    model = resultants_of(case) if has_stresses(case.structure) else None
    case = case if model is None else model.case
    sheet, panels, creases = LoadedSheet(case), [], []
    for place, own in zip(displacement, factors, strict=True):
        q = sheet.dofs(place, own)
        creases.append(crease_moments(case.structure, sheet.body(own), q))
        if model is not None:
            panels.append(model.at(q, own))
    return SmallStresses(np.array(panels) if model is not None else None, np.array(creases))


def _modes(case: Case, result: xarray.Dataset) -> SmallStresses:
    """Stresses of mode shapes."""
    shape = result["shape"].values
    if not isinstance(case.structure, Superelements):
        return _about(case, result, shape.reshape(len(shape), -1))
    stressed = for_stresses(case)
    again = spectrum_of(
        stressed, min(len(shape) + SPARE, result.attrs["free_dofs"]), verify=False, errors=False
    )
    names = "shape", "between_shape"
    given, found = (
        np.concatenate([own[name].values.reshape(len(own["mode"]), -1) for name in names], axis=1)
        for own in (result, again.result)
    )
    share = np.linalg.lstsq(found.T, given.T, rcond=None)[0]  # modes of one frequency may be turned
    motions = again.linear.whole(oriented(again.spectrum.shapes)) @ share
    return small_motions(stressed, result["displacement"].values, motions)


def _response(case: Case, result: xarray.Dataset) -> SmallStresses:
    """Stresses per unit of the drive of a frequency response."""
    method, quantity = result.attrs["method"], quantity_of(result)
    if method not in LINEAR or quantity not in ("receptance", "transmissibility"):
        raise InputError(
            f": a {quantity} by the method {method!r}; give a receptance or transmissibility by "
            f"{' or '.join(LINEAR)}",
            "result",
        )
    moved = result[quantity].values
    if not isinstance(case.structure, Superelements):
        return _about(case, result, moved.reshape(len(moved), -1))
    base = quantity == "transmissibility"
    value = float(result.attrs["drive_displacement" if base else "drive_force"])
    axis = str(result.attrs["base_axis"]) if base else None
    drive = Drive(float(result.attrs["amplitude"]), result["drive"].values, value, axis)
    system = linearize(for_stresses(case))
    answer = direct(system, drive, result["frequency"].values, Direct(), lambda _: None)
    return small_motions(system.case, system.displacement, system.whole(answer.response.T))


def small_motions(
    case: Case, place: NDArray, motions: NDArray[Any], at_rest: bool = True
) -> SmallStresses:
    """Stresses in small motions (m, s) of all dofs about a state (n, 3), m.

    Superelements have those with the shapes for stresses.

    at_rest : whether no load acts in the state.
    """
    structure = case.structure
    if isinstance(structure, Superelements):
        assert structure.stressed
        model = SuperelementResultants(case)
        panels = (model.rows @ motions).T.reshape(motions.shape[1], -1, 2, 3)
        return SmallStresses(panels, (model.crease_rows @ motions).T)
    factors = np.full(len(case.loads), 0.0 if at_rest else 1.0)
    sheet, model = LoadedSheet(case), resultants_of(case) if has_stresses(structure) else None
    body, q = sheet.body(factors), sheet.dofs(place, factors)
    size = STEP * float(np.linalg.norm(np.ptp(structure.nodes, axis=0)))

    def change(motion: NDArray[Any]) -> list[NDArray]:
        """Changes of creases, and of forces and moments, with a motion (m,)."""
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


def _about(case: Case, result: xarray.Dataset, motions: NDArray[Any]) -> SmallStresses:
    """Stresses in small motions (s, 3 n) of nodes about the state of a result."""
    at_rest = str(result.attrs.get("state", "rest")) == "rest"
    sheet, place = LoadedSheet(case), result["displacement"].values
    factors = np.full(len(case.loads), 0.0 if at_rest else 1.0)
    body = sheet.body(factors)
    hidden, first, motion = np.zeros((0, len(motions))), place.size, motions.T
    if len(body.hidden):
        tangent = body.tangent(sheet.dofs(place, factors))
        follows = factorize(tangent[first:, first:].tocsc())
        parts = [np.real(motion), np.imag(motion)] if np.iscomplexobj(motion) else [motion]
        across = tangent[first:, :first]
        real, *other = (-follows.solve(np.ascontiguousarray(across @ part)) for part in parts)
        hidden = real + 1j * other[0] if other else real
    return small_motions(case, place, np.concatenate([motion, hidden]), at_rest)
