"""Universal files: what pyuff, which shares no code with us, reads of them; and their records."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from small_results import case, modes, motion, path, response

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.exports import uff

pyuff = pytest.importorskip("pyuff")


def sets(result, folder, **options):
    (file,) = fd.export(result, folder / "a.uff", **options)
    return pyuff.UFF(str(file)).read_sets()


def of(found, kind):
    return [one for one in found if one["type"] == kind]


def test_units_and_geometry(tmp_path):
    found = sets(modes(), tmp_path)
    assert found[0]["type"] == 164 and found[0]["units_code"] == 1
    assert (found[0]["length"], found[0]["force"], found[0]["temp_offset"]) == (1.0, 1.0, 273.15)
    (nodes,) = of(found, 2411)
    np.testing.assert_array_equal(nodes["node_nums"], np.arange(1, 9))
    for k, axis in enumerate("xyz"):
        np.testing.assert_array_equal(nodes[axis], modes().rest_position[:, k])
    (line,) = of(found, 82)
    pairs = np.append(line["nodes"], 0).reshape(-1, 3)[:, :2] - 1
    np.testing.assert_array_equal(pairs, case().structure.pattern.edges)
    (panels,) = of(found, 2412)
    assert [one["nodes_nums"] for one in panels[94]] == [[1, 3, 4, 2], [3, 5, 6, 4]]


def test_long_lines_are_divided_and_large_panels_cut(tmp_path):
    pattern = fd.patterns.miura(cells=(8, 8), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    edges = np.concatenate(
        [
            np.array([int(word) for line in rows[2:] for word in line.split()] + [0]).reshape(-1, 3)
            for rows in (list(uff._trace(1, pattern.edges[k : k + 80])) for k in range(0, 544, 80))
        ]
    )
    np.testing.assert_array_equal(edges[:, :2] - 1, pattern.edges[: len(edges)])
    assert all(len(row) <= 80 for row in uff._trace(1, pattern.edges[:80]))
    assert 3 * uff.TRACED <= 250
    assert uff._pieces((4, 5, 6, 7, 8)) == [(4, 5, 6), (4, 6, 7), (4, 7, 8)]


def test_modes_have_mass_frequency_and_damping(tmp_path):
    found = of(sets(modes(), tmp_path), 55)
    assert [one["mode_n"] for one in found] == [1, 2, 3, 4]
    for k, one in enumerate(found):
        assert one["analysis_type"] == 2 and one["modal_m"] == 1.0
        assert one["freq"] == pytest.approx(float(modes().frequency[k]), rel=1e-5)
        assert one["modal_damp_vis"] == pytest.approx(float(modes().damping_ratio[k]), rel=1e-5)
        shape = np.stack([one["r1"], one["r2"], one["r3"]], axis=1)
        np.testing.assert_allclose(shape, modes()["shape"][k], rtol=1e-5)
        np.testing.assert_array_equal(one["node_nums"], np.arange(1, 9))


def test_rigid_modes_have_no_frequency_and_unstable_ones_are_left_out(tmp_path):
    odd = modes().copy(deep=True)
    odd.frequency.values[:2] = 0.0, np.nan
    odd.damping_ratio.values[:2] = np.nan
    with pytest.warns(FoldynWarning, match=r"modes \[2\] are unstable"):
        found = of(sets(odd, tmp_path), 55)
    assert [one["mode_n"] for one in found] == [1, 3, 4]
    assert found[0]["freq"] == found[0]["modal_damp_vis"] == 0.0


def test_responses(tmp_path):
    found = of(sets(response(), tmp_path, nodes=[7, 2]), 58)
    assert [(one["rsp_node"], one["rsp_dir"]) for one in found] == [
        (8, 1), (8, 2), (8, 3), (3, 1), (3, 2), (3, 3),
    ]  # fmt: skip
    for one in found:
        assert (one["func_type"], one["ref_node"], one["ref_dir"]) == (4, 1, -1)
        assert (one["ordinate_spec_data_type"], one["orddenom_spec_data_type"]) == (8, 13)
        np.testing.assert_allclose(one["x"], response().frequency, rtol=1e-12)
        true = response().receptance[:, one["rsp_node"] - 1, one["rsp_dir"] - 1]
        np.testing.assert_allclose(one["data"], true, rtol=1e-12)


def test_histories(tmp_path):
    found = of(sets(motion(), tmp_path, nodes=1, fields=["displacement", "velocity"]), 58)
    assert [one["ordinate_spec_data_type"] for one in found] == [8, 8, 8, 11, 11, 11]
    for one in found:
        name = "displacement" if one["ordinate_spec_data_type"] == 8 else "velocity"
        assert one["func_type"] == 1 and one["abscissa_axis_units_lab"] == "s"
        true = motion()[name][:, 1, one["rsp_dir"] - 1]
        np.testing.assert_allclose(one["data"], true, rtol=1e-12)


def test_forces_on_several_nodes_are_a_load_case(tmp_path):
    both = response().copy(deep=True)
    both["drive"][1, 0] = 1.0
    (one, *_) = of(sets(both, tmp_path, nodes=0), 58)
    assert (one["load_case_id"], one["ref_node"], one["ref_dir"]) == (1, 0, 0)


@pytest.mark.parametrize("result", [response, motion], ids=["complex", "real"])
def test_uneven_abscissae_are_written_out(tmp_path, result):
    along = "frequency" if result is response else "time"
    uneven = result().isel({along: [0, 1, 3, 4, 5]})
    (one, *_) = of(sets(uneven, tmp_path, nodes=0), 58)
    assert one["abscissa_spacing"] == 0 and one["num_pts"] == 5
    np.testing.assert_allclose(one["x"], uneven[along], rtol=1e-5)
    name = "receptance" if result is response else "displacement"
    np.testing.assert_allclose(one["data"], uneven[name][:, 0, 0], rtol=1e-12)


def test_a_spacing_that_six_digits_spoil_is_not_even():
    assert uff._even(np.arange(100) / 240.0) == (0.0, 4.16667e-3)  # right to 8e-7
    assert uff._even(10.0 + np.arange(100) * 1.234567e-5) == (10.0, 1.23457e-5)
    assert uff._even(np.arange(1000) * 0.001) == (0.0, 0.001)
    assert uff._even(np.array([0.0, 1.0, 3.0])) == (0.0, 0.0)
    assert uff._even(np.array([2.0])) == (0.0, 0.0)


def test_records_stand_in_their_columns(tmp_path):
    """Formats (6I10), (4E13.5) and 2(I5,I10),2(1X,10A1,I10,I4) of the definition."""
    (file,) = fd.export(modes(), tmp_path / "a.unv")
    lines = file.read_text("ascii").splitlines()
    at = lines.index("    55")
    assert lines[at - 1] == "    -1"
    assert lines[at + 6] == "         1         2         2         8         2         3"
    assert lines[at + 7] == "         2         4         1         1"
    assert [float(lines[at + 8][k : k + 13]) for k in range(0, 52, 13)][1] == 1.0
    assert len(lines[at + 8]) == 52 and len(lines[at + 10]) == 39
    (file,) = fd.export(response(), tmp_path / "b.uff", nodes=[6])
    lines = file.read_text("ascii").splitlines()
    at = lines.index("    58")
    assert lines[at + 6] == (
        "    4         0    0         0 NONE               7   1 NONE               1  -1"
    )
    assert [lines[at + 7][k : k + 10].strip() for k in (0, 10, 20)] == ["6", "21", "1"]
    assert len(lines[at + 12]) == 80


def test_coherence_of_what_does_not_move_is_left_out(tmp_path):
    values = np.full(response().receptance.shape, 0.9)
    values[:, 4] = np.nan
    more = response().assign(coherence=(response().receptance.dims, values))
    found = of(sets(more, tmp_path, nodes=[4, 5], fields="coherence"), 58)
    assert [(one["func_type"], one["rsp_node"]) for one in found] == [(6, 6)] * 3


def test_what_universal_files_cannot_hold_is_refused(tmp_path):
    lacking = response().copy(deep=True)
    lacking["receptance"][4] = np.nan
    with pytest.raises(InputError, match=r"receptance has no value at 1 of 21 .* frequency 0\.4"):
        fd.export(lacking, tmp_path / "a.uff")
    with pytest.raises(InputError, match="'path', which the format uff does not hold"):
        fd.export(path(), tmp_path / "a.uff")
    with pytest.raises(InputError, match=r"fields = .velocity"):
        fd.export(response(), tmp_path / "a.uff", fields="velocity")
    with pytest.raises(InputError, match="node 8 is out of range"):
        fd.export(response(), tmp_path / "a.uff", nodes=[8])
    assert not list(tmp_path.iterdir())
    assert isinstance(lacking, xr.Dataset)
