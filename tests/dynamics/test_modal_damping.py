"""Damping ratios of modes in motions of both models, with all integrators."""

from __future__ import annotations

import numpy as np
import pytest
from oscillators import equal_steps

import foldyn as fd
from foldyn.dynamics import METHODS, modal_damping
from foldyn.dynamics.driver import prepare
from foldyn.dynamics.modal_damping import modal_rows, rows_of
from foldyn.signals import matrix_pencil

RATIOS = (0.02, 0.05)


def sheet(model: str, mass: str | None = None, modulus: float = 1e5, **more) -> fd.Case:
    """A Miura cell with linear laws, held at one edge."""
    material = fd.Sheet(modulus, 0.25, 0.01, 1.0)
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.2, panel_angle=60, dihedral=80)
    if model == "bars":
        laws = {"bend_law": "linear", "fold_law": "linear", "bar_law": "linear"}
        s = fd.discretize(pattern, material, mass=mass or "circumcenter", **laws, preset="herkal")
    else:
        s = fd.shell(pattern, material, divisions=2, mass=mass or "lumped", fold_law="linear")
    return fd.Case(s, [fd.Fix("xmin", "xyz")], **{"damping": fd.ModalDamping(RATIOS)} | more)


def decay(case: fd.Case, method: str, number: int, steps: int | None, every: float = 1 / 40):
    """Damping ratio of a small free vibration in a mode, and the energy error."""
    mode = fd.modes(case, 3).isel(mode=number)
    shape, period = mode["shape"].values, 1.0 / float(mode.frequency)
    start = fd.State(1e-6 * shape / np.abs(shape).max())
    motion = fd.simulate(
        case, 3 * period, method, dt=None if steps is None else period / steps, initial=start,
        every=period * every, **equal_steps(method),
    )  # fmt: skip
    mass = case.structure.mass
    modal = np.einsum("tna,na->t", motion.displacement.values, mass @ shape)
    fit = matrix_pencil(modal, period * every, 2)
    return fit.damping_ratio[np.argmax(fit.amplitude)], motion.attrs["energy_error"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("number", [0, 1])
def test_each_mode_decays_with_its_ratio(number, method):
    implicit = METHODS[method].implicit
    ratio, error = decay(sheet("bars"), method, number, 200 if implicit else None)
    assert ratio == pytest.approx(RATIOS[number], rel=1e-3)
    assert error < 2e-3


def test_modes_that_are_not_listed_are_not_damped():
    ratio, _ = decay(sheet("bars"), "newmark", 2, 200)
    assert abs(ratio) < 1e-6


@pytest.mark.parametrize("number", [0, 1])
def test_the_shell(number):
    ratio, error = decay(sheet("shell"), "newmark", number, 200)
    assert ratio == pytest.approx(RATIOS[number], rel=1e-3)
    assert error < 1e-3


def test_a_consistent_mass_matrix():
    ratio, _ = decay(sheet("bars", "consistent"), "newmark", 1, 200)
    assert ratio == pytest.approx(RATIOS[1], rel=1e-3)


@pytest.mark.filterwarnings("ignore:the energy balance")  # numerical damping
@pytest.mark.parametrize("method", ["newmark", "generalized_alpha", "energy_momentum"])
def test_strong_damping_converges_as_fast(method):
    """Woodbury's formula keeps Newton's method for ratios far above 1, where a matrix without
    the rows would diverge."""
    iterations = []
    for ratio in (0.0, 5.0):
        case = sheet("bars", damping=fd.ModalDamping(ratio, 4))
        v = np.zeros_like(case.structure.nodes)
        v[3:, 2] = 1e-4
        motion = fd.simulate(case, 1.0, method, dt=0.01, initial=fd.State(0 * v, v))
        iterations.append(motion.attrs["iterations"])
    assert iterations[1] < 1.3 * iterations[0]


@pytest.mark.parametrize("model", ["bars", "shell"])
def test_ratios_of_rayleigh(model):
    """With Rayleigh's own ratios of all modes it is Rayleigh's matrix: the same motion."""
    rayleigh = fd.Rayleigh(0.3, 0.01)
    plain = sheet(model, damping=rayleigh)
    count = {"bars": 30, "shell": 66}[model]  # all
    ratios = fd.modes(plain, count).damping_ratio.values
    modal = sheet(model, damping=fd.ModalDamping(ratios.tolist()))
    v = np.zeros_like(plain.structure.nodes)
    v[3:] = 1e-4 * np.random.default_rng(2).standard_normal((len(v) - 3, 3))
    v[plain.fixed] = 0.0
    both = [
        fd.simulate(case, 0.5, "newmark", dt=2e-3, initial=fd.State(0 * v, v), every=10)
        for case in (plain, modal)
    ]
    size = float(np.abs(both[0].displacement).max())
    assert both[0].displacement.values == pytest.approx(
        both[1].displacement.values, abs=2e-3 * size
    )
    assert float(both[0].dissipated[-1]) == pytest.approx(float(both[1].dissipated[-1]), rel=2e-3)


@pytest.mark.parametrize("damping", [fd.ModalDamping([0.1, 0.04]), fd.ModalDamping(0.07, 1)])
def test_modes_of_one_frequency_share_their_ratios(damping):
    """Which of the sums of two bending modes of a tower is the first one, rounding decides."""
    tower = fd.patterns.kresling(sides=5, height=1.0, twist=30.0)
    s = fd.discretize(tower, fd.Sheet(1e6, 0.3, 0.03, 1000.0), fold_law="linear")
    with pytest.warns(fd.errors.FoldynWarning, match="2 modes have frequencies in common"):
        ratio = fd.modes(fd.Case(s, damping=damping), 9).damping_ratio.values
    mean = 0.07 if isinstance(damping.ratios, tuple) else 0.035
    np.testing.assert_allclose(ratio[6:], [mean, mean, 0.0], atol=1e-6)


def test_all_modes_by_one_number():
    case = sheet("bars", damping=fd.ModalDamping(0.03))
    ratios = fd.modes(case, 30).damping_ratio.values
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


def test_a_moving_base():
    """The simulated response to a base motion is that of the linear analysis."""
    case = sheet("bars", damping=fd.ModalDamping(0.1))
    f = 0.7 * float(fd.modes(case, 1).frequency[0])
    driven = fd.Case(
        case.structure,
        [*case.supports, fd.BaseMotion("z", fd.Harmonic(f), 1e-5)],
        damping=case.damping,
    )
    motion = fd.simulate(driven, 25 / f, "newmark", dt=1 / (200 * f), every=20)
    t, z = motion.time.values, motion.displacement[:, 8, 2].values
    late = t > 15 / f
    w = 2 * np.pi * f
    basis = np.stack([np.sin(w * t[late]), np.cos(w * t[late])], axis=1)
    sine, cosine = np.linalg.lstsq(basis, z[late], rcond=None)[0] / 1e-5
    exact = complex(fd.frf(case, fd.BaseMotion("z"), [f]).transmissibility[0, 8, 2])
    assert sine + 1j * cosine == pytest.approx(exact, rel=5e-3)
    assert motion.attrs["energy_error"] < 1e-3


def test_free_bodies_keep_their_momenta():
    """Rigid modes are not damped, and what is damped has no momentum."""
    case = sheet("bars")
    case = fd.Case(case.structure, damping=fd.ModalDamping(0.2, 5))
    v = 1e-3 * np.random.default_rng(5).standard_normal(case.structure.nodes.shape)
    motion = fd.simulate(case, 0.5, dt=1e-4, initial=fd.State(0 * v, v), every=0.05)
    momentum = np.einsum("n,tna->ta", case.structure.nodal_mass, motion.velocity.values)
    assert np.abs(momentum - momentum[0]).max() < 1e-9 * np.abs(momentum).max()
    assert float(motion.dissipated[-1]) > 0.0


def test_an_unstable_state_is_refused():
    """About a state of compression modes have no frequency."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=170)
    s = fd.discretize(
        pattern,
        fd.Sheet(1e4, 0.25, 0.01, 1.0),
        fold_law="linear",
        bend_law="linear",
        preset="herkal",
    )
    case = fd.Case(s, [fd.Fix([0, 1])], damping=fd.ModalDamping(0.1, 2, "start"))
    u = np.zeros_like(s.nodes)
    u[2:, 0] = -0.3
    with pytest.raises(fd.errors.InputError, match='the state "start" is unstable'):
        fd.simulate(case, 0.1, initial=fd.State(u))


@pytest.mark.parametrize("method", ["rk4", "generalized_alpha", "auto"])
def test_modes_are_computed_once(method, monkeypatch):
    """The critical step, the choice of a method and the motion take the same modes."""
    seen = []

    def counted(*arguments):
        seen.append(arguments)
        return rows_of(*arguments)

    monkeypatch.setattr(modal_damping, "rows_of", counted)
    case = sheet("bars", damping=fd.ModalDamping(RATIOS, state="start"))
    prepare(case, 0.1, method, every=0.01)
    assert len(seen) == 1
