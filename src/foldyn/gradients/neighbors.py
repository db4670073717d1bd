"""Results of slightly different cases (neighbors), each found from the result of one case.

Differences between these results give derivatives. A neighbor's equilibria, modes or responses
follow by Newton steps with the factorized matrix of the one result: no path is followed and no mode
is searched for, so a neighbor costs a few solutions. One step is not enough: it strains bars to
second order in the motion, and bars are far stiffer than creases. So steps are repeated until they
are small. Neighbors of a motion are integrated along with it, step by step (`dynamics.companions`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy import sparse
from xarray import Variable

from foldyn.algebra.complex_symmetric import solved
from foldyn.algebra.superlu import PIVOT, factorize
from foldyn.algebra.woodbury import Squared
from foldyn.cases import Case
from foldyn.dynamics.companions import Accompanied, Companion
from foldyn.dynamics.initial import begin, check_start
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.motion_state import MotionState
from foldyn.dynamics.system import pack
from foldyn.dynamics.timing import jumps
from foldyn.errors import ComputationError, InputError
from foldyn.linear.excitation import absolute, drive_of, drive_terms
from foldyn.linear.frequency_domain import dynamic_stiffness
from foldyn.linear.harmonic import REFERENCE, HarmonicBalance, Hinges, harmonic
from foldyn.linear.linearized import Linearized, linearize
from foldyn.linear.modes import Found
from foldyn.statics.equilibrium import OrigamiProblem

GAINED = 1e-6  # steps end at this fraction of the first step
ROUNDING = 1e-14  # a step below this fraction of the whole counts as zero
# largest step that round-off may leave, relative to the first step, and to the whole
ENOUGH, STALLED = 1e-4, 1e-8
ROUNDS = 12
TURN = 2.0 * np.pi
ALONG = ("newmark", "generalized_alpha")
"""Integration methods for which neighbors of a motion can be computed."""
RESPONSES = ("direct", "harmonic")
"""Methods for which neighbors of a frequency response can be computed."""
NONE = "there is no neighbor of"


class Asked(NamedTuple):
    """A case, and the arguments of its analysis."""

    case: Case
    arguments: Mapping[str, Any]


def refined(x: NDArray, step_at: Callable[[NDArray], NDArray], size: float) -> NDArray:
    """Limit of Newton steps with the matrix of a neighbor.

    Parameters
    ----------
    x : ndarray, shape (n,) or (n, c)
        Start, for one neighbor or several.
    step_at : callable
        Returns the next step of each neighbor from given points.
    size : float
        Scale for rounding errors.

    Raises
    ------
    ComputationError
        The steps do not converge: a neighbor is too far away.
    """
    sizes: list[NDArray] = []
    going = np.ones(x.shape[1:], bool)
    for _ in range(ROUNDS):
        step = step_at(x) * going
        x = x + step
        sizes.append(np.linalg.norm(step, axis=0))
        near = sizes[-1] <= np.maximum(ENOUGH * sizes[0], STALLED * size)
        going = sizes[-1] > np.maximum(GAINED * sizes[0], ROUNDING * size)
        if len(sizes) > 2:  # compare with the step before the last: even and odd steps differ
            stalled = sizes[-1] > 0.5 * sizes[-3]
            going &= ~(stalled & near)
            if (stalled & going).any():
                break
        if not going.any():
            break
    if near.all():
        return x
    raise ComputationError(f"{NONE} this state: Newton's steps do not converge")


# ------------------------------------------------------------------ statics
def equilibria(one: Asked, result: xarray.Dataset, others: Sequence[Asked]) -> list[Any]:
    """Equilibria of other cases, near a path with given load factors."""
    problem = _problem(one)
    beside = [problem if each.case is one.case else _problem(each) for each in others]
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
    """Equilibrium problem of a case; refuses contact, memory and constant loads."""
    case, given = one.case, one.arguments
    lacks = case.contact, case.remembering, given.get("inertia_relief"), given.get("duration")
    if any(lacks) or np.size(given.get("constant", ())):
        raise InputError(f"{NONE} a path with contact or memory")
    return OrigamiProblem(case)


def _balanced(problem: OrigamiProblem, x: NDArray, factor: float, factored: Any) -> NDArray:
    """State (m,) in equilibrium, near a state (m,) of another problem."""
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
    """Displacements (k, n, 3) of other cases, integrated along with a motion, at its samples.

    share : a step has converged if the difference between motions changes by less than this share.
    """
    case, state, lasting = motion.case, one.arguments.get("initial"), ("initial", "sample")
    lacks = (
        motion.method.name not in ALONG, not motion.plan.steps, motion.continued, case.contact,
        case.air, case.remembering, motion.packed.system.turns, motion.device != "cpu",
    )  # fmt: skip
    if any(lacks):
        raise InputError(f"{NONE} a motion of this kind")
    given = {name: value for name, value in one.arguments.items() if name not in lasting}
    beside = []
    for other in others:
        if given != {name: value for name, value in other.arguments.items() if name in given}:
            raise InputError(f"{NONE} a motion with other steps")
        start = check_start(other.case, state)
        packed = pack(other.case, motion.packed.system.waves.span, motion.origin)
        if not np.array_equal(packed.numbering.order, motion.packed.numbering.order):
            raise InputError(f"{NONE} a motion whose nodes are numbered otherwise")
        beside.append(Companion(packed, begin(other.case, *start, None, None, motion.plan, packed)))
    engines: list[Accompanied] = []
    scheme: Any = motion.method.scheme
    steps = motion.plan, jumps(case)

    def engine_of(state: MotionState) -> Accompanied:
        engines.append(Accompanied(scheme, motion.packed, state, *steps, beside, share))
        return engines[-1]

    motion.integrate(engine_of=engine_of)
    for packed, _ in beside:
        if packed.callbacks.error is not None:
            raise ComputationError(f"{NONE} this motion: {packed.callbacks.error}")
    return [np.array(found) for found in engines[-1].displacement]


# ------------------------------------------------------------------ modes
def modes(found: Found, others: Sequence[Asked], wanted: Sequence[int]) -> list[Any]:
    """Modes of other cases, near those modes of `found` that have the numbers `wanted`."""
    linear, result = found.linear, found.result
    beside = [linear if each.case is linear.case else _linear(each) for each in others]
    frequency = [result["frequency"].values.copy() for _ in others]
    eigenvalue = [result["eigenvalue"].values.copy() for _ in others]
    ratio = [result["damping_ratio"].values.copy() for _ in others]
    seen = result["shape"].transpose("mode", "node", "axis").values
    shapes = [seen.copy() for _ in others]
    assert not isinstance(linear.mass, Squared)  # large sheets in air have no gradients
    for k in wanted:
        value = float(result["eigenvalue"].values[k])
        matrix = linear.stiffness - value * linear.mass
        carried = (linear.mass @ _on_free(linear, seen[k].ravel()))[:, None]
        bordered = sparse.block_array([[matrix, -carried], [-carried.T, None]], format="csc")
        factored = factorize(bordered, pivot=PIVOT)
        full = factored.solve(np.append(np.zeros(len(carried)), -1.0))[:-1]  # includes hidden dofs
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
        raise InputError(f"{NONE} a linearization about a loaded state")
    linear = linearize(one.case, secant=given.get("secant"))
    if linear.responding is not None:
        raise InputError(f"{NONE} vibrations with laws that have memory")
    return linear


def _on_free(linear: Linearized, motion: NDArray) -> NDArray:
    """Motion (nf,) of the free dofs from a motion (3n,) of all nodes; 0 for hidden dofs."""
    out = np.zeros(len(linear.free))
    out[linear.free < motion.size] = motion[linear.free[linear.free < motion.size]]
    return out


def _vibrating(linear: Linearized, mode: NDArray, factored: Any) -> NDArray:
    """Shape and eigenvalue (nf + 1,) of the mode near a given one, with phi' M phi = 1."""
    scale = np.ones(len(mode))
    scale[-1] = 1.0 / abs(mode[-1])  # scaled so that its relative change counts

    def step_at(scaled: NDArray) -> NDArray:
        shape, value = scaled[:-1], scaled[-1] / scale[-1]
        carried = linear.mass @ shape
        left = linear.stiffness @ shape - value * carried
        return -scale * factored.solve(np.append(left, 0.5 * (1.0 - shape @ carried)))

    return refined(mode * scale, step_at, float(np.linalg.norm(mode * scale))) / scale


# ------------------------------------------------------------------ frequency responses
def responses(one: Asked, others: Sequence[Asked]) -> list[xarray.Dataset]:
    """Frequency responses, by the direct or harmonic method, of a case and its neighbors."""
    if (method := one.arguments["method"]) not in RESPONSES:
        raise InputError(f"{NONE} a response by another method than {', '.join(RESPONSES)}")
    cases = [_Driven(each) for each in (one, *others)]
    hertz = np.asarray(one.arguments["frequencies"], float)
    if method == "direct":
        found = _direct(cases, TURN * hertz)
    else:
        known = {each.name for each in fields(HarmonicBalance)}
        given = {name: value for name, value in one.arguments.items() if name in known}
        first, balance = cases[0], HarmonicBalance(**given)
        answer = harmonic(first.linear, first.drive, hertz, balance, lambda _: None)
        found = _harmonic(cases, TURN * hertz, answer.response)
    named = {"frequency": hertz}
    return [
        xarray.Dataset(
            {each.drive.quantity: (("frequency", "node", "axis"), each.absolute(own))}, named
        )
        for each, own in zip(cases, found, strict=True)
    ]


def _direct(cases: Sequence[_Driven], omegas: NDArray) -> NDArray[np.complex128]:
    """Responses (c, f, nf) of the first case and its neighbors by the direct method."""
    linear, beside = cases[0].linear, cases[1:]
    found = np.full((len(cases), len(omegas), len(linear.free)), np.nan, np.complex128)
    matrices = sparse.block_diag([each.matrices for each in beside], format="csr")
    for k, omega in enumerate(omegas):
        stiffness, load = dynamic_stiffness(linear, omega), cases[0].load(omega)
        x, factors = solved(stiffness, load, linear.gram, 1j * omega)
        if factors is not None:
            found[0, k] = x
            left = partial(_left, beside, matrices, omega)
            found[1:, k] = _repeated(x, len(beside), left, factors)
    return found


def _left(
    beside: Sequence[_Driven], matrices: sparse.csr_array, omega: float, x: NDArray
) -> NDArray[np.complex128]:  # fmt: skip
    """Out-of-balance forces (nf, c) of responses (nf, c) of the cases."""
    parts = np.stack([np.real(x.T).ravel(), np.imag(x.T).ravel()], axis=1)
    products = ((matrices @ parts) @ (1.0, 1.0j)).reshape(len(beside), 3, -1)
    each = zip(beside, products, x.T, strict=True)
    return np.stack([one.left(product, own, omega) for one, product, own in each], axis=1)


def _repeated(
    x: NDArray, count: int, left: Callable[[NDArray], NDArray], factors: Any
) -> NDArray[np.complex128]:  # fmt: skip
    """Balanced responses (c, nf) of the neighbors, all begun from the first case's x (nf,)."""
    begin = np.repeat(x[:, None], count, axis=1)
    return refined(begin, lambda each: -factors.solve(left(each)), float(np.linalg.norm(x))).T


def _harmonic(
    cases: Sequence[_Driven], omegas: NDArray, response: NDArray
) -> NDArray[np.complex128]:
    """Responses (c, f, nf) by the harmonic method, given the response (f, nf) of the first case."""
    if len(cases[0].linear.modal):
        raise InputError(f"{NONE} a harmonic response with modal damping")
    values = np.array([each.drive.value for each in cases])
    balances = [Hinges(each.linear) for each in cases]
    found = np.repeat(response[None], len(cases), axis=0)
    for k in np.flatnonzero(np.isfinite(response).all(axis=1)):
        x, omega = response[k] * values[0], float(omegas[k])
        stiffness = [dynamic_stiffness(each.linear, omega) for each in cases]
        loads = [each.drive.value * each.load(omega) for each in cases]
        own = balances[0].left(stiffness[0], x, loads[0])  # residual at which it stopped
        beside = [*zip(balances[1:], stiffness[1:], loads[1:], strict=True)]
        factors = _InParts(balances[0].tangent(stiffness[0], x))
        left = partial(_out_of_balance, beside, own)
        found[1:, k] = _repeated(x, len(beside), left, factors) / values[1:, None]
    return found


def _out_of_balance(
    beside: Sequence[tuple[Hinges, sparse.csc_array, NDArray]], own: NDArray, x: NDArray
) -> NDArray[np.complex128]:
    """Out-of-balance forces (nf, c) of motions (nf, c), less the residual of the first case."""
    each = zip(beside, x.T, strict=True)
    forces = [hinges.left(matrix, motion, load) for (hinges, matrix, load), motion in each]
    return np.stack(forces, axis=1) - own[:, None]


class _InParts:
    """Factors of a real matrix (2n, 2n) that acts on real and imaginary parts."""

    def __init__(self, matrix: sparse.csc_array) -> None:
        self._factors = factorize(matrix, symmetric=False)

    def solve(self, force: NDArray) -> NDArray[np.complex128]:
        """Solution (n, c) for complex right-hand sides (n, c)."""
        solution = self._factors.solve(np.vstack([np.real(force), np.imag(force)]))
        real, imag = np.split(solution, 2)
        return real + 1j * imag


class _Driven:
    """A linearized case and its drive."""

    def __init__(self, one: Asked) -> None:
        harmonically = one.arguments["method"] == "harmonic"
        secant = REFERENCE if harmonically else one.arguments.get("secant")
        self.linear = _linear(Asked(one.case, {**one.arguments, "secant": secant}))
        self.drive = drive_of(one.case, one.arguments["drive"], one.arguments.get("amplitude", 1.0))
        self._terms = drive_terms(self.linear, self.drive)
        each = self.linear.stiffness, self.linear.damping, self.linear.mass
        self.matrices = sparse.vstack(each, format="csr")

    def load(self, omega: float) -> NDArray[np.complex128]:
        """Load (nf,) per unit of the drive at an angular frequency (rad/s)."""
        parts = [term.shape * term.factor(omega) for term in self._terms]
        return np.sum(parts, axis=0).astype(complex)

    def left(self, products: NDArray, x: NDArray, omega: float) -> NDArray:
        """Out-of-balance force (nf,) of a response x, from its matrix products (3, nf)."""
        elastic, damped, inertia = products
        rows = self.linear.modal
        damped = damped + rows.T @ (rows @ x) if len(rows) else damped
        return elastic - omega**2 * inertia + 1j * omega * damped - self.load(omega)

    def absolute(self, response: NDArray) -> NDArray[np.complex128]:
        """Response (f, n, 3) from the response of the free dofs (f, nf)."""
        return absolute(self.linear, self.drive, response)
