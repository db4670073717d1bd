"""Laws that the user defines by plain scalar Python functions.

Built-in laws are compiled once and kept on disk. A user's law is compiled anew in every process (in
a fraction of a second) and called by its address. A result computed with it records that it cannot
be run again from its file alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, cast

from numba.core.errors import NumbaError

from foldyn.errors import InputError
from foldyn.jit.compiled import callback
from foldyn.materials.law import BarLaw, HingeLaw, Law


class _Called(Law):
    """A law whose first three fields are functions; each takes the numbers of a state."""

    @cached_property
    def _functions(self) -> list[Any]:
        return [self._compiled(item.name) for item in fields(cast(Any, self))[:3]]

    def _compiled(self, function: str) -> Any:
        signature = f"float64({', '.join(['float64'] * len(self.rest_state))})"
        try:
            return callback(signature, getattr(self, function))
        except (NumbaError, TypeError, AttributeError) as error:
            raise InputError(
                f"law {self.name!r}: {function} cannot be compiled by Numba; write it as a Python "
                f"function {signature.replace('float64', 'float')} with plain arithmetic and the "
                f"math module. Numba says: {str(error).strip().splitlines()[-1]}"
            ) from error

    @property
    def addresses(self) -> tuple[int, int, int]:
        """Addresses of the compiled functions; valid as long as this object lives."""
        energy, response, slope = self._functions
        return energy.address, response.address, slope.address


@dataclass(frozen=True, eq=False)
class CustomBarLaw(_Called, BarLaw):
    """A user's bar law.

    Parameters
    ----------
    energy_of, stress_of, slope_of : callable
        Scalar functions of the stretch: W / E_y, S / E_y (second Piola-Kirchhoff stress) and
        (dS/dE) / E_y, with dW/dE = S and E the Green strain.
    name : str
        Name of the law in figures and results.
    """

    energy_of: Callable[[float], float]
    stress_of: Callable[[float], float]
    slope_of: Callable[[float], float]
    name: str = "custom"


@dataclass(frozen=True, eq=False)
class CustomHingeLaw(_Called, HingeLaw):
    """A user's moment law.

    Parameters
    ----------
    energy_of, moment_of, slope_of : callable
        Scalar functions of (theta, rest) in radians, per unit stiffness. The moment is the first
        derivative of the energy with respect to theta, and the slope the second.
    name : str
        Name of the law in figures and results.

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
