"""Duffing's oscillator of two bars: a node between them moves across their line.

A bar of length L and stiffness E A, linear in Green strain, holds the energy
E A L / 2 (w^2 / 2 L^2)^2 where one of its ends has moved by w across it: the restoring force is
exactly cubic. With the node a little off the line the pair is a shallow arch with two states.
"""

from __future__ import annotations

import numpy as np

import foldyn as fd
from foldyn.structures import ModelOptions

TURN = 2.0 * np.pi
SIZE = 1e-3  # m: x = place / SIZE, so small that the bars hardly turn
AREA = 1e-4
MIDDLE = 1  # node


def duffing(
    linear: float = 0.0, alpha: float = 0.0, force: float = 0.0, omega: float = 1.0,
    phase: float = 0.0, cubic: bool = True,
) -> fd.Case:  # fmt: skip
    """x'' + alpha x' + linear x + x^3 = force sin(omega t + phase), mass 1 kg.

    linear : below 0 two states at +-sqrt(-linear); node at rest in the upper one, see `place`.
    """
    rise = SIZE * np.sqrt(max(-linear, 0.0))
    stiffness = 1.0 / SIZE**2 if cubic else 1e-9
    structure = fd.Structure(
        nodes=np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, rise], [1.0, 0.0, 0.0]]),
        bars=np.array([[0, 1], [1, 2]]),
        bar_area=np.array([AREA, AREA]),
        sheet=fd.Sheet(stiffness / AREA, 0.3, 0.01),
        options=ModelOptions(bar_law="linear"),
        node_mass=np.ones(3),
    )
    supports: list = [fd.Fix([0, 2]), fd.Fix([MIDDLE], "xy")]
    if linear > 0.0:
        supports.append(fd.Spring(linear, nodes=[MIDDLE], direction="z"))
    push = fd.Force([MIDDLE], (0.0, 0.0, force * SIZE), fd.Harmonic(omega / TURN, phase))
    return fd.Case(structure, supports, [push] if force else [], fd.Rayleigh(alpha=alpha))


def place(case: fd.Case, displacement: np.ndarray) -> np.ndarray:
    """x of displacements (..., n, 3), m."""
    return (displacement[..., MIDDLE, 2] + case.structure.nodes[MIDDLE, 2]) / SIZE


def at(case: fd.Case, x: float, v: float = 0.0) -> fd.State:
    """The state with x and x'."""
    u, w = np.zeros((3, 3)), np.zeros((3, 3))
    u[MIDDLE, 2] = x * SIZE - case.structure.nodes[MIDDLE, 2]
    w[MIDDLE, 2] = v * SIZE
    return fd.State(u, w)


X = fd.Quantity("1", "x", function=lambda u, v, t: u[MIDDLE, 2] / SIZE)
"""x of a case whose node is on the line at rest."""
