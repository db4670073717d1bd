"""`sensitivity` and what it takes: sources, parameters, measures, and bad input."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from differences import Design

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.gradients.parameters import Parameters, Slope, numbers_of
from foldyn.mechanics.pullback import Arrays
from named_models import named

MODES = {"kind": "modes", "count": 3}
CASE = """
[pattern]
kind = "miura"
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.02
density = 900.0
[[supports]]
nodes = "xmin"
[model]
preset = "plate"
[analysis]
kind = "modes"
count = 3
"""


def cell(
    panel_angle: float = 60.0, thickness: Any = 0.02, stiffness: Any = 0.02, cells: int = 1,
    force: float = 0.0,
) -> fd.Case:  # fmt: skip
    pattern = fd.patterns.miura(cells=(int(cells), 1), panel_angle=panel_angle)
    own = [fd.PanelSheet(k, thickness=float(t)) for k, t in enumerate(np.ravel(thickness))]
    several = np.ndim(thickness) > 0
    sheet = fd.Sheet(1e6, 0.25, 0.02 if several else thickness, 900.0, panels=own * several)
    made = fd.discretize(pattern, sheet, preset="merlin2", bend_law="linear",
                         crease_stiffness=stiffness)  # fmt: skip
    loads = [fd.Force("xmax", (force, 0.0, 0.0))] if force else []
    return fd.Case(made, [fd.Fix("xmin")], loads)


def test_names_and_dimensions():
    values = {"panel_angle": 60.0, "stiffness": np.full(4, 0.02)}
    found = fd.sensitivity(cell, values, measures=["frequency[1]", "mass"], analysis=MODES)
    assert found["measure"].values.tolist() == ["frequency[1]", "mass"]
    assert found["gradient_panel_angle"].dims == ("measure",)
    assert found["gradient_stiffness"].dims == ("measure", "stiffness_entry")
    assert found["gradient_stiffness"].shape == (2, 4)
    assert found.attrs["analysis"] == "modes"


def test_expressions_follow_the_chain_rule():
    values = {"panel_angle": 60.0}
    ratio = "-frequency[2] / frequency[1] + min(mass, 1e9) ** 2"
    found = fd.sensitivity(
        cell, values, measures=["frequency[1]", "frequency[2]", "mass", ratio], analysis=MODES
    )
    (f1, f2, m, r), (d1, d2, dm, dr) = found["value"].values, found["gradient_panel_angle"].values
    assert r == pytest.approx(-f2 / f1 + m**2)
    assert dr == pytest.approx(-d2 / f1 + f2 * d1 / f1**2 + 2.0 * m * dm, rel=1e-12)


@pytest.mark.matrix
def test_a_case_file_is_changed_by_its_keys(tmp_path):
    (tmp_path / "cell.toml").write_text(CASE)
    values = {"pattern.panel_angle": 61.0, "sheet.thickness": 0.02}
    found = fd.sensitivity(tmp_path / "cell.toml", values, measures="frequency[1]")

    def own(panel_angle: float, thickness: float) -> fd.Case:
        pattern = fd.patterns.miura(panel_angle=panel_angle)
        made = fd.discretize(pattern, fd.Sheet(1e6, 0.25, thickness, 900.0), preset="plate")
        return fd.Case(made, [fd.Fix("xmin")])

    other = fd.sensitivity(
        own, {"panel_angle": 61.0, "thickness": 0.02}, measures="frequency[1]", analysis=MODES
    )
    assert found["gradient_pattern.panel_angle"].values == pytest.approx(
        other["gradient_panel_angle"].values, rel=1e-6
    )
    assert found["gradient_sheet.thickness"].values == pytest.approx(
        other["gradient_thickness"].values, rel=1e-6
    )


def test_a_case_file_that_starts_from_a_state_is_refused(tmp_path):
    own = CASE.replace('kind = "modes"\ncount = 3', 'kind = "dynamics"\nduration = 0.1')
    (tmp_path / "cell.toml").write_text(
        own.replace('[[supports]]\nnodes = "xmin"', "") + "[initial]\nvelocity = [0.0, 0.0, 0.1]\n"
    )
    with pytest.raises(InputError, match=r"cell.toml: initial: there are no gradients"):
        fd.sensitivity(tmp_path / "cell.toml", {"sheet.thickness": 0.02}, measures="mass")


def test_an_own_measure_with_its_derivative():
    def ratio(result: Any, case: fd.Case) -> float:
        return float(result["frequency"][1] / result["frequency"][0])

    def slope(result: Any, case: fd.Case) -> dict[str, Any]:
        first, second = result["frequency"].values[:2]
        return {"frequency": np.array([-second / first**2, 1.0 / first, 0.0])}

    values = {"panel_angle": 60.0}
    own = fd.sensitivity(cell, values, measures={"ratio": (ratio, slope)}, analysis=MODES)
    text = fd.sensitivity(cell, values, measures="frequency[2] / frequency[1]", analysis=MODES)
    for name in ("value", "gradient_panel_angle"):
        assert own[name].values == pytest.approx(text[name].values, rel=1e-12)


# ------------------------------------------------------------------ parameters
def most_entries(slope: Slope) -> int:
    """How many entries of the parameter a number depends on, at the most."""
    return max(int(np.diff(by.indptr).max(initial=0)) for by in slope.by.values())


def test_stiffnesses_of_creases_are_told_apart_at_once():
    calls = []

    def build(stiffness: Any) -> fd.Case:
        calls.append(1)
        return cell(stiffness=stiffness)

    design = Parameters(build, {"stiffness": np.linspace(0.01, 0.04, 4)}, {})
    slope = design.slopes(numbers_of)["stiffness"]
    assert most_entries(slope) == 1
    assert len(calls) < 15
    assert sorted(slope.by["0.hinge_stiffness"].indices.tolist()) == [0, 1, 2, 3]


@pytest.mark.matrix
def test_thicknesses_of_panels_share_edges_and_are_changed_one_by_one():
    design = Parameters(cell, {"thickness": np.linspace(0.015, 0.02, 4)}, {})
    slope = design.slopes(numbers_of)["thickness"]
    assert most_entries(slope) > 1
    found = fd.sensitivity(cell, design.values, measures=["frequency[1]", "mass"], analysis=MODES)
    assert found["gradient_thickness"].shape == (2, 4)
    total = fd.sensitivity(cell, {"thickness": 0.02}, measures="mass", analysis=MODES)
    each = fd.sensitivity(cell, {"thickness": np.full(4, 0.02)}, measures="mass", analysis=MODES)
    assert each["gradient_thickness"].values.sum() == pytest.approx(
        total["gradient_thickness"].values[0], rel=1e-9
    )


@pytest.mark.matrix
def test_entries_that_are_mixed_are_changed_one_by_one():
    """As a filter mixes them, however much smaller than others the mixed stiffness is."""

    def build(values: Any) -> fd.Case:
        stiffness = 0.03 * np.asarray(values)
        stiffness[2] = 0.015 * (values[1] + values[3])  # whose own entry has no influence
        stiffness[0] *= 1e5
        return cell(stiffness=stiffness)

    values = np.array([1.0, 1.2, 1.1, 1.0])
    design = Design(build, {"values": values}, ["frequency[2]"], MODES)
    found = design.gradient()["values"][0]
    assert found[2] == 0.0
    for k in (1, 3):
        alone = {"values": np.eye(4)[k]}
        assert found[k] == pytest.approx(design.difference(alone)[0], rel=1e-5)


@pytest.mark.parametrize("count", [2, 3, 7, 40])
def test_entries_are_told_apart_exactly(count):
    """A number of one entry from one that has a little of another, or the difference of two."""

    def slope(case_of: Any) -> Any:
        design = Parameters(case_of, {"values": np.logspace(-3.0, 1.0, count)}, {})
        return design.slopes(lambda numbers: Arrays({"own": numbers}, {}))["values"]

    apart = slope(lambda values: values[::-1] ** 3)
    assert most_entries(apart) == 1
    assert apart.by["own"].indices.tolist() == list(range(count))[::-1]
    seed = np.linspace(1.0, 2.0, count)
    expected = 3.0 * np.logspace(-3.0, 1.0, count) ** 2 * seed[::-1]
    assert apart.pulled({"own": seed}) == pytest.approx(expected, rel=1e-9)
    for other in (1e-6, -1.0):
        mixed = slope(lambda values, by=other: np.append(values, values[0] + by * values[-1]))
        assert most_entries(mixed) == 2
        last = mixed.pulled({"own": np.append(np.zeros(count), 1.0)})
        assert last[[0, -1]] == pytest.approx([1.0, other], rel=1e-6)


@pytest.mark.matrix
def test_stiffnesses_of_several_decades():
    values = {"stiffness": np.array([2e-5, 0.02, 5.0, 3e-3])}
    found = fd.sensitivity(cell, values, measures="frequency[1]", analysis=MODES)[
        "gradient_stiffness"
    ].values[0]

    def own(k: int) -> float:
        """From a case in which that crease alone is a parameter."""

        def build(one: float) -> fd.Case:
            return cell(stiffness=np.where(np.arange(4) == k, one, values["stiffness"]))

        one = fd.sensitivity(
            build, {"one": values["stiffness"][k]}, measures="frequency[1]", analysis=MODES
        )
        return float(one["gradient_one"].values[0])

    assert found == pytest.approx([own(k) for k in range(4)], rel=1e-8)


@pytest.mark.matrix
@pytest.mark.parametrize("preset", ["plate", "herkal"])
def test_a_kink_of_the_design_is_warned_of(preset):
    """Plates bend otherwise beyond corners of 120 degrees; rectangles along either diagonal."""
    flat = fd.patterns.simple_fold(b=1.2, dihedral=110.0)

    def build(shift: float) -> fd.Case:
        points = flat.vertices.copy()
        points[5, 2] += shift
        pattern = fd.Pattern(points, flat.faces)
        if preset == "plate":
            pattern = fd.patterns.miura(panel_angle=60.0 + shift, dihedral=110.0)
        options = {"preset": preset, "bend_law": "linear" if preset == "herkal" else None}
        made = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.02, 900.0), **named(options))
        return fd.Case(made, [fd.Fix([0, 1, 2, 3])])

    with pytest.warns(FoldynWarning, match=r"shift: the numbers of the case .* have a kink here"):
        fd.sensitivity(build, {"shift": 0.0}, measures="mass", analysis=MODES, sizes={"shift": 0.1})
    fd.sensitivity(
        build, {"shift": 0.01}, measures="mass", analysis=MODES
    )  # beside it there is none


@pytest.mark.parametrize("thickness", [0.016, 0.018, 0.02, 0.021])
def test_rounding_of_what_is_always_zero_is_no_kink(thickness):
    def rounding(result, case: fd.Case) -> float:
        return (float(case.structure.sheet.thickness) + 0.1) - 0.1 - case.structure.sheet.thickness

    own = {"zero": (rounding, lambda result, case: {})}
    with warnings.catch_warnings():
        warnings.filterwarnings("error", ".* have a kink here", FoldynWarning)
        found = fd.sensitivity(cell, {"thickness": thickness}, measures=own, analysis=MODES)
    assert abs(float(found.gradient_thickness[0])) < 1e-7


@pytest.mark.parametrize("size", [0.0, -0.01, 1e-12])
def test_sizes_that_differences_cannot_take_are_refused(size):
    with pytest.raises(InputError, match=r"sizes\.thickness = .*above 0, and at least 2e-08"):
        fd.sensitivity(
            cell, {"thickness": 0.02}, measures="mass", analysis=MODES, sizes={"thickness": size}
        )
    with pytest.raises(InputError, match=r"sizes\.force = .*give a size above 0: differences"):
        fd.sensitivity(
            cell, {"force": 0.0}, measures="mass", analysis=MODES, sizes={"force": -abs(size)}
        )


def test_a_parameter_of_zero_needs_a_size():
    state = {**MODES, "state": "equilibrium"}

    def build(force: float) -> fd.Case:
        made = cell()
        return fd.Case(made.structure, made.supports, [fd.Force("xmax", (force + 0.01, 0, 0))])

    with pytest.raises(InputError, match=r"force = 0: .*sizes="):
        fd.sensitivity(build, {"force": 0.0}, measures="frequency[1]", analysis=state)
    found = fd.sensitivity(
        build, {"force": 0.0}, measures="frequency[1]", analysis=state, sizes={"force": 0.01}
    )
    assert found["gradient_force"].values[0] != 0.0


def test_measures_of_an_expression_take_their_own_arguments():
    """Whichever comes first: the mass, which has none, or a frequency."""
    values, texts = {"panel_angle": 60.0, "thickness": 0.02}, ["mass", "frequency[1]"]
    pairs = "mass * frequency[1]", "frequency[1] * mass"
    found = fd.sensitivity(cell, values, measures=[*texts, *pairs], analysis=MODES)
    mass, frequency, *products = found["gradient_thickness"].values
    expected = mass * found["value"].values[1] + frequency * found["value"].values[0]
    np.testing.assert_allclose(products, expected, rtol=1e-12)
    assert abs(mass) > 0.0


# ------------------------------------------------------------------ bad input
@pytest.mark.parametrize(
    ("build", "values", "measures", "analysis", "told"),
    [
        (cell, {"cells": 2.0}, "frequency[1]", MODES, "cells"),
        (cell, {"angle": 60.0}, "frequency[1]", MODES, "build cannot take these parameters"),
        (cell, {}, "frequency[1]", MODES, "parameters = .*give a mapping of names"),
        (cell, {"panel_angle": "wide"}, "frequency[1]", MODES, "panel_angle = 'wide'|\"wide\""),
        (cell, {"panel_angle": np.nan}, "frequency[1]", MODES, "finite number"),
        (cell, {"panel_angle": "60"}, "frequency[1]", MODES, "panel_angle = .60.: must be numbers"),
        (
            cell,
            {"panel_angle": 60.0},
            "velocity[5,x]",
            MODES,
            "a result of kind dynamics, not modes",
        ),
        (cell, {"panel_angle": 60.0}, "frequence[1]", MODES, "no measure frequence"),
        (cell, {"panel_angle": 60.0}, [], MODES, "measures: none"),
        (cell, {"panel_angle": 60.0}, "frequency[1]", None, "say what is computed"),
        (cell, {"panel_angle": 60.0}, "frequency[1]", {"kind": "mode"}, "analysis.kind = "),
        (3, {"panel_angle": 60.0}, "frequency[1]", MODES, "a function, a case or a case file"),
        (cell(), ["fold_stiffnes"], "frequency[1]", MODES, "fold_stiffness"),
        (cell(), {"fold_stiffness": np.ones(3)}, "frequency[1]", MODES, "shape"),
        (cell, {"panel_angle": 60.0}, {"own": len}, MODES, "a pair of a function and its deriv"),
        (cell, {"panel_angle": 60.0}, "open('x')", MODES, "measures"),
    ],
)
def test_bad_input(build, values, measures, analysis, told):
    with pytest.raises(InputError, match=told):
        fd.sensitivity(build, values, measures=measures, analysis=analysis)


def test_what_changes_the_topology_is_named():
    def build(share: float) -> fd.Case:
        made = cell()
        held = "xmin" if share <= 0.5 else ["xmin", "xmax"][:2]
        return fd.Case(made.structure, [fd.Fix(one) for one in np.atleast_1d(held)])

    with pytest.raises(InputError, match=r"share: changes what is connected, held.*fd.sweep"):
        fd.sensitivity(build, {"share": 0.5}, measures="frequency[1]", analysis=MODES)
