"""One sample of a motion, from a state of the equation of motion."""

from __future__ import annotations

from foldyn.dynamics.inertia import kinetic_energy, moving_energy, times_mass
from foldyn.dynamics.system import carry
from foldyn.dynamics.ties import add_reactions
from foldyn.jit.compiled import inner
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.term import dissipated_by, energies_of


@inner
def record(model, system, mass, q, w, a, tally, s, displacement, velocity, reaction, energy):
    """Write one sample after `acceleration`.

    The reaction is the force of the supports: M (a + alpha v) + F_int + beta K0 v - p there.
    `energy` receives the strain energies, the energy lost to air if there is any, the kinetic
    energy, the dissipated energy and the work.
    """
    carry(system.moved, s.factor[:, 0], q, s.displacement)
    carry(system.moved, s.factor[:, 1], w, s.velocity)
    carry(system.moved, s.factor[:, 2], a, s.moving)
    for i in range(system.order.size):
        for c in range(3):
            displacement[system.order[i], c] = s.displacement[i, c]
            velocity[system.order[i], c] = s.velocity[i, c]
    product, force = flat(s.product), flat(s.force)
    times_mass(mass, s.moving, s.product)
    reaction[:] = 0.0
    add_reactions(system.ties.reactions, product, 1.0, reaction)
    add_reactions(system.ties.reactions, force, 1.0, reaction)
    groups, last = s.energy.size, energy.size - 1
    energy[last - 2] = kinetic_energy(mass, s.velocity, (0, s.velocity.shape[0]))
    times_mass(mass, s.velocity, s.product)
    add_reactions(system.ties.reactions, product, system.alpha, reaction)
    energies_of(model, s.displacement, s.energy)
    for k in range(groups):
        energy[k] = s.energy[k]
    if last - 2 > groups:
        energy[groups] = tally.air
    energy[last - 1] = tally.dissipated + dissipated_by(model)
    # work includes the energy that accelerated moving supports, which may come in jolts
    energy[last] = tally.work + moving_energy(system.moved_mass, s.factor)
