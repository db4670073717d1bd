"""Damping of strain rates: beta K0 in small motions, nothing in turns; and what beta does there."""

from __future__ import annotations

import numpy as np
import pytest
from oscillators import MASS, equal_steps, linear_law, oscillator, released

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.dynamics.dampers import damping_matrix
from foldyn.dynamics.system import pack
from foldyn.dynamics.turned import turned
from foldyn.errors import FoldynWarning, InputError
from foldyn.signals import log_decrement
from resisted import resisted

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
BETA = 1e-3


def miura(**options) -> fd.Structure:
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    return fd.discretize(pattern, SHEET, **options)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"membrane": "bars"},
        {"preset": "herkal", "bend_law": "linear"},
        {"fold_law": "enhanced"},
    ],
    ids=["plate", "single bars", "herkal", "locking folds"],
)
def test_about_rest_it_is_beta_times_the_stiffness(options):
    supports = [fd.Fix("xmin", "xz"), fd.Fix([1], "y"), fd.Spring(2.0, nodes=[7])]
    s = miura(**options)
    ratios = [
        fd.modes(fd.Case(s, supports[:n], damping=damping), 12).damping_ratio.values
        for damping in (fd.Rayleigh(beta=BETA), fd.StrainDamping(BETA))
        for n in (2, 3)
    ]
    np.testing.assert_allclose(ratios[0], ratios[2], rtol=1e-9)
    assert (ratios[3] < ratios[1]).any()  # springs are not part of it


def test_panels_of_several_kinds_are_damped_anywhere():
    """A triangle, a quad and a pentagon, moved far: the forces are those of the matrix."""
    vertices = [
        (0, 0, 0), (1, 0, 0), (1.2, 0.8, 0), (0.5, 1.3, 0), (-0.2, 0.8, 0), (0.5, -0.8, 0.4),
        (1.9, 0, 0.5), (2.1, 0.8, 0.5),
    ]  # fmt: skip
    pattern = fd.Pattern(vertices, [(0, 1, 2, 3, 4), (1, 0, 5), (2, 1, 6, 7)])
    case = fd.Case(fd.discretize(pattern, SHEET), damping=fd.StrainDamping(BETA))
    rng, body = np.random.default_rng(4), case.elastic_body
    u, v = 0.1 * rng.standard_normal((2, *case.structure.nodes.shape))
    force, power = resisted(case, u, v)
    matrix = damping_matrix(case, body.dofs(u))
    np.testing.assert_allclose(force.ravel(), matrix @ v.ravel(), rtol=1e-9)
    assert power == pytest.approx(float(np.vdot(force, v)), rel=1e-12)
    assert power > 0.0
    rest = damping_matrix(case, np.zeros(body.size)).toarray()
    np.testing.assert_allclose(
        rest, BETA * body.tangent(np.zeros(body.size)).toarray(), atol=1e-9 * np.abs(rest).max()
    )


@pytest.mark.parametrize("nodes", [[0, 1, 2], [3, 4, 6]], ids=["held", "free"])
def test_clamped_edges_are_damped(nodes):
    s = miura(preset="herkal", bend_law="linear", clamped=[(0, 1), (1, 2)])
    held = [fd.Fix(nodes)]
    beta, strain = (
        fd.modes(fd.Case(s, held, damping=damping), 8).damping_ratio.values
        for damping in (fd.Rayleigh(beta=BETA), fd.StrainDamping(BETA))
    )
    np.testing.assert_allclose(beta, strain, rtol=1e-9)


def test_a_response_is_that_of_beta():
    s, force = miura(), fd.Force([7], (0.01, 0.0, 0.0))
    found = [
        fd.frf(fd.Case(s, [fd.Fix("xmin")], damping=damping), force, np.arange(0.5, 6.0, 0.5))
        for damping in (fd.Rayleigh(beta=BETA), fd.StrainDamping(BETA))
    ]
    np.testing.assert_allclose(found[0].receptance, found[1].receptance, rtol=1e-8)


@pytest.mark.parametrize("method", METHODS)
def test_decay_of_one_bar(method):
    """Logarithmic decrement 2 pi z / sqrt(1 - z^2), z = beta w / 2."""
    omega, ratio = 4.0, 0.05
    case = oscillator(linear_law(), MASS * omega**2)
    case = case.altered(damping=fd.StrainDamping(2.0 * ratio / omega))
    period = 2.0 * np.pi / omega
    radius = {"spectral_radius": 1.0} if method == "generalized_alpha" else {}
    motion = fd.simulate(
        case, 6 * period, method, initial=released(1e-3), every=period / 40, dt=period / 400,
        **equal_steps(method), **radius,
    )  # fmt: skip
    found = log_decrement(motion.displacement[:, 1, 0].values, period / 40, rest=0.0)
    assert found.decrement == pytest.approx(2 * np.pi * ratio / np.sqrt(1 - ratio**2), rel=3e-4)
    assert motion.attrs["energy_error"] < 1e-4
    assert float(motion.dissipated[-1]) > 0.9 * float(motion.strain_bars[0])


def spun(damping, method: str, duration: float, **numeric):
    """A free folded sheet that spins at 3 rad/s."""
    case = fd.Case(miura(), damping=damping)
    v = np.cross([0.0, 0.0, 3.0], case.structure.nodes - case.structure.center_of_mass)
    return fd.simulate(
        case, duration, method, initial=fd.State(velocity=v), every=duration / 50, **numeric
    )


@pytest.mark.parametrize("method", ["rk4", "newmark", "energy_momentum"])
def test_turning_takes_nothing(method):
    """Half a turn; what is lost is what the centrifugal forces stretch and fold at first."""
    beta = 1e-6 if method == "rk4" else 1e-4
    numeric = {} if method == "rk4" else {"dt": 5e-3}
    motion = spun(fd.StrainDamping(beta), method, 1.0, **numeric)
    assert float(motion.dissipated[-1]) < 0.02 * float(motion.kinetic[0])
    assert motion.attrs["energy_error"] < 0.01


def test_beta_takes_a_turn_away_and_says_so():
    with pytest.warns(FoldynWarning, match=r"damping: beta resists .* use fd.StrainDamping"):
        motion = spun(fd.Rayleigh(beta=1e-4), "newmark", 1.0, dt=5e-3)
    assert float(motion.kinetic[-1]) < 0.01 * float(motion.kinetic[0])
    with pytest.warns(FoldynWarning, match="damping: modal damping resists rotations"):
        spun(fd.ModalDamping(0.02), "newmark", 1.0, dt=5e-3)
    spun(fd.Rayleigh(beta=1e-4), "newmark", 1e-3, dt=2e-5)  # it hardly turns


def test_what_turning_costs_is_estimated_right():
    """Against the energy that is lost, where that is a small part."""
    with pytest.warns(FoldynWarning, match="resists rotations: panels turn by up to 1[67]"):
        motion = spun(fd.Rayleigh(beta=1e-8), "newmark", 1.0, dt=5e-3)
    case = fd.case_of(motion)
    told = turned(
        case, pack(case, 1e-3), np.zeros_like(case.structure.nodes), motion.displacement.values,
        motion.velocity.values,
    )  # fmt: skip
    lost = float(motion.dissipated[-1])
    assert lost > 0.01 * float(motion.kinetic[0])
    assert told[1] == pytest.approx(lost, rel=0.2)


def test_models_whose_panels_bend_as_plates_refuse_it():
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=120)
    for s in (fd.shell(pattern, SHEET, 2), fd.discretize(pattern, SHEET, preset="n5b8e")):
        with pytest.raises(InputError, match="damping: StrainDamping takes bars and hinges"):
            fd.Case(s, damping=fd.StrainDamping(BETA))
