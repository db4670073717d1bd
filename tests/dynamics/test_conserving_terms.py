"""The conserving method with everything that may add to the energy of a sheet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import foldyn as fd
from foldyn.checks import observed_order

MODELS = ("plate", "n5b8e", "shell")
SHEET = fd.Sheet(1e6, 0.25, 0.01, 1000.0)
AXIAL = [
    fd.Spring(0.3, between=[(3, 10)]),
    fd.Spring(0.05, between=[(0, 14)], rest_length=2.0),
    fd.Spring(0.02, between=[(4, 11)], rest_length=0.0),
]
GROUNDED = [fd.Spring(2.0, [9], direction="z"), fd.Spring(0.6, [14])]


def sheet(model: str, **options: Any) -> Any:
    pattern = fd.patterns.miura(cells=(2, 1), a=1.0, b=1.0, panel_angle=60, dihedral=100)
    options = {"fold_law": fd.EnhancedLinear(70, 290)} | options
    if model == "shell":
        return fd.shell(pattern, SHEET, 1, **options)
    return fd.discretize(pattern, SHEET, preset=model, **options)


def thrown(case: fd.Case, spin: Sequence[float] = (0.1, 1.0, 0.15)) -> fd.State:
    """Flying, and spinning about an oblique axis."""
    s = case.structure
    x = s.nodes - (s.mass @ s.nodes).sum(axis=0) / s.mass.sum()
    v = np.cross(spin, x) + np.array([0.4, 0.0, 1.0])
    return fd.State(velocity=np.where(case.fixed, 0.0, v))


def drift(values: np.ndarray) -> float:
    """Largest change relative to the largest value at the start."""
    return float(np.abs(values - values[0]).max() / np.abs(values[0]).max())


def energy(case: fd.Case, motion: Any) -> np.ndarray:
    return sum(motion[name].to_numpy() for name in ("kinetic", *case.energy_groups))


@pytest.mark.parametrize("dt", [4e-3, 5e-2])
@pytest.mark.parametrize("model", MODELS)
def test_a_free_sheet_with_springs_keeps_energy_and_both_momenta(model, dt):
    """Also with steps in which it turns by 3 degrees, hundreds of times RK4's critical one."""
    case = fd.Case(sheet(model), AXIAL)
    motion = fd.simulate(case, 200 * dt, "energy_momentum", dt=dt, every=10, initial=thrown(case))
    p = np.array([case.structure.mass @ v for v in motion.velocity.to_numpy()])
    h = np.cross(case.structure.nodes + motion.displacement.to_numpy(), p).sum(axis=1)
    total = energy(case, motion)
    assert np.ptp(motion.strain_springs.to_numpy()) > 0.1 * float(motion.strain_springs[0])
    assert max(drift(total), drift(h), drift(p.sum(axis=1))) < 1e-10


@pytest.mark.matrix
@pytest.mark.parametrize("model", MODELS)
def test_nothing_adds_up_over_1e4_steps(model):
    case = fd.Case(sheet(model), AXIAL)
    options = {"dt": 5e-3, "every": 100, "initial": thrown(case, (0.03, 0.3, 0.05))}
    motion = fd.simulate(case, 50.0, "energy_momentum", **options)
    assert motion.attrs["steps"] == 10_000
    assert drift(energy(case, motion)) < 1e-9


@pytest.mark.parametrize("dt", [1e-3, 1e-2])
@pytest.mark.parametrize("model", ["herkal", "shell"])
def test_a_clamped_sheet_on_springs_keeps_its_energy(model, dt):
    case = fd.Case(sheet(model, clamped=[(0, 1)]), [fd.Fix([0, 1]), *AXIAL, *GROUNDED])
    start = thrown(case, (0.0, 0.3, 0.0))
    motion = fd.simulate(case, 200 * dt, "energy_momentum", dt=dt, every=10, initial=start)
    total = energy(case, motion)
    assert np.ptp(motion.kinetic.to_numpy()) > 0.05 * total[0]
    assert np.ptp(total) < 1e-9 * max(total[0], 1.0)


def everything(model: str) -> fd.Case:
    """A sheet with loads of many kinds, moving supports, an actuated fold, springs and damping."""
    supports = [
        fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2], "z"), fd.Fix([1], "y"),
        fd.Impose([12], "x", 0.02, fd.Ramp(0.05)),
        fd.BaseMotion("z", fd.Harmonic(20.0), 1e-3),
        *AXIAL, *GROUNDED, fd.Dashpot(5.0, between=[(2, 6)]),
    ]  # fmt: skip
    loads = [
        fd.Force([14], (0.0, 0.0, 1.0), fd.Harmonic(30.0)),
        fd.Gravity((0.0, 0.0, -9.81)),
        fd.Actuate([3, 5], 150.0, fd.Ramp(0.05)),
        fd.Pressure(3.0, history=fd.Harmonic(10.0)),
        fd.CreaseMoment([1], 0.05, fd.Ramp(0.02)),
    ]
    damping = [fd.Rayleigh(alpha=1.0, beta=1e-5), fd.StrainDamping(1e-5)]
    return fd.Case(sheet(model), supports, loads, damping[: 2 if model == "plate" else 1])


@pytest.mark.filterwarnings("ignore:damping. beta resists rotations")
@pytest.mark.parametrize("model", MODELS)
def test_the_balance_closes_with_everything_that_acts(model):
    motion = fd.simulate(everything(model), 0.1, "energy_momentum", dt=5e-4)
    parts = {name: float(np.abs(motion[name]).max()) for name in ("dissipated", "work", "kinetic")}
    assert min(parts.values()) > 1e-3 * max(parts.values())
    assert motion.attrs["energy_error"] < 1e-9


@pytest.mark.parametrize("model", MODELS)
def test_it_is_of_order_two_and_tends_to_the_motion_of_other_methods(model):
    case, duration = everything(model), 0.02

    def end(method: str, steps: int) -> np.ndarray:
        dt = duration / steps
        return fd.simulate(case, duration, method, dt=dt, every=steps).displacement.to_numpy()[-1]

    right, steps = end("newmark", 1600), np.array([50, 100, 200])
    errors = [np.abs(end("energy_momentum", n) - right).max() for n in steps.tolist()]
    assert observed_order(duration / steps, errors) == pytest.approx(2.0, abs=0.1)
    assert errors[-1] < 5e-5 * np.abs(right).max()


@pytest.mark.parametrize("model", ["n5b8e", "shell"])
def test_dofs_without_mass_do_not_ring(model):
    """What they store beyond their balance: nothing with a linear law, little with another."""
    for law, most in (("linear", 1e-11), ("superlinear", 1e-4)):
        case = fd.Case(sheet(model, fold_law=law))
        options = {"dt": 5e-3, "every": 20, "initial": thrown(case)}
        motion = fd.simulate(case, 2.0, "energy_momentum", **options)
        body, strain = case.structure.body, energy(case, motion) - motion.kinetic.to_numpy()
        least = [body.energies(body.dofs(u)).sum() for u in motion.displacement.to_numpy()]
        assert np.abs(strain - least).max() < most * strain.max()


@pytest.mark.parametrize("model", ["n5b8e", "shell"])
def test_a_moment_that_jumps_moves_dofs_without_mass_at_once(model):
    s = sheet(model)
    jump = fd.CreaseMoment("all", 0.3 * float(s.fold_stiffness[0]), fd.Step(0.05))
    case = fd.Case(s, [fd.Fix([0, 1, 2])], [jump])
    motion = fd.simulate(case, 0.2, "energy_momentum", dt=2e-3)
    assert float(motion.work[-1]) > 1e-6
    assert motion.attrs["energy_error"] < 1e-9
