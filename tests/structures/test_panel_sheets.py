"""Panels that differ from the rest of the sheet: stiffness, mass, and how they are stored."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

import foldyn as fd
from case_texts import MIURA_TEXT
from foldyn.analyses.provenance import provenance
from foldyn.errors import InputError
from foldyn.plots.scene import Sheet3D

E, NU, T, RHO = 2e9, 0.3, 1e-3, 1200.0
SHEET = fd.Sheet(E, NU, T, RHO, length_scale_ratio=2.0)
OTHER = fd.PanelSheet([1], youngs_modulus=7e9, poissons_ratio=0.2, thickness=2e-3, density=2700.0)
ALONE = fd.Sheet(7e9, 0.2, 2e-3, 2700.0, length_scale_ratio=2.0)  # what panel 1 is made of
MIXED = fd.Sheet(E, NU, T, RHO, length_scale_ratio=2.0, panels=[OTHER])
PAIR = fd.Pattern([(0, 0), (1, 0), (2.2, 0), (0, 0.8), (1, 0.8), (2.2, 0.8)],
                  [(0, 1, 4, 3), (1, 2, 5, 4)])  # fmt: skip
MIURA = fd.patterns.miura((2, 1), 0.03, 0.02, 65, 80)


def make(model, pattern, sheet, **options):
    if model == "shell":
        return fd.shell(pattern, sheet, divisions=4, **options)
    return fd.discretize(pattern, sheet, scheme=model, **options)


@pytest.mark.parametrize("calibration", ["standard", "merlin2"])
@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_panels_that_differ_in_nothing_change_no_bit(scheme, calibration):
    same = fd.PanelSheet([0, 3, 5], E, NU, T, RHO)
    sheet = fd.Sheet(E, NU, T, RHO, length_scale_ratio=2.0, panels=[same])
    one, two = (fd.discretize(MIURA, s, scheme=scheme, calibration=calibration)
                for s in (SHEET, sheet))  # fmt: skip
    for name in ("bar_area", "fold_stiffness", "bend_stiffness", "nodal_mass"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


def test_panels_of_a_shell_that_differ_in_nothing_change_no_bit():
    same = fd.PanelSheet(2, thickness=T)
    sheet = fd.Sheet(E, NU, T, RHO, length_scale_ratio=2.0, panels=[same])
    one, two = (fd.shell(MIURA, s, divisions=3) for s in (SHEET, sheet))
    for name in ("membrane", "bending", "piece_stiffness"):
        np.testing.assert_array_equal(getattr(one.model, name), getattr(two.model, name))
    np.testing.assert_array_equal(one.mass.data, two.mass.data)


@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_stiffness_of_bars_and_bends_is_that_of_each_panel_on_its_own(scheme):
    """E A of the bar on the crease is the sum of the two panels' E A."""
    stiffness: dict[tuple, float] = {}
    bends = []
    for face, sheet in zip(PAIR.faces, (SHEET, ALONE), strict=True):
        panel = fd.Pattern(PAIR.vertices[list(face)], [(0, 1, 2, 3)])
        s = fd.discretize(panel, sheet, scheme=scheme)
        bends += s.bend_stiffness.tolist()
        for bar, area in zip(s.bars.tolist(), s.bar_area, strict=True):
            place = tuple(sorted(map(tuple, s.nodes[bar].round(9).tolist())))
            stiffness[place] = stiffness.get(place, 0.0) + sheet.youngs_modulus * area
    both = fd.discretize(PAIR, MIXED, scheme=scheme)
    found = {
        tuple(sorted(map(tuple, both.nodes[bar].round(9).tolist()))): E * area
        for bar, area in zip(both.bars.tolist(), both.bar_area, strict=True)
    }
    assert found == pytest.approx(stiffness, rel=1e-13)
    np.testing.assert_allclose(both.bend_stiffness, bends, rtol=1e-13)


def test_a_crease_between_different_panels_is_two_springs_in_series():
    one, two, both = (
        fd.discretize(PAIR, s, preset="herkal").fold_stiffness[0] for s in (SHEET, ALONE, MIXED)
    )
    assert 1.0 / both == pytest.approx(0.5 * (1.0 / one + 1.0 / two), rel=1e-14)
    assert fd.shell(PAIR, MIXED, divisions=2).fold_stiffness[0] == both
    # by hand: half of each side's Ls/G + 1/(0.55 G (L/t)^(1/3)), L = 0.8 m
    g = [e * t**3 / (12 * (1 - nu**2)) for e, nu, t in ((E, NU, T), (7e9, 0.2, 2e-3))]
    soft = [
        2 / k + 1 / (0.55 * k * (0.8 / t) ** (1 / 3)) for k, t in zip(g, (T, 2e-3), strict=True)
    ]
    assert both == pytest.approx(2.0 / sum(soft), rel=1e-13)


@pytest.mark.parametrize("mass", [*fd.structures.MASS_RULES])
def test_mass_of_each_panel_by_every_rule(mass):
    s = fd.discretize(PAIR, MIXED, mass=mass)
    light, heavy = RHO * T * 0.8, 2700.0 * 2e-3 * 0.96  # kg
    assert s.total_mass == pytest.approx(light + heavy, rel=1e-14)
    center = (0.5 * light + 1.6 * heavy) / (light + heavy)
    np.testing.assert_allclose(s.center_of_mass, [center, 0.4, 0], atol=1e-14)


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_mass_of_each_panel_of_a_shell(mass):
    s = fd.shell(PAIR, MIXED, divisions=4, mass=mass)
    light, heavy = RHO * T * 0.8, 2700.0 * 2e-3 * 0.96
    assert s.total_mass == pytest.approx(light + heavy, rel=1e-13)
    center = (0.5 * light + 1.6 * heavy) / (light + heavy)
    np.testing.assert_allclose(s.center_of_mass, [center, 0.4, 0], atol=1e-13)


@pytest.mark.parametrize("model", ["n5b8", "shell"])
def test_panels_side_by_side_share_a_pull(model):
    """Stretched along their crease by the strain e: F = (E1 t1 b1 + E2 t2 b2) e, equal nu."""
    sheet = fd.Sheet(E, NU, T, panels=[fd.PanelSheet([1], youngs_modulus=7e9, thickness=2e-3)])
    laws = {"bar_law": "linear", "membrane": "bars"} if model == "n5b8" else {}
    s = make(model, PAIR, sheet, **laws)
    e = 1e-6
    hold = [fd.Fix("ymin", "y"), fd.Fix([0], "xz"), fd.Fix([1, 2, 3, 4, 5], "z"),
            fd.Impose("ymax", "y", 0.8 * e)]  # fmt: skip
    if model == "shell":  # whole edges, which a selection by vertices does not name
        rim = np.flatnonzero(s.nodes[:, 1] < 1e-9), np.flatnonzero(s.nodes[:, 1] > 0.8 - 1e-9)
        hold = [fd.Fix(rim[0], "y"), fd.Fix([0], "xz"), fd.Fix(np.arange(1, len(s.nodes)), "z"),
                fd.Impose(rim[1], "y", 0.8 * e)]  # fmt: skip
    path = fd.trace(fd.Case(s, hold), load_factors=[1.0])
    top = (path.support_axis == "y") & (s.nodes[path.support_node, 1] > 0.4)
    force = float(path.reaction[-1].sel(support=top).sum())
    wanted = (E * T * 1.0 + 7e9 * 2e-3 * 1.2) * e
    assert force == pytest.approx(wanted, rel=3e-6)


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
    strip = fd.Pattern([(0, 0), (one, 0), (one + two, 0), (0, width), (one, width),
                        (one + two, width)], [(0, 1, 4, 3), (1, 2, 5, 4)])  # fmt: skip
    thin = fd.Sheet(1e9, 0.0, 0.02, panels=[fd.PanelSheet([1], 3e9, thickness=0.01)])
    s = fd.shell(
        strip, thin, divisions=16, fold_law="linear", crease_stiffness=1e4, clamped=[(0, 3)]
    )
    root, tip = (np.flatnonzero(abs(s.nodes[:, 0] - x) < 1e-9) for x in (0.0, one + two))
    stiffness = s.tangent(np.zeros_like(s.nodes)).tocsc()
    force = np.zeros(stiffness.shape[0])
    force[3 * tip + 2] = 1e-6 / 16
    force[[3 * 2 + 2, 3 * 5 + 2]] *= 0.5  # corners
    free = np.setdiff1d(np.arange(len(force)), (3 * root[:, None] + np.arange(3)).ravel())
    moved = np.zeros(len(force))
    moved[free] = spsolve(stiffness[free][:, free], force[free])
    first, second = 1e9 * width * 0.02**3 / 12, 3e9 * width * 0.01**3 / 12
    hinge = two**2 / (1e4 * width)
    wanted = 1e-6 * (two**3 / (3 * second) + hinge + ((one + two) ** 3 - two**3) / (3 * first))
    assert moved[3 * tip + 2].mean() == pytest.approx(wanted, rel=1e-3)


@pytest.mark.parametrize(
    ("changed", "apart"),
    [({"youngs_modulus": 1e7}, 0.03), ({"density": 5.0}, 0.07), ({"thickness": 0.03}, 0.075)],
)
def test_both_models_agree_on_what_two_other_panels_change(changed, apart):
    """By which factors the frequencies of a Miura unit change, where they are 40 % apart."""
    pattern = fd.patterns.miura((1, 1))
    hold = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
    found = []
    for panels in ([], [fd.PanelSheet([0, 3], **changed)]):
        sheet = fd.Sheet(1e6, 0.25, 0.01, 1.0, panels=panels)
        bars = fd.discretize(pattern, sheet, bend_law="linear", mass="consistent")
        shell = fd.shell(pattern, sheet, divisions=8, mass="consistent")
        both = [fd.modes(fd.Case(s, hold), count=3).frequency for s in (bars, shell)]
        found.append(np.array(both))
    bars, shell = found[1] / found[0]
    assert np.abs(shell - 1.0).max() > 0.3
    np.testing.assert_allclose(bars, shell, rtol=apart)


def test_kinds_of_panels():
    assert MIXED.of(0) == SHEET
    assert MIXED.of(1) == ALONE
    np.testing.assert_array_equal(MIXED.values("thickness", 3), [T, 2e-3, T])
    assert fd.PanelSheet(np.array([4, 1]), thickness=1).panels == (4, 1)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fd.PanelSheet([0]), "panels: give what differs there: youngs_modulus"),
        (lambda: fd.PanelSheet([-1], thickness=1), r"panels = \[-1\]: panels are counted from 0"),
        (lambda: fd.PanelSheet("all", thickness=1), "panels .*must be panel numbers|not a panel"),
        (lambda: fd.PanelSheet([0], thickness=-1), "thickness = -1: must be greater than 0"),
        (lambda: fd.PanelSheet([0], poissons_ratio=0.5), "must lie between -1 and 0.5"),
        (
            lambda: fd.Sheet(E, NU, T, panels=[OTHER]),
            r"sheet: panels\[0\].density = 2700: the rest of the sheet has none",
        ),
        (
            lambda: fd.Sheet(E, NU, T, RHO, panels=[OTHER, fd.PanelSheet([2, 1], thickness=1)]),
            r"sheet: panels\[1\].panels: panel 1 is among those of panels\[0\] already",
        ),
        (lambda: fd.Sheet(E, NU, T, panels=OTHER), "panels = .*must be a list of PanelSheet"),
        (lambda: fd.Sheet(E, NU, T, panels=[3]), r"panels\[0\] = 3: must be a PanelSheet"),
        (
            lambda: fd.discretize(PAIR, fd.Sheet(E, NU, T, panels=[fd.PanelSheet(2, 1.0)])),
            r"panels\[0\].panels: panel 2 is out of range; this pattern has panels 0 to 1",
        ),
        (
            lambda: fd.shell(PAIR, fd.Sheet(E, NU, T, panels=[fd.PanelSheet(2, 1.0)])),
            "panel 2 is out of range",
        ),
        (
            lambda: fd.discretize(
                PAIR, fd.Sheet(E, NU, T, panels=[fd.PanelSheet([1], poissons_ratio=-0.1)]),
                membrane="bars",
            ),
            "poissons_ratio = -0.1: N5B8 quadrilaterals need it above 0",
        ),
    ],
)  # fmt: skip
def test_wrong_panels(make, message):
    with pytest.raises(InputError, match=message):
        make()


FILE = (
    MIURA_TEXT
    + """
{panels}
[model]
kind = "{kind}"
{model}
[[supports]]
nodes = "xmin"
[[loads]]
nodes = [7]
force = [0, 0, 1e-5]
[analysis]
kind = "statics"
load_factors = [1]
"""
)
PANELS = """[[sheet.panels]]
panels = [2, 0]
thickness = 0.03
density = 4
[[sheet.panels]]
panels = [1]
youngs_modulus = 2e6
"""


@pytest.mark.parametrize("kind", ["bars_and_hinges", "shell"])
def test_from_a_case_file_to_a_result_and_back(tmp_path, kind):
    path = tmp_path / "case.toml"
    model = 'divisions = 2\ncrease_stiffness = { mountain = 0.1, flat = 2 }\n' if kind == "shell" \
        else 'crease_rest = { valley = 100 }\ncrease_stiffness = { valley = 0.3 }\n'  # fmt: skip
    path.write_text(FILE.format(kind=kind, panels=PANELS, model=model.replace(", flat = 2", "")))
    case = fd.read_case(path).case()
    assert case.structure.sheet.panels == (
        fd.PanelSheet([2, 0], thickness=0.03, density=4.0), fd.PanelSheet([1], 2e6),
    )  # fmt: skip
    result = fd.read_case(path).run()
    fd.save(result, tmp_path / "result.nc")
    again = fd.case_of(fd.load(tmp_path / "result.nc"))
    assert again.structure.sheet == case.structure.sheet
    assert again.structure.options == case.structure.options
    np.testing.assert_array_equal(again.structure.fold_stiffness, case.structure.fold_stiffness)
    np.testing.assert_array_equal(again.structure.fold_rest, case.structure.fold_rest)
    np.testing.assert_array_equal(again.nodal_mass, case.nodal_mass)
    u = 1e-3 * np.sin(np.arange(case.structure.nodes.size)).reshape(-1, 3)
    np.testing.assert_array_equal(
        again.structure.internal_force(u), case.structure.internal_force(u)
    )


@pytest.mark.parametrize(
    ("panels", "message"),
    [
        ("[[sheet.panels]]\npanels = [9]\nthickness = 1", r"panels\[0\].panels: panel 9 is out of"),
        ("[[sheet.panels]]\npanels = [0]", r"sheet: panels\[0\].panels: give what differs there"),
        ("[[sheet.panels]]\nthickness = 1", r"sheet.panels\[0\].panels: missing"),
        ("[[sheet.panels]]\npanels = [0, 0]\nthickness = 1", "panel 0 is listed twice"),
        ("[[sheet.panels]]\npanels = [0]\nthick = 1", r"panels\[0\].thick: unknown key"),
        ("[[sheet.panels]]\npanels = [0]\nthickness = 0", r"panels\[0\].thickness = 0"),
    ],
)
def test_wrong_panels_in_a_case_file(tmp_path, panels, message):
    path = tmp_path / "case.toml"
    path.write_text(FILE.format(kind="bars_and_hinges", panels=panels, model=""))
    with pytest.raises(InputError, match=message):
        fd.read_case(path)


@pytest.mark.parametrize("model", ["n5b8", "n4b5", "shell"])
def test_all_panels_of_another_material_are_a_sheet_of_it(model):
    other = {"youngs_modulus": 7e9, "poissons_ratio": 0.2, "thickness": 2e-3, "density": 2700.0}
    every = fd.PanelSheet(range(len(MIURA.faces)), **other)
    mixed = make(model, MIURA, fd.Sheet(E, NU, T, RHO, length_scale_ratio=2.0, panels=[every]))
    alone = make(model, MIURA, ALONE)
    u = 1e-4 * np.sin(np.arange(alone.nodes.size)).reshape(-1, 3)
    force = alone.internal_force(u)
    np.testing.assert_allclose(mixed.internal_force(u), force, atol=1e-12 * np.abs(force).max())
    np.testing.assert_allclose(mixed.nodal_mass, alone.nodal_mass, rtol=1e-14)
    # and with it the critical step, and a motion with its energies
    cases = [fd.Case(s, loads=[fd.Gravity("-z"), fd.Force([7], (0.1, 0, 0))])
             for s in (mixed, alone)]  # fmt: skip
    if model == "shell":
        return
    assert fd.critical_step(cases[0]) == pytest.approx(fd.critical_step(cases[1]), rel=1e-9)
    one, two = (fd.simulate(case, 1e-3, dt=1e-6, every=200) for case in cases)
    assert one.attrs["energy_error"] < 1e-6
    np.testing.assert_allclose(one.kinetic, two.kinetic, rtol=1e-8, atol=1e-15)


@pytest.mark.parametrize(("model", "method"), [("n5b8", "rk4"), ("shell", "newmark")])
def test_energy_of_a_motion_with_panels_that_differ(model, method):
    """Kinetic + strain + dissipated - work closes."""
    boards = fd.Sheet(
        1e6, 0.25, 0.01, 1.0, panels=[fd.PanelSheet([1], thickness=0.02, density=4.0)]
    )
    s = make(model, PAIR, boards)
    case = fd.Case(s, [fd.Fix([0, 3])], [fd.Gravity((0, 0, -0.05), fd.Ramp(0.2, smooth=True))],
                   fd.Rayleigh(alpha=1.0))  # fmt: skip
    motion = fd.simulate(case, 0.5, method, every=0.1)
    assert float(motion.kinetic[-1]) > 0.0
    assert motion.attrs["energy_error"] < (1e-6 if method == "rk4" else 3e-3)


def test_the_page_and_the_picture_say_what_differs(tmp_path):
    path = tmp_path / "case.toml"
    model = "crease_stiffness = { mountain = 0.1, valley = 0.25 }"
    path.write_text(FILE.format(kind="bars_and_hinges", panels=PANELS, model=model))
    case_file = fd.read_case(path)
    rows = provenance(case_file, {"mixed_voronoi": case_file.run()})[1].rows
    text = " ".join(str(cell) for row in rows for cell in row)
    assert "[2, 0] with thickness 0.03 m; density 4 kg/m3, [1] with youngs modulus 2e+06 Pa" in text
    assert "crease stiffness mountain 0.1, valley 0.25 N m/rad per m" in text
    legend = fd.plots.draw_structure(case_file.case()).legends[0]
    labels = [entry.get_text() for entry in legend.get_texts()]
    assert "panels with t = 0.03 m, ρ = 4 kg/m³" in labels
    assert "panels with E = 2e+06 Pa" in labels
    colors = Sheet3D.of(case_file.case()).paper
    assert len(np.unique(colors, axis=0)) == 3
