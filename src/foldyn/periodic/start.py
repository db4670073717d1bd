"""Start of the search for a periodic motion, and the ways from there to the motion."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases import Case, Constant, Impose, Origin, State
from foldyn.cases.contact_checks import check_contact
from foldyn.dynamics import initial
from foldyn.errors import ComputationError, InputError
from foldyn.linear.linearized import equivalent_slope
from foldyn.periodic.balance import AtFrequency, Balance, Converged, newton
from foldyn.periodic.continuation import Step, Stride, point_at, steps
from foldyn.periodic.families import ByLevel
from foldyn.periodic.fourier import values_of
from foldyn.periodic.orbit import Orbit
from foldyn.statics import trace
from foldyn.statics.equilibrium import drives
from foldyn.statics.tracing import displacement_of

FLOOR = float(equivalent_slope(0.0, np.radians(1.0)))
"""Slope of superlinear hinges at rest in a first guess, for a swing of one degree."""
LITTLE = 1e-4  # of the drive, whose forces are proportional to it
SMALL = 0.05  # of the drive: level from which a motion is followed to the full drive
GROWING = Stride(0.05, 0.5, 200)
TURN = 2.0 * np.pi
PLACES = "None, a State, or a result of periodic_motion or response_curve"


def still_case(case: Case) -> Case:
    """The case without varying loads, its swinging supports held in place."""
    loads = [load for load in case.loads if load.history == Constant()]
    supports = []
    for support in case.supports:
        if getattr(support, "history", None) in (None, Constant()):
            supports.append(support)
        elif isinstance(support, Impose):
            supports.append(replace(support, value=0.0, history=Constant()))
    contact = case.contact
    if contact is not None:
        planes = [
            plane
            if plane.history in (None, Constant())
            else replace(plane, motion=None, history=None)
            for plane in contact.planes
        ]
        contact = replace(contact, planes=planes)
    return case.altered(loads=loads, supports=supports, contact=contact)


def equilibrium(case: Case) -> NDArray:
    """Displacement (n, 3), m, under the constant loads, near rest."""
    still = still_case(case)
    if not drives(still, ()):
        return np.zeros_like(case.structure.nodes)
    return trace(still, "newton", load_factors=[0.0, 1.0])["displacement"].values[-1]


def origin_of(case: Case, guess: Any) -> Origin | None:
    """State of damping that is defined at the start; None without such damping.

    It is the state or the result from which the search begins, or the equilibrium.
    """
    if not case.damped_at_start:
        return None
    if isinstance(guess, State):
        return guess.origin_of(case.structure.nodes.shape, field="guess")
    found = initial.origin_of(guess, "guess: ") if isinstance(guess, xr.Dataset) else None
    return found or Origin(equilibrium(case))


def coefficients(balance: Balance, guess: Any, omega: float, level: float = 1.0) -> NDArray:
    """Initial coefficients (c, k): from a given motion, or of small motions about a state."""
    equation = balance.equation
    if isinstance(guess, xr.Dataset):
        return _of_result(balance, guess, level)
    if guess is None:
        place = equilibrium(equation.case)
    else:
        place = displacement_of(guess, equation.case, "guess", PLACES)
    mean = equation.at(np.zeros(1), 0.0)
    check_contact(equation.case, place, mean.planes[0])
    x = np.zeros(balance.shape)
    x[0] = equation.unknowns(place[None], mean)[0]
    return x + linear_response(balance, x, omega, level)


def linear_response(balance: Balance, x: NDArray, omega: float, level: float) -> NDArray:
    """First Newton step (c, k) of small motions about a state, with slopes for soft hinges."""
    equation, fourier = balance.equation, balance.fourier
    still, little = (
        balance.residual(x, omega, balance.instants(share * level)) for share in (0.0, LITTLE)
    )
    residual = still + (little - still) / LITTLE
    u = equation.basis @ x[0] + equation.offset
    tangent = equation.projected(equation.body.tangent(u, FLOOR))
    w = omega / balance.multiple
    amplitudes = fourier.complex_of(residual)
    for j in range(len(amplitudes)):
        matrix = tangent - (j * w) ** 2 * equation.mass + 1j * j * w * equation.damping
        amplitudes[j] = np.linalg.lstsq(matrix, -amplitudes[j], rcond=None)[0]
    return fourier.real_of(amplitudes)


def _of_result(balance: Balance, guess: xr.Dataset, level: float) -> NDArray:
    """Coefficients (c, k) of a motion from an earlier result."""
    found = guess.variables.get("coefficient")
    n = len(balance.equation.case.structure.nodes)
    if found is None or found.dims != ("harmonic", "node", "axis") or found.shape[1:] != (n, 3):
        raise InputError(
            f": must be {PLACES} of this case (of a curve one point, as curve.isel(point=3))",
            "guess",
        )
    given, longer = np.asarray(found), balance.multiple
    if not np.isfinite(given).all():
        raise InputError(": its coefficients must be finite", "guess")
    own = int(guess.get("periods", 1))
    if own != longer:  # the same motion in a longer period
        if longer % own:
            raise InputError(
                f": its period is {own} of the drive; give periods = {own}, or a multiple", "guess"
            )
        spread = np.zeros(((len(given) - 1) * (longer // own) + 1, n, 3), complex)
        spread[:: longer // own] = given
        given = spread
    phase = balance.fourier.phase
    at = balance.instants(level)
    return balance.fourier.fit @ balance.equation.unknowns(values_of(given, phase), at)


def balanced(
    balance: Balance, x: NDArray, omega: float, tolerance: float, level: float = 1.0
) -> Converged:
    """The motion near coefficients (c, k), or the one that grows with the drive from rest.

    Raises
    ------
    ComputationError
        Neither is found.
    """
    found = newton(AtFrequency(balance, omega, level), x.ravel(), tolerance)
    return _grown(balance, x, omega, tolerance, level) if found is None else found


def _grown(balance: Balance, x: NDArray, omega: float, tolerance: float, level: float) -> Converged:
    """Follow the motion from a small drive to the full one, around folds."""
    family = ByLevel(balance, level, tolerance, omega / TURN)
    still = np.zeros(balance.shape)
    still[0] = x[0]
    begin = (still + SMALL * (x - still)).ravel()
    first, share = newton(AtFrequency(balance, omega, SMALL * level), begin, tolerance), 0.0
    if first is not None:
        spent, ahead = first.iterations, np.append(np.zeros(x.size), 1.0)
        top = point_at(family, first.x, SMALL * level, ahead)  # point of the largest drive
        for step in steps(family, top, GROWING, lambda point: point.p / level - 1.0):
            if not isinstance(step, Step) or step.after.p < 0.0:
                break
            spent += step.after.iterations
            top = max(top, step.after, key=lambda point: point.p)
        found, share = newton(AtFrequency(balance, omega, level), top.z, tolerance), top.p / level
        if found is not None:
            return Converged(found.x, spent + found.iterations)
    raise ComputationError(
        f"frequency = {omega / TURN:g} Hz: no periodic motion is found; the search ends at "
        f"{share:.2g} of the drive. Remedies: another guess (a motion at a frequency nearby, or a "
        "State), fd.response_curve from a frequency off resonance, or more damping"
    )


def orbit_of(balance: Balance, x: NDArray, omega: float, level: float = 1.0) -> Orbit:
    """Orbit of coefficients (c k,)."""
    amplitudes = balance.fourier.complex_of(x.reshape(balance.shape))
    return Orbit(balance.equation, amplitudes, omega, balance.multiple, level)
