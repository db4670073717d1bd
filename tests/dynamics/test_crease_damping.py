"""Damped creases in motions of both models: small ones against formulas, large ones in energy."""

from __future__ import annotations

import numpy as np
import pytest
from oscillators import equal_steps

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.signals import matrix_pencil

K, C = 0.05, 2e-3  # N m/rad and N m s/rad per m of crease


def flap(model: str, modulus: float = 1e6, dihedral: float = 120.0, **more) -> fd.Case:
    """A simple fold, one panel held; the other one turns about the crease."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=dihedral)
    sheet = fd.Sheet(modulus, 0.25, 0.01, 1.0)
    laws = {"fold_law": "linear", "crease_stiffness": K}
    if model == "bars":
        s = fd.discretize(pattern, sheet, bend_law="linear", **laws, preset="herkal")
        held = [node for node in range(len(s.nodes)) if node not in (4, 5, 7)]
    else:
        s = fd.shell(pattern, sheet, divisions=3, **laws)
        held = np.flatnonzero(s.nodes[:, 0] <= s.nodes[2, 0] + 1e-9).tolist()
    return fd.Case(s, [fd.Fix(held)], **{"damping": fd.CreaseDamping(C)} | more)


@pytest.mark.parametrize("model", ["bars", "shell"])
def test_ratio_of_the_folding_mode(model):
    """Of stiff panels z = c w / (2 k): c L theta' against k L theta, whatever the inertia."""
    errors = []
    for modulus in (1e8, 1e10):
        mode = fd.modes(flap(model, modulus), 1)
        omega = 2 * np.pi * float(mode.frequency[0])
        errors.append(abs(float(mode.damping_ratio[0]) / (C * omega / (2 * K)) - 1.0))
    assert errors[0] < 3e-3 and errors[1] < 3e-5  # as 1 / modulus


def test_frequency_of_the_folding_mode():
    """k L theta against the inertia of the panel's nodes about the crease."""
    case = flap("bars", 1e10)
    arm = case.structure.nodes[[4, 5, 7]] - case.structure.nodes[2]
    arm[:, 1] = 0.0
    inertia = (case.structure.nodal_mass[[4, 5, 7]] * (arm**2).sum(axis=1)).sum()
    mode = fd.modes(case, 1)
    assert float(mode.frequency[0]) == pytest.approx(np.sqrt(K / inertia) / (2 * np.pi), rel=1e-5)
    exact = C / (2 * np.sqrt(K * inertia))
    assert float(mode.damping_ratio[0]) == pytest.approx(exact, rel=1e-5)


def swing(case: fd.Case, method: str, steps: int | None) -> tuple[float, float]:
    """Damping ratio of a small free vibration over that of the mode, and the energy error."""
    mode = fd.modes(case, 1)
    shape, period = mode.shape.values[0], 1.0 / float(mode.frequency[0])
    start = fd.State(1e-5 * shape / np.abs(shape).max())
    motion = fd.simulate(
        case, 3 * period, method, dt=None if steps is None else period / steps, initial=start,
        every=period / 40, **equal_steps(method),
    )  # fmt: skip
    fit = matrix_pencil((motion.displacement.values * shape).sum(axis=(1, 2)), period / 40, 2)
    ratio = fit.damping_ratio[np.argmax(fit.amplitude)]
    return ratio / float(mode.damping_ratio[0]), motion.attrs["energy_error"]


@pytest.mark.parametrize("method", METHODS)
def test_decay_of_bars_and_hinges(method):
    implicit = METHODS[method].implicit
    ratio, error = swing(flap("bars"), method, 200 if implicit else None)
    assert ratio == pytest.approx(1.0, abs=1e-3)
    assert error < 1e-3


@pytest.mark.parametrize("method", ["newmark", "generalized_alpha", "energy_momentum"])
def test_decay_of_the_shell(method):
    """The rotations at the crease, without mass, take part in its angle."""
    ratio, error = swing(flap("shell"), method, 200)
    assert ratio == pytest.approx(1.0, abs=1e-3)
    assert error < 1e-3


@pytest.mark.parametrize("method", METHODS)
def test_a_folded_sheet_that_spins_loses_nothing(method):
    """Rigid rotation of a free fold."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=100)
    s = fd.discretize(pattern, fd.Sheet(1e7, 0.25, 0.01, 1.0), fold_law="linear", preset="herkal")
    case = fd.Case(s, damping=fd.CreaseDamping(1.0))
    spin = np.array([0.0, 0.3, 0.0])
    v = np.cross(spin, s.nodes - s.center_of_mass)
    numeric = {"dt": 1e-3} if METHODS[method].implicit else {}
    motion = fd.simulate(case, 1.0, method, initial=fd.State(0 * v, v), every=0.1, **numeric)
    # what the centrifugal forces stretch and fold is of the order of the spin to the fourth power
    assert float(motion.dissipated[-1]) < 1e-4 * float(motion.kinetic[0])


def large_folding(model: str, method: str, modulus: float, **numeric):
    """A fold brought from 170 to 60 degrees by its damped crease's own stiffness."""
    case = flap(model, modulus, 170.0, damping=fd.CreaseDamping(0.02))
    load = fd.Actuate("all", 300.0, fd.Ramp(1.5, smooth=True))
    case = fd.Case(case.structure, case.supports, [load], case.damping)
    return case, fd.simulate(case, 3.0, method, every=0.01, **numeric)


def check_folding(case: fd.Case, motion, angle: np.ndarray, tolerance: float) -> None:
    """Dissipation is the integral of c L theta'^2, and the energy balance closes."""
    assert np.degrees(abs(angle[-1] - angle[0])) > 100.0
    rate = np.gradient(angle, 0.01, edge_order=2)
    taken = 0.02 * np.trapezoid(rate**2, dx=0.01)
    assert float(motion.dissipated[-1]) == pytest.approx(taken, rel=3e-4)
    assert motion.attrs["energy_error"] < tolerance


@pytest.mark.parametrize("method", METHODS)
def test_a_large_folding(method):
    """All methods on bars and hinges, the dihedrals taken from the samples."""
    implicit = METHODS[method].implicit
    case, motion = large_folding("bars", method, 1e7, **({"dt": 0.005} if implicit else {}))
    angle = np.array([case.structure.dihedrals(u)[0][0] for u in motion.displacement.values])
    check_folding(case, motion, angle, 1e-4)


def test_a_large_folding_of_the_shell():
    """Of stiff panels the dihedral of the crease is that of the nodes beside it."""
    case, motion = large_folding("shell", "newmark", 1e9, dt=0.005)
    hinge = case.structure.folds[0]
    x = case.structure.nodes + motion.displacement.values
    axis = x[:, hinge[1]] - x[:, hinge[0]]
    one, two = (np.cross(axis, x[:, hinge[k]] - x[:, hinge[0]]) for k in (2, 3))
    cosine = (one * two).sum(axis=1)
    cosine /= np.linalg.norm(one, axis=1) * np.linalg.norm(two, axis=1)
    check_folding(case, motion, np.arccos(cosine), 1e-4)
