"""Forces and tangents against JAX: autodiff of energies written anew, in 64 bit.

The dihedral is the angle by which wing i must be turned about the axis, through the front, to
fall on wing l: another road than the closed form of the package.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from itertools import product

import numpy as np
import pytest
from samples import MODELS, relative, state, structure

import foldyn as fd
from foldyn.materials import LinearBar, LinearHinge, Ogden, Superlinear
from pairwise import beyond

jax = pytest.importorskip("jax")
jnp = jax.numpy
jax.config.update("jax_enable_x64", True)

TOLERANCE = 1e-12
TWO_PI = 2 * math.pi


def dihedral(points):
    """Angle of points (4, 3): axis j, k, wings i, l."""
    j, k, i, l = points  # noqa: E741
    axis = (k - j) / jnp.linalg.norm(k - j)
    first, second = i - j, l - j
    first = first - jnp.dot(first, axis) * axis
    second = second - jnp.dot(second, axis) * axis
    front = jnp.cross(axis, first)
    angle = jnp.arctan2(jnp.dot(second, front), jnp.dot(second, first))
    return jnp.where(angle < 0, angle + TWO_PI, angle)


def published(theta, rest, theta1, theta2):
    """EnhancedLinear per k, energy as published (design, section 5)."""
    mirrored = theta > theta2
    t = jnp.where(mirrored, TWO_PI - theta, theta)
    r = jnp.where(mirrored, TWO_PI - rest, rest)
    limit = jnp.where(mirrored, TWO_PI - theta2, theta1)
    beyond = t < limit
    safe = jnp.where(beyond, t, limit)
    p = jnp.pi / limit
    locked = (r - limit) ** 2 / 2 + (r - limit) * (limit - safe)
    locked = locked - 4 / p**2 * jnp.log(jnp.cos(p * (limit - safe) / 2))
    return jnp.where(beyond, locked, (theta - rest) ** 2 / 2)


def law_energy(law):
    """Energy per k as a function of (theta, rest) of a hinge law object."""
    if isinstance(law, LinearHinge):
        return lambda theta, rest: (theta - rest) ** 2 / 2
    if isinstance(law, Superlinear):
        return lambda theta, rest: 3 / 7 * jnp.abs(theta - rest) ** (7 / 3)
    if isinstance(law, fd.PlateSuperlinear):
        square = math.radians(law.onset) ** 2
        return lambda theta, rest: (
            3 / 7 * square * ((1 + (theta - rest) ** 2 / square) ** (7 / 6) - 1)
        )
    limits = math.radians(law.theta1), math.radians(law.theta2)
    if law.rest == "as_published":
        return lambda theta, rest: published(theta, rest, *limits)

    def stress_free(theta, rest):
        moment = jax.grad(published)(rest, jax.lax.stop_gradient(rest), *limits)
        change = published(theta, rest, *limits) - published(rest, rest, *limits)
        return change - moment * (theta - rest)

    return stress_free


@functools.cache
def hinge_oracle(law):
    """Energy, force (4, 3) and tangent (4, 3, 4, 3) of hinges (n, 4, 3), compiled."""
    per_unit = law_energy(law)

    def energy(points, rest):
        return per_unit(dihedral(points), rest)

    return in_batches(jax.jit(jax.vmap(lambda x, r: (energy(x, r), *forces(energy, x, r)))))


@functools.cache
def bar_oracle(law):
    """Energy, force (2, 3) and tangent (2, 3, 2, 3) per E A L of bars (n, 2, 3), compiled."""

    def energy(points, length):
        stretch = jnp.linalg.norm(points[1] - points[0]) / length
        if isinstance(law, Ogden):
            return ((stretch**5 - 1) / 5 - (stretch - 1)) / 4
        assert isinstance(law, LinearBar)
        return ((stretch**2 - 1) / 2) ** 2 / 2

    return in_batches(jax.jit(jax.vmap(lambda x, r: (energy(x, r), *forces(energy, x, r)))))


def in_batches(oracle, size=32):
    """The oracle on any number of elements, compiled for one number only."""

    def run(x, r):
        if len(x) == 0:
            return tuple(np.zeros((0, *x.shape[1:] * k)) for k in range(3))
        pick = np.arange(-(-len(x) // size) * size) % len(x)
        parts = [oracle(x[p], r[p]) for p in pick.reshape(-1, size)]
        return tuple(np.concatenate(column)[: len(x)] for column in zip(*parts, strict=True))

    return run


def forces(energy, x, r):
    return jax.grad(energy)(x, r), jax.hessian(energy)(x, r)


def assemble(n, nodes, scale, force, tangent):
    """Sum element forces and tangents of elements with the given nodes."""
    f, k = np.zeros((n, 3)), np.zeros((n, 3, n, 3))
    for row, c, fe, ke in zip(nodes, scale, force, tangent, strict=True):
        np.add.at(f, row, c * fe)
        for a, na in enumerate(row):
            for b, nb in enumerate(row):
                k[na, :, nb, :] += c * ke[a, :, b, :]
    return f, k.reshape(3 * n, 3 * n)


SOME = ("miura n5b8",)
OTHERS = sorted(name for name in MODELS if "coupled" not in name and name not in SOME)
AMPLITUDES = (0.02, 0.15, 0.4)


@pytest.mark.matrix
@pytest.mark.parametrize(  # JAX compiles each anew: all states of a model where it is compiled
    ("name", "amplitude"), [*product(SOME, AMPLITUDES), *beyond(product(OTHERS, AMPLITUDES), 8)]
)
def test_whole_structure(name, amplitude):
    """Up to states in which hinges are nearly closed and bars a third longer or shorter."""
    s = structure(name)
    # creases in series with panels are held against another solution in materials/test_series.py
    s = dataclasses.replace(s, panel_softness=np.zeros(0))
    u = state(s, seed=7, amplitude=amplitude)
    x = s.nodes + u
    stiffness = s.sheet.youngs_modulus * s.bar_area * s.bar_length
    energy, force, tangent = bar_oracle(s.bar_law)(x[s.bars], s.bar_length)
    n = len(s.nodes)
    f, k = assemble(n, s.bars, stiffness, force, tangent)
    wanted = {"strain_bars": float(np.sum(stiffness * energy))}
    groups = {
        "strain_folds": (s.folds, s.fold_stiffness, s.fold_rest, s.fold_law),
        "strain_bends": (s.bends, s.bend_stiffness, s.bend_rest, s.bend_law),
    }
    for group, (rows, stiff, rest, law) in groups.items():
        energy, force, tangent = hinge_oracle(law)(x[rows], rest)
        wanted[group] = float(np.sum(stiff * energy))
        fe, ke = assemble(n, rows, stiff, force, tangent)
        f, k = f + fe, k + ke
    assert relative(s.internal_force(u), f) < TOLERANCE
    assert relative(s.tangent(u).toarray(), k) < TOLERANCE
    total = sum(wanted.values())
    assert s.energy(u) == pytest.approx(total, rel=1e-12)
    for group, value in wanted.items():
        assert s.energies(u)[group] == pytest.approx(value, rel=1e-11, abs=1e-13 * total)
