"""Axial dashpots and damped creases: directions, forces, power and matrix, for both models."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.dynamics.dampers import dampers, damping_matrix
from foldyn.mechanics.term import ThreadTerms, evaluate
from foldyn.mechanics.viscous import WIDTH, Viscous, ViscousTerm, put_gradients
from resisted import resisted

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
C = 0.3  # N m s/rad per m
RNG = np.random.default_rng(4)


def damped(model: str) -> fd.Case:
    """A Miura cell with damped creases and dashpots between its corners."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.2, panel_angle=60, dihedral=80)
    bars = fd.discretize(pattern, SHEET, preset="herkal")  # its panels do not give way at creases
    s = bars if model == "bars" else fd.shell(pattern, SHEET, divisions=2)
    axial = fd.Dashpot(0.7, between=[(0, 8), (2, 6)])
    return fd.Case(s, [axial], damping=fd.CreaseDamping(C))


def elements_of(case: fd.Case) -> Viscous:
    return case.elastic_body.with_terms(*dampers(case)).term(ViscousTerm).elements


def state(case: fd.Case, size: float) -> np.ndarray:
    """Random dofs (rows, 3) of a size (m)."""
    body, out = case.body, np.zeros((case.body.rows, 3))
    out.reshape(-1)[: body.size] = size * RNG.standard_normal(body.size)
    return out


def scalars(case: fd.Case, q: np.ndarray) -> np.ndarray:
    """Distances (m) of the dashpots and angles (rad) of the hinges of the folds."""
    n = len(case.structure.nodes)
    x = case.structure.nodes + q.reshape(-1, 3)[:n]
    lengths = [np.linalg.norm(x[b] - x[a]) for a, b in case.dashpots[0][1].between]
    part = case.body.thread_parts(1)[0]
    model, moved = ThreadTerms(case.body, part), case.body.in_rows(q)
    evaluate(model.terms, moved, 0.0 * moved, 0.0 * moved, np.zeros(0))
    hinges = case.body.sheet.fold_hinges()
    angles = part.fold_angle
    if len(angles) != len(hinges.fold):  # bars and hinges: all hinges stand there
        angles = case.structure.dihedrals(q[: case.structure.nodes.size])[0]
    return np.concatenate([lengths, angles])


@pytest.mark.parametrize("model", ["bars", "shell"])
def test_directions_are_gradients(model):
    """Of the distance between nodes, and of the very angle that resists folding."""
    case = damped(model)
    elements, q = elements_of(case), state(case, 0.02)
    found = np.zeros((len(elements.coefficient), WIDTH))
    put_gradients(elements, q.ravel(), found)
    for _ in range(3):
        along, h = state(case, 1.0), 1e-6
        exact = (scalars(case, q + h * along) - scalars(case, q - h * along)) / (2 * h)
        rates = (found * along.ravel()[elements.dofs]).sum(axis=1)
        assert rates == pytest.approx(exact, rel=1e-6, abs=1e-7)


@pytest.mark.parametrize("model", ["bars", "shell"])
def test_force_power_and_matrix_agree(model):
    """Force = C(u) v, power = v' C v = sum of c rate^2; the coefficient is c times the length."""
    case = damped(model)
    elements, q, v = elements_of(case), state(case, 0.02), state(case, 1.0)
    (force, power), m = resisted(case, q, v), case.body.size
    matrix = damping_matrix(case, q.ravel()[:m])
    assert force.ravel()[:m] == pytest.approx(matrix @ v.ravel()[:m], rel=1e-12, abs=1e-12)
    assert power == pytest.approx((force * v).sum(), rel=1e-12)
    h = 1e-6
    rates = (scalars(case, q + h * v) - scalars(case, q - h * v)) / (2 * h)
    assert power == pytest.approx((elements.coefficient * rates**2).sum(), rel=1e-7)
    creases = case.structure.pattern.creases
    length = np.linalg.norm(np.diff(case.structure.nodes[creases], axis=1), axis=2).sum()
    assert elements.coefficient.sum() == pytest.approx(2 * 0.7 + C * length)


@pytest.mark.parametrize("model", ["bars", "shell"])
def test_rigid_motions_dissipate_nothing(model):
    """However far the sheet has turned and folded: no force, no power."""
    case = damped(model)
    n = len(case.structure.nodes)
    turn, q = Rotation.from_rotvec([1.0, -2.0, 0.5]), state(case, 0.02)
    x = case.structure.nodes + q[:n]
    q[:n] = turn.apply(x) - case.structure.nodes
    v = np.zeros_like(q)
    v[:n] = np.cross([0.3, 1.0, -2.0], turn.apply(x)) + np.arange(3.0)
    force, power = resisted(case, q, v)
    assert power < 1e-25
    assert np.abs(force).max() < 1e-13


def test_what_cannot_be_damped_is_said():
    """A model that does not tell which hinges are those of a fold is refused, not left undamped."""
    case = damped("bars")
    body = case.body
    hinges = body.sheet.fold_hinges()
    body.sheet.fold_hinges = lambda: hinges._replace(
        fold=hinges.fold[1:], nodes=hinges.nodes[1:], corners=hinges.corners[1:],
        hidden=hinges.hidden[1:],
    )  # fmt: skip
    with pytest.raises(fd.errors.InputError, match="cannot damp crease 0"):
        dampers(case)
