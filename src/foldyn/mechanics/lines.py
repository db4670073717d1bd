"""Elastic lines over points: springs between two nodes, struts, and cables over several nodes.

A line runs straight from point to point, nodes or points on the ground, and slides over those in
between without friction: all its pieces have the tension k (l - l0), with l the sum of their
lengths. A cable is slack, without force, where l is below l0. A bar may have a law instead
(`materials.switch`), of the strain e = l/l0 - 1 that it has throughout: with S and W the second
Piola-Kirchhoff stress and the energy per modulus, its tension is k l0 (1 + e) S(e), its energy k
l0^2 W(e).

The force-free length l0 and the stiffness k may change in time: l0 by `change` times the factor of
a history, as by a winch, and k as the factor of another. Of lines that are given by EA, k = EA/l0
changes with l0. What these changes add to the energy at given positions is the power of the motor.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.materials.switch import bar_energy, bar_slope, bar_stress
from foldyn.mechanics.discrete_gradient import mean_stress

NO_LAW = -2  # in place of a law's code: lines that are linear in their length
GROUND = -1  # stands for an end on the ground
SOON = 1e-3  # share of a step below which a change from slack to taut does no harm
JUST_TAUT = 1e-12  # share of its length by which a cable may be too long and still count as taut


class Lines(NamedTuple):
    """Arrays of c lines with p points in all."""

    first: NDArray  # (c + 1,) first point of each line
    node: NDArray  # (p,) node of each point; `GROUND` for those that stand still
    vector: NDArray  # (p, 3) to the next point of the line at rest, m
    length: NDArray  # (p,) length of `vector`, m
    natural: NDArray  # (c,) l0 at rest, m
    stretch: NDArray  # (c,) length at rest in excess of l0, m
    stiffness: NDArray  # (c,) N/m, with l0 at rest
    slack: NDArray  # (c,) whether it has no force if l is below l0
    scaled: NDArray  # (c,) whether k l0 is constant
    change: NDArray  # (c,) of l0 at the factor 1, m
    code: NDArray  # (c,) of the law, or `NO_LAW`
    addresses: NDArray  # (c, 3) of a user law's energy, stress and slope, otherwise 0
    row: NDArray  # (c, 2) rows of the histories of l0 and k, -1 for none; none of lines with a law
    now: NDArray  # (c, 4) current change of l0 (m) and its rate, factor of k and its rate


@inner_scalar
def moved(lines, u, i, c):
    """Displacement of a point, m."""
    node = lines.node[i]
    return 0.0 if node < 0 else u[node, c]


@inner_scalar
def between(lines, u, i, c):
    """Difference of the displacements of both ends of the piece after point i, m."""
    return moved(lines, u, i + 1, c) - moved(lines, u, i, c)


@inner_scalar
def along(lines, u, i, c):
    """Component of the vector from point i to the next, m."""
    return lines.vector[i, c] + between(lines, u, i, c)


@inner_scalar
def piece(lines, u, i):
    """Growth of the piece after point i, and its length, m; from displacements."""
    length, x = lines.length[i], 0.0
    for c in range(3):
        du = between(lines, u, i, c)
        x += du * (2.0 * lines.vector[i, c] + du)
    now = math.sqrt(max(length * length + x, 0.0))
    return (x / (now + length) if now + length > 0.0 else 0.0), now


@inner_scalar
def extension(lines, u, s, ahead):
    """l - l0 of a line, m; with l0 as it is `ahead` (s) later."""
    total = lines.stretch[s] - lines.now[s, 0] - ahead * lines.now[s, 1]
    for i in range(lines.first[s], lines.first[s + 1] - 1):
        total += piece(lines, u, i)[0]
    return total


@inner_scalar
def strength(lines, s, ahead):
    """k of a line (N/m), as it is `ahead` (s) later; nan if no length is left of a scaled one."""
    k = lines.stiffness[s] * (lines.now[s, 2] + ahead * lines.now[s, 3])
    if lines.scaled[s]:
        left = lines.natural[s] + lines.now[s, 0] + ahead * lines.now[s, 1]
        k = k * lines.natural[s] / left if left > 0.0 else math.nan
    return k


@inner_scalar
def response(lines, s, beyond):
    """Energy (m2), tension (m) and its slope of a line per k, at the extension `beyond`, m."""
    if lines.code[s] == NO_LAW:
        return 0.5 * beyond * beyond, beyond, 1.0
    code, natural, address = lines.code[s], lines.natural[s], lines.addresses[s]
    e = beyond / natural
    stress = bar_stress(code, e, address[1])
    slope = stress + (1.0 + e) ** 2 * bar_slope(code, e, address[2])
    return natural**2 * bar_energy(code, e, address[0]), (natural + beyond) * stress, slope


@inner_scalar
def mean_pull(lines, s, first, last):
    """Mean tension per k, m, whose work between two extensions (m) is the change of energy."""
    if lines.code[s] == NO_LAW:
        return 0.5 * (first + last)
    natural = lines.natural[s]
    x, middle = first / natural * (2.0 + first / natural), natural + 0.5 * (first + last)
    change = middle * (last - first) / natural**2  # of the Green strain, of which S is the force
    return middle * mean_stress(lines.code[s], lines.addresses[s], x, change)[0]


@inner_scalar
def idle(lines, s, beyond):
    """Whether a line is slack at the extension `beyond`, m."""
    return lines.slack[s] and beyond < 0.0


@inner_scalar
def free(lines, s):
    """Whether a line pulls with k times its length, whatever the direction: its ends may meet."""
    return lines.natural[s] == 0.0 and lines.row[s, 0] < 0


@inner_scalar
def per_length(lines, s, tension, length):
    """Ratio (N/m) of the tension of a line to the length of a piece."""
    if free(lines, s):
        return strength(lines, s, 0.0)
    return tension / length if length > 0.0 else 0.0


@inner_scalar
def add_pull(lines, i, pull, start, end, force):
    """Add the forces of a piece, `pull` (N/m) times the mean of its vectors at two states."""
    a, b = lines.node[i], lines.node[i + 1]
    for c in range(3):
        apart = between(lines, start, i, c) + between(lines, end, i, c)
        pulled = pull * (lines.vector[i, c] + 0.5 * apart)
        if b >= 0:
            force[b, c] += pulled
        if a >= 0:
            force[a, c] -= pulled


@inner
def pull_lines(lines, u, force):
    """Add the forces of all lines; return the power of the motors, W."""
    power = 0.0
    for s in range(lines.stiffness.size):
        beyond = extension(lines, u, s, 0.0)
        if idle(lines, s, beyond):
            continue
        k, reach = strength(lines, s, 0.0), response(lines, s, beyond)[1]
        for i in range(lines.first[s], lines.first[s + 1] - 1):
            pull = per_length(lines, s, k * reach, piece(lines, u, i)[1])
            add_pull(lines, i, pull, u, u, force)
        if lines.row[s, 0] >= 0 or lines.row[s, 1] >= 0:
            power += 0.5 * beyond * beyond * _rate_of_strength(lines, s, k)
            power -= k * beyond * lines.now[s, 1]
    return power


@inner_scalar
def _rate_of_strength(lines, s, k):
    """Rate of k, N/(m s)."""
    rate = lines.stiffness[s] * lines.now[s, 3]
    if lines.scaled[s]:
        left = lines.natural[s] + lines.now[s, 0]
        rate = (rate * lines.natural[s] - k * lines.now[s, 1]) / left
    return rate


@kernel
def put_tensions(lines, u, out):
    """Put the tensions (c,) of all lines, N, to `out`; those of slack ones as if they pushed."""
    for s in range(lines.stiffness.size):
        out[s] = strength(lines, s, 0.0) * response(lines, s, extension(lines, u, s, 0.0))[1]


@inner
def lines_energy(lines, u):
    """Energy of all lines, J."""
    energy = 0.0
    for s in range(lines.stiffness.size):
        energy += strength(lines, s, 0.0) * _stored(lines, u, s, 0.0)[1]
    return energy


@inner_scalar
def _stored(lines, u, s, ahead):
    """Extension of a line, and the energy per stiffness."""
    beyond = extension(lines, u, s, ahead)
    return beyond, 0.0 if idle(lines, s, beyond) else response(lines, s, beyond)[0]


@inner
def pull_on_average(lines, u0, u1, h, force):
    """Add forces whose work from u0 to u1 in a step h (s) is the change of the energies.

    The lines are as in the middle of the step. Returns the power of the motors, W.
    """
    power = 0.0
    for s in range(lines.stiffness.size):
        first, before = _stored(lines, u0, s, -0.5 * h)
        last, after = _stored(lines, u1, s, 0.5 * h)
        if before == 0.0 and after == 0.0:
            continue
        soft, stiff = strength(lines, s, -0.5 * h), strength(lines, s, 0.5 * h)
        mean = mean_pull(lines, s, first, last)
        if lines.slack[s] and (first < 0.0 or last < 0.0):
            mean = (after - before) / (last - first)
        tension = 0.5 * (soft + stiff) * mean
        for i in range(lines.first[s], lines.first[s + 1] - 1):
            both = 0.5 * (piece(lines, u0, i)[1] + piece(lines, u1, i)[1])
            add_pull(lines, i, per_length(lines, s, tension, both), u0, u1, force)
        power += 0.5 * (before + after) * (stiff - soft) / h - tension * lines.now[s, 1]
    return power


@kernel
def line_rates(lines, u, s, out):
    """Put the derivatives (p, 3) of a line's length by the positions of its points to `out`."""
    out[:] = 0.0
    for j in range(lines.first[s + 1] - lines.first[s] - 1):
        i = lines.first[s] + j
        length = piece(lines, u, i)[1]
        for c in range(3):
            unit = along(lines, u, i, c) / length if length > 0.0 else 0.0
            out[j + 1, c] += unit
            out[j, c] -= unit


@kernel
def line_blocks(lines, u, loose, out):
    """Put the derivatives of the forces of all lines, N/m, by all their points, line by line.

    loose : without the part of the tension of lines that push.
    """
    at, most = 0, 0
    for s in range(lines.stiffness.size):
        most = max(most, lines.first[s + 1] - lines.first[s])
    room = np.empty((most, 3))
    for s in range(lines.stiffness.size):
        points = lines.first[s + 1] - lines.first[s]
        size = 3 * points
        block = out[at : at + size * size].reshape(size, size)
        block[:] = 0.0
        at += size * size
        beyond, k = extension(lines, u, s, 0.0), strength(lines, s, 0.0)
        if lines.slack[s] and beyond < -JUST_TAUT * (lines.natural[s] + lines.now[s, 0]):
            continue
        _, reach, slope = response(lines, s, beyond)
        rates = room[:points]
        line_rates(lines, u, s, rates)
        for a in range(size):
            for b in range(size):
                block[a, b] = k * slope * rates[a // 3, a % 3] * rates[b // 3, b % 3]
        for j in range(0 if loose and beyond < 0.0 else points - 1):
            i = lines.first[s] + j
            length = piece(lines, u, i)[1]
            pull = per_length(lines, s, k * reach, length)
            for a in range(3):
                for b in range(3):
                    product = along(lines, u, i, a) * along(lines, u, i, b)
                    across = pull * ((a == b) - (product / length**2 if length > 0.0 else 0.0))
                    block[3 * j + a, 3 * j + b] += across
                    block[3 * j + 3 + a, 3 * j + 3 + b] += across
                    block[3 * j + a, 3 * j + 3 + b] -= across
                    block[3 * j + 3 + a, 3 * j + b] -= across


@inner
def differentiate_lines(lines, out, u, weights, added):
    """Add the derivatives of weights . F by displacements to `added`, by arrays to `out`."""
    for s in range(lines.stiffness.size):
        beyond = extension(lines, u, s, 0.0)
        if idle(lines, s, beyond):
            continue
        k, growth = strength(lines, s, 0.0), 0.0  # growth: rate of l for velocities `weights`
        for i in range(lines.first[s], lines.first[s + 1] - 1):
            growth += growth_of(lines, u, weights, i)[0]
        _, reach, slope = response(lines, s, beyond)
        out.stretch[s] += k * slope * growth
        out.stiffness[s] += reach * growth
        if lines.code[s] != NO_LAW:
            out.natural[s] += k * (reach - slope * beyond) / lines.natural[s] * growth
        for i in range(lines.first[s], lines.first[s + 1] - 1):
            own, length = growth_of(lines, u, weights, i)
            pull = per_length(lines, s, k * reach, length)
            by_length = 0.0  # derivative by the length of the piece
            if length > 0.0:
                by_length = 0.0 if free(lines, s) else k * slope * growth - pull * own
                out.length[i] += by_length * lines.length[i] / length - k * slope * growth
                by_length /= length
            for c in range(3):
                by = pull * between(lines, weights, i, c)
                out.vector[i, c] += by + by_length * between(lines, u, i, c)
                by += by_length * along(lines, u, i, c)
                a, b = lines.node[i], lines.node[i + 1]
                if b >= 0:
                    added[b, c] += by
                if a >= 0:
                    added[a, c] -= by


@inner_scalar
def growth_of(lines, u, weights, i):
    """Rate of a piece's length for velocities `weights`, and that length."""
    length, grown = piece(lines, u, i)[1], 0.0
    for c in range(3):
        grown += between(lines, weights, i, c) * along(lines, u, i, c)
    return (grown / length if length > 0.0 else 0.0), length


@inner
def until_turn(lines, u, v, a, h):
    """Time (s), at most h, until a cable goes slack or taut; u, v and a are (n, 3).

    Times below `SOON` times h do not count: so little of a step does no harm.
    """
    for s in range(lines.stiffness.size):
        if not lines.slack[s]:
            continue
        beyond, rate, growth = extension(lines, u, s, 0.0), -lines.now[s, 1], 0.0
        for i in range(lines.first[s], lines.first[s + 1] - 1):
            grown, length = growth_of(lines, u, v, i)
            rate += grown
            squares = -grown * grown
            for c in range(3):
                squares += between(lines, v, i, c) ** 2
                squares += along(lines, u, i, c) * between(lines, a, i, c)
            growth += squares / length if length > 0.0 else 0.0
        root = rate * rate - 2.0 * growth * beyond
        if root < 0.0:
            continue
        half = -rate - math.copysign(math.sqrt(root), rate)  # without cancellation
        for time in (half / growth if growth != 0.0 else 0.0, 2.0 * beyond / half if half else 0.0):
            if SOON * h < time < h:
                h = time
    return h


@inner
def drive_lines(lines, factors):
    """Set lengths and stiffness for factors (h, 3) of the histories."""
    for s in range(lines.stiffness.size):
        for k in range(2):
            if lines.row[s, 0] >= 0:
                lines.now[s, k] = lines.change[s] * factors[lines.row[s, 0], k]
            if lines.row[s, 1] >= 0:
                lines.now[s, 2 + k] = factors[lines.row[s, 1], k]
