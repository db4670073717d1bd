"""`simulate`: the motion of a case from an initial state, and what makes it ready to run."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, Rayleigh, State
from foldyn.dynamics import outcome
from foldyn.dynamics.audit import AUDITED, energy_error, energy_scale
from foldyn.dynamics.critical_step import MARGIN, critical_step, largest_frequency
from foldyn.dynamics.methods import Method, method_of
from foldyn.dynamics.progress import Progress, Reporter, reporter
from foldyn.dynamics.stability import is_stable, stability_limit
from foldyn.dynamics.system import pack, scratch
from foldyn.dynamics.timing import Schedule, check_memory, positive, schedule
from foldyn.errors import (
    FoldynWarning,
    InputError,
    InstabilityError,
    MotionInterrupted,
    PenetrationError,
)
from foldyn.mechanics import angles, workspace
from foldyn.results import trajectory_dataset

if TYPE_CHECKING:
    import xarray

DAMPING_COST = 10.0  # shrinking of the critical step by beta above which the user is told
MANY_STEPS = 20_000_000  # beyond which the user is told before the run
RECHECKS = 20  # of the critical step during a motion
CHUNK = 256  # steps of the first stretch; later ones take about REPORT_EVERY seconds
REPORT_EVERY = 0.25
INACCURATE = 1e-2  # relative energy error above which the user is warned
EXPLODED = 1.0  # and above which the motion is stopped


def simulate(
    case: Case,
    duration: float,
    method: str = "rk4",
    dt: float | None = None,
    every: int | float = 1,
    initial: State | None = None,
    force: bool = False,
    progress: bool | Reporter | None = None,
) -> xarray.Dataset:
    """Integrate M x'' + C x' + F_int(x) = p(t) from an initial state.

    Parameters
    ----------
    case : Case
    duration : float
        Simulated time (s). The last step is the last that does not go beyond it.
    method : {"rk4", "central_difference"}
        Integrator.
    dt : float, optional
        Time step (s). Without it, half the critical step, shortened to divide `every`.
    every : int or float, default 1
        Sampling interval: an int counts steps, a float is seconds.
    initial : State, optional
        Displacement and velocity at t = 0; rest by default. Supported nodes stay where it
        puts them.
    force : bool, default False
        Integrate even with a step above the critical one.
    progress : bool or callable, optional
        True shows a bar; a callable gets a `Progress` several times a second.

    Returns
    -------
    xarray.Dataset
        `displacement` (m) and `velocity` (m/s) with dimensions time, node, axis; `reaction` (N)
        at supported dofs; energies (J): `kinetic`, `strain_bars`, `strain_folds`,
        `strain_bends`, `dissipated`, `work`. First sample at t = 0. Attributes hold the
        statistics of the run; the case travels along (`foldyn.case_of`).

    Raises
    ------
    InputError
        An argument out of range, a step above the critical one, a free node without mass.
    InstabilityError, PenetrationError
        The motion grew without bound or became NaN; panel passed through panel. What was
        computed until then is in the exception's `partial`.

    Warns
    -----
    FoldynWarning
        The energy balance is off by more than 1 % of the energies at play.

    Notes
    -----
    Histories are evaluated at every stage time t_n + c dt with t_n = n dt. Damping is
    C = alpha M + beta K0, K0 the tangent at rest.
    """
    return prepare(case, duration, method, dt, every, initial, force).run(progress)


def prepare(
    case: Case,
    duration: float,
    method: str = "rk4",
    dt: float | None = None,
    every: int | float = 1,
    initial: State | None = None,
    force: bool = False,
) -> Motion:
    """Check everything that `simulate` checks and choose the step, without computing a motion.

    Arguments and exceptions are those of `simulate`; the motion starts with `Motion.run`.
    """
    if not isinstance(case, Case):
        raise InputError(f"case: got {type(case).__name__}, give a Case")
    integrator = method_of(method)
    positive("duration", duration)
    if not isinstance(force, bool):
        raise InputError(f"force = {force!r}: give True or False")
    if not len(case.free_dofs):
        raise InputError(
            "supports: hold every node along x, y and z, so that nothing can move: free one"
        )
    start = _start(case, initial)
    packed = pack(case)
    critical = critical_step(case, method, start[0])
    plan = schedule(duration, dt, every, critical)
    _warn_of_damping(case, method, start[0], critical)
    if not force and plan.dt > critical:
        raise InputError(
            f"dt = {plan.dt:.6g} s is above the critical step of {critical:.6g} s: take a smaller "
            "one or leave dt out (force = true integrates all the same)"
        )
    check_memory(plan.samples, len(start[0]), len(case.supported_dofs))
    if plan.steps > MANY_STEPS:
        warnings.warn(
            f"{plan.steps:.3g} steps of {plan.dt:.3g} s are a long way (critical step "
            f"{critical:.3g} s); stiff bars, light nodes and strong damping make it small",
            FoldynWarning,
            stacklevel=3,
        )
    return Motion(case, integrator, plan, critical, force, start, packed)


def _start(case: Case, initial: State | None) -> tuple[NDArray, NDArray]:
    """Displacement and velocity at t = 0, checked."""
    if initial is not None and not isinstance(initial, State):
        raise InputError(
            f"initial: got {type(initial).__name__}; give a State: fd.State(displacement=..., "
            "velocity=...) or fd.initial_state(result)"
        )
    shape = case.structure.nodes.shape
    pair = []
    for name in ("displacement", "velocity"):
        value = getattr(initial, name, None)
        array = np.zeros(shape) if value is None else np.array(value, float)
        if array.shape != shape:
            raise InputError(f"initial: {name} of shape {array.shape}: the case has {shape}")
        pair.append(np.ascontiguousarray(array))
    if (pair[1][case.fixed] != 0.0).any():
        node = int(np.argwhere((pair[1] != 0.0) & case.fixed)[0][0])
        raise InputError(f"initial: velocity of node {node} is not zero along a supported axis")
    return pair[0], pair[1]


def _warn_of_damping(case: Case, method: str, u: NDArray, critical: float) -> None:
    """Say so where stiffness-proportional damping makes an explicit step very small."""
    if case.damping.beta == 0.0:
        return
    without = critical_step(replace(case, damping=Rayleigh(case.damping.alpha)), method, u)
    if without > DAMPING_COST * critical:
        warnings.warn(
            f"beta = {case.damping.beta:g} s makes the critical step {without / critical:.0f} "
            f"times smaller ({critical:.3g} s instead of {without:.3g} s): an explicit method must "
            "resolve the damping of the fastest vibration; alpha costs nothing",
            FoldynWarning,
            stacklevel=4,
        )


class Motion:
    """A motion that is ready to be computed; made by `prepare`."""

    def __init__(
        self, case: Case, method: Method, plan: Schedule, critical: float, force: bool,
        start: tuple[NDArray, NDArray], packed: Any,
    ) -> None:  # fmt: skip
        self.case, self.method, self.plan = case, method, plan
        self.critical, self.force = critical, force
        self._start, self._packed = start, packed
        self.stored = 0
        self.seconds = 0.0

    def run(self, progress: bool | Reporter | None = None) -> xarray.Dataset:
        """Integrate the motion; see `simulate`."""
        n, samples = len(self.case.structure.nodes), self.plan.samples
        self.displacement = np.empty((samples, n, 3))
        self.velocity = np.empty((samples, n, 3))
        self.reaction = np.empty((samples, len(self.case.supported_dofs)))
        self.energy = np.empty((samples, len(AUDITED)))
        self.stored = 0
        self._integrate(*reporter(progress))
        return self._finish()

    def _integrate(self, report: Reporter, close: Callable[[], None]) -> None:
        """Advance in stretches between which histories are tabulated and progress is told."""
        model, system, mass = self._packed
        u, v = self._start[0].copy(), self._start[1].copy()
        plan, work, memory = self.plan, workspace(model), scratch(len(u))
        tally, carry = np.zeros(4), np.zeros_like(u)
        angle = angles(model.rest + u, model.hinges)
        recheck = max(1000, -(-plan.steps // RECHECKS))
        first, length = 0, 0  # the first call only records t = 0: it may have to compile
        began = None
        try:
            while True:
                last = min(first + length, plan.steps, (first // recheck + 1) * recheck)
                row = -(-first // plan.every)
                rows = slice(row, last // plan.every + 1)
                clock = time.perf_counter()
                code, step, hinge = self.method.advance(
                    model, system, mass, u, v, carry, tally, plan.dt, first, last, plan.every,
                    self._factors(first, last), angle, self.displacement[rows],
                    self.velocity[rows], self.reaction[rows], self.energy[rows], work, memory,
                )  # fmt: skip
                clock = time.perf_counter() - clock
                began = time.perf_counter() if began is None else began
                self.seconds = time.perf_counter() - began
                self.stored = max(self.stored, self._complete(step, code))
                if code != outcome.DONE:
                    self._fail(code, step, hinge, model)
                report(Progress(last * plan.dt, plan.steps * plan.dt, last, self._audit()))
                if last == plan.steps:
                    return
                if last and last % recheck == 0 and not self.force:
                    self._recheck(last, u)
                first = last
                growth = REPORT_EVERY / max(clock, 1e-9)
                length = max(CHUNK, min(int(length * min(growth, 8.0)), 100_000))
        except KeyboardInterrupt:
            raise MotionInterrupted(
                f"interrupted at t = {first * plan.dt:.6g} s", self._dataset()
            ) from None
        finally:
            close()

    def _factors(self, first: int, last: int) -> NDArray:
        """Factors (steps, stages, histories) at t_n + c dt, t_n = n dt."""
        start = np.arange(first, last + 1) * self.plan.dt
        times = start[:, None] + self.method.stages[None, :] * self.plan.dt
        histories = [history for _, history in self.case.load_terms]
        try:
            columns = [np.asarray(history(times), float) for history in histories]
        except InputError as error:  # a callable that fails at some time during the motion
            raise InstabilityError(str(error), self._dataset()) from error
        return np.stack(columns, -1) if columns else np.zeros((*times.shape, 0))

    def _complete(self, step: int, code: int) -> int:
        """Samples that are known to be good after a stretch that ended at `step`."""
        done = step // self.plan.every + 1
        if code != outcome.DONE and step % self.plan.every == 0:
            done -= 1
        return done

    def _audit(self) -> float:
        """Relative energy error so far; raises where the energy has exploded."""
        energy = self.energy[: self.stored]
        error, scale = energy_error(energy), energy_scale(energy)
        stiffness = self.case.structure.model.bar_stiffness
        negligible = 1e-24 * float((stiffness * self.case.structure.bar_length.max() ** 2).sum())
        if scale <= negligible:
            return 0.0
        relative = np.abs(error) / scale
        worst = float(relative.max())
        if worst > EXPLODED:
            bad = int(np.argmax(relative > EXPLODED))
            self.stored = bad
            raise InstabilityError(
                f"the motion is unstable: at t = {bad * self.plan.every * self.plan.dt:.6g} s the "
                f"energy balance is off by more than the energies at play; use a step below "
                f"{self.plan.dt:.3g} s (critical at the start: {self.critical:.3g} s)",
                self._dataset(),
            )
        return worst

    def _recheck(self, step: int, u: NDArray) -> None:
        """Stop where the structure has stiffened so much that the step is above its limit."""
        damping = self.case.damping.alpha, self.case.damping.beta
        omega = largest_frequency(self.case, u)
        if not is_stable(self.method.growth, omega, *damping, self.plan.dt):
            limit = stability_limit(self.method.growth, omega, *damping)
            raise InstabilityError(
                f"the structure has stiffened: at t = {step * self.plan.dt:.6g} s the step of "
                f"{self.plan.dt:.3g} s is above the stability limit of {limit:.3g} s; use "
                f"dt = {0.5 * MARGIN * limit:.3g} or smaller",
                self._dataset(),
            )

    def _fail(self, code: int, step: int, hinge: int, model: Any) -> None:
        moment = f"t = {step * self.plan.dt:.6g} s (step {step})"
        if self.plan.dt > self.critical:
            moment += f", with a step above the critical one of {self.critical:.3g} s,"
        if code == outcome.PENETRATION:
            j, k, i, l = model.hinges[hinge].tolist()  # noqa: E741
            raise PenetrationError(
                f"at {moment} panel passed through panel: the dihedral about nodes {j}-{k} (wings "
                f"{i}, {l}) jumped by more than pi; a fold law that locks (EnhancedLinear) or a "
                "smaller step keeps panels apart",
                self._dataset(),
            )
        raise InstabilityError(
            f"at {moment} the motion is no longer finite: the step of {self.plan.dt:.3g} s is too "
            f"large (critical at the start: {self.critical:.3g} s) or a load is not finite",
            self._dataset(),
        )

    def _dataset(self) -> xarray.Dataset:
        """Samples stored so far, with the case and the statistics."""
        plan, n = self.plan, self.stored
        statistics = {
            "method": self.method.name,
            "dt": plan.dt,
            "steps": plan.steps,
            "duration": plan.steps * plan.dt,
            "every": plan.every,
            "critical_step": self.critical,
            "wall_seconds": self.seconds,
            "energy_error": self._relative_error(),
            "started_from": "rest" if self._at_rest() else "state",
        }
        energies: dict[str, NDArray] = dict(zip(AUDITED, self.energy[:n].T, strict=True))
        times = np.arange(n) * plan.every * plan.dt
        return trajectory_dataset(
            self.case, times, self.displacement[:n], self.velocity[:n], self.reaction[:n],
            energies, statistics,
        )  # fmt: skip

    def _at_rest(self) -> bool:
        return not (self._start[0].any() or self._start[1].any())

    def _relative_error(self) -> float:
        energy = self.energy[: self.stored]
        if not len(energy):
            return 0.0
        scale = energy_scale(energy)
        return float(np.abs(energy_error(energy)).max() / scale) if scale > 0.0 else 0.0

    def _finish(self) -> xarray.Dataset:
        """Dataset of the whole motion; warns where its energy balance is poor."""
        error = self._audit()
        if error > INACCURATE:
            warnings.warn(
                f"the energy balance of the motion is off by {error:.1%} of the energies at play: "
                f"use a step smaller than {self.plan.dt:.3g} s",
                FoldynWarning,
                stacklevel=3,
            )
        return self._dataset()
