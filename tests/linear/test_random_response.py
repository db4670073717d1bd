"""Random vibration: mean squares beside closed forms and beside simulated noise."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import solve_continuous_lyapunov

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError, ModelRangeWarning
from verification.benchmarks.noise import MASS, ZETA, chain


def noise(value, low=1e-3, high=1e4, unit="m2/s3"):
    return fd.SpectralDensity([low, high], [value, value], unit)


def test_the_mean_square_of_one_mass_under_white_noise():
    """pi f S (1 + 4 zeta^2) / (4 zeta) of the absolute acceleration (Crandall and Mark, 1963).

    And S / (64 pi^3 f^3 zeta) of the relative displacement; both for all frequencies from 0.
    """
    case, s = chain([500.0], [MASS]), 0.2
    f = np.sqrt(500.0 / MASS) / (2.0 * np.pi)
    found = fd.random_response(case, base={"x": noise(s, 1e-6, 1e7)}).sel(node=1, axis="x")
    accelerated = np.pi * f * s * (1.0 + 4.0 * ZETA**2) / (4.0 * ZETA)
    np.testing.assert_allclose(found.acceleration_rms**2, accelerated, rtol=1e-6)
    np.testing.assert_allclose(
        found.displacement_rms**2, s / (64 * np.pi**3 * f**3 * ZETA), rtol=1e-6
    )
    np.testing.assert_allclose(found.displacement_crossings, f, rtol=1e-6)


@pytest.mark.parametrize("zeta", [1e-5, 0.3])
def test_band_limited_noise(zeta):
    """The integral between two frequencies, one of them on the slope of the peak."""
    case = chain([500.0], [MASS], zeta)
    f = np.sqrt(500.0 / MASS) / (2.0 * np.pi)
    low, high = 0.2 * f, 1.05 * f
    density = fd.SpectralDensity([low, 0.5 * f, high], [0.1, 0.4, 0.4], "m2/s3")
    found = fd.random_response(case, base={"x": density}).sel(node=1, axis="x")

    def power(x):
        return (
            float(density.at(x))
            * (1 + (2 * zeta * x / f) ** 2)
            / ((1 - (x / f) ** 2) ** 2 + (2 * zeta * x / f) ** 2)
        )

    near = [f * (1 + side * zeta * 4.0**k) for k in range(-3, 9) for side in (-1, 1)]
    ends = sorted({low, 0.5 * f, high, f, *(x for x in near if low < x < high)})
    true = sum(quad(power, a, b, epsrel=1e-11)[0] for a, b in pairwise(ends))
    np.testing.assert_allclose(found.acceleration_rms**2, true, rtol=1e-6)


def test_three_masses_beside_the_lyapunov_equation():
    """With a dashpot that couples the modes, white forces on one mass and on another, alone."""
    stiffness, masses = np.array([300.0, 200.0, 100.0]), np.array([0.3, 0.2, 0.1])
    case = chain(stiffness, masses).altered(
        supports=[*chain(stiffness, masses).supports, fd.Dashpot(0.05, [3])],
        damping=fd.Rayleigh(0.4),
    )
    s = (0.02, 0.05)
    found = fd.random_response(
        case,
        forces=[(fd.Force([2], (1, 0, 0)), noise(s[0], 1e-5, 1e6, "N2/Hz")),
                (fd.Force([3], (2, 0, 0)), noise(s[1], 1e-5, 1e6, "N2/Hz"))],
    )  # fmt: skip
    k = np.diag(stiffness + np.append(stiffness[1:], 0.0)) - np.diag(stiffness[1:], 1)
    k -= np.diag(stiffness[1:], -1)
    c = np.diag(0.4 * masses) + np.diag([0.0, 0.0, 0.05])
    inverse = np.diag(1.0 / masses)
    a = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ k, -inverse @ c]])
    b = np.zeros((6, 2))
    b[4, 0], b[5, 1] = 1.0 / masses[1], 2.0 / masses[2]
    square = solve_continuous_lyapunov(a, -0.5 * b @ np.diag(s) @ b.T)  # one-sided densities
    rms = found.displacement_rms.sel(node=[1, 2, 3], axis="x")
    np.testing.assert_allclose(rms**2, np.diag(square)[:3], rtol=1e-6)
    rate = np.sqrt(np.diag(square)[3:] / np.diag(square)[:3]) / (2.0 * np.pi)
    crossings = found.displacement_crossings.sel(node=[1, 2, 3], axis="x")
    np.testing.assert_allclose(crossings, rate, rtol=1e-4)  # of velocities the tail is longer


SHEET = fd.Sheet(3e9, 0.3, 1e-3, density=1000.0)
PATTERN = fd.patterns.simple_fold(a=0.1, b=0.1, dihedral=120)


def folded(structure):
    return fd.Case(structure, [fd.Fix("xmin")], damping=fd.Rayleigh(20.0))


@pytest.mark.matrix
@pytest.mark.parametrize("driven", ["force", "base"])
def test_a_folded_sheet_beside_simulated_noise(driven):
    """Within three standard errors of the mean square over 16 s."""
    case = folded(fd.superelements(PATTERN, SHEET, level=1, divisions=8, clamped="xmin"))
    case = case.altered(damping=fd.Rayleigh(50.0))  # so much that few seconds tell
    if driven == "force":
        density = noise(0.02, 1.0, 200.0, "N2/Hz")
        found = fd.random_response(case, forces=[(fd.Force([5], (0, 0, 1)), density)])
        push = fd.Force([5], (0, 0, 1), history=density.history(16.0, seed=4))
        shaken = case.altered(loads=[push])
    else:
        density = noise(0.02, 1.0, 200.0)
        found = fd.random_response(case, base={"z": density})
        base = fd.BaseMotion("z", history=density.history(16.0, seed=4))
        shaken = case.altered(supports=[*case.supports, base])
    moved = fd.simulate(shaken, 16.0, interval=2e-3).displacement.sel(axis="z")
    late = (moved.sel(node=5) - (moved.sel(node=0) if driven == "base" else 0.0)).values[500:]
    rms = float(found.displacement_rms.sel(node=5, axis="z"))
    correlation = 2.0 / 50.0  # s, of an amplitude damped by alpha
    error = np.sqrt(2.0 * correlation / 16.0)
    assert late.std() == pytest.approx(rms, rel=3.0 * error)


@pytest.mark.parametrize("unit", ["m2/s3", "N2/Hz"])
def test_histories_have_their_density(unit):
    density = fd.SpectralDensity([5.0, 20.0, 100.0], [0.1, 0.4, 0.05], unit)
    made = density.history(100.0, seed=1)
    again = density.history(100.0, seed=1)
    np.testing.assert_array_equal(made.values, again.values)
    assert np.abs(made.values - density.history(100.0, seed=2).values).max() > 0.0
    value, dt = made.values, float(np.diff(made.times).mean())
    if unit == "m2/s3":
        assert value[0] == value[-1] == 0.0
        value = np.diff(np.append(value, value[1]), 2) / dt**2
    lines = 100 * 95  # within the density: each has two random numbers
    assert value.std() == pytest.approx(density.rms, rel=0.01 + 3.0 / np.sqrt(lines))
    with pytest.raises(InputError, match=r"duration = 0.1: must be at least 0\.2 s"):
        density.history(0.1)


def test_densities_integrate_to_mean_squares():
    """And are those of the frequency response: displacements by forces, accelerations by a base."""
    case = chain([500.0, 200.0], [0.3, 0.2], 0.05)
    f = np.linspace(1.0, 30.0, 4001)
    push = noise(0.2, 1.0, 30.0, "N2/Hz")
    one = fd.random_response(case, forces=[(fd.Force([2], (2, 0, 0)), push)], frequencies=f)
    two = fd.random_response(case, base={"x": noise(0.3, 1.0, 30.0)}, frequencies=f)
    for found in (one, two):
        for name in ("displacement", "acceleration"):
            area = np.trapezoid(found[f"{name}_psd"].sel(node=[1, 2], axis="x"), f, axis=0)
            rms = found[f"{name}_rms"].sel(node=[1, 2], axis="x")
            np.testing.assert_allclose(area, rms**2, rtol=1e-4)
    at = {"frequency": f[[10, 900]], "node": 1, "axis": "x"}
    response = fd.frf(case, fd.Force([2], (2, 0, 0)), frequencies=at["frequency"])
    moved = np.abs(2.0 * response.receptance.sel(node=1, axis="x")) ** 2 * 0.2
    np.testing.assert_allclose(one.displacement_psd.sel(at), moved, rtol=1e-9)
    response = fd.frf(case, fd.BaseMotion("x"), frequencies=at["frequency"])
    shaken = np.abs(response.transmissibility.sel(node=1, axis="x")) ** 2 * 0.3
    np.testing.assert_allclose(two.acceleration_psd.sel(at), shaken, rtol=1e-9)


def test_what_lies_below_a_frequency_grows_to_the_root_mean_square():
    case = chain([500.0, 200.0], [0.3, 0.2], 0.01)
    f = np.linspace(0.5, 31.0, 62)
    found = fd.random_response(case, base={"x": noise(0.3, 1.0, 30.0)}, frequencies=f)
    plain = fd.random_response(case, base={"x": noise(0.3, 1.0, 30.0)})
    for name in ("displacement", "acceleration"):
        below = found[f"{name}_cumulative"].sel(node=[1, 2], axis="x").values
        assert (np.diff(below, axis=0) >= 0.0).all()
        rms = plain[f"{name}_rms"].sel(node=[1, 2], axis="x").values
        np.testing.assert_allclose(below[-1], rms, rtol=1e-9)
        np.testing.assert_allclose(found[f"{name}_rms"], plain[f"{name}_rms"], rtol=1e-9)
        assert (below[0] == 0.0).all()
        half = fd.random_response(case, base={"x": noise(0.3, 1.0, float(f[20]))}, count=2)
        cut = half[f"{name}_rms"].sel(node=[1, 2], axis="x").values
        np.testing.assert_allclose(below[20], cut, rtol=1e-6)


def test_coherent_forces_beside_frequency_responses():
    """S = |H1|2 S1 + |H2|2 S2 + 2 c Re(H1 H2*) sqrt(S1 S2); with c = 1 forces are in phase."""
    case, f = chain([500.0, 200.0], [0.3, 0.2], 0.03), np.linspace(2.0, 20.0, 7)
    pushes = [fd.Force([1], (1, 0, 0)), fd.Force([2], (1, 0, 0))]
    densities = [noise(0.2, 1.0, 30.0, "N2/Hz"), noise(0.05, 2.0, 40.0, "N2/Hz")]
    one, two = (
        fd.frf(case, push, frequencies=f).receptance.sel(node=2, axis="x").values for push in pushes
    )
    forces = list(zip(pushes, densities, strict=True))
    for given, c in ((0.0, 0.0), (0.6, 0.6), ([[1.0, -0.8], [-0.8, 1.0]], -0.8), (1.0, 1.0)):
        found = fd.random_response(case, forces=forces, coherence=given, frequencies=f)
        own = np.abs(one) ** 2 * 0.2 + np.abs(two) ** 2 * 0.05
        own = own + 2.0 * c * (one * two.conj()).real * np.sqrt(0.2 * 0.05)
        np.testing.assert_allclose(found.displacement_psd.sel(node=2, axis="x"), own, rtol=1e-7)
    alike = [(push, densities[0]) for push in pushes]
    apart = fd.random_response(case, forces=alike, coherence=1.0)
    phase = fd.random_response(case, forces=[(pushes, densities[0])])
    np.testing.assert_allclose(apart.displacement_rms, phase.displacement_rms, rtol=1e-8)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (2.0, "from -1 to 1"),
        ([[1.0, 0.5], [0.4, 1.0]], "symmetric 3 x 3 matrix"),
        (-0.9, "no forces have these coherences"),
    ],
)
def test_refused_coherences(given, told):
    forces = [(fd.Force([1], (1, 0, 0)), noise(1.0, unit="N2/Hz"))] * 3
    with pytest.raises(InputError, match=f"coherence: .*{told}"):
        fd.random_response(chain([500.0], [MASS]), forces=forces, coherence=given)


@pytest.mark.parametrize("drive", ["base", "force"])
def test_reactions_are_what_moves_the_masses(drive):
    """Their sum is that of mass times acceleration, less the force; damping acts between nodes."""
    structure = fd.discretize(PATTERN, SHEET, clamped="xmin", mass="panel")
    case = fd.Case(structure, [fd.Fix("xmin")], damping=fd.Rayleigh(0.0, 1e-4))
    f = np.linspace(5.0, 60.0, 4)
    if drive == "base":
        given, driver, density, push = (
            {"base": {"z": noise(0.2, 1.0, 90.0)}},
            fd.BaseMotion("z"),
            0.2,
            0,
        )
    else:
        driver, density, push = fd.Force([5], (0, 0, 1)), 0.1, 1.0
        given = {"forces": [(driver, noise(0.1, 1.0, 90.0, "N2/Hz"))]}
    with np.errstate(all="ignore"):
        found = fd.random_response(case, **given, frequencies=f, reactions=True, count=18)
    response = fd.frf(case, driver, frequencies=f)
    name = "transmissibility" if drive == "base" else "receptance"
    moved = response[name].sel(axis="z").values
    if drive == "force":
        moved = -((2 * np.pi * f[:, None]) ** 2) * moved
    total = moved @ np.asarray(structure.mass.sum(axis=0)).ravel() - push
    own = found.total_reaction_psd.sel(axis="z").values
    np.testing.assert_allclose(own, np.abs(total) ** 2 * density, rtol=1e-6)
    assert set(found.reaction_rms.dims) == {"support"}
    with pytest.raises(InputError, match="reactions: no support"):
        fd.random_response(
            case.altered(supports=[]), forces=[(fd.Force([5], (0, 0, 1)), noise(1, 1, 9, "N2/Hz"))],
            reactions=True,
        )  # fmt: skip


def test_models_agree_and_few_modes_nearly_do():
    base = {"z": noise(0.01, 1.0, 60.0)}
    panels = folded(fd.superelements(PATTERN, SHEET, level=2, divisions=12, clamped="xmin"))
    bars = folded(fd.discretize(PATTERN, SHEET, clamped="xmin"))
    with pytest.warns(ModelRangeWarning, match="modes above 60 Hz"):
        whole = fd.random_response(panels, base=base)
    assert whole.attrs["modes"] < 30
    with pytest.warns(ModelRangeWarning):
        few = fd.random_response(panels, base=base, count=8)
    with pytest.warns(ModelRangeWarning):
        other = fd.random_response(bars, base=base)
    free = {"node": [2, 3, 4, 5], "axis": "z"}
    for name in ("displacement_rms", "acceleration_rms"):
        one, two, three = (each[name].sel(free).values for each in (whole, few, other))
        np.testing.assert_allclose(two, one, rtol=2e-3)
        np.testing.assert_allclose(three, one, rtol=0.1)


def test_modes_that_are_left_out_are_told():
    panels = folded(fd.superelements(PATTERN, SHEET, level=1, divisions=8, clamped="xmin"))
    with pytest.warns(FoldynWarning, match=r"3 modes are taken of the \d+ below 300 Hz"):
        fd.random_response(panels, base={"z": noise(0.01, 1.0, 300.0)}, count=3)


def test_the_table_of_a_density():
    rising = fd.SpectralDensity([20.0, 80.0], [0.01, 0.04], "g2/Hz")
    assert rising.at([10.0, 40.0, 100.0]) == pytest.approx([0.0, 0.02 * 9.80665**2, 0.0])
    area = 0.0005 * (80.0**2 - 20.0**2) / 2.0
    assert rising.rms == pytest.approx(9.80665 * np.sqrt(area))
    falling = fd.SpectralDensity([20.0, 80.0], [0.04, 0.01], "N2/Hz")  # as 1/f
    assert falling.rms == pytest.approx(np.sqrt(0.8 * np.log(4.0)))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"unit": "g/Hz"}, 'unit = "g/Hz"'),
        ({"frequency": [20.0, 10.0]}, r"frequency\[1\] = 10.0: must increase"),
        ({"frequency": [0.0, 10.0]}, r"frequency\[0\] = 0.0: must be greater than 0 Hz"),
        ({"frequency": [10.0]}, "frequency: give at least two frequencies"),
        ({"value": [0.1, -0.1]}, "value: 2 densities for 2 frequencies"),
        ({"value": [0.1]}, "value: 1 densities for 2 frequencies"),
    ],
)
def test_refused_densities(change, told):
    given = {"frequency": [10.0, 20.0], "value": [0.1, 0.1], "unit": "g2/Hz", **change}
    with pytest.raises(InputError, match=told):
        fd.SpectralDensity(**given)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({}, "base: give a base or forces"),
        ({"base": {"u": noise(1.0)}}, 'base = "u": choose one of x, y, z'),
        ({"base": {"x": noise(1.0, unit="N2/Hz")}}, r"base\['x'\]: its unit is N2/Hz"),
        ({"forces": [(fd.Force([1], (1, 0, 0)), noise(1.0))]}, r"forces\[0\]: its unit is m2/s3"),
        ({"forces": [fd.Force([1], (1, 0, 0))]}, r"forces\[0\] = .*give pairs"),
        ({"base": {"x": 0.1}}, "SpectralDensity"),
        (
            {"base": {"x": noise(1.0)}, "frequencies": [2.0, 1.0]},
            r"frequencies\[1\] = 1.0: must increase",
        ),
        (
            {"base": {"x": noise(1.0)}, "frequencies": [0.0]},
            r"frequencies\[0\] = 0.0: must be greater",
        ),
    ],
)
def test_refused_drives(given, told):
    with pytest.raises(InputError, match=told):
        fd.random_response(chain([500.0], [MASS]), **given)


def test_without_damping_there_is_no_response():
    case = chain([500.0], [MASS]).altered(damping=fd.Rayleigh())
    with pytest.raises(InputError, match=r"damping: the mode at 6\.49747 Hz has no"):
        fd.random_response(case, base={"x": noise(1.0)})
