"""Results of cases that differ a little from one, each found from its result.

Differences of them are derivatives. A neighbor's equilibria, modes or responses follow by Newton's
steps with the factors of the matrix of the one result: no path is followed and no mode searched
for, so that each costs a few solutions. They go on until the steps are small: after the first one
bars are strained by what is of second order in the motion, and they are far stiffer than creases.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy import sparse
from xarray import Variable

from foldyn.algebra.complex_symmetric import solved
from foldyn.algebra.superlu import PIVOT, factorize
from foldyn.cases import Case
from foldyn.dynamics.companions import Accompanied, Companion
from foldyn.dynamics.initial import begin, check_start
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.motion_state import Course
from foldyn.dynamics.system import pack
from foldyn.dynamics.timing import jumps
from foldyn.errors import ComputationError, InputError
from foldyn.linear.excitation import absolute, drive_of, drive_terms
from foldyn.linear.frequency_domain import dynamic_stiffness
from foldyn.linear.linearized import Linearized, linearize
from foldyn.linear.modes import Found
from foldyn.statics.equilibrium import OrigamiProblem

GAINED = 1e-6  # of the first step: the size of the last one
ROUNDING = 1e-14  # of the whole: a step that is none
ENOUGH, STALLED = 1e-4, 1e-8  # of the first step, and of the whole: what rounding may leave
ROUNDS = 12
TURN = 2.0 * np.pi
ALONG = ("newmark", "generalized_alpha")
"""Methods along whose steps neighbors go."""
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


# ------------------------------------------------------------------ motions
def motions(
    motion: Motion, one: Asked, others: Sequence[Asked], share: float
) -> list[NDArray[np.float64]]:
    """Displacements (k, n, 3) of other cases at the samples of a motion, which is computed.

    share : change of a difference between motions, in itself, at which a step has found it.
    """
    case, state, lasting = motion.case, one.arguments.get("initial"), ("initial", "sample")
    lacks = (
        motion.method.name not in ALONG, not motion.plan.steps, motion.continues, case.contact,
        case.remembering, motion.packed.system.turns, motion.device != "cpu",
    )  # fmt: skip
    if any(lacks):
        raise InputError(f"{NONE} a motion of this kind")
    given = {name: value for name, value in one.arguments.items() if name not in lasting}
    beside = []
    for other in others:
        if given != {name: value for name, value in other.arguments.items() if name in given}:
            raise InputError(f"{NONE} a motion with other steps")
        start = check_start(other.case, state)
        packed = pack(other.case, motion.packed.system.waves.span, start[0])
        if not np.array_equal(packed.numbering.order, motion.packed.numbering.order):
            raise InputError(f"{NONE} a motion whose nodes are numbered otherwise")
        course = begin(other.case, *start, None, None, motion.plan, packed)
        beside.append(Companion(packed, course))
    engines: list[Accompanied] = []

    def engine_of(course: Course) -> Accompanied:
        made = motion.method.scheme, motion.packed, course, motion.plan, jumps(case)
        engines.append(Accompanied(*made, beside, share))
        return engines[-1]

    motion.integrate(engine_of=engine_of)
    for packed, _ in beside:
        if packed.callbacks.error is not None:
            raise ComputationError(f"{NONE} this motion: {packed.callbacks.error}")
    return [np.array(found) for found in engines[-1].displacement]


# ------------------------------------------------------------------ modes
def modes(found: Found, others: Sequence[Asked], wanted: Sequence[int]) -> list[Any]:
    """Modes of other cases beside some of those found, those with the places `wanted`."""
    linear, result, beside = found.linear, found.result, [_linear(each) for each in others]
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
def responses(one: Asked, others: Sequence[Asked]) -> list[xarray.Dataset]:
    """Frequency responses of a case by the direct method, and of other cases beside it.

    Those are found by one step: what a case is linear in has no further ones to first order.
    """
    if one.arguments["method"] != "direct":
        raise InputError(f"{NONE} a response by another method than the direct one")
    cases = [_Driven(each) for each in (one, *others)]
    first, *beside = cases
    hertz = np.asarray(one.arguments["frequencies"], float)
    found = np.full((len(cases), len(hertz), len(first.linear.free)), np.nan, np.complex128)
    matrices = sparse.vstack([each.matrices for each in beside], format="csr")
    for k, omega in enumerate(TURN * hertz):
        linear = first.linear
        stiffness = dynamic_stiffness(linear, omega)
        x, factors = solved(stiffness, first.load(omega), linear.gram, 1j * omega)
        if factors is None:
            continue
        products = (matrices @ np.stack([x.real, x.imag], axis=1)) @ (1.0, 1.0j)
        left = [
            each.load(omega) - each.stiffened(part, x, omega)
            for each, part in zip(beside, products.reshape(len(beside), 3, -1), strict=True)
        ]
        found[0, k], found[1:, k] = x, x + factors.solve(np.stack(left, axis=1)).T
    named = {"frequency": hertz}
    return [
        xarray.Dataset(
            {each.drive.quantity: (("frequency", "node", "axis"), each.absolute(own))}, named
        )
        for each, own in zip(cases, found, strict=True)
    ]


class _Driven:
    """A case linearized, and what drives it."""

    def __init__(self, one: Asked) -> None:
        self.linear = _linear(one)
        self.drive = drive_of(one.case, one.arguments["drive"], one.arguments.get("amplitude", 1.0))
        self._terms = drive_terms(self.linear, self.drive)
        each = self.linear.stiffness, self.linear.damping, self.linear.mass
        self.matrices = sparse.vstack(each, format="csr")

    def load(self, omega: float) -> NDArray[np.complex128]:
        """Load (nf,) per unit of the drive at an angular frequency (rad/s)."""
        parts = [term.shape * term.factor(omega) for term in self._terms]
        return np.sum(parts, axis=0).astype(complex)

    def stiffened(self, products: NDArray, x: NDArray, omega: float) -> NDArray:
        """Dynamic stiffness times x (nf,), from the products (3, nf) of the matrices with it."""
        elastic, damped, inertia = products
        rows = self.linear.modal
        damped = damped + rows.T @ (rows @ x) if len(rows) else damped
        return elastic - omega**2 * inertia + 1j * omega * damped

    def absolute(self, response: NDArray) -> NDArray[np.complex128]:
        """Response (f, n, 3) from that of the free dofs (f, nf)."""
        return absolute(self.linear, self.drive, response)
