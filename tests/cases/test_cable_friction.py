"""Cables that rub: the capstan equation, weights over pulleys, energy, derivatives, messages."""

from __future__ import annotations

import math

import numpy as np
import pytest
from attached_cases import FOLD, moved, structure
from test_cables import SHEET, blocks, level, on_rails

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.dynamics.gpu.checks import lacking
from foldyn.dynamics.system import pack
from foldyn.errors import FoldynWarning, InputError
from foldyn.mechanics.pullback import arrays_of_body
from foldyn.mechanics.term import FORCES, ThreadTerms, evaluate

G = 9.81
EA = 1e4  # N
HALF_TURN = [0, (-1, 0, 0), (1, 0, 0), 3]  # over two points, by a right angle at each


def friction_of(case: fd.Case, u: np.ndarray, v: np.ndarray):
    """Forces (m,) of the friction at dofs u and velocities v, and the powers put in and lost."""
    body, parts = case.structure.body, []
    for model in (body.with_terms(case.rubbing_cables), body):
        kept = tuple(term.memory for term in model.others)
        own = ThreadTerms(model, model._parts(1)[0]._replace(kept=kept), [FORCES])
        force = np.zeros((model.rows, 3))
        evaluate(own.terms, model.in_rows(u), model.in_rows(v), force, np.zeros(0))
        parts.append((force.ravel()[: body.size], own.terms.powers.copy()))
    (whole, power), (sheet, _) = parts
    return whole - sheet, power[:2]


LOOSE = [  # on a free body: nodes only
    fd.Cable([0, 2, 1, 4, 3], 300.0, pretension=20.0, friction=0.3, sliding_speed=0.05),
    fd.Cable([3, 0, 2], 200.0, rest_length=1.0, friction=0.7, sliding_speed=0.5),
]


@pytest.fixture(scope="module", params=["bars and hinges", "n5b8e"])
def loose(request):
    """A case, and displacements and velocities of its dofs."""
    s = structure(request.param, FOLD)
    v = moved(s, 0.1, 5)
    v[s.nodes.size :] = 0.0
    return fd.Case(s, LOOSE), moved(s, 0.1), v


def test_friction_has_no_resultant_and_no_moment_and_takes_the_power_that_it_books(loose):
    case, u, v = loose
    force, (put_in, lost) = friction_of(case, u, v)
    nodal = force[: case.structure.nodes.size].reshape(-1, 3)
    x = case.structure.nodes + u[: nodal.size].reshape(-1, 3)
    size = np.abs(force).max()
    assert size > 1.0
    assert np.abs(nodal.sum(axis=0)).max() < 1e-13 * size
    assert np.abs(np.cross(x, nodal).sum(axis=0)).max() < 1e-13 * size
    assert lost == pytest.approx(float(force @ v), rel=1e-12)
    assert put_in == 0.0


def test_friction_never_gives_energy(loose):
    case, u, _ = loose
    for seed in range(20):
        v = moved(case.structure, 0.3, seed)
        assert friction_of(case, u, v)[1][1] > 0.0
        assert friction_of(case, u, 1e-9 * v)[1][1] > 0.0


def test_its_derivative_by_velocity(loose):
    case, u, v = loose
    term, step = case.rubbing_cables, 1e-6
    friction_of(case, u, v)
    found = term.damping(u).toarray()
    pairs = [(v + step * e, v - step * e) for e in np.eye(len(u))]
    rows = [friction_of(case, u, a)[0] - friction_of(case, u, b)[0] for a, b in pairs]
    expected = np.array(rows).T / (2 * step)
    assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()


def test_its_derivative_by_displacement_as_all_slides():
    """Along the stretch that leaves the directions and shares of the pieces as they are."""
    s = structure("bars and hinges", FOLD)
    cable = fd.Cable([0, 2, 1], 300.0, pretension=200.0, friction=0.5, sliding_speed=1e-6)
    case, u, v = fd.Case(s, [cable]), moved(s, 0.1), moved(s, 0.1, 5)
    grown = np.zeros_like(u)
    grown[: s.nodes.size] = s.nodes.ravel() + u[: s.nodes.size]
    friction_of(case, u, v)
    found, step = case.rubbing_cables.tangent(u) @ grown, 1e-6
    pair = (friction_of(case, u + by * grown, v)[0] for by in (step, -step))
    expected = np.subtract(*pair) / (2 * step)
    assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()


def test_where_all_sticks_the_damping_is_largest(loose):
    """The bound for explicit steps is symmetric, and its ends are those of a motion at rest."""
    case, u, v = loose
    term = case.rubbing_cables
    bound = term.nominal(u).damping(u).toarray()
    assert np.abs(bound - bound.T).max() < 1e-13 * np.abs(bound).max()
    friction_of(case, u, 0.0 * v)
    assert term.damping(u).toarray() == pytest.approx(bound, rel=1e-9, abs=1e-9 * bound.max())


def test_a_slack_cable_does_not_rub():
    s = structure("bars and hinges", FOLD)
    with pytest.warns(FoldynWarning, match="slack until its points are farther apart"):
        case = fd.Case(s, [fd.Cable([0, 2, 1], 300.0, rest_length=30.0, friction=0.3)])
    force, powers = friction_of(case, moved(s, 0.1), moved(s, 0.1, 5))
    assert not force.any() and not powers.any()
    assert not case.rubbing_cables.damping(moved(s, 0.1)).toarray().any()


# ------------------------------------------------------------------ the capstan equation
@pytest.mark.parametrize("change", [-0.02, 0.02])
@pytest.mark.parametrize("mu", [0.1, 0.4])
def test_a_winch_pulls_harder_than_the_far_end_by_the_capstan_equation(change, mu):
    """Both ends are held, so that reactions are the tensions; it winds in, and pays out."""
    s = blocks((-1, 0, -1), (1, 0, -1), (5, 0, 0))
    cable = fd.Cable(
        HALF_TURN,
        EA,
        pretension=100.0,
        change=change,
        history=fd.Ramp(1.0),
        friction=mu,
        sliding_speed=1e-4,
    )
    case = fd.Case(s, [on_rails(3), fd.Fix(range(6), "z"), *level(3)[2:], cable])
    motion = fd.simulate(case, 1.0, method="generalized_alpha", dt=0.01)
    along, node = motion.support_axis.values == "z", motion.support_node.values
    far, near = (-motion.reaction.values[1:-1, along & (node == k)][:, 0] for k in (0, 3))
    assert near.min() > 10.0
    turned = mu * math.pi * math.copysign(1.0, -change)
    assert near / far == pytest.approx(np.full(len(far), math.exp(turned)), rel=1e-6)
    lengths = np.array([1.0, 2.0, 1.0])
    tensions = far[:, None] * np.exp(turned * np.array([0.0, 0.5, 1.0]))
    assert tensions @ lengths / 4.0 == pytest.approx(motion.tension.values[1:-1, 0], rel=1e-9)


@pytest.mark.parametrize("mu", [0.0, 0.1, -0.1])
def test_two_weights_over_a_pulley_that_rubs(mu):
    """m1 a = T1 - W1 and m2 a = W2 - T1 exp(mu pi), to either side."""
    s, heavy, light = blocks((-1, 0, -1), (1, 0, -1)), 45.0, 20.0
    mass = float(fd.Case(s).nodal_mass[:3].sum())
    W1, W2 = (light, heavy) if mu >= 0.0 else (heavy, light)
    grip, way = math.exp(mu * math.pi), 1.0 if mu >= 0.0 else -1.0
    a = (W2 - W1 * grip) / (mass * (1.0 + grip))  # of the second weight, downwards
    first = W1 + mass * a
    mean = first * (0.25 + 0.5 * math.sqrt(grip) + 0.25 * grip)
    cable = fd.Cable(HALF_TURN, 1e8, pretension=mean, friction=abs(mu))
    loads = [fd.Force([0], (0, 0, -W1)), fd.Force([3], (0, 0, -W2))]
    case = fd.Case(s, [on_rails(2), *level(2), cable], loads)
    start = np.zeros_like(s.nodes)
    start[:, 2] = 0.2 * way * np.repeat([1.0, -1.0], 3)
    motion = fd.simulate(
        case, 0.03, method="generalized_alpha", dt=1.5e-4, initial=fd.State(velocity=start)
    )
    t, z = motion.time.values, motion.displacement.values[:, 3, 2]
    assert abs(a) > 10.0
    assert -z == pytest.approx(way * 0.2 * t + 0.5 * a * t**2, rel=1e-4, abs=1e-7)


# ------------------------------------------------------------------ motions
def swinging(mu: float, **options) -> fd.Case:
    """Two weights that a load drives back and forth over two points."""
    cable = fd.Cable(HALF_TURN, EA, pretension=30.0, friction=mu, **options)
    loads = [fd.Force([k], (0, 0, -30.0)) for k in (0, 3)]
    drive = fd.Harmonic(5.0, phase=90.0)
    loads += [fd.Force([k], (0, 0, by), drive) for k, by in ((0, 12.0), (3, -12.0))]
    s = blocks((-1, 0, -1), (1, 0, -1))
    return fd.Case(s, [on_rails(2), *level(2), cable], loads)


GIVEN = {name: {"dt": 1e-3} if METHODS[name].implicit else {} for name in METHODS}
GIVEN["dormand_prince"] = {"tolerance": 1e-7}


@pytest.mark.parametrize("method", METHODS)
def test_energy_balances_as_it_slides_back_and_forth(method):
    case = swinging(0.15, sliding_speed=0.02)
    motion = fd.simulate(case, 0.4, method=method, interval=0.01, **GIVEN[method])
    assert motion.attrs["energy_error"] < 1e-4
    lost = motion.dissipated.values
    assert np.diff(lost).min() > 0.0
    assert lost[-1] == pytest.approx(11.645359, rel=1e-2)
    z = motion.displacement.values[:, 3, 2]
    assert np.diff(z).min() < -0.01 and np.diff(z).max() > 0.01  # both ways


@pytest.mark.parametrize("method", METHODS)
def test_a_winch_works_against_friction(method):
    """It lifts a weight at its speed: its work is what is stored and what is lost."""
    s = blocks((0, 0, 0))
    cable = fd.Cable(
        [0, (0, 0, 1), (1, 0, 1), (1, 0, 0)], 300.0, pretension=G, change=-0.3,
        history=fd.Ramp(1.0, smooth=True), friction=0.2, sliding_speed=0.05,
    )  # fmt: skip
    case = fd.Case(s, [on_rails(1), *level(1), cable], [fd.Force([0], (0, 0, -G))])
    motion = fd.simulate(case, 1.0, method=method, interval=0.02, **GIVEN[method])
    assert motion.attrs["energy_error"] < 1e-4
    lost = motion.dissipated.values
    assert np.diff(lost).min() > 0.0
    slid = G * (math.exp(0.2 * math.pi) - 1.0) * 0.3  # at full sliding, the weight unmoved
    assert 0.8 * slid < lost[-1] < 1.05 * slid
    assert lost[-1] == pytest.approx(2.5309121, rel=1e-5)


@pytest.mark.parametrize("method", ["newmark", "energy_momentum"])
def test_an_implicit_motion_goes_on_with_identical_bits(method):
    case, options = swinging(0.15, sliding_speed=0.02), {"method": method, "dt": 2.0**-9}
    whole, first = (fd.simulate(case, end, interval=2.0**-6, **options) for end in (0.25, 0.125))
    start = fd.initial_state(first, at=-1)
    rest = fd.simulate(case, 0.125, start=0.125, initial=start, interval=2.0**-6, **options)
    assert np.array_equal(rest.displacement.values[-1], whole.displacement.values[-1])


def test_without_friction_it_is_the_plain_cable():
    plain, none, hardly = swinging(0.0), swinging(0.0, sliding_speed=1.0), swinging(1e-9)
    assert none.rubbing_cables is None and hardly.rubbing_cables is not None
    assert not none.damped and hardly.damped
    found = [
        fd.simulate(case, 0.1, method="newmark", dt=1e-3).displacement.values
        for case in (plain, none, hardly)
    ]
    assert np.array_equal(found[0], found[1])
    assert found[2] == pytest.approx(found[0], abs=1e-7 * np.abs(found[0]).max())


def test_light_weights_hang_still_by_friction():
    """Below the ratio exp(mu pi) the cable sticks: it creeps at a part of the sliding speed."""
    first, second = 20.0, 40.0
    mean = (first + 2.0 * math.sqrt(first * second) + second) / 4.0
    cable = fd.Cable(HALF_TURN, EA, pretension=mean, friction=0.3, sliding_speed=1e-4)
    loads = [fd.Force([0], (0, 0, -20.0)), fd.Force([3], (0, 0, -40.0))]
    case = fd.Case(blocks((-1, 0, -1), (1, 0, -1)), [on_rails(2), *level(2), cable], loads)
    motion = fd.simulate(case, 1.0, method="generalized_alpha", interval=0.1)
    crept = np.diff(motion.displacement.values[5:, 3, 2])
    assert crept == pytest.approx(-1e-5 * math.atanh(math.log(2.0) / (0.3 * math.pi)), rel=0.02)


# ------------------------------------------------------------------ messages
@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"friction": -0.1}, r"friction = -0.1"),
        ({"friction": 0.1, "sliding_speed": 0.0}, r"sliding_speed = 0"),
        ({"friction": 0.1, "nodes": [0, 1]}, r"friction = 0.1: a cable of two points slides over"),
    ],
)
def test_bad_friction_is_refused(given, text):
    with pytest.raises(InputError, match=text):
        fd.Cable(**{"nodes": [0, 1, 2], "stiffness": EA, **given})


@pytest.mark.parametrize(
    "analysis",
    [
        lambda case: fd.trace(case),
        lambda case: fd.modes(case, 1),
        lambda case: fd.frf(case, fd.Force([0], (0, 0, 1.0)), frequencies=[1.0]),
        lambda case: fd.buckling(case, 1),
        lambda case: fd.periodic_motion(case, frequency=5.0),
        lambda case: fd.backbone(case),
    ],
)
def test_what_has_no_sliding_refuses_friction(analysis):
    with pytest.raises(InputError, match=r"supports\[3\]\.friction = 0.15: friction needs a mot"):
        analysis(swinging(0.15))


def test_gradients_and_graphics_cards_refuse_friction():
    s = structure("bars and hinges", FOLD, SHEET, mass="mixed_voronoi")
    case = fd.Case(s, [fd.Cable([0, 1, 2], EA, friction=0.2)])
    packed = pack(case, 1.0)
    assert lacking(case, packed) == "the term Capstan"
    with pytest.raises(InputError, match="no gradients through friction of cables"):
        arrays_of_body(packed.body)


PULLED = """
pattern = { kind = "miura", cells = [1, 1], a = 0.04, b = 0.04, panel_angle = 60, dihedral = 110 }
sheet = { youngs_modulus = 2e9, poissons_ratio = 0.3, thickness = 3e-4, density = 1200.0 }
model = { preset = "plate" }
supports = [
  { nodes = "xmin" },
  { cable = [7, 4, [0.1, 0.03, 0.05]], cable_stiffness = 0.5, pretension = 1e-3, RUBS },
]
analysis = { kind = "dynamics", duration = 1e-3 }
"""


def test_a_case_file_gives_friction_and_results_keep_it(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text(PULLED.replace("RUBS", "cable_friction = 0.2, cable_sliding_speed = 1e-2"))
    motion = fd.read_case(file).run()
    assert float(motion.dissipated[-1]) > 0.0
    fd.save(motion, tmp_path / "pulled.nc")
    supports = fd.case_of(fd.load(tmp_path / "pulled.nc")).supports
    (cable,) = (part for part in supports if isinstance(part, fd.Cable))
    assert (cable.friction, cable.sliding_speed) == (0.2, 1e-2)
