"""Panels that differ from the rest of the sheet: stiffness, mass, and how they are stored."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

import foldyn as fd
from case_texts import MIURA_TEXT
from foldyn.analyses.provenance import provenance
from foldyn.errors import InputError
from foldyn.plots.scene import Sheet3D
from foldyn.structures import MASS_RULES

E, NU, T, RHO = 2e9, 0.3, 1e-3, 1200.0
SHEET = fd.Sheet(E, NU, T, RHO, length_scale_ratio=2.0)
OTHER = fd.PanelSheet([1], youngs_modulus=7e9, poissons_ratio=0.2, thickness=2e-3, density=2700.0)
ALONE = fd.Sheet(7e9, 0.2, 2e-3, 2700.0, length_scale_ratio=2.0)  # what panel 1 is made of
MIXED = replace(SHEET, panels=[OTHER])
PAIR = fd.Pattern([(0, 0), (1, 0), (2.2, 0), (0, 0.8), (1, 0.8), (2.2, 0.8)],
                  [(0, 1, 4, 3), (1, 2, 5, 4)])  # fmt: skip
MIURA = fd.patterns.miura((2, 1), 0.03, b=0.02, panel_angle=65, dihedral=80)


def make(model, pattern, sheet, **options):
    if model == "shell":
        return fd.shell(pattern, sheet, divisions=4, **options)
    return fd.discretize(pattern, sheet, scheme=model, **options)


BITS = ("bar_area", "fold_stiffness", "bend_stiffness")


@pytest.mark.parametrize(
    ("build", "options", "names"),
    [
        (fd.discretize, {"scheme": "n5b8"}, BITS),
        (fd.discretize, {"scheme": "n4b5"}, BITS),
        (fd.discretize, {"scheme": "n5b8", "calibration": "merlin2"}, BITS),
        (fd.shell, {"divisions": 3}, ("fold_stiffness",)),
    ],
)
def test_panels_that_differ_in_nothing_change_no_bit(build, options, names):
    same = fd.PanelSheet([0, 3, 5], E, NU, T, RHO)
    one, two = (build(MIURA, s, **options) for s in (SHEET, replace(SHEET, panels=[same])))
    for name in names:
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    tangents = [s.body.tangent(np.zeros(s.body.size)) for s in (one, two)]
    np.testing.assert_array_equal(*(each.toarray() for each in tangents))
    np.testing.assert_array_equal(one.mass.toarray(), two.mass.toarray())


def stiffness(s, youngs_modulus):
    """E A of bars, by the places of their ends."""
    ends = (tuple(sorted(map(tuple, s.nodes[bar].round(9).tolist()))) for bar in s.bars.tolist())
    return dict(zip(ends, youngs_modulus * s.bar_area, strict=True))


@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_stiffness_of_bars_and_bends_is_that_of_each_panel_on_its_own(scheme):
    """E A of the bar on the crease is the sum of the two panels' E A."""
    whole, bends = Counter(), []
    for face, sheet in zip(PAIR.faces, (SHEET, ALONE), strict=True):
        panel = fd.Pattern(PAIR.vertices[list(face)], [(0, 1, 2, 3)])
        s = fd.discretize(panel, sheet, scheme=scheme)
        bends += s.bend_stiffness.tolist()
        whole.update(stiffness(s, sheet.youngs_modulus))
    both = fd.discretize(PAIR, MIXED, scheme=scheme)
    assert stiffness(both, E) == pytest.approx(dict(whole), rel=1e-13)
    np.testing.assert_allclose(both.bend_stiffness, bends, rtol=1e-13)


def test_a_crease_between_different_panels_is_two_springs_in_series():
    one, two, both = (
        fd.discretize(PAIR, s, preset="herkal").fold_stiffness[0] for s in (SHEET, ALONE, MIXED)
    )
    assert 1.0 / both == pytest.approx(0.5 * (1.0 / one + 1.0 / two), rel=1e-14)
    assert fd.shell(PAIR, MIXED, divisions=2).fold_stiffness[0] == both
    # by hand: half of each side's Ls/G + 1/(0.55 G (L/t)^(1/3)), L = 0.8 m
    soft = 0.0
    for e, nu, t in ((E, NU, T), (7e9, 0.2, 2e-3)):
        g = e * t**3 / (12 * (1 - nu**2))
        soft += 0.5 * (2 / g + 1 / (0.55 * g * (0.8 / t) ** (1 / 3)))
    assert both == pytest.approx(1.0 / soft, rel=1e-13)


@pytest.mark.parametrize("mass", [*MASS_RULES, "lumped", "shell"])
def test_mass_of_each_panel_by_every_rule(mass):
    if mass in MASS_RULES:
        s = fd.discretize(PAIR, MIXED, mass=mass, preset="plate")
    else:
        rule = "consistent" if mass == "shell" else mass
        s = fd.shell(PAIR, MIXED, divisions=4, mass=rule)
    light, heavy = RHO * T * 0.8, 2700.0 * 2e-3 * 0.96  # kg
    assert s.total_mass == pytest.approx(light + heavy, rel=1e-13)
    center = (0.5 * light + 1.6 * heavy) / (light + heavy)
    np.testing.assert_allclose(s.center_of_mass, [center, 0.4, 0], atol=1e-13)


@pytest.mark.parametrize("model", ["n5b8", "shell"])
def test_panels_side_by_side_share_a_pull(model):
    """Stretched along their crease by the strain e: F = (E1 t1 b1 + E2 t2 b2) e, equal nu."""
    sheet = fd.Sheet(E, NU, T, panels=[fd.PanelSheet([1], youngs_modulus=7e9, thickness=2e-3)])
    laws = {"bar_law": "linear", "membrane": "bars"} if model == "n5b8" else {}
    s, e = make(model, PAIR, sheet, **laws), 1e-6
    hold = [fd.Fix("ymin", "y", along=True), fd.Fix([0], "xz"),
            fd.Fix(range(1, len(s.nodes)), "z"),
            fd.Impose("ymax", "y", 0.8 * e, along=True)]  # fmt: skip
    path = fd.trace(fd.Case(s, hold), load_factors=[1.0])
    top = (path.support_axis == "y") & (s.nodes[path.support_node, 1] > 0.4)
    force = float(path.reaction[-1].sel(support=top).sum())
    assert force == pytest.approx((E * T * 1.0 + 7e9 * 2e-3 * 1.2) * e, rel=3e-6)


@pytest.mark.parametrize("model", ["n5b8", "shell"])
def test_two_boards_that_flap_on_their_crease(model):
    """Axis held, panels all but rigid: w^2 = k (1/I1 + 1/I2), I = m b^2 / 3 about the crease."""
    boards = fd.Sheet(1e11, 0.3, 0.01, 500.0,
                      panels=[fd.PanelSheet([1], thickness=0.02, density=800.0)])  # fmt: skip
    options = {"preset": "herkal", "bend_law": "linear"} if model == "n5b8" else {}
    s = make(model, PAIR, boards, crease_stiffness=5.0, mass="consistent", **options)
    crease = [1, 4] if model == "n5b8" else np.flatnonzero(abs(s.nodes[:, 0] - 1.0) < 1e-9)
    found = fd.modes(fd.Case(s, [fd.Fix(crease)]), count=2).frequency.to_numpy()
    inertia = 5.0 * 0.8 * 1.0 / 3.0, 16.0 * 0.96 * 1.2**2 / 3.0
    wanted = np.sqrt(5.0 * 0.8 * (1 / inertia[0] + 1 / inertia[1])) / (2 * np.pi)
    assert abs(found[0]) < 1e-3 * wanted
    assert found[1] == pytest.approx(wanted, rel=1e-4 if model == "shell" else 1e-5)


def test_a_shell_cantilever_of_two_thicknesses():
    """Euler-Bernoulli, nu = 0: F (L2^3 / 3 E I2 + L2^2 / k + ((L1 + L2)^3 - L2^3) / 3 E I1)."""
    one, two, width = 1.0, 0.8, 0.2
    points = [(x, y) for y in (0, width) for x in (0, one, one + two)]
    thin = fd.Sheet(1e9, 0.0, 0.02, panels=[fd.PanelSheet([1], 3e9, thickness=0.01)])
    s = fd.shell(
        fd.Pattern(points, PAIR.faces), thin, divisions=16, fold_law="linear",
        crease_stiffness=1e4, clamped=[(0, 3)],
    )  # fmt: skip
    load = fd.TotalForce((0, 0, 1e-6), edges=[(2, 5)])
    path = fd.trace(fd.Case(s, [fd.Fix([0, 3])], [load]), load_factors=[1.0])
    tip = np.flatnonzero(abs(s.nodes[:, 0] - one - two) < 1e-9)
    first, second = 1e9 * width * 0.02**3 / 12, 3e9 * width * 0.01**3 / 12
    hinge = two**2 / (1e4 * width)
    wanted = 1e-6 * (two**3 / (3 * second) + hinge + ((one + two) ** 3 - two**3) / (3 * first))
    assert path.displacement.values[-1, tip, 2].mean() == pytest.approx(wanted, rel=1e-3)


@pytest.mark.parametrize(
    ("changed", "apart"),
    [({"youngs_modulus": 1e7}, 0.03), ({"density": 5.0}, 0.07), ({"thickness": 0.03}, 0.075)],
)
def test_both_models_agree_on_what_two_other_panels_change(changed, apart):
    """By which factors the frequencies of a Miura unit change, where they are 40 % apart."""
    hold = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
    found = []
    for panels in ([], [fd.PanelSheet([0, 3], **changed)]):
        given = fd.patterns.miura((1, 1)), fd.Sheet(1e6, 0.25, 0.01, 1.0, panels=panels)
        for s in (
            fd.discretize(*given, bend_law="linear", mass="consistent"),
            fd.shell(*given, divisions=8, mass="consistent"),
        ):
            found.append(fd.modes(fd.Case(s, hold), count=3).frequency.values)
    bars, shell = found[2] / found[0], found[3] / found[1]
    assert np.abs(shell - 1.0).max() > 0.3
    np.testing.assert_allclose(bars, shell, rtol=apart)


def test_kinds_of_panels():
    assert MIXED.of(0) == SHEET
    assert MIXED.of(1) == ALONE
    np.testing.assert_array_equal(MIXED.values("thickness", 3), [T, 2e-3, T])
    assert fd.PanelSheet(np.array([4, 1]), thickness=1).panels == (4, 1)


BOTH = [OTHER, fd.PanelSheet([2, 1], thickness=1)]
THIRD = fd.Sheet(E, NU, T, panels=[fd.PanelSheet(2, 1.0)])
AUXETIC = fd.Sheet(E, NU, T, panels=[fd.PanelSheet([1], poissons_ratio=-0.1)])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fd.PanelSheet([0]), "panels: give what differs there: youngs_modulus"),
        (lambda: fd.PanelSheet([-1], thickness=1), r"panels = \[-1\]: panels are counted from 0"),
        (lambda: fd.PanelSheet("all", thickness=1), "panels .*must be panel numbers|not a panel"),
        (lambda: fd.PanelSheet([0], thickness=-1), "thickness = -1: must be greater than 0"),
        (lambda: fd.PanelSheet([0], poissons_ratio=-1), "poissons_ratio = -1.*greater than -1"),
        (
            lambda: fd.Sheet(E, NU, T, panels=[fd.PanelSheet([0], poissons_ratio=0.5)]),
            r"panels\[0\].poissons_ratio = 0.5: must lie between -1 and 0.5",
        ),
        (lambda: fd.Sheet(E, NU, T, panels=[OTHER]), r"\[0\].density = 2700: the rest .* has none"),
        (lambda: fd.Sheet(E, NU, T, RHO, panels=BOTH), r"panels\[1\].panels: panel 1 .* already"),
        (lambda: fd.Sheet(E, NU, T, panels=OTHER), "panels = .*must be a list of PanelSheet"),
        (lambda: fd.Sheet(E, NU, T, panels=[3]), r"panels\[0\] = 3: must be a PanelSheet"),
        (
            lambda: fd.discretize(PAIR, THIRD, preset="plate"),
            r"\[0\].panels: panel 2 is out of range; .* 0 to 1",
        ),
        (lambda: fd.shell(PAIR, THIRD), "panel 2 is out of range"),
        (
            lambda: fd.discretize(PAIR, AUXETIC, membrane="bars", preset="plate"),
            "= -0.1: N5B8 quadrilaterals need",
        ),
    ],
)
def test_wrong_panels(make, message):
    with pytest.raises(InputError, match=message):
        make()


FILE = f"""{MIURA_TEXT}[[supports]]
nodes = "xmin"
[[loads]]
nodes = [7]
force = [0, 0, 1e-5]
[analysis]
kind = "statics"
load_factors = [1]
{{panels}}
[model]
{{model}}
"""
PANELS = """[[sheet.panels]]
panels = [2, 0]
thickness = 0.03
density = 4
[[sheet.panels]]
panels = [1]
youngs_modulus = 2e6
"""


@pytest.mark.matrix
@pytest.mark.parametrize(
    "model",
    [
        "crease_rest = { valley = 100 }\ncrease_stiffness = { valley = 0.3 }",
        'kind = "shell"\ndivisions = 2\ncrease_stiffness = { mountain = 0.1 }',
    ],
)
def test_from_a_case_file_to_a_result_and_back(model, read, kept):
    case_file = read(FILE.format(panels=PANELS, model=model))
    case = case_file.case()
    panels = (fd.PanelSheet([2, 0], thickness=0.03, density=4.0), fd.PanelSheet([1], 2e6))
    again, s = kept(case_file.run()), case.structure
    assert again.structure.sheet == s.sheet and s.sheet.panels == panels
    assert again.structure.options == s.options
    for name in ("fold_stiffness", "fold_rest", "nodal_mass"):
        np.testing.assert_array_equal(getattr(again.structure, name), getattr(s, name))
    u = 1e-3 * np.sin(np.arange(s.nodes.size)).reshape(-1, 3)
    np.testing.assert_array_equal(again.structure.internal_force(u), s.internal_force(u))


@pytest.mark.parametrize(
    ("panels", "message"),
    [
        ("panels = [9]\nthickness = 1", r"panels\[0\].panels: panel 9 is out of"),
        ("panels = [0]", r"sheet\.panels\[0\].panels: give what differs there"),
        ("thickness = 1", r"sheet.panels\[0\].panels: missing"),
        ("panels = [0, 0]\nthickness = 1", "panel 0 is listed twice"),
        ("panels = [0]\nthick = 1", r"panels\[0\].thick: unknown key"),
        ("panels = [0]\nthickness = 0", r"panels\[0\].thickness = 0"),
    ],
)
def test_wrong_panels_in_a_case_file(panels, message, read):
    with pytest.raises(InputError, match=message):
        read(FILE.format(panels=f"[[sheet.panels]]\n{panels}", model=""))


@pytest.mark.parametrize("model", ["n5b8", "n4b5", "shell"])
def test_all_panels_of_another_material_are_a_sheet_of_it(model):
    every = replace(OTHER, panels=range(len(MIURA.faces)))
    mixed, alone = (make(model, MIURA, s) for s in (replace(SHEET, panels=[every]), ALONE))
    u = 1e-4 * np.sin(np.arange(alone.nodes.size)).reshape(-1, 3)
    force = alone.internal_force(u)
    np.testing.assert_allclose(mixed.internal_force(u), force, atol=1e-12 * np.abs(force).max())
    np.testing.assert_allclose(mixed.nodal_mass, alone.nodal_mass, rtol=1e-14)
    if model == "shell":
        return
    # and with it the critical step, and a motion with its energies
    loads = [fd.Gravity("-z"), fd.Force([7], (0.1, 0, 0))]
    cases = [fd.Case(s, loads=loads) for s in (mixed, alone)]
    assert fd.critical_step(cases[0]) == pytest.approx(fd.critical_step(cases[1]), rel=1e-9)
    one, two = (fd.simulate(case, 1e-3, method="rk4", dt=1e-6, every_steps=200) for case in cases)
    assert one.attrs["energy_error"] < 1e-6
    np.testing.assert_allclose(one.kinetic, two.kinetic, rtol=1e-8, atol=1e-15)


@pytest.mark.matrix
@pytest.mark.parametrize(("model", "method"), [("n5b8", "rk4"), ("shell", "newmark")])
def test_energy_of_a_motion_with_panels_that_differ(model, method):
    """Kinetic + strain + dissipated - work closes."""
    boards = fd.Sheet(
        1e6, 0.25, 0.01, 1.0, panels=[fd.PanelSheet([1], thickness=0.02, density=4.0)]
    )
    s = make(model, PAIR, boards)
    case = fd.Case(s, [fd.Fix([0, 3])], [fd.Gravity((0, 0, -0.05), fd.Ramp(0.2, smooth=True))],
                   fd.Rayleigh(alpha=1.0))  # fmt: skip
    motion = fd.simulate(case, 0.5, method=method, interval=0.1)
    assert float(motion.kinetic[-1]) > 0.0
    assert motion.attrs["energy_error"] < (1e-6 if method == "rk4" else 3e-3)


def test_the_page_and_the_picture_say_what_differs(read):
    model = "crease_stiffness = { mountain = 0.1, valley = 0.25 }"
    case_file = read(FILE.format(panels=PANELS, model=model))
    rows = provenance(case_file, {"mixed_voronoi": case_file.run()})[1].rows
    text = " ".join(str(cell) for row in rows for cell in row)
    assert "[2, 0] with thickness 0.03 m; density 4 kg/m3, [1] with youngs modulus 2e+06 Pa" in text
    assert "crease stiffness mountain 0.1, valley 0.25 N m/rad per m" in text
    legend = fd.plots.draw_structure(case_file.case()).legends[0]
    labels = {entry.get_text() for entry in legend.get_texts()}
    assert labels >= {"panels with t = 0.03 m, ρ = 4 kg/m³", "panels with E = 2e+06 Pa"}
    assert len(np.unique(Sheet3D.of(case_file.case()).paper, axis=0)) == 3
