"""Paths of equilibria with contact: a strip that folds onto itself, a sheet pressed to a block."""

from __future__ import annotations

import numpy as np
import pytest
from pressed import SHEET, T, plates, press

import foldyn as fd
from contact_sheets import crossing, strip
from foldyn.checks import tangent_error
from foldyn.errors import CrossingWarning
from foldyn.statics import OrigamiProblem, Settings

TARGETS = [(8.0, 8.0), (8.0, 25.0)]  # degrees to which both creases are folded: edge on edge or not
RESTS = [57.66, 33.26]  # degrees of the smaller one where it rests, as found in 36 load steps


def folded(targets, steps: int = 4, **options):
    case = fd.Case(
        strip(), [fd.Fix(nodes=[2, 3, 4, 5])], [fd.Actuate([0, 1], targets)], contact=fd.Contact()
    )
    return case, fd.trace(case, "newton", steps=steps, **options)


@pytest.mark.matrix
@pytest.mark.parametrize(("targets", "rest"), [*zip(TARGETS, RESTS, strict=True)])
@pytest.mark.filterwarnings("ignore:the path loses stability")  # edge on edge it may slip
def test_a_strip_folded_from_both_ends_comes_to_rest_in_contact(targets, rest):
    pytest.importorskip("ipctk")
    ends = []
    for steps in (1, 4):
        case, path = folded(targets, steps)
        assert crossing(case.structure, path.displacement.values) == 0
        assert float(path.contact[-1]) > 0.0 == float(path.contact[0])
        ends.append(path.displacement.values[-1])
    # where it rests does not depend on the steps that lead there
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)
    angle = np.degrees(case.structure.dihedrals(ends[1])[0])
    assert angle.min() == pytest.approx(rest, abs=0.01)


@pytest.mark.matrix
def test_without_the_limit_of_newtons_steps_it_crosses_itself(monkeypatch):
    pytest.importorskip("ipctk")
    hasty = Settings(jump=1e6, iterations=100)  # nothing else cuts the steps
    case, path = folded(TARGETS[1], 10, settings=hasty)
    assert crossing(case.structure, path.displacement.values) == 0
    monkeypatch.setattr(OrigamiProblem, "clear", lambda problem, u, step: 1.0)
    with pytest.warns(CrossingWarning):
        case, path = folded(TARGETS[1], 10, settings=hasty)
    assert crossing(case.structure, path.displacement.values) > 0


@pytest.fixture(scope="module")
def pressed():
    """A Miura sheet between two plates: until its layers are near, and on to a block."""
    case, layers = press()
    end, way = 0.7, case.contact.planes[0].motion[0]
    near = 1.0 - 0.5 * (2.4 - end) * layers * T / way
    closing = fd.trace(case, "newton", load_factors=np.linspace(0.0, near, 12))
    block = fd.trace(
        case, "arc_length", load_factors=[near, 1.0], steps=100, first_step=(1.0 - near) / 40,
        initial=fd.initial_state(closing),
    )  # fmt: skip
    return case, layers, closing, block


@pytest.mark.matrix
def test_a_sheet_pressed_to_a_block_carries_load_as_its_layers_say(pressed):
    """Forces of a prototype, which minimizes energies, at lengths over the layers' thickness."""
    pytest.importorskip("ipctk")
    case, layers, closing, block = pressed
    for path in (closing, block):
        assert crossing(case.structure, path.displacement.values) == 0
    force, length = plates(case, block)
    over = length / (layers * T)
    assert over.min() < 0.9
    for x, expected in {2.2: 0.30, 1.7: 0.45, 1.3: 7.1, 1.1: 18.0, 0.9: 47.0}.items():
        assert float(np.interp(-x, -over, force)) == pytest.approx(expected, rel=0.35)
    # until the layers meet it hardly resists; at their thickness the force has risen steeply
    soft = float(np.median(plates(case, closing)[0]))
    assert soft < 0.3 < 50.0 * soft < float(np.interp(-1.1, -over, force))


@pytest.mark.matrix
def test_steps_are_cut_anew_from_each_point():
    """A press needs steps far below the first one: few halvings in a row, many in all."""
    case, layers = press()
    few = Settings(cuts=6)
    path = fd.trace(case, "arc_length", load_factors=[0.0, 1.0], first_step=0.05, settings=few)
    length = plates(case, path)[1]
    assert length[-1] < 0.9 * layers * T
    assert np.diff(path.load_factor.values).min() < 0.05 / 2**8


@pytest.mark.matrix
def test_what_the_plates_give_is_what_the_sheet_stores(pressed):
    case, _, _, path = pressed
    force = plates(case, path)[0]
    stored = sum(path[group].values for group in case.energy_groups)
    work = path.work.values
    assert np.abs(stored - stored[0] - work).max() < 0.03 * work[-1]  # trapezoids of the path
    moved = np.diff(path.load_factor.values) * 2.0 * case.contact.planes[0].motion[0]
    along = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * moved)])
    np.testing.assert_allclose(along, work, rtol=1e-9, atol=1e-12)
    assert path.plane_force.dims == ("step", "plane", "axis")
    assert np.abs(path.plane_force.sum("plane").values).max() < 1e-9 * force.max()
    # supports only hold the sheet's place: they carry nothing
    assert np.abs(path.reaction.values).max() < 1e-6 * force.max()


@pytest.mark.matrix
def test_tangents_with_plates_are_exact(pressed):
    case, _, _, path = pressed
    problem, at = OrigamiProblem(case), path.sizes["step"] // 2
    factor = float(path.load_factor[at])
    u = problem.state(path.displacement.values[at], factor)
    assert len(u) == case.structure.nodes.size + 1  # the planes are one dof more
    error = tangent_error(
        lambda v: problem.residual(v, factor), lambda v: problem.tangent(v, factor), at=u, size=1e-7
    )
    assert error < 1e-5  # of the differences: elements switch on and off within them


def test_newtons_method_rests_on_planes_at_the_factors_asked_for():
    """A flap that closes onto the ground: what the ground carries, the held panel holds down."""
    s = fd.discretize(
        fd.patterns.simple_fold(0.04, 0.05, dihedral=100), SHEET, fold_law="linear", preset="plate"
    )
    ground = fd.Plane((0, 0, s.nodes[:, 2].min() - 2.0 * T), (0, 0, 1))
    held, fold = fd.Fix([0, 1, 2, 3]), fd.Actuate([0], 290.0)
    case = fd.Case(s, [held], [fold], contact=fd.Contact(planes=[ground]))
    path = fd.trace(case, load_factors=[0.0, 0.5, 1.0])
    force = plates(case, path)[0]
    down = path.reaction.values[:, case.reaction_dofs % 3 == 2].sum(axis=1)
    np.testing.assert_allclose(force, -down, atol=1e-9)
    assert force[-1] > 1e-3
