"""`LinearMotion`: a motion of superelements, with as many modes as it takes."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case, Continuation, State
from foldyn.cases.air import refuse_wind
from foldyn.cases.constraints import AGREES
from foldyn.cases.releases import refuse_releases
from foldyn.cases.springs import refuse_driven
from foldyn.dynamics import timing
from foldyn.dynamics.audit import audited, energy_error
from foldyn.dynamics.in_memory import InMemory
from foldyn.dynamics.initial import MODAL, check_imposed, check_start, check_steady
from foldyn.dynamics.method_choice import AUTO
from foldyn.dynamics.motion_state import Samples, StepPlan, samples
from foldyn.dynamics.progress import Progress, Reporter
from foldyn.dynamics.sampling import Sampler, SamplingError
from foldyn.dynamics.superposition import Bases, Matrices, Steps, Superposition, matrices, steps_of
from foldyn.errors import ComputationError, InputError, ModelRangeWarning, warn
from foldyn.results import Quantity, trajectory_dataset
from foldyn.structures.beyond_range import TURN, far_turn, panel_turns
from foldyn.values import number

if TYPE_CHECKING:
    import xarray

SAMPLES = 2000  # by default
WHOLE = 4.0  # a step limit, relative to the duration, that limits no step
LEFT_OUT = 1e-3  # default share of the displacements that modes may leave out
FEWEST, MOST = 32, 512  # modes: twice as many each time until the motion no longer changes
LOOK = 100  # samples between two reports of progress


def prepare_linear(
    case: Case, duration: float, method: str, *, interval: float | None = None,
    initial: State | None = None, tolerance: float | None = None, start: float = 0.0,
    sample: Mapping[str, Callable[..., Any] | Quantity] | None = None, kept: bool = False,
    **others: Any,
) -> LinearMotion:  # fmt: skip
    """Check the input of `driver.simulate` for a linear model."""
    steps = {"method": None if method in (AUTO, MODAL) else method}
    for name, given in {**steps, **others}.items():
        if given is not None and given is not False and given != "cpu":
            raise InputError(
                f" = {given!r}: motions of {case.structure.linear} superpose modes, and their "
                "steps are exact: leave it out, and give the interval of the samples",
                name,
            )
    _refuse_nonlinear(case)
    duration = number("duration", duration, above=0.0)
    start = float(number("start", start, unit="s"))
    if tolerance is not None:
        number("tolerance", tolerance, above=0.0)
    sampling = timing.sampling(duration, None, duration / SAMPLES if interval is None else interval)
    plan = timing.fixed_steps(duration, None, sampling, WHOLE * duration, start)
    timing.check_rounding(plan)
    if not kept:
        size = len(case.structure.nodes), len(case.reaction_dofs)
        timing.check_samples(timing.expected_samples(plan), *size)
    check_steady(case, plan.start, plan.end)
    timing.warn_of_functions(case)
    u, v = check_start(case, initial)
    imposed = ((float(history(start)) * shape) for shape, history in case.imposed_terms)
    check_imposed(case, u, sum(imposed, np.zeros_like(u)))
    sampler = Sampler(case, {} if sample is None else sample, u, v, start)
    return LinearMotion(case, plan, initial, sampler, tolerance or LEFT_OUT)


def _refuse_nonlinear(case: Case) -> None:
    """Refuse what a linear equation of motion leaves out."""
    refuse_wind(case, "motions of superelements")
    if case.air is not None and case.air.drag:
        raise InputError(
            ".drag: grows with the square of the velocity, and motions of superelements are "
            "linear: give drag = false, or take bars and hinges",
            "air",
        )
    refuse_driven(case, "motions of superelements")
    bars = "leave it out, or take bars and hinges, or a shell"
    refuse_releases(case, "a motion of superelements", bars)
    if case.remembering:
        raise InputError(
            f": {case.remembering[0].law.name} has memory, which motions of superelements leave "
            "out: take an elastic law with CreaseDamping, or bars and hinges",
            "fold_law",
        )


class LinearMotion(InMemory):
    """A motion of superelements that is ready to be computed; see `driver.prepared`."""

    kind = MODAL

    def __init__(
        self, case: Case, plan: StepPlan, initial: State | None, sampler: Sampler,
        tolerance: float,
    ) -> None:  # fmt: skip
        self.case, self.plan, self._initial, self._sampler = case, plan, initial, sampler
        self._tolerance = tolerance
        terms = (
            *case.load_terms, *case.following_terms, *case.rest_terms, *case.imposed_terms,
            *case.base_terms,
        )  # fmt: skip
        self.histories = list(dict.fromkeys(history for _, history in terms))

    @property
    def expected_samples(self) -> int:
        """Number of samples."""
        return timing.expected_samples(self.plan)

    def _computed(self, report: Reporter) -> xarray.Dataset:
        began, case, plan = time.perf_counter(), self.case, self.plan
        model, steps, momentum, bases = self._begun(FEWEST)
        modes, before, missing = min(FEWEST, bases.most), None, 0.0
        while True:
            equation = Superposition(model, bases.basis(modes))
            if modes == bases.most:
                break
            moved = _displacements(equation, steps, momentum, case.structure.nodes.size)
            if before is not None:
                largest, change = (float(np.abs(one).max()) for one in (moved, moved - before))
                missing = change / largest if largest else 0.0
                if missing <= self._tolerance or modes >= MOST:
                    break
            modes, before = min(2 * modes, bases.most), moved
        missing = 0.0 if modes == bases.most else missing
        out, end = self._sampled(model, equation, steps, momentum, report)
        self._take(out)
        self._warn(out, missing)
        names = audited(case.energy_groups, case.air is not None)
        values, known = self._sampler.columns(len(out.time)), self._sampler.known
        facts = {
            "method": MODAL,
            "start": plan.start,
            "duration": plan.end - plan.start,
            "dt": float(steps.lengths.max()),
            "interval": plan.interval or (plan.end - plan.start) / max(len(out.time) - 1, 1),
            "steps": len(steps.lengths),
            "critical_step": math.inf,
            "modes": modes,
            "left_out": missing,
            "wall_seconds": time.perf_counter() - began,
            "threads": 1,
            "energy_error": _imbalance(out.energy),
            "started_from": "rest" if self._initial is None else "state",
        }
        continued = {"continuation": (float(out.time[-1]), Continuation(MODAL, end))}
        if self._continued is not None:
            continued["continued_from"] = float(out.time[0]), Continuation(MODAL, self._continued)
        return trajectory_dataset(
            case, out.time, out.displacement, out.velocity, out.reaction,
            dict(zip(names, out.energy.T, strict=True)), facts,
            {name: (known[name], values[name]) for name in known}, continuations=continued,
        )  # fmt: skip

    def _begun(self, modes: int) -> tuple[Matrices, Steps, NDArray, Bases]:
        """Matrices, steps, momentum (m,) at the start, and bases with so many modes found."""
        model = matrices(self.case, self.histories)
        steps = steps_of(self.case, self.histories, self.plan)
        place, speed = self._beginning(model, steps.at[0])
        beside = place - model.support @ steps.at[0]
        bases = Bases(model, beside, model.ties @ speed[model.free], modes)
        return model, steps, model.mass @ speed, bases

    def again(self, modes: int) -> tuple[Superposition, Iterator[NDArray]]:
        """The superposition with so many modes, and its states at all samples."""
        model, steps, momentum, bases = self._begun(modes)
        equation = Superposition(model, bases.basis(modes))
        start = equation.basis.motions.T @ momentum
        return equation, (z for z, _ in equation.steps(steps, start, works=False))

    def _take(self, out: Samples) -> None:
        """Evaluate the user's quantities at all samples."""
        self._sampler.clear()
        try:
            self._sampler.take(out, len(out.time))
        except SamplingError as error:
            raise ComputationError(str(error)) from error

    @property
    def _continued(self) -> NDArray | None:
        """All displacements and velocities (2 m,) from which a motion of superelements goes on."""
        known, size = self._initial and self._initial.continuation, self.case.body.size
        if not known or known.method != MODAL or len(known.values) != 2 * size:
            return None
        stored = np.split(known.values, 2)
        for own, given in zip(stored, check_start(self.case, self._initial), strict=True):
            apart = np.abs(own[: given.size] - given.ravel()).max()
            if apart > AGREES * np.abs(own).max():  # a changed state
                return None
        return known.values

    def _beginning(self, model: Matrices, factor: NDArray) -> tuple[NDArray, NDArray]:
        """Displacement and velocity (m,) of all dofs at the start.

        Unless the motion goes on from another one, dofs beside those of nodes are in balance: with
        the nodes, and with the loads unless the sheet is at rest.
        """
        body = self.case.elastic_body
        if (continued := self._continued) is not None:
            place, speed = np.split(continued, 2)
            return place, speed
        u, v = check_start(self.case, self._initial)
        push = (model.load - model.turned) @ factor
        place = body.dofs(u, push) if u.any() else np.zeros(body.size)
        return place, body.dofs(v) if v.any() else np.zeros(body.size)

    def _sampled(
        self, model: Matrices, equation: Superposition, steps: Steps, momentum: NDArray,
        report: Reporter,
    ) -> tuple[Samples, NDArray]:  # fmt: skip
        """Samples of the motion in one basis, and all displacements and velocities at the end."""
        case, plan, basis = self.case, self.plan, equation.basis
        names = audited(case.energy_groups, case.air is not None)
        count, size = int(steps.sampled.sum()), case.structure.nodes.size
        out = samples(count, size // 3, len(case.reaction_dofs), len(names))
        out.time[:] = steps.ends[steps.sampled]
        on_nodes, end = equation.both[:size], np.zeros(0)
        resisted = case.constraints.reactions @ equation.unbalanced[:size]
        for k, (z, total) in enumerate(equation.steps(steps, basis.motions.T @ momentum)):
            place, rate, gain = equation.amplitudes(z)
            out.displacement[k] = (on_nodes @ place).reshape(-1, 3)
            out.velocity[k] = (on_nodes @ rate).reshape(-1, 3)
            out.reaction[k] = resisted @ np.concatenate([place, rate, gain])
            strain = self._strain(model, equation.both @ place, z[equation.factors])
            kinetic, carried = equation.kinetic(z)
            air = [0.0] if case.air is not None else []
            out.energy[k] = [*strain, *air, kinetic, total[0], total[1] + carried]
            if k % LOOK == 0 or k == count - 1:
                done = float(out.time[k]) - plan.start
                report(Progress(done, plan.end - plan.start, k, _imbalance(out.energy[: k + 1])))
                end = np.concatenate([equation.both @ place, equation.both @ rate])
        out.energy[:, -1] -= out.energy[0, -1]
        return out, end

    def _strain(self, model: Matrices, x: NDArray, factor: NDArray) -> NDArray[np.float64]:
        """Strain energies (g,), J, at displacements x (m,) and factors (h,)."""
        case, body = self.case, self.case.elastic_body
        if case.rest_terms:
            number = self.histories.index
            turns = (change * factor[number(history)] for change, history in case.rest_terms)
            body = body.folded(body.sheet.rest_angles + sum(turns))
        strain, (push, stored) = body.energies(x), model.heat
        for k, added in self._springs:
            strain[k] = 0.5 * x @ (added @ x)
        strain[0] += factor @ (push.T @ x) + 0.5 * factor @ stored @ factor  # see mechanics.heat
        return strain

    @cached_property
    def _springs(self) -> list[tuple[int, sparse.csr_array]]:
        """Stiffness (m, m) at rest of each term that supports add, and the place of its energy."""
        body, groups = self.case.elastic_body, list(self.case.energy_groups)
        named = [(group, term) for term in body.others for group in term.energy_groups]
        rest = np.zeros(body.size)
        return [(groups.index(group), term.tangent(rest)) for group, term in named]

    def _warn(self, out: Samples, missing: float) -> None:
        if missing > self._tolerance:
            warn(
                f"{MOST} modes may leave out {missing:.1g} of the displacements, more than the "
                f"tolerance of {self._tolerance:g}: they answer slower changes of load; give a "
                "smoother history, or a higher tolerance",
                "superelements.md#motions",
            )
        turns = panel_turns(self.case.structure, out.displacement)
        at = int(turns.argmax())
        if turns[at] > TURN:
            where = f"t = {out.time[at]:.6g} s"
            message = far_turn(self.case.structure, turns[at], where)
            warn(message, "superelements.md#motions", ModelRangeWarning)


def _displacements(
    equation: Superposition, steps: Steps, momentum: NDArray, size: int
) -> NDArray[np.float64]:
    """Displacements (nt, size) of nodal dofs at the samples, m."""
    start, on_nodes = equation.basis.motions.T @ momentum, equation.both[:size]
    moved = equation.steps(steps, start, works=False)
    return np.array([on_nodes @ equation.amplitudes(z)[0] for z, _ in moved])


def _imbalance(energy: NDArray) -> float:
    """Largest error of the balance of energies (k, columns), relative to the energies at play."""
    scale = float(np.abs(energy).max())
    return float(np.abs(energy_error(energy)).max()) / scale if scale else 0.0
