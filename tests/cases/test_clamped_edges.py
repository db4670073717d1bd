"""Clamped edges: the tangent they keep, that they ride, and plates and strips of textbooks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from attached_cases import FOLD, SHEET, SQUARE, derivative_errors, moved, structure
from scipy.spatial.transform import Rotation

import foldyn as fd
from case_texts import HELD_MIURA_TEXT
from foldyn.dynamics.driver import prepare
from foldyn.errors import InputError, PenetrationError

pytestmark = pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
HEAVY = fd.Sheet(1e6, 0.3, 0.01, density=100.0)
FLAT = fd.Sheet(1e6, 0.0, 0.01, density=100.0)  # a strip of it bends as a beam does
ROOT = [0, 3]


@pytest.mark.parametrize("size", [1e-3, 0.1])
def test_forces_are_the_gradient_of_the_energy_and_the_tangent_that_of_the_forces(model, size):
    body = structure(model, FOLD, clamped=[(0, 1), (0, 2)]).body
    assert max(derivative_errors(body, moved(structure(model, FOLD), size))) < 1e-8


def test_moving_the_clamped_edge_with_the_sheet_strains_nothing(model):
    """A shift costs nothing; a rotation of the whole, which turns the tangent, does."""
    s = structure(model, FOLD, clamped=[(0, 1)])
    shift = np.tile([0.3, -0.2, 0.5], (len(s.nodes), 1))
    assert s.energy(shift) < 1e-20
    assert np.abs(s.internal_force(shift)).max() < 1e-9
    u = 1e-2 * np.random.default_rng(1).standard_normal(s.nodes.shape)
    assert s.internal_force(u).sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-9)
    turned = np.cross([0, 0.01, 0], s.nodes - s.nodes[0])
    assert s.energy(turned) > 1e-7


def test_turns_that_keep_the_tangent_strain_nothing(model):
    """Those about the normal of the panel and about the tangent, which tilts the edge."""
    skew = fd.Pattern([[0, 0, 0], [1, 0.3, 0], [1, 1.3, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    s = structure(model, skew, clamped=[(0, 3)])
    normal, tangent, edge = (
        s.energy(s.nodes @ Rotation.from_euler(axis, 0.3).as_matrix() - s.nodes) for axis in "zxy"
    )
    assert max(normal, tangent) < 1e-20 and edge > 1e-3


def test_the_energy_of_a_clamp_in_bars_and_hinges_is_that_of_its_stiffness():
    """A panel that turns as a whole by phi about its edge: k phi^2 / 2 with k = 2 D L / h."""
    s, phi = structure("bars and hinges", clamped=[(0, 3)]), 0.3
    x, stiffness = s.nodes, 2.0 * SHEET.bending_modulus * 1.0 / 0.5
    assert s.clamp_stiffness == pytest.approx([stiffness])
    turned = np.stack([x[:, 0] * np.cos(phi), x[:, 1], x[:, 0] * np.sin(phi)], axis=1)
    energies = s.energies(turned - x)
    assert energies["strain_bends"] == pytest.approx(0.5 * stiffness * phi**2, rel=1e-12)
    assert energies["strain_bars"] < 1e-20


# ------------------------------------------------------------------ beams


def strip(panels: int) -> fd.Pattern:
    """Panels in a row, 1 m long and 0.1 m wide."""
    x = np.linspace(0.0, 1.0, panels + 1)
    vertices = [[value, side, 0.0] for value in x for side in (0.0, 0.1)]
    faces = [[2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1] for k in range(panels)]
    return fd.Pattern(vertices, faces)


def cantilever(s, tips: list[int]) -> np.ndarray:
    """Deflection (m) under 1e-6 N in all at the tip, and the first frequency (Hz)."""
    root = sorted({node for edge in s.options.clamped for node in edge})
    case = fd.Case(s, [fd.Fix(root)], [fd.Force(tips, (0, 0, 1e-6 / len(tips)))])
    w = fd.trace(case).displacement.values[-1][tips, 2].mean()
    return np.array([w, fd.modes(case, 1).frequency.item(0)])


def beam() -> np.ndarray:
    """w = P L^3 / 3 D b; f = 3.516 / 2 pi sqrt(D / rho t) / L^2: Blevins 1979, table 8-1."""
    d, areal = FLAT.bending_modulus, FLAT.density * FLAT.thickness
    return np.array([1e-6 / (3.0 * d * 0.1), 3.516 / (2.0 * np.pi) * np.sqrt(d / areal)])


@pytest.mark.matrix
def test_a_clamped_strip_of_the_shell_bends_and_swings_as_a_beam():
    s = structure("shell", strip(1), FLAT, divisions=12, clamped=[(0, 1)])
    assert cantilever(s, [2, 3]) == pytest.approx(beam(), rel=0.01)


@pytest.mark.parametrize("panels", [2, 4])
def test_a_clamped_chain_of_rigid_panels_bends_as_a_beam(panels):
    """Rigid panels of length l = h, hinges D b / l between them and 2 D b / l at the clamp.

    The deflection is the trapezoidal rule of P (L - x)^2 / D b: too large by l^2 / 2 L^2.
    """
    s = structure(
        "bars and hinges", strip(panels), FLAT, scheme="n4b5", clamped=[(0, 1)], preset="herkal",
        crease_stiffness=FLAT.bending_modulus * panels,
    )  # fmt: skip
    stiff = replace(s, bend_stiffness=np.full(len(s.bend_stiffness), 20.0))
    w, f = cantilever(stiff, [2 * panels, 2 * panels + 1])
    exact = beam()
    assert w == pytest.approx(exact[0] * (1 + 0.5 / panels**2), rel=5e-3)
    assert f == pytest.approx(exact[1], rel=1.2 / panels)  # lumped masses


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("preset", "frequency", "deflection"),
    [("plate", -0.163, 0.198), ("n5b8e", 0.014, -0.005), ("herkal", -0.098, -0.167)],
)
def test_errors_of_a_clamped_panel(preset, frequency, deflection):
    """What docs/supports.md states of one square panel: linear bends, against the plate."""
    plate = 3.47114  # omega a^2 sqrt(rho t / D), by Ritz: tests/shells/plate_theory.py
    scale = np.sqrt(HEAVY.bending_modulus / (HEAVY.density * HEAVY.thickness)) / (2 * np.pi)
    tips = {}
    for model, options in (("shell", {"divisions": 16}), ("bars and hinges", {"preset": preset})):
        s = structure(model, SQUARE, HEAVY, clamped=[(0, 3)], **options)
        tips[model], f = cantilever(s, [1, 2])
        error = f / (plate * scale) - 1.0
        assert error == pytest.approx(-0.006 if model == "shell" else frequency, abs=0.003)
    reduced = tips["bars and hinges"] / tips["shell"] - 1.0
    assert reduced == pytest.approx(deflection, abs=0.005)


# ------------------------------------------------------------------ supports that move


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["rk4", "generalized_alpha"])
def test_a_clamp_rides_on_a_moving_base(model, method):
    """Seen from the base, a cantilever answers to the inertia alone, wherever it starts."""
    if model == "shell" and method == "rk4":
        pytest.skip("explicit methods do not take the rotations of a shell")
    lumped = "lumped" if model == "shell" else "mixed_voronoi"  # no impulse as the base starts
    s = structure(model, SQUARE, HEAVY, clamped=[(0, 3)], mass=lumped)
    history, a, omega = fd.HalfSine(0.2), 1e-3, np.pi / 0.2
    base = fd.Case(s, [fd.Fix(ROOT), fd.BaseMotion("z", history, a)])
    moving = fd.simulate(base, 0.19, method=method, interval=0.01, tolerance=None)
    pushed = fd.Case(s, [fd.Fix(ROOT)], [fd.Gravity((0, 0, a * omega**2), history)])
    start = fd.State(velocity=-a * omega * (~pushed.fixed) * np.array([0.0, 0.0, 1.0]))
    still = fd.simulate(
        pushed, 0.19, method=method, interval=0.01, initial=start
    ).displacement.values
    relative = moving.displacement.values - moving.displacement.values[:, :1]
    assert np.abs(relative - still).max() < 1e-3 * np.abs(relative).max()
    assert moving.attrs["energy_error"] < 1e-3


@pytest.mark.parametrize(("preset", "clamped"), [("plate", ()), ("plate", [(0, 1)]), ("n5b8e", ())])
def test_explicit_steps_watch_the_dihedrals_of_all_hinges(preset, clamped):
    """Else panels that pass through each other are not seen, or are where none do."""
    s = fd.discretize(FOLD, HEAVY, preset=preset, fold_law="linear", clamped=clamped)
    case = fd.Case(s, [fd.Fix([0, 1]), fd.Spring(1.0, nodes=[3])], [fd.Force([2], (0, 0, 1.0))])
    motion = prepare(case, 0.1, method="rk4", interval=0.01)
    motion.run()
    body, u = motion.packed.body, motion.state.u
    found = body.angles(u.ravel())
    np.testing.assert_allclose(motion.state.angle, found, rtol=0, atol=1e-12)
    assert np.abs(found - body.angles(0.0 * u.ravel())).max() > 1e-3


def test_an_edge_may_be_brought_elsewhere_in_statics(model):
    s, way = structure(model, FOLD, clamped=[(0, 1)]), (0.4, -0.3, 0.2)
    moves = [fd.Impose([0, 1], axis, value) for axis, value in zip("xyz", way, strict=True)]
    u = fd.trace(fd.Case(s, moves)).displacement.values[-1]
    assert u == pytest.approx(np.tile(way, (len(u), 1)), abs=1e-9)


def test_a_clamped_edge_carries_a_sheet_that_turns_without_it(model):
    load = [fd.Force([4, 5], (0, 0, -1e-3))]
    clamped, free = (structure(model, FOLD, clamped=edges) for edges in ([(0, 1)], []))
    path = fd.trace(fd.Case(clamped, [fd.Fix([0, 1])], load))
    assert path.reaction.values[-1].reshape(-1, 3).sum(axis=0) == pytest.approx([0, 0, 2e-3])
    with pytest.raises(InputError, match="can move freely: rotation about y"):
        fd.trace(fd.Case(free, [fd.Fix([0, 1])], load))


def test_a_panel_that_folds_back_at_its_clamp_is_refused():
    thin = fd.Sheet(1e3, 0.3, 1e-4, density=1.0)
    s = structure("bars and hinges", SQUARE, thin, clamped=[(0, 3)])
    spin = fd.State(velocity=s.nodes[:, :1] * [0.0, 0.0, 40.0])
    with pytest.raises(PenetrationError, match="the edge is clamped"):
        fd.simulate(fd.Case(s, [fd.Fix(ROOT)]), 0.3, method="rk4", initial=spin, force=True)


# ------------------------------------------------------------------ points of a mesh


def test_points_between_the_ends_of_a_clamped_edge_are_supported_with_them():
    s = fd.shell(SQUARE, HEAVY, divisions=4, clamped=[(0, 3)])
    edge = np.flatnonzero(s.nodes[:, 0] < 1e-12)
    held = fd.Case(s, [fd.Fix([0, 3], "xz"), fd.Fix([0], "y")])
    assert held.fixed[edge][:, [0, 2]].all()
    assert held.fixed[:, 1].sum() == 1
    assert held.fixed.sum() == 2 * len(edge) + 1
    free = fd.Case(fd.shell(SQUARE, HEAVY, divisions=4), [fd.Fix([0, 3])])
    assert free.fixed.sum() == 6


def test_points_between_the_ends_move_on_a_straight_line():
    s = fd.shell(SQUARE, HEAVY, divisions=4, clamped=[(0, 3)])
    edge = np.flatnonzero(s.nodes[:, 0] < 1e-12)
    turn = fd.Impose([3], "z", 0.2, fd.Ramp(1.0))
    case = fd.Case(s, [fd.Fix([0, 3], "xy"), fd.Fix([0], "z"), turn])
    assert case.imposed[edge, 2].sum() == len(edge) - 1  # not the held end
    assert case.imposed_terms[0][0][edge, 2] == pytest.approx(0.2 * s.nodes[edge, 1])
    u = fd.trace(case, load_factors=[1.0]).displacement.values[-1]
    assert u[edge, 2] == pytest.approx(0.2 * s.nodes[edge, 1], abs=1e-12)


# ------------------------------------------------------------------ writing and bad input


@pytest.mark.parametrize(
    ("clamped", "message"),
    [
        ([(2, 3)], r"clamped: \(2, 3\) is not a boundary edge"),
        ([(0, 1), (1, 0)], r"clamped: \(0, 1\) is listed twice"),
        ((0, 1), r"clamped = \[0, 1\]: give pairs of vertices"),
        ("x > 99", r'clamped = "x > 99": selects no vertex'),
        ("xmin and ymin", "selects no boundary edge, which needs both of its ends"),
        ("xmim", "xmim is not known"),
        (3, "or a selection"),
    ],
)
def test_bad_edges(model, clamped, message):
    with pytest.raises(InputError, match=message):
        structure(model, FOLD, clamped=clamped)
    # of the boundary alone: the ridge from 2 to 3 is a crease
    selected = structure(model, FOLD, clamped="x > 0.5").options.clamped
    assert selected == ((2, 4), (3, 5), (4, 5))


def test_a_case_file_selects_edges(read):
    text = f"""{HELD_MIURA_TEXT}[analysis]
kind = "statics"
[model]
"""
    plates = read(f'{text}scheme = "n5b8e"\nstraight = "xmin"').case()
    assert plates.structure.options.straight == ((0, 1), (1, 2))
    case = read(f'{text}clamped = "xmax"').case()
    assert case.structure.options.clamped == ((6, 7), (7, 8))
    with pytest.raises(InputError, match='clamped = "xmim": xmim is not known'):
        read(f'{text}clamped = "xmim"')
