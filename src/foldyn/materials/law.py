"""Base classes of scalar laws for bars and hinges.

A bar law is per unit Young's modulus and a hinge law per unit stiffness, so the same law object
serves every element of a structure. Compiled kernels never see these objects. They get `code`, an
integer that selects the law in one compiled switch (`switch.py`), and for hinges four parameters
per element.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Checked
from foldyn.errors import InputError

PARAMETERS = 4
ANGLES = 722  # number of dihedrals at which the least slope of a law is sought
CALLED = -1  # code of laws whose functions are called at their addresses


class Law(Checked):
    """A scalar law with a name and the integer code of its compiled form."""

    name: str
    code: int = CALLED
    formulas: ClassVar[tuple[Any, ...]] = ()
    """`BarFormulas` or `HingeFormulas` for each code of the law; `code` is that of the first."""
    rest_state: tuple[float, ...]
    compiled: ClassVar[Callable[..., NDArray]]
    """Function that returns a table of functions of a law for its code, one per row; set by the
    registry."""
    known: ClassVar[Mapping[int, Any]]
    """Formulas that the switch knows, by code; set by the registry."""

    def __init_subclass__(cls, **options: Any) -> None:
        """Begin messages with the name of the class, and take the code from its formulas."""
        super().__init_subclass__(**options)
        cls.place = f"{cls.__name__}: "
        if "formulas" in vars(cls) and isinstance(cls.code, int):
            cls.code = cls.formulas[0].code

    @property
    def addresses(self) -> tuple[int, int, int] | None:
        """Addresses of a user law's compiled energy, response and slope; None for other laws."""
        return None

    def check(self, field: str) -> None:
        """Refuse a law whose formulas are not in the switch under its code."""
        if type(self).addresses is not Law.addresses:  # reading would compile functions
            return
        if self.known.get(self.code) not in self.formulas:
            raise InputError(
                f": {self.name!r}, code {self.code}, is not a law that the kernels know; give a "
                "CustomBarLaw or CustomHingeLaw (a new built-in law declares its formulas, and "
                "has its place in materials/switch.py)",
                field,
            )


class BarLaw(Law):
    """Axial law of a bar in terms of the stretch lambda = l / L, per unit Young's modulus."""

    rest_state = (1.0,)

    def energy(self, stretch: ArrayLike) -> NDArray:
        """Energy density W / E_y at each stretch."""
        return self._table(stretch)[0]

    def stress(self, stretch: ArrayLike) -> NDArray:
        """Second Piola-Kirchhoff stress S / E_y at each stretch."""
        return self._table(stretch)[1]

    def slope(self, stretch: ArrayLike) -> NDArray:
        """Slope (dS/dE) / E_y at each stretch, with E = (lambda^2 - 1)/2 the Green strain."""
        return self._table(stretch)[2]

    def _table(self, stretch: ArrayLike) -> NDArray:
        lam = np.asarray(stretch, float)
        address = np.array(self.addresses or (0, 0, 0), np.int64)
        return self.compiled(self.code, lam.ravel() - 1.0, address).reshape((3, *lam.shape))


class HingeLaw(Law):
    """Moment law of a hinge in terms of its dihedral (rad), per unit stiffness."""

    rest_state = (math.pi, math.pi)
    elastic: Any = property(lambda self: self)
    """The law without its memory."""
    linear_between: tuple[float, float] | None = None
    """Dihedrals (rad) between which the moment is k (theta - rest); None if nowhere."""
    follows_rest: bool = True
    """Whether the parameters of the formulas depend on the rest angle."""
    closed_at_rest: bool = True
    """Whether a hinge can be closed at rest, with a dihedral of 0 or 2 pi."""
    slopes: ClassVar[Callable[..., NDArray]]
    """Function that returns the slopes alone, which superelements need; see `compiled`."""

    def check(self, field: str) -> None:
        """Refuse unknown laws, and parameters that do not follow the rest angle they depend on."""
        super().check(field)
        one, other = self.parameters(np.array([math.pi, 0.5 * math.pi]))
        if (one != other).any() and self.known[self.code].follow is None:
            raise InputError(
                f": parameters of {self.name!r} depend on the rest angle, but its formulas have "
                "no `follow`, which sets them as it turns",
                field,
            )

    @property
    def parts(self) -> tuple[tuple[HingeLaw, Any], ...]:
        """Laws of the hinges of a structure, each with the rows of its hinges."""
        return ((self, slice(None)),)

    def at(self, rows: Any) -> HingeLaw:
        """Law of some of the hinges."""
        return self

    def each(self, of: Callable[[HingeLaw, Any], NDArray]) -> NDArray:
        """Array (..., n) of the hinges, put together from those of all `parts`."""
        return of(self, slice(None))

    def parameters(self, rest: NDArray) -> NDArray:
        """Parameters of the formulas (n, 4) for hinges with rest angles (n,)."""
        return np.zeros((len(rest), PARAMETERS))

    def reach(self, theta: NDArray, rest: NDArray, parameters: NDArray) -> NDArray:
        """Distance (rad) from each dihedral (n,) to the nearest kink or pole; inf if smooth."""
        return np.full(len(theta), np.inf)

    def least_slope(self, rest: NDArray, stiffness: NDArray, length: NDArray) -> NDArray:
        """Least slope / k (n,), at least 0, that the moments of hinges can have at any dihedral.

        rest, stiffness, length : of n hinges: rad, N m/rad and m.
        """
        least = self.slope(rest, rest)
        for theta in np.linspace(0.0, 2.0 * math.pi, ANGLES)[1:-1]:
            least = np.fmin(least, self.slope(theta, rest))
        return np.maximum(least, 0.0)

    def energy(self, theta: ArrayLike, rest: ArrayLike) -> NDArray:
        """Energy / k (rad^2) at dihedral `theta` with rest dihedral `rest` (rad)."""
        return self._table(theta, rest)[0]

    def moment(self, theta: ArrayLike, rest: ArrayLike) -> NDArray:
        """Moment / k (rad), positive if it resists opening (theta above rest)."""
        return self._table(theta, rest)[1]

    def slope(self, theta: ArrayLike, rest: ArrayLike) -> NDArray:
        """Slope of the moment / k at dihedral `theta`."""
        return self._rows(self.slopes, theta, rest)[0]

    def _table(self, theta: ArrayLike, rest: ArrayLike) -> NDArray:
        return self._rows(self.compiled, theta, rest)

    def _rows(self, compiled: Callable[..., NDArray], theta: ArrayLike, rest: ArrayLike) -> NDArray:
        # copies: read-only arrays would compile the table again
        both = np.broadcast_arrays(theta, rest)
        theta, rest = (np.array(each, float, order="C") for each in both)
        address = np.array(self.addresses or (0, 0, 0), np.int64)
        parameters = np.ascontiguousarray(self.parameters(rest.ravel()))
        flat = compiled(self.code, theta.ravel(), rest.ravel(), parameters, address)
        return flat.reshape((len(flat), *theta.shape))


def columns(rows: int, *values: ArrayLike) -> NDArray:
    """Parameters (n, 4) of hinges from the first columns; the other columns are zero."""
    table = np.zeros((rows, PARAMETERS))
    for column, value in enumerate(values):
        table[:, column] = value
    return table
