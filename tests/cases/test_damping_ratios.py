"""Rayleigh damping from two damping ratios."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError


def test_the_pair_of_the_paper():
    """13.5 % at 9.3 Hz and 9 % at 16.7 Hz (Herkal et al., section 7): 14.4 1/s and 4.1e-4 s."""
    damping = fd.Rayleigh.from_ratios(9.3, 0.135, 16.7, 0.09)
    assert (damping.alpha, damping.beta) == pytest.approx((14.4, 4.1e-4), rel=2e-3)


@pytest.mark.parametrize("seed", range(20))
def test_the_ratios_come_back(seed):
    random = np.random.default_rng(seed)
    alpha, beta = random.uniform(0.0, 30.0), random.uniform(0.0, 1e-2)
    f1, f2 = random.uniform(0.1, 50.0, 2)
    z1, z2 = (alpha / (4 * np.pi * f) + beta * np.pi * f for f in (f1, f2))
    found = fd.Rayleigh.from_ratios(f1, z1, f2, z2, "start")
    assert (found.alpha, found.beta) == pytest.approx((alpha, beta), rel=1e-9, abs=1e-12)
    assert found.state == "start"


def test_alone():
    """Ratios as of one of the two: exactly zero, or its rounding, for the other."""
    one = fd.Rayleigh.from_ratios(2.0, 0.1, 4.0, 0.05)
    assert one.beta == pytest.approx(0.0, abs=1e-17) and one.alpha == pytest.approx(0.8 * np.pi)
    other = fd.Rayleigh.from_ratios(4.0, 0.1, 2.0, 0.05)
    assert other.alpha == pytest.approx(0.0, abs=1e-15)


def test_modes_have_them():
    s = fd.discretize(fd.patterns.miura(), fd.Sheet(1e6, 0.25, 0.01, 1.0), bend_law="linear")
    held = [fd.Fix("xmin", "xyz")]
    f = fd.modes(fd.Case(s, held), 3).frequency.values
    damping = fd.Rayleigh.from_ratios(f[0], 0.02, f[2], 0.05)
    ratios = fd.modes(fd.Case(s, held, damping=damping), 3).damping_ratio.values
    assert ratios[[0, 2]] == pytest.approx([0.02, 0.05], rel=1e-9)
    assert ratios[1] < 0.05


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((1, 0.1, 2, 0.3), r"z2 = 0.3: .* from 0.05 \(alpha alone\) to 0.2 \(beta alone\)"),
        ((2, 0.1, 1, 0.01), r"z2 = 0.01: .* from 0.05 \(beta alone\) to 0.2 \(alpha alone\)"),
        ((1, 0.1, 1, 0.1), "f2 = 1: must differ from f1"),
        ((0, 0.1, 1, 0.1), "f1 = 0: must be greater than 0"),
        ((1, -0.1, 2, 0.1), "z1 = -0.1: must be at least 0"),
        ((1, "a", 2, 0.1), 'z1 = "a"'),
    ],
)
def test_bad_input(given, words):
    with pytest.raises(InputError, match=words):
        fd.Rayleigh.from_ratios(*given)
