"""Frequency responses by matrices: closed forms, reciprocity, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from frf_structures import chain, chain_modes, chain_response, largest_error, miura_case

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear import convert, frf, peaks_of
from foldyn.plots import plot_frf

F = np.arange(0.1, 5.01, 0.1)
PUSH = fd.Force([1], (2.0, 0, 0))
DAMPING = {"alpha": 0.4, "beta": 3e-3}
NO_LAWS = {"stiffness": (100.0,), "masses": (0.5,)}


# ------------------------------------------------------------------------ closed forms
@pytest.mark.parametrize("method", ["direct", "modal", "harmonic"])
def test_a_chain_of_two_masses(method):
    found = frf(chain(**DAMPING), PUSH, frequencies=F, method=method)
    exact = chain_response(F, **DAMPING)[:, :, 0]
    assert largest_error(found.receptance.values[:, 1:, 0], exact) < 1e-12
    assert not found.receptance.values[:, 0].any()  # held
    assert found.attrs["drive_force"] == 2.0
    with pytest.warns(
        FoldynWarning, match=r"drive\[0\].*in part"
    ):  # what supports take is left out
        partly = frf(chain(**DAMPING), fd.Force([0, 1], (2.0, 0, 0)), frequencies=F, method=method)
    np.testing.assert_array_equal(partly.receptance, found.receptance)


@pytest.mark.matrix
def test_peaks_recover_frequency_and_damping():
    """From the response through the estimators: poles known in closed form."""
    found = frf(chain(**DAMPING), PUSH, frequencies=np.arange(0.5, 5, 0.02))
    frequency, ratio = chain_modes(**DAMPING)
    for node in (1, 2):
        peaks = peaks_of(found, node, axis="x")
        np.testing.assert_allclose([p.natural_frequency for p in peaks], frequency, rtol=1e-6)
        np.testing.assert_allclose([p.damping_ratio for p in peaks], ratio, rtol=1e-6)
        assert max(p.misfit for p in peaks) < 1e-6
    misses = []  # of noisy responses, over their errors
    size = 0.01 * np.abs(found.receptance.values).max()
    for seed in range(8):
        noise = np.random.default_rng(seed).normal(size=(2, *found.receptance.shape))
        noisy = found.assign(receptance=found.receptance + size * (noise[0] + 1j * noise[1]))
        peaks = peaks_of(noisy, 1, axis="x", prominence=0.2, count=2)
        for peak, f, z in zip(peaks, frequency, ratio, strict=True):
            misses.append((peak.natural_frequency - f) / peak.frequency_error)
            misses.append((peak.damping_ratio - z) / peak.damping_error)
            assert abs(peak.damping_ratio / z - 1) < 0.1
    assert np.abs(misses).max() < 5
    assert 0.7 < np.sqrt(np.mean(np.square(misses))) < 1.5


def test_peaks_of_a_single_mode():
    """Half-power points: exact for one mode; the textbook formula is high by about 2 z^2."""
    case = chain(**NO_LAWS, alpha=3.0)
    frequency, ratio = chain_modes(**NO_LAWS, alpha=3.0)
    found = frf(case, PUSH, frequencies=np.arange(0.5, 5, 0.05))
    (peak,) = peaks_of(found, 1, axis="x")
    assert peak.half_power == pytest.approx(ratio[0], rel=1e-9)
    assert peak.textbook == pytest.approx(ratio[0] * (1 + 2 * ratio[0] ** 2), rel=1e-3)
    assert peak.frequency == pytest.approx(frequency[0] * np.sqrt(1 - 2 * ratio[0] ** 2), rel=1e-9)
    (peak,) = peaks_of(found, 1, axis="x", quantity="mobility")
    assert peak.frequency == pytest.approx(frequency[0], rel=1e-9)
    assert peak.half_power == peak.textbook * peak.frequency / frequency[0]


def test_peaks_without_damping():
    """The response is real there, and negative beyond a resonance."""
    found = frf(chain(), PUSH, frequencies=np.arange(0.5, 5, 0.0201))
    peaks = peaks_of(found, 1, axis="x")
    assert [peak.frequency for peak in peaks] == pytest.approx(chain_modes()[0], abs=0.0201)
    assert len(plot_frf(found, 1, axes="x").axes) == 2


def test_a_node_at_rest_has_no_peaks():
    found = frf(chain(alpha=0.4), PUSH, frequencies=F)
    assert peaks_of(found, 0, axis="x") == ()
    with pytest.raises(InputError, match="node = 3"):
        peaks_of(found, 3, axis="x")


def test_the_static_limit_is_the_flexibility():
    case = miura_case()
    found = frf(case, fd.Force([7], (0.01, 0, 0)), frequencies=[0.0])
    free, static = case.free_dofs, np.zeros(case.structure.nodes.size)
    stiffness = case.structure.tangent(0.0 * case.structure.nodes).toarray()
    static[free] = np.linalg.solve(stiffness[np.ix_(free, free)], (free == 21).astype(float))
    np.testing.assert_allclose(found.receptance.values[0].ravel(), static, atol=1e-9)


def test_reciprocity():
    case, places = miura_case(beta=2e-3), [(7, 0), (6, 1), (4, 2)]
    H = []
    for node, axis in places:
        found = frf(case, fd.Force([node], 0.01 * np.eye(3)[axis]), frequencies=F).receptance.values
        H.append([found[:, n, a] for n, a in places])
    scale = np.abs(H).max()
    np.testing.assert_allclose(H, np.transpose(H, (1, 0, 2)), atol=1e-11 * scale)
    assert np.abs(H[0][1]).max() > 1e-3 * scale


# ------------------------------------------------------------------------ modes
@pytest.mark.parametrize(
    ("loads", "state", "beta"),
    [
        ([], None, 0.0),
        ([], None, 5e-3),
        # K0 at rest about another state is not diagonal in the modes
        ([fd.Force([7], (0.004, 0, 0))], "equilibrium", 5e-3),
    ],
)
def test_all_modes_give_the_direct_response(loads, state, beta):
    case, drive = miura_case(loads, beta=beta), fd.Force([7], (1e-3, 0, 0))
    direct, modal = (
        frf(case, drive, frequencies=F, state=state, method=m).receptance.values
        for m in ("direct", "modal")
    )
    assert largest_error(modal, direct) < 1e-9


def shell_case(*damping):
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    shell = fd.shell(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), divisions=2)
    return fd.Case(shell, miura_case().supports, damping=fd.Rayleigh(*damping))


@pytest.mark.matrix
def test_a_shell():
    """Its edges' rotations have no mass: they follow, and do not show."""
    case, drive = shell_case(0.5, 1e-3), fd.Force([7], (0.01, 0, 0))
    direct, modal, harmonic = (
        frf(case, drive, frequencies=F, method=m).receptance.values
        for m in ("direct", "modal", "harmonic")
    )
    assert direct.shape == (len(F), len(case.structure.nodes), 3)
    assert largest_error(modal, direct) < 1e-6
    assert largest_error(harmonic, direct) < 1e-8
    natural = fd.modes(case, 4).frequency.values
    (peak, *_) = peaks_of(frf(case, drive, frequencies=np.arange(0.2, 1.5, 0.02)), 7, axis="x")
    assert np.abs(peak.natural_frequency / natural - 1.0).min() < 1e-3


@pytest.mark.matrix
def test_a_shell_struck():
    """By an implicit method, since explicit ones need mass everywhere."""
    drive, f = fd.Force([7], (1e-4, 0, 0)), np.arange(0.2, 2.01, 0.2)
    struck, exact = (
        frf(shell_case(2.0, 1e-3), drive, frequencies=f, method=m) for m in ("impulse", "direct")
    )
    assert struck.attrs["integrator"] == "generalized_alpha"
    assert largest_error(struck.receptance.values, exact.receptance.values) < 3e-3


@pytest.mark.filterwarnings("ignore:frequencies. the modes that are left out")
def test_static_correction_converges_faster():
    case, drive = miura_case(), fd.Force([7], (0.01, 0, 0))
    direct = frf(case, drive, frequencies=F).receptance.values

    def error(count, corrected):
        options = {"method": "modal", "count": count, "static_correction": corrected}
        return largest_error(frf(case, drive, frequencies=F, **options).receptance.values, direct)

    corrected, plain = ([error(n, how) for n in (4, 8, 16)] for how in (True, False))
    assert corrected[0] < 1e-3 and corrected[1] < 1e-6 and corrected[2] < 1e-8 < 1e-7 < plain[2]
    assert (np.array(plain) > 2 * np.array(corrected)).all()


def test_a_free_body():
    """Pushed as its masses are, a free body moves as a rigid one: x = -f / (w^2 m)."""
    s = miura_case().structure
    case, w = fd.Case(s), 2 * np.pi * F[:, None]
    masses = s.mass.diagonal()
    along = [fd.Force([node], (float(m), 0, 0)) for node, m in enumerate(masses)]
    found = frf(case, along, frequencies=F).receptance.values[:, :, 0]
    np.testing.assert_allclose(found * w**2 * masses.sum(), -1.0, rtol=1e-6)

    push, low = fd.Force([7], (1e-3, 0, 0)), [0.05, 0.2, 0.4]
    kept = frf(case, push, frequencies=low, method="modal", count=16).receptance.values
    exact = frf(case, push, frequencies=low).receptance.values
    for k in range(3):
        assert largest_error(kept[k], exact[k]) < 1e-5
    with pytest.warns(FoldynWarning, match="no response at 0 Hz"):
        found = frf(case, push, frequencies=[0.0, 1.0])
    assert np.isnan(found.receptance.values[0, :, 0]).all()
    assert np.isfinite(found.receptance.values[1]).all()


@pytest.mark.parametrize("method", ["direct", "modal"])
def test_a_resonance_without_damping(method):
    frequency, _ = chain_modes()
    near = np.sort([*frequency, 1.0, 2.0])
    with pytest.warns(FoldynWarning, match="no response at") as told:
        found = frf(chain(), PUSH, frequencies=near, method=method)
    assert f"{frequency[0]:.6g}, {frequency[1]:.6g} Hz" in str(told[0].message)
    lost = np.isnan(found.receptance.values[:, 1, 0])
    np.testing.assert_array_equal(lost, np.isin(near, frequency))
    exact = chain_response([1.0, 2.0])[:, :, 0]
    assert largest_error(found.receptance.sel(frequency=[1.0, 2.0])[:, 1:, 0], exact) < 1e-12
    assert np.isfinite(
        frf(chain(), PUSH, frequencies=1.0001 * frequency, method=method).receptance
    ).all()


# ------------------------------------------------------------------------ base motion
def test_transmissibility_of_one_mass():
    """(k + i w beta k) / (k - w^2 m + i w (alpha m + beta k)), alpha damping absolute motion."""
    alpha, beta = 0.7, 4e-3
    case = chain(**NO_LAWS, alpha=alpha, beta=beta)
    k, m, w = 100.0, 0.5, 2 * np.pi * F
    exact = k * (1 + 1j * w * beta) / (k - w**2 * m + 1j * w * (alpha * m + beta * k))
    for method in ("direct", "modal"):
        found = frf(case, fd.BaseMotion("x", value=1e-6), frequencies=F, method=method)
        assert largest_error(found.transmissibility.values[:, 1, 0], exact) < 1e-12
        assert (found.transmissibility.values[:, 0, 0] == 1.0).all()
    (peak,) = peaks_of(found, 1, axis="x")
    frequency, ratio = chain_modes(**NO_LAWS, alpha=alpha, beta=beta)
    assert peak.natural_frequency == pytest.approx(frequency[0], rel=1e-6)
    assert peak.damping_ratio == pytest.approx(ratio[0], rel=1e-6)


@pytest.mark.parametrize("mass", ["circumcenter", "consistent"])
def test_transmissibility_tends_to_one(mass):
    case = miura_case(mass=mass, alpha=0.0, beta=1e-3)
    found = frf(case, fd.BaseMotion("z"), frequencies=[0.0, 0.01, 0.02]).transmissibility.values
    still, *errors = np.abs(found - np.array([0, 0, 1])).max(axis=(1, 2))
    assert still < 1e-9 and errors[1] < 0.01
    assert errors[1] / errors[0] == pytest.approx(4.0, rel=0.01)


# ------------------------------------------------------------------------ quantities, files
def test_mobility_and_accelerance():
    found = frf(chain(alpha=0.4), PUSH, frequencies=F)
    w = 2 * np.pi * F[:, None, None]
    H = found.receptance.values
    np.testing.assert_allclose(convert(found, "mobility").mobility, 1j * w * H)
    accelerance = convert(found, "accelerance")
    np.testing.assert_allclose(accelerance.accelerance, -(w**2) * H)
    np.testing.assert_allclose(convert(accelerance, "receptance").receptance, H)
    assert accelerance.accelerance.attrs["units"] == "m/(N s2)"
    assert "receptance" not in accelerance
    with pytest.raises(InputError, match="transmissibility"):
        convert(frf(chain(alpha=0.4), fd.BaseMotion("x"), frequencies=F), "mobility")


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("method", "options"), [("direct", {}), ("burst_random", {"seed": 3, "averages": 2})]
)
def test_files_keep_complex_numbers(tmp_path, method, options):
    case, drive, f = miura_case(alpha=4.0), fd.Force([7], (1e-6, 0, 0)), [0.5, 1.0, 1.5]
    found = frf(case, drive, frequencies=f, method=method, **options)
    fd.save(found, tmp_path / "frf.nc")
    loaded = fd.load(tmp_path / "frf.nc")
    assert loaded.identical(found) and loaded.receptance.dtype == complex
    again = frf(fd.case_of(loaded), drive, frequencies=f, method=method, **options)
    np.testing.assert_array_equal(again.receptance, found.receptance)
    for name, value in {"method": method, **options}.items():
        assert loaded.attrs[name] == value
    found.receptance.values[0, 1, :2] = complex(np.inf, 1.0), complex(np.nan, np.nan)
    fd.save(found, tmp_path / "odd.nc")
    infinite, nothing = fd.load(tmp_path / "odd.nc").receptance.values[0, 1, :2]
    assert infinite == complex(np.inf, 1.0) and np.isnan(nothing)


# ------------------------------------------------------------------------ refused
HELD = [fd.Fix([0], "xyz"), fd.Fix([1, 2], "yz"), fd.Impose([2], "x", 0.0)]
OPPOSED = [fd.Force([1], (1, 0, 0)), fd.Force([1], (-1, 0, 0))]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"drive": []}, "drive"),
        ({"drive": fd.Force([0], (1, 0, 0))}, r"drive\[0\].*acts only where supports hold"),
        ({"drive": fd.Force([1], (0, 0, 0))}, "drive: the forces are zero"),
        ({"drive": OPPOSED}, "drive: the forces are zero"),
        ({"drive": [fd.Force([1], (1, 0, 0)), fd.BaseMotion("x")]}, "only drive"),
        ({"drive": fd.Gravity((0, 0, -9.81))}, "must be a list of Force"),
        ({"drive": fd.Force([1], (1, 0, 0), fd.Harmonic(1.0))}, r"drive\[0\].history"),
        ({"drive": fd.BaseMotion("x", value=0.0)}, "the base must move"),
        (
            {"case": fd.Case(chain().structure, HELD), "drive": fd.BaseMotion("x")},
            "use Fix instead",
        ),
        ({"frequencies": []}, "frequencies"),
        ({"frequencies": [2.0, 1.0]}, "must increase"),
        ({"frequencies": [-1.0, 1.0]}, r"frequencies\[0\] = -1.0: must be at least 0 Hz"),
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
    with pytest.raises(InputError, match=message):
        frf(**{"case": chain(alpha=0.4), "drive": PUSH, "frequencies": F} | change)


def test_an_unstable_state_is_told():
    """A strut pressed beyond its limit: the bars' forces turn the middle node aside."""
    nodes = np.array([[0.0, 0, 0], [1, 0, 0.1], [2, 0, 0]])
    bars, sheet = np.array([[0, 1], [1, 2]]), fd.Sheet(1e6, 0.3, 0.01)
    s = fd.Structure(nodes, bars, np.full(2, 1e-4), sheet, node_mass=np.ones(3))
    case = fd.Case(s, [fd.Fix([0, 2], "xyz"), fd.Fix([1], "y")], damping=fd.Rayleigh(1.0))
    flat = fd.State(nodes * [0, 0, -1])
    with pytest.warns(FoldynWarning, match="unstable equilibrium"):
        frf(case, fd.Force([1], (0, 0, 1.0)), frequencies=[1.0], state=flat)
