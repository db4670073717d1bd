"""Gradients of stresses, moments of creases and margins of paths."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from differences import Design

import foldyn as fd
from foldyn.errors import InputError

PATH: dict[str, Any] = {"kind": "statics", "method": "newton", "load_factors": [0.5, 1.0]}
MEASURES = ["von_mises", "crease_moment[2]", "margin"]


def strip(model: str, thickness: float, width: float = 0.1) -> fd.Case:
    """A clamped strip without creases under a force at its end."""
    pattern = fd.Pattern([[0, 0, 0], [1, 0, 0], [1, width, 0], [0, width, 0]], [(0, 1, 2, 3)])
    sheet = fd.Sheet(7e10, 0.0, thickness, 2700.0, strength=1e8)
    make = fd.shell if model == "shell" else fd.superelements
    structure = make(pattern, sheet, divisions=8, clamped=[(0, 3)])
    push = fd.Force([1, 2], (0.0, 0.0, -1e-3))
    return fd.Case(structure, [fd.Fix([0, 3], "xyz")], [push])


@pytest.mark.matrix
@pytest.mark.parametrize("model", ["shell", "superelements"])
def test_stress_falls_with_the_square_of_the_thickness(model):
    """6 P L / (b t2) at any point: its logarithm changes by -2 dt/t and by -db/b."""
    values = {"thickness": 5e-3, "width": 0.1}
    if model == "superelements":  # have no gradients by their shape
        del values["width"]
    found = fd.sensitivity(
        lambda **given: strip(model, **given), values, measures=["von_mises", "margin"],
        analysis=PATH,
    )  # fmt: skip
    stress, margin = found["value"].values
    falls, grows = 5e-3 * found["gradient_thickness"].values
    np.testing.assert_allclose([falls / stress, grows / (margin + 1.0)], [-2.0, 2.0], rtol=0.01)
    if model == "shell":
        narrower, _ = 0.1 * found["gradient_width"].values
        np.testing.assert_allclose(narrower / stress, -1.0, rtol=0.01)


def folded(model: str, thickness: float, stiffness: Any, panel_angle: float = 62.0) -> fd.Case:
    """A Miura-ori held at one side, under a force at one vertex: no two stresses are equal."""
    pattern = fd.patterns.miura(cells=(1, 1), panel_angle=panel_angle, dihedral=110)
    sheet = fd.Sheet(1e8, 0.3, thickness, 1000.0, strength=1e5)
    make: Any = {
        "shell": partial(fd.shell, divisions=2),
        "superelements": partial(fd.superelements, level=1, divisions=4),
    }.get(model, partial(fd.discretize, preset=model))
    structure = make(pattern, sheet, crease_stiffness=stiffness)
    push = fd.Force([int(pattern.vertices[:, 0].argmax())], (0.0, 1e-3, -5e-3))
    return fd.Case(structure, [fd.Fix("xmin", "xyz")], [push])


@pytest.mark.matrix
@pytest.mark.parametrize("model", ["shell", "superelements", "n5b8e", "merlin2"])
def test_gradients_agree_with_differences(model):
    values: dict[str, Any] = {"thickness": 0.02, "stiffness": np.linspace(0.04, 0.07, 4)}
    if model != "superelements":  # the shape of which is condensed again
        values["panel_angle"] = 62.0
    measures = MEASURES[1:2] if model == "merlin2" else MEASURES
    design = Design(lambda **given: folded(model, **given), values, measures, PATH)
    design.step = 2e-2 if model == "superelements" else 2e-3
    errors = design.errors()
    rough = 3e-3 if model == "superelements" else 5e-4  # stresses are rounded at 1e-9
    assert max(errors.values()) < rough, errors


@pytest.mark.matrix
def test_the_thinnest_strip_that_holds():
    best = fd.design(
        lambda thickness: strip("superelements", thickness),
        {"thickness": (2e-3, 2e-2)}, minimize="mass", subject_to=["von_mises <= 2e4"],
        analysis=PATH,
    )  # fmt: skip
    here = best["parameters"]["thickness"]
    there = fd.trace(strip("superelements", here), steps=1)
    np.testing.assert_allclose(fd.stresses(there).von_mises.max(), 2e4, rtol=1e-3)
    assert 2e-3 < here < 2e-2


def test_what_has_no_gradient_is_refused():
    def build(x: float, model: str = "merlin2") -> fd.Case:
        return folded(model, x, 0.05)

    held = {"kind": "statics", "method": "arc_length", "steps": 2}
    with pytest.raises(InputError, match="crease_moment: point 0 of the path has no given load"):
        fd.sensitivity(build, {"x": 0.02}, measures="crease_moment", analysis=held)
    moving = {"kind": "dynamics", "duration": 1e-3, "dt": 1e-4, "method": "rk4"}
    with pytest.raises(InputError, match=r"crease_moment.*derivatives of paths only"):
        fd.sensitivity(build, {"x": 0.02}, measures="crease_moment", analysis=moving)
    with pytest.raises(InputError, match=r"crease_moment: .*bar_length"):
        fd.sensitivity(build(0.02), ["bar_length"], measures="crease_moment", analysis=PATH)


@pytest.mark.matrix
@pytest.mark.parametrize("force", [0.2, 15.0])
def test_a_small_moment_changes_as_a_large_one(force):
    """Its sign is that of the design, so that its size has no kink where it is nearly 0."""
    case = folded("merlin2", 0.02, np.full(4, 0.05))
    push = replace(case.loads[0], vector=(0.0, 1e-3 * force, -5e-3 * force))

    def build(rest: float) -> fd.Case:
        angles = case.structure.fold_rest.copy()
        angles[2] = rest
        return replace(case, structure=replace(case.structure, fold_rest=angles), loads=[push])

    path = {"kind": "statics", "method": "newton", "load_factors": [1.0]}
    design = Design(build, {"rest": case.structure.fold_rest[2]}, ["crease_moment[2]"], path)
    design.step = 1e-7
    exact = design.difference({"rest": 1.0})
    np.testing.assert_allclose(design.gradient()["rest"], exact, rtol=0.01)


def flaps(left: float, right: float) -> fd.Case:
    """A held strip with a flap at each end, each under a force of its own."""
    x = [-2, -1, 0, 1, 2]
    points = [(a, b, 0.3 * (abs(a) == 2)) for a in x for b in (0, 1)]
    pattern = fd.Pattern(points, [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(4)])
    made = fd.discretize(
        pattern, fd.Sheet(1e8, 0.3, 0.01, 1000.0), preset="merlin2", crease_stiffness=0.05
    )
    pushes = [fd.Force([0, 1], (0, 0, left)), fd.Force([8, 9], (0, 0, right))]
    return fd.Case(made, [fd.Fix(range(2, 8), "xyz")], pushes)


def test_equal_moments_that_separate_have_no_derivative():
    """Two flaps that are mirror images: together they change alike, one alone does not."""
    alike = {"measures": "crease_moment", "analysis": PATH}
    with pytest.raises(InputError, match="reached at 2 places at once"):
        fd.sensitivity(flaps, {"left": 1e-4, "right": 1e-4}, **alike)
    found = fd.sensitivity(lambda both: flaps(both, both), {"both": 1e-4}, **alike)
    one = fd.sensitivity(
        lambda left: flaps(left, 1e-4), {"left": 1e-4}, measures="crease_moment[0]", analysis=PATH
    )
    np.testing.assert_allclose(found["gradient_both"], one["gradient_left"], rtol=1e-6)
    assert found["gradient_both"].item() > 0.0
