"""Large rotations: a strip rolled up by an end moment, bent by a force; a slit ring lifted.

The last two are problems 3.1 and 3.3 of K. Y. Sze, X. H. Liu and S. H. Lo, Popular benchmark
problems for geometric nonlinear analysis of shells, Finite Elem. Anal. Des. 40, 1551-1569, 2004,
which keep strains small. Their other ones need shells that are curved at rest, or layers.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from shell_lab import (
    WEST,
    at_rest,
    dofs,
    equilibrium,
    grid,
    plane,
    sheet_of,
    split,
    with_rotations_on,
)

import foldyn as fd
from foldyn.checks import observed_order
from pairwise import FEW
from verification.benchmarks.large import BENCHMARKS, END_SHEAR, LEG, end_shear

STRIP = fd.Sheet(1.2e6, 0.0, 0.1)
EI = STRIP.youngs_modulus * STRIP.thickness**3 / 12.0  # of a width of one


def strip(nx, ny, length):
    """A strip of width one, clamped at x = 0; with rotations on the sides of its free end."""
    mesh, number = grid(nx, ny, lambda x, y: plane(length * x, y))
    s, rows = with_rotations_on(sheet_of(mesh, STRIP, [WEST]), number[-1])
    return s, number, rows


# ------------------------------------------------------------------ rolled up


def end_moment(s, rows, moment):
    """A moment per length about sides: on the rotation there and, as a couple, on the triangle.

    It lifts the third corners. The derivative is taken by differences, for few dofs.
    """
    corners = np.array([s.triangles[t, [k, (k + 1) % 3, (k + 2) % 3]] for t, k, _ in rows])
    rotations = s.nodes.size + np.array([r for *_, r in rows])
    edge = np.linalg.norm(s.nodes[corners[:, 1]] - s.nodes[corners[:, 0]], axis=1)

    def forces(q):
        out = np.zeros(q.size)
        out[rotations] = moment * edge
        a, b, c = ((s.nodes + split(s, q)[0])[corners[:, k]] for k in range(3))
        along, arm = b - a, c - a
        foot = np.einsum("ij,ij->i", arm, along) / np.einsum("ij,ij->i", along, along)
        height = arm - foot[:, None] * along
        normal = np.cross(along, height)
        normal *= (moment * edge / np.linalg.norm(height, axis=1))[:, None] / np.linalg.norm(
            normal, axis=1, keepdims=True
        )
        for k, share in enumerate((foot - 1.0, -foot, np.ones_like(foot))):
            np.add.at(out[: s.nodes.size].reshape(-1, 3), corners[:, k], share[:, None] * normal)
        return out

    def with_slope(q):
        slope, step = sparse.lil_array((q.size, q.size)), 1e-6
        for d in dofs(np.unique(corners)):
            shift = np.zeros(q.size)
            shift[d] = step
            column = (forces(q + shift) - forces(q - shift)) / (2.0 * step)
            rows = np.flatnonzero(column)
            slope[rows, [d] * len(rows)] = column[rows]
        return forces(q), slope.tocsr()

    return with_slope


def roll(nx, ny, length, angles):
    """States at end angles M L / (E I), and the strip."""
    s, number, rows = strip(nx, ny, length)
    q, found, steps = at_rest(s), [], round(angles[-1] / (np.pi / 12))
    for k in range(1, steps + 1):
        angle = angles[-1] * k / steps
        moment = end_moment(s, rows, -angle * EI / length)
        q = equilibrium(s, q, 0 * q, dofs(number[0]), moment)
        if np.isclose(angle, angles).any():
            found.append(q)
    return s, number, found


@pytest.mark.parametrize("mesh", [(12, 1), pytest.param((8, 3), marks=pytest.mark.matrix)])
def test_an_end_moment_rolls_a_strip_into_a_full_circle(mesh):
    """M = E I / R, exactly on any mesh: n sides that turn by angle / n each."""
    length, angles = 12.0, np.array([0.5, 1.0, 2.0]) * np.pi
    s, number, states = roll(*mesh, length, angles)
    for angle, q in zip(angles, states, strict=True):
        u, x = split(s, q)
        tip = (s.nodes + u)[number[-1]]
        part = angle / mesh[0]
        radius = 0.5 * length / mesh[0] / np.sin(0.5 * part)
        aim = np.tile([radius * np.sin(angle), radius * (1 - np.cos(angle))], (len(tip), 1))
        assert np.abs(tip[:, [0, 2]]) == pytest.approx(np.abs(aim), abs=1e-7)
        assert u[:, 1] == pytest.approx(0 * u[:, 1], abs=1e-8)  # plane strain, nu = 0
        energies = s.energies(u, x)
        assert energies["strain_bending"] == pytest.approx(0.5 * EI * angle**2 / length, rel=1e-10)
        assert energies["strain_membrane"] < 1e-10 * energies["strain_bending"]


# ------------------------------------------------------------------ bent by a force


def elastica(load, length):
    """Shortening and lift of the tip of an inextensible cantilever under a vertical dead load."""

    def curve(start):
        def slope(_, y):
            return [y[1], -load / EI * np.cos(y[0]), 1.0 - np.cos(y[0]), np.sin(y[0])]

        return solve_ivp(slope, [0, length], [0, start, 0, 0], rtol=1e-11, atol=1e-13).y[:, -1]

    start = brentq(lambda k: curve(k)[1], 0.0, load * length / EI, xtol=1e-14)
    return curve(start)[2:]


@pytest.mark.matrix
def test_cantilever_under_end_shear():
    exact = np.array([elastica(4.0 * part, 10.0) for part in END_SHEAR])
    cells = np.array([8, 16, 32])
    found = [end_shear(int(n)) for n in cells]
    assert found[-1] == pytest.approx(np.array([*END_SHEAR.values()]), rel=4e-3, abs=1e-3)
    errors = [np.linalg.norm(each - exact) for each in found]
    assert observed_order(1.0 / cells, errors) == pytest.approx(2.0, abs=0.15)


# ------------------------------------------------------------------ a frame


def frame_load(drop, guess):
    """Force on Lee's frame by shooting, its place this far down; an elastica that stretches.

    guess, found : reactions at the foot, its angle, and the force.
    """
    stretching, bending = 720.0 * 6.0, 720.0 * 2.0

    def along(start, x_force, z_force, length):
        def slope(_, y):
            c, s = np.cos(y[2]), np.sin(y[2])
            stretch = 1.0 - (x_force * c + z_force * s) / stretching
            moment = stretch * (z_force * c - x_force * s)
            return [stretch * c, stretch * s, y[3] / bending, moment]

        return solve_ivp(slope, [0.0, length], start, rtol=1e-8, atol=1e-10).y[:, -1]

    def missed(unknown):
        x_force, z_force, angle, load = unknown
        corner = along([0.0, 0.0, angle, 0.0], x_force, z_force, LEG)
        pushed = along(corner - [0, 0, 0.5 * np.pi, 0], x_force, z_force, 0.2 * LEG)
        x, z, _, moment = along(pushed, x_force, z_force - load, 0.8 * LEG)
        return [x - LEG, z - LEG, moment, pushed[1] - LEG + drop]

    return fsolve(missed, guess)


@pytest.mark.matrix
def test_the_reference_of_lees_frame():
    """Its largest load, by a parabola through three."""
    found, loads, drops = np.array([0.0, 0.01, 0.5 * np.pi, 0.01]), [], [48.0, 48.7, 49.4]
    for drop in (4.0, 12.0, 20.0, 28.0, 36.0, 44.0, *drops):
        found = frame_load(drop, found)
        loads.append(found[3])
    a, b, c = np.polyfit(drops, loads[-3:], 2)
    (row,) = (row for row in BENCHMARKS if row.name == "Lee's frame")
    assert c - b**2 / (4.0 * a) == pytest.approx(row.reference[0], rel=1e-4)


# ------------------------------------------------------------------ slit ring

# force per length over 0.8: lift of the loaded edge's inner and outer end (Sze et al., table 5)
SLIT_RING = {
    0.025: (1.305, 1.789), 0.1: (4.277, 5.876), 0.2: (6.725, 9.160), 0.5: (10.468, 13.768),
    1.0: (13.891, 17.528),
}  # fmt: skip


def lifted_ring(across, around):
    """Lifts of the ends of the loaded edge at the loads of the table."""

    def place(x, y):
        return plane((6 + 4 * y) * np.cos(2 * np.pi * x), (6 + 4 * y) * np.sin(2 * np.pi * x))

    mesh, number = grid(around, across, place)
    mesh = replace(mesh, triangles=mesh.triangles[:, ::-1])  # counter-clockwise
    s = sheet_of(mesh, fd.Sheet(21e6, 0.0, 0.03), [WEST])
    share = np.full(across + 1, 4.0 / across)
    share[[0, -1]] *= 0.5
    load = at_rest(s)
    load[dofs(number[-1], "z")] = 0.8 * share
    q, part, step, found = at_rest(s), 0.0, 0.0125, []
    while part < 1.0:
        aim = min([part + step, *(k for k in SLIT_RING if k > part)])
        try:
            q = equilibrium(s, q, aim * load, dofs(number[0]), tolerance=1e-6)
        except AssertionError:
            step *= 0.5
            continue
        part, step = aim, 1.3 * step
        if part in SLIT_RING:
            found.append(split(s, q)[0][number[-1, [0, -1]], 2])
    return np.array(found)


@pytest.mark.matrix
def test_slit_ring_lifted():
    table = np.array(list(SLIT_RING.values()))
    few = np.array([4, 8]), 0.03, 1.0
    cells, most, order = few if FEW else (np.array([4, 8, 12]), 0.017, 1.1)
    errors = np.array([lifted_ring(int(n), 8 * int(n)) / table - 1.0 for n in cells])
    assert (errors < 0.0).all()  # stiff: strains in the plane are constant in each triangle
    assert np.abs(errors[-1]).max() < most
    assert np.abs(errors[:, 0]).max() < 0.02
    for case in np.abs(errors).reshape(len(cells), -1).T:
        assert observed_order(1.0 / cells, case) > order
