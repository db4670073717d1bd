"""The bend law that is a plate's for small turns and superlinear for large ones."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

import foldyn as fd
from case_texts import HELD_MIURA_TEXT
from foldyn import checks
from foldyn.errors import InputError
from foldyn.materials import PlateSuperlinear, Superlinear
from foldyn.materials.plate_superlinear import SQUARE
from named_models import named

SHEET, HELD = fd.Sheet(1e6, 0.25, 0.01, density=1.0), fd.Fix("xmin", "xyz")


def structure(**options):
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.3)
    options = {"calibration": "plate", "bend_law": "plate_superlinear", **options}
    return fd.discretize(pattern, SHEET, **named(options))


def test_limits_of_the_law():
    """Linear far below the onset; k d0^(-1/3) d^(4/3) far above; 2^(1/6) of both at the onset."""
    law, d0 = PlateSuperlinear(onset=2.0), np.radians(2.0)
    small, large = 1e-4 * d0, 30.0 * d0
    assert law.moment(1.0 + small, 1.0) == pytest.approx(small, rel=1e-7)
    wanted = d0 ** (-1.0 / 3.0) * Superlinear().moment(1.0 + large, 1.0)
    assert law.moment(1.0 + large, 1.0) == pytest.approx(wanted, rel=3e-4)
    assert law.moment(1.0 - d0, 1.0) == pytest.approx(-(2.0 ** (1.0 / 6.0)) * d0)
    assert law.slope(1.0, 1.0) == 1.0


@pytest.mark.parametrize("turns", [1e-9, 1e-3, 0.0099, 0.0101, 0.3, 1.0, 7.0, 300.0])
def test_energy_is_the_integral_of_the_moment(turns):
    """To rounding, on both sides of where the energy changes to its series."""
    law, d = PlateSuperlinear(onset=0.5), turns * np.radians(0.5)
    ends = [0.0, min(0.5, 2.0 / turns), 1.0]
    integral = sum(
        quad(lambda s: float(law.moment(s * d, 0.0)) * d, a, b, epsrel=1e-13)[0]
        for a, b in pairwise(ends)
    )
    assert law.energy(d, 0.0) == pytest.approx(integral, rel=1e-13)
    assert law.energy(d, 0.0) == law.energy(-d, 0.0)


def test_onsets_of_the_bends():
    """A bend has the plate's stiffness at rest, the standard calibration's moment far from it."""
    s, plain = structure(), structure(calibration="standard", bend_law="superlinear")
    (_, bends), (_, old) = s.hinge_kinds, plain.hinge_kinds
    for row in (0, 5):
        law = bends.law_of(row)
        assert law.onset == pytest.approx(np.degrees(s.bend_onset[row]))
        far = bends.rest[row] + 1.2
        found = s.bend_stiffness[row] * law.moment(far, bends.rest[row])
        wanted = plain.bend_stiffness[row] * old.law.moment(far, old.rest[row])
        assert found == pytest.approx(wanted, rel=1e-3)
    table = s.model.hinge_parameters[s.model.hinge_group == 1]
    np.testing.assert_allclose(np.sort(table[:, 0]), np.sort(s.bend_onset**-2.0))


def test_onset_of_a_square_panel():
    """(D/t)^(1/3)/2 against 1 - nu: 8 (1 - nu)^3 t/D."""
    square = fd.Pattern([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2, 3]])
    s = fd.discretize(square, SHEET, calibration="plate", bend_law="plate_superlinear")
    np.testing.assert_allclose(s.bend_onset, 8 * 0.75**3 * 0.01 / np.sqrt(2.0), rtol=1e-12)
    np.testing.assert_allclose(s.bend_onset, SQUARE, rtol=1e-12)


@pytest.mark.parametrize("scale", [1e-4, 0.3])
def test_force_and_tangent_are_derivatives(scale):
    """Small and large motions, bends with onsets of their own: central differences."""
    s = structure(scheme="n5b8")
    u = scale * 0.1 * np.random.default_rng(1).standard_normal(s.nodes.shape)
    assert checks.gradient_error(s.energy, s.internal_force, at=u) < 1e-6
    assert checks.tangent_error(s.internal_force, s.tangent, at=u) < 1e-5


def test_modes_at_rest_are_those_of_linear_bends():
    found, linear = (
        fd.modes(fd.Case(structure(bend_law=law), [HELD]), 6).frequency.values
        for law in ("plate_superlinear", "linear")
    )
    np.testing.assert_allclose(found, linear, rtol=1e-9)


@pytest.mark.parametrize("method", ["rk4", "generalized_alpha", "energy_momentum"])
def test_motions_keep_their_energy(method):
    push = fd.Force([7], (0.0, 0.0, 2e-3), fd.HalfSine(0.2))
    motion = fd.simulate(fd.Case(structure(), [HELD], [push]), duration=0.5, method=method)
    assert abs(motion.attrs["energy_error"]) < 5e-3


@pytest.mark.matrix
def test_in_case_files_and_results(tmp_path):
    text = f"""{HELD_MIURA_TEXT}[model]
calibration = "plate"
bend_law = LAW
[analysis]
kind = "modes"
count = 2
"""
    kind, name = 'kind = "plate_superlinear"', "plate_superlinear"
    for given, law, onset in (
        (f'"{name}"', name, None), (f"{{ {kind} }}", PlateSuperlinear(), None),
        (f"{{ {kind}, onset = 3.0 }}", PlateSuperlinear(onset=3.0), np.radians(3.0)),
    ):  # fmt: skip
        (tmp_path / "case.toml").write_text(text.replace("LAW", given), "utf-8")
        fd.save(fd.read_case(tmp_path / "case.toml").run(), tmp_path / "modes.nc")
        again = fd.case_of(fd.load(tmp_path / "modes.nc")).structure
        kept = again.model.hinge_parameters[again.model.hinge_group == 1, 0]
        own = np.broadcast_to(onset or again.bend_onset, kept.shape) ** -2.0
        np.testing.assert_allclose(np.sort(kept), np.sort(own))
        assert again.options.bend_law == law and again.as_made


def test_pictures_draw_each_bend_with_its_onset():
    figure = fd.plots.plot_laws(structure())
    assert any("plate_superlinear" in axes.get_title() for axes in figure.axes)


def test_refused():
    with pytest.raises(InputError, match=r'bend_law.*calibration = "plate"'):
        structure(calibration="standard")
    with pytest.raises(InputError, match=r"fold_law.*onset"):
        structure(fold_law="plate_superlinear")
    with pytest.raises(InputError, match=r"fold_law.*onset"):
        fd.shell(fd.patterns.miura(), SHEET, divisions=2, fold_law=PlateSuperlinear())
    for onset in (0.0, -1.0, 400.0, float("nan"), "2"):
        with pytest.raises(InputError, match="onset"):
            PlateSuperlinear(onset=onset)
    given = structure(calibration="standard", bend_law=PlateSuperlinear(onset=5.0))
    assert given.hinge_kinds[1].onset is None
