"""Creases with a width, beside shells whose strips are meshed."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.linear import modes
from pairwise import beyond

SHEET = fd.Sheet(3e9, 0.3, 1e-3, 1200.0)
SIDE, WIDTH = 0.1, 4e-3
FILM = fd.Strip(WIDTH, thickness=2e-4)
FOLD = fd.patterns.simple_fold(a=SIDE, b=SIDE, dihedral=120)


def flat(strip: float) -> fd.Pattern:
    """Two panels and a crease, or a strip between them, welded to both."""
    x = [0.0, SIDE - 0.5 * strip, SIDE + 0.5 * strip, 2.0 * SIDE]
    x = x if strip else [x[0], SIDE, x[3]]
    n = len(x)
    points = [(a, b, 0.0) for b in (0.0, SIDE) for a in x]
    faces = [(k, k + 1, n + k + 1, n + k) for k in range(n - 1)]
    welds = [(1, n + 1), (2, n + 2)] if strip else []
    letters = {} if strip else {(1, n + 1): "V"}
    return fd.Pattern(points, faces, letters, welds=welds)


def test_a_strip_is_a_spring_less_what_the_panels_bend():
    bending, thin = SHEET.bending_modulus, SHEET.bending_modulus * 0.2**3
    per_length = 1.0 / (WIDTH / thin - WIDTH / bending)
    for structure in (
        fd.shell(FOLD, SHEET, divisions=2, crease_stiffness=FILM),
        fd.discretize(FOLD, SHEET, crease_stiffness={"mountain": FILM}, preset="n5b8e"),
        fd.superelements(FOLD, SHEET, crease_stiffness=FILM),
    ):
        np.testing.assert_allclose(structure.fold_stiffness, SIDE * per_length, rtol=1e-12)
    own = fd.Strip(WIDTH, 2e-4, youngs_modulus=1e9, poissons_ratio=0.4)
    soft = 1e9 * 2e-4**3 / 12.0 / (1.0 - 0.4**2)
    found = fd.shell(FOLD, SHEET, divisions=2, crease_stiffness=own).fold_stiffness
    np.testing.assert_allclose(found, SIDE / (WIDTH / soft - WIDTH / bending), rtol=1e-12)


@pytest.mark.matrix
@pytest.mark.parametrize("width", [2e-3, 5e-3, 1e-2])
def test_turns_and_frequencies_are_those_of_meshed_strips(width):
    """Turns within 3 %, the first frequency within 3 %, up to a tenth of the panel's side."""
    thin = 2e-4
    film = fd.Strip(width, thickness=thin)
    strip = fd.PanelSheet([1], thickness=thin)
    meshed = fd.Sheet(3e9, 0.3, 1e-3, 1200.0, panels=[strip])
    found = []
    for pattern, sheet, options in (
        (flat(0.0), SHEET, {"crease_stiffness": film}), (flat(width), meshed, {}),
    ):  # fmt: skip
        first = list(pattern.faces[0])
        structure = fd.shell(pattern, sheet, divisions=16, **options)
        held = [fd.Fix(first, "xyz", along=True), fd.Fix("xmin", "xyz", along=True)]
        tip = np.flatnonzero(pattern.vertices[:, 0] > 1.9 * SIDE).tolist()
        case = fd.Case(structure, held, [fd.Force(tip, (0.0, 0.0, 1e-6))])
        path = fd.trace(case, steps=1)
        low = path.displacement[-1].sel(node=tip, axis="z").values.mean()
        found.append((low, float(modes(case.altered(loads=()), count=1).frequency[0])))
    np.testing.assert_allclose(found[0], found[1], rtol=0.03)


def test_a_case_with_strips_is_stored_and_read(tmp_path):
    text = """
        [pattern]
        kind = "miura"
        [sheet]
        youngs_modulus = 3e9
        poissons_ratio = 0.3
        thickness = 0.01
        density = 1200
        [model]
        kind = "shell"
        divisions = 2
        crease_stiffness = { valley = { width = 0.05, thickness = 1e-3 }, mountain = 2.0 }
        [analysis]
        kind = "modes"
        count = 8
        """
    (tmp_path / "case.toml").write_text(text)
    made = fd.read_case(tmp_path / "case.toml")
    structure = made.case().structure
    assert structure.options.crease_stiffness == {
        "mountain": 2.0, "valley": fd.Strip(0.05, thickness=1e-3),
    }  # fmt: skip
    stored = fd.case_of(made.run()).structure
    assert stored.options.crease_stiffness == structure.options.crease_stiffness
    np.testing.assert_array_equal(stored.fold_stiffness, structure.fold_stiffness)
    one = text.replace("{ valley = { width = 0.05, thickness = 1e-3 }, mountain = 2.0 }",
                       "{ width = 0.05, thickness = 1e-3 }")  # fmt: skip
    (tmp_path / "case.toml").write_text(one)
    again = fd.read_case(tmp_path / "case.toml")
    assert again.case().structure.options.crease_stiffness == fd.Strip(0.05, thickness=1e-3)
    assert fd.case_of(again.run()).structure.options == again.case().structure.options


@pytest.mark.parametrize(
    ("strip", "message"),
    [
        (lambda: fd.Strip(0.2, 1e-4), r"crease_stiffness.width = 0.2: wider than a panel beside"),
        (lambda: fd.Strip(1e-3), "crease_stiffness: as stiff in bending as the panels, and no"),
        (lambda: fd.Strip(1e-3, youngs_modulus=1e12), "crease_stiffness: as stiff in bending"),
        (lambda: fd.Strip(0.0, 1e-4), "width = 0.0: must be greater than 0"),
        (lambda: {"valley": fd.Strip(1e-3, 1e-4)}, "valley"),
    ],
)
def test_impossible_strips_get_one_message(strip, message):
    with pytest.raises(InputError, match=message):
        fd.shell(FOLD, SHEET, divisions=2, crease_stiffness=strip())


def test_strips_between_plies_need_a_modulus():
    ply = fd.Ply(1e-3, (3e9, 1e9), 0.3, 1e9, density=1000.0)
    sheet = fd.Sheet(plies=[ply], direction=0.0)
    with pytest.raises(InputError, match="youngs_modulus: missing; the panels have plies"):
        fd.shell(FOLD, sheet, divisions=2, crease_stiffness=fd.Strip(1e-3, 1e-4))


@pytest.mark.parametrize("kind", ["shell", "n5b8e", *beyond(["superelements"])])
def test_stiff_flaps_on_a_heavy_strip(kind):
    """Two free flaps of mass m and length a fold about a strip with M more: a^2 w^2 is

    2 k / (m / 3 - m^2 / (2 M + 4 m)), with the stiffness k of the crease.
    """
    pattern, film = flat(0.0), fd.Strip(WIDTH, thickness=5e-5)
    structure = {
        "shell": lambda: fd.shell(
            pattern, SHEET, divisions=4, mass="consistent", crease_stiffness=film
        ),
        "superelements": lambda: fd.superelements(pattern, SHEET, crease_stiffness=film),
        "n5b8e": lambda: fd.discretize(pattern, SHEET, preset="n5b8e", crease_stiffness=film),
    }[kind]()
    flap = SHEET.areal_density * SIDE**2
    heavy = 2.0 * flap
    ends = pattern.creases[0].tolist()
    case = fd.Case(structure, masses=[fd.PointMass(ends, 0.5 * heavy)])
    assert float(case.mass.sum()) == pytest.approx(2.0 * flap + heavy, rel=1e-9)
    found = modes(case, count=8)
    first = found.frequency.values[~found.rigid.values.astype(bool)][0]
    inertia = SIDE**2 * (flap / 3.0 - flap**2 / (2.0 * heavy + 4.0 * flap))
    exact = np.sqrt(2.0 * structure.fold_stiffness[0] / inertia) / (2.0 * np.pi)
    assert first == pytest.approx(exact, rel=0.01)
