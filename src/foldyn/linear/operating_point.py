"""The state about which a case is linearized: found by statics, or given and checked."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case, State
from foldyn.cases.case_assembly import SomeLoads
from foldyn.cases.history import STEADY
from foldyn.cases.releases import unreleased
from foldyn.errors import FoldynWarning, InputError, warn
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.following import NO_POTENTIAL
from foldyn.statics import OrigamiProblem, trace
from foldyn.statics.equilibrium import drives, is_actuated
from foldyn.statics.newton import Balance, Solver, balance
from foldyn.statics.path_memory import AT_REST, FOLLOWED, REFUSED, flowing
from foldyn.statics.rigid import free_rigid_motions
from foldyn.statics.tracing import displacement_of

BALANCED = 1e-6  # largest residual in equilibrium, relative to the forces that act
PLACES = "None (the rest state), 'equilibrium' or a State, as fd.initial_state(path)"


class OperatingPoint(NamedTuple):
    """A state and its residual."""

    displacement: NDArray  # (n, 3) m
    problem: OrigamiProblem
    factor: float  # factor of actuated folds and of loads that depend on the displacement
    body: Assembly  # body with its folds actuated
    dofs: NDArray  # (m,) the state on all dofs of the body
    balance: Balance
    kind: str  # "rest", "equilibrium" or "state"

    @property
    def planes(self) -> NDArray:
        """Displacements (p, 3) of the planes of contact, m."""
        return self.problem.planes(self.problem.state(self.displacement, self.factor))

    def load_stiffness(self) -> sparse.csr_array | None:
        """Load stiffness (m, m), N/m, of loads that depend on the displacement."""
        if self.kind == "rest" or not self.problem.following.acts:
            return None
        return self.problem.load_stiffness(self.dofs, self.factor)

    @property
    def relative(self) -> float:
        """Residual as a fraction of the forces that act; 0 if within their rounding."""
        if self.balance.residual <= self.problem.force_rounding:
            return 0.0
        return self.balance.residual / max(self.balance.residual, self.balance.reference)


def operating_point(
    case: Case, state: State | str | None, load_factor: float = 1.0
) -> OperatingPoint:
    """The state requested for a linearization.

    Warns
    -----
    FoldynWarning
        The state is not an equilibrium, or the case has steady loads, which do not act at rest.
    """
    case.check_movable()
    if state is not None and case.structure.linear:
        raise InputError(
            f": {case.structure.linear} are linear about the rest state only; take bars and "
            "hinges, or a shell",
            "state",
        )
    if state is None:
        point = _judge(case, np.zeros_like(case.structure.nodes), None, 0.0, "rest")
        if any(getattr(load, "history", None) == STEADY for load in case.loads):
            _warn(
                "state = None: the loads of the case do not act in the rest state; "
                "state = 'equilibrium' takes the equilibrium under them"
            )
    elif isinstance(state, str):
        if state != "equilibrium":
            raise InputError(f" = {state!r}: give {PLACES}", "state")
        point = _judge(case, *_equilibrium(case), 1.0, "equilibrium")
    else:
        found = displacement_of(state, case, "state", PLACES)
        memory = case.memory_in(state)
        memory = memory[flowing(case, False)] if isinstance(memory, np.ndarray) else memory
        point = _judge(case, found, memory, load_factor, "state")
    if point.relative > BALANCED:
        _warn(_imbalance(point, case))
    return point


def _equilibrium(case: Case) -> tuple[NDArray, NDArray | None]:
    """Displacement (n, 3), m, under the full loads of a case, near its rest state; its memory.

    Superlinear hinges need one more Newton step: with a residual at round-off, a hinge at 1e-6 rad
    from rest is still off by 1e-4 of that turn, which affects its slope.
    """
    case, factors = unreleased(case), [0.0, 1.0] if drives(case, ()) else [0.0]
    nodes, body = case.structure.nodes, case.body
    free = free_rigid_motions(nodes, case.constraints, body.holds(np.zeros(body.size))).shape[1] > 0
    with warnings.catch_warnings():  # the linearization itself gives these warnings
        for told in ("the path loses stability", NO_POTENTIAL[:20]):
            warnings.filterwarnings("ignore", told, FoldynWarning)
        path = trace(case, "newton", load_factors=factors, inertia_relief=free)
    found = path["displacement"].values[-1]
    memory = path["memory"].values[-1][flowing(case, False)] if case.latches else None
    if len(body.sheet.soft_hinges(body.dofs(found)).offset):
        problem = OrigamiProblem(case, inertia_relief=free, flow=_flow(case), memory=memory)
        again = Solver(problem).correct(problem.state(found, factors[-1]), factors[-1])
        return problem.displacement(again.u), memory
    return found, memory


def _judge(
    case: Case, displacement: NDArray, memory: NDArray | str | None, factor: float, kind: str
) -> OperatingPoint:
    """The operating point of a state, with its residual.

    Latches hold as the memory of the state says.

    Forces with a fixed direction do not enter the tangent, and a state does not record their
    factors: each load gets the factor that minimizes the residual. Loads that depend on the
    displacement act with the factor of actuated folds.
    """
    flow = AT_REST if kind == "rest" else _flow(case)
    problem = OrigamiProblem(case, (), displacement, flow=flow, memory=memory)
    reached = problem.state(displacement, factor)
    body, u, free = problem.body(reached, factor), problem.dofs(reached), problem.free
    residual = problem.projected(body.internal(u) - problem.following_force(u, factor))
    loads = problem.projected(_load_vectors(case, body))
    if kind == "equilibrium":
        residual = residual - loads.sum(axis=1)
    elif kind == "state" and loads.size:
        factors = np.linalg.lstsq(loads[free], residual[free], rcond=None)[0]
        residual = residual - loads @ factors
    residual = np.pad(residual, (0, len(reached) - len(residual)))  # planes are fixed
    found = balance(problem, reached, factor, residual)
    return OperatingPoint(displacement, problem, factor, body, u, found, kind)


def _flow(case: Case) -> str:
    """How the memory of a case counts: latches hold, but nothing yields."""
    only = all(part.latches or part.law.relaxes for part in case.remembering)
    return FOLLOWED if case.latches and only else REFUSED


def _load_vectors(case: Case, body: Assembly) -> NDArray:
    """Forces (m, loads), N, of each load in full."""
    alone = [SomeLoads(case, [i]) for i in range(len(case.loads))]
    vectors = [vector.ravel() for one in alone for vector, _ in one.load_terms]
    loads = np.zeros((body.size, len(vectors)))
    for k, vector in enumerate(vectors):
        loads[: vector.size, k] = vector
    return loads


def _imbalance(point: OperatingPoint, case: Case) -> str:
    """Warning that a state is not an equilibrium, with a remedy."""
    driven = "springs and cables with a history" if case.elastic_body.histories else ""
    driven = "actuated folds" if is_actuated(case) else driven
    driven = "pressure and moments of creases" if case.following_terms else driven
    remedy = {
        "rest": "state = 'equilibrium' finds the equilibrium that belongs to it",
        "equilibrium": "the loads of a free body must balance, or it accelerates",
        "state": "take it from a path of this case"
        + (f", and give the load_factor of its {driven}" if driven else ""),
    }[point.kind]
    what = "the rest state" if point.kind == "rest" else "the state"
    return (
        f"{what} is no equilibrium: its residual is {point.relative:.2g} of the forces at play; "
        f"motions about it are not free vibrations. Remedy: {remedy}"
    )


def _warn(message: str) -> None:
    warn(message, "modes.md#choose-the-state")
