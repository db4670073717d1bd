"""Sheets that expand by different amounts along their fibers and across."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from case_texts import SHELL_MODES
from foldyn.errors import InputError
from foldyn.mechanics.triangle import turned_axes, turned_strain
from foldyn.structures.ply import expansion
from pairwise import beyond

FIBERS = {"youngs_modulus": (14e9, 1e9), "poissons_ratio": 0.3, "shear_modulus": 6e8}
ALONG, ACROSS, CHANGE = -1e-6, 3e-5, -0.5  # cold: warm sheets that are held buckle
SIZE = abs(CHANGE) * ACROSS
T = 1e-3
HELD = [fd.Fix([0], "xyz"), fd.Fix([1], "yz"), fd.Fix([4], "z")]
DIRECTIONS = [(1.0, 0.0, 0.0), (np.cos(0.5), np.sin(0.5), 0.0), (0.0, 1.0, 0.0)]
PATTERN = fd.Pattern(
    [(0, 0, 0), (0.2, 0, 0), (0.5, 0, 0), (0.5, 0.3, 0), (0.25, 0.3, 0), (0, 0.3, 0)],
    [(0, 1, 4, 5), (1, 2, 3, 4)],
)
MODELS = {
    "shell": lambda sheet, **own: fd.shell(PATTERN, sheet, divisions=4, fold_law="linear", **own),
    "superelements": lambda sheet, **own: fd.superelements(
        PATTERN, sheet, fold_law="linear", level=1, divisions=8, **own
    ),
}
each_model = pytest.mark.parametrize("model", MODELS)


def woven(direction, **others):
    return fd.Sheet(**FIBERS, thickness=T, density=1000.0, direction=direction, **others)


def laminate(*angles, direction=DIRECTIONS[1], **others):
    warm = {"expansion": (ALONG, ACROSS), "density": 1e3, **others}
    half = [fd.Ply(0.5 * T / len(angles), angle=own, **FIBERS, **warm) for own in angles]
    return fd.Sheet(plies=[*half, *half[::-1]], direction=direction)


def tensor(direction, first=ALONG, second=ACROSS):
    along, across = np.array(direction), np.cross((0, 0, 1), direction)
    return CHANGE * (first * np.outer(along, along) + second * np.outer(across, across))


def warmed(structure, load, supports=HELD):
    return fd.trace(fd.Case(structure, supports, [load]), "newton", load_factors=[0.0, 1.0])


@pytest.mark.parametrize("direction", [DIRECTIONS[1], *beyond((way,) for way in DIRECTIONS[::2])])
@each_model
def test_a_free_sheet_grows_without_stress(model, direction):
    structure = MODELS[model](woven(direction))
    path = warmed(structure, fd.Temperature(CHANGE, expansion=(ALONG, ACROSS)))
    grown = structure.nodes @ tensor(direction)
    turned = grown[1, 1] / structure.nodes[1, 0]  # node 1 stays on the x axis
    grown -= turned * structure.nodes @ [[0, 1, 0], [-1, 0, 0], [0, 0, 0]]
    np.testing.assert_allclose(path.displacement[-1], grown, atol=1e-5 * SIZE)
    force = fd.stresses(path).membrane_force[-1]
    assert np.abs(force).max() < 1e-4 * SIZE * FIBERS["youngs_modulus"][1] * T


@each_model
def test_a_held_sheet_is_pushed_by_its_stiffness(model):
    """N = -A alpha dT, and the energy is half of N times the strain."""
    direction, angle = DIRECTIONS[1], 0.5
    sheet = woven(direction)
    structure = MODELS[model](sheet)
    edges = structure.edge_nodes if model == "shell" else structure.pattern.lines
    held = fd.Fix(np.unique(edges), along=model == "superelements")
    path = warmed(structure, fd.Temperature(CHANGE, expansion=(ALONG, ACROSS)), [held])
    free = turned_strain(-angle) @ [CHANGE * ALONG, CHANGE * ACROSS, 0.0]
    push = -turned_axes(sheet.stretching, angle) @ free
    found = fd.stresses(path)
    force = found.membrane_force[-1].values  # first edges are along x
    even = np.tile(push, (len(force), 1))[found.point_place != "corner"]  # corners are rigid
    np.testing.assert_allclose(force[found.point_place != "corner"], even, rtol=2e-3)
    stored = sum(float(path[name][-1]) for name in structure.energy_groups)
    assert stored == pytest.approx(-0.5 * 0.15 * push @ free, rel=5e-3)


@each_model
def test_two_equal_numbers_are_one(model):
    structure = MODELS[model](woven(DIRECTIONS[1]))
    held = [fd.Fix([0, 5]), fd.Fix([2, 3], "z")]
    one, two = (
        warmed(structure, fd.Temperature(CHANGE, expansion=own, curvature=1e-3), held)
        for own in (ACROSS, (ACROSS, ACROSS))
    )
    a, b = one.displacement.values, two.displacement.values
    np.testing.assert_allclose(a, b, atol=1e-12 * np.abs(a).max(), rtol=0)


def test_laminates_expand_by_lamination_theory():
    """Along a cross-ply, sum Q alpha over sum Q; a single ply is itself, turned or not."""
    nu, (stiff, soft) = FIBERS["poissons_ratio"], FIBERS["youngs_modulus"]
    both = nu * soft
    cross = ((stiff + both) * ALONG + (both + soft) * ACROSS) / (stiff + 2.0 * both + soft)
    found = {angles: expansion(laminate(*angles).plies) for angles in [(0, 90), (30,), (45, -45)]}
    np.testing.assert_allclose(found[0, 90], [cross, cross, 0.0], rtol=1e-12, atol=1e-19)
    alone = turned_strain(-np.radians(30.0)) @ [ALONG, ACROSS, 0.0]
    np.testing.assert_allclose(found[(30,)], alone, rtol=1e-12)
    np.testing.assert_allclose(found[45, -45], [cross, cross, 0.0], rtol=1e-12, atol=1e-19)


@pytest.mark.parametrize("angles", [(20, 65), *beyond([((0,),), ((0, 90),)])])
@each_model
def test_laminates_grow_as_their_plies_want(model, angles):
    """As a sheet with the expansion of the whole along the axes where it has no shear."""
    structure = MODELS[model](laminate(*angles))
    path = warmed(structure, fd.Temperature(CHANGE, expansion="plies"))
    x, y = PATTERN.vertices[2, :2], PATTERN.vertices[5, :2]
    xx, yy, xy = CHANGE * turned_strain(-0.5) @ expansion(structure.sheet.plies)
    moved = path.displacement[-1].values
    assert moved[2, 0] == pytest.approx(xx * x[0], abs=1e-5 * SIZE)
    assert moved[5, 1] == pytest.approx(yy * y[1], abs=1e-5 * SIZE)
    assert moved[5, 0] == pytest.approx(xy * y[1], abs=1e-5 * SIZE)
    force = fd.stresses(path).membrane_force[-1]
    assert np.abs(force).max() < 1e-4 * SIZE * FIBERS["youngs_modulus"][1] * T


ISOTROPIC = fd.Sheet(1e9, 0.3, T, 1000.0)


@pytest.mark.parametrize(
    ("sheet", "given", "message"),
    [
        (ISOTROPIC, (1e-5, 2e-5), r"loads\[0\].expansion: panel 0 is isotropic"),
        (ISOTROPIC, "plies", r"loads\[0\].expansion: panel 0 has no plies"),
        (laminate(0, expansion=None), "plies", "has no plies with an expansion"),
        (laminate(0, expansion=(1.0, 0.0)), "plies", "a free strain of 0.385"),
        (woven(DIRECTIONS[0]), (1e-5, 2.0), "a free strain of 1"),
        (woven(DIRECTIONS[0]), (1e-5, 2e-5, 0.0), "must be one number .1/K., or two"),
        (woven(DIRECTIONS[0]), "fibers", "expansion = "),
    ],
)
def test_expansions_that_a_sheet_cannot_have_are_named(sheet, given, message):
    with pytest.raises(InputError, match=message):
        warmed(MODELS["shell"](sheet), fd.Temperature(CHANGE, expansion=given))


def test_panels_of_other_sheets_keep_theirs():
    """Panel 1 is isotropic and stays cold; panel 0 grows."""
    plain = fd.PanelSheet([1], 1e9, 0.3, shear_modulus=None, direction=None)
    with pytest.raises(InputError, match="panel 1 is isotropic"):
        warmed(
            MODELS["shell"](woven(DIRECTIONS[0], panels=[plain])), fd.Temperature(1.0, (1e-5, 0.0))
        )


def test_margins_do_not_know_what_plies_do_to_each_other():
    sheet = laminate(0, 90, strength=(1e8, 1e8, 1e7, 1e7, 1e7))
    for given, known in ((1e-5, True), ("plies", False), ((1e-5, 2e-5), False)):
        load = fd.Temperature(CHANGE, expansion=given)
        path = warmed(MODELS["shell"](sheet), load, [fd.Fix([0, 5]), fd.Fix([2, 3])])
        if known:
            assert fd.margins(path).attrs["least_margin"] > 0.0
        else:
            with pytest.raises(InputError, match="plies that expand by different amounts"):
                fd.margins(path)


@pytest.mark.parametrize("given", ["[-1e-6, 3e-5]", '"plies"'])
def test_case_files_have_expansions(tmp_path, given):
    text = f"""{SHELL_MODES.replace('"modes"', '"statics"').replace("count", "steps")}
        [sheet]
        direction = 0
        [[sheet.plies]]
        thickness = 1e-3
        youngs_modulus = [14e9, 1e9]
        poissons_ratio = 0.3
        shear_modulus = 6e8
        expansion = [-1e-6, 3e-5]
        [[supports]]
        nodes = [0, 1]
        axes = "z"
        [[loads]]
        temperature = -0.5
        expansion = {given}
        """
    (tmp_path / "case.toml").write_text(text)
    made = fd.read_case(tmp_path / "case.toml")
    path = made.run()
    again = fd.case_of(path)
    assert again.loads == made.case().loads
    assert again.structure.sheet.plies[0].expansion == (ALONG, ACROSS)
    twice = fd.Temperature(CHANGE, expansion=(ALONG, ACROSS))
    same = fd.trace(made.case().altered(loads=[twice]), steps=2)
    a, b = same.displacement.values[-1], path.displacement.values[-1]
    np.testing.assert_allclose(a, b, atol=1e-9 * np.abs(a).max())
    assert np.abs(a).max() > 0.01 * SIZE
