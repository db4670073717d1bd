"""The registry of integrators."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.cases import Case, Origin, State
from foldyn.cases.history import CALLED
from foldyn.dynamics import central_difference, dormand_prince, energy_momentum, generalized_alpha
from foldyn.dynamics.checkpoint import beyond_samples, state_parts
from foldyn.dynamics.engine import Engine
from foldyn.dynamics.equation import EquationOfMotion, accelerate
from foldyn.dynamics.implicit.engine import ImplicitEngine
from foldyn.dynamics.modal_damping import ModalRows, modal_rows
from foldyn.dynamics.motion_state import MotionState, Samples, StepPlan
from foldyn.dynamics.runge_kutta import RK4, Tableau, advance
from foldyn.dynamics.stability import (
    MARGIN,
    Growth,
    damper_rate,
    explicit,
    hidden_inertia,
    largest_frequency,
    stability_limit,
)
from foldyn.dynamics.system import PackedCase, scratches
from foldyn.dynamics.timing import jumps
from foldyn.errors import InputError
from foldyn.jit.compiled import ready
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.mechanics.threads import run_together
from foldyn.values import of_kind


class ExplicitEngine(Engine):
    """Engine of an explicit method whose loop is fully compiled.

    Parameters
    ----------
    loop : callable
        See `Integrator`.
    packed : PackedCase
        The case.
    state : MotionState
    plan : StepPlan
    threads : int
        Maximum number of threads; fewer are used if elements couple distant nodes.
    slows : bool
        Whether slow contacts get inertia; possible on one thread only.
    further : tuple
        Further arguments of the loop.
    """

    def __init__(
        self, loop: Callable[..., tuple[int, int]], packed: PackedCase, state: MotionState,
        plan: StepPlan, threads: int, slows: bool = False, further: tuple[Any, ...] = (),
    ) -> None:  # fmt: skip
        self._loop, self._packed, self._state, self._plan = loop, packed, state, plan
        self._further = further
        self._threads = packed.body.thread_parts(threads)
        self._scratches = scratches(packed.system, [own.own for own in self._threads])
        self._equations = [
            EquationOfMotion(packed, own, scratch, state, slows)
            for own, scratch in zip(self._threads, self._scratches, strict=True)
        ]
        self.threads = len(self._threads)

    def start_with(self, powers: NDArray) -> None:
        """Set the powers (2,) at the last step, in and out, W."""
        for scratch in self._scratches:
            scratch.powers[:2] = powers if scratch is self._scratches[0] else 0.0

    @property
    def powers(self) -> NDArray:
        """Powers (3,) in, out and to the air, W, at the last step."""
        return np.sum([scratch.powers for scratch in self._scratches], axis=0)

    def advance(self, out: Samples, stretch: int) -> tuple[int, int]:
        """Advance the motion by at most `stretch` steps; returns (outcome, hinge)."""
        case = self._state, self._plan, out.end, stretch, *self._further
        arguments = [(equation.recording(out), *case) for equation in self._equations]
        return run_together(self._loop, [own.team for own in self._threads], arguments)[0]

    def continuation(self) -> NDArray:
        """Numbers to continue from the last sample; see `Engine`."""
        return beyond_samples(self._packed, self._state)

    def accelerate(self) -> None:
        """Recompute the current acceleration, for methods that store it."""
        state, handle = self._state, self._equations[0].handle
        accelerate(handle, state.u, state.v, float(state.tally.time), state.carry)

    def changing(self) -> dict[str, Any]:
        """What the next steps depend on; see `Engine`."""
        contact = [self._packed.body.kept(own, ContactTerm) or () for own in self._threads]
        powers = [scratch.powers for scratch in self._scratches]
        parts = state_parts(self._packed, self._state) | {"powers": powers, "contact": contact}
        if self._packed.system.touches:  # the step limit uses the end of the last step
            whole = self._scratches[0]
            parts["seen"] = [self._threads[0].angle, whole.displacement, whole.velocity]
        return parts

    def facts(self) -> dict[str, Any]:
        """Statistics for the result's attributes: contact lists, shortest contact step."""
        kept = self._packed.body.kept(self._threads[0], ContactTerm)
        if kept is None:
            return {}
        shortest = float(kept.facts.shortest)
        return {"contact_lists": int(kept.counts.lists), "shortest_contact_step": shortest}


def threads_of(packed: PackedCase) -> int:
    """Number of threads with which a motion of a case runs fastest.

    One thread if the case has parts that threads cannot share: user functions, constraints, added
    mass, loads that depend on the displacement, and some terms.
    """
    system = packed.system
    called = bool((system.waves.code == CALLED).any())
    alone = system.follows or called
    alone = alone or len(system.ties.slave) > 0 or packed.added.acts
    return 1 if alone else packed.body.threads


@dataclass(frozen=True)
class Integrator:
    """An integration method and its properties.

    Parameters
    ----------
    name : str
    order : int
        Order of convergence, checked by tests.
    loop : callable
        Compiled core. Explicit method: the step loop, with the arguments of
        `central_difference.advance`. Implicit method: the residual of a step.
    growth : callable, optional
        For an explicit method: the largest factor by which a step multiplies a free vibration, as
        a function of omega, damping and dt.
    evaluations : int
        For an explicit method: number of force evaluations per step.
    adaptive : bool
        Whether the method always controls its steps by their error.
    scheme : callable, optional
        For an implicit method: creates its `Scheme` from a case and the state of the motion.
    looks : tuple of float
        Fractions of a step, from 0 to 1, at which the method evaluates the loads.
    tableau : Tableau, optional
        For an explicit Runge-Kutta method of fixed step: last argument of its loop,
        `runge_kutta.advance`.
    """

    name: str
    order: int
    loop: Callable[..., Any]
    growth: Growth | None = None
    evaluations: int = 0
    adaptive: bool = False
    scheme: Callable[..., Any] | None = None
    looks: tuple[float, ...] = (0.0, 1.0)
    tableau: Tableau | None = None

    def __post_init__(self) -> None:
        """Check that an explicit method has growth and evaluations, an implicit one a scheme."""
        if self.scheme is None and (self.growth is None or not self.evaluations):
            raise TypeError(
                f"{self.name}: an explicit method needs growth, which limits its steps, and "
                "evaluations; an implicit one needs its scheme"
            )

    @property
    def implicit(self) -> bool:
        """Whether steps solve equations, so that only accuracy limits the step length."""
        return self.scheme is not None

    def engine(
        self, case: Case, packed: PackedCase, state: MotionState, plan: StepPlan,
        device: str = "cpu",
    ) -> Engine:  # fmt: skip
        """Create the engine for a case, with its motion and memory."""
        if device == "gpu":
            from foldyn.dynamics.gpu.engine import CardEngine

            return CardEngine(self, packed, state, plan)
        if self.scheme is not None:
            return ImplicitEngine(self.scheme, packed, state, plan, jumps(case))
        threads = 1 if self.adaptive else threads_of(packed)
        further = () if self.tableau is None else (self.tableau.coefficients,)
        return ExplicitEngine(self.loop, packed, state, plan, threads, self.adaptive, further)

    def hidden_inertia(self, case: Case) -> NDArray:
        """Inertia (h,), kg, that the method gives to dofs without mass; (0,) for none."""
        return np.zeros(0) if self.implicit else hidden_inertia(case)

    def critical_step(
        self, case: Case, u: ArrayLike | None = None, modal: ModalRows | None = None
    ) -> float:
        """Critical step (s) about u; `modal` is the modal damping of a motion from u, if known."""
        if self.growth is None:
            return np.inf
        if modal is None:
            modal = modal_rows(case, None if u is None else Origin(np.asarray(u, float)))
        rate = damper_rate(case, u) + modal.rate
        omega = largest_frequency(case, u)
        return MARGIN * stability_limit(self.growth, omega, case.rayleigh, rate)


def _explicit(module: Any, evaluations: int, **traits: Any) -> Integrator:
    """Integrator whose name and loop are those of a module."""
    name = module.__name__.rpartition(".")[2]
    return Integrator(name, module.ORDER, module.advance, module.growth, evaluations, **traits)


def runge_kutta(method: Tableau) -> Integrator:
    """Explicit Runge-Kutta method of fixed step for a tableau."""
    return Integrator(
        method.name, method.order, advance, method.growth, len(method.weights),
        looks=method.looks, tableau=method,
    )  # fmt: skip


def _implicit(name: str, module: Any, scheme: Callable[..., Any]) -> Integrator:
    return Integrator(name, module.ORDER, module.residual, scheme=scheme)


METHODS: Mapping[str, Integrator] = {
    method.name: method
    for method in (
        runge_kutta(RK4),
        _explicit(central_difference, 1),
        _explicit(dormand_prince, 6, adaptive=True),
        _implicit("newmark", generalized_alpha, generalized_alpha.newmark),
        _implicit("generalized_alpha", generalized_alpha, generalized_alpha.scheme()),
        _implicit("energy_momentum", energy_momentum, energy_momentum.EnergyMomentum),
    )
}


def method_of(name: str) -> Integrator:
    """Integrator of this name."""
    if not isinstance(name, str) or name not in METHODS:
        raise InputError(f" = {name!r}: choose auto or one of {', '.join(METHODS)}", "method")
    return METHODS[name]


def suited(name: str, case: Case) -> Integrator:
    """Integrator of this name; refuses a method that does not suit the case."""
    method = method_of(name)
    if lack := lacking(method, case):
        fit = ", ".join(other.name for other in METHODS.values() if not lacking(other, case))
        raise InputError(
            f" = {name!r}: {lack}; choose {f'one of {fit}' if fit else 'another model'}", "method"
        )
    return method


def suiting(method: Integrator, case: Case) -> Case:
    """The case; for an explicit method, its structure with the dofs that such methods take."""
    return case if method.implicit else explicit(case)


def lacking(method: Integrator, case: Case) -> str:
    """Reason why a method does not suit a case; empty if it does."""
    structure = case.structure
    if structure.linear:
        return f"{structure.linear} serve linear analyses, and move by fd.simulate alone"
    if method.implicit and case.air is not None and case.air.added_mass:
        return "only explicit methods take the added mass of air (leave it out: added_mass = false)"
    return ""


def compiled(name: str) -> bool:
    """Whether a method's kernels are cached on disk; otherwise its first use compiles."""
    return ready(method_of(name).loop)


def critical_step(case: Case, method: str = "rk4", *, state: State | None = None) -> float:
    """Critical time step (s) of an explicit method for a case: 0.9 of its stability limit.

    Parameters
    ----------
    case : Case
    method : str
        Integrator, as for `simulate`; the result is inf for implicit methods, whose step is limited
        by accuracy only.
    state : State, optional
        State about which the stiffness is taken; rest by default.

    Notes
    -----
    Free vibrations of the damped structure satisfy s^2 + (alpha + beta w^2 + r) s + w^2 = 0. The
    limit is the largest dt for which none of them grows, for all frequencies w up to the highest of
    the structure and all r from 0 to the largest damping rate of modal damping, dashpots and
    creases. For RK4 this means ``|R(s dt)| <= 1``.
    """
    of_kind("case", case, Case)
    chosen, place = suited(method, case), None
    if state is not None:
        shape = case.structure.nodes.shape
        place = of_kind("state", state, State).of_nodes("displacement", shape, "state")
    return chosen.critical_step(suiting(chosen, case), place)
