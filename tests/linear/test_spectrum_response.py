"""Response spectra: closed forms of one and two masses, rigid bodies, and motions."""

from __future__ import annotations

import numpy as np
import pytest
from tests.linear.test_random_response import MASS, chain

import foldyn as fd
from foldyn.errors import InputError, ModelRangeWarning
from foldyn.linear.spectrum_response import correlation
from foldyn.signals import shock_spectrum

PATTERN = fd.patterns.simple_fold(a=0.1, b=0.1, dihedral=120)
SHEET = fd.Sheet(3e9, 0.3, 1e-3, density=1000.0)


def test_one_mass_takes_its_own_acceleration():
    case, omega = chain([500.0], [MASS]), np.sqrt(500.0 / MASS)
    spectrum = ([1.0, 100.0], [2.0, 200.0])  # 2 f
    at = {"node": 1, "axis": "x"}
    found = fd.spectrum_response(case, {"x": spectrum}).sel(at)
    own = 2.0 * omega / (2.0 * np.pi)
    np.testing.assert_allclose(found.acceleration_peak, own, rtol=1e-9)
    np.testing.assert_allclose(found.displacement_peak, own / omega**2, rtol=1e-9)
    assert found.attrs["covered_x"] == pytest.approx(1.0)


@pytest.mark.parametrize("rule", ["srss", "cqc"])
def test_two_masses(rule):
    """Modes of a chain by NumPy, combined by hand."""
    zeta, masses = 0.05, np.array([0.3, 0.003])
    case = chain([500.0, 5.0], masses, zeta)  # a tuned mass: two close frequencies
    k = np.array([[505.0, -5.0], [-5.0, 5.0]])
    root = 1.0 / np.sqrt(masses)
    values, vectors = np.linalg.eigh(k * np.outer(root, root))
    shapes, omega = root[:, None] * vectors, np.sqrt(values)
    pull = shapes.T @ masses
    r = omega[1] / omega[0]
    rho = 8 * zeta**2 * (1 + r) * r**1.5
    rho /= (1 - r**2) ** 2 + 4 * zeta**2 * r * (1 + r) ** 2
    assert rho > 0.3
    both = rho if rule == "cqc" else 0.0
    flat = {"x": ([0.5, 50.0], [3.0, 3.0])}
    found = fd.spectrum_response(case, flat, combine=rule, reactions=True)
    each = shapes * pull * 3.0
    for name, own in (("acceleration", each), ("displacement", each / omega**2)):
        square = (own**2).sum(axis=1) + 2.0 * both * own.prod(axis=1)
        at = found[f"{name}_peak"].sel(node=[1, 2], axis="x")
        np.testing.assert_allclose(at, np.sqrt(square), rtol=1e-7)
    base = masses @ each
    square = (base**2).sum() + 2.0 * both * base.prod()
    total = found.total_reaction_peak.sel(axis="x")
    np.testing.assert_allclose(total, np.sqrt(square), rtol=1e-6)


def test_what_is_stiff_moves_with_the_base():
    """All modes lie above the spectrum: every node has the acceleration of the base."""
    case = fd.Case(
        fd.superelements(PATTERN, SHEET, level=1, divisions=8, clamped="xmin"), [fd.Fix("xmin")]
    )
    with pytest.warns(ModelRangeWarning, match="have 0% of the mass"):
        found = fd.spectrum_response(case, {"z": ([0.1, 1.0], [5.0, 5.0])}, reactions=True)
    np.testing.assert_allclose(found.acceleration_peak.sel(axis="z"), 5.0, rtol=1e-6)
    mass = float(case.structure.mass.sum())
    np.testing.assert_allclose(found.total_reaction_peak.sel(axis="z"), 5.0 * mass, rtol=1e-6)


def test_equal_modes_move_together():
    np.testing.assert_allclose(correlation(np.ones(2), np.full(2, 0.05)), 1.0)
    np.testing.assert_allclose(correlation(np.array([1.0, 2.0]), np.zeros(2)), np.eye(2))


def records(count):
    """Bursts of noise from 10 to 200 Hz that rise and fall, m/s2, with the time step."""
    t = np.arange(0.0, 0.6, 2.5e-4)
    shape = (t / 0.05) * np.exp(1.0 - t / 0.05)
    f = np.arange(10.0, 200.0, 2.0)
    for seed in range(count):
        phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(f))
        waves = np.sin(2.0 * np.pi * f * t[:, None] + phase).sum(axis=1)
        yield shape * waves, float(t[1])


@pytest.mark.matrix
def test_ten_records_beside_motions():
    """Displacements of two nodes, and the sum of reactions; the docs have the means."""
    panels = fd.superelements(PATTERN, SHEET, level=1, divisions=8, clamped="xmin")
    case = fd.Case(panels, [fd.Fix("xmin")], damping=fd.ModalDamping(0.03))
    ratios = []
    for record, dt in records(10):
        f = np.geomspace(2.0, 2000.0, 300)
        spectrum = shock_spectrum(record, dt, frequency=f, damping_ratio=0.03)
        found = fd.spectrum_response(case, {"z": spectrum}, reactions=True)
        place = _twice(record, dt)
        base = fd.BaseMotion("z", history=fd.Table(dt * np.arange(len(record)), place, smooth=True))
        shaken = case.altered(supports=[*case.supports, base])
        moved = fd.simulate(shaken, dt * (len(record) - 1), interval=dt)
        relative = moved.displacement.sel(axis="z") - moved.displacement.sel(node=0, axis="z")
        chosen = (moved.support_axis == "z").values
        push = moved.reaction.values[:, chosen].sum(axis=1)
        pairs = [
            (found.displacement_peak.sel(node=5, axis="z"), np.abs(relative.sel(node=5)).max()),
            (found.displacement_peak.sel(node=2, axis="z"), np.abs(relative.sel(node=2)).max()),
            (found.total_reaction_peak.sel(axis="z"), np.abs(push).max()),
        ]
        ratios.append([float(a) / float(b) for a, b in pairs])
    assert np.mean(ratios, axis=0) == pytest.approx([0.97, 0.96, 0.88], abs=0.01)
    assert np.array(ratios) == pytest.approx(1.0, abs=0.35)


def _twice(record, dt):
    """The displacement of a base with this acceleration, from rest."""
    speed = np.append(0.0, np.cumsum(0.5 * (record[1:] + record[:-1]) * dt))
    step = speed[:-1] * dt + (2.0 * record[:-1] + record[1:]) * dt**2 / 6.0
    return np.append(0.0, np.cumsum(step))


def test_margins_of_a_shock():
    strong = fd.Sheet(3e9, 0.3, 1e-3, density=1000.0, strength=3e7)
    case = fd.Case(
        fd.superelements(PATTERN, strong, level=1, divisions=8, clamped="xmin"), [fd.Fix("xmin")]
    )
    shock = {"z": ([1.0, 20.0, 2000.0], [5.0, 200.0, 200.0])}
    with pytest.raises(InputError, match="compute it with stresses = True"):
        fd.margins(fd.spectrum_response(case, shock))
    found = fd.spectrum_response(case, shock, stresses=True)
    least = fd.margins(found).attrs["least_margin"]
    assert least == pytest.approx(3e7 / float(found.von_mises_peak.max()) - 1.0)
    fd.plots.draw_stresses(found)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({}, "base = .*give spectra by axis"),
        ({"u": ([1.0, 2.0], [1.0, 1.0])}, 'base = "u": choose one of x, y, z'),
        ({"x": 3.0}, r"base\['x'\]: give a spectrum"),
        ({"x": ([2.0, 1.0], [1.0, 1.0])}, r"base\['x'\]\[0\]\[1\] = 1.0: must increase"),
        ({"x": ([1.0, 2.0], [1.0, -1.0])}, "an acceleration .* above 0"),
        ({"x": ([10.0, 20.0], [1.0, 1.0])}, "begins at 10 Hz, above the mode at 6.497 Hz"),
    ],
)
def test_refused_spectra(given, told):
    with pytest.raises(InputError, match=told):
        fd.spectrum_response(chain([500.0], [MASS]), given)


def test_what_stands_on_the_ground_is_refused():
    case = chain([500.0], [MASS])
    case = case.altered(supports=[*case.supports, fd.Spring(5.0, [1], direction="x")])
    with pytest.raises(InputError, match="supports: springs, dashpots or planes"):
        fd.spectrum_response(case, {"x": ([1.0, 100.0], [1.0, 1.0])})
