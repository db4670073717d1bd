"""Laws of the user's own, given as plain scalar Python functions.

Built-in laws are compiled once and kept on disk. A user's law is compiled in every process anew
(a fraction of a second) and called by its address; a result computed with it says that it cannot
be run again from its file alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from numba.core.errors import NumbaError

from foldyn.errors import InputError
from foldyn.jit.compiled import callback
from foldyn.materials.law import BarLaw, HingeLaw


def _compile(law: str, function: str, signature: str, source: Callable[..., float]) -> Any:
    try:
        return callback(signature, source)
    except (NumbaError, TypeError, AttributeError) as error:
        raise InputError(
            f"law {law!r}: {function} cannot be compiled by Numba; write it as a Python function "
            f"{signature.replace('float64', 'float')} with plain arithmetic and the math module. "
            f"Numba says: {str(error).strip().splitlines()[-1]}"
        ) from error


@dataclass(frozen=True, eq=False)
class CustomBarLaw(BarLaw):
    """A user's bar law.

    Parameters
    ----------
    energy_of, stress_of, slope_of : callable
        Scalar functions of the stretch: W / E_y, S / E_y (second Piola-Kirchhoff) and
        (dS/dE) / E_y, with dW/dE = S and E the Green strain.
    name : str
        Shown in figures and results.
    """

    energy_of: Callable[[float], float]
    stress_of: Callable[[float], float]
    slope_of: Callable[[float], float]
    name: str = "custom"

    @cached_property
    def _functions(self) -> tuple[Any, Any, Any]:
        signature = "float64(float64)"
        return (
            _compile(self.name, "energy_of", signature, self.energy_of),
            _compile(self.name, "stress_of", signature, self.stress_of),
            _compile(self.name, "slope_of", signature, self.slope_of),
        )

    @property
    def addresses(self) -> tuple[int, int, int]:
        """Addresses of the compiled functions; valid as long as this object lives."""
        energy, stress, slope = self._functions
        return energy.address, stress.address, slope.address


@dataclass(frozen=True, eq=False)
class CustomHingeLaw(HingeLaw):
    """A user's moment law.

    Parameters
    ----------
    energy_of, moment_of, slope_of : callable
        Scalar functions of (theta, rest) in radians, per unit stiffness; the moment is the
        derivative of the energy with respect to theta, the slope that of the moment.
    name : str
        Shown in figures and results.

    Examples
    --------
    >>> cubic = CustomHingeLaw(
    ...     energy_of=lambda t, r: 0.25 * (t - r) ** 4,
    ...     moment_of=lambda t, r: (t - r) ** 3,
    ...     slope_of=lambda t, r: 3.0 * (t - r) ** 2,
    ...     name="cubic",
    ... )
    >>> float(cubic.moment(2.0, rest=1.0))
    1.0
    """

    energy_of: Callable[[float, float], float]
    moment_of: Callable[[float, float], float]
    slope_of: Callable[[float, float], float]
    name: str = "custom"

    @cached_property
    def _functions(self) -> tuple[Any, Any, Any]:
        signature = "float64(float64, float64)"
        return (
            _compile(self.name, "energy_of", signature, self.energy_of),
            _compile(self.name, "moment_of", signature, self.moment_of),
            _compile(self.name, "slope_of", signature, self.slope_of),
        )

    @property
    def addresses(self) -> tuple[int, int, int]:
        """Addresses of the compiled functions; valid as long as this object lives."""
        energy, moment, slope = self._functions
        return energy.address, moment.address, slope.address
