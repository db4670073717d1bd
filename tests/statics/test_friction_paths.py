"""Paths of equilibria with Coulomb friction: what sticks, what slips, what is lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pressed import SHEET, T, cycle, plates, press

import foldyn as fd
from contact_sheets import on_a_panel
from foldyn.checks import tangent_error
from foldyn.errors import ComputationError, InputError
from foldyn.statics import OrigamiProblem

pytestmark = pytest.mark.filterwarnings("ignore:contact. at rest panels are nearer")
MU, WEIGHT, WAY = 0.4, 0.06, 5e-5  # N, m


def strip(supports, loads=(), **plane):
    """A flat strip that its weight, the load 0, presses onto a rough plane."""
    pattern = fd.patterns.simple_fold(a=0.04, b=0.05, dihedral=180)
    s = fd.discretize(pattern, SHEET, fold_law="linear", membrane="bars", preset="plate")
    ground = fd.Plane((0, 0, -0.495 * T), (0, 0, 1), friction=MU, **plane)
    n = len(s.nodes)
    weight = fd.Force(list(range(n)), (0, 0, -WEIGHT / n))
    return fd.Case(s, supports, [weight, *loads], contact=fd.Contact(planes=[ground]))


def lying(supports=(), loads=(), friction: float = MU) -> fd.Case:
    """A strip that its weight, the load 0, presses onto a panel that is held."""
    s, strip = on_a_panel(shift=(0.013, 0.007), turn=0.3)
    held = fd.Fix(np.setdiff1d(np.arange(len(s.nodes)), strip))
    weight = fd.Force(strip, (0, 0, -WEIGHT / len(strip)))
    contact = fd.Contact(friction=friction)
    return fd.Case(s, [held, *supports], [weight, *loads], contact=contact)


SURFACES = {"plane": (strip, [0, 1], 1e-6), "panel": (lying, [4, 5], 3e-4)}


def dragged(factors, surface="plane"):
    """The strip, two nodes of which are dragged along a surface; with the force on them."""
    make, ends, _ = SURFACES[surface]
    case = make([fd.Impose(ends, "x", WAY), fd.Fix(ends, "y")])
    path = fd.trace(case, "displacement", load_factors=factors, constant=[0])
    mine = (case.reaction_dofs % 3 == 0) & np.isin(case.reaction_dofs // 3, ends)
    return path, path.reaction.values[:, mine].sum(axis=1)


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("steps", [1, 4, 10])
def test_a_dragged_strip_slides_under_mu_n_whatever_the_steps(surface, steps):
    way = np.linspace(0.0, 1.0, steps + 1)
    path, force = dragged([*way, *(1.0 - 2.0 * way[1:])], surface)
    top, lost = int(np.argmax(path.load_factor.values)), float(path.dissipated[-1])
    wanted = [MU * WEIGHT, -MU * WEIGHT]
    assert force[[top, -1]] == pytest.approx(wanted, rel=SURFACES[surface][2])
    assert path.negative_eigenvalues.values[-1] == -1  # it slips: no eigenvalue tells anything
    assert (np.diff(path.dissipated.values) >= 0.0).all()
    # each node slips all its way but what its spring takes up
    assert lost == pytest.approx(MU * WEIGHT * 3.0 * WAY, rel=0.02)
    if surface == "panel":
        return
    np.testing.assert_allclose(path.plane_force.values[:, 0, 2], WEIGHT, rtol=1e-9)
    np.testing.assert_allclose(path.plane_friction.values[:, 0, 0], -force, atol=1e-9 * WEIGHT)
    # twice as much where it turns
    slipped = MU * WEIGHT * (3.0 * WAY - 3.0 * MU * WEIGHT / 8.0 / (0.03 * 1.219e9 * T))
    assert lost == pytest.approx(slipped, rel=2e-3)  # the strip gives a bit
    assert lost == pytest.approx(3.5669556e-6, rel=1e-6)  # in 100 steps


@pytest.mark.matrix
@pytest.mark.parametrize(("surface", "close"), [("plane", 1e-6), ("panel", 1e-5)])
def test_the_work_of_a_cycle_is_what_slipping_takes(surface, close):
    work, lost, stored = cycle(lambda factors: dragged(factors, surface))
    np.testing.assert_allclose(work, lost, rtol=close)
    assert np.ptp(stored) < 0.1 * close * lost[0]


def tilted(factors, surface="plane"):
    """The strip under a force along the surface that reaches twice mu N; nothing else holds it."""
    nodes = range(8) if surface == "plane" else on_a_panel()[1]
    aside = fd.Force(nodes, (2.0 * MU * WEIGHT / len(nodes), 0, 0))
    return fd.trace(SURFACES[surface][0]([], [aside]), "newton", load_factors=factors, constant=[0])


@pytest.mark.matrix
@pytest.mark.parametrize("surface", SURFACES)
def test_what_leans_holds_up_to_the_angle_of_friction(surface):
    with pytest.raises(ComputationError, match="no equilibrium was found beyond the load factor 0"):
        tilted([0.49, 0.501], surface)
    if surface == "panel":
        path = tilted([0.49, 0.4999], surface)
        assert np.abs(path.displacement.values[:, :, :2]).max() < 1e-6
        return
    path = tilted([0.49, 0.499999, 0.2, 0.0])
    aside = path.plane_friction.values[:, 0, 0] / (MU * WEIGHT)
    np.testing.assert_allclose(aside, [-0.98, -0.999998, -0.4, 0.0], atol=1e-9)
    assert (path.negative_eigenvalues == 0).all()  # springs that stick hold it
    assert np.abs(path.displacement.values[-1, :, :2]).max() < 1e-12  # and give back what they took


def test_stability_is_not_counted_where_nodes_slip():
    path, force = dragged([0.0, 1e-3, 1.0])
    counts = path.negative_eigenvalues.values.tolist()
    assert counts[:2] == [0, 0] and counts[-1] == -1 and set(counts) == {0, -1}
    assert 0.0 < force[1] < 0.9 * MU * WEIGHT
    assert path.attrs["unstable_points"] == 0


def test_a_plane_takes_the_strip_along():
    """Friction acts on what moves against the plane, whichever of them moves."""
    case = strip([fd.Fix([0, 1], "xy")], motion=(WAY, 0.0, 0.0))
    path = fd.trace(case, "displacement", load_factors=[0.0, 0.5, 1.0, 0.5], constant=[0])
    pull = path.plane_friction.values[:, 0, 0] / (MU * WEIGHT)
    np.testing.assert_allclose(pull, [0.0, 1.0, 1.0, -1.0], atol=1e-6)


def moved(case: fd.Case, u: np.ndarray, aside: float) -> np.ndarray:
    """A state u (m,) with the strip pressed onto the panel and moved aside (m)."""
    out = u.copy()
    strip = [node for node in range(len(case.structure.nodes)) if node > 3 and node != 10]
    out[3 * np.array(strip)] += aside
    out[3 * np.array(strip) + 2] -= 2e-5
    return out


def begun(case):
    """The problem of a case, and the state where it begins."""
    problem = OrigamiProblem(case, flow="followed")
    problem.begin(0.0)
    return problem, problem.start(0.0)


@pytest.mark.parametrize(
    ("surface", "size", "slips"),
    [("plane", 1e-8, True), ("plane", 1e-6, True), ("panel", 1e-5, True), ("panel", 1e-7, False)],
)
def test_tangents_with_friction_are_exact(surface, size, slips):
    if surface == "plane":
        problem, u = begun(strip([], motion=(3e-5, 2e-5, 1e-6)))
    else:
        case = lying([fd.Impose([4, 5], "x", WAY), fd.Fix([4, 5], "y")])
        problem, u = begun(case)
        u, size = moved(case, u, size), 1e-8
    u = u + size * np.random.default_rng(1).normal(size=u.size)
    assert problem.slips(u) == slips
    error = tangent_error(
        lambda v: problem.residual(v, 0.3), lambda v: problem.tangent(v, 0.3), at=u, size=1e-9
    )
    assert error < (1e-6 if surface == "plane" else 1e-5)  # of the differences


def rough(friction):
    """The folded sheet between plates with friction."""
    case, _ = press()
    planes = [replace(plane, friction=friction) for plane in case.contact.planes]
    return case.altered(contact=replace(case.contact, planes=planes))


@pytest.fixture(scope="module")
def cycles():
    """The sheet is pressed and released, without and with friction."""
    way = np.linspace(0.0, 0.3, 9)
    factors = [*way, *way[-2::-1]]
    return {
        mu: (rough(mu), fd.trace(rough(mu), "newton", load_factors=factors)) for mu in (0.0, 0.3)
    }


@pytest.mark.matrix
def test_a_rough_press_meets_more_force_on_the_way_in_and_less_on_the_way_out(cycles):
    smooth, force = (plates(*cycles[mu])[0] for mu in (0.0, 0.3))
    np.testing.assert_allclose(smooth[:8], smooth[:-9:-1], rtol=1e-6)
    assert (force[2:9] > 1.02 * smooth[2:9]).all()
    assert (force[10:-1] < 0.99 * smooth[10:-1]).all()


@pytest.mark.matrix
def test_the_energy_of_a_rough_press_closes(cycles):
    for case, path in cycles.values():
        stored = sum(path[group].values for group in case.energy_groups)
        lost = path.dissipated.values if "dissipated" in path else np.zeros(len(stored))
        gap = np.abs(stored - stored[0] + lost - path.work.values)
        assert gap.max() < 0.02 * path.work.values.max()  # trapezoids
    assert lost[-1] > 0.1 * path.work.values.max()


@pytest.mark.matrix
def test_friction_converges_with_the_steps_of_a_path():
    case = rough(0.3)
    ways = [np.linspace(0.0, 0.3, steps + 1) for steps in (8, 16, 32)]
    paths = [fd.trace(case, "newton", load_factors=way) for way in ways]
    ends = [plates(case, path)[0][-1] for path in paths]
    coarse, fine = np.abs(np.diff(ends))
    assert 0.7 < np.log2(coarse / fine) < 1.5  # first order: backward Euler
    assert fine < 1e-4 * ends[-1]
    free = fd.trace(case, "arc_length", load_factors=[0.0, 0.3], first_step=0.02)
    assert plates(case, free)[0][-1] == pytest.approx(ends[-1], rel=2e-3)
    # nothing of a path is left in its case
    again = fd.trace(case, "newton", load_factors=ways[0])
    np.testing.assert_array_equal(again.displacement, paths[0].displacement)


@pytest.mark.matrix
def test_a_press_whose_creases_yield():
    """What never yields is elastic; what yields takes work, and lets the plates go."""
    case, _ = press()
    way = np.linspace(0.0, 0.9, 7)
    paths = {}
    for name, law, factors in (
        ("elastic", "linear", way),
        ("strong", fd.Plastic(1e3, law="linear"), way),
        ("weak", fd.Plastic(0.02, kinematic=0.005, law="linear"), [*way, *way[-2::-1]]),
    ):
        s = fd.discretize(case.structure.pattern, SHEET, fold_law=law, preset="plate")
        paths[name] = fd.trace(replace(case, structure=s), "newton", load_factors=factors)
    elastic, strong, weak = (plates(case, path)[0] for path in paths.values())
    np.testing.assert_allclose(strong, elastic, rtol=1e-9, atol=1e-12)
    top = len(way) - 1
    assert weak[top] < 0.99 * elastic[top]
    assert weak[-1] < 1e-9 < 0.01 < elastic[1]  # it springs back by a part of the way
    path = paths["weak"]
    stored = sum(path[group].values for group in case.energy_groups)
    gap = stored - stored[0] + path.dissipated.values - path.work.values
    assert np.abs(gap).max() < 0.03 * path.work.values.max()
    assert float(path.dissipated[-1]) > 0.05 * path.work.values.max()


@pytest.mark.parametrize("surface", SURFACES)
def test_what_needs_an_energy_refuses_friction(surface):
    with pytest.raises(InputError, match=r"contact.friction: makes equilibria depend on the path"):
        OrigamiProblem(SURFACES[surface][0]([]))


def test_a_path_that_goes_on_from_the_same_point_takes_the_same_way():
    """What an accepted step has tied is recalled: two tries from it are equal."""
    case = lying([fd.Impose([4, 5], "x", WAY), fd.Fix([4, 5], "y")])
    problem, u = begun(case)
    kept = problem.keep(moved(case, u, 0.0), 0.0)
    ahead = moved(case, u, 1e-7)
    first = problem.residual(ahead, 0.3)
    assert problem.slips(moved(case, u, 1e-5))
    problem.keep(moved(case, u, 1e-5), 0.3)
    assert np.abs(problem.residual(ahead, 0.3) - first).max() > 1e-3 * np.abs(first).max()
    problem.recall(kept)
    np.testing.assert_allclose(problem.residual(ahead, 0.3), first, rtol=1e-9, atol=1e-12)


@pytest.mark.matrix
def test_layers_that_rub_make_a_stiffer_block():
    """A folded Miura sheet between smooth plates: its layers slide on each other."""
    case, layers = press()
    near = 1.0 - (2.4 - 0.7) * layers * T / (2.0 * case.contact.planes[0].motion[0])
    forces = {}
    for mu in (0.0, 0.3):
        planes = [replace(plane, friction=0.0) for plane in case.contact.planes]
        rough = case.altered(contact=replace(case.contact, friction=mu, planes=planes))
        closing = fd.trace(rough, "newton", load_factors=np.linspace(0.0, near, 20))
        path = fd.trace(
            rough, "arc_length", load_factors=[near, 1.0], steps=300, first_step=(1.0 - near) / 40,
            initial=fd.initial_state(closing),
        )  # fmt: skip
        force, length = plates(rough, path)
        forces[mu] = np.interp([-2.2, -0.9], -length / (layers * T), force)
    assert forces[0.3][0] == pytest.approx(forces[0.0][0], rel=1e-3)  # layers hardly touch
    assert 1.02 < forces[0.3][1] / forces[0.0][1] < 1.1
    stored = sum(path[group].values for group in rough.energy_groups)
    gap = stored - stored[0] + path.dissipated.values - path.work.values
    assert np.abs(gap).max() < 0.03 * path.work.values.max()  # trapezoids
    assert 1e-3 < path.dissipated.values[-1] / path.work.values[-1] < 1e-2
    assert (np.diff(path.dissipated.values) >= 0.0).all() and path.dissipated.values[-1] > 0.0
