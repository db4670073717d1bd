"""Forces whose work in a step is the change of a term's energy, for any term with an energy.

From u0 to u1 = u0 + du, with F the forces at the midpoint and W the energy,

    f = F + (W1 - W0 - F . du - h P) du / |du|^2,

with P the power that the term puts in minus the power that it dissipates (Gonzalez, J. Nonlinear
Sci. 6, 1996). The correction along du, for all dofs of the term at once, is of third order in du.
It has a resultant and a moment, so that momenta are not conserved: terms that conserve them have
their own `mean_forces`.

Hidden dofs have no inertia. With midpoint forces they would oscillate from step to step; with the
mean of the forces at both ends they do not, and the correction acts along the displacements.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import Addressed
from foldyn.jit.context import Context, numbers_at, rows_at, run_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    MEAN_FORCES,
    PLACE_OBSTACLES,
    CompiledTerm,
    Term,
    mean_forces,
)
from foldyn.mechanics.threads import ThreadPart

NOISE = 16.0 * float(np.finfo(float).eps)  # rounding errors, relative to an energy


class _Context(NamedTuple):
    term: int  # address of the term's context
    forces: int  # addresses of the term's kernels
    energies: int
    dofs: NDArray  # (d,) dofs with mass on which the term's forces depend
    hidden: NDArray  # (r,)
    found: NDArray  # (3, rows, 3) forces at the midpoint and, if the term has hinges, at u0 and u1
    middle: NDArray  # (rows, 3)
    speed: NDArray  # (rows, 3)
    energy: NDArray  # (groups,)
    powers: NDArray  # (3, 3) powers of the same evaluations


@mean_forces
def _mean_forces(own, u0, u1, before, h, t, force, powers):
    rows, middle, speed, found = own.middle.shape[0], own.middle, own.speed, own.found
    start, end, out = flat(rows_at(u0, rows)), flat(rows_at(u1, rows)), flat(rows_at(force, rows))
    for i in range(out.size):
        flat(middle)[i], flat(speed)[i] = 0.5 * (start[i] + end[i]), (end[i] - start[i]) / h
    for k in range(found.shape[0]):  # u1 comes last, so that its dihedrals remain
        place = middle if k == 0 else rows_at(u0 if k == 1 else u1, rows)
        found[k], own.powers[k] = 0.0, 0.0
        run_at(own.forces, (own.term, place, speed, t, found[k], own.powers[k]))
    mean = flat(found[0])
    for k in own.hidden:
        mean[k] = 0.5 * (flat(found[1])[k] + flat(found[2])[k])
    power_in, power_out, power_air = own.powers[0]
    total = numbers_at(powers, 3)
    total[0] += power_in
    total[1] += power_out
    total[2] += power_air
    if own.energies != 0:
        missed, size, square = h * (power_out - power_in), 0.0, 0.0
        for k in range(2):
            own.energy[:] = 0.0
            run_at(own.energies, (own.term, u0 if k == 0 else u1, own.energy))
            for energy in own.energy:
                missed += energy if k == 1 else -energy
                size += abs(energy)
        for i in range(out.size):
            missed -= mean[i] * (end[i] - start[i])
        for k in own.dofs:
            square += (end[k] - start[k]) ** 2
        if abs(missed) > NOISE * size and square > 0.0:
            for k in own.dofs:
                mean[k] += missed / square * (end[k] - start[k])
    for i in range(out.size):
        out[i] += mean[i]


class MeanForces:
    """Mean forces of all terms of a body except contact, on a thread; owns their contexts.

    Contact, whose forces depend on the history, has its own step forces.

    Attributes
    ----------
    context, kernel : ndarray, shape (k,)
        Addresses.
    drive : ndarray, shape (k, 2)
        Kernels that set terms to factors of histories, or 0, and their contexts.
    powers : ndarray, shape (3,)
        Powers that forces without energy put in, dissipate and lose to the air, W.
    """

    def __init__(self, body: Assembly, part: ThreadPart) -> None:
        self.powers, self._body = np.zeros(3), body
        pairs = zip(body.terms, body.compiled(part), strict=True)
        kept = [(term, own) for term, own in pairs if not isinstance(term, ContactTerm)]
        self._held = [(own, *self._of(term, own)) for term, own in kept]
        self.context = np.array([context.address for _, context, _ in self._held], np.int64)
        self.kernel = np.array([kernel.at(context) for _, context, kernel in self._held], np.int64)
        self.drive = np.zeros((len(kept), 2), np.int64)
        for row, (_, own) in zip(self.drive, kept, strict=True):
            if PLACE_OBSTACLES in own.kernels:
                row[:] = own.kernels[PLACE_OBSTACLES].at(own.context), own.context.address

    def _of(self, term: Term, own: CompiledTerm) -> tuple[Context, Addressed]:
        """Context and kernel of a term."""
        if MEAN_FORCES in own.kernels:
            return own.context, own.kernels[MEAN_FORCES]
        hidden, energies = self._body.hidden.astype(np.int64), own.kernels.get(ENERGIES)
        dofs, rows = np.setdiff1d(np.arange(self._body.size), hidden), self._body.rows
        if term is not self._body.sheet:
            hidden = hidden[:0]
            dofs = np.intersect1d(dofs, term.places[0]) if len(term.places[0]) else dofs
        states = 3 if len(hidden) or len(term.hinges) else 1
        context = _Context(
            term=own.context.address,
            forces=own.kernels[FORCES].at(own.context),
            energies=0 if energies is None else energies.at(own.context),
            dofs=dofs,
            hidden=hidden,
            found=np.zeros((states, rows, 3)),
            middle=np.zeros((rows, 3)),
            speed=np.zeros((rows, 3)),
            energy=np.zeros(len(self._body.energy_groups)),
            powers=np.zeros((states, 3)),
        )
        return Context(context), _mean_forces
