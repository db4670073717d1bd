"""Where panels that stretch hold much of the strain energy: that is told, once."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import StretchWarning
from foldyn.structures.stretching import stretch, stretching
from foldyn.studies import find_case
from verification.fidelity.compare import structure_of
from verification.fidelity.mixed import gaps
from verification.fidelity.references import read_references, stored

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
LINEAR = {"bar_law": "linear", "fold_law": "linear", "bend_law": "linear"}
MIURA = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
TOWER = fd.patterns.kresling(sides=6, radius=1.0, height=0.9, twist=30)
BASE = [fd.Fix("zmin")]
FOLDING = [fd.Fix([0, 1, 2], "x"), fd.Fix([1], "y"), fd.Fix([0, 2, 6, 8], "z")]


def told(compute) -> list[str]:
    """What is said of bars that stretch."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        compute()
    return [str(one.message) for one in caught if one.category is StretchWarning]


def held(pattern, supports, model=fd.discretize, loads=(), **options) -> fd.Case:
    options = options or {"mass": "circumcenter", "preset": "herkal", **LINEAR}
    return fd.Case(model(pattern, SHEET, **options), supports, loads, fd.Rayleigh(0.5))


def test_the_share_in_a_mode_is_that_of_its_energies():
    """Half the difference quotient of the energies of bars and of all, along the shape."""
    case = held(MIURA, FOLDING)
    found = fd.modes(case, 27)
    body, shapes = case.body, found["shape"].values
    bars = stretching(case.structure, 0.0 * shapes[0], shapes.reshape(len(shapes), -1).T)
    for shape, mine, value in zip(shapes, bars, found.eigenvalue.values, strict=True):
        step = 1e-7 / np.abs(shape).max()
        energies = body.energies(body.dofs(step * shape))
        assert 2.0 * energies.sum() / step**2 == pytest.approx(value, rel=1e-4)
        assert 2.0 * energies[0] / step**2 == pytest.approx(mine, rel=1e-3, abs=1e-6 * value)
    share = bars / found.eigenvalue.values
    assert share[:3].max() < 0.01 and share[-1] > 0.9


def test_modes():
    assert told(lambda: fd.modes(held(MIURA, FOLDING), 6)) == []
    (text,) = told(lambda: fd.modes(held(TOWER, BASE), 3))
    assert text.startswith(
        "panels that stretch hold more than 5% of the strain energy of modes 1 to 3 ("
    )
    assert "--model superelements" in text and "membrane" not in text
    assert told(lambda: fd.modes(held(TOWER, BASE, fd.shell, divisions=2), 3)) == []


def test_frequency_responses():
    first = fd.modes(held(MIURA, FOLDING), 1).frequency.values[0]
    f = first * np.linspace(0.5, 1.5, 41)
    push = fd.Force([7], (1.0, 0, 0))
    assert told(lambda: fd.frf(held(MIURA, FOLDING), push, frequencies=f)) == []
    tower = held(TOWER, BASE)
    f = fd.modes(tower, 1).frequency.values[0] * np.linspace(0.9, 1.1, 41)
    (text,) = told(lambda: fd.frf(tower, fd.Force([6], (0, 0, 1.0)), frequencies=f))
    assert text.startswith("panels that stretch hold more than 5% of the strain energy of the resp")
    assert float(text.split(" at ")[1].split()[0]) == pytest.approx(f[20], rel=0.02)


def test_paths_and_motions():
    push = [fd.Force([7], (0.01, 0, 0), fd.HalfSine(0.5))]
    case = held(MIURA, FOLDING, loads=push)
    assert told(lambda: fd.trace(case, "newton", load_factors=[0.0, 1.0])) == []
    assert told(lambda: fd.simulate(case, 0.5, method="rk4")) == []
    load = [fd.Force(list(range(6, 12)), (0, 0, -1e-3))]
    tower = held(TOWER, BASE, loads=load)
    (path,) = told(lambda: fd.trace(tower, "newton", load_factors=[0.0, 1.0]))
    start, _, remedy = path.partition("at point 1 (load factor 1), ")
    assert start == "panels that stretch hold 100% of the strain energy where that is largest, "
    (motion,) = told(lambda: fd.simulate(tower, 0.05, method="rk4"))
    assert re.fullmatch(rf"{start}at t = 0\.0\d+ s, {re.escape(remedy)}", motion)


@pytest.mark.matrix
def test_membranes():
    """Between two held edges `plate` is too stiff, which is told, and `n5b8e` right.

    The shell with a vertex radius of its thickness, held along these edges, has its first modes at
    38.8, 153.7 and 162.5 Hz (12 divisions). What is advised is not what the model has already.
    """
    pattern = fd.patterns.miura(cells=(3, 2), a=0.03, b=0.03, panel_angle=60, dihedral=100)
    sheet, held = fd.Sheet(3e9, 0.35, 2e-4, density=1200.0), [fd.Fix("xmin or xmax")]
    cases = {
        name: fd.Case(fd.discretize(pattern, sheet, preset=name, straight="xmin or xmax"), held)
        for name in ("plate", "n5b8e")
    }
    shell, errors = np.array([38.8, 153.7, 162.5]), {}
    for name, case in cases.items():
        errors[name] = fd.modes(case, 3).frequency.values / shell - 1.0
    assert abs(errors["plate"][0]) < 0.06 and errors["plate"][1:].min() > 0.12
    assert abs(errors["n5b8e"]).max() < 0.05
    (text,) = told(lambda: fd.modes(cases["plate"], 3))
    assert "of modes 2, 3 (" in text
    assert "edges that stay straight can be too stiff: take superelements" in text
    assert told(lambda: fd.modes(cases["n5b8e"], 3)) == []
    tower = fd.patterns.kresling(storeys=2)
    case = fd.Case(fd.discretize(tower, fd.Sheet(3e9, 0.35, 0.02, 1200.0), preset="n5b8e"), BASE)
    (text,) = told(lambda: fd.modes(case, 2))
    assert "closed and welded" in text and "membrane =" not in text and "preset" not in text
    load = [fd.Force(list(range(12, 18)), (0, 0, -1.0))]
    pressed = fd.Case(case.structure, BASE, load)
    assert len(told(lambda: fd.trace(pressed, "newton", load_factors=[0.0, 1.0]))) == 1


def test_panels_that_bend_in_their_plane_are_right():
    """Beside stored shells: told where panels stretch as a whole, and frequencies are 16 % off."""
    lines, cases = read_references("gaps"), {case.name: case for case in gaps()}
    for name, wrong in (("nearly flat, 176 degrees", ""), ("two edges held, 3 x 3 cells", "1, 2")):
        case = cases[name]
        held = case.case(structure_of(case, "plate, consistent"))
        found = fd.modes(held, 2)
        error = found.frequency.values / stored(case, lines[name]).frequency[:2] - 1.0
        shape = found["shape"].values[0]
        energies = held.body.energies(held.body.dofs(1e-6 * shape / np.abs(shape).max()))
        assert energies[0] > 0.7 * energies.sum()  # of stretching
        texts = told(lambda held=held: fd.modes(held, 2))
        assert [f"of modes {wrong} (" in text for text in texts] == [True] * bool(wrong)
        assert error.min() > 0.15 if wrong else abs(error).max() < 0.04


def test_mean_strains_of_a_sheet_that_is_stretched_and_turned():
    """Stretched by 1 % along x, contraction free or not, and turned: the energy of a membrane."""
    flat = fd.patterns.miura(cells=(1, 1), a=0.1, b=0.1, panel_angle=60, dihedral=179.99)
    sheet = fd.Sheet(1e9, 0.25, 1e-3, density=1000.0)
    s = fd.discretize(flat, sheet, preset="plate")
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    moved = (s.nodes * [1.01, 1.0, 1.0]) @ turn.T - s.nodes
    strain = 0.5 * (1.01**2 - 1.0)
    energy = 0.5 * 1e9 * 1e-3 / (1.0 - 0.25**2) * strain**2 * flat.face_areas.sum()
    groups = {"strain_bars": np.array([1.0]), "strain_folds": np.array([2.0 * energy - 1.0])}
    found = stretch(s, groups | {"strain_bends": np.zeros(1)}, moved[None])
    assert found is not None and found.share == pytest.approx(0.5, rel=1e-6)


@pytest.mark.parametrize(("name", "count"), [("kresling", 1), ("miura-bending", 0)])
def test_shipped_cases(name, count):
    assert len(told(lambda: fd.read_case(find_case(f"gallery/{name}")).run())) == count


def test_what_is_not_told():
    """Bars by hand, which are what they are; a body that hardly strains; nothing but rounding."""
    s = held(MIURA, FOLDING).structure
    bars, folds = np.array([0.0, 9.0]), np.array([0.0, 1.0])
    of = {"strain_bars": bars, "strain_folds": folds, "strain_bends": folds}
    still = np.zeros((2, len(s.nodes), 3))
    assert stretch(s, of, still) == (1, 9.0 / 11.0)
    assert stretch(s, of | {"kinetic": np.array([1e5])}, still) is None
    assert stretch(s, {name: 1e-20 * energy for name, energy in of.items()}, still) is None
    assert stretch(s, of | {"strain_bars": 0.01 * bars}, still) is None
    by_hand = fd.Structure(s.nodes, s.bars, s.bar_area, s.sheet)
    assert stretch(by_hand, of, still) is None
    turning = fd.State(0.0 * s.nodes, np.cross([0.0, 0.0, 1.0], s.nodes - s.nodes.mean(axis=0)))
    free = fd.Case(s)
    assert told(lambda: fd.simulate(free, 0.2, method="rk4", initial=turning)) == []
