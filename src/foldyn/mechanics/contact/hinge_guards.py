"""Guards of hinges: distance does not show whether panels that share a crease have crossed.

Whatever the hinge law, a dihedral theta below t0 has the additional energy K t0^2 f(theta / t0),
and so has 2 pi - theta. Faces of thickness t with wing height h meet at t0 = t / h; K = k h^2.
"""

from __future__ import annotations

import math

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.mechanics.contact.potential import barrier
from foldyn.mechanics.dihedral import hinge_at

TURN = 2.0 * math.pi


@inner_scalar
def gradient_at(tables, x, h):
    """Dihedral (rad) of a guarded hinge and its gradient (12 numbers)."""
    return hinge_at(x, tables.hinges, h)


@kernel
def add_guards(tables, x, angle, force, first, last):
    """Energy (J) of guards first to last - 1 at dihedrals `angle`; adds their gradient.

    force : (n, 3) N.
    """
    energy = 0.0
    for h in range(first, last):
        limit, theta = tables.hinge_limit[h], angle[tables.hinge_row[h]]
        if limit < theta < TURN - limit:
            continue
        found = gradient_at(tables, x, h)
        turned, sign = found[0], 1.0
        if turned > math.pi:
            turned, sign = TURN - turned, -1.0
        if turned >= limit:
            continue
        f, f1, _ = barrier(turned / limit)
        energy += tables.hinge_stiffness[h] * limit * limit * f
        moment = sign * tables.hinge_stiffness[h] * limit * f1
        for v in range(4):
            for c in range(3):
                force[tables.hinges[h, v], c] += moment * found[1 + 3 * v + c]
    return energy
