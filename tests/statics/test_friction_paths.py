"""Paths of equilibria with Coulomb friction on planes: what sticks, what slips, what is lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pressed import SHEET, T, cycle, plates, press

import foldyn as fd
from foldyn.checks import tangent_error
from foldyn.errors import ComputationError, InputError
from foldyn.statics import OrigamiProblem

MU, WEIGHT, WAY = 0.4, 0.06, 5e-5  # N, m


def strip(supports, loads=(), **plane):
    """A flat strip that its weight, the load 0, presses onto a rough plane."""
    s = fd.discretize(
        fd.patterns.simple_fold(a=0.04, b=0.05, dihedral=180),
        SHEET,
        fold_law="linear",
        membrane="bars",
    )
    ground = fd.Plane((0, 0, -0.495 * T), (0, 0, 1), friction=MU, **plane)
    n = len(s.nodes)
    weight = fd.Force(list(range(n)), (0, 0, -WEIGHT / n))
    return fd.Case(s, supports, [weight, *loads], contact=fd.Contact(planes=[ground]))


def dragged(factors):
    """The strip, one end of which is dragged along the plane; with the force on it."""
    case = strip([fd.Impose([0, 1], "x", WAY), fd.Fix([0, 1], "y")])
    path = fd.trace(case, "displacement", factors, constant=[0])
    return path, path.reaction.values[:, case.reaction_dofs % 3 == 0].sum(axis=1)


@pytest.mark.parametrize("steps", [1, 4, 10])
def test_a_dragged_strip_slides_under_mu_n_whatever_the_steps(steps):
    way = np.linspace(0.0, 1.0, steps + 1)
    path, force = dragged([*way, *(1.0 - 2.0 * way[1:])])
    np.testing.assert_allclose(path.plane_force.values[:, 0, 2], WEIGHT, rtol=1e-9)
    np.testing.assert_allclose(path.plane_friction.values[:, 0, 0], -force, atol=1e-9 * WEIGHT)
    at = path.load_factor.values
    top = int(np.argmax(at))
    assert force[top] == pytest.approx(MU * WEIGHT, rel=1e-6)
    assert force[-1] == pytest.approx(-MU * WEIGHT, rel=1e-6)
    # each node slips all its way but what its spring takes up, twice as much where it turns
    k = 0.03 * 1.219e9 * T
    slipped = MU * WEIGHT * (3.0 * WAY - 3.0 * MU * WEIGHT / 8.0 / k)
    assert float(path.dissipated[-1]) == pytest.approx(slipped, rel=2e-3)  # the strip gives a bit
    assert float(path.dissipated[-1]) == pytest.approx(3.5669556e-6, rel=1e-6)  # in 100 steps
    assert (np.diff(path.dissipated.values) >= 0.0).all()


def test_the_work_of_a_cycle_is_what_slipping_takes():
    work, lost, stored = cycle(dragged)
    np.testing.assert_allclose(work, lost, rtol=1e-6)
    assert np.ptp(stored) < 1e-7 * lost[0]


def tilted(factors):
    """The strip under a force along the plane that reaches twice mu N; nothing else holds it."""
    n = 8
    aside = fd.Force(list(range(n)), (2.0 * MU * WEIGHT / n, 0, 0))
    return fd.trace(strip([], [aside]), "newton", factors, constant=[0])


def test_what_leans_holds_up_to_the_angle_of_friction():
    path = tilted([0.49, 0.499999, 0.2, 0.0])
    aside = path.plane_friction.values[:, 0, 0] / (MU * WEIGHT)
    np.testing.assert_allclose(aside, [-0.98, -0.999998, -0.4, 0.0], atol=1e-9)
    assert (path.negative_eigenvalues == 0).all()  # springs that stick hold it
    assert np.abs(path.displacement.values[-1, :, :2]).max() < 1e-12  # and give back what they took
    with pytest.raises(ComputationError, match="no equilibrium was found beyond the load factor 0"):
        tilted([0.49, 0.501])


def test_stability_is_not_counted_where_nodes_slip():
    path, force = dragged([0.0, 1e-3, 1.0])
    counts = path.negative_eigenvalues.values.tolist()
    assert counts[:2] == [0, 0]
    assert counts[-1] == -1
    assert set(counts) == {0, -1}
    assert 0.0 < force[1] < 0.9 * MU * WEIGHT
    assert path.attrs["unstable_points"] == 0


def test_a_plane_takes_the_strip_along():
    """Friction acts on what moves against the plane, whichever of them moves."""
    case = strip([fd.Fix([0, 1], "xy")], motion=(WAY, 0.0, 0.0))
    path = fd.trace(case, "displacement", [0.0, 0.5, 1.0, 0.5], constant=[0])
    pull = path.plane_friction.values[:, 0, 0] / (MU * WEIGHT)
    np.testing.assert_allclose(pull, [0.0, 1.0, 1.0, -1.0], atol=1e-6)


@pytest.mark.parametrize("size", [1e-8, 1e-6])
def test_tangents_with_friction_are_exact(size):
    case = strip([], motion=(3e-5, 2e-5, 1e-6))
    problem = OrigamiProblem(case, flow="followed")
    problem.begin(0.0)
    u = problem.start(0.0)
    u = u + size * np.random.default_rng(1).normal(size=u.size)
    assert problem.slips(u)
    error = tangent_error(
        lambda v: problem.residual(v, 0.3), lambda v: problem.tangent(v, 0.3), u, size=1e-9
    )
    assert error < 1e-6


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
    return {mu: (rough(mu), fd.trace(rough(mu), "newton", factors)) for mu in (0.0, 0.3)}


def test_a_rough_press_meets_more_force_on_the_way_in_and_less_on_the_way_out(cycles):
    smooth, force = (plates(*cycles[mu])[0] for mu in (0.0, 0.3))
    np.testing.assert_allclose(smooth[:8], smooth[:-9:-1], rtol=1e-6)
    assert (force[2:9] > 1.02 * smooth[2:9]).all()
    assert (force[10:-1] < 0.99 * smooth[10:-1]).all()


def test_the_energy_of_a_rough_press_closes(cycles):
    for case, path in cycles.values():
        stored = sum(path[group].values for group in case.energy_groups)
        lost = path.dissipated.values if "dissipated" in path else np.zeros(len(stored))
        gap = np.abs(stored - stored[0] + lost - path.work.values)
        assert gap.max() < 0.02 * path.work.values.max()  # trapezoids
    assert lost[-1] > 0.1 * path.work.values.max()


@pytest.mark.matrix
def test_friction_converges_with_the_steps_of_a_path():
    ends = []
    for steps in (8, 16, 32):
        path = fd.trace(case := rough(0.3), "newton", np.linspace(0.0, 0.3, steps + 1))
        ends.append(plates(case, path)[0][-1])
    coarse, fine = np.abs(np.diff(ends))
    assert 0.7 < np.log2(coarse / fine) < 1.5  # first order: backward Euler
    assert fine < 1e-4 * ends[-1]
    free = fd.trace(case, "arc_length", [0.0, 0.3], first_step=0.02)
    assert plates(case, free)[0][-1] == pytest.approx(ends[-1], rel=2e-3)
    # nothing of a path is left in its case
    again = fd.trace(case, "newton", np.linspace(0.0, 0.3, 33))
    np.testing.assert_array_equal(again.displacement, path.displacement)


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
        s = fd.discretize(case.structure.pattern, SHEET, fold_law=law)
        paths[name] = fd.trace(replace(case, structure=s), "newton", factors)
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


def test_what_needs_an_energy_refuses_friction():
    with pytest.raises(InputError, match=r"contact.friction: makes equilibria depend on the way"):
        OrigamiProblem(strip([]))
