"""Bifurcations between two points of a family of forced motions: detected, located and named.

As the parameter changes, multipliers cross the unit circle at 1 (fold, or pitchfork if another
branch crosses), at -1 (period doubling) or in complex pairs (Neimark-Sacker): Kuznetsov, Elements
of Applied Bifurcation Theory, 3rd ed. 2004, chapters 4 and 5.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.periodic.continuation import Point, Step, located

FOLD, PITCHFORK = "fold", "pitchfork"
DOUBLING, TORUS = "period doubling", "Neimark-Sacker"
SURE = {FOLD: 1e-6, PITCHFORK: 1e-3, DOUBLING: 1e-3, TORUS: 1e-3}
"""How close to zero the test function of a bifurcation must come."""
REAL = 1e-9  # largest imaginary part of a real multiplier


class Event(NamedTuple):
    """A bifurcation and its location."""

    name: str
    point: Point


Found = NDArray[np.complex128]
Multipliers = Callable[[Point], Found]


def events(family: Any, step: Step, of: Multipliers) -> list[Event]:
    """Bifurcations within a step, in order along it.

    of : multipliers (2k,) of a point.
    """
    one, other = step.before, step.after
    found: list[tuple[str, Callable[[Point], float]]] = []
    if one.side != other.side:
        found.append((PITCHFORK, lambda point: point.side * _nearest(of(point), 1.0)))
    elif one.tangent[-1] * other.tangent[-1] < 0.0:
        found.append((FOLD, lambda point: float(point.tangent[-1])))
    if _parity(of(one)) != _parity(of(other)):
        found.append((DOUBLING, lambda point: _parity(of(point)) * _nearest(of(point), -1.0)))
    moduli = _moduli(of(one)), _moduli(of(other))
    counts = [int((pairs > 1.0).sum()) for pairs in moduli]
    # a pair that crosses has not met on the real axis: it exists at both ends
    if counts[0] != counts[1] and min(map(len, moduli)) >= max(counts):
        found.append((TORUS, lambda point: _modulus(_moduli(of(point)), max(counts)) - 1.0))
    events = []
    for name, value in found:
        point = located(family, one, other, step.length, value)
        if abs(value(point)) <= SURE[name]:  # pairs may meet on the real axis instead
            events.append((name, point))
    along = [_along(one, point) for _, point in events]
    return [Event(*events[k]) for k in np.argsort(along, kind="stable")]


def _along(one: Point, point: Point) -> float:
    return float(np.append(point.z - one.z, point.p - one.p) @ one.tangent)


def _nearest(found: Found, value: float) -> float:
    """Distance of the nearest real multiplier from a value; of any multiplier if none is real."""
    real = found[np.abs(found.imag) <= REAL].real
    return float(np.abs((real if len(real) else found) - value).min())


def _parity(found: Found) -> float:
    """Sign of det(monodromy + 1): -1 with an odd number of multipliers below -1."""
    real = found[np.abs(found.imag) <= REAL].real
    return -1.0 if np.count_nonzero(real < -1.0) % 2 else 1.0


def _moduli(found: Found) -> NDArray:
    """Moduli of the multipliers with a positive imaginary part, the largest first."""
    return -np.sort(-np.abs(found[found.imag > REAL]))


def _modulus(moduli: NDArray, place: int) -> float:
    """Modulus at a place, counted from 1; 0 if there are fewer."""
    return float(moduli[place - 1]) if len(moduli) >= place else 0.0
