"""Results of cases that differ a little from one, each found from its result.

Differences of them are derivatives. A neighbor's equilibria, modes or responses follow by Newton's
steps with the factors of the matrix of the one result: no path is followed and no mode searched
for, so that each costs a few solutions. They go on until the steps are small: after the first one
bars are strained by what is of second order in the motion, and they are far stiffer than creases.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from xarray import Variable

from foldyn.algebra.superlu import PIVOT, factorize
from foldyn.cases import Case
from foldyn.errors import ComputationError, InputError
from foldyn.linear.excitation import absolute, drive_of, drive_terms
from foldyn.linear.frequency_domain import dynamic_stiffness
from foldyn.linear.linearized import Linearized, linearize
from foldyn.statics.equilibrium import OrigamiProblem

if TYPE_CHECKING:
    import xarray

GAINED = 1e-6  # of the first step: the size of the last one
ROUNDING = 1e-14  # of the whole: a step that is none
ENOUGH, STALLED = 1e-4, 1e-8  # of the first step, and of the whole: what rounding may leave
ROUNDS = 12
TURN = 2.0 * np.pi
NONE = "there is no neighbor of"


class Asked(NamedTuple):
    """A case, and the arguments of its analysis."""

    case: Case
    arguments: Mapping[str, Any]


def refined(x: NDArray, step_at: Callable[[NDArray], NDArray], size: float) -> NDArray:
    """Where Newton's steps with the matrix of a neighbor end.

    Parameters
    ----------
    x : ndarray
        Where they begin.
    step_at : callable
        The step from a place.
    size : float
        Of the whole, by which rounding is measured.

    Raises
    ------
    ComputationError
        They do not end: the neighbor is too far away.
    """
    sizes: list[float] = []
    for _ in range(ROUNDS):
        step = step_at(x)
        x = x + step
        sizes.append(float(np.linalg.norm(step)))
        if sizes[-1] <= max(GAINED * sizes[0], ROUNDING * size):
            return x
        if len(sizes) > 2 and not sizes[-1] <= 0.5 * sizes[-3]:  # even and odd ones differ
            break
    if sizes[-1] <= max(ENOUGH * sizes[0], STALLED * size):
        return x
    raise ComputationError(f"{NONE} this state: Newton's steps do not end")


# ------------------------------------------------------------------ statics
def equilibria(one: Asked, result: xarray.Dataset, others: Sequence[Asked]) -> list[Any]:
    """Equilibria of other cases beside those of a path with given load factors."""
    problem, *beside = (_problem(each) for each in (one, *others))
    factors = [each.arguments["load_factors"] for each in others]
    moved = result["displacement"].transpose("step", "node", "axis").values
    if any(len(each) != len(moved) for each in factors):
        raise InputError(f"{NONE} a path with more points than were asked for")
    displacements, reactions = ([[] for _ in others] for _ in range(2))
    for k, (u, factor) in enumerate(zip(moved, result["load_factor"].values, strict=True)):
        x = problem.state(u, factor)
        block = sparse.csr_array(problem.tangent(x, factor))[problem.free][:, problem.free]
        factored = factorize(sparse.csc_array(block), pivot=PIVOT)
        for other, at, own, held in zip(beside, factors, displacements, reactions, strict=True):
            there = _balanced(other, x, float(at[k]), factored)
            own.append(other.displacement(there))
            held.append(other.reactions(there, float(at[k])))
    support = result["reaction"].dims
    return [
        {
            **result.variables,
            "displacement": Variable(("step", "node", "axis"), own),
            "reaction": Variable(support, np.reshape(held, result["reaction"].shape)),
            "load_factor": Variable("step", at),
        }
        for own, held, at in zip(displacements, reactions, factors, strict=True)
    ]


def _problem(one: Asked) -> OrigamiProblem:
    case, given = one.case, one.arguments
    lacks = (
        case.contact, case.remembering, given.get("inertia_relief"), given.get("duration"),
    )  # fmt: skip
    if any(lacks) or np.size(given.get("constant", ())):
        raise InputError(f"{NONE} a path with contact or memory")
    return OrigamiProblem(case)


def _balanced(problem: OrigamiProblem, x: NDArray, factor: float, factored: Any) -> NDArray:
    """State (m,) in equilibrium beside a state (m,) of another problem."""
    x = x.copy()
    x[problem.held] = problem.prescribed(factor)

    def step_at(free: NDArray) -> NDArray:
        x[problem.free] = free
        return -factored.solve(problem.residual(x, factor)[problem.free])

    x[problem.free] = refined(x[problem.free], step_at, problem.length)
    return x


# ------------------------------------------------------------------ modes
def modes(
    one: Asked, result: xarray.Dataset, others: Sequence[Asked], wanted: Sequence[int]
) -> list[Any]:
    """Modes of other cases beside some modes of a result, those with the places `wanted`."""
    linear, *beside = (_linear(each) for each in (one, *others))
    frequency, eigenvalue, ratio = (
        [result[name].values.copy() for _ in others]
        for name in ("frequency", "eigenvalue", "damping_ratio")
    )
    seen = result["shape"].transpose("mode", "node", "axis").values
    shapes = [seen.copy() for _ in others]
    for k in wanted:
        value = float(result["eigenvalue"].values[k])
        matrix = linear.stiffness - value * linear.mass
        carried = linear.mass @ _on_free(linear, seen[k].ravel())
        bordered = sparse.block_array(
            [[matrix, -carried[:, None]], [-carried[None], None]], format="csc"
        )
        factored = factorize(bordered, pivot=PIVOT)
        full = factored.solve(np.append(np.zeros(len(carried)), -1.0))[:-1]  # hidden dofs too
        full /= np.sqrt(full @ (linear.mass @ full))
        for j, other in enumerate(beside):
            at = _vibrating(other, np.append(full, value), factored)
            shape, eigenvalue[j][k] = at[:-1], at[-1]
            omega = np.sqrt(at[-1])
            damped = shape @ (other.damping @ shape) + ((other.modal @ shape) ** 2).sum()
            frequency[j][k], ratio[j][k] = omega / TURN, damped / (2.0 * omega)
            shapes[j][k] = other.expanded(shape[:, None]).reshape(seen[k].shape)
    return [
        {
            **result.variables,
            "frequency": Variable("mode", frequency[j]),
            "eigenvalue": Variable("mode", eigenvalue[j]),
            "damping_ratio": Variable("mode", ratio[j]),
            "shape": Variable(("mode", "node", "axis"), shapes[j]),
        }
        for j in range(len(others))
    ]


def _linear(one: Asked) -> Linearized:
    """A case linearized about rest."""
    given = one.arguments
    if given.get("state") is not None:
        raise InputError(f"{NONE} what is linearized about a state that loads have made")
    linear = linearize(one.case, None, given.get("secant"), 1.0, given.get("internal", 0))
    if linear.responding is not None:
        raise InputError(f"{NONE} vibrations with laws that remember")
    return linear


def _on_free(linear: Linearized, motion: NDArray) -> NDArray:
    """Motion (nf,) of the free dofs in one (3n,) of all nodes; 0 for those that are hidden."""
    out = np.zeros(len(linear.free))
    out[linear.free < motion.size] = motion[linear.free[linear.free < motion.size]]
    return out


def _vibrating(linear: Linearized, mode: NDArray, factored: Any) -> NDArray:
    """Shape and eigenvalue (nf + 1,) of the mode beside one, with phi' M phi = 1."""
    scale = np.ones(len(mode))
    scale[-1] = 1.0 / abs(mode[-1])  # the eigenvalue counts by its relative change

    def step_at(scaled: NDArray) -> NDArray:
        shape, value = scaled[:-1], scaled[-1] / scale[-1]
        carried = linear.mass @ shape
        left = linear.stiffness @ shape - value * carried
        return -scale * factored.solve(np.append(left, 0.5 * (1.0 - shape @ carried)))

    return refined(mode * scale, step_at, float(np.linalg.norm(mode * scale))) / scale


# ------------------------------------------------------------------ frequency responses
def responses(one: Asked, result: xarray.Dataset, others: Sequence[Asked]) -> list[Any]:
    """Frequency responses of other cases beside that of one, by the direct method."""
    if one.arguments["method"] != "direct":
        raise InputError(f"{NONE} a response by another method than the direct one")
    linear, *beside = (_linear(each) for each in (one, *others))
    if len(linear.modal):
        raise InputError(f"{NONE} a response with modal damping")
    drives = [
        drive_of(each.case, each.arguments["drive"], each.arguments.get("amplitude", 1.0))
        for each in (one, *others)
    ]
    terms = [drive_terms(each, drive) for each, drive in zip(beside, drives[1:], strict=True)]
    hertz, name = result["frequency"].values, drives[0].quantity
    found = np.zeros((len(others), len(hertz), len(linear.free)), np.complex128)
    own = drive_terms(linear, drives[0])
    for k, omega in enumerate(TURN * hertz):
        factored = factorize(dynamic_stiffness(linear, omega), pivot=PIVOT)
        begin = factored.solve(_load(own, omega))
        size = float(np.linalg.norm(begin))
        for other, pushed, out in zip(beside, terms, found, strict=True):
            out[k] = refined(begin, _corrected(other, _load(pushed, omega), omega, factored), size)
    return [
        result.assign({name: (("frequency", "node", "axis"), absolute(each, drive, response))})
        for each, drive, response in zip(beside, drives[1:], found, strict=True)
    ]


def _corrected(
    linear: Linearized, load: NDArray, omega: float, factored: Any
) -> Callable[[NDArray], NDArray]:
    """Steps of a response at an angular frequency (rad/s), with the factors of another case."""

    def step_at(x: NDArray) -> NDArray:
        damped = 1j * omega * (linear.damping @ x)
        return factored.solve(load - linear.stiffness @ x + omega**2 * (linear.mass @ x) - damped)

    return step_at


def _load(terms: Sequence[Any], omega: float) -> NDArray[np.complex128]:
    """Load per unit of the drive at an angular frequency (rad/s)."""
    return np.sum([term.shape * term.factor(omega) for term in terms], axis=0).astype(complex)
