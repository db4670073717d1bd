"""Strain energy of panels that heat would stretch and curl if they were free.

Heat acts like follower loads (`mechanics.following`), to which a free sheet yields without stress.
The stored energy is due to the difference from the free strains: the energy of all strains, plus
the potential of these loads, plus a constant that makes it zero if each part of the sheet has its
free strain.

- parts with quadratic energies: half the thermal forces times the free strains;
- a bar of any law, free at the Green strain E and pushing with the stress S: V (S E - W(E)), with V
  its volume times Young's modulus.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import addressed, inner_scalar, kernel
from foldyn.jit.intrinsics import flat
from foldyn.materials.switch import bar_energy, bar_slope, bar_stress
from foldyn.mechanics.following import Following, hinge_of

ITERATIONS = 30  # Newton iterations for the free strain of a bar; a few suffice
SHARP = 1e-15  # Green strain: Newton's method ends at smaller steps


class Heat(NamedTuple):
    """Thermal forces of s swollen states, h histories; energy groups of stretching and bending."""

    loads: Following
    angles: NDArray  # (k,) rest dihedrals of the loaded hinges, rad
    groups: NDArray  # (2,)
    quadratic: NDArray  # (2, h, h) J
    stress: NDArray  # (s, b) of bars, divided by Young's modulus
    row: NDArray  # (s,) row of each state's history
    volume: NDArray  # (b,) volume of bars times Young's modulus, J
    code: int  # law of the bars
    addresses: NDArray  # (3,) of the law's energy, stress and slope
    seen: NDArray  # (2,) heat correction at the start of a motion, and its largest change since, J


class Warm(NamedTuple):
    """Heat in a motion: the data, and the energies (groups,) to correct."""

    heat: Heat
    displacement: NDArray
    factor: NDArray
    energy: NDArray


@inner_scalar
def free_energy(code, stress, addresses):
    """(S E - W(E)) / Young's modulus of a bar, with E the Green strain at the stress S."""
    green, e = 0.0, 0.0
    for _ in range(ITERATIONS):
        step = (stress - bar_stress(code, e, addresses[1])) / bar_slope(code, e, addresses[2])
        green += step
        e = 2.0 * green / (1.0 + math.sqrt(1.0 + 2.0 * green))
        if abs(step) <= SHARP:
            break
    return stress * green - bar_energy(code, e, addresses[0])


@kernel
def free_energies(code, stress, addresses):
    """`free_energy` at stresses (n,)."""
    out = np.empty(stress.size)
    for i in range(out.size):
        out[i] = free_energy(code, stress[i], addresses)
    return out


@kernel
def add_heat(heat, u, factor, out):
    """Add the heat correction of the strain energies, J; u flat, factors (h, k) in column 0."""
    loads, stretching, bending = heat.loads, heat.groups[0], heat.groups[1]
    for g in range(2):
        for i in range(heat.quadratic.shape[1]):
            for j in range(heat.quadratic.shape[2]):
                part = factor[i, 0] * factor[j, 0] * heat.quadratic[g, i, j]
                out[heat.groups[g]] += 0.5 * part
    for b in range(heat.volume.size):
        stress = 0.0
        for s in range(heat.row.size):
            stress += factor[heat.row[s], 0] * heat.stress[s, b]
        out[stretching] += heat.volume[b] * free_energy(heat.code, stress, heat.addresses)
    for e in range(loads.tension.size):
        pull = loads.tension[e] * factor[loads.tension_row[e], 0]
        for c in range(3):
            moved = u[3 * loads.bars[e, 1] + c] - u[3 * loads.bars[e, 0] + c]
            out[stretching] += 0.5 * pull * moved * (2.0 * loads.vectors[e, c] + moved)
    points, gradient = np.empty((4, 3)), np.empty((4, 3))
    for h in range(loads.moment.size):
        angle = hinge_of(loads, u, h, points, gradient)
        moment = loads.moment[h] * factor[loads.moment_row[h], 0]
        out[bending] -= moment * (angle - heat.angles[h])
    for e in range(loads.push.size):
        push = loads.push[e] * factor[loads.push_row[e], 0]
        out[bending] -= push * u[loads.hidden[e]]


@addressed()
def warm(m):
    """Put the heat correction at the current state of a motion into `m.energy`."""
    for g in range(m.energy.size):
        m.energy[g] = 0.0
    add_heat(m.heat, flat(m.displacement), m.factor, m.energy)
    total, seen = 0.0, m.heat.seen
    for g in range(m.energy.size):
        total += m.energy[g]
    if np.isnan(seen[0]):
        seen[0] = total
    seen[1] = max(seen[1], abs(total - seen[0]))
