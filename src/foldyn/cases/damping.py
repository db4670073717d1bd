"""Kinds of damping, and their registry.

Viscous dampers between nodes are supports (`connectors`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, get_args

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, arguments
from foldyn.cases.decode import Part
from foldyn.cases.selection import Creases, resolve_creases
from foldyn.errors import InputError, within
from foldyn.json_schema import Schema, any_of
from foldyn.structures.discretized import Discretized
from foldyn.tables import ListOf, Section, read, schema_of
from foldyn.values import choice, number, number_or_list, numbers, show, whole

STATES = ("rest", "initial")


@dataclass(frozen=True)
class Rayleigh(Part):
    """Damping matrix C = alpha M + beta K0, with K0 the tangent stiffness in a given state.

    A motion of angular frequency w has the damping ratio alpha / (2 w) + beta w / 2. As K0 is
    constant, beta also resists rigid rotations: take `StrainDamping` for large rotations.

    Parameters
    ----------
    alpha : float
        Mass-proportional coefficient (1/s), at least 0.
    beta : float
        Stiffness-proportional coefficient (s), at least 0.
    state : {"rest", "initial"}
        State in which K0 is computed: at rest, or where a motion starts (for modes and frequency
        responses: the state about which the structure vibrates).
    """

    alpha: Annotated[float, Check(number, least=0.0, unit="1/s")] = 0.0
    beta: Annotated[float, Check(number, least=0.0, unit="s")] = 0.0
    state: Annotated[str, Check(choice, known=STATES)] = "rest"

    key: ClassVar[str] = ""
    several: ClassVar[bool] = False

    @classmethod
    def from_ratios(
        cls, f1: float, z1: float, *, f2: float, z2: float, state: str = "rest"
    ) -> Rayleigh:
        """Damping that has the ratios z1 and z2 at the frequencies f1 and f2.

        Solves z = alpha / (4 pi f) + beta pi f for alpha and beta. Between the two frequencies the
        damping ratio is lower, outside this range higher.

        Parameters
        ----------
        f1, f2 : float
            Frequencies (Hz), positive and different.
        z1, z2 : float
            Damping ratios at f1 and f2, at least 0 (0.02 is 2 %).
        state : {"rest", "initial"}
            See `Rayleigh`.

        Raises
        ------
        InputError
            No alpha and beta of at least 0 give these ratios.

        Examples
        --------
        >>> import foldyn as fd
        >>> damping = fd.Rayleigh.from_ratios(9.3, 0.135, f2=16.7, z2=0.09)
        >>> print(f"{damping.alpha:.1f} 1/s, {damping.beta:.1e} s")
        14.4 1/s, 4.1e-04 s
        """
        f1, f2 = number("f1", f1, above=0.0), number("f2", f2, above=0.0)
        z1, z2 = number("z1", z1, least=0.0), number("z2", z2, least=0.0)
        if f1 == f2:
            raise InputError(f" = {f2:g}: must differ from f1", "f2")
        lower, upper = sorted((z1 * f1 / f2, z1 * f2 / f1))
        slack = 1e-12 * upper  # rounding if alpha or beta is 0
        if not lower - slack <= z2 <= upper + slack:
            ends = ("alpha", "beta") if f1 < f2 else ("beta", "alpha")
            raise InputError(
                f" = {z2:g}: with a ratio of {z1:g} at {f1:g} Hz, the ratio at {f2:g} Hz must lie "
                f"between {lower:.3g} ({ends[0]} alone) and {upper:.3g} ({ends[1]} alone)",
                "z2",
            )
        apart = f2**2 - f1**2
        alpha = 4.0 * math.pi * f1 * f2 * (z1 * f2 - z2 * f1) / apart
        beta = (z2 * f2 - z1 * f1) / (math.pi * apart)
        return cls(max(alpha, 0.0), max(beta, 0.0), state)

    def matrix(self, mass: Any, stiffness: Any) -> Any:
        """C from M (kg) and K0 (N/m)."""
        damping = mass * self.alpha
        return damping if self.beta == 0.0 else damping + self.beta * stiffness

    def rate(self, omega: Any) -> Any:
        """Damping (1/s) of a mode with angular frequency omega (rad/s) and modal mass 1 kg m2."""
        return self.alpha + self.beta * omega**2


@dataclass(frozen=True)
class ModalDamping(Part):
    """Damping ratios of the lowest modes, C = M Phi diag(2 zeta omega) Phi' M, phi' M phi = 1.

    Small motions in the listed modes have these ratios; other modes are undamped. The matrix is
    constant (E. L. Wilson and J. Penzien, Int. J. Numer. Methods Eng. 4, 1972; R. W. Clough and J.
    Penzien, Dynamics of Structures, 2nd ed. 1993, section 12-3). It damps only deformation: if
    supports move, it damps the motion relative to the quasi-static motion. Rigid motions and modes
    without stiffness are neither counted nor damped. Modes of equal frequency all get the mean of
    their ratios, as their shapes are not unique.

    Parameters
    ----------
    ratios : float or sequence of float
        Damping ratio (0.02 is 2 %, at least 0) of `count` modes, or one for each mode from the
        lowest on.
    count : int, optional
        Number of lowest modes that have the ratio, if `ratios` is a single number; all by default.
    state : {"rest", "initial"}
        State whose modes are damped: rest, or the initial state of a motion (for modes and
        frequency responses: the state about which the structure vibrates).
    """

    ratios: Annotated[float | Sequence[float], Check(number_or_list, what="mode", least=0.0)]
    count: Annotated[int | None, Check(whole, least=1, what="modes")] = None
    state: Annotated[str, Check(choice, known=STATES)] = "rest"

    key: ClassVar[str] = "modal"
    several: ClassVar[bool] = False

    def agree(self) -> None:
        """Refuse a count together with a ratio for each mode."""
        if self.count is not None and isinstance(self.ratios, tuple):
            raise InputError(
                f" = {self.count}: there are {len(self.ratios)} ratios, one for each mode; leave "
                "count out, or give one ratio",
                "count",
            )

    @property
    def modes(self) -> int | None:
        """Number of damped modes; None for all."""
        return len(self.ratios) if isinstance(self.ratios, tuple) else self.count


@dataclass(frozen=True)
class CreaseDamping(Part):
    """A moment M = c L d theta / dt against the folding of each crease.

    As theta is the current dihedral, this is exact for any motion; rigid motions dissipate nothing.
    If several crease dampings act on one crease, their coefficients add up.

    Parameters
    ----------
    coefficient : float
        Damping c of a crease, N m s/rad per m of its length L at rest, at least 0.
    creases : int, sequence of int, or str
        Numbers in the order of `pattern.creases`, or a name: "mountain", "valley", "all" (all
        except flat creases), or a family of the pattern (`Pattern.families`), such as "zigzag".
    """

    coefficient: Annotated[float, Check(number, least=0.0, unit="N m s/rad per m")]
    creases: Creases = "all"

    key: ClassVar[str] = "creases"
    several: ClassVar[bool] = True

    def per_length(self, structure: Discretized, place: str) -> NDArray[np.float64]:
        """Coefficients (nf,) of all folds, N m s/rad per m."""
        damped = np.zeros(len(structure.folds))
        damped[resolve_creases(structure, self.creases, f"{place}.creases")] = self.coefficient
        return damped


@dataclass(frozen=True)
class StrainDamping(Part):
    """Damping of the rates at which bars stretch and hinges turn: beta times their stiffness.

    A Kelvin-Voigt material: the force of a bar or hinge depends on its elongation or turn plus beta
    times the rate of this, and acts along the current direction. In panels with membranes the rates
    of bars are coupled like their strains. The damping is exact for motions of any size, and rigid
    rotations dissipate nothing. For small motions about rest it equals beta K0 (see `Rayleigh`): a
    vibration of angular frequency w has the damping ratio beta w / 2. For hinges the slope of their
    law at rest is used. Springs are not damped; use dashpots for this.

    Parameters
    ----------
    beta : float
        Coefficient (s), at least 0.
    """

    beta: Annotated[float, Check(number, least=0.0, unit="s")]

    key: ClassVar[str] = "strain"
    several: ClassVar[bool] = False


Damping = Rayleigh | ModalDamping | CreaseDamping | StrainDamping
DAMPINGS: tuple[type[Damping], ...] = get_args(Damping)
"""All kinds. `key` is a kind's key in the table of damping; a kind without it is the table."""


def dampings(given: Any) -> Damping | tuple[Damping, ...]:
    """Return one damping as it is, several as a tuple, and zero Rayleigh damping for none.

    Raises
    ------
    InputError
        `given` is something else, or has two of a kind that may occur only once.
    """
    parts = tuple(given) if isinstance(given, list | tuple) else (given,)
    names = " or ".join(f"{kind.__name__}(...)" for kind in DAMPINGS)
    for part in parts:
        if not isinstance(part, DAMPINGS):
            raise InputError(f"damping = {show(part)}: must be {names}, or a list of them")
    for kind in DAMPINGS:
        if not kind.several and sum(isinstance(part, kind) for part in parts) > 1:
            raise InputError(f"damping: give one {kind.__name__}, not several")
    if len(parts) > 1:
        return parts
    return parts[0] if parts else Rayleigh()


def damping_table(parts: Sequence[Damping]) -> dict[str, Any]:
    """Table of dampings with plain values."""
    table: dict[str, Any] = {}
    for part in parts:
        if not part.key:
            table |= part.table()
        elif part.several:
            table.setdefault(part.key, []).append(part.table())
        else:
            table[part.key] = part.table()
    return table


class _DampingsOf(Check):
    """Dampings of one kind, from a table, a list of tables, or just the value of the first key."""

    def __init__(self, kind: type[Damping]) -> None:
        super().__init__(self._listed)
        self.kind, self.first = kind, next(iter(kind.by_key()))

    def schema(self, hint: Any, definitions: dict[str, Schema]) -> Schema:
        """See `Check`."""
        table = schema_of(self.kind, definitions)
        several = [{"type": "array", "items": table}] if self.kind.several else []
        return any_of([arguments(self.kind)[self.first].schema(definitions), table, *several])

    def _listed(self, name: str, value: Any) -> Sequence[Damping]:
        several = self.kind.several and isinstance(value, list) and value
        if several and isinstance(value[0], Mapping):
            return ListOf(Check(self._one))(name, value)
        return [self._one(name, value)]

    def _one(self, name: str, value: Any) -> Damping:
        if isinstance(value, Mapping):
            return read(self.kind, name, value)
        try:
            return read(self.kind, name, {self.first: value})
        except InputError as error:  # the field is the value, not a table
            raise InputError(error.reason, error.field.replace(f".{self.first}", "", 1)) from None


def _ratios(name: str, value: Any) -> list[list[float]]:
    array = numbers(name, value)
    if array.shape != (2, 2):
        raise InputError(
            f" = {show(value)}: must be two pairs of a frequency (Hz) and the damping ratio there, "
            "as in [[9.3, 0.135], [16.7, 0.09]]",
            name,
        )
    return array.tolist()


class DampingSection(Rayleigh, Section):
    """[damping]: Rayleigh coefficients, or two damping ratios; modes, creases, strain rates.

    Parameters
    ----------
    ratios : sequence of (float, float)
        Instead of alpha and beta: two pairs of a frequency (Hz) and the damping ratio at it.
    modal : float, sequence of float, or table
        Damping ratios of the lowest modes; see `ModalDamping`.
    creases : float, table, or list of tables
        Damping of creases (N m s/rad per m); see `CreaseDamping`.
    strain : float
        Like beta (s), but for motions of any size; see `StrainDamping`.
    """

    ratios: Annotated[Sequence[Sequence[float]] | None, Check(_ratios)] = None
    modal: Annotated[Sequence[Damping], _DampingsOf(ModalDamping)] = ()
    creases: Annotated[Sequence[Damping], _DampingsOf(CreaseDamping)] = ()
    strain: Annotated[Sequence[Damping], _DampingsOf(StrainDamping)] = ()

    def agree(self) -> None:
        """Refuse coefficients together with ratios."""
        if self.ratios is not None and self.stated & {"alpha", "beta"}:
            raise InputError(
                f" = {show(self.ratios)}: they give alpha and beta; leave those out, or ratios",
                "ratios",
            )

    def made(self) -> Damping | tuple[Damping, ...]:
        """The damping that the table describes."""
        others = [*self.modal, *self.creases, *self.strain]
        if others and not self.stated & {"alpha", "beta", "ratios"}:
            return dampings(others)
        return dampings([self._rayleigh(), *others])

    def _rayleigh(self) -> Rayleigh:
        if self.ratios is None:
            return Rayleigh(self.alpha, self.beta, self.state)
        (f1, z1), (f2, z2) = self.ratios
        with within(f".ratios = {show(self.ratios)}: "):
            return Rayleigh.from_ratios(f1, z1, f2=f2, z2=z2, state=self.state)
