"""The state about which a case is linearized: found, or given and judged."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.errors import FoldynWarning, InputError
from foldyn.mechanics.body import Body
from foldyn.statics import OrigamiProblem, trace
from foldyn.statics.origami import drives, is_actuated
from foldyn.statics.rigid import free_rigid_motions

BALANCED = 1e-6  # of the forces at play: the largest residual of a state taken for an equilibrium
PLACES = "None (the rest state), 'equilibrium' or a State, as fd.initial_state(path)"


class Station(NamedTuple):
    """A state, and how far it is from an equilibrium."""

    displacement: NDArray  # (n, 3) m
    problem: OrigamiProblem
    factor: float  # of actuated folds there
    body: Body  # with its folds as they are actuated
    dofs: NDArray  # (m,) the state on all dofs of the body
    residual: float  # norm on the free dofs, N
    reference: float  # norm of the forces at play, N
    kind: str  # "rest", "equilibrium" or "state"

    @property
    def relative(self) -> float:
        """Residual as a fraction of the forces at play; 0 below their rounding."""
        if self.residual <= self.problem.force_rounding:
            return 0.0
        return self.residual / max(self.reference, self.residual)


def station(case: Case, state: State | str | None, load_factor: float = 1.0) -> Station:
    """The state that a linearization is asked for.

    Warns
    -----
    FoldynWarning
        It is no equilibrium, or the case has loads, which do not act at rest.
    """
    if not len(case.free_dofs):
        raise InputError(
            "supports: hold every node along x, y and z, so that nothing can move: free one"
        )
    shape = case.structure.nodes.shape
    if state is None:
        found = _judge(case, np.zeros(shape), 0.0, "rest")
        if case.loads:
            _warn(
                "state = None: the loads of the case do not act in the rest state; "
                "state = 'equilibrium' takes the equilibrium under them"
            )
    elif isinstance(state, str):
        if state != "equilibrium":
            raise InputError(f" = {state!r}: give {PLACES}", "state")
        found = _judge(case, _equilibrium(case), 1.0, "equilibrium")
    elif isinstance(state, State):
        given = np.zeros(shape) if state.displacement is None else np.array(state.displacement)
        if given.shape != shape:
            raise InputError(
                f": displacement of shape {given.shape}: the case has {shape}", "state"
            )
        found = _judge(case, given, load_factor, "state")
    else:
        raise InputError(f": got {type(state).__name__}; give {PLACES}", "state")
    if found.relative > BALANCED:
        _warn(_imbalance(found, case))
    return found


def _equilibrium(case: Case) -> NDArray:
    """Displacement (n, 3) under the loads of a case in full, near its rest state."""
    factors = [0.0, 1.0] if drives(case, ()) else [0.0]
    free = free_rigid_motions(case.structure.nodes, case.fixed.ravel()).shape[1] > 0
    with warnings.catch_warnings():  # what is linearized there tells of its unstable motions
        warnings.filterwarnings("ignore", "the path loses stability", FoldynWarning)
        path = trace(case, "newton", factors, inertia_relief=free)
    return path["displacement"].values[-1]


def _judge(case: Case, displacement: NDArray, factor: float, kind: str) -> Station:
    """A state with its residual.

    Forces that keep their direction have no part in the tangent, and a state does not tell by
    which factor they act in it: each may have its own, the one that leaves the least residual.
    """
    problem = OrigamiProblem(case, (), displacement)
    body = problem.actuation.body(factor)
    u, free = body.dofs(displacement), problem.free
    residual = body.internal(u)
    loads = _load_vectors(case, body)
    if kind == "equilibrium":
        residual = residual - loads.sum(axis=1)
    elif kind == "state" and loads.size:
        factors = np.linalg.lstsq(loads[free], residual[free], rcond=None)[0]
        residual = residual - loads @ factors
    held = float(np.linalg.norm(residual[problem.held]))
    reference = max(problem.reference(u, factor), held)
    size = float(np.linalg.norm(residual[free]))
    return Station(displacement, problem, factor, body, u, size, reference, kind)


def _load_vectors(case: Case, body: Body) -> NDArray:
    """Forces (m, loads), N, of each load in full."""
    with warnings.catch_warnings():  # they were given when the case was made
        warnings.simplefilter("ignore", FoldynWarning)
        alone = [replace(case, loads=[load]) for load in case.loads]
    vectors = [vector.ravel() for one in alone for vector, _ in one.load_terms]
    loads = np.zeros((body.size, len(vectors)))
    for k, vector in enumerate(vectors):
        loads[: vector.size, k] = vector
    return loads


def _imbalance(found: Station, case: Case) -> str:
    remedy = {
        "rest": "state = 'equilibrium' finds the equilibrium that belongs to it",
        "equilibrium": "the loads of a free body must balance, or it accelerates",
        "state": "take it from a path of this case"
        + (", and give the load_factor of its actuated folds" if is_actuated(case) else ""),
    }[found.kind]
    what = "the rest state" if found.kind == "rest" else "the state"
    return (
        f"{what} is no equilibrium: its residual is {found.relative:.2g} of the forces at play; "
        f"motions about it are not free vibrations. Remedy: {remedy}"
    )


def _warn(message: str) -> None:
    warnings.warn(message, FoldynWarning, stacklevel=5)
