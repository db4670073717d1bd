"""Structures whose motion is known: one mass on one bar, with laws made to fit."""

from __future__ import annotations

import numpy as np

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.structures import ModelOptions

LENGTH = 2.0  # of the bar, m
MASS = 0.5  # kg


def linear_law() -> fd.CustomBarLaw:
    """S = (lambda - 1) / lambda: the axial force is E A (lambda - 1), linear in displacement."""
    return fd.CustomBarLaw(
        energy_of=lambda s: 0.5 * (s - 1.0) ** 2,
        stress_of=lambda s: (s - 1.0) / s,
        slope_of=lambda s: 1.0 / s**3,
        name="spring",
    )


def duffing_law(cubic: float) -> fd.CustomBarLaw:
    """Axial force E A (e + cubic e^3), e = lambda - 1."""
    return fd.CustomBarLaw(
        energy_of=lambda s: 0.5 * (s - 1.0) ** 2 + 0.25 * cubic * (s - 1.0) ** 4,
        stress_of=lambda s: ((s - 1.0) + cubic * (s - 1.0) ** 3) / s,
        slope_of=lambda s: (1.0 / s + cubic * (s - 1.0) ** 2 * (2.0 + 1.0 / s)) / s**2,
        name="duffing",
    )


def oscillator(law: fd.BarLaw, stiffness: float, **damping: float) -> fd.Case:
    """A mass on a bar along x: node 0 held, node 1 free along x, k = E A / L."""
    structure = fd.Structure(
        nodes=np.array([[0.0, 0.0, 0.0], [LENGTH, 0.0, 0.0]]),
        bars=np.array([[0, 1]]),
        bar_area=np.array([1e-4]),
        sheet=fd.Sheet(stiffness * LENGTH / 1e-4, 0.3, 0.01),
        options=ModelOptions(bar_law=law),
        node_mass=np.array([MASS, MASS]),
    )
    supports = [fd.Fix([0], "xyz"), fd.Fix([1], "yz")]
    return fd.Case(structure, supports=supports, damping=fd.Rayleigh(**damping))


def released(amplitude: float, speed: float = 0.0) -> fd.State:
    """Node 1 displaced by `amplitude` and moving with `speed` along x."""
    u, v = np.zeros((2, 3)), np.zeros((2, 3))
    u[1, 0], v[1, 0] = amplitude, speed
    return fd.State(u, v)


def equal_steps(method: str) -> dict[str, float]:
    """Arguments of `simulate` with which a method that controls its error takes equal steps."""
    return {"tolerance": 1e6} if METHODS[method].adaptive else {}
