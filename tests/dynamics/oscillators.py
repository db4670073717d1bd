"""Structures whose motion is known: one mass on one bar, with laws made to fit."""

from __future__ import annotations

import numpy as np
from moving_sheets import equal_steps

import foldyn as fd
from foldyn.dynamics.stability import MARGIN
from foldyn.signals import log_decrement
from foldyn.structures import ModelOptions

LENGTH = 2.0  # of the bar, m
MASS = 0.5  # kg


def linear_law() -> fd.CustomBarLaw:
    """S = (lambda - 1) / lambda: the axial force is E A (lambda - 1), linear in displacement."""
    return duffing_law(0.0)


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


def spring(omega: float, **damping: float) -> fd.Case:
    """A mass on a linear spring, with the angular frequency `omega` (rad/s)."""
    return oscillator(linear_law(), MASS * omega**2, **damping)


def pulled(case: fd.Case, force: float, history=None) -> fd.Case:
    """The case with a force (N) along x on its mass."""
    return case.altered(loads=[*case.loads, fd.Force([1], (force, 0.0, 0.0), history)])


def place(motion) -> np.ndarray:
    """Displacement (nt,) of the mass."""
    return motion.displacement.values[:, 1, 0]


def damped(t: np.ndarray, omega: float, ratio: float) -> np.ndarray:
    """Motion from rest at 1: e^(-z w t) (cos + z w / wd sin), by the ratio z."""
    wd, decay = omega * np.sqrt(1.0 - ratio**2), ratio * omega
    return np.exp(-decay * t) * (np.cos(wd * t) + decay / wd * np.sin(wd * t))


def after_pulse(t: np.ndarray, omega: float, end: float) -> np.ndarray:
    """Motion from rest under a force of 1 N that ends."""
    static = 1.0 / (MASS * omega**2)
    gone = np.where(t > end, 1.0 - np.cos(omega * (t - end)), 0.0)
    return static * (1.0 - np.cos(omega * t) - gone)


def about_the_limit(case: fd.Case, method: str, over: float) -> list[float]:
    """Largest late displacements with steps below and above the largest stable one."""
    limit, found = fd.critical_step(case, method) / MARGIN, []
    for dt in (0.98 * limit, over * limit):
        try:
            motion = fd.simulate(
                case, 400 * dt, method=method, dt=dt, initial=released(0.1), force=True
            )
            found.append(float(abs(motion.displacement[-50:]).max()))
        except fd.errors.InstabilityError:
            found.append(np.inf)
    return found


def decrement(case: fd.Case, method: str, omega: float):
    """Logarithmic decrement of a free vibration of six periods, and its motion."""
    period = 2.0 * np.pi / omega
    radius = {"spectral_radius": 1.0} if method == "generalized_alpha" else {}
    motion = fd.simulate(
        case, 6 * period, method=method, initial=released(1e-3), interval=period / 40,
        dt=period / 400,
        **equal_steps(method), **radius,
    )  # fmt: skip
    return log_decrement(place(motion), period / 40, rest=0.0).decrement, motion


def steady(motion, node: int, axis: int, frequency: float, after: float) -> complex:
    """Amplitude of the part of a motion that goes as sin(w t), and i times that as cos(w t)."""
    late = motion.time.values > after
    phase = 2.0 * np.pi * frequency * motion.time.values[late]
    basis = np.stack([np.sin(phase), np.cos(phase)], axis=1)
    x = motion.displacement.values[late, node, axis]
    return complex(*np.linalg.lstsq(basis, x, rcond=None)[0])


def released(amplitude: float, speed: float = 0.0) -> fd.State:
    """Node 1 displaced by `amplitude` and moving with `speed` along x."""
    u, v = np.zeros((2, 3)), np.zeros((2, 3))
    u[1, 0], v[1, 0] = amplitude, speed
    return fd.State(u, v)
