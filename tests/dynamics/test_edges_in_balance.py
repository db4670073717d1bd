"""n5b8e by explicit methods: edge angles in balance with what acts on them."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import foldyn as fd
from foldyn.dynamics.driver import prepare
from foldyn.errors import FoldynWarning
from pairwise import in_pairs

SHEET = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.25, thickness=0.01, density=1.0)
PATTERN = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=120)
K = 0.2  # N m/rad
CURVED, SMOOTH = fd.EnhancedLinear(115, 122), fd.Ramp(0.4, smooth=True)
EXPLICIT = ("rk4", "central_difference", "dormand_prince")
pytestmark = pytest.mark.filterwarnings("ignore::foldyn.errors.StretchWarning")


def moment(history=None):
    return fd.CreaseMoment("all", 0.02, history=history)


def heat(history=None):
    return fd.Temperature(1.0, expansion=1e-5, curvature=2e-2, history=history)


def case(loads, law="linear", k=K, held=(0, 1, 2, 3), alpha=2.0):
    structure = fd.discretize(PATTERN, SHEET, preset="n5b8e", crease_stiffness=k, fold_law=law)
    return fd.Case(structure, [fd.Fix(list(held), "xyz")], loads, fd.Rayleigh(alpha))


def balance(result):
    """Largest error of the energy balance, over the largest work."""
    strain = sum(result[name] for name in result.data_vars if name.startswith("strain_"))
    left = strain + result.kinetic + result.dissipated - result.work
    return float(abs(left - left[0]).max() / abs(result.work).max())


def apart(one, other):
    """Largest difference of displacements, and of energies, over the largest of both."""
    names = [name for name in one.data_vars if name.startswith("strain_")]
    energies = [np.array([run[name].values for name in (*names, "work")]) for run in (one, other)]
    pairs = (one.displacement.values, other.displacement.values), energies
    return max(float(np.abs(a - b).max() / np.abs(b).max()) for a, b in pairs)


@pytest.mark.parametrize("law", ["linear", CURVED])
@pytest.mark.parametrize("load", [moment, heat])
def test_a_damped_motion_ends_where_statics_ends(load, law):
    made = case([load(fd.Ramp(0.1))], law, alpha=8.0)
    end = fd.simulate(made, 8.0, "rk4", every=8.0).displacement.values[-1]
    path = fd.trace(case([load()], law), load_factors=[0.0, 1.0]).displacement.values[-1]
    np.testing.assert_allclose(end, path, atol=1e-6 * np.abs(path).max())


@pytest.mark.parametrize("k", [0.02, 0.2, 4.0])
def test_a_moment_opens_a_crease_by_its_own_stiffness(k):
    """Where it has opened by M / k, nothing moves."""
    made = case([fd.CreaseMoment("all", np.radians(2.0) * k)], k=k, held=[0, 1, 2])
    there = fd.trace(made, steps=1).displacement.values[-1]
    turn = np.degrees(made.structure.dihedrals(there)[0] - made.structure.fold_rest)
    assert turn == pytest.approx(2.0, rel=5e-3)
    with pytest.warns(FoldynWarning, match="below the rounding errors"):
        motion = fd.simulate(made, 0.05, "rk4", initial=fd.State(displacement=there))
    np.testing.assert_allclose(motion.displacement[-1], there, atol=1e-7 * np.abs(there).max())


@pytest.mark.parametrize(
    ("loads", "law", "method"),
    in_pairs([[moment()], [heat(SMOOTH), moment(SMOOTH)]], ["linear", CURVED], EXPLICIT),
)
def test_motions_are_those_with_edge_angles_as_dofs(method, law, loads):
    """By generalized_alpha, whose error of order 2 is all that is left; energies too."""
    made = case(loads, law)
    close = {"tolerance": 1e-8} if method == "dormand_prince" else {}
    found = fd.simulate(made, 0.3, method, every=0.05, **close)
    steps = (2e-4, 1e-4)
    others = [fd.simulate(made, 0.3, "generalized_alpha", dt=dt, every=0.05) for dt in steps]
    errors = [apart(other, found) for other in others]
    assert errors[1] < (2e-5 if method == "central_difference" else 2e-6)
    assert method == "central_difference" or errors[0] / errors[1] > 3.0
    assert balance(found) < (2e-5 if method == "central_difference" else 1e-6)


def test_runge_kutta_keeps_its_order():
    """In displacements; and in the balance, where forces are constant."""
    steps = (2e-4, 1e-4, 2.5e-5)
    made = case([moment(fd.HalfSine(0.4))])
    runs = [fd.simulate(made, 0.2, "rk4", dt=dt, every=0.05) for dt in steps]
    errors = [np.abs(run.displacement - runs[-1].displacement).values.max() for run in runs]
    assert np.log2(errors[0] / errors[1]) > 3.8
    errors = [balance(fd.simulate(case([moment()]), 0.2, "rk4", dt=dt)) for dt in steps]
    assert np.log2(errors[0] / errors[1]) > 3.7


def test_work_of_forces_that_jump():
    """Edge angles jump with them, and take the mean of both forces along."""
    made = case([moment(fd.Pulse(0.2))])
    found = fd.simulate(made, 0.4, "dormand_prince", every=0.1, tolerance=1e-8)
    other = fd.simulate(made, 0.4, "generalized_alpha", dt=1e-4, every=0.1)
    assert balance(found) < 1e-8
    assert apart(other, found) < 1e-5


SMALL = fd.Rayleigh(0.1)
REMEMBERING = {
    "prony": (fd.Prony(0.5, 0.1, law="linear"), [SMALL]),
    "plastic": (fd.Plastic(5e-3, 0.02, law="linear"), [SMALL]),
    "eyring": (fd.Eyring(1e-2, 1e-1, law="linear"), [SMALL]),
}
DAMPED = {
    "weak": ("linear", [fd.CreaseDamping(1e-4)]),
    "strong": ("linear", [fd.CreaseDamping(5.0)]),
    "nonlinear": (CURVED, [fd.CreaseDamping(0.05)]),
    "prony": (fd.Prony(0.5, 0.1, law="linear"), [fd.CreaseDamping(0.05)]),
    "eyring": (fd.Eyring(1e-2, 1e-1, law="linear"), [fd.CreaseDamping(0.05)]),
}


@pytest.mark.parametrize("method", EXPLICIT)
@pytest.mark.parametrize("kind", REMEMBERING)
def test_creases_with_memory_move_as_with_edge_angles_as_dofs(method, kind):
    law, damping = REMEMBERING[kind]
    made = case([moment(SMOOTH), heat(SMOOTH)], law).altered(damping=damping)
    found = fd.simulate(made, 0.3, method, every=0.05)
    other = fd.simulate(made, 0.3, "generalized_alpha", dt=1e-4, every=0.05)
    assert apart(other, found) < 5e-6
    np.testing.assert_allclose(found.dissipated, other.dissipated, atol=1e-5 * other.dissipated[-1])
    assert balance(found) < 1e-6


@pytest.mark.parametrize(
    ("kind", "method"),
    [
        *(("weak", method) for method in EXPLICIT),
        *((kind, "rk4") for kind in ("nonlinear", "prony", "eyring")),
        *(
            pytest.param(kind, method, marks=pytest.mark.matrix)
            for kind, method in product(DAMPED, EXPLICIT)
            if kind == "strong" or (kind != "weak" and method != "rk4")
        ),
    ],
)
def test_damped_creases_move_as_with_edge_angles_as_dofs(method, kind):
    """generalized_alpha is of order 1 where dofs without mass are damped: it is extrapolated."""
    law, damping = DAMPED[kind]
    made = case([moment(SMOOTH), heat(SMOOTH)], law).altered(damping=damping)
    found = fd.simulate(made, 0.3, method, every=0.05)
    one, other = (
        fd.simulate(made, 0.3, "generalized_alpha", dt=dt, every=0.05) for dt in (1e-4, 5e-5)
    )
    for name in ("displacement", "dissipated", "work"):
        wanted = 2.0 * other[name].values - one[name].values
        np.testing.assert_allclose(found[name], wanted, atol=2e-5 * np.abs(wanted).max())
    assert balance(found) < 5e-6


@pytest.mark.parametrize("damping", [1e-4, 0.05, 5.0])
def test_damped_creases_are_of_order_two(damping):
    """As with all memory, by whatever method; the balance too."""
    made = case([moment(SMOOTH)]).altered(damping=fd.CreaseDamping(damping))
    runs = [fd.simulate(made, 0.2, "rk4", dt=dt, every=0.05) for dt in (4e-4, 2e-4, 2.5e-5)]
    errors = [apart(run, runs[-1]) for run in runs[:-1]]
    assert np.log2(errors[0] / errors[1]) > 1.7
    assert balance(runs[1]) < 1e-6


@pytest.mark.parametrize("kind", ["strong", "eyring"])
@pytest.mark.parametrize("method", EXPLICIT)
def test_a_state_holds_what_damped_creases_remember(method, kind):
    law, damping = DAMPED[kind]
    made = case([moment(SMOOTH)], law).altered(damping=damping)
    whole = fd.simulate(made, 0.2, method, every=0.1)
    first = fd.simulate(made, 0.1, method, every=0.1)
    rest = fd.simulate(made, 0.1, method, every=0.1, initial=fd.initial_state(first), start=0.1)
    end = whole.displacement.values[-1]
    assert balance(rest) < 1e-5
    np.testing.assert_allclose(rest.displacement[-1], end, atol=1e-6 * np.abs(end).max())


@pytest.mark.matrix
def test_dampers_take_what_jumps():
    """The moment of a damped crease that jumps turns it at a finite rate."""
    made = case([moment(fd.Pulse(0.1))]).altered(damping=fd.CreaseDamping(0.5))
    found = fd.simulate(made, 0.2, "dormand_prince", every=0.05)
    one, other = (
        fd.simulate(made, 0.2, "generalized_alpha", dt=dt, every=0.05) for dt in (1e-4, 5e-5)
    )
    wanted = 2.0 * other.displacement.values - one.displacement.values
    np.testing.assert_allclose(found.displacement, wanted, atol=1e-4 * np.abs(wanted).max())
    assert balance(found) < 1e-3


JUMPS = (
    fd.CreaseMoment([0, 1], 0.02, fd.Pulse(0.1)),
    fd.Temperature(1.0, curvature=2e-2, history=fd.Pulse(0.1)),
)


@pytest.mark.parametrize("jump", JUMPS)
@pytest.mark.parametrize(
    "method", [pytest.param("generalized_alpha", marks=pytest.mark.matrix), "energy_momentum"]
)
def test_edge_angles_jump_beside_damped_creases(method, jump):
    """But for the turn of these; if they did not, they would ring from step to step."""
    sheet = fd.discretize(fd.patterns.miura(), SHEET, preset="n5b8e", crease_stiffness=K)
    held = fd.Fix(list(sheet.pattern.faces[0]))
    made = fd.Case(sheet, [held], [jump], damping=fd.CreaseDamping(0.5, [2, 3]))
    found = fd.simulate(made, 0.2, method, dt=2e-4, every=0.05)
    other = fd.simulate(made, 0.2, "dormand_prince", every=0.05, tolerance=1e-7)
    assert apart(other, found) < {"energy_momentum": 1e-3}.get(method, 1e-2)
    assert balance(found) < 1e-3


def test_edge_angles_without_a_balance_find_the_next_one():
    """As in a step that is tried again. What yields, whose slope jumps, has one nearly always."""
    law = fd.Plastic(5e-3)
    pattern = fd.patterns.miura()
    stiff = fd.discretize(pattern, SHEET, preset="n5b8e", crease_stiffness=10.0, fold_law=law)
    made = fd.Case(stiff, [fd.Fix(list(pattern.faces[0]))], [fd.CreaseMoment("all", 0.02)])
    body, other = (prepare(made, 0.1, "rk4").packed.body for _ in range(2))
    rng, none = np.random.default_rng(0), 0
    wild = np.where(made.fixed, 0.0, rng.normal(size=(400, *made.fixed.shape)))
    for q in wild * 10.0 ** rng.uniform(-3.0, -0.5, (400, 1, 1)):
        none += bool(np.isnan(body.internal(q.ravel())).any())
    assert none < 20
    assert np.isnan(body.internal(np.full(made.fixed.size, np.nan))).any()
    small = 1e-3 * wild[0].ravel()
    np.testing.assert_allclose(body.internal(small), other.internal(small), atol=1e-9)


def test_edges_without_balance_are_told_of():
    """Creases 10,000 times as stiff as panels that yield: Newton's iteration zigzags."""
    pattern = fd.patterns.miura(cells=(1, 1), b=1.1, panel_angle=65, dihedral=100)
    law = fd.Plastic(yield_moment=1.0, isotropic=0.5)
    sheet = fd.Sheet(1e6, 0.3, 0.03, 1000.0)
    s = fd.discretize(pattern, sheet, preset="n5b8e", crease_stiffness=2e4, fold_law=law)
    pushed = fd.CreaseMoment(creases=[1], moment=2.0, history=fd.HalfSine(0.2))
    case = fd.Case(s, [fd.Fix([0, 1, 2])], [pushed])
    with pytest.raises(fd.errors.InstabilityError, match=r'no balance.*take method = "newmark"'):
        fd.simulate(case, 0.3, "rk4", every=0.02)
    assert fd.simulate(case, 0.3, "newmark", every=0.02).dissipated[-1] > 0.0
