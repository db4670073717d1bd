"""Dashpots, damped creases and damped strain rates in motions: decay, energy, momenta, steps."""

from __future__ import annotations

import numpy as np
import pytest
from measured import apart, decay, drift, momenta
from moving_sheets import IMPLICIT, SHEET, cell, equal_steps, fold, spinning, steps_of
from oscillators import LENGTH, MASS, about_the_limit, decrement, linear_law, steady
from oscillators import spring as oscillator

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.dynamics.dampers import damping_matrix
from foldyn.dynamics.system import pack
from foldyn.dynamics.turned import turned
from foldyn.errors import FoldynWarning, InputError
from foldyn.structures import ModelOptions
from resisted import resisted

OMEGA, RATIO = 4.0, 0.05  # rad/s
SPRING = oscillator(OMEGA)
C = 2.0 * RATIO * OMEGA * MASS  # N s/m
BETA = 1e-3


def damped(*dashpots: fd.Dashpot) -> fd.Case:
    """One mass on a linear spring along x, with dashpots."""
    return SPRING.altered(supports=[*SPRING.supports, *dashpots])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "case",
    [
        damped(fd.Dashpot(C, nodes=[1])),
        damped(fd.Dashpot(C, nodes=[1], direction="-x")),
        damped(fd.Dashpot(C, between=(0, 1))),
        damped(fd.Dashpot(C, between=(1, 0), direction=(2, 0, 0))),
        damped(fd.Dashpot(4.0 * C, nodes=[1], direction=(1, 0, np.sqrt(3.0)))),
        SPRING.altered(damping=fd.StrainDamping(2.0 * RATIO / OMEGA)),
    ],
    ids=["ground", "along", "axial", "fixed", "oblique", "strain rate"],
)
def test_decay_of_one_mass(case, method):
    """Logarithmic decrement 2 pi z / sqrt(1 - z^2) with z = c / (2 m w) (Thomson, chapter 2)."""
    found, motion = decrement(case, method, OMEGA)
    assert found == pytest.approx(2 * np.pi * RATIO / np.sqrt(1 - RATIO**2), rel=3e-4)
    assert motion.attrs["energy_error"] < 1e-4
    assert float(motion.dissipated[-1]) > 0.9 * float(motion.strain_bars[0])


def pair(c: float) -> fd.Case:
    """Two free masses on a soft spring with a dashpot between them."""
    structure = fd.Structure(
        nodes=np.array([[0.0, 0, 0], [LENGTH, 0, 0]]),
        bars=np.array([[0, 1]]),
        bar_area=np.array([1e-4]),
        sheet=fd.Sheet(2.0 * LENGTH / 1e-4, 0.3, 0.01),
        options=ModelOptions(bar_law=linear_law()),
        node_mass=np.array([MASS, 2 * MASS]),
    )
    return fd.Case(structure, [fd.Dashpot(c, between=(0, 1))])


@pytest.mark.matrix
@pytest.mark.parametrize("method", METHODS)
def test_a_tumbling_pair_keeps_its_momenta(method):
    """The axial dashpot follows the line between the masses: it damps the stretch, not the turn."""
    case, start = pair(0.5), fd.State(velocity=[[0.1, -1.0, 0.3], [0.3, 0.5, -0.2]])
    motion = fd.simulate(
        case, 6.0, method=method, dt=0.002, initial=start, interval=0.1, **equal_steps(method)
    )
    momentum, spin = momenta(case.structure, motion)
    assert drift(momentum) < 1e-12 and drift(spin) < 1e-5
    assert motion.attrs["energy_error"] < 2e-5
    x = case.structure.nodes + motion.displacement.values
    rate = np.gradient(np.linalg.norm(x[:, 1] - x[:, 0], axis=1), 0.1)
    taken = 0.5 * np.trapezoid(rate**2, dx=0.1)
    assert float(motion.dissipated[-1]) > 10 * 1e-3
    assert float(motion.dissipated[-1]) == pytest.approx(taken, rel=0.02)


def test_a_pair_that_only_turns_loses_nothing():
    """Without the spring's stretch: circular motion at its stretched length."""
    case, reduced, stretch = pair(0.5), MASS * 2 * MASS / (3 * MASS), 0.1
    spin = np.sqrt(2.0 * stretch / (reduced * (LENGTH + stretch)))  # k e = mu w^2 l
    arm = (LENGTH + stretch) * np.array([-2 / 3, 1 / 3])
    start = fd.State([[0, 0, 0], [stretch, 0, 0]], spin * np.outer(arm, [0.0, 1.0, 0.0]))
    motion = fd.simulate(case, 20.0, method="rk4", dt=0.02, initial=start, interval=0.5)
    assert float(motion.dissipated[-1]) < 1e-9 * float(motion.kinetic[0])


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["rk4", "newmark", "energy_momentum"])
@pytest.mark.parametrize("ground", [True, False])
def test_a_moving_base(ground, method):
    """A dashpot to the ground drags at the moving mass; one to the base damps its relative motion.

    Steady motion: x / y = (k + i w c') / (k - w^2 m + i w c), c' = 0 or c (Thomson, section 3.5).
    """
    case = damped(fd.Dashpot(C, nodes=[1]) if ground else fd.Dashpot(C, between=(0, 1)))
    w, k = 3.0, MASS * OMEGA**2
    shaken = fd.BaseMotion("x", fd.Harmonic(w / (2 * np.pi)), 1e-3)
    driven = case.altered(supports=[*case.supports, shaken])
    motion = fd.simulate(driven, 60.0, method=method, dt=0.01, interval=0.05)
    exact = (k + (0 if ground else 1j * w * C)) / (k - w**2 * MASS + 1j * w * C)
    found = steady(motion, 1, 0, w / (2 * np.pi), after=45.0) / 1e-3
    assert found == pytest.approx(exact, rel=2e-3)
    assert motion.attrs["energy_error"] < 1e-4
    response = fd.frf(case, fd.BaseMotion("x"), frequencies=[w / (2 * np.pi)])
    assert complex(response.transmissibility[0, 1, 0]) == pytest.approx(exact, rel=1e-9)


@pytest.mark.filterwarnings("ignore:the energy balance", "ignore:the dashpots make")
@pytest.mark.parametrize("method", ["rk4", "central_difference"])
@pytest.mark.parametrize("ratio", [0.5, 3.0, 30.0])
def test_motion_just_below_and_above_the_limit(ratio, method):
    """The step that a strong dashpot allows is stable, and one a little longer is not."""
    case = damped(fd.Dashpot(2.0 * ratio * OMEGA * MASS, nodes=[1]))
    assert fd.critical_step(case, method) < fd.critical_step(SPRING, method)
    below, above = about_the_limit(case, method, 1.05)
    assert below <= 0.6
    if ratio > 1.0:  # else the bound of the damping at lower frequencies counts
        assert above > 10.0 * below


@pytest.mark.filterwarnings("ignore:the energy balance")  # of vibrations that no step resolves
@pytest.mark.parametrize("method", ["rk4", "central_difference"])
def test_a_sheet_with_strong_dampers_stays_stable(method):
    """The bound for damping that no mode is proportional to holds for a whole structure."""
    s = cell(dihedral=120, preset="plate", bend_law="linear", fold_law="linear")
    dashpots = [fd.Dashpot(5.0, nodes=[8]), fd.Dashpot(2.0, between=[(1, 7), (3, 5)])]
    plain = fd.Case(s, [fd.Fix("xmin")])
    case = plain.altered(supports=[*plain.supports, *dashpots], damping=fd.CreaseDamping(1e-3))
    step = fd.critical_step(case, method)
    assert step < fd.critical_step(plain, method)
    v = 1e-3 * np.random.default_rng(1).standard_normal(s.nodes.shape) * ~case.fixed
    start = fd.State(velocity=v)
    motion = fd.simulate(case, 3000 * step, method=method, dt=step, initial=start, every_steps=50)
    kinetic = motion.kinetic.values
    assert kinetic[-1] < 0.1 * kinetic[0] and kinetic.max() <= kinetic[0] * (1 + 1e-9)


def test_dashpots_that_cost_many_steps_are_told():
    case = damped(fd.Dashpot(2000.0 * C, nodes=[1]))
    with pytest.warns(FoldynWarning, match="the dashpots make the critical step .* times"):
        fd.simulate(case, 0.01, method="rk4")


# ------------------------------------------------------------------ creases
K, CREASE = 0.05, 2e-3  # N m/rad and N m s/rad per m of crease


def flap(model: str, modulus: float = 1e6, dihedral: float = 120.0, **more) -> fd.Case:
    """A simple fold, one panel held; the other one turns about the crease."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=dihedral)
    sheet = fd.Sheet(modulus, 0.25, 0.01, 1.0)
    laws = {"fold_law": "linear", "crease_stiffness": K}
    if model == "bars":
        s = fd.discretize(pattern, sheet, bend_law="linear", **laws, preset="herkal")
        held = np.setdiff1d(np.arange(len(s.nodes)), (4, 5, 7))
    else:
        s = fd.shell(pattern, sheet, divisions=3, **laws)
        held = np.flatnonzero(s.nodes[:, 0] <= s.nodes[2, 0] + 1e-9)
    return fd.Case(s, [fd.Fix(held.tolist())], **{"damping": fd.CreaseDamping(CREASE)} | more)


@pytest.mark.parametrize("model", ["bars", "shell"])
def test_ratio_and_frequency_of_the_folding_mode(model):
    """Of stiff panels z = c w / (2 k): c L theta' against k L theta, whatever the inertia."""
    errors = []
    for modulus in (1e8, 1e10):
        mode = fd.modes(case := flap(model, modulus), 1)
        omega = 2 * np.pi * float(mode.frequency[0])
        errors.append(abs(float(mode.damping_ratio[0]) / (CREASE * omega / (2 * K)) - 1.0))
    assert errors[0] < 3e-3 and errors[1] < 3e-5  # as 1 / modulus
    if model == "bars":  # the inertia of the panel's nodes about the crease
        arm = (case.structure.nodes[[4, 5, 7]] - case.structure.nodes[2])[:, [0, 2]]
        inertia = (case.structure.nodal_mass[[4, 5, 7]] * (arm**2).sum(axis=1)).sum()
        assert omega == pytest.approx(np.sqrt(K / inertia), rel=1e-5)


@pytest.mark.parametrize(
    ("model", "method"),
    [*(("bars", method) for method in METHODS), *(("shell", method) for method in IMPLICIT)],
)
def test_decay_of_the_folding_mode(model, method):
    """The rotations of a shell at the crease, without mass, take part in its angle."""
    ratio, error = decay(flap(model), method)
    assert ratio == pytest.approx(float(fd.modes(flap(model), 1).damping_ratio[0]), rel=1e-3)
    assert error < 1e-3


@pytest.mark.parametrize("method", METHODS)
def test_a_folded_sheet_that_spins_loses_nothing(method):
    """Rigid rotation of a free fold."""
    s = fold(100, fd.Sheet(1e7, 0.25, 0.01, 1.0), fold_law="linear")
    case, start = fd.Case(s, damping=fd.CreaseDamping(1.0)), spinning(s, [0.0, 0.3, 0.0])
    motion = fd.simulate(
        case, 1.0, method=method, initial=start, interval=0.1, **steps_of(method, 1e-3)
    )
    # what the centrifugal forces stretch and fold is of the order of the spin to the fourth power
    assert float(motion.dissipated[-1]) < 1e-4 * float(motion.kinetic[0])


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("model", "method", "modulus"),
    [*(("bars", method, 1e7) for method in METHODS), ("shell", "newmark", 1e9)],
)
def test_a_large_folding(model, method, modulus):
    """From 170 to 60 degrees: dissipation is the integral of c L theta'^2, energies balance.

    The dihedral is taken from the samples; of a shell of stiff panels it is that of the nodes
    beside the crease.
    """
    go = fd.Actuate("all", 300.0, fd.Ramp(1.5, smooth=True))
    case = flap(model, modulus, 170.0, damping=fd.CreaseDamping(0.02)).altered(loads=[go])
    motion = fd.simulate(case, 3.0, method=method, interval=0.01, **steps_of(method, 0.005))
    hinge = case.structure.folds[0]
    x = (case.structure.nodes + motion.displacement.values)[:, hinge]
    one, two = (np.cross(x[:, 1] - x[:, 0], x[:, k] - x[:, 0]) for k in (2, 3))
    cosine = (one * two).sum(axis=1) / np.linalg.norm(one, axis=1) / np.linalg.norm(two, axis=1)
    angle = np.arccos(cosine)
    assert np.degrees(abs(angle[-1] - angle[0])) > 100.0
    taken = 0.02 * np.trapezoid(np.gradient(angle, 0.01, edge_order=2) ** 2, dx=0.01)
    assert float(motion.dissipated[-1]) == pytest.approx(taken, rel=3e-4)
    assert motion.attrs["energy_error"] < 1e-4


# ------------------------------------------------------------------ strain rates
def ratios(s, held, count=12) -> list[np.ndarray]:
    """Damping ratios of modes with beta and with strain rates damped."""
    dampings = (fd.Rayleigh(beta=BETA), fd.StrainDamping(BETA))
    cases = [fd.Case(s, held, damping=damping) for damping in dampings]
    return [fd.modes(case, count).damping_ratio.values for case in cases]


CLAMPED = {"preset": "herkal", "bend_law": "linear", "clamped": [(0, 1), (1, 2)]}


@pytest.mark.parametrize(
    ("options", "held"),
    [
        *(
            (options, [fd.Fix("xmin", "xz"), fd.Fix([1], "y")])
            for options in (
                {"preset": "plate"},
                {"preset": "plate", "membrane": "bars"},
                {"preset": "herkal", "bend_law": "linear"},
                {"preset": "plate", "fold_law": "enhanced"},
            )
        ),
        (CLAMPED, [fd.Fix([0, 1, 2])]),
        (CLAMPED, [fd.Fix([3, 4, 6])]),
    ],
    ids=["plate", "single bars", "herkal", "locking folds", "clamped, held", "clamped, free"],
)
def test_about_rest_it_is_beta_times_the_stiffness(options, held):
    s = cell(**options)
    np.testing.assert_allclose(*ratios(s, held), rtol=1e-9)
    beta, strain = ratios(s, [*held, fd.Spring(2.0, nodes=[7])])
    assert (strain < beta).any()  # springs are not part of it


def test_panels_of_several_kinds_are_damped_anywhere():
    """A triangle, a quad and a pentagon, moved far: the forces are those of the matrix."""
    vertices = [
        (0, 0, 0), (1, 0, 0), (1.2, 0.8, 0), (0.5, 1.3, 0), (-0.2, 0.8, 0), (0.5, -0.8, 0.4),
        (1.9, 0, 0.5), (2.1, 0.8, 0.5),
    ]  # fmt: skip
    pattern = fd.Pattern(vertices, [(0, 1, 2, 3, 4), (1, 0, 5), (2, 1, 6, 7)])
    case = fd.Case(fd.discretize(pattern, SHEET, preset="plate"), damping=fd.StrainDamping(BETA))
    rng, body = np.random.default_rng(4), case.elastic_body
    u, v = 0.1 * rng.standard_normal((2, *case.structure.nodes.shape))
    force, power = resisted(case, u, v)
    np.testing.assert_allclose(force.ravel(), damping_matrix(case, body.dofs(u)) @ v.ravel())
    assert power == pytest.approx(float(np.vdot(force, v)), rel=1e-12)
    assert power > 0.0
    still = np.zeros(body.size)
    rest = damping_matrix(case, still).toarray()
    assert apart(rest, BETA * body.tangent(still).toarray()) < 1e-9


def test_a_response_is_that_of_beta():
    s, force = cell(preset="plate"), fd.Force([7], (0.01, 0.0, 0.0))
    found = [
        fd.frf(
            fd.Case(s, [fd.Fix("xmin")], damping=damping),
            force,
            frequencies=np.arange(0.5, 6.0, 0.5),
        )
        for damping in (fd.Rayleigh(beta=BETA), fd.StrainDamping(BETA))
    ]
    np.testing.assert_allclose(found[0].receptance, found[1].receptance, rtol=1e-8)


def spun(damping, method: str = "newmark", duration: float = 1.0, dt: float | None = 5e-3):
    """A free folded sheet that spins at 3 rad/s."""
    case = fd.Case(cell(preset="plate"), damping=damping)
    start, interval = spinning(case.structure, [0.0, 0.0, 3.0]), duration / 50
    return fd.simulate(case, duration, method=method, initial=start, interval=interval, dt=dt)


@pytest.mark.parametrize(
    ("method", "beta", "dt"),
    [("rk4", 1e-6, None), ("newmark", 1e-4, 5e-3), ("energy_momentum", 1e-4, 5e-3)],
)
def test_turning_takes_nothing(method, beta, dt):
    """Half a turn; what is lost is what the centrifugal forces stretch and fold at first."""
    motion = spun(fd.StrainDamping(beta), method, dt=dt)
    assert float(motion.dissipated[-1]) < 0.02 * float(motion.kinetic[0])
    assert motion.attrs["energy_error"] < 0.01


def test_beta_takes_a_turn_away_and_says_so():
    with pytest.warns(FoldynWarning, match=r"damping: beta resists .* use fd.StrainDamping"):
        motion = spun(fd.Rayleigh(beta=1e-4))
    assert float(motion.kinetic[-1]) < 0.01 * float(motion.kinetic[0])
    with pytest.warns(FoldynWarning, match="damping: modal damping resists rotations"):
        spun(fd.ModalDamping(0.02))
    spun(fd.Rayleigh(beta=1e-4), duration=1e-3, dt=2e-5)  # it hardly turns


def test_what_turning_costs_is_estimated_right():
    """Against the energy that is lost, where that is a small part."""
    with pytest.warns(FoldynWarning, match="resists rotations: panels turn by up to 1[67]"):
        motion = spun(fd.Rayleigh(beta=1e-8))
    case, moved = fd.case_of(motion), (motion.displacement.values, motion.velocity.values)
    told = turned(case, pack(case, 1e-3), np.zeros_like(case.structure.nodes), *moved)
    lost = float(motion.dissipated[-1])
    assert lost > 0.01 * float(motion.kinetic[0])
    assert told[1] == pytest.approx(lost, rel=0.2)


def test_models_whose_panels_bend_as_plates_refuse_it():
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=120)
    for s in (fd.shell(pattern, SHEET, divisions=2), fd.discretize(pattern, SHEET, preset="n5b8e")):
        with pytest.raises(InputError, match="damping: StrainDamping takes bars and hinges"):
            fd.Case(s, damping=fd.StrainDamping(BETA))


@pytest.mark.filterwarnings("ignore:damping. beta resists rotations")
@pytest.mark.parametrize("method", ["newmark", "generalized_alpha"])
def test_steps_know_that_dofs_without_mass_have_the_mean_velocity(method):
    """With the velocity at the end in the matrix, each iteration made a new one: 350 and more."""
    s = fd.shell(
        fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60),
        fd.Sheet(1e5, 0.25, 0.01, 1.0),
        divisions=1,
    )
    push = fd.Force([0, 1], (1e-3, 0, 0), history=fd.Harmonic(0.4))
    case = fd.Case(s, [fd.Fix([4, 5]), fd.Fix([0, 1], "yz")], [push], fd.Rayleigh(0.2, 0.05))
    run = fd.simulate(case, 2.5, method=method, dt=0.05, interval=2.5)
    assert run.attrs["factorizations"] < 40
