"""What motions keep, and how near they are to each other."""

from __future__ import annotations

from typing import Any

import numpy as np
from moving_sheets import equal_steps, steps_of

import foldyn as fd
from foldyn.signals import matrix_pencil


def momenta(s: Any, motion: Any) -> tuple[np.ndarray, np.ndarray]:
    """Linear (kg m/s) and angular momentum (kg m2/s) about the origin, per sample."""
    carried = np.array([s.mass @ v for v in motion.velocity.values])
    x = s.nodes + motion.displacement.values
    return carried.sum(axis=1), np.cross(x, carried).sum(axis=1)


def strain(motion: Any) -> np.ndarray:
    """All that is stored, J, per sample."""
    stored = [name for name in motion.data_vars if name.startswith("strain_") or name == "contact"]
    return sum(motion[name].values for name in stored)


def energy(motion: Any) -> np.ndarray:
    return strain(motion) + motion.kinetic.values


def balance(motion: Any) -> float:
    """Largest error of the energy balance, over the largest work."""
    left = energy(motion) + motion.dissipated.values - motion.work.values
    return float(np.abs(left - left[0]).max() / np.abs(motion.work).max())


def drift(values: np.ndarray) -> float:
    """Largest change over the largest value at the start."""
    return float(np.abs(values - values[0]).max() / np.abs(values[0]).max())


def apart(one: Any, other: Any, name: str = "displacement") -> float:
    """Largest difference of a variable of two results (or of arrays) over the largest value."""
    a, b = (x[name].values if hasattr(x, "data_vars") else np.asarray(x) for x in (one, other))
    assert a.shape == b.shape
    return float(np.abs(a - b).max() / np.abs(b).max())


def agree(found: Any, wanted: Any, near: float) -> None:
    """Hold all that a result tells over time to another one, relative to the largest values."""
    for name in wanted.data_vars:
        values = wanted[name].values
        if "time" in wanted[name].dims and values.dtype.kind == "f":
            gap = np.abs(found[name].values - values).max()
            assert gap <= near * np.abs(values).max(), name


def order(steps, errors) -> float:
    """Observed order of errors of so many equal steps."""
    return fd.checks.observed_order(1.0 / np.asarray(steps), errors)


def decay(case: fd.Case, method: str, number: int = 0) -> tuple[float, float]:
    """Damping ratio of a small free vibration in a mode, and the energy error."""
    mode = fd.modes(case, number + 1).isel(mode=number)
    shape, period = mode["shape"].values, 1.0 / float(mode.frequency)
    start = fd.State(1e-6 * shape / np.abs(shape).max())
    numeric = steps_of(method, period / 200) | equal_steps(method)
    motion = fd.simulate(
        case, 3 * period, method=method, initial=start, interval=period / 40, **numeric
    )
    modal = np.einsum("tna,na->t", motion.displacement.values, case.structure.mass @ shape)
    fit = matrix_pencil(modal, period / 40, order=2)
    return fit.damping_ratio[np.argmax(fit.amplitude)], motion.attrs["energy_error"]
