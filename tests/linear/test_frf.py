"""Frequency responses by matrices: closed forms, reciprocity, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from frf_structures import (
    STIFFNESS,
    chain,
    chain_modes,
    chain_response,
    largest_error,
    miura_case,
)

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear import convert, frf, peaks_of
from foldyn.plots import plot_frf

F = np.arange(0.1, 5.01, 0.1)
PUSH = fd.Force([1], (2.0, 0, 0))
NO_LAWS = {"stiffness": (100.0,), "masses": (0.5,)}


# ------------------------------------------------------------------------ closed forms
@pytest.mark.parametrize("method", ["direct", "modal", "harmonic"])
def test_a_chain_of_two_masses(method):
    damping = {"alpha": 0.4, "beta": 3e-3}
    found = frf(chain(**damping), PUSH, F, method=method)
    exact = chain_response(F, **damping)[:, :, 0]
    assert largest_error(found.receptance.values[:, 1:, 0], exact) < 1e-12
    assert not found.receptance.values[:, 0].any()  # held
    assert found.attrs["drive_force"] == 2.0


def test_peaks_recover_frequency_and_damping():
    """From the response through the estimators: poles known in closed form."""
    damping = {"alpha": 0.4, "beta": 3e-3}
    found = frf(chain(**damping), PUSH, np.arange(0.5, 5, 0.02))
    for node in (1, 2):
        peaks = peaks_of(found, node, "x")
        frequency, ratio = chain_modes(**damping)
        np.testing.assert_allclose([p.natural_frequency for p in peaks], frequency, rtol=1e-6)
        np.testing.assert_allclose([p.damping_ratio for p in peaks], ratio, rtol=1e-6)
        assert max(p.misfit for p in peaks) < 1e-6


def test_peaks_of_a_single_mode():
    """Half-power points: exact for one mode; the textbook formula is high by about 2 z^2."""
    case = chain(**NO_LAWS, alpha=3.0)
    frequency, ratio = chain_modes(**NO_LAWS, alpha=3.0)
    found = frf(case, PUSH, np.arange(0.5, 5, 0.05))
    (peak,) = peaks_of(found, 1, "x")
    assert peak.half_power == pytest.approx(ratio[0], rel=1e-9)
    assert peak.textbook == pytest.approx(ratio[0] * (1 + 2 * ratio[0] ** 2), rel=1e-3)
    assert peak.frequency == pytest.approx(frequency[0] * np.sqrt(1 - 2 * ratio[0] ** 2), rel=1e-9)
    (peak,) = peaks_of(found, 1, "x", quantity="mobility")
    assert peak.frequency == pytest.approx(frequency[0], rel=1e-9)
    assert peak.half_power == peak.textbook * peak.frequency / frequency[0]


def test_peaks_from_a_noisy_response_lie_within_their_errors():
    damping = {"alpha": 0.4, "beta": 3e-3}
    found = frf(chain(**damping), PUSH, np.arange(0.5, 5, 0.02))
    frequency, ratio = chain_modes(**damping)
    misses = []
    for seed in range(8):
        random = np.random.default_rng(seed)
        noise = random.normal(size=(2, *found.receptance.shape))
        size = 0.01 * np.abs(found.receptance.values).max()
        noisy = found.assign(receptance=found.receptance + size * (noise[0] + 1j * noise[1]))
        for peak, f, z in zip(
            peaks_of(noisy, 1, "x", prominence=0.2, count=2), frequency, ratio, strict=True
        ):
            misses.append((peak.natural_frequency - f) / peak.frequency_error)
            misses.append((peak.damping_ratio - z) / peak.damping_error)
            assert abs(peak.damping_ratio / z - 1) < 0.1
    assert np.abs(misses).max() < 5
    assert 0.7 < np.sqrt(np.mean(np.square(misses))) < 1.5


def test_peaks_without_damping():
    """The response is real there, and negative beyond a resonance."""
    found = frf(chain(), PUSH, np.arange(0.5, 5, 0.0201))
    peaks = peaks_of(found, 1, "x")
    assert [peak.frequency for peak in peaks] == pytest.approx(chain_modes()[0], abs=0.0201)
    assert len(plot_frf(found, 1, "x").axes) == 2


def test_a_node_at_rest_has_no_peaks():
    found = frf(chain(alpha=0.4), PUSH, F)
    assert peaks_of(found, 0, "x") == ()
    with pytest.raises(InputError, match="node = 3"):
        peaks_of(found, 3, "x")


def test_the_static_limit_is_the_flexibility():
    case = miura_case()
    found = frf(case, fd.Force([7], (0.01, 0, 0)), [0.0])
    stiffness = case.structure.tangent(np.zeros_like(case.structure.nodes))
    free = case.free_dofs
    load = np.zeros(case.structure.nodes.size)
    load[21] = 1.0
    static = np.zeros_like(load)
    static[free] = np.linalg.solve(stiffness.toarray()[np.ix_(free, free)], load[free])
    np.testing.assert_allclose(found.receptance.values[0].ravel(), static, atol=1e-9)


def test_reciprocity():
    case = miura_case(beta=2e-3)
    places = [(7, 0), (6, 1), (4, 2)]
    H = []
    for node, axis in places:
        found = frf(case, fd.Force([node], 0.01 * np.eye(3)[axis]), F).receptance.values
        H.append([found[:, n, a] for n, a in places])
    H = np.array(H)
    scale = np.abs(H).max()
    np.testing.assert_allclose(H, H.transpose(1, 0, 2), atol=1e-11 * scale)
    assert np.abs(H[0, 1]).max() > 1e-3 * scale


# ------------------------------------------------------------------------ modes
@pytest.mark.parametrize("beta", [0.0, 5e-3])
def test_all_modes_give_the_direct_response(beta):
    case, drive = miura_case(beta=beta), fd.Force([7], (0.01, 0, 0))
    direct, modal = (frf(case, drive, F, method=m).receptance.values for m in ("direct", "modal"))
    assert largest_error(modal, direct) < 1e-9


def test_modes_that_damping_couples():
    """K0 at rest about another state is not diagonal in the modes."""
    load = fd.Force([7], (0.004, 0, 0))
    case, drive = miura_case([load], beta=5e-3), fd.Force([7], (1e-3, 0, 0))
    direct, modal = (
        frf(case, drive, F, state="equilibrium", method=m).receptance.values
        for m in ("direct", "modal")
    )
    assert largest_error(modal, direct) < 1e-9


def test_a_shell():
    """Its edges' rotations have no mass: they follow, and do not show."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    shell = fd.shells.shell(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), divisions=2)
    supports = miura_case().supports
    case = fd.Case(shell, supports, damping=fd.Rayleigh(0.5, 1e-3))
    drive = fd.Force([7], (0.01, 0, 0))
    direct, modal, harmonic = (
        frf(case, drive, F, method=m).receptance.values for m in ("direct", "modal", "harmonic")
    )
    assert direct.shape == (len(F), len(shell.nodes), 3)
    assert largest_error(modal, direct) < 1e-6
    assert largest_error(harmonic, direct) < 1e-8
    natural = fd.linear.modes(case, 4).frequency.values
    (peak, *_) = peaks_of(frf(case, drive, np.arange(0.2, 1.5, 0.02)), 7, "x")
    assert np.abs(peak.natural_frequency / natural - 1.0).min() < 1e-3


def test_a_shell_struck():
    """By an implicit method, since explicit ones need mass everywhere."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    shell = fd.shells.shell(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), divisions=2)
    case = fd.Case(shell, miura_case().supports, damping=fd.Rayleigh(2.0, 1e-3))
    drive, f = fd.Force([7], (1e-4, 0, 0)), np.arange(0.2, 2.01, 0.2)
    struck, exact = frf(case, drive, f, method="impulse"), frf(case, drive, f)
    assert struck.attrs["integrator"] == "generalized_alpha"
    assert largest_error(struck.receptance.values, exact.receptance.values) < 3e-3


def test_static_correction_converges_faster():
    case, drive = miura_case(), fd.Force([7], (0.01, 0, 0))
    direct = frf(case, drive, F).receptance.values
    errors = {
        corrected: [
            largest_error(
                frf(case, drive, F, method="modal", count=n, static_correction=corrected)
                .receptance.values,
                direct,
            )
            for n in (4, 8, 16)
        ]
        for corrected in (True, False)
    }  # fmt: skip
    assert errors[True][0] < 1e-3
    assert errors[True][1] < 1e-6
    assert errors[True][2] < 1e-8
    assert (np.array(errors[False]) > 2 * np.array(errors[True])).all()
    assert errors[False][2] > 1e-7


def test_a_free_body():
    """Pushed as its masses are, a free body moves as a rigid one: x = -f / (w^2 m)."""
    s = miura_case().structure
    case, w = fd.Case(s), 2 * np.pi * F[:, None]
    masses = s.mass.diagonal()
    along = [fd.Force([node], (float(m), 0, 0)) for node, m in enumerate(masses)]
    found = frf(case, along, F).receptance.values[:, :, 0]
    np.testing.assert_allclose(found * w**2 * masses.sum(), -1.0, rtol=1e-6)

    push, low = fd.Force([7], (1e-3, 0, 0)), [0.05, 0.2, 0.4]
    kept = frf(case, push, low, method="modal", count=16).receptance.values
    exact = frf(case, push, low).receptance.values
    for k in range(3):
        assert largest_error(kept[k], exact[k]) < 1e-5
    with pytest.warns(FoldynWarning, match="no response at 0 Hz"):
        found = frf(case, push, [0.0, 1.0])
    assert np.isnan(found.receptance.values[0, :, 0]).all()
    assert np.isfinite(found.receptance.values[1]).all()


@pytest.mark.parametrize("method", ["direct", "modal"])
def test_a_resonance_without_damping(method):
    frequency, _ = chain_modes()
    near = np.sort([*frequency, 1.0, 2.0])
    with pytest.warns(FoldynWarning, match="no response at") as told:
        found = frf(chain(), PUSH, near, method=method)
    assert f"{frequency[0]:.6g}, {frequency[1]:.6g} Hz" in str(told[0].message)
    lost = np.isnan(found.receptance.values[:, 1, 0])
    np.testing.assert_array_equal(lost, np.isin(near, frequency))
    exact = chain_response([1.0, 2.0])[:, :, 0]
    assert largest_error(found.receptance.sel(frequency=[1.0, 2.0])[:, 1:, 0], exact) < 1e-12
    assert np.isfinite(frf(chain(), PUSH, 1.0001 * frequency, method=method).receptance).all()


# ------------------------------------------------------------------------ base motion
def test_transmissibility_of_one_mass():
    """(k + i w beta k) / (k - w^2 m + i w (alpha m + beta k)), alpha damping absolute motion."""
    alpha, beta = 0.7, 4e-3
    case = chain(**NO_LAWS, alpha=alpha, beta=beta)
    k, m, w = 100.0, 0.5, 2 * np.pi * F
    exact = k * (1 + 1j * w * beta) / (k - w**2 * m + 1j * w * (alpha * m + beta * k))
    for method in ("direct", "modal"):
        found = frf(case, fd.BaseMotion("x", value=1e-6), F, method=method)
        assert largest_error(found.transmissibility.values[:, 1, 0], exact) < 1e-12
        assert (found.transmissibility.values[:, 0, 0] == 1.0).all()
    (peak,) = peaks_of(found, 1, "x")
    frequency, ratio = chain_modes(**NO_LAWS, alpha=alpha, beta=beta)
    assert peak.natural_frequency == pytest.approx(frequency[0], rel=1e-6)
    assert peak.damping_ratio == pytest.approx(ratio[0], rel=1e-6)


@pytest.mark.parametrize("mass", ["circumcenter", "consistent"])
def test_transmissibility_tends_to_one(mass):
    case = miura_case(mass=mass, alpha=0.0, beta=1e-3)
    base = fd.BaseMotion("z")
    errors = []
    for f in (0.02, 0.01):
        found = frf(case, base, [f]).transmissibility.values[0]
        errors.append(np.abs(found - np.array([0, 0, 1])).max())
    assert errors[0] < 0.01
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.01)
    np.testing.assert_allclose(frf(case, base, [0.0]).transmissibility.values[0, :, 2], 1.0)


# ------------------------------------------------------------------------ quantities, files
def test_mobility_and_accelerance():
    found = frf(chain(alpha=0.4), PUSH, F)
    w = 2 * np.pi * F[:, None, None]
    H = found.receptance.values
    np.testing.assert_allclose(convert(found, "mobility").mobility, 1j * w * H)
    accelerance = convert(found, "accelerance")
    np.testing.assert_allclose(accelerance.accelerance, -(w**2) * H)
    np.testing.assert_allclose(convert(accelerance, "receptance").receptance, H)
    assert accelerance.accelerance.attrs["units"] == "m/(N s2)"
    assert "receptance" not in accelerance
    with pytest.raises(InputError, match="transmissibility"):
        convert(frf(chain(alpha=0.4), fd.BaseMotion("x"), F), "mobility")


@pytest.mark.parametrize("method", ["direct", "burst_random"])
def test_files_keep_complex_numbers(tmp_path, method):
    case, drive = miura_case(alpha=4.0), fd.Force([7], (1e-6, 0, 0))
    options = {"seed": 3, "averages": 2} if method == "burst_random" else {}
    found = frf(case, drive, [0.5, 1.0, 1.5], method=method, **options)
    fd.save(found, tmp_path / "frf.nc")
    loaded = fd.load(tmp_path / "frf.nc")
    assert loaded.identical(found)
    assert loaded.receptance.dtype == complex
    again = frf(fd.case_of(loaded), drive, [0.5, 1.0, 1.5], method=method, **options)
    np.testing.assert_array_equal(again.receptance, found.receptance)
    assert loaded.attrs["method"] == method
    if options:
        assert (loaded.attrs["seed"], loaded.attrs["averages"]) == (3, 2)


def test_nan_and_infinity_survive_files(tmp_path):
    found = frf(chain(alpha=0.4), PUSH, F)
    found.receptance.values[0, 1, 0] = complex(np.inf, 1.0)
    found.receptance.values[1, 1, 0] = complex(np.nan, np.nan)
    fd.save(found, tmp_path / "frf.nc")
    loaded = fd.load(tmp_path / "frf.nc")
    assert loaded.receptance.values[0, 1, 0] == complex(np.inf, 1.0)
    assert np.isnan(loaded.receptance.values[1, 1, 0])


# ------------------------------------------------------------------------ refused
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"drive": []}, "drive"),
        ({"drive": fd.Force([0], (1, 0, 0))}, r"drive\[0\].*acts only where supports hold"),
        ({"drive": fd.Force([1], (0, 0, 0))}, "drive: the forces are zero"),
        (
            {"drive": [fd.Force([1], (1, 0, 0)), fd.Force([1], (-1, 0, 0))]},
            "drive: the forces are zero",
        ),
        ({"drive": [fd.Force([1], (1, 0, 0)), fd.BaseMotion("x")]}, "drives alone"),
        ({"drive": fd.Gravity((0, 0, -9.81))}, "must be a list of Force"),
        ({"drive": fd.Force([1], (1, 0, 0), fd.Harmonic(1.0))}, r"drive\[0\].history"),
        ({"drive": fd.BaseMotion("x", value=0.0)}, "the base must move"),
        ({"frequencies": []}, "frequencies"),
        ({"frequencies": [2.0, 1.0]}, "must increase"),
        ({"frequencies": [-1.0, 1.0]}, "from 0 Hz"),
        ({"frequencies": [1.0, np.nan]}, r"frequencies\[1\]"),
        ({"method": "drect"}, "did you mean 'direct'"),
        ({"count": 3}, "no option of the method direct"),
        ({"method": "modal", "cuont": 3}, "did you mean 'count'"),
        ({"method": "modal", "count": 3}, "only 2 free dofs"),
        ({"method": "modal", "count": 0}, "count = 0"),
        ({"amplitude": 0.0}, "amplitude"),
        ({"state": "buckled"}, "state"),
        ({"method": "harmonic", "secant": 1.0}, "finds the swing"),
    ],
)
def test_refused(change, message):
    arguments = {"drive": PUSH, "frequencies": F} | change
    with pytest.raises(InputError, match=message):
        frf(chain(alpha=0.4), **arguments)


def test_forces_that_supports_take_are_left_out():
    with pytest.warns(FoldynWarning, match=r"drive\[0\].*in part"):
        found = frf(chain(alpha=0.4), fd.Force([0, 1], (2.0, 0, 0)), F)
    assert found.attrs["drive_force"] == 2.0
    exact = chain_response(F, alpha=0.4)[:, :, 0]
    assert largest_error(found.receptance.values[:, 1:, 0], exact) < 1e-12


def test_a_base_with_imposed_nodes_is_refused():
    structure = chain(STIFFNESS).structure
    supports = [fd.Fix([0], "xyz"), fd.Fix([1, 2], "yz"), fd.Impose([2], "x", 0.0)]
    with pytest.raises(InputError, match="use Fix instead of Impose"):
        frf(fd.Case(structure, supports), fd.BaseMotion("x"), F)


def test_an_unstable_state_is_told():
    """A strut pressed beyond its limit: the bars' forces turn the middle node aside."""
    s = fd.Structure(
        nodes=np.array([[0.0, 0, 0], [1, 0, 0.1], [2, 0, 0]]),
        bars=np.array([[0, 1], [1, 2]]),
        bar_area=np.array([1e-4, 1e-4]),
        sheet=fd.Sheet(1e6, 0.3, 0.01),
        node_mass=np.ones(3),
    )
    case = fd.Case(s, [fd.Fix([0, 2], "xyz"), fd.Fix([1], "y")], damping=fd.Rayleigh(1.0))
    flat = np.zeros((3, 3))
    flat[1, 2] = -0.1
    with pytest.warns(FoldynWarning, match="unstable equilibrium"):
        frf(case, fd.Force([1], (0, 0, 1.0)), [1.0], state=fd.State(flat))
