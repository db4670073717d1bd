"""Measures: each against what is known of the result otherwise."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from swept_cases import BANDS, FRF, MODES, MOTION, PATH

import foldyn as fd
from foldyn.analyses import ANALYSES
from foldyn.errors import InputError
from foldyn.sweeps import MEASURES
from foldyn.sweeps.job import code_of
from foldyn.sweeps.measure import asked, own_measure

DOCS = Path(__file__).resolve().parents[2] / "docs"
TEXTS = {"modes": MODES, "frf": FRF, "dynamics": MOTION, "statics": PATH, "bands": BANDS}
GIVEN = {
    "node": "8", "axis": "z", "mode": "1", "model": "own", "frequency": "0.3", "time": "0.01",
    "band": "1", "point": "X", "leg": "X-M", "panel": "0", "crease": "0",
}  # fmt: skip


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder, made = tmp_path_factory.mktemp("cases"), {}
    for kind, text in TEXTS.items():
        strong = text.replace("\nthickness =", "\nstrength = 1e6\nthickness =", 1)
        (folder / f"{kind}.toml").write_text(strong)
        case_file = fd.read_case(folder / f"{kind}.toml")
        made[kind] = case_file, case_file.run()
    return made


def take(results, kind: str, text: str):
    case_file, result = results[kind]
    one = asked(text, MEASURES)
    one.check(case_file)
    return one.of(result, case_file.case(), {})


EVERY = [(one, kind) for one in MEASURES.values() for kind in one.kinds if kind in TEXTS]


@pytest.mark.matrix
@pytest.mark.parametrize(("one", "kind"), EVERY, ids=lambda one: getattr(one, "name", one))
def test_every_measure_can_be_taken_of_all_its_kinds(results, one, kind):
    given = GIVEN if kind != "statics" else {**GIVEN, "node": "0", "axis": "x", "displacement": "0"}
    words = [given[what] for what in one.takes]
    if one.name == "bar_load":
        with pytest.raises(InputError, match="needs a Bar with bending"):
            take(results, kind, one.name)
        return
    value = take(results, kind, f"{one.name}[{','.join(words)}]" if words else one.name)
    assert value.ndim == len(one.dims)
    assert one.doc
    never = (
        "limit_load",
        "bifurcation_load",
        "first_loss_of_stability",
        "first_maximum",
        "barrier",
        "barrier_back",
        "limit_interval",
        "bifurcation_interval",
    )  # of a fold pushed a bit
    if one.name == "clearance":  # of panels that all meet in one vertex
        assert value > 0.0
        return
    assert np.isnan(value).all() if one.name in never else np.isfinite(value).all()


@pytest.mark.parametrize("one", MEASURES.values(), ids=lambda one: one.name)
def test_every_measure_has_kinds_that_there_are_and_a_row(one):
    assert set(one.kinds) <= set(ANALYSES)
    page = (DOCS / "sweeps.md").read_text("utf-8")
    assert re.search(rf"^\| `{re.escape(one.asked)}`", page, re.M), one.asked


@pytest.mark.matrix
def test_frequencies_and_damping_of_modes(results):
    _, modes = results["modes"]
    np.testing.assert_array_equal(take(results, "modes", "frequencies"), modes["frequency"])
    assert take(results, "modes", "frequency[2]") == modes["frequency"][1]
    share = take(results, "modes", "effective_mass[1,z]")
    assert share == modes["effective_mass"].sel(mode=1, axis="z")
    with pytest.raises(InputError, match=r"raise analysis\.count"):
        take(results, "modes", "frequency[9]")


@pytest.mark.matrix
def test_gaps_of_bands_are_those_of_the_table(results):
    """Signed: a gap of the table where it is above 0, an overlap of neighbors below."""
    _, bands = results["bands"]
    where = zip(bands["gap_direction"].values, bands["gap_below"].values, strict=True)
    table = {pair: k for k, pair in enumerate(where)}
    assert ("X-M", 4) in table
    for leg in ("all", "G-X", "X-M", "M-Y", "Y-G"):
        for band in range(1, 5):
            width, center, share = (
                float(take(results, "bands", f"{name}[{band},{leg}]"))
                for name in ("band_gap", "gap_center", "relative_gap")
            )
            assert (width > 1e-3 * center) == ((leg, band) in table)
            np.testing.assert_allclose(share, width / center)
            if (leg, band) in table:
                k = table[leg, band]
                np.testing.assert_allclose(width, bands["gap_width"][k])
                middle = 0.5 * (bands["gap_bottom"][k] + bands["gap_top"][k])
                np.testing.assert_allclose(center, middle)
    widths = [take(results, "bands", f"band_gap[{band}]") for band in range(1, 5)]
    assert take(results, "bands", "widest_gap") == max(widths)
    corner = np.sort(bands["frequency"].values[4])  # the first leg has a quarter of the points
    assert take(results, "bands", "band[3,X]") == corner[2]
    for text, message in (
        ("band[3,K]", "has the points G, X, M, Y"),
        ("band_gap[5]", r"raise analysis\.count"),
        ("band_gap[1,G-M]", "has the legs all, G-X"),
    ):
        with pytest.raises(InputError, match=message):
            take(results, "bands", text)


@pytest.mark.matrix
def test_gaps_along_stretched_states_are_kept(tmp_path):
    """A sweep over the stretch goes on from its folder; 1 is the state at rest."""
    (tmp_path / "case.toml").write_text(BANDS.replace("zone = 6\nattenuation = 20\n", ""))
    found = []
    for _ in range(2):
        swept = fd.sweep(
            tmp_path / "case.toml", {"analysis.stretch": [1.0, 1.002]},
            measures=["band_gap[4,X-M]"],
            processes=1, folder=tmp_path / "points", progress=found.append,
        )  # fmt: skip
    assert (found[1].found, found[3].found) == (0, 2)
    rest = fd.read_case(tmp_path / "case.toml").run()
    width = rest["gap_width"].values[
        (rest["gap_direction"].values == "X-M") & (rest["gap_below"].values == 4)
    ]
    values = swept["band_gap_4_X-M"].values
    np.testing.assert_allclose(values[:1], width, rtol=1e-6)
    assert abs(values[1] / values[0] - 1.0) > 1e-4


@pytest.mark.matrix
def test_a_response_peaks_and_is_damped_as_its_mode(results):
    """alpha = 0.2 1/s: damping ratio alpha/(2 w) of mass-proportional damping."""
    _, modes = results["modes"]
    for text in ("[8]", "[8,z]"):
        found = float(take(results, "frf", f"peak_frequency{text}"))
        near = np.abs(modes["frequency"].values / found - 1.0)
        assert near.min() < 0.005
        ratio = 0.2 / (4.0 * np.pi * found)
        assert take(results, "frf", f"peak_damping{text}") == pytest.approx(ratio, rel=0.05)
        peaks = take(results, "frf", f"peak_frequencies{text}")
        assert (np.diff(peaks) > 0.0).all() and found in peaks
    _, response = results["frf"]
    largest = float(np.abs(response["receptance"].sel(node=8, axis="z")).max())
    height = float(take(results, "frf", "peak_height[8,z]"))
    assert largest <= height < 1.1 * largest


def test_a_motion_rings_at_its_frequency_and_decays(results):
    _, modes = results["modes"]
    _, motion = results["dynamics"]
    found = float(take(results, "dynamics", "peak_frequency[8]"))
    assert np.abs(modes["frequency"].values - found).min() < 1.0 / 40.0  # one line of the spectrum
    moved = motion["displacement"]
    assert take(results, "dynamics", "displacement[8,z]") == moved[-1].sel(node=8, axis="z")
    lengths = np.linalg.norm(moved.values, axis=2)
    assert take(results, "dynamics", "largest_displacement") == lengths.max()
    assert take(results, "dynamics", "largest_displacement[8]") == lengths[:, 8].max()
    energy = motion["strain_bars"] + motion["strain_folds"] + motion["strain_bends"]
    assert take(results, "dynamics", "strain_energy") == float(energy.max())
    assert take(results, "dynamics", "dissipated") == float(motion["dissipated"][-1])
    balance = float(motion["work"][-1])
    assert 0.0 < take(results, "dynamics", "dissipated") < balance


def test_what_a_path_carries(results):
    case_file, path = results["statics"]
    assert take(results, "statics", "largest_load") == 1.0
    # equilibrium: the forces of -1e-3 N on two nodes go into the supports
    assert take(results, "statics", "reaction[x]") == pytest.approx(2e-3, rel=1e-6)
    # twice the force of one node against the mean displacement of both
    moved = -float(path["displacement"][1].sel(axis="x").isel(node=[0, 1]).mean())
    load = float(path["load_factor"][1]) * 1e-3
    stiffness = float(take(results, "statics", "stiffness"))
    known = fd.landscape(path, case_file.case())
    assert stiffness == pytest.approx(known.force[1] / known.stroke[1], rel=1e-12)
    assert stiffness * moved / load == pytest.approx(2.0, rel=1e-9)
    structure = case_file.case().structure
    i, j = structure.bars.T
    ends = structure.nodes + path["displacement"].values[-1]
    strain = np.linalg.norm(ends[j] - ends[i], axis=1) / structure.bar_length - 1.0
    assert take(results, "statics", "strain") == pytest.approx(np.abs(strain).max(), rel=1e-12)


@pytest.mark.matrix
def test_the_barriers_of_a_tower_that_snaps(tmp_path):
    case = fd.studies.find_case("gallery/kresling-displacement")
    names = ["stable_states", "barrier", "barrier_back", "state_strokes", "state_energies"]
    case_file = fd.read_case(case)
    as_it_is = {"sheet.thickness": [case_file.sheet.thickness]}
    found = fd.sweep(
        case, as_it_is, measures=[*names, "limit_load", "first_maximum"], processes=1
    ).isel(thickness=0)
    assert str(found["failure"].values) == ""
    known = fd.landscape(case_file.run(), case_file.case())
    assert int(found["stable_states"]) == len(known.stable) == 2
    assert float(found["barrier"]) == pytest.approx(known.barrier(0, 1), rel=1e-9)
    assert float(found["barrier_back"]) == pytest.approx(known.barrier(1, 0), rel=1e-9)
    strokes = [state.stroke for state in known.stable]
    np.testing.assert_allclose(found["state_strokes"], strokes, rtol=1e-9)
    tops = np.flatnonzero((np.diff(known.force)[:-1] > 0.0) & (np.diff(known.force)[1:] <= 0.0))
    top = known.force[1 + tops[0]]
    assert top <= float(found["first_maximum"]) < 1.01 * top
    assert np.isnan(found["limit_load"])  # the top is moved, so no load has a limit


def test_own_measures_are_found_by_module_and_by_file(tmp_path, results):
    (tmp_path / "mine.py").write_text("def one(result, case):\n    return len(case.loads)\n")
    case_file, result = results["modes"]
    found = own_measure("mine.py:one", tmp_path)
    assert found is not None and found.name == "one"
    assert found.of(result, case_file.case(), {}) == 0
    named = own_measure("two=swept_cases:slow_measure", tmp_path)
    assert named is not None and named.name == "two"
    assert own_measure("peak_frequency[8]", tmp_path) is None
    for text in ("mine.py:two", "nowhere:one", "none.py:one"):
        with pytest.raises(InputError, match=r"has no function|cannot be imported"):
            own_measure(text, tmp_path)


def test_the_table_of_the_page_can_be_read(tmp_path):
    page = (DOCS / "sweeps.md").read_text("utf-8")
    (table,) = re.findall(r"^```toml\n(.*?)^```$", page, re.M | re.S)
    (tmp_path / "case.toml").write_text(MODES + table)
    found = fd.sweep(tmp_path / "case.toml", samples=2, processes=1)
    assert set(found.data_vars) >= {"frequencies", "effective_mass_1_z"}
    assert found.attrs["failed"] == 0


def test_the_first_loss_of_stability_is_the_first_critical_point():
    """A bifurcation before a limit point on the path, whose load factor is lower or not."""
    path = xr.Dataset(
        {
            "point": ("step", ["regular", "bifurcation", "limit"]),
            "negative_eigenvalues": ("step", [0, 1, 2]),
        },
        {"load_factor": ("step", [0.0, 2.0, 1.5])},
        {"method": "arc_length", "locate": 1},
    )
    taken = MEASURES["first_loss_of_stability"].function
    assert taken(path, None) == 2.0
    assert taken(path.isel(step=[0, 2]), None) == 1.5
    assert np.isnan(taken(path.isel(step=[0]), None))


def test_registered_measures_are_stamped_by_the_program_alone():
    """A stamp of theirs that changed from process to process would find no stored point again."""
    assert {code_of(one.function) for one in MEASURES.values()} == {""}
