"""Paths of equilibria with Coulomb friction between panels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pressed import T, cycle, plates, press

import foldyn as fd
from contact_sheets import on_a_panel
from foldyn.checks import tangent_error
from foldyn.errors import ComputationError, InputError
from foldyn.statics import OrigamiProblem

pytestmark = pytest.mark.filterwarnings("ignore:contact. at rest panels are nearer")
MU, WEIGHT, WAY = 0.4, 0.06, 5e-5  # N, m


def lying(supports=(), loads=(), friction: float = MU) -> fd.Case:
    """A strip that its weight, the load 0, presses onto a panel that is held."""
    s, strip = on_a_panel(shift=(0.013, 0.007), turn=0.3)
    held = fd.Fix(np.setdiff1d(np.arange(len(s.nodes)), strip))
    weight = fd.Force(strip, (0, 0, -WEIGHT / len(strip)))
    contact = fd.Contact(friction=friction)
    return fd.Case(s, [held, *supports], [weight, *loads], contact=contact)


def moved(case: fd.Case, u: np.ndarray, aside: float) -> np.ndarray:
    """A state u (m,) with the strip pressed onto the panel and moved aside (m)."""
    out = u.copy()
    strip = [node for node in range(len(case.structure.nodes)) if node > 3 and node != 10]
    out[3 * np.array(strip)] += aside
    out[3 * np.array(strip) + 2] -= 2e-5
    return out


def dragged(factors):
    """The strip, two nodes of which are dragged along the panel; with the force on them."""
    case = lying([fd.Impose([4, 5], "x", WAY), fd.Fix([4, 5], "y")])
    path = fd.trace(case, "displacement", factors, constant=[0])
    mine = (case.reaction_dofs % 3 == 0) & np.isin(case.reaction_dofs // 3, [4, 5])
    return path, path.reaction.values[:, mine].sum(axis=1)


@pytest.mark.parametrize("steps", [1, 4, 10])
def test_a_dragged_strip_slides_under_mu_n_whatever_the_steps(steps):
    way = np.linspace(0.0, 1.0, steps + 1)
    path, force = dragged([*way, *(1.0 - 2.0 * way[1:])])
    top = int(np.argmax(path.load_factor.values))
    assert force[top] == pytest.approx(MU * WEIGHT, rel=3e-4)
    assert force[-1] == pytest.approx(-MU * WEIGHT, rel=3e-4)
    assert path.negative_eigenvalues.values[-1] == -1  # it slips: no eigenvalue tells anything
    # each node slips all its way but what its spring takes up
    assert float(path.dissipated[-1]) == pytest.approx(MU * WEIGHT * 3.0 * WAY, rel=0.02)
    assert (np.diff(path.dissipated.values) >= 0.0).all()


def test_the_work_of_a_cycle_is_what_slipping_takes():
    work, lost, stored = cycle(dragged)
    np.testing.assert_allclose(work, lost, rtol=1e-5)
    assert np.ptp(stored) < 1e-6 * lost[0]


def test_a_path_that_goes_on_from_the_same_point_takes_the_same_way():
    """What an accepted step has tied is recalled: two tries from it are equal."""
    case = lying([fd.Impose([4, 5], "x", WAY), fd.Fix([4, 5], "y")])
    problem = OrigamiProblem(case, flow="followed")
    problem.begin(0.0)
    u = problem.start(0.0)
    kept = problem.keep(moved(case, u, 0.0), 0.0)
    ahead = moved(case, u, 1e-7)
    first = problem.residual(ahead, 0.3)
    assert problem.slips(moved(case, u, 1e-5))
    problem.keep(moved(case, u, 1e-5), 0.3)
    assert np.abs(problem.residual(ahead, 0.3) - first).max() > 1e-3 * np.abs(first).max()
    problem.recall(kept)
    np.testing.assert_allclose(problem.residual(ahead, 0.3), first, rtol=1e-9, atol=1e-12)


def test_what_leans_holds_up_to_the_angle_of_friction():
    def tilted(factors):
        """Under a force along the panel that reaches twice mu N; nothing else holds the strip."""
        _, strip = on_a_panel()
        aside = fd.Force(strip, (2.0 * MU * WEIGHT / len(strip), 0, 0))
        return fd.trace(lying(loads=[aside]), "newton", factors, constant=[0])

    path = tilted([0.49, 0.4999])
    assert np.abs(path.displacement.values[:, :, :2]).max() < 1e-6
    with pytest.raises(ComputationError, match="no equilibrium was found beyond the load factor 0"):
        tilted([0.49, 0.501])


@pytest.mark.parametrize(("aside", "slips"), [(1e-5, True), (1e-7, False)])
def test_tangents_with_friction_are_exact(aside, slips):
    case = lying([fd.Impose([4, 5], "x", WAY), fd.Fix([4, 5], "y")])
    problem = OrigamiProblem(case, flow="followed")
    problem.begin(0.0)
    u = moved(case, problem.start(0.0), aside)
    u = u + 1e-8 * np.random.default_rng(1).normal(size=u.size)
    assert problem.slips(u) == slips
    error = tangent_error(
        lambda v: problem.residual(v, 0.3), lambda v: problem.tangent(v, 0.3), u, size=1e-9
    )
    assert error < 1e-5  # of the differences


@pytest.mark.matrix
def test_layers_that_rub_make_a_stiffer_block():
    """A folded Miura sheet between smooth plates: its layers slide on each other."""
    case, layers = press()
    near = 1.0 - (2.4 - 0.7) * layers * T / (2.0 * case.contact.planes[0].motion[0])
    forces = {}
    for mu in (0.0, 0.3):
        planes = [replace(plane, friction=0.0) for plane in case.contact.planes]
        rough = case.altered(contact=replace(case.contact, friction=mu, planes=planes))
        closing = fd.trace(rough, "newton", np.linspace(0.0, near, 20))
        path = fd.trace(
            rough, "arc_length", [near, 1.0], steps=300, first_step=(1.0 - near) / 40,
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


def test_what_needs_an_energy_refuses_friction():
    with pytest.raises(InputError, match=r"contact.friction: makes equilibria depend on the way"):
        OrigamiProblem(lying())
