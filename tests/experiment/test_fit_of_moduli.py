"""The classic test of an orthotropic plate: its moduli from frequencies while it hangs free."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.experiment import NaturalFrequencies, Parameter

CASE = """
[pattern]
vertices = [[0, 0, 0], [0.2, 0, 0], [0.2, 0.2, 0], [0, 0.2, 0]]
faces = [[0, 1, 2, 3]]
[sheet]
youngs_modulus = [120e9, 10e9]
poissons_ratio = 0.3
shear_modulus = 5e9
thickness = 1e-3
density = 1600
direction = 0
[model]
kind = "superelements"
divisions = 4
[analysis]
kind = "modes"
count = 14
"""
TRUTH = {
    "sheet.youngs_modulus[0]": 120e9, "sheet.youngs_modulus[1]": 10e9, "sheet.shear_modulus": 5e9,
}  # fmt: skip
GUESS = 100e9, 12e9, 4e9
NOISE = 0.005


@pytest.mark.matrix
def test_moduli_of_a_free_plate_lie_in_their_intervals(tmp_path):
    """Five frequencies with noise of 0.5 %: of 100 seeds 95, 96 and 95 are inside."""
    path = tmp_path / "free.toml"
    path.write_text(CASE)
    exact = fd.read_case(path).run().frequency.values
    exact = exact[exact > 1.0][:5]
    inside = dict.fromkeys(TRUTH, 0)
    for seed in range(3):
        noisy = exact * (1.0 + NOISE * np.random.default_rng(seed).standard_normal(5))
        fit = fd.fit(
            path,
            [NaturalFrequencies(frequency=noisy, sigma=NOISE * exact)],
            parameters=[Parameter(*each) for each in zip(TRUTH, GUESS, strict=True)],
        )
        for key, truth in TRUTH.items():
            found = fit[key]
            inside[key] += found.lower <= truth <= found.upper
            assert abs(found.value / truth - 1.0) < 0.1
    assert min(inside.values()) == 3, inside
