"""Damaged NetCDF files: noticed, refused with a remedy, and never read at any price."""

from __future__ import annotations

import ctypes
import os
import re
import time

import h5py
import numpy as np
import pytest
import xarray as xr

import foldyn as fd
from foldyn.cases.document import Document
from foldyn.dynamics import initial_state
from foldyn.errors import ComputationError, InputError
from foldyn.experiment import TrackedModel
from foldyn.results import netcdf, trajectory_dataset
from foldyn.results.netcdf import apart
from foldyn.results.stored_case import case_variables, document_of

SEAL = 80  # bytes at the end


def still(make=fd.discretize, **options) -> xr.Dataset:
    """A sheet at rest."""
    s = make(fd.patterns.miura((1, 1)), fd.Sheet(1e6, 0.25, 0.01, 1e3), **options)
    case = fd.Case(s, [fd.Fix("xmin")])
    moved, reaction = np.zeros((3, len(s.nodes), 3)), np.zeros((3, len(case.supported_dofs)))
    return trajectory_dataset(case, [0.0, 0.1, 0.2], moved, moved, reaction, {}, {})


@pytest.fixture(scope="module")
def motion() -> xr.Dataset:
    return still()


@pytest.fixture
def file(motion, tmp_path):
    path = tmp_path / "run.nc"
    fd.save(motion, path)
    return path


def unsealed(path):
    """As older programs wrote it."""
    path.write_bytes(path.read_bytes()[:-SEAL])
    return path


def refusal(path) -> str:
    with pytest.raises(InputError) as caught:
        fd.load(path)
    assert str(caught.value).startswith(str(path))
    return str(caught.value)


def test_every_flipped_bit_shows(file, motion):
    sound = file.read_bytes()
    assert netcdf.sound(file)
    random = np.random.default_rng(0)
    for place in [*random.integers(0, len(sound), 200), 0, len(sound) - SEAL - 1, len(sound) - 2]:
        damaged = bytearray(sound)
        damaged[place] ^= 1 << int(random.integers(8))
        file.write_bytes(damaged)
        if netcdf.sound(file) is None:  # the seal itself: all before it is sound
            assert place >= len(sound) - SEAL
            xr.testing.assert_identical(fd.load(file), motion)
        else:
            assert "is damaged: its checksum does not match" in refusal(file)


@pytest.mark.matrix
def test_files_without_a_seal_are_read(file, motion):
    xr.testing.assert_identical(fd.load(unsealed(file)), motion)
    assert netcdf.sound(file) is None
    motion.to_netcdf(file, engine="h5netcdf")
    xr.testing.assert_identical(fd.load(file), motion)


def test_other_programs_read_and_change_sealed_files(file, motion):
    xr.testing.assert_identical(xr.load_dataset(file, decode_times=False), motion)
    with h5py.File(file, "r+") as changed:
        changed.attrs["note"] = "mine"
        changed["displacement"][1, 2, 0] = 0.5
    found = fd.load(file)  # HDF5 has cut the seal off
    assert found.attrs["note"] == "mine"
    assert found["displacement"].values[1, 2, 0] == 0.5


@pytest.mark.matrix
def test_a_file_cut_short_is_refused(file):
    sound = file.read_bytes()
    for left in (0, 5, 100, len(sound) // 2, len(sound) - SEAL - 1):
        file.write_bytes(sound[:left])
        assert "restore it from a copy, or compute it again" in refusal(file)


def test_a_file_that_declares_more_than_it_holds_is_refused_at_once(tmp_path):
    file = tmp_path / "huge.nc"
    with h5py.File(file, "w") as made:
        made.create_dataset("case", (3 * 10**9,), "f8")
        made.attrs["foldyn_result"] = "trajectory"
    assert file.stat().st_size < 8000
    start = time.perf_counter()
    assert "it declares 2.4e+10 bytes of numbers in a file of" in refusal(file)
    assert time.perf_counter() - start < 3.0


def elsewhere(made, kind) -> None:
    """Put something that is no variable of the file in the place of one."""
    if kind == "stored elsewhere":
        made.create_dataset("displacement", (8,), "f8", external=[("/dev/zero", 0, 64)])
    elif kind == "virtual":
        layout = h5py.VirtualLayout((4,), "f8")
        layout[:] = h5py.VirtualSource("/dev/zero", "x", (4,))
        made.create_virtual_dataset("displacement", layout)
    elif kind == "group":
        made.create_group("displacement")
    else:
        soft, other = h5py.SoftLink("/velocity"), h5py.ExternalLink("other.nc", "/displacement")
        made["displacement"] = soft if kind == "soft" else other


@pytest.mark.parametrize("kind", ["soft", "external", "stored elsewhere", "virtual", "group"])
def test_nothing_but_variables_of_the_file_itself_is_read(kind, file):
    with h5py.File(file, "r+") as made:
        del made["displacement"]
        elsewhere(made, kind)
    assert "displacement is not a variable in it" in refusal(file)


def test_much_that_is_well_packed_is_read(tmp_path):
    ds = xr.Dataset({"a": ("t", np.zeros(2_000_000))})
    ds.to_netcdf(tmp_path / "a.nc", engine="h5netcdf", encoding={"a": {"zlib": True}})
    assert (tmp_path / "a.nc").stat().st_size < 60_000
    xr.testing.assert_identical(netcdf.read(tmp_path / "a.nc", ""), ds)


def complex_parts(**parts):
    """A result with variables that pose as parts of one that is complex."""
    posed = {"x_real": {"part_of_complex": "x"}, "x": {"part_of_complex": "response"}}
    return lambda ds: ds.assign({k: (*v, posed.get(k, {})) for k, v in parts.items()})


HALF = "lacks its real or imaginary part"


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda ds: ds.assign_attrs(foldyn_result=1), "is damaged: its attribute `foldyn_result`"),
        (lambda ds: ds.assign_attrs(foldyn_format="one"), "foldyn_format must be a whole number"),
        (lambda ds: ds.assign_attrs(foldyn_format=0.5), "foldyn_format must be a whole number"),
        (lambda ds: ds.assign(case=("few", ["a", "b"])), "its variable `case` is no text"),
        (complex_parts(x=((), 1.0)), HALF),
        (complex_parts(x_real=((), 1.0), x_imag=("node", np.arange(13))), HALF),
        (complex_parts(x_real=((), 1), x_imag=((), 2.0)), HALF),
    ],
)
def test_results_with_the_wrong_contents_are_refused(change, text, motion, tmp_path):
    netcdf.write(change(motion), tmp_path / "run.nc")
    assert text in refusal(tmp_path / "run.nc")


def test_variables_must_fit_their_dimensions(file):
    with h5py.File(file, "r+") as made:
        known = {k: v for k, v in made["node"].attrs.items() if k != "REFERENCE_LIST"}
        del made["node"]
        made["node"] = np.arange(2)
        made["node"].attrs.update(known)
    assert "it is damaged" in refusal(file)


def case_text(text):
    return lambda ds: ds.assign(case=((), text))


def edited(pattern, new):
    """Change what a pattern finds in the text of the case."""
    return lambda ds: case_text(re.sub(pattern, new, str(ds["case"].values[()]), count=1))(ds)


def faces(change):
    """Change the vertex numbers of the faces."""

    def changed(ds):
        sections, arrays = document_of(ds)
        other = arrays | {"faces": change(arrays["faces"])}
        return ds.assign(case=case_variables(Document(sections, other, ()))["case"])

    return changed


NONE = "no finite displacements"
NUMBERS = "must be numbers over node, axis; it has"


@pytest.mark.parametrize(
    ("make", "change", "text"),
    [
        (fd.case_of, lambda ds: ds.assign_attrs(rerunnable="x"), "rerunnable must be a whole"),
        (fd.case_of, case_text("a = " + "[" * 9999), "case is damaged"),
        (fd.case_of, case_text("a = " + "9" * 5000), "case is damaged"),
        (fd.case_of, case_text("[pattern"), "damaged"),
        (fd.case_of, case_text("title = 1"), "damaged"),
        (fd.case_of, edited(r"face_offsets = .*\n", ""), "lacks its array face_offsets"),
        (fd.case_of, edited("i8 16 ", "i8 15 "), "its array .faces. cannot be read"),
        (fd.case_of, edited('faces = "<i8 ', 'faces = "O '), "its array .faces. cannot be read"),
        (fd.case_of, edited("i8 16 ....", "i8 16 "), "its array .faces. cannot be read"),
        (fd.case_of, edited("i8 16 ....", "i8 16 é"), "its array .faces. cannot be read"),
        (fd.case_of, edited('faces = ".*"', "faces"), "its array .faces. cannot be read"),
        (fd.case_of, lambda ds: ds.drop_vars("rest_position"), "lacks its array rest_position"),
        (fd.case_of, lambda ds: ds.isel(node=[1, 2]), "use the whole result"),
        (fd.case_of, faces(lambda numbers: numbers + 1000), "vert"),
        (fd.case_of, faces(lambda numbers: numbers * 2**62), "vert|damaged"),
        (fd.case_of, faces(lambda numbers: numbers.astype(str)), "damaged|vert"),
        (initial_state, lambda ds: ds.assign(displacement=ds["node"]), "displacement must be numb"),
        (
            initial_state,
            lambda ds: ds.assign_coords(time=ds["time"].astype(object)),
            "time must be numbers",
        ),
        (
            initial_state,
            lambda ds: ds.assign(velocity=ds["velocity"].astype(str)),
            f"velocity {NUMBERS} <U3",
        ),
        (
            initial_state,
            lambda ds: ds.transpose(..., "axis", "node"),
            f"displacement {NUMBERS} float64 over axis, node",
        ),
        (TrackedModel.of, lambda ds: ds.isel(time=[]), NONE),
        (TrackedModel.of, lambda ds: ds.assign(displacement=ds["displacement"] * np.nan), NONE),
        (TrackedModel.of, lambda ds: ds.assign(rest_position=ds["displacement"]), "rest|damaged"),
    ],
)
def test_what_is_made_of_a_result_checks_it(make, change, text, motion):
    with pytest.raises(InputError, match=text):
        make(change(motion))


def test_a_damaged_case_asks_for_no_mesh_larger_than_the_result():
    ds = still(fd.shell, divisions=2)
    assert fd.case_of(ds).structure.options.divisions == 2
    text = str(ds["case"].values[()])
    start = time.perf_counter()
    for many in (4, 10**9, 2**62):
        other = ds.assign(case=((), text.replace("divisions = 2", f"divisions = {many}")))
        with pytest.raises(InputError, match="its structure has at least"):
            fd.case_of(other)
    assert time.perf_counter() - start < 2.0


# ------------------------------------------------------------------- a process of its own
def test_a_call_apart_returns_what_it_makes_or_raises_it():
    here = os.getpid()
    assert apart(os.getpid, 5, 2**28) != here
    assert apart(lambda: np.arange(3).tolist(), 5, 2**28) == [0, 1, 2]
    with pytest.raises(ComputationError, match="told"):
        apart(lambda: (_ for _ in ()).throw(ComputationError("told")), 5, 2**28)
    with pytest.raises(OSError, match="KeyError: 'other'"):
        apart(lambda: {}["other"], 5, 2**28)


HARM = {
    "abort": os.abort,
    "segmentation fault": lambda: ctypes.string_at(0),
    "exit": lambda: os._exit(0),
    "loop": lambda: all(iter(int, 1)) or [None for _ in iter(int, 1)],
    "wait": lambda: time.sleep(60),
    "memory": lambda: np.ones(2**26),
}


@pytest.mark.parametrize("harm", HARM)
def test_what_crashes_or_hangs_apart_is_an_error_here(harm, capfd):
    start = time.perf_counter()
    with pytest.raises(OSError, match=r"crashed or took too much|MemoryError"):
        apart(HARM[harm], 1, 2**28)
    assert time.perf_counter() - start < 8.0
    assert capfd.readouterr() == ("", "")
