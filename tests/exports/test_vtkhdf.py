"""VTKHDF: what VTK reads at every sample, or h5py where there is no VTK."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

import foldyn as fd
from foldyn.exports.vtkhdf import BAR, CELLS, PANEL
from foldyn.viewer.states import fields


@pytest.fixture
def read(tmp_path):
    """Give the reader of VTK, and the times, of a result as exported."""
    vtk = pytest.importorskip("vtk")

    def opened(result, **options):
        (file,) = fd.export(result, tmp_path / "x.vtkhdf", **options)
        reader = vtk.vtkHDFReader()
        reader.SetFileName(str(file))
        reader.UpdateInformation()
        about = reader.GetOutputInformation(0)
        key = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
        return reader, [about.Get(key, k) for k in range(about.Length(key))]

    return opened


def arrays(data):
    from vtk.util.numpy_support import vtk_to_numpy

    count = data.GetNumberOfArrays()
    return {data.GetArrayName(k): vtk_to_numpy(data.GetArray(k)) for k in range(count)}


def at(reader, time):
    """Points, fields of points and cells, and numbers at a time."""
    from vtk.util.numpy_support import vtk_to_numpy

    reader.UpdateTimeStep(time)
    mesh = reader.GetOutput()
    parts = mesh.GetPointData(), mesh.GetCellData(), mesh.GetFieldData()
    return vtk_to_numpy(mesh.GetPoints().GetData()).copy(), *map(arrays, parts)


def test_every_sample_of_a_motion(motion, case, read):
    reader, times = read(motion)
    np.testing.assert_array_equal(times, motion["time"].values)
    u = motion["displacement"].values
    expected = fields(case, motion, u)
    for k, time in enumerate(times):
        points, nodes, cells, numbers = at(reader, time)
        np.testing.assert_allclose(points, case.structure.nodes + u[k], rtol=1e-6, atol=1e-9)
        for name in ("displacement", "velocity"):
            np.testing.assert_array_equal(nodes[name], motion[name].values[k].astype(np.float32))
        strain = cells["strain"][cells["kind"] == BAR]
        np.testing.assert_array_equal(strain, expected["bar_strain"].values[k].astype(np.float32))
        on = cells["crease"] >= 0
        for name, own in (("turn", "turn"), ("moment", "fold_moment")):
            values = expected[own].values[k].astype(np.float32)
            np.testing.assert_array_equal(cells[name][on], values[cells["crease"][on]])
            assert np.isnan(cells[name][~on]).all()
        energy = expected["energy"].values[k].astype(np.float32)
        panels = cells["kind"] == PANEL
        np.testing.assert_array_equal(cells["energy"][panels], energy[cells["panel"][panels]])
        assert numbers["strain_bars"][0] == motion["strain_bars"].values[k]


def test_cells_join_the_nodes_of_panels_edges_and_bars(motion, case, read):
    reader, _ = read(motion)
    *_, cells, _ = at(reader, 0.5)
    mesh, structure = reader.GetOutput(), case.structure
    corners = [
        [mesh.GetCell(k).GetPointId(i) for i in range(mesh.GetCell(k).GetNumberOfPoints())]
        for k in range(mesh.GetNumberOfCells())
    ]
    kind, pattern = cells["kind"], structure.pattern
    own = {k: [c for c, is_k in zip(corners, kind == k, strict=True) if is_k] for k in range(7)}
    assert own[PANEL] == structure.triangles.tolist()
    assert own[BAR] == structure.bars.tolist()
    assert own[4] == pattern.boundary.tolist()
    np.testing.assert_array_equal(cells["panel"][kind == PANEL], structure.triangle_panel)
    for number, letter in enumerate("MV"):
        rows = np.array(pattern.assignments) == letter
        assert own[number] == pattern.creases[rows].tolist()


def test_a_path_goes_by_its_steps(path, read):
    reader, times = read(path)
    assert times == list(range(7))
    for k, time in enumerate(times):
        assert at(reader, time)[-1]["load_factor"][0] == path["load_factor"].values[k]


def test_modes_are_fields_of_nodes_that_stay(modes, read):
    reader, times = read(modes)
    assert times == [1, 2, 3]
    for k, time in enumerate(times):
        points, nodes, cells, numbers = at(reader, time)
        np.testing.assert_array_equal(points, modes["rest_position"].values.astype(np.float32))
        np.testing.assert_array_equal(nodes["shape"], modes["shape"].values[k].astype(np.float32))
        assert numbers["frequency"][0] == modes["frequency"].values[k]
        assert "strain" not in cells


def test_some_samples(motion, read):
    _, times = read(motion, frames=3)
    np.testing.assert_array_equal(times, motion["time"].values[[0, 3, 6]])


def test_a_shell_has_no_bars(shell_motion, read):
    reader, times = read(shell_motion)
    points, nodes, cells, _ = at(reader, times[-1])
    assert set(cells) == {"kind", "crease", "panel"} and BAR not in cells["kind"]
    assert len(points) == shell_motion.sizes["node"] and "velocity" in nodes


def test_the_mesh_is_stored_once(motion, case, tmp_path):
    (file,) = fd.export(motion, tmp_path / "x.vtkhdf")
    with h5py.File(file) as read:
        root = read["VTKHDF"]
        assert root.attrs["Type"] == b"PolyData"
        assert root["Polygons/Connectivity"].shape == (case.structure.triangles.size,)
        assert root["CellData/kind"].shape == root["CellData/panel"].shape
        assert root["Points"].shape == (7 * len(case.structure.nodes), 3)
        assert root["Points"].dtype == np.float32


def test_offsets_lead_to_each_sample_without_vtk(motion, case, tmp_path):
    (file,) = fd.export(motion, tmp_path / "x.vtkhdf")
    u = motion["displacement"].values
    strain = fields(case, motion, u)["bar_strain"].values
    with h5py.File(file) as read:
        root, steps = read["VTKHDF"], read["VTKHDF/Steps"]
        count = sum(int(root[f"{kind}/NumberOfCells"][0]) for kind in CELLS)
        nodes, kind = int(root["NumberOfPoints"][0]), root["CellData/kind"][:]
        assert (len(kind), steps.attrs["NSteps"]) == (count, len(u))
        for k in range(len(u)):
            first = steps["PointOffsets"][k]
            points = root["Points"][first : first + nodes]
            np.testing.assert_allclose(points, case.structure.nodes + u[k], rtol=1e-6, atol=1e-9)
            first = steps["PointDataOffsets/displacement"][k]
            moved = root["PointData/displacement"][first : first + nodes]
            np.testing.assert_array_equal(moved, u[k].astype(np.float32))
            first = steps["CellDataOffsets/strain"][k]
            values = root["CellData/strain"][first : first + count]
            np.testing.assert_array_equal(values[kind == BAR], strain[k].astype(np.float32))
            assert steps["CellDataOffsets/kind"][k] == 0


def test_a_folding_has_the_angles_of_its_creases(folding, tmp_path):
    way = folding
    (file,) = fd.export(way, tmp_path / "x.vtkhdf")
    with h5py.File(file) as read:
        root = read["VTKHDF"]
        points = root["Points"][:].reshape(way.sizes["step"], -1, 3)
        np.testing.assert_allclose(points, way["position"].values, atol=1e-6)
        crease = root["CellData/crease"][:]
        turn = root["CellData/turn"][:].reshape(way.sizes["step"], -1)[:, crease >= 0]
        np.testing.assert_allclose(turn, np.degrees(way["fold_angle"].values), rtol=1e-6)
        np.testing.assert_array_equal(root["FieldData/share"][:], way["share"].values)
