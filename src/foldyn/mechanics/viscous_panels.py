"""Viscous panels, which resist strain rates in proportion to their stiffness.

With E the strains of a panel's bars, and S their coupling matrix (`mechanics.membranes`), the
stresses are C dE/dt, C = beta S. They dissipate the power dE/dt' C dE/dt, which is zero if a panel
only turns or folds. A term has panels of one kind, as membranes with C in the place of S.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.jit.eights import eight
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.lanes import WIDTH, increase, take
from foldyn.mechanics.membranes import (
    Back,
    Membranes,
    Packed,
    add_pulls,
    back,
    combined,
    growth,
    membrane_blocks,
    multiply,
    packed,
    pull_apart,
    pull_stiffness,
    pull_vector,
    put_rates,
    put_strains,
    scatter,
    strain_places,
    work_of,
)
from foldyn.mechanics.model import ranks
from foldyn.mechanics.pullback import Arrays, Pulled, arrays_of, pullback
from foldyn.mechanics.term import FORCES, CompiledTerm, Term, forces, nodal


class _Context(NamedTuple):
    own: Packed
    rows: int


@forces
def _forces(own, u, v, t, force, powers):
    panels, power = own.own, 0.0
    moved, speed, out = rows_at(u, own.rows), rows_at(v, own.rows), rows_at(force, own.rows)
    for first in range(0, panels.count, WIDTH):
        put_strains(panels, first, flat(moved), panels.apart, panels.strain)
        put_rates(panels, first, flat(speed), panels.other_apart, panels.strain)
        multiply(panels, first, panels.strain, panels.stress)
        add_pulls(panels, first, panels.apart, 0, own.rows, flat(out))
        power += work_of(panels)
    numbers_at(powers, 2)[1] += power


class _Backward(NamedTuple):
    own: Packed
    back: Back
    speed: NDArray  # (24 b,) differences of velocities at the ends of the bars
    force: NDArray  # (24 c,) derivatives of a group by velocities
    rows: int


@inner
def _pull(own, u, v, weight, product, rate):
    """Add the derivatives of weight . F = r^T C E' to `product`, `rate` and the gradients."""
    panels, back = own.own, own.back
    for first in range(0, panels.count, WIDTH):
        put_strains(panels, first, u, panels.apart, panels.strain)
        put_rates(panels, first, v, own.speed, panels.strain)
        put_rates(panels, first, weight, panels.other_apart, panels.other_strain)
        pull_stiffness(panels, back, first)
        panels.force[:] = 0.0
        own.force[:] = 0.0
        at = panels.ends.shape[0] * (first // WIDTH)
        for i in range(panels.ends.shape[0]):
            x, d = take(panels.vector, at + i), take(panels.apart, i)
            w, s = take(panels.other_apart, i), take(own.speed, i)
            stress, pulled = eight(panels.stress, i * WIDTH), eight(panels.other_stress, i * WIDTH)
            by = stress * growth(x, d, w) + pulled * growth(x, d, s)
            increase(back.per_length2, i * back.per_length2.shape[1] + first, by)
            per_length2 = eight(panels.per_length2, (at + i) * WIDTH)
            stress, pulled = stress * per_length2, pulled * per_length2
            both = combined(stress, w, pulled, s)
            pull_vector(back, first, i, both)
            pull_apart(panels.force, panels.ends, i, both)
            pull_apart(own.force, panels.ends, i, combined(pulled, x, pulled, d))
        scatter(panels, first, panels.force, panels.stress, 0, own.rows, product)
        scatter(panels, first, own.force, panels.stress, 0, own.rows, rate)


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    moved, speed = rows_at(u, own.rows), rows_at(v, own.rows)
    weights, out = rows_at(weight, own.rows), rows_at(product, own.rows)
    by_speed = rows_at(rate, own.rows)
    _pull(own, flat(moved), flat(speed), flat(weights), flat(out), flat(by_speed))


class ViscousPanelsTerm(Term):
    """Viscous panels of one kind, without gives; see `Term`."""

    damps = True

    def __init__(self, panels: Membranes) -> None:
        self.panels = panels

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        own = Context(_Context(packed(self.panels), int(part.own[1])))
        return CompiledTerm(own, {FORCES: _forces})

    def arrays(self) -> Arrays:
        """Arrays that the term's forces depend on; see `Term`."""
        return arrays_of(self.panels)

    def pulled(self) -> Pulled:
        """Pullback of the term's forces; see `Term`."""
        own, out = packed(self.panels), back(self.panels)
        rows = 1 + int(self.panels.nodes.max(initial=0))
        memory = np.zeros_like(own.apart), np.zeros_like(own.force)
        return Pulled(Context(_Backward(own, out, *memory, rows)), _pullback, out.of(self.panels))

    @cached_property
    def damping_places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of the term's damping entries; see `Term`."""
        return strain_places(self.panels)

    def damping_entries(self, q: NDArray, hidden: float = 1.0) -> NDArray:
        """Damping entries; panels have no hidden dofs. See `Term`."""
        still = np.zeros(self.panels.stiffness.shape[1:])
        return membrane_blocks(self.panels, nodal(q), nodal(q), still).ravel()

    def placed(self, order: NDArray, before: Any) -> ViscousPanelsTerm:
        """The term with nodes in memory order; see `Term`."""
        return ViscousPanelsTerm(self.panels._replace(nodes=ranks(order)[self.panels.nodes]))
