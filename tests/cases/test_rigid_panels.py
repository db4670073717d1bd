"""Rigid panels: panels without bending, against the mechanics of rigid bodies.

Kinematics of the Miura-ori: Schenk and Guest, PNAS 110, 2013; Wei, Guo, Dudte, Liang and Mahadevan,
Phys. Rev. Lett. 110, 2013. At its flat-foldable vertices half the fold angles of the two kinds of
creases have tangents in the constant ratio cos(panel angle) (Evans, Lang, Magleby and Howell, R.
Soc. Open Sci. 2, 2015). The generator of the pattern is an independent statement of the same.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import foldyn as fd
from foldyn.structures.structure import hinge_angles
from named_models import named

GAMMA, DIHEDRAL = 60.0, 100.0
STIFF = fd.Sheet(1e9, 0.25, 0.01, density=300.0)
CREASE, STRETCH = 0.02, 1e-8  # N m/rad per m, against some 1e7 N of the bars
CLOSER = np.cos(np.radians(GAMMA))
MODELS = {
    "bars": lambda pattern, **more: fd.discretize(pattern, STIFF, mass="consistent", **named(more)),
    "shell": lambda pattern, **more: fd.shell(
        pattern, STIFF, divisions=2, mass="consistent", **more
    ),
}


def miura(dihedral=DIHEDRAL):
    return fd.patterns.miura((1, 1), 1.0, b=1.0, panel_angle=GAMMA, dihedral=dihedral)


def folding_cell(model, **more):
    """A unit cell in the frame of its generator, with creases that are linear."""
    options = {"fold_law": "linear", "crease_stiffness": CREASE, "rigid": "all"}
    s = MODELS[model](miura(), **{**options, **more})
    return s, [fd.Fix([0, 1, 2], "x"), fd.Fix([0], "y"), fd.Fix([0, 2, 6, 8], "z")]


def swing(model, **more):
    """A panel that swings about the edge of another, which is held."""
    s = MODELS[model](fd.patterns.simple_fold(1.0, 1.5, dihedral=70.0), fold_law="linear", **more)
    return s, fd.Case(s, [fd.Fix([2, 3, 4, 5])])


@pytest.mark.filterwarnings("error")  # soft bends among them: they cannot turn
@pytest.mark.parametrize("model", MODELS)
def test_a_panel_on_a_crease_is_a_pendulum(model) -> None:
    """I = m a^2 / 3 on the spring of the crease: omega^2 = k / I."""
    s, case = swing(model, rigid="all")
    inertia = STIFF.density * STIFF.thickness * 1.5 / 3.0
    found = fd.modes(case, 1)
    frequency = np.sqrt(s.fold_stiffness[0] / inertia) / (2.0 * np.pi)
    assert found.frequency.item(0) == pytest.approx(frequency, rel=1e-6)
    assert found.soft_hinges == 0


@pytest.mark.matrix
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    "method", [pytest.param("rk4", marks=pytest.mark.matrix), "newmark", "energy_momentum"]
)
def test_a_pendulum_in_large_swings(model, method) -> None:
    """Energy: I w^2 / 2 + m g (height) is kept, and the dihedral follows the rigid body."""
    s, case = swing(model, rigid="all", crease_stiffness=0.0)
    case = fd.Case(s, case.supports, [fd.Gravity("-z")])
    motion = fd.simulate(
        case, 0.4, method=method, dt=2e-4 if method != "rk4" else None, interval=0.05
    )
    # the equation of a compound pendulum about the ridge, by an integrator of SciPy's
    ridge, edge = s.nodes[[2, 0]]
    first = np.arctan2(edge[2] - ridge[2], edge[0] - ridge[0])
    t = motion.time.values
    turned = solve_ivp(
        lambda _, y: (y[1], -1.5 * 9.80665 * np.cos(y[0])), (0.0, 0.4), (first, 0.0),
        t_eval=t, rtol=1e-11, atol=1e-11,
    ).y[0]  # fmt: skip
    tip = s.nodes[0] + motion.displacement.values[:, 0] - ridge
    angle = np.unwrap(np.arctan2(tip[:, 2], tip[:, 0]))
    assert np.ptp(angle) > 0.5
    close = 2e-4 if method == "newmark" else 1e-5  # of order 2, and the bars stretch
    np.testing.assert_allclose(angle, turned, atol=close)
    assert motion.energy_error < 1e-4


@pytest.mark.parametrize("model", MODELS)
def test_a_miura_cell_folds_as_one_mechanism(model) -> None:
    """All vertices where the generator has them at the same dihedral, to the bars' stretch."""
    s, supports = folding_cell(model)
    case = fd.Case(s, supports, [fd.Force([2, 8], (0.0, -0.02, 0.0))])
    path = fd.trace(case, load_factors=[0.25, 0.5, 0.75, 1.0])
    assert (path.negative_eigenvalues.values == 0).all()
    assert s.pattern.creases.tolist() == [[1, 4], [3, 4], [4, 5], [4, 7]]
    for u in path.displacement.values:
        x = s.nodes + u
        folded = np.pi - hinge_angles(x, s.folds)
        expected = miura(180.0 - abs(np.degrees(folded[0]))).vertices
        np.testing.assert_allclose(x[: len(expected)], expected, atol=STRETCH)
        half = np.tan(0.5 * folded)
        np.testing.assert_allclose(half[[0, 3]], half[0], rtol=STRETCH)
        np.testing.assert_allclose(half[1:3] / half[0], [-CLOSER, CLOSER], rtol=STRETCH)
        assert all(flat(s, panel, x) < 1e-14 for panel in range(4))
    assert np.degrees(np.abs(folded[0])) > 95.0  # from 80


def flat(s, panel, x) -> float:
    """How far the nodes of a panel lie off a plane, m."""
    nodes = np.unique(s.triangles[s.triangle_panel == panel])
    return float(np.linalg.svd(x[nodes] - x[nodes].mean(axis=0))[1][2])


@pytest.mark.parametrize("model", MODELS)
def test_the_folding_mode_of_a_miura_cell(model) -> None:
    """omega^2 = sum k (d theta / d s)^2 / v M v, v the velocities of its rigid panels along s."""
    s, supports = folding_cell(model)
    count, step = len(s.pattern.vertices), 1e-3
    behind, ahead = (miura(DIHEDRAL + change).vertices for change in (-step, step))
    corners = np.arange(count)
    moved = np.zeros_like(s.nodes)
    moved[:count] = (ahead - behind) / (2.0 * step)
    case = fd.Case(s, supports)
    for plate in s.plates:  # interior points of a panel go with its corners
        inner = np.setdiff1d(plate.riders, corners)
        inside = [row for row, node in enumerate(plate.riders) if node in inner]
        moved[plate.riders[inside]] = plate.weights[inside] @ moved[plate.corners]
    assert np.abs(case.constraints.values(moved)).max() < 1e-9
    turns = hinge_angles(s.nodes + step * moved, s.folds)
    turns = (turns - hinge_angles(s.nodes - step * moved, s.folds)) / (2.0 * step)
    inertia = float((moved * (s.mass @ moved)).sum())
    expected = np.sqrt(s.fold_stiffness @ turns**2 / inertia) / (2.0 * np.pi)
    found = fd.modes(case, 2)
    assert found.frequency.item(0) == pytest.approx(expected, rel=1e-6)
    assert found.frequency.item(1) > 100.0 * expected  # the sheet stretches


def test_both_models_fold_alike() -> None:
    """With rigid panels nothing distinguishes them but how their panels stretch."""
    motions, load = [], fd.Force([2, 8], (0.0, -2.0, 0.0), fd.HalfSine(0.5))
    for model in MODELS:
        case = fd.Case(*folding_cell(model), [load], fd.Rayleigh(0.5))
        motions.append(fd.simulate(case, 1.0, method="generalized_alpha", dt=2e-3, interval=0.1))
        assert motions[-1].energy_error < 1e-4
    bars, shell = (motion.displacement.values[:, :9] for motion in motions)
    assert np.abs(bars).max() > 0.05
    np.testing.assert_allclose(bars, shell, atol=1e-5 * np.abs(bars).max())
    assert motions[0].strain_bends.max() < 1e-20 > motions[1].strain_bending.max()


@pytest.mark.parametrize("model", MODELS)
def test_some_rigid_panels_and_some_that_bend(model) -> None:
    """One panel that cannot bend changes nothing of the others' equations, and stays flat."""
    (s, supports), (whole, _) = (folding_cell(model, rigid=rigid) for rigid in ([1], None))
    loads = [fd.Force([2, 8], (0.0, -0.02, 0.0)), fd.Force([7], (0.0, 0.0, 0.01))]
    case = fd.Case(s, supports, loads)
    assert {equation.owner for equation in case.constraints.equations} == {"the rigid panels"}
    path, free = (
        fd.trace(one, load_factors=[0.5, 1.0]) for one in (case, fd.Case(whole, supports, loads))
    )
    x = s.nodes + path.displacement.values[-1]
    assert flat(s, 1, x) < 1e-14 and flat(s, 0, x) > 1e-6
    assert free.work.item(-1) > path.work.item(-1)  # a constraint makes it stiffer


def test_rigid_panels_do_not_shorten_the_step() -> None:
    """A penalty would; here fast motions of center nodes are gone, and the step grows."""
    sheet = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
    pattern = fd.patterns.miura((2, 2))
    steps = []
    for rigid in (None, "all"):
        s = fd.discretize(pattern, sheet, rigid=rigid, preset="herkal")
        steps.append(fd.critical_step(fd.Case(s, [fd.Fix([0])])))
    assert 1.1 < steps[1] / steps[0] < 1.6


def test_a_shell_of_rigid_panels_alone_takes_explicit_methods() -> None:
    s, supports = folding_cell("shell")
    assert (s.rotations, s.massless) == (0, "")
    assert fd.critical_step(fd.Case(s, supports)) > 0.0
    some, whole = (folding_cell("shell", rigid=rigid)[0] for rigid in ([0, 1], None))
    assert 0 < some.rotations < whole.rotations


@pytest.mark.parametrize("model", MODELS)
def test_a_result_holds_its_rigid_panels(model, kept) -> None:
    s, supports = folding_cell(model, rigid=[1, 2])
    supports = [*supports, fd.Fix([8], direction=(1.0, 1.0, 0.0)), fd.Link([3, 5], axes="z"),
                fd.Impose([7], direction="z", value=1e-4)]  # fmt: skip
    path = fd.trace(fd.Case(s, supports), "displacement", load_factors=[0.0, 1.0])
    again = kept(path)
    assert again.structure.options.rigid == (1, 2) and again.supports == tuple(supports)
    same = fd.trace(again, "displacement", load_factors=[0.0, 1.0])
    for name in ("displacement", "reaction"):
        np.testing.assert_array_equal(same[name], path[name])
    z = path.displacement.values[-1, :, 2]
    assert [z[7], z[3]] == pytest.approx([1e-4, z[5]], rel=1e-12)
