"""Histories inside compiled loops: formulas of built-in histories, calls of users' functions.

`History.factor` and the integrators both evaluate a formula here: the factor and its first and
second derivative in time, which imposed motions need.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.histories import HISTORIES, TABLE
from foldyn.cases.history import CALLED, History
from foldyn.errors import InputError
from foldyn.jit.compiled import inner, kernel
from foldyn.jit.intrinsics import call1
from foldyn.jit.switches import arguments_of, by_code, switch

PARAMETERS = 4
GAUSS_POINTS, GAUSS_WEIGHTS = (0.5 * x for x in np.polynomial.legendre.leggauss(8))
GAUSS_POINTS += 0.5  # points in the interval from 0 to 1


class Waveforms(NamedTuple):
    """h histories as arrays; tables are cubic polynomials between k knots."""

    code: NDArray  # (h,)
    parameters: NDArray  # (h, 4)
    first: NDArray  # (h + 1,) first knot of each history
    knot: NDArray  # (k,) times, s
    cubic: NDArray  # (k, 4) coefficients of (t - knot)^3, ^2, ^1, ^0 after each knot
    address: NDArray  # (h,) addresses of user's functions
    span: float  # distance (s) of points for differences of user's functions


class Callbacks:
    """User functions of time made callable from compiled code.

    An exception cannot pass through compiled code: the first one is kept in `error`, and the factor
    becomes nan, which integrators notice. The object must live as long as its addresses are used.
    """

    def __init__(self) -> None:
        self.error: BaseException | None = None
        self._kept: list[Any] = []

    def address(self, function: Callable[[float], float]) -> int:
        """Address of a compiled function float64(float64) that calls `function`."""

        def guarded(time: float) -> float:
            if self.error is not None:
                return math.nan
            try:
                return float(function(time))
            except BaseException as error:
                self.error = error
                return math.nan

        entry = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(guarded)
        self._kept.append(entry)
        return ctypes.cast(entry, ctypes.c_void_p).value or 0


def pack(histories: Sequence[Any], callbacks: Callbacks, span: float = 0.0) -> Waveforms:
    """Histories as arrays for compiled code.

    A history has `code` and `parameters()`, a table also `polynomials()`. A history whose code is
    `CALLED` is called through `callbacks`. `span` (s) is short compared with the variations of
    histories.
    """
    parameters = np.zeros((len(histories), PARAMETERS))
    knots, cubics = [np.zeros(0)], [np.zeros((0, 4))]
    for row, history in enumerate(histories):
        given = history.parameters()
        if history.code != CALLED and FORMULAS.get(history.code) not in history.formulas:
            raise InputError(
                f"history {history.kind}: its formula is not one that kernels know; give "
                "fd.Function (a new built-in history has its place in cases/histories.py)"
            )
        parameters[row, : len(given)] = given
        knot, cubic = history.polynomials()
        knots.append(knot)
        cubics.append(cubic)
    return Waveforms(
        code=np.array([history.code for history in histories], np.int64),
        parameters=parameters,
        first=np.cumsum([0, *map(len, knots[1:])]).astype(np.int64),
        knot=np.concatenate(knots),
        cubic=np.ascontiguousarray(np.concatenate(cubics)),
        address=np.array(
            [callbacks.address(h) if h.code == CALLED else 0 for h in histories], np.int64
        ),
        span=float(span),
    )


FORMULAS = by_code({kind: one.formulas for kind, one in HISTORIES.items()})
formula_at = switch(
    __name__, "formula_at", "code, t, a, b, c, d",
    {
        code: (f"{{0}}({', '.join('tabcd'[: len(arguments_of(one.formula))])})", (one.formula,))
        for code, one in FORMULAS.items() if one.formula is not None
    },
    ("nan, nan, nan", ()),
)  # fmt: skip


@inner
def waveform(w, row, t, derive):
    """Factor of a history at time t and its two derivatives (per s and s2).

    derive : whether the derivatives are needed. If not, the derivatives of user's functions, which
        cost several calls, are 0.
    """
    code, p = w.code[row], w.parameters[row]
    if code == CALLED:
        return _called(w.address[row], t, w.span, derive)
    if code == TABLE:
        return _tabulated(w, row, t)
    return formula_at(code, t, p[0], p[1], p[2], p[3])


@inner
def _tabulated(w, row, t):
    """Piecewise polynomial; before and after it, its first and last value."""
    low, high = w.first[row], w.first[row + 1] - 1
    if t < w.knot[low]:
        return w.cubic[low, 3], 0.0, 0.0
    while high - low > 1:  # after the last knot the cubic is a constant
        middle = (low + high) // 2
        low, high = (middle, high) if t >= w.knot[middle] else (low, middle)
    if t >= w.knot[high]:
        low = high
    x, p = t - w.knot[low], w.cubic[low]
    return (
        ((p[0] * x + p[1]) * x + p[2]) * x + p[3],
        (3.0 * p[0] * x + 2.0 * p[1]) * x + p[2],
        6.0 * p[0] * x + 2.0 * p[1],
    )


@kernel
def _called(address, t, h, derive):
    """A user's function and its derivatives by differences of the fourth order.

    For t < 2h all points are at later times, as a function need not be defined before 0.
    """
    f = call1(address, t)
    if not derive:
        return f, 0.0, 0.0
    if t >= 2.0 * h:
        a, b = call1(address, t - 2.0 * h), call1(address, t - h)
        c, d = call1(address, t + h), call1(address, t + 2.0 * h)
        rate = (a - 8.0 * b + 8.0 * c - d) / (12.0 * h)
        return f, rate, (16.0 * (b + c) - a - d - 30.0 * f) / (12.0 * h * h)
    a, b = call1(address, t + h), call1(address, t + 2.0 * h)
    c, d = call1(address, t + 3.0 * h), call1(address, t + 4.0 * h)
    rate = (48.0 * a - 25.0 * f - 36.0 * b + 16.0 * c - 3.0 * d) / (12.0 * h)
    e = call1(address, t + 5.0 * h)
    second = (45.0 * f - 154.0 * a + 214.0 * b - 156.0 * c + 61.0 * d - 10.0 * e) / (12.0 * h * h)
    return f, rate, second


@kernel
def evaluate(w, t, derive, out):
    """Factors of all histories and their derivatives (h, 3) at one time; see `waveform`."""
    for row in range(out.shape[0]):
        out[row, 0], out[row, 1], out[row, 2] = waveform(w, row, t, derive)


@kernel
def waveform_table(w, row, times):
    """Factors of a history and their derivatives (3, n) at times (n,)."""
    out = np.empty((3, times.size))
    for i in range(times.size):
        out[0, i], out[1, i], out[2, i] = waveform(w, row, times[i], True)
    return out


@kernel
def unseen(w, first, last, before, after, out):
    """Mean distance (h,) of histories from straight lines between their values at two times.

    before, after : factors (h, 3) at the times `first` and `last`. The distance is the error of a
        step that uses the average of the load at both ends.
    """
    for row in range(out.size):
        rate = (after[row, 0] - before[row, 0]) / (last - first)
        total, low, knot = 0.0, first, w.first[row]
        while knot < w.first[row + 1] and w.knot[knot] <= first:
            knot += 1
        while low < last:
            high = last
            if knot < w.first[row + 1] and w.knot[knot] < last:
                high = w.knot[knot]
                knot += 1
            for k in range(GAUSS_POINTS.size):
                t = low + (high - low) * GAUSS_POINTS[k]
                line = before[row, 0] + rate * (t - first)
                distance = abs(waveform(w, row, t, False)[0] - line)
                total += GAUSS_WEIGHTS[k] * (high - low) * distance
            low = high
        out[row] = total / (last - first)


def table(history: History, times: NDArray) -> NDArray:
    """Factors and derivatives (3, n) of one history at times (n,), s."""
    return waveform_table(pack([history], Callbacks()), 0, times)
