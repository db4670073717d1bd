"""The registry of integrators."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from foldyn.cases import Case
from foldyn.dynamics import (
    central_difference,
    dormand_prince,
    energy_momentum,
    generalized_alpha,
    resolution,
    rk4,
)
from foldyn.dynamics.engine import Compiled, Engine, threads_of
from foldyn.dynamics.implicit.alpha import residual
from foldyn.dynamics.implicit.engine import Implicit
from foldyn.dynamics.stability import Growth
from foldyn.dynamics.system import Packed
from foldyn.errors import InputError
from foldyn.jit.compiled import ready


class Integrator(NamedTuple):
    """An integrator.

    Parameters
    ----------
    name : str
    order : int
        What tests hold it to.
    loop : callable
        The compiled function at its core: of an explicit method the loop over its steps, with
        the arguments of `rk4.advance`; of an implicit one the residual of a step.
    growth : callable, optional
        Of an explicit method: the largest factor by which a step multiplies a free vibration, as
        a function of omega, damping and dt.
    evaluations : int
        Of an explicit method: how often a step evaluates the forces.
    adaptive : bool
        Whether it always chooses its steps by their error.
    scheme : callable, optional
        Of an implicit method: its steps from a `Bench`.
    massless : bool
        Whether it takes dofs without mass beside the displacements, as those of a shell.
    conserving : bool
        Whether it needs forces with a discrete gradient, which not every model has.
    looks : tuple of float
        Where in a step, from 0 to 1, it looks at the loads.
    """

    name: str
    order: int
    loop: Callable[..., Any]
    growth: Growth | None = None
    evaluations: int = 0
    adaptive: bool = False
    scheme: Callable[..., Any] | None = None
    massless: bool = False
    conserving: bool = False
    looks: tuple[float, ...] = (0.0, 1.0)

    @property
    def implicit(self) -> bool:
        """Whether a step solves equations: then nothing but accuracy limits it."""
        return self.scheme is not None

    def engine(self, case: Case, packed: Packed) -> Engine:
        """The method with a case and the memory that it works with."""
        if self.scheme is not None:
            return Implicit(self.scheme, packed, resolution.jumps(case))
        return Compiled(self.loop, packed, 1 if self.adaptive else threads_of(packed))


METHODS: Mapping[str, Integrator] = {
    method.name: method
    for method in (
        Integrator("rk4", rk4.ORDER, rk4.advance, rk4.growth, 4, looks=(0.0, 0.5, 1.0)),
        Integrator(
            "central_difference",
            central_difference.ORDER,
            central_difference.advance,
            central_difference.growth,
            1,
        ),
        Integrator(
            "dormand_prince",
            dormand_prince.ORDER,
            dormand_prince.advance,
            dormand_prince.growth,
            6,
            adaptive=True,
        ),
        Integrator(
            "newmark",
            generalized_alpha.ORDER,
            residual,
            scheme=generalized_alpha.newmark,
            massless=True,
        ),
        Integrator(
            "generalized_alpha",
            generalized_alpha.ORDER,
            residual,
            scheme=generalized_alpha.scheme(),
            massless=True,
        ),
        Integrator(
            "energy_momentum",
            energy_momentum.ORDER,
            energy_momentum.residual,
            scheme=energy_momentum.EnergyMomentum,
            conserving=True,
        ),
    )
}


def method_of(name: str) -> Integrator:
    """Integrator by its name."""
    if not isinstance(name, str) or name not in METHODS:
        raise InputError(f" = {name!r}: choose auto or one of {', '.join(METHODS)}", "method")
    return METHODS[name]


def suited(name: str, structure: Any) -> Integrator:
    """Integrator by its name, for a structure."""
    method = method_of(name)
    found = _lacking(method, structure)
    if found:
        fit = ", ".join(other.name for other in METHODS.values() if not _lacking(other, structure))
        raise InputError(
            f" = {name!r}: {found}, which this method needs; choose one of {fit}", "method"
        )
    return method


def _lacking(method: Integrator, structure: Any) -> str:
    """What a method needs and a structure lacks, in words; empty where nothing."""
    if structure.massless and not method.massless:
        return f"{structure.massless} have no mass"
    if method.conserving and not structure.body.has_discrete_gradient:
        return "the forces of this structure have no discrete gradient"
    return ""


def compiled(name: str) -> bool:
    """Whether a method's kernels are kept on disk (else its first use compiles)."""
    return ready(method_of(name).loop)
