"""Temperature: free panels stretch and curl without stress, held ones push."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.cases.loads import load_from
from foldyn.checks import tangent_error
from foldyn.errors import InputError

SHEET = fd.Sheet(1e9, 0.3, 4e-4, 1000.0)
WIDTH, COUNT = 0.05, 5


def strip(count: int = COUNT) -> fd.Pattern:
    """Square panels in a row along x, from the vertices 0 and 1 to the last two."""
    vertices = [[i * WIDTH, j * WIDTH, 0.0] for i in range(count + 1) for j in (0, 1)]
    return fd.Pattern(vertices, [[2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1] for i in range(count)])


def models(pattern: fd.Pattern, straight=(), **options):
    bars = {"bend_law": "linear", "fold_law": "linear", "straight": straight}
    yield fd.discretize(pattern, SHEET, **bars, **options)
    yield fd.discretize(pattern, SHEET, scheme="n4b5", **bars, **options)
    yield fd.shell(pattern, SHEET, divisions=4, fold_law="linear", **options)


HELD = [fd.Fix([0], "xyz"), fd.Fix([1], "xz"), fd.Fix([2], "z")]  # no more than a rigid body needs


def paths(load: fd.Temperature, supports=HELD, factors=(0.0, 0.5, 1.0), **options):
    for structure in models(strip(), **options):
        case = fd.Case(structure, supports, [load])
        yield structure, fd.trace(case, "newton", load_factors=list(factors))


def test_a_free_strip_expands_without_stress() -> None:
    for structure, path in paths(fd.Temperature(30.0, expansion=1e-4)):
        expected = 3e-3 * (structure.nodes - structure.nodes[0])
        np.testing.assert_allclose(path["displacement"][-1], expected, atol=1e-9)
        half = path["displacement"][1].values
        np.testing.assert_allclose(half, 0.5 * expected, atol=3e-3 * np.abs(expected).max())
        assert np.abs(path["reaction"]).max() < 1e-8


def test_a_free_strip_curls_to_an_arc() -> None:
    """w = kappa (x^2 + y^2) / 2, and nothing strains; the second model's error is of order 2."""
    kappa = 1e-3
    for structure, path in paths(fd.Temperature(10.0, curvature=0.1 * kappa)):
        x = structure.nodes
        lift = 0.5 * kappa * ((x[:, 0] ** 2) + (x[:, 1] ** 2))
        corners = np.array([0, 1, 2])
        plane = np.linalg.solve(np.c_[np.ones(3), x[corners, :2]], lift[corners])
        expected = lift - np.c_[np.ones(len(x)), x[:, :2]] @ plane
        found = path["displacement"][-1, :, 2].values
        np.testing.assert_allclose(found, expected, atol=1e-3 * np.abs(expected).max())


def test_a_clamped_bilayer_bends_by_half_kappa_length_squared() -> None:
    """Timoshenko, J. Opt. Soc. Am. 11, 1925: tip deflection kappa L^2 / 2.

    The clamp keeps the shell from curling across it, which adds nu times its curvature along.
    """
    layers = [(2e-4, 1e9, 1e-5), (2e-4, 2e9, 6e-5)]
    kappa, length = -0.05 * fd.Laminate(layers).curvature, COUNT * WIDTH
    load = fd.Temperature(-0.05, layers=layers)
    tips = [
        float(path["displacement"][-1, 2 * COUNT, 2])
        for _, path in paths(load, [fd.Fix([0, 1])], clamped=[(0, 1)], crease_stiffness=1e3)
    ]
    bars, other, shell = np.array(tips) / (0.5 * kappa * length**2)
    assert kappa > 0.0  # cooled, the layer in front shrinks more: towards the front
    assert bars == pytest.approx(1.0, abs=5e-3)
    assert other == pytest.approx(1.0, abs=5e-3)
    assert 1.0 < shell < 1.08


def test_a_held_strip_pushes() -> None:
    """E A alpha T of a strip whose sides are free and whose ends are held along their length.

    The shell is held at its corners alone, and so are panels whose ends may bow.
    """
    ends = [0, 1, 2 * COUNT, 2 * COUNT + 1]
    supports = [fd.Fix(ends, "x"), fd.Fix([0, 2 * COUNT], "yz"), fd.Fix([1], "z")]
    force = SHEET.youngs_modulus * SHEET.thickness * WIDTH * 1e-7  # ten times that buckles it
    found = [
        float(path["reaction"][-1].values[np.isin(path["support_node"], [0, 1])
              & (path["support_axis"].values == "x")].sum())
        for straight in ([(0, 1), (2 * COUNT, 2 * COUNT + 1)], ())
        for _, path in paths(
            fd.Temperature(0.01, expansion=1e-5), supports, (0.0, 1.0), straight=straight
        )
    ]  # fmt: skip
    np.testing.assert_allclose(found[:2], force, rtol=1e-4)
    assert 0.7 * force < found[2] < force
    np.testing.assert_allclose(found[3:5], 0.7 * force, rtol=0.05)


def test_one_warm_panel_of_two_bends_the_strip_nowhere_else() -> None:
    load = fd.Temperature(10.0, curvature=1e-4, panels=[0])
    structure = next(models(strip(2)))
    case = fd.Case(structure, HELD, [load])
    ((turns, _),) = case.rest_terms
    folds, bends = turns[: len(structure.folds)], turns[len(structure.folds) :]
    assert folds[0] == pytest.approx(0.0, abs=1e-12)  # h = s = L / 2: the chord is the tangent
    assert np.count_nonzero(bends) == 4


@pytest.mark.parametrize("method", ["rk4", "generalized_alpha"])
def test_motion_by_heat_ends_where_statics_ends_and_audits(method: str) -> None:
    structure = next(models(strip(2)))
    history = fd.Ramp(0.02)
    load = fd.Temperature(20.0, 1e-5, 2e-3, history=history)
    case = fd.Case(structure, HELD, [load], fd.Rayleigh(alpha=60.0))
    motion = fd.simulate(case, 0.4, method, every=0.02)
    path = fd.trace(case, "newton", load_factors=[0.0, 1.0])
    end = path["displacement"][-1].values
    np.testing.assert_allclose(
        motion["displacement"][-1], end, atol=1e-3 * np.abs(end).max()
    )  # fmt: skip
    assert abs(motion.attrs["energy_error"]) < 1e-4


def test_the_shell_moves_by_heat_too() -> None:
    *_, shell = models(strip(1))
    load = fd.Temperature(20.0, 1e-5, 2e-3, history=fd.Ramp(0.02))
    case = fd.Case(shell, HELD, [load], fd.Rayleigh(alpha=60.0))
    motion = fd.simulate(case, 0.3, "generalized_alpha", every=0.02)
    end = fd.trace(case, "newton", load_factors=[0.0, 1.0])["displacement"][-1].values
    np.testing.assert_allclose(motion["displacement"][-1], end, atol=2e-3 * np.abs(end).max())


def test_the_tangent_of_a_warm_strip_is_exact() -> None:
    from foldyn.statics.equilibrium import OrigamiProblem

    for structure in models(strip(1), clamped=[(0, 1)]):
        case = fd.Case(structure, [fd.Fix([0, 1])], [fd.Temperature(20.0, 1e-4, 0.02)])
        problem = OrigamiProblem(case)
        start = problem.start() + 1e-3 * np.random.default_rng(0).standard_normal(
            len(problem.start())
        )
        error = tangent_error(
            lambda q, p=problem: p.residual(q, 1.0), lambda q, p=problem: p.tangent(q, 1.0), start
        )
        assert error < 1e-6


def test_a_case_with_layers_survives_a_file(tmp_path) -> None:
    load = fd.Temperature(5.0, layers=[(2e-4, 1e9, 1e-5), (2e-4, 2e9, 6e-5)], panels=[0, 2])
    path = fd.trace(fd.Case(next(models(strip())), HELD, [load]), "newton", load_factors=[0.0, 1.0])
    fd.save(path, tmp_path / "warm.nc")
    (read,) = fd.case_of(fd.load(tmp_path / "warm.nc")).loads
    assert read == load


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
    ],
)
def test_wrong_temperatures_are_named(arguments, message) -> None:
    with pytest.raises(InputError, match=message):
        fd.Temperature(**arguments)


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
    assert load_from(load).layers == names["bimetal"].layers


def test_a_panel_that_is_not_there() -> None:
    with pytest.raises(InputError, match=r"loads\[0\].panels = \[9\]: panel 9 is out of range"):
        fd.Case(next(models(strip())), HELD, [fd.Temperature(1.0, 1e-5, panels=9)])
