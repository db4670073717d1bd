"""Tidy tables: what comes back with pandas, and what is refused."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from small_results import backbone, modes, motion, path, response

import foldyn as fd
from foldyn.errors import InputError

pd = pytest.importorskip("pandas")


def table(result, folder, **options):
    (file,) = fd.export(result, folder / "table.csv", **options)
    return pd.read_csv(file)


def test_a_row_for_each_sample_and_node(tmp_path):
    run = motion()
    frame = table(run, tmp_path)
    assert list(frame) == [
        "time [s]", "node",
        *(f"displacement_{axis} [m]" for axis in "xyz"),
        *(f"velocity_{axis} [m/s]" for axis in "xyz"),
    ]  # fmt: skip
    shape = run.displacement.shape[:2]
    assert len(frame) == np.prod(shape)
    np.testing.assert_array_equal(frame["time [s]"].to_numpy().reshape(shape)[:, 3], run.time)
    np.testing.assert_array_equal(frame["node"].to_numpy().reshape(shape)[1], run.node)
    for k, axis in enumerate("xyz"):
        found = frame[f"velocity_{axis} [m/s]"].to_numpy().reshape(shape)
        np.testing.assert_array_equal(found, run.velocity[:, :, k])


def test_a_row_for_each_phase_and_band(tmp_path):
    cell = fd.UnitCell(fd.Case(fd.discretize(fd.patterns.miura(), fd.Sheet(1e6, 0.3, 0.01, 1.0))))
    bands = fd.bands(cell, phases=[(0.5, 0.0), (1.0, 0.0)], count=3, check_model=False)
    frame = table(bands, tmp_path)
    assert len(frame) == 6
    np.testing.assert_array_equal(frame["frequency [Hz]"], bands.frequency.values.ravel())


@pytest.mark.matrix
def test_a_row_for_each_point_of_a_backbone_and_each_of_its_harmonics(tmp_path):
    spine = backbone()
    frame = table(spine, tmp_path)
    for name, title in (("frequency", "frequency [Hz]"), ("amplitude", "amplitude [m]")):
        np.testing.assert_array_equal(frame[title], spine[name])
    parts = table(spine, tmp_path, rows="point,harmonic,node")
    found = parts["coefficient_x_real [m]"] + 1j * parts["coefficient_x_imag [m]"]
    wanted = spine.coefficient.transpose("point", "harmonic", "node", "axis")[..., 0]
    np.testing.assert_array_equal(found, wanted.values.ravel())


def test_numbers_have_all_their_digits(tmp_path):
    run = motion()
    rng = np.random.default_rng(1)
    values = np.exp(rng.normal(0.0, 100.0, run.displacement.shape)) * rng.choice([-1, 1])
    values[0, 0] = 5e-324, -0.0, np.nan
    odd = run.assign(displacement=(run.displacement.dims, values, run.displacement.attrs))
    found = table(odd, tmp_path, fields="displacement").to_numpy()[:, 2:]
    np.testing.assert_array_equal(found.reshape(values.shape), values)


def test_rows_for_samples_supports_and_nodes(tmp_path):
    run = motion()
    energies = table(run, tmp_path, rows="time")
    np.testing.assert_array_equal(energies["kinetic [J]"], run.kinetic)
    assert len(energies) == run.sizes["time"]
    forces = table(run, tmp_path, rows="support, time")
    assert list(forces)[1:4] == ["support", "support_node", "support_axis"]
    fourth = forces[forces.support == 3]
    np.testing.assert_array_equal(fourth["reaction [N]"], run.reaction[:, 3])
    assert set(fourth.support_node) == {int(run.support_node[3])}
    rest = table(run, tmp_path, rows="node")
    np.testing.assert_array_equal(rest.to_numpy()[:, 1:], run.rest_position)


def test_other_kinds_of_results(tmp_path):
    shapes = table(modes(), tmp_path)
    assert list(shapes)[:3] == ["mode", "node", "shape_x [m]"]
    np.testing.assert_array_equal(
        table(modes(), tmp_path, rows="mode")["frequency [Hz]"], modes().frequency
    )
    frame = table(response(), tmp_path)
    found = frame["receptance_y_real [m/N]"] + 1j * frame["receptance_y_imag [m/N]"]
    np.testing.assert_array_equal(found.to_numpy(), response().receptance[:, :, 1].values.ravel())
    points = table(path(), tmp_path, rows="step")
    np.testing.assert_array_equal(points["load_factor"], path().load_factor)
    assert set(points["point"]) == set(path().point.values.tolist())
    assert table(path(), tmp_path)["load_factor"].iloc[-1] == path().load_factor[-1]


def test_some_nodes_and_samples(tmp_path):
    frame = table(motion(), tmp_path, nodes=[4, 1], every=2, fields=["velocity"])
    assert frame.node.tolist()[:2] == [4, 1]
    np.testing.assert_array_equal(frame["time [s]"].unique(), motion().time[[0, 2, 4, 5]])
    np.testing.assert_array_equal(
        frame["velocity_x [m/s]"].to_numpy().reshape(4, 2),
        motion().velocity.values[[0, 2, 4, 5]][:, [4, 1], 0],
    )


def test_nodes_by_place(tmp_path):
    where = fd.case_of(motion()).structure.pattern
    chosen = fd.patterns.select(where, "xmax")
    frame = table(motion(), tmp_path, nodes="xmax", fields=["velocity"])
    assert frame.node.unique().tolist() == chosen.tolist()
    assert table(motion(), tmp_path, nodes="4 1").node.tolist()[:2] == [4, 1]


def test_the_file_is_plain(tmp_path):
    (file,) = fd.export(motion(), tmp_path / "a.csv", rows="time", fields="work")
    with file.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.reader(lines))
    assert rows[0] == ["time [s]", "work [J]"]
    assert [float(row[1]) for row in rows[1:]] == motion().work.values.tolist()
    assert b"\r" not in file.read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rows": "nodes"}, 'rows = "nodes": choose one of "time,node", "time,support"'),
        ({"rows": 3}, "rows = 3: choose one of"),
        ({"fields": "displacment"}, "did you mean 'displacement'"),
        ({"fields": ["kinetic"]}, "fields = .kinetic.: .*choose one of displacement, velocity"),
        ({"nodes": [99]}, "node 99 is out of range; there are 0 to 7"),
        ({"nodes": "1,x"}, 'nodes = "1,x": .* is not a condition'),
        ({"nodes": "x > 99"}, "selects no vertex"),
        ({"nodes": [0], "rows": "time"}, "nodes: rows of this table are not for nodes but time"),
        ({"every": 0}, "every"),
        ({"step": 1}, "not an option of the format csv"),
    ],
)
def test_wrong_options(tmp_path, options, message):
    with pytest.raises(InputError, match=message):
        fd.export(motion(), tmp_path / "a.csv", **options)
    assert not list(tmp_path.iterdir())
