"""Numbers that are probably in other units: told, with what was probably meant."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import foldyn as fd
from case_texts import HELD_MIURA_TEXT, PLATE
from foldyn.cli.main import main
from foldyn.errors import UnitsWarning
from foldyn.studies import find_case, shipped_cases

SMALL = fd.patterns.miura(cells=(1, 1), a=0.04, b=0.04, panel_angle=60, dihedral=60)
STEEL = (2e11, 0.3, 1e-4, 7850.0)


def told(compute) -> list[str]:
    """What is said of units."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        compute()
    return [str(one.message) for one in caught if one.category is UnitsWarning]


@pytest.mark.parametrize("model", [fd.discretize, fd.shell])
@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((2e11, 0.3, 0.3, 7850.0), "thickness = 0.3 m is 7.5 times the shortest .* give 0.0003 "),
        ((200.0, 0.3, 1e-4, 7850.0), "200 Pa .* at 0.16 m/s .* meant in GPa, give 2e[+]11 "),
        ((3500.0, 0.3, 1e-4, 1200.0), "3500 Pa .* at 1.71 m/s .* meant in MPa, give 3.5e[+]09 "),
        ((2e11, 0.3, 1e-4, 7.85), "7.85 kg/m3: .* if density is meant in g/cm3, give 7850 "),
        ((2e11, 0.3, 1e-4, 7.85e-9), "if density is meant in t/mm3, give 7850 "),
    ],
)
def test_sheets(model, given, message):
    with pytest.warns(UnitsWarning, match=message) as caught:
        model(SMALL, fd.Sheet(*given))
    assert sum(one.category is UnitsWarning for one in caught) == 1


@pytest.mark.parametrize("model", [fd.discretize, fd.shell])
def test_patterns_in_millimeters(model):
    """With a thickness in m, and in mm; nothing of a sail of film, nor of a bridge of plates."""
    wide = fd.patterns.miura(cells=(1, 1), a=55.0, b=60.0, panel_angle=70, dihedral=120)
    with pytest.warns(
        UnitsWarning, match="edges of 55 m and more and is 0.0005 m thick, .* in mm, make"
    ):
        model(wide, fd.Sheet(3e9, 0.3, 5e-4, 1100.0))
    with pytest.warns(UnitsWarning, match="= 0.5 m, .* is that of a slab .* give 0.0005 and a"):
        model(wide, fd.Sheet(3e9, 0.3, 0.5, 1100.0))
    sail = fd.patterns.simple_fold(a=1.9, b=1.9, dihedral=120)
    assert told(lambda: model(sail, fd.Sheet(5e9, 0.3, 2.5e-6, 1400.0))) == []
    bridge = fd.patterns.simple_fold(a=8.0, b=4.0, dihedral=120)
    assert told(lambda: model(bridge, fd.Sheet(2e11, 0.3, 0.02, 7850.0))) == []


def test_a_panel_of_its_own():
    thick = fd.PanelSheet([2], thickness=0.1)
    (text,) = told(lambda: fd.discretize(SMALL, fd.Sheet(*STEEL, panels=[thick]), preset="plate"))
    assert "thickness = 0.1 m is 2.5 times the shortest edge of panel 2, 0.04 m" in text


def test_what_is_not_told():
    for density in (None, 1.0, 1000.0):  # sheets of the paper
        sheet = fd.Sheet(1e6, 0.25, 0.01, density)
        assert (
            told(lambda sheet=sheet: fd.discretize(fd.patterns.miura(), sheet, preset="plate"))
            == []
        )
    angles = [0.1, 0.25, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 5, 5.5, 6, 6.3, 6.45, 7, 9.42478]
    assert told(lambda: [fd.patterns.simple_fold(dihedral=angle) for angle in angles]) == []
    assert told(lambda: [fd.Actuate("all", angle=[angle, 120.0]) for angle in angles]) == []
    assert told(lambda: fd.Actuate("all", fold_angle=[1.23, 2.345])) == []  # small folds
    assert told(lambda: fd.patterns.kresling(twist=1.234)) == []


@pytest.mark.parametrize("name", shipped_cases())
def test_shipped_cases(name):
    case_file = fd.read_case(find_case(name))
    assert told(lambda: case_file.case(case_file.masses[0])) == []


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fd.patterns.miura(panel_angle=np.pi / 3), "panel_angle = 1.0472 is pi/3, .* 60 "),
        (lambda: fd.patterns.miura(dihedral=2.0944), "dihedral = 2.0944 is 2 pi/3, .* give 120 "),
        (lambda: fd.patterns.kresling(twist=-np.pi / 9), "twist = 0.34907 is pi/9, .* give 20 "),
        (lambda: fd.Actuate("all", angle=np.pi), "angle = 3.1416 is pi, .* give 180 "),
        (lambda: fd.Actuate("all", fold_angle=[0.0, np.pi / 2]), "fold_angle = 1.5708 is pi/2"),
        (
            lambda: fd.patterns.miura(panel_angle=1.22),
            "panel_angle = 1.22 is small for .* give 69.9 if",
        ),
        (lambda: fd.patterns.eggbox(dihedral=np.radians(71)), "dihedral = 1.2392 .* give 71 if"),
        (lambda: fd.Actuate("all", angle=[2.44, 1.67]), "angle = 2.44 is small .* 139.8"),
        (
            lambda: fd.discretize(SMALL, fd.Sheet(*STEEL), crease_rest=4.01, preset="plate"),
            "crease_rest = 4.01 .* give 229.8 if",
        ),
        (
            lambda: fd.discretize(SMALL, fd.Sheet(*STEEL), crease_rest=np.pi / 4, preset="plate"),
            "= 0.785.* is pi/4, ",
        ),
    ],
)
def test_radians(make, message):
    with pytest.warns(UnitsWarning, match=message):
        make()


def test_a_case_file_says_it_once(tmp_path, capsys):
    text = HELD_MIURA_TEXT.replace("[sheet]", f"panel_angle = {np.pi / 3}\n[sheet]")
    text = text.replace("youngs_modulus = 1e6", "youngs_modulus = 200.0")
    text = text.replace("density = 1.0", "density = 1000.0")
    (tmp_path / "case.toml").write_text(f'{text}{PLATE}[analysis]\nkind = "modes"\n')
    main(["run", str(tmp_path / "case.toml"), "--no-figures", "--out", str(tmp_path / "out")])
    said = capsys.readouterr().err
    assert said.count("is pi/3, but angles are in degrees: give 60") == 1
    assert said.count("if youngs_modulus is meant in MPa, give 2e+08") == 1
