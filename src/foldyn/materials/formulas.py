"""Declarations of laws for kernels: compiled formulas, selected by a law's code.

The file of a law declares all its formulas in one place; a missing one is an error on import.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from foldyn.jit.switches import Branch, arguments_of

MOVING = 3  # number of parameters on which a moment may depend, as gradients have no more


@dataclass(frozen=True)
class BarFormulas:
    """Formulas of a bar law in e = stretch - 1, per unit Young's modulus, compiled as `scalar`.

    Parameters
    ----------
    code : int
        A number that no other bar law has.
    energy, stress, slope : compiled functions
        W, its derivative S with respect to the Green strain E, and dS/dE.
    """

    code: int
    energy: Any
    stress: Any
    slope: Any


@dataclass(frozen=True)
class HingeFormulas:
    """Formulas of a hinge law per unit stiffness, compiled as `scalar`.

    Each formula takes `turn`, the dihedral minus the rest angle, or `theta` and `rest`. Further
    arguments, under any names, are as many of the four `HingeLaw.parameters` as it needs.

    Parameters
    ----------
    code : int
        A number that no other hinge law has.
    energy, moment, slope : compiled functions
        Energy and its first and second derivatives with respect to the dihedral.
    by_parameters : compiled function, optional
        Derivatives of the moment with respect to each parameter that it takes, three at most, as a
        tuple; needed if it takes any.
    energy_by_rest, moment_by_rest : compiled functions, optional
        Derivatives with respect to the rest angle. Not needed if all formulas take the turn, as
        they are then minus the derivatives with respect to the dihedral.
    follow : compiled function, optional
        Function of (rest, parameters) that sets the parameters of a hinge that depend on the rest
        angle; needed if there are any.
    """

    code: int
    energy: Any
    moment: Any
    slope: Any
    by_parameters: Any = None
    energy_by_rest: Any = None
    moment_by_rest: Any = None
    follow: Any = None

    def __post_init__(self) -> None:
        """Refuse incomplete formulas, for which kernels would return nan."""
        by_rest = self.energy_by_rest, self.moment_by_rest
        lacks = []
        if not all(map(of_turn, (self.energy, self.moment, self.slope))) and None in by_rest:
            lacks.append("energy_by_rest and moment_by_rest, as a formula takes theta and rest")
        if (count := parameters_of(self.moment)) and self.by_parameters is None:
            lacks.append("by_parameters, the derivatives of the moment by its parameters")
        if lacks:
            raise TypeError(f"{self.energy.__module__}: the law lacks {', and '.join(lacks)}")
        if count > MOVING:
            raise TypeError(
                f"{self.energy.__module__}: the moment takes {count} parameters; {MOVING} at most"
            )

    def value(self, name: str) -> Branch:
        """Branch of the switch that returns the formula `name`."""
        return _call(0, formula := getattr(self, name)), (formula,)

    def energy_slope(self) -> Branch:
        """Branch that returns the derivative of the energy with respect to the rest angle."""
        return _by_rest(self.energy_by_rest, self.moment)

    def moment_slopes(self) -> Branch:
        """Branch for derivatives of the moment with respect to rest angle and three parameters."""
        by_rest, functions = _by_rest(self.moment_by_rest, self.slope)
        slopes, others = f"({by_rest},)", MOVING - parameters_of(self.moment)
        if self.by_parameters is not None:
            slopes += f" + {_call(1, self.by_parameters)}"
            functions += (self.by_parameters,)
        return slopes + (f" + ({'0.0, ' * others})" if others else ""), functions


@dataclass(frozen=True)
class BranchFormulas:
    """Formulas of a branch of a law with memory, per unit stiffness, compiled as `scalar`.

    Both functions take `p, before, after, dt, one, other`: the (4,) parameters of the branch; the
    turn from rest at the last accepted step and now, rad; the time between, s; and the two numbers
    of the state at that step. Without a turn and without time, the state keeps its bits.

    Parameters
    ----------
    code : int
        A number that no other branch has.
    update : compiled function
        State (two numbers), moment, its derivative with respect to `after`, energy and loss.
    mean_moment : compiled function
        Mean moment in the step, its derivative with respect to `after`, and a deficit: the work
        along the turn is the change of energy plus the loss of `update` minus this deficit. None
        for branches that only occur in explicit motions.
    """

    code: int
    update: Any
    mean_moment: Any


def of_turn(formula: Any) -> bool:
    """Whether a formula of a hinge law takes the turn from rest rather than both angles."""
    return arguments_of(formula)[0] == "turn"


def parameters_of(formula: Any) -> int:
    """Number of parameters that a formula of a hinge law takes."""
    return len(arguments_of(formula)) - (1 if of_turn(formula) else 2)


def _call(place: int, formula: Any) -> str:
    angles = ["theta - rest"] if of_turn(formula) else ["theta", "rest"]
    return f"{{{place}}}({', '.join([*angles, *'abcd'[: parameters_of(formula)]])})"


def _by_rest(own: Any, by_angle: Any) -> Branch:
    return (f"-{_call(0, by_angle)}", (by_angle,)) if own is None else (_call(0, own), (own,))
