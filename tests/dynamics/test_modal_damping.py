"""Damping ratios of modes in motions of both models, with all integrators."""

from __future__ import annotations

import numpy as np
import pytest
from measured import apart, decay, drift, momenta
from moving_sheets import IMPLICIT, fold
from oscillators import steady

import foldyn as fd
from foldyn.dynamics import METHODS, modal_damping
from foldyn.dynamics.driver import prepare
from foldyn.dynamics.modal_damping import modal_rows, rows_of

RATIOS = (0.02, 0.05)


def sheet(model: str, mass: str | None = None, **more) -> fd.Case:
    """A Miura cell with linear laws, held at one edge."""
    material = fd.Sheet(1e5, 0.25, 0.01, 1.0)
    pattern = fd.patterns.miura(b=1.2, dihedral=80)
    if model == "bars":
        laws = {"bend_law": "linear", "fold_law": "linear", "bar_law": "linear"}
        s = fd.discretize(pattern, material, mass=mass or "circumcenter", **laws, preset="herkal")
    else:
        s = fd.shell(pattern, material, divisions=2, mass=mass or "lumped", fold_law="linear")
    return fd.Case(s, [fd.Fix("xmin", "xyz")], **{"damping": fd.ModalDamping(RATIOS)} | more)


def shaken(case: fd.Case, size: float, seed: int = 2) -> fd.State:
    random = np.random.default_rng(seed).standard_normal(case.fixed.shape)
    return fd.State(velocity=size * random * ~case.fixed)


@pytest.mark.parametrize(
    ("model", "mass", "number", "method"),
    [
        *(("bars", None, number, method) for number in (0, 1) for method in METHODS),
        *(("shell", None, number, "newmark") for number in (0, 1)),
        ("bars", "consistent", 1, "newmark"),
    ],
)
def test_each_mode_decays_with_its_ratio(model, mass, number, method):
    case = sheet(model, mass)
    ratio, error = decay(case, method, number)
    assert ratio == pytest.approx(RATIOS[number], rel=1e-3)
    assert error < 2e-3


def test_modes_that_are_not_listed_are_not_damped():
    assert abs(decay(sheet("bars"), "newmark", 2)[0]) < 1e-6


@pytest.mark.filterwarnings("ignore:the energy balance")  # numerical damping
@pytest.mark.parametrize("method", IMPLICIT)
def test_strong_damping_converges_as_fast(method):
    """Woodbury's formula keeps Newton's method for ratios far above 1, where a matrix without
    the rows would diverge."""
    iterations = []
    for ratio in (0.0, 5.0):
        case = sheet("bars", damping=fd.ModalDamping(ratio, 4))
        start = fd.State(velocity=1e-4 * ~case.fixed * [0.0, 0.0, 1.0])
        motion = fd.simulate(case, 1.0, method=method, dt=0.01, initial=start)
        iterations.append(motion.attrs["iterations"])
    assert iterations[1] < 1.3 * iterations[0]


@pytest.mark.matrix
@pytest.mark.parametrize(("model", "count"), [("bars", 30), ("shell", 66)])
def test_ratios_of_rayleigh(model, count):
    """With Rayleigh's own ratios of all modes it is Rayleigh's matrix: the same motion."""
    plain = sheet(model, damping=fd.Rayleigh(0.3, 0.01))
    ratios = fd.modes(plain, count).damping_ratio.values.tolist()
    modal = plain.altered(damping=fd.ModalDamping(ratios))
    options = {"dt": 2e-3, "initial": shaken(plain, 1e-4), "every_steps": 10}
    one, other = (fd.simulate(case, 0.5, method="newmark", **options) for case in (plain, modal))
    assert apart(other, one) < 2e-3
    assert float(one.dissipated[-1]) == pytest.approx(float(other.dissipated[-1]), rel=2e-3)


@pytest.mark.parametrize("damping", [fd.ModalDamping([0.1, 0.04]), fd.ModalDamping(0.07, 1)])
def test_modes_of_one_frequency_share_their_ratios(damping):
    """Which of the sums of two bending modes of a tower is the first one, rounding decides."""
    tower = fd.patterns.kresling(sides=5, height=1.0, twist=30.0)
    s = fd.discretize(tower, fd.Sheet(1e6, 0.3, 0.03, 1000.0), fold_law="linear", preset="plate")
    with pytest.warns(fd.errors.FoldynWarning, match="2 modes have frequencies in common"):
        ratio = fd.modes(fd.Case(s, damping=damping), 9).damping_ratio.values
    mean = 0.07 if isinstance(damping.ratios, tuple) else 0.035
    np.testing.assert_allclose(ratio[6:], [mean, mean, 0.0], atol=1e-6)


def test_all_modes_by_one_number():
    ratios = fd.modes(sheet("bars", damping=fd.ModalDamping(0.03)), 30).damping_ratio.values
    assert ratios == pytest.approx(np.full(30, 0.03), rel=1e-6)


@pytest.mark.parametrize("model", ["bars", "shell"])
@pytest.mark.parametrize("mass", [None, "consistent"])
def test_translations_are_not_damped(model, mass):
    """Where the base moves, deformation is damped and not the motion with it."""
    case = sheet(model, mass)
    modal = modal_rows(case)
    whole = np.zeros((case.body.size, 3))
    whole[: case.structure.nodes.size] = np.tile(np.eye(3), (len(case.structure.nodes), 1))
    assert np.abs(modal.rows @ whole).max() < 1e-6 * np.abs(modal.rows).max()
    frequency = 2 * np.pi * fd.modes(case, 2).frequency.values
    assert modal.rate == pytest.approx((2 * np.array(RATIOS) * frequency).max())


@pytest.mark.matrix
def test_a_moving_base():
    """The simulated response to a base motion is that of the linear analysis."""
    case = sheet("bars", damping=fd.ModalDamping(0.1))
    f = 0.7 * float(fd.modes(case, 1).frequency[0])
    driven = case.altered(supports=[*case.supports, fd.BaseMotion("z", fd.Harmonic(f), 1e-5)])
    motion = fd.simulate(driven, 25 / f, method="newmark", dt=1 / (200 * f), every_steps=20)
    exact = complex(fd.frf(case, fd.BaseMotion("z"), frequencies=[f]).transmissibility[0, 8, 2])
    assert steady(motion, 8, 2, f, after=15 / f) / 1e-5 == pytest.approx(exact, rel=5e-3)
    assert motion.attrs["energy_error"] < 1e-3


def test_free_bodies_keep_their_momenta():
    """Rigid modes are not damped, and what is damped has no momentum."""
    case = fd.Case(sheet("bars").structure, damping=fd.ModalDamping(0.2, 5))
    motion = fd.simulate(
        case, 0.5, method="rk4", dt=1e-4, initial=shaken(case, 1e-3, 5), interval=0.05
    )
    assert drift(momenta(case.structure, motion)[0]) < 1e-9
    assert float(motion.dissipated[-1]) > 0.0


def test_an_unstable_state_is_refused():
    """About a state of compression modes have no frequency."""
    s = fold(170, fd.Sheet(1e4, 0.25, 0.01, 1.0), fold_law="linear", bend_law="linear")
    case = fd.Case(s, [fd.Fix([0, 1])], damping=fd.ModalDamping(0.1, 2, "initial"))
    u = -0.3 * ~case.fixed * [1.0, 0.0, 0.0]
    with pytest.raises(fd.errors.InputError, match='the state "initial" is unstable'):
        fd.simulate(case, 0.1, method="rk4", initial=fd.State(u))


@pytest.mark.parametrize("method", ["rk4", "generalized_alpha", "auto"])
def test_modes_are_computed_once(method, monkeypatch):
    """The critical step, the choice of a method and the motion take the same modes."""
    seen = []

    def counted(*arguments):
        seen.append(arguments)
        return rows_of(*arguments)

    monkeypatch.setattr(modal_damping, "rows_of", counted)
    prepare(
        sheet("bars", damping=fd.ModalDamping(RATIOS, state="initial")), 0.1, method, interval=0.01
    )
    assert len(seen) == 1
