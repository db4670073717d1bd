"""Gradients of superelements, against differences and laws of scaling."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from differences import Design

import foldyn as fd
from foldyn.errors import InputError

MIURA = fd.patterns.miura(cells=(1, 1), panel_angle=55, dihedral=100)
PUSH = fd.Force([5], (1e-3, 0.0, 2e-3))
MODES: dict[str, Any] = {"kind": "modes", "count": 3}
SQUARES = dict(MODES)  # of another pattern
STATICS = {"kind": "statics", "method": "newton", "load_factors": [1.0]}
FRF = {"kind": "frf", "drive": [PUSH], "frequencies": [0.4, 1.1]}
BASE = {**FRF, "drive": [fd.BaseMotion("z")]}


def case(
    pattern: fd.Pattern = MIURA, modulus: float = 1e9, ratio: float = 0.3,
    thickness: float = 0.01, density: float = 1000.0, stiffness: Any = None, mass: float = 5.0,
    springs: float = 0.0, loads: Any = (),
) -> fd.Case:  # fmt: skip
    sheet = fd.Sheet(modulus, ratio, thickness, density)
    made = fd.superelements(pattern, sheet, level=3, divisions=8, crease_stiffness=stiffness)
    supports: list[Any] = [fd.Fix("xmin", along=True)]
    if springs:
        supports.append(fd.Spring(springs, nodes=[5]))
    masses = [fd.PointMass([5], mass)] if mass else []
    return fd.Case(made, supports, loads, fd.Rayleigh(0.1, 1e-3), masses)


@pytest.mark.matrix
def test_frequencies_scale_with_modulus_and_density():
    found = fd.sensitivity(
        lambda **given: case(mass=0.0, **given), {"modulus": 1e9, "density": 1000.0},
        measures=["frequency[1]", "frequency[3]"], analysis=MODES,
    )  # fmt: skip
    half = 0.5 * found["value"]
    np.testing.assert_allclose(1e9 * found["gradient_modulus"], half, rtol=1e-8)
    np.testing.assert_allclose(1000.0 * found["gradient_density"], -half, rtol=1e-8)


STIFF = np.linspace(2.0, 5.0, 4)
SHAPES = ["frequency[3]", "damping_ratio[2]", "effective_mass[2,z]"]
RESPONSE = ["response[5,z,1.1]"]


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("values", "measures", "analysis"),
    [
        ({"thickness": 0.01, "stiffness": STIFF, "mass": 5.0}, SHAPES, MODES),
        ({"ratio": 0.3, "springs": 300.0}, ["frequency[1]", "frequency[3]"], SQUARES),
        ({"thickness": 0.01, "stiffness": STIFF}, ["displacement[5,z]", "strain_energy"], STATICS),
        ({"thickness": 0.01, "mass": 5.0}, RESPONSE, FRF),
        ({"density": 1000.0}, RESPONSE, BASE),
    ],
)  # fmt: skip
def test_gradients_agree_with_differences(values, measures, analysis):
    options = {"loads": [PUSH]} if analysis is STATICS else {}
    if analysis is SQUARES:  # vibrations of equal frequency
        options["pattern"] = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=120)
        analysis = MODES
    design = Design(lambda **given: case(**given, **options), values, measures, analysis)
    design.step = 2e-3
    errors = design.errors()
    assert max(errors.values()) < 1e-5, errors  # panels are condensed to 1e-9


@pytest.mark.parametrize(
    ("build", "analysis", "named"),
    [
        (
            lambda x: case(fd.patterns.miura(cells=(1, 1), panel_angle=x)), MODES,
            "x: changes .*shape of superelements",
        ),
        (
            lambda x: case(modulus=1e9 * x, loads=[fd.Gravity("-z")]), STATICS,
            "between the vertices of superelements",
        ),
        (
            lambda x: case(modulus=1e9 * x, loads=[fd.Actuate("all", 100.0)]), STATICS, "actuated",
        ),
    ],
)  # fmt: skip
def test_what_has_no_gradient_is_refused(build, analysis, named):
    measure = "frequency[1]" if analysis is MODES else "displacement[5,z]"
    with pytest.raises(InputError, match=named):
        fd.sensitivity(build, {"x": 55.0}, measures=measure, analysis=analysis)
