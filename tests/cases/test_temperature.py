"""Temperature: free panels stretch and curl without stress, held ones push."""

from __future__ import annotations

import re
import tomllib
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.cases.loads import LOAD
from foldyn.checks import tangent_error
from foldyn.dynamics import prepare
from foldyn.errors import InputError
from foldyn.statics.equilibrium import OrigamiProblem
from pairwise import beyond
from sheets_with_facets import STEEL, cut_across, triangulated, with_lines

SHEET = fd.Sheet(1e9, 0.3, 4e-4, 1000.0)
WIDTH, COUNT = 0.05, 5
LAYERS = [(2e-4, 1e9, 1e-5), (2e-4, 2e9, 6e-5)]  # the one in front shrinks more


HELD = [fd.Fix([0], "xyz"), fd.Fix([1], "xz"), fd.Fix([2], "z")]  # no more than a rigid body needs


def strip(count: int = COUNT) -> fd.Pattern:
    """Square panels in a row along x, from the vertices 0 and 1 to the last two."""
    vertices = [[i * WIDTH, j * WIDTH, 0.0] for i in range(count + 1) for j in (0, 1)]
    return fd.Pattern(vertices, [[2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1] for i in range(count)])


def plates(pattern: fd.Pattern, **options) -> fd.Structure:
    """Panels that bend as plates and give way at their edges."""
    return fd.discretize(pattern, SHEET, preset="n5b8e", fold_law="linear", **options)


def models(pattern: fd.Pattern, straight=(), **options):
    bars = {"bend_law": "linear", "fold_law": "linear", "straight": straight}
    yield fd.discretize(pattern, SHEET, **bars, **options)
    yield fd.discretize(pattern, SHEET, scheme="n4b5", **bars, **options)
    yield fd.shell(pattern, SHEET, divisions=4, fold_law="linear", **options)
    if not straight:
        yield plates(pattern, **options)


def traced(structure, load: fd.Temperature, supports=HELD, factors=(0.0, 1.0), **options):
    case = fd.Case(structure, supports, [load], **options)
    return fd.trace(case, "newton", load_factors=list(factors))


def off_the_paraboloid(structure: fd.Structure, load: fd.Temperature, kappa: float) -> float:
    """Largest error of the lift kappa r^2 / 2 where it is free, over the largest lift."""
    x = structure.nodes
    corners = [int(np.argmax(x[:, :2] @ way)) for way in ([-1, -1], [1, -1], [-1, 1])]
    held = [fd.Fix([k], axes) for k, axes in zip(corners, ("xyz", "yz", "z"), strict=True)]
    path = traced(structure, load, held)
    lift = 0.5 * kappa * (x[:, :2] ** 2).sum(axis=1)
    flat = np.c_[np.ones(len(x)), x[:, :2]]
    lift -= flat @ np.linalg.solve(flat[corners], lift[corners])
    assert np.abs(path.reaction[-1]).max() < 1e-6
    return float(np.abs(path.displacement.values[-1, :, 2] - lift).max() / np.abs(lift).max())


@pytest.mark.matrix
def test_a_free_strip_expands_without_stress() -> None:
    for structure in models(strip()):
        path = traced(structure, fd.Temperature(30.0, expansion=1e-4), factors=(0.0, 0.5, 1.0))
        expected = 3e-3 * (structure.nodes - structure.nodes[0])
        np.testing.assert_allclose(path.displacement[-1], expected, atol=1e-9)
        half = path.displacement[1].values
        np.testing.assert_allclose(half, 0.5 * expected, atol=3e-3 * np.abs(expected).max())
        assert np.abs(path.reaction).max() < 1e-8


def stored(result, structure) -> np.ndarray:
    return np.sum([result[group].values for group in structure.energy_groups], axis=0)


@pytest.mark.matrix
def test_free_panels_store_nothing() -> None:
    """Whatever causes the strain: two loads on the same panels act as one."""
    cause = [fd.Temperature(12.0, 2e-4, 3e-4), fd.Temperature(4.0, 1e-4, -2e-4)]
    for structure in models(strip(3)):
        path = fd.trace(fd.Case(structure, HELD, cause), load_factors=[0.0, 0.4, 1.0])
        whole = structure.body.energies(structure.body.dofs(path.displacement.values[-1])).sum()
        assert whole > 1e-4
        assert np.abs(stored(path, structure)).max() < 1e-9 * whole
        assert np.abs(path.work).max() < 1e-8 * whole


def test_panels_that_may_not_expand_store_what_they_may_not() -> None:
    """E A L (alpha T)^2 / 2 between rigid ends, and the work along the path is just that."""
    strain, length = 3e-7, COUNT * WIDTH
    ends = [0, 1, 2 * COUNT, 2 * COUNT + 1]
    supports = [fd.Fix(ends, "x"), fd.Fix([0, 2 * COUNT], "yz"), fd.Fix([1], "z")]
    expected = 0.5 * SHEET.youngs_modulus * SHEET.thickness * WIDTH * length * strain**2
    straight = [(0, 1), (2 * COUNT, 2 * COUNT + 1)]
    for structure in islice(models(strip(), straight=straight), 2):
        path = traced(structure, fd.Temperature(0.03, expansion=1e-5), supports)
        assert float(path.strain_bars[-1]) == pytest.approx(expected, rel=1e-3)
        assert float(path.work[-1]) == pytest.approx(expected, rel=1e-3)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_warm_panels_among_cold_ones_balance() -> None:
    """Work is stored energy: by one panel that expands, one that curls, and a force."""
    pattern = fd.patterns.miura(cells=(1, 1), a=0.05, b=0.04, panel_angle=70, dihedral=110)
    loads = [
        fd.Temperature(2.0, expansion=1e-3, panels=[0]),
        fd.Temperature(-1.0, expansion=5e-4, curvature=0.3, panels=[0, 1]),
        fd.Force([8], (0.0, 0.0, 1e-4)),
    ]
    for structure in models(pattern):
        case = fd.Case(structure, [fd.Fix("xmin")], loads)
        path = fd.trace(case, steps=12)
        energy = stored(path, structure)
        assert energy[-1] > 1e-6 and energy.min() >= -1e-15
        np.testing.assert_allclose(path.work, energy, rtol=0.03, atol=0.01 * energy[-1])


def test_a_free_strip_curls_to_an_arc() -> None:
    """w = kappa (x^2 + y^2) / 2, and nothing strains; the second model's error is of order 2."""
    load = fd.Temperature(10.0, curvature=1e-4)
    errors = [off_the_paraboloid(structure, load, 1e-3) for structure in models(strip())]
    assert max(errors) < 1e-3 and errors[-1] < 1e-5


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
@pytest.mark.parametrize(
    "cut",
    [
        cut_across([0.25, 0.5, 0.75]),
        with_lines([(0, 0.5), (1, 0.5)]),
        with_lines([(0.35, 0), (0.55, 1)]),
        triangulated(6, seed=1),
    ],
)
def test_panels_that_are_welded_curl_as_one(cut) -> None:
    structure = fd.discretize(fd.welded(cut), STEEL)
    assert structure.edge_plates is not None
    assert off_the_paraboloid(structure, fd.Temperature(1.0, curvature=1e-5), 1e-5) < 1e-5


@pytest.mark.matrix
@pytest.mark.parametrize("crease", [0.02, 2.0])
def test_creases_of_a_folded_sheet_stay_straight_as_in_the_shell(crease) -> None:
    """Where they hold back the curl; schemes without edge angles do not know of that."""
    pattern, load = (
        fd.patterns.simple_fold(0.05, 0.05, dihedral=120),
        fd.Temperature(1.0, curvature=1e-2),
    )
    options = {"fold_law": "linear", "crease_stiffness": crease}
    found, shell = (
        traced(structure, load).displacement.values[-1, : len(pattern.vertices)]
        for structure in (
            fd.discretize(pattern, SHEET, preset="n5b8e", **options),
            fd.shell(pattern, SHEET, divisions=16, **options),
        )
    )
    assert np.abs(found - shell).max() < 0.01 * np.abs(shell).max()


def test_rigid_panels_do_not_curl() -> None:
    path = traced(plates(strip(2), rigid=[0]), fd.Temperature(10.0, curvature=1e-4))
    corners = path.displacement.values[-1, [0, 1, 2, 3], 2]
    assert np.abs(corners).max() < 1e-6 * np.abs(path.displacement[-1]).max()


@pytest.mark.matrix
def test_a_bilayer_bends_as_timoshenko_says() -> None:
    """J. Opt. Soc. Am. 11, 1925, equation 4, for layers as thick as each other.

    Free it has the curvature kappa, clamped the tip deflection kappa L^2 / 2: the clamp keeps
    plates from curling across it, which adds nu times the curvature along.
    """
    kappa, length = 24 * 5e-5 * 0.05 / (4e-4 * (14 + 2 + 1 / 2)), COUNT * WIDTH
    load = fd.Temperature(-0.05, layers=LAYERS)
    assert kappa == pytest.approx(-0.05 * fd.Laminate(LAYERS).curvature)
    assert off_the_paraboloid(plates(strip()), load, kappa) < 2e-4
    tips = [
        traced(s, load, [fd.Fix([0, 1])]).displacement.values[-1, 2 * COUNT, 2]
        for s in models(strip(), clamped=[(0, 1)], crease_stiffness=1e3)
    ]
    bars, other, *plate = np.array(tips) / (0.5 * kappa * length**2)
    assert [bars, other] == pytest.approx([1.0, 1.0], abs=5e-3)
    assert min(plate) > 1.0 and max(plate) < 1.08


def test_a_held_strip_pushes() -> None:
    """E A alpha T of a strip whose sides are free and whose ends are held along their length.

    The shell is held at its corners alone, and so are panels whose ends may bow.
    """
    ends = [0, 1, 2 * COUNT, 2 * COUNT + 1]
    supports = [fd.Fix(ends, "x"), fd.Fix([0, 2 * COUNT], "yz"), fd.Fix([1], "z")]
    force = SHEET.youngs_modulus * SHEET.thickness * WIDTH * 1e-7  # ten times that buckles it

    def pushes(structure) -> float:
        path = traced(structure, fd.Temperature(0.01, expansion=1e-5), supports)
        mine = path.support_node.isin([0, 1]) & (path.support_axis == "x")
        return float(path.reaction[-1][mine].sum())

    *bars, shell = map(pushes, models(strip(), straight=[(0, 1), (2 * COUNT, 2 * COUNT + 1)]))
    np.testing.assert_allclose(bars, force, rtol=1e-4)
    assert 0.7 * force < shell < force
    bars = [pushes(structure) for structure in islice(models(strip()), 2)]
    np.testing.assert_allclose(bars, 0.7 * force, rtol=0.05)


def test_one_warm_panel_of_two_bends_the_strip_nowhere_else() -> None:
    load = fd.Temperature(10.0, curvature=1e-4, panels=[0])
    structure = next(models(strip(2)))
    case = fd.Case(structure, HELD, [load])
    ((turns, _),) = case.rest_terms
    folds, bends = turns[: len(structure.folds)], turns[len(structure.folds) :]
    assert folds[0] == pytest.approx(0.0, abs=1e-12)  # h = s = L / 2: the chord is the tangent
    assert np.count_nonzero(bends) == 4


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("model", "method"),
    [
        (0, "rk4"),
        (3, "generalized_alpha"),
        *beyond([(0, "generalized_alpha"), (2, "generalized_alpha")]),
    ],
)
def test_motion_by_heat_ends_where_statics_ends_and_audits(model: int, method: str) -> None:
    """Bars and hinges, a shell, and panels as plates."""
    structure = [*models(strip(1 if model == 2 else 2))][model]
    load = fd.Temperature(20.0, 1e-5, 2e-3, history=fd.Ramp(0.02))
    case = fd.Case(structure, HELD, [load], fd.Rayleigh(alpha=60.0))
    motion = fd.simulate(case, 0.4, method=method, interval=0.02)
    end = fd.trace(case, "newton", load_factors=[0.0, 1.0]).displacement.values[-1]
    np.testing.assert_allclose(motion.displacement[-1], end, atol=1e-3 * np.abs(end).max())
    assert abs(motion.attrs["energy_error"]) < 1e-4
    whole = structure.body.energies(structure.body.dofs(end)).sum()
    assert np.abs(stored(motion, structure)).max() < 1e-3 * whole  # but for the waves of it
    given = motion.work - motion.dissipated - motion.kinetic - stored(motion, structure)
    assert np.abs(given).max() < 1e-4 * whole
    assert float(motion.work[0]) == 0.0


def test_a_motion_in_the_heat_does_no_work() -> None:
    """It starts warm, so that all that it has is the energy of its vibration."""
    structure = next(models(strip(2)))
    case = fd.Case(structure, HELD, [fd.Temperature(20.0, 1e-4, 2e-3)])
    end = fd.trace(case, load_factors=[1.0]).displacement.values[-1]
    aside = end + 1e-6 * np.sin(np.arange(end.size)).reshape(end.shape)
    aside[[0, 1, 2]] = end[[0, 1, 2]]
    start = fd.State(displacement=aside)
    motion = fd.simulate(
        case, 1e-3, method="energy_momentum", dt=1e-5, interval=1e-4, initial=start
    )
    energy = stored(motion, structure) + motion.kinetic.values
    assert energy[0] > 0.0
    np.testing.assert_allclose(energy, energy[0], rtol=1e-3)
    assert np.abs(motion.work).max() < 1e-3 * energy[0]


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")  # energies are rounding
@pytest.mark.parametrize("cut", [None, cut_across([0.25, 0.5])], ids=["creased", "welded"])
def test_explicit_methods_stay_where_it_has_curled(cut) -> None:
    """With edge angles in balance: the state that statics find is one of equilibrium."""
    structure = plates(strip(2) if cut is None else fd.welded(cut), mass="consistent")
    n = len(structure.pattern.vertices)
    held = (
        HELD
        if cut is None
        else [fd.Fix([0], "xyz"), fd.Fix([n // 2 - 1], "yz"), fd.Fix([n // 2], "z")]
    )
    case = fd.Case(structure, held, [fd.Temperature(1.0, 1e-5, 1e-3)])
    end = fd.trace(case, load_factors=[0.0, 1.0]).displacement.values[-1]
    motion = prepare(case, 1e-4, "rk4", initial=fd.State(displacement=end))
    moved = motion.samples().displacement - end
    np.testing.assert_allclose(moved, 0.0, atol=1e-6 * np.abs(end).max())


def test_the_tangent_of_a_warm_strip_is_exact() -> None:
    for structure in models(strip(1), clamped=[(0, 1)]):
        case = fd.Case(structure, [fd.Fix([0, 1])], [fd.Temperature(20.0, 1e-4, 0.02)])
        problem = OrigamiProblem(case)
        residual, tangent = (partial(of, factor=1.0) for of in (problem.residual, problem.tangent))
        start = problem.start()
        start = start + 1e-4 * np.random.default_rng(0).standard_normal(len(start))
        assert tangent_error(residual, tangent, at=start) < 1e-6


def test_a_case_with_layers_survives_a_file(kept) -> None:
    load = fd.Temperature(5.0, layers=LAYERS, panels=[0, 2])
    assert kept(traced(next(models(strip())), load)).loads == (load,)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"change": 10.0}, "expansion: give expansion"),
        ({"change": np.nan, "expansion": 1e-5}, "change = nan"),
        ({"change": 10.0, "expansion": 0.1}, "change = 10: a free strain of 1;"),
        ({"change": 10.0, "curvature": "x"}, "curvature = "),
        ({"change": 1.0, "expansion": 1.0e-5, "layers": [(1e-3, 1e9, 0.0)]}, "the layers give the"),
        ({"change": 1.0, "layers": [(1e-3, 1e9)]}, r"layers\[0\]"),
        ({"change": 1.0, "expansion": 1e-5, "panels": "some"}, 'panels = "some": give panel'),
        ({"change": 1.0, "expansion": 1e-5, "panels": 9}, r"\[0\].panels = \[9\]: panel 9 is out"),
    ],
)
def test_wrong_temperatures_are_named(arguments, message) -> None:
    with pytest.raises(InputError, match=message):
        fd.Case(next(models(strip())), HELD, [fd.Temperature(**arguments)])


def test_the_code_of_the_page_runs() -> None:
    page = Path(__file__).resolve().parents[2] / "docs" / "loads.md"
    first, _, block = re.findall(r"^```python\n(.*?)^```$", page.read_text("utf-8"), re.M | re.S)
    names: dict = {}
    exec(compile(first + block, "loads.md", "exec"), names)
    end = fd.trace(names["case"], "newton", load_factors=[0.0, 1.0])["displacement"][-1].values
    assert np.abs(end).max() > 1e-4
    table = re.search(r"^```toml\n(.*?)^```$", page.read_text("utf-8"), re.M | re.S)
    assert table
    (load,) = tomllib.loads(table[1])["loads"]
    assert LOAD("", load).layers == names["bimetal"].layers
