"""`simulate` integrates a motion from an initial state; `prepare` checks its input first."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from foldyn.algebra.solvers import check_fill
from foldyn.cases import Case, Dashpot, Rayleigh, State
from foldyn.cases.releases import release_times, waiting
from foldyn.dynamics import generalized_alpha, timing
from foldyn.dynamics.checkpoint import SECONDS, check_keeping
from foldyn.dynamics.gpu.checks import check_gpu, check_taken
from foldyn.dynamics.inertia import check_mass, is_lumped
from foldyn.dynamics.initial import (
    MODAL,
    check_start,
    check_steady,
    check_touching,
    warn_of_standing_in_wind,
    warn_of_unstable_damping,
)
from foldyn.dynamics.linear_motion import LinearMotion, prepare_linear
from foldyn.dynamics.method_choice import AUTO, Choice, choose
from foldyn.dynamics.methods import METHODS, Integrator, method_of, suited, suiting
from foldyn.dynamics.modal_damping import modal_rows
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.motion_state import StepPlan
from foldyn.dynamics.progress import Reporter
from foldyn.dynamics.releases import ReleasedMotion, prepare_released
from foldyn.dynamics.sampling import Sampler
from foldyn.dynamics.system import pack
from foldyn.errors import InputError, warn
from foldyn.results import Quantity
from foldyn.values import choice, flag, number, of_kind

if TYPE_CHECKING:
    import xarray

DAMPING_COST = 10.0  # factor by which beta may shrink the critical step without a warning
MANY_STEPS = 20_000_000  # number of steps above which the user is warned
TOLERANCE = 1e-6  # default relative error of adaptive steps
IMPLICIT_TOLERANCE = 1e-5  # default for methods of order 2; gives 130 steps per period
FLOOR = 1e-8  # least displacement that errors are relative to, as a share of the longest bar
FINER = 4  # factor to shorten steps of central differences that were too long


def simulate(
    case: Case,
    duration: float,
    *,
    method: str = AUTO,
    dt: float | None = None,
    every_steps: int | None = None,
    interval: float | None = None,
    initial: State | None = None,
    force: bool = False,
    tolerance: float | None = None,
    start: float = 0.0,
    progress: bool | Reporter | None = None,
    spectral_radius: float | None = None,
    sample: Mapping[str, Callable[..., Any] | Quantity] | None = None,
    store: str | os.PathLike[str] | None = None,
    checkpoint: float = SECONDS,
    resume: bool = False,
    device: str = "cpu",
) -> xarray.Dataset:
    """Integrate M x'' + C x' + F_int(x) = p(t) from an initial state.

    Parameters
    ----------
    case : Case
    duration : float
        Simulated time (s). The last step ends at or before this time.
    method : str, default "auto"
        Name of an integrator in the list of `foldyn info`. "auto" picks the one expected to be
        fastest, and switches to another if the energies do not balance; the documentation has a
        page on integrators. For superelements it is "modal", which superposes modes with exact
        steps: give `interval` and, at most, `tolerance`.
    dt : float, optional
        Time step (s). Explicit methods: by default half the critical step, shortened to divide
        `interval`. Implicit methods and `dormand_prince` choose their steps by error control: `dt`
        alone fixes the step of an implicit method; with `tolerance`, `dt` is the largest step.
    every_steps : int, optional
        Number of steps between samples; by default every step is sampled.
    interval : float, optional
        Time between samples (s), instead of `every_steps`.
    initial : State, optional
        Displacement and velocity at the start; rest by default. Supported nodes stay at their
        initial positions, base motions start there, and imposed displacements must agree with them.
    force : bool, default False
        Integrate even if the step is above the critical step.
    tolerance : float, optional
        Relative error per step of adaptive methods, by default 1e-6 with `dormand_prince`, 1e-5
        with implicit methods: error of displacement and velocity at the worst node, relative to the
        largest values so far in the motion.
    start : float, default 0.0
        Time (s) of the first sample. Set it to continue a stored motion, so that histories go on.
    progress : bool or callable, optional
        True shows a bar; a callable gets a `Progress` several times a second.
    spectral_radius : float, optional
        For `generalized_alpha`: factor by which a step multiplies the fastest vibrations, from 0
        (removed) to 1 (kept); 0.8 by default.
    sample : mapping of str to callable or Quantity, optional
        Further variables of the result: functions of displacement (n, 3), m, velocity (n, 3),
        m/s, and time, s, that return a number or an array. ``fd.Quantity(units, text, dims,
        function)`` adds unit, meaning and dimensions. Functions are evaluated at every sample.
    store : path, optional
        File for the result, such as "run.nc". Samples then go to disk as they are computed, into
        the folder "run.nc.unfinished", so that memory does not limit the length of the motion.
    checkpoint : float, default 60.0
        With `store`: computing time (s) between checkpoints, from which the motion can resume.
    resume : bool, default False
        With `store`: resume the same motion from the last checkpoint of an interrupted run, with
        bit-identical results; without a checkpoint it starts from the beginning. A finished motion
        is read from its file.
    device : {"cpu", "gpu"}
        Where steps are computed; "gpu" needs an NVIDIA GPU and numba-cuda, an explicit method with
        fixed steps, and bars and hinges. The documentation has a page on when it pays off.

    Returns
    -------
    xarray.Dataset
        `displacement` (m) and `velocity` (m/s) with dimensions time, node, axis; `reaction` (N) at
        supported dofs; energies (J): `kinetic`, `strain_bars`, `strain_folds`, `strain_bends`,
        `dissipated`, `work` (of loads, moving supports and actuated folds). The first sample is
        at the start. Attributes hold the statistics of the run; the dataset also contains the case
        (`foldyn.case_of`). With `store`, variables are read from the file on first use, as by
        ``fd.load("run.nc", whole=False)``.

    Raises
    ------
    InputError
        An argument out of range, a step above the critical one, a free node without mass, or an
        interrupted motion that differs from this one; the message names what differs.
    ComputationError
        A function of `sample` failed, changed its shape or returned a value that is not finite,
        after the start. Or the disk is full; the last checkpoint remains, to resume from.
    InstabilityError, PenetrationError
        The motion grew without bound or became NaN; panel passed through panel. The exception's
        `partial` holds the samples computed so far.

    Warns
    -----
    FoldynWarning
        The energy balance is off by more than 1 % of the energies at play, or it was, and "auto"
        has repeated the motion with another method or step.
    CrossingWarning
        Panels pass through each other at one of the checked samples.

    Notes
    -----
    Histories are evaluated at every stage time t_n + c dt with t_n = start + n dt. The damping
    matrices, alpha M + beta K0 and modal damping, are constant: K0 and the modes are taken at rest
    or, if the damping has state = "initial", in the state where the motion began: the initial
    displacement or, if `initial` is a sample of a motion, the start of that motion. Dashpots
    between nodes and damped creases follow the motion. Supports and planes with `until` are
    released then: the motion goes on without them, and what they had stored is dissipated.
    """
    keeping = None if store is None else check_keeping(store, checkpoint, resume)
    if store is None and flag("resume", resume):
        raise InputError(": there is nothing to resume; name the file of the result", "store")
    motion = prepared(
        case, duration, method, dt=dt, every_steps=every_steps, interval=interval, initial=initial,
        force=force, tolerance=tolerance, start=start, spectral_radius=spectral_radius,
        sample=sample, kept=keeping is not None, device=device,
    )  # fmt: skip
    return motion.run(progress) if keeping is None else motion.run_into_file(keeping, progress)


def prepared(
    case: Case, duration: float, method: str = AUTO, **given: Any
) -> Motion | LinearMotion | ReleasedMotion:
    """As `prepare`, for linear models and motions with releases, too."""
    if of_kind("case", case, Case).structure.linear:
        return prepare_linear(case, duration, method, **given)
    if isinstance(method, str) and method == MODAL:
        raise InputError(
            f" = {MODAL!r}: superposes modes of linear models (fd.superelements); this one takes "
            f"{AUTO} or one of {', '.join(METHODS)}",
            "method",
        )
    duration = number("duration", duration, above=0.0)
    start = float(number("start", given.get("start", 0.0), unit="s"))
    if waiting(case) or any(time < start + duration for time in release_times(case).values()):
        given |= {"method": method, "start": start}
        return prepare_released(case, duration, prepare, **given)
    return prepare(case, duration, method, **given)


def prepare(
    case: Case,
    duration: float,
    method: str = AUTO,
    dt: float | None = None,
    every_steps: int | None = None,
    interval: float | None = None,
    initial: State | None = None,
    force: bool = False,
    tolerance: float | None = None,
    start: float = 0.0,
    spectral_radius: float | None = None,
    sample: Mapping[str, Callable[..., Any] | Quantity] | None = None,
    kept: bool = False,
    device: str = "cpu",
) -> Motion:
    """Check all input of `simulate` and choose the step, without computing the motion.

    Arguments and exceptions are the same as for `simulate`; `Motion.run` starts the motion. With
    `kept`, samples go to disk and may exceed the memory.
    """
    of_kind("case", case, Case)
    choice("method", method, (*METHODS, AUTO))
    if choice("device", device, ("cpu", "gpu")) == "gpu":
        method = "rk4" if method == AUTO else method
        check_gpu(method)
    integrator = method_of("rk4") if method == AUTO else suited(method, case)
    duration = number("duration", duration, above=0.0)
    force = flag("force", force)
    case.check_movable()
    sampling = timing.sampling(duration, every_steps, interval)
    start = number("start", start, unit="s")
    u, v = check_start(case, initial)
    check_touching(case, u, float(start), float(start) + duration)
    remembered = case.memory_in(initial)
    origin = (initial or State()).origin_of(u.shape, float(start))
    modal = modal_rows(case, origin)
    chosen = Choice(integrator.name, "")
    if method == AUTO:
        chosen = choose(
            case, u, v, float(start), duration, dt, sampling.interval, tolerance,
            IMPLICIT_TOLERANCE, modal,
        )  # fmt: skip
        integrator = suited(chosen.method, case)
    given, case = case, suiting(integrator, case)
    integrator = _with_radius(integrator, spectral_radius)
    if not integrator.implicit or not is_lumped(case.mass):
        check_mass(case.mass, case.constraints.determined)
    critical = integrator.critical_step(case, u, modal)
    plan = _plan(case, integrator, duration, dt, sampling, critical, force, tolerance, float(start))
    _warn_of_damping(case, integrator, u, critical)
    warn_of_unstable_damping(case, origin)
    warn_of_standing_in_wind(case, v)
    timing.check_rounding(plan)
    if not force and plan.dt > critical:
        raise InputError(
            f" = {plan.dt:.6g} s is above the critical step of {critical:.6g} s: take a smaller "
            "one or leave dt out (force = true integrates all the same)",
            "dt",
        )
    if not kept:
        timing.check_samples(timing.expected_samples(plan), len(u), len(case.reaction_dofs))
    if integrator.implicit:
        check_fill(case.structure.fill, case.body.size)
    check_steady(case, plan.start, plan.end)
    if plan.steps:
        timing.warn_of_coarse_steps(case, plan, integrator.looks, integrator.implicit)
    elif integrator.implicit:
        timing.warn_of_functions(case)
    steps = (plan.end - plan.start) / plan.dt
    if steps > MANY_STEPS:
        warn(
            f"{steps:.3g} steps of {plan.dt:.3g} s will take a long time (critical step "
            f"{critical:.3g} s; stiff bars, light nodes and strong damping make it small): take "
            'method = "generalized_alpha"',
            "integrators.md#steps",
        )
    hidden = integrator.hidden_inertia(case)
    packed = pack(case, timing.apart(plan, critical), origin, modal, hidden)
    if device == "gpu":
        check_taken(case, packed)
    sampler = Sampler(case, sample, u, v, plan.start)
    start_from = u, v, remembered, initial.continuation if initial else None
    better = None
    if chosen.better:
        if chosen.better == chosen.method:
            dt, every_steps, interval = plan.dt / FINER, plan.every * FINER, None
        better = partial(
            prepare, given, duration, chosen.better, dt, every_steps, interval, initial, force,
            tolerance, start, None, sample, kept,
        )  # fmt: skip
    return Motion(
        case, integrator, plan, critical, force, start_from, origin, packed, sampler, chosen.reason,
        better, device,
    )  # fmt: skip


def _with_radius(method: Integrator, spectral_radius: float | None) -> Integrator:
    """The method with a spectral radius, if one is given."""
    if spectral_radius is None:
        return method
    if method.name != "generalized_alpha":
        raise InputError(
            f" = {spectral_radius!r}: {method.name} has none; leave it out, or "
            "choose generalized_alpha",
            "spectral_radius",
        )
    radius = number("spectral_radius", spectral_radius, least=0.0, most=1.0)
    return replace(method, scheme=generalized_alpha.scheme(radius))


def _plan(
    case: Case, method: Integrator, duration: float, dt: float | None,
    sampling: timing.SampleSpacing, critical: float, force: bool, tolerance: float | None,
    start: float,
) -> StepPlan:  # fmt: skip
    """Plan of steps and samples that the arguments of `simulate` define."""
    if tolerance is not None:
        number("tolerance", tolerance, above=0.0)
        if not method.adaptive and not method.implicit:
            raise InputError(
                f" = {tolerance!r}: {method.name} has fixed steps; give dt, or choose "
                "dormand_prince or an implicit method",
                "tolerance",
            )
    if method.adaptive or (method.implicit and (dt is None or tolerance is not None)):
        default = IMPLICIT_TOLERANCE if method.implicit else TOLERANCE
        largest = math.inf if force else critical
        tolerance, floor = tolerance or default, FLOOR * case.body.sheet.longest()
        return timing.variable_steps(
            duration, dt, sampling, largest, start, tolerance, floor, timing.knots(case)
        )
    return timing.fixed_steps(duration, dt, sampling, critical, start)


def _warn_of_damping(case: Case, method: Integrator, u: NDArray, critical: float) -> None:
    """Warn if damping other than alpha makes the critical step very small."""
    if not math.isfinite(critical) or not case.damped:
        return
    fast = [f"beta = {case.rayleigh.beta:g} s"] if case.rayleigh.beta > 0.0 else []
    fast += ["the dashpots"] if case.dashpots else []
    fast += ["the damping of the creases"] if case.crease_damping.any() else []
    fast += ["the damping of strain rates"] if case.strain_damping else []
    if not fast:
        return
    supports = [support for support in case.supports if not isinstance(support, Dashpot)]
    slow = replace(case, damping=Rayleigh(case.rayleigh.alpha), supports=supports)
    without = method.critical_step(slow, u)
    if without > DAMPING_COST * critical:
        warn(
            f"{' and '.join(fast)} make{'' if len(fast) > 1 or case.dashpots else 's'} "
            f"the critical step {without / critical:.0f} "
            f"times smaller ({critical:.3g} s instead of {without:.3g} s): an explicit method must "
            "resolve the damping of the fastest vibration; an implicit one need not: "
            'method = "generalized_alpha" (alpha costs nothing)',
            "damping.md#in-the-analyses",
        )
