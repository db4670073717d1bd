"""`trace`: the equilibrium path of a case.

Before a path is computed, mechanisms (motions without resistance) are found and named: motions that
neither stretch a bar nor turn a hinge. Every hinge counts with its stiffness k, whatever its law
(superlinear bends have zero slope at rest, but still resist); internal forces do not count.

Free rigid motions follow from the supports alone, including springs and clamped edges. To find
other mechanisms, the stiffness matrix is factorized; only if its smallest eigenvalue is suspicious
are its softest modes computed. A mode is a mechanism if its strain is round-off. Bars are judged by
elongations, because these are accurate to round-off: soft modes of a large sheet are millions of
times softer than its bars and still not free.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence, Sized
from functools import partial
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.solvers import check_fill, factorized
from foldyn.algebra.superlu import Factorization
from foldyn.cases import Case, Gravity, State
from foldyn.cases.constraints import check_tied
from foldyn.cases.contact_checks import check_contact, check_driven
from foldyn.cases.directions import AXES
from foldyn.cases.reached import REACHED, Reached
from foldyn.cases.releases import release_times, waiting
from foldyn.errors import InputError, within
from foldyn.mechanics.term import Unstrained
from foldyn.ram_limit import check_memory
from foldyn.statics.equilibrium import AdaptiveLoad, OrigamiProblem, drives, is_actuated, is_moved
from foldyn.statics.newton import Settings, Solver, settings_of
from foldyn.statics.path_memory import FOLLOWED, flowing
from foldyn.statics.path_methods import METHODS, PathPlan, along, plan_path
from foldyn.statics.recording import record
from foldyn.statics.releases import JUMP, trace_released
from foldyn.statics.rigid import name_rigid_motions
from foldyn.statics.stability import softest_modes
from foldyn.statics.stepping import Point, Walk, kept, settle, walk
from foldyn.values import choice, flag, function, indices, of_kind, show, single, whole

SHORTEST = 1e-3  # least length of a bar at the start of a path, relative to its rest length
LOOKS = 51  # load factors between two given ones at which supports and planes are checked
COPIES = 8  # copies of a point's dofs in memory while forces, work and the dataset are computed
SHIFT = 1e-13  # relative shift of the diagonal so that the matrix of a mechanism can be factorized
SUSPICIOUS = 1e-11  # modes are computed if an eigenvalue of the scaled matrix is below this
INVERSE_ITERATIONS = 4
MOST_MODES = 12
BAR_STRAIN = 1e-9  # elongation that counts as zero, relative to the most that the end motions allow
HINGE_STRAIN = 1e-6  # turn of a hinge that counts as zero, in the same measure
MOVED = 0.3  # nodes that move more than this fraction of the largest motion are named
MOST_NAMED = 8


def until_of(given: Any, case: Case) -> Callable[..., Any] | None:
    """End condition of a path, as a function of displacements, load factor and what is released."""
    if given is None:
        return None
    if callable(given):
        return lambda u, factor, gone=(): given(u, factor)
    if not isinstance(given, Reached | Mapping):
        raise InputError(
            f" = {show(given)}: give a function, or a table of {REACHED.asked}", "until"
        )
    end = given if isinstance(given, Reached) else REACHED("until", given)
    with within("until."):
        share = end.share(case)
    return lambda u, factor, gone=(): share(u, lambda history: factor, gone) >= 1.0


def trace(
    case: Case,
    method: str = "newton",
    *,
    load_factors: Sequence[float] | None = None,
    steps: int | None = None,
    duration: float | Sequence[float] | None = None,
    constant: str | Sequence[int] = (),
    initial: State | None = None,
    first_step: float | None = None,
    until: Callable[[NDArray, float], bool] | Mapping[str, Any] | None = None,
    adaptive_load: AdaptiveLoad | None = None,
    inertia_relief: bool = False,
    settings: Settings | Mapping[str, Any] | None = None,
    progress: Callable[[Point], None] | None = None,
) -> xarray.Dataset:
    """Follow the equilibria of a case along a load factor.

    The factor multiplies the case's forces, gravity, imposed displacements and actuations;
    histories and base motions are ignored. Supports and planes with `until` are released at the
    first point where that is reached: the next point is the equilibrium without them at the same
    load factor, and what is lost on the way is `dissipated`.

    Parameters
    ----------
    case : Case
    method : {"newton", "displacement", "mgdcm", "arc_length"}
        "newton" steps the load factor and returns the points at the given factors only;
        "displacement" steps the factor of moved supports or folds, and returns every point on the
        way; "mgdcm" and "arc_length" let the factor move freely, through limit points.
    load_factors : sequence of float, optional
        For "newton" and "displacement" the factors to reach, in this order. For the others two
        numbers, where the path begins and ends; without them it begins at 0 and ends after
        `steps`.
    steps : int, optional
        Instead of load_factors: equal steps from 0 to 1 (default 10). For "mgdcm" and
        "arc_length": steps after which the path ends (default 100).
    duration : float or sequence of float, optional
        For "newton" and "displacement" the time (s) from each load factor to the next: one value
        for all intervals, or one for each. The factor changes at a constant rate, or stays constant
        if repeated. Creases with memory relax and creep meanwhile; without a duration they are
        fully relaxed.
    constant : "gravity", int or sequence of int
        Numbers, each once, of loads in `case.loads` that act in full at every factor.
    initial : State, optional
        Displacements near which the first point is sought; fixed supports hold their nodes at these
        displacements. Without it the path starts from rest at the factor 0.
    first_step : float, optional
        Change of the factor in the first step of "mgdcm" and "arc_length" (default 0.05, or this
        fraction of the range to the last factor); the next steps are about as long.
    until : callable or mapping, optional
        The path ends at the first point where this is reached: {"node": 6, "axis": "z",
        "displacement": -0.03} (m), {"crease": 3, "angle": 170} (degrees) or {"line": 0, "tension":
        40} (N), or where a function of displacements (n, 3) and load factor is true.
    adaptive_load : callable, optional
        Further forces (n, 3), N, as a function of displacements (n, 3) and load factor.
    inertia_relief : bool
        Balance the loads on a free body by its inertia.
    settings : Settings or mapping, optional
        Values of `statics.Settings`, such as {"largest_turn": 3.0}, for tolerance, step control,
        stability and linear solver.
    progress : callable, optional
        Called with each point found.

    Returns
    -------
    xarray.Dataset
        `displacement` (m) with dimensions step, node, axis and the coordinate `load_factor`;
        `reaction` (N) at supported dofs; energies (J) `strain_bars`, `strain_folds`,
        `strain_bends` and `work`; `negative_eigenvalues`, `point` ("regular", "limit",
        "bifurcation"), `iterations`, `residual`; with a duration `elapsed` (s). Attributes hold
        `status` ("complete", "until not reached", or "stopped" with `stopped_because` and
        `remedy`), `unstable_points` (how many) and `stability_changes` (in words), and facts about
        the run.

    Raises
    ------
    InputError
        An argument out of range; supports that leave a mechanism; nothing that loads the case.
    ComputationError
        The path cannot continue; the exception's `partial` holds it up to its last point.

    Warns
    -----
    FoldynWarning
        The count of negative eigenvalues changes along the path, except at limit points that
        "mgdcm" and "arc_length" have located; or the path ends before `until` is reached.
    CrossingWarning
        Panels pass through each other at a point.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01))
    >>> supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    >>> case = fd.Case(s, supports, [fd.Force([0, 1], (-1e-3, 0, 0))])
    >>> path = trace(case, load_factors=[0.5, 1.0])
    >>> path.displacement.sel(node=0, axis="x").values.round(4).tolist()
    [-0.0176, -0.0348]
    """
    for place, time in release_times(of_kind("case", case, Case)).items():
        raise InputError(
            f" = {time:g}: a path has no time: give what is reached then, as in "
            'until = { node = 6, axis = "z", displacement = -0.03 }',
            f"{place}.until",
        )
    choice("method", method, METHODS)
    if steps is not None:
        check_steps(steps, case.structure.nodes.size)
    plan = plan_path(method, load_factors, steps, first_step, duration)
    if waiting(case) and plan.durations:
        raise InputError(": a path that takes time releases nothing; leave it out", "duration")
    steady = constant_numbers(case, constant)
    if initial is not None:
        displacement_of(initial, case, "initial")
    _check_case(case, plan, steady, adaptive_load is not None)
    given = {
        "method": method,
        "steps": plan.steps,
        "load_factors": load_factors,
        "duration": duration,
        "first_step": plan.first_step if plan.method.rule is not None else None,
        "constant": steady or None,
        "inertia_relief": flag("inertia_relief", inertia_relief),
    }
    until, adaptive_load = until_of(until, case), function("adaptive_load", adaptive_load)
    settings, progress = settings_of(settings), function("progress", progress)
    follow = partial(_follow, given, until, adaptive_load, settings, progress)
    if waiting(case):
        return trace_released(follow, case, plan, initial, until)
    return follow(case, plan, initial)


def _follow(
    given: Mapping[str, Any], until: Any, adaptive_load: AdaptiveLoad | None, settings: Settings,
    progress: Callable[[Point], None] | None, case: Case, plan: PathPlan, initial: State | None,
    watch: Callable[[NDArray, float], Any] | None = None,
) -> xarray.Dataset:  # fmt: skip
    """Path by a plan; see `trace`.

    given : facts about the run.
    watch : whether the path ends, as `until`, but also at its first point.
    """
    timed, steady = given["duration"] is not None, given["constant"] or ()
    displacement = None if initial is None else displacement_of(initial, case, "initial")
    check_fill(case.structure.fill, case.body.size)
    memory = case.memory_in(initial)
    if isinstance(memory, np.ndarray):  # it covers all branches: select those that evolve
        memory = memory[flowing(case, timed)]
    problem = OrigamiProblem(
        case, steady, displacement, adaptive_load, given["inertia_relief"],
        flow=FOLLOWED, memory=memory, timed=timed,
    )  # fmt: skip
    begin = 0.0 if initial is None else plan.begin
    _check_start(problem, begin)
    _check_driven(problem, begin, plan)
    _check_actuation(problem, plan)
    problem.begin(begin)
    refuse_mechanisms(problem, begin)
    solver = Solver(problem, settings)
    facts = {**given, "started_from": "rest" if initial is None else "state"}

    def stations() -> Walk:
        u = problem.start(begin)
        start = settle(solver, u, begin)
        if initial is None and not steady:  # energy released by the sheet without loads is not work
            problem.energy_at_rest = float(problem.energies(start.point.u, begin).sum())
        if watch is not None:  # work of the loads up to the first point
            forces = problem.working(u, begin) + problem.working(start.point.u, begin)
            facts[JUMP] = float(0.5 * forces @ (start.point.u - u))
        first = kept(problem, start)
        if first.point.factor != plan.begin:
            *_, first = walk(solver, first, [plan.begin], False)
        yield first
        onward = None
        if plan.method.rule is not None and plan.motion is not None:
            there = problem.displacement(first.point.u)
            onward = first.point.u - problem.state(there - plan.motion, begin)
        yield from along(solver, first, plan, onward)

    adaptive = adaptive_load is not None
    return record(stations(), progress, solver, problem, facts, until, adaptive, watch)


def check_steps(steps: Any, dofs: int) -> None:
    """Refuse steps that are not a positive whole number, or too many for memory."""
    count = whole("steps", steps, least=1)
    check_memory(
        "steps", f"a path of {float(count):.3g} points", 8.0 * COPIES * count * dofs, "take fewer"
    )


def constant_numbers(case: Case, constant: Any) -> tuple[int, ...]:
    """Numbers of the loads that are constant along the path."""
    if isinstance(constant, str):
        if constant != "gravity":
            raise InputError(
                f' = {show(constant)}: give "gravity", or numbers of loads, as in [0]', "constant"
            )
        chosen = tuple(i for i, load in enumerate(case.loads) if isinstance(load, Gravity))
        if not chosen:
            raise InputError(' = "gravity": the case has no Gravity among its loads', "constant")
        return chosen
    constant = single(constant)
    if isinstance(constant, Sized) and not len(constant):
        return ()
    chosen = sorted(indices("constant", constant, "load", 'or "gravity"'))
    for which in chosen:
        if not 0 <= which < len(case.loads):
            raise InputError(
                f": the case has no load {which}; it has {len(case.loads)}, counted from 0",
                "constant",
            )
    return tuple(chosen)


def displacement_of(
    state: Any, case: Case, field: str, expected: str = "a State, as fd.initial_state(path, at=-1)"
) -> NDArray:
    """Displacements (n, 3) of a case in a state, zero if it has none."""
    if not isinstance(state, State):
        raise InputError(f": got {type(state).__name__}; give {expected}", field)
    displacement = state.of_nodes("displacement", case.structure.nodes.shape, field)
    check_tied(case, displacement, field)
    return displacement


def _check_case(case: Case, plan: PathPlan, constant: Sequence[int], adaptive: bool) -> None:
    """Refuse a case in which nothing changes along the path."""
    case.check_movable()
    moves = is_actuated(case) or is_moved(case)
    if plan.method.name == "displacement" and not moves:
        raise InputError(
            " 'displacement' needs something that moves: an Impose among the supports, an Actuate "
            "among the loads, or a plane of contact; paths under forces take 'newton' or "
            "'arc_length'",
            "method",
        )
    if not plan.factors and plan.begin == 0.0 and plan.method.rule is None:
        return  # one point, under constant loads
    if not (drives(case, constant) or adaptive):
        raise InputError(
            "nothing grows along the path: give a Force, Gravity, Actuate, Impose, moving plane, "
            "or a cable or spring with a history, that is not among the constant loads "
            "(load_factors = [0] finds the state under these alone)"
        )


def _check_start(problem: OrigamiProblem, factor: float) -> None:
    """Refuse a start of the path at which a bar has collapsed or parts have crossed."""
    structure, u = problem.structure, problem.start(factor)
    check_contact(problem.case, problem.displacement(u), problem.planes(u))
    x = structure.nodes + problem.displacement(u)
    length = np.linalg.norm(x[structure.bars[:, 1]] - x[structure.bars[:, 0]], axis=1)
    short = np.flatnonzero(~(length > SHORTEST * structure.bar_length))
    if short.size:
        one, other = structure.bars[short[0]]
        raise InputError(f": the neighboring nodes {one} and {other} coincide", "initial")


def _check_driven(problem: OrigamiProblem, begin: float, plan: PathPlan) -> None:
    """Refuse load factors at which supports and planes have passed through each other."""
    if problem.case.contact is None or not is_moved(problem.case):
        return
    ends = [begin, *plan.factors, *([] if plan.end is None else [plan.end])]
    between = [np.linspace(a, b, LOOKS) for a, b in itertools.pairwise(ends)]

    def states() -> Iterator[tuple[str, NDArray, NDArray]]:
        for factor in np.concatenate([ends[:1], *between]).tolist():
            u = problem.start(factor).copy()
            u[problem.held] = problem.prescribed(factor)
            yield f"the load factor {factor:.6g}", problem.displacement(u), problem.planes(u)

    check_driven(problem.case, states())


def _check_actuation(problem: OrigamiProblem, plan: PathPlan) -> None:
    """Refuse load factors at which a rest angle would leave 0 to 360 degrees."""
    if not problem.actuation.acts:
        return
    for factor in (plan.begin, *plan.factors, *([] if plan.end is None else [plan.end])):
        beyond = np.flatnonzero(np.isnan(problem.actuation.rest(factor)))
        if beyond.size:
            raise InputError(
                f": at {factor:g} the rest angle of crease {beyond[0]} would leave 0 "
                "to 360 degrees; actuated folds reach their angle at the factor 1",
                "load_factors",
            )


def refuse_mechanisms(problem: OrigamiProblem, factor: float = 0.0) -> None:
    """Refuse a case whose supports or members leave a mechanism, naming its motions.

    factor : load factor at the start, where planes in contact also hold the structure.

    Raises
    ------
    InputError
        The structure can move without strain.
    """
    names = mechanisms(problem, factor)
    if names:
        raise InputError(
            f"the structure can move freely: {'; '.join(names)}. Statics needs supports (and bars "
            "and hinges) that resist every motion: hold what moves, or take inertia_relief = true "
            "for a free body"
        )


def mechanisms(problem: OrigamiProblem, factor: float = 0.0) -> list[str]:
    """Free motions in words: rigid motions or, if there are none, internal mechanisms."""
    structure = problem.structure
    start = problem.start(factor)
    body = problem.body(start, 0.0)
    x, q = structure.nodes + problem.displacement(start), problem.dofs(start)
    rigid = name_rigid_motions(x, problem.pinned, body.holds(q))
    unstrained = None if rigid else body.unstrained(q)
    if unstrained is None:
        return rigid
    return [_name(mode.reshape(-1, 3)) for mode in free_modes(problem, unstrained).T]


def _name(mode: NDArray) -> str:
    """An internal mechanism (n, 3) in words: its nodes, and its axis if it has one."""
    size = np.linalg.norm(mode, axis=1)
    moving = np.flatnonzero(size > MOVED * size.max())
    moving = moving[np.argsort(-size[moving], kind="stable")]
    nodes = ", ".join(map(str, sorted(moving[:MOST_NAMED].tolist())))
    more = f" and {len(moving) - MOST_NAMED} more" if len(moving) > MOST_NAMED else ""
    share = (mode[moving] ** 2).sum(axis=0)
    axis = int(np.argmax(share))
    along = f" along {AXES[axis]}" if share[axis] > 0.9 * share.sum() else ""
    plural = "s" if len(moving) > 1 else ""
    return f"internal mechanism that moves node{plural} {nodes}{more}{along}"


def free_modes(problem: OrigamiProblem, unstrained: Unstrained) -> NDArray:
    """Orthonormal motions (m, k) of the free dofs that strain nothing."""
    free = problem.free
    matrix = problem.case.constraints.matrix(unstrained.tangent)[free][:, free].tocsc()
    diagonal = matrix.diagonal()
    if not (diagonal > 0.0).all():
        return _unresisted(problem, diagonal)
    scale = 1.0 / np.sqrt(diagonal)  # scaled so that all pivots are of similar size
    scaled = sparse.csc_array(matrix.multiply(scale[:, None]).multiply(scale[None, :]))
    size = len(free)
    factors = factorized(sparse.csc_array(scaled + SHIFT * sparse.eye_array(size, format="csc")))
    if _softest(factors, size) > SUSPICIOUS:
        return np.zeros((len(diagonal) + len(problem.held), 0))
    values, vectors = softest_modes(scaled, factors, MOST_MODES, dense=600, shift=-SHIFT)
    vectors = vectors[:, np.argsort(values, kind="stable")[:MOST_MODES]]
    shapes = np.zeros((size + len(problem.held), vectors.shape[1]))
    shapes[free] = vectors * scale[:, None]
    shapes = problem.dofs(shapes)
    kept = [k for k, mode in enumerate(shapes.T) if _strains_nothing(unstrained, mode)]
    return np.linalg.qr(shapes[:, kept])[0] if kept else shapes[:, :0]


def _softest(factors: Factorization, size: int) -> float:
    """Upper bound of the smallest eigenvalue, by a few inverse iterations."""
    value, guess = np.inf, np.random.default_rng(0).standard_normal(size)
    for _ in range(INVERSE_ITERATIONS):
        guess = guess / np.linalg.norm(guess)
        guess = factors.solve(guess)
        value = 1.0 / float(np.linalg.norm(guess))
    return value


def _unresisted(problem: OrigamiProblem, diagonal: NDArray) -> NDArray:
    """Motions of single dofs that no member touches."""
    loose = problem.free[diagonal <= 0.0]
    modes = np.zeros((problem.structure.nodes.size, len(loose)))
    modes[loose, np.arange(len(loose))] = 1.0
    return problem.case.constraints.displacement(modes)


def _strains_nothing(unstrained: Unstrained, mode: NDArray) -> bool:
    """Whether the strain of a mode is round-off."""
    if unstrained.stretch(mode) > BAR_STRAIN:
        return False
    turned = float(mode @ (unstrained.hinges @ mode))
    return turned <= HINGE_STRAIN**2 * float(unstrained.hinges.diagonal() @ mode**2)
