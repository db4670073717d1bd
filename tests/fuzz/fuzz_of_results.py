"""Fuzzers of results and tracks (NetCDF): bytes, and whole parts of what HDF5 holds."""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

import h5py
import numpy as np
import xarray as xr
from fuzz_mutations import INTEGERS, REALS, WORDS, mutate
from fuzz_target import Target

import foldyn as fd
from foldyn.dynamics import initial_state
from foldyn.errors import InputError
from foldyn.experiment import TrackedModel, load_tracks, save_tracks
from foldyn.experiment.calibration.measured_files import recognize, shapes
from foldyn.results import frf_dataset, netcdf, trajectory_dataset

WORDS_OF_CASES = ("kind", "nodes", "array", "history", "supports", "loads", "sheet", "model",
                  "shell", "divisions", "linear", "faces", "vertices", "rest_position")  # fmt: skip


# --------------------------------------------------------------------------- sound files
def results(folder: Path) -> list[bytes]:
    """A motion, a motion of a shell and a frequency response, each with and without its seal."""
    pattern = fd.patterns.miura((1, 1))
    sheet = fd.Sheet(1e6, 0.25, 0.01, 1000.0)
    table = fd.Table([0.0, 0.1, 0.3], [0.0, 1.0, 0.5])
    found = []
    for structure in (
        fd.discretize(pattern, sheet, preset="plate"),
        fd.shell(pattern, sheet, divisions=2),
    ):
        case = fd.Case(structure, [fd.Fix("xmin")], [fd.Force("xmax", (0.0, 0.0, 1.0), table)])
        found.append(_motion(case))
    found.append(_response(case))
    return _stored(folder, [(ds, fd.save) for ds in found])


def _motion(case: fd.Case) -> xr.Dataset:
    random = np.random.default_rng(0)
    moved = 1e-3 * random.normal(size=(4, len(case.structure.nodes), 3))
    energies = dict.fromkeys(("kinetic", "dissipated", "work"), np.zeros(4))
    reaction = np.zeros((4, len(case.supported_dofs)))
    return trajectory_dataset(case, np.arange(4) * 0.1, moved, moved, reaction, energies, {})


def _response(case: fd.Case) -> xr.Dataset:
    state = np.zeros((len(case.structure.nodes), 3))
    response = np.full((2, *state.shape), 1.0 + 2.0j)
    return frf_dataset(case, [1.0, 2.0], "receptance", response, state, state, {})


def tracks(folder: Path) -> list[bytes]:
    """Tracks of a film and of photographs, each with and without its seal."""
    return _stored(folder, [(_tracks(along), save_tracks) for along in ("time", "photo")])


def _tracks(along: str) -> xr.Dataset:
    values = np.arange(36.0).reshape(6, 2, 3) * 1e-3
    values[1, 0] = np.nan
    steps = np.arange(6) if along == "photo" else 0.1 * np.arange(6)
    places = {along: steps, "node": [3, 8], "axis": ["x", "y", "z"]}
    known = {"foldyn_tracks": 1, "metres_per_pixel": 1e-4, "match_rms_px": np.array([0.3])}
    return xr.Dataset({"displacement": ((along, "node", "axis"), values)}, places, known)


def _stored(folder: Path, made: Sequence[tuple[xr.Dataset, Any]]) -> list[bytes]:
    file, found = folder / "seed.nc", []
    for ds, write in made:
        write(ds, file)
        found += [file.read_bytes()] * 2
        end = found[-1].rindex(b"\nfoldyn sha256 ")
        found[-1] = found[-1][:end]  # as older programs wrote it
    file.unlink()
    return found


# ----------------------------------------------------------------------------- mutations
def damage(random: Random, data: bytes, seeds: Sequence[bytes]) -> bytes:
    """Bytes mutated, or parts of a sound HDF5 file."""
    if random.random() < 0.4:
        return mutate(random, data, seeds, ())
    whole = io.BytesIO(data)
    with h5py.File(whole, "r+") as file:
        for _ in range(random.choice((1, 1, 2, 4))):
            name = random.choice(list(file))
            with suppress(KeyError, OSError, RuntimeError, TypeError, ValueError):
                if file.get(name) is not None:  # no link that leads nowhere
                    random.choice(_OF_PARTS)(random, file, name)  # HDF5 itself refuses some
            if not len(file):
                break
    return whole.getvalue()


def _remove(random: Random, file: h5py.File, name: str) -> None:
    del file[name]


def _rename(random: Random, file: h5py.File, name: str) -> None:
    other = random.choice([*file, "x", "time", "displacement", "é", "a b"])
    if other == name:
        return
    if other in file:
        del file[other]
    file.move(name, other)


def _replace(random: Random, file: h5py.File, name: str) -> None:
    """Other numbers, types and shapes under a name."""
    left = ("DIMENSION_LIST", "REFERENCE_LIST")[: random.choice((1, 2, 2))]
    shape = file[name].shape if isinstance(file[name], h5py.Dataset) else ()
    shape = random.choice((shape, shape, shape, (), (0,), (1,), (3,), (*shape, 2), shape[:-1]))
    if np.prod(shape, dtype=float) > 10_000:
        shape = (3,)
    _put(file, name, left, data=_values(random, shape))


def _put(file: h5py.File, name: str, left: Sequence[str] = (), **made: Any) -> None:
    """Make a variable anew; attributes stay but for those that are left out."""
    known = dict(file[name].attrs)
    del file[name]
    file.create_dataset(name, **made)
    for key, value in known.items():
        if key not in left:
            _set(file[name], key, value)


def _values(random: Random, shape: tuple[int, ...]) -> Any:
    types = ("<f8", "<f4", ">f8", "<f2", "<i8", "<u8", "i1", "?", "<c16", "S5", "V3", "str",
             "enum", "pair")  # fmt: skip
    kind = random.choice(types)
    if kind == "str":
        words = np.full(shape, random.choice(WORDS).replace("\0", ""), dtype=object)
        return words.astype(h5py.string_dtype())
    if kind == "enum":
        return np.zeros(shape, h5py.enum_dtype({"a": 0, "b": 1}, basetype="i1"))
    if kind == "pair":
        return np.zeros(shape, [("a", "<f8"), ("b", "S3")])
    value = random.choice(REALS if kind.endswith(("f8", "f4", "f2", "c16")) else [0, 1, 2, 99, 127])
    with np.errstate(all="ignore"):
        return np.full(shape, value).astype(kind)


def _number(random: Random, file: h5py.File, name: str) -> None:
    """A boundary number in its place."""
    item = file[name]
    if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "iuf":
        return
    if not item.size or item.size > 10_000:
        return
    values = item[()].ravel() if item.ndim else np.array([item[()]])
    choice = REALS if values.dtype.kind == "f" else [n for n in INTEGERS if abs(n) < 2**62]
    with np.errstate(all="ignore"):
        values[random.randrange(values.size)] = np.array(random.choice(choice)).astype(item.dtype)
    item[...] = values.reshape(item.shape)


def _text(random: Random, file: h5py.File, name: str) -> None:
    """The stored case, its words mutated."""
    if "case" not in file or not isinstance(file["case"], h5py.Dataset) or file["case"].shape:
        return
    text = file["case"][()]
    if not isinstance(text, bytes):
        return
    text = mutate(random, text, [text], WORDS_OF_CASES).replace(b"\0", b"")
    _put(file, "case", data=text.decode("utf-8", "replace"), dtype=h5py.string_dtype())


def _attribute(random: Random, file: h5py.File, name: str) -> None:
    holder = random.choice((file, file[name]))
    names = [*holder.attrs, "_FillValue", "scale_factor", "add_offset", "coordinates", "units",
             "calendar", "dtype", "_Encoding", "grid_mapping", "missing_value"]  # fmt: skip
    key = random.choice(names)
    if random.random() < 0.2 and key in holder.attrs:
        del holder.attrs[key]
        return
    value = random.choice((
        0, -1, 99, 2**62, 0.5, float("nan"), "", "x", "seconds since 2000-01-01", "w" * 9000,
        b"\xff\xfe", True, np.arange(3), np.array(["a", "b"], object), np.zeros((2, 2)),
        h5py.Empty("f8"), np.array([(1, 2)], "i4,i4"), 1 + 2j, file.ref, file[name].ref,
    ))  # fmt: skip
    _set(holder, key, value)


def _set(holder: Any, key: str, value: Any) -> None:
    with suppress(TypeError, ValueError, OSError, RuntimeError):
        holder.attrs[key] = value


def _huge(random: Random, file: h5py.File, name: str) -> None:
    """A variable that is declared but was never written."""
    shape = random.choice(((3 * 10**9,), (50_000, 50_000), (2**40,), (10**6,), (4, 10**9, 3)))
    kind = random.choice(("f8", "i1", h5py.string_dtype()))
    _put(file, name, shape=shape, dtype=kind, chunks=random.choice((None, True)))


def _other(random: Random, file: h5py.File, name: str) -> None:
    """No variable under its name."""
    del file[name]
    kind = random.randrange(6)
    if kind == 0:
        file.create_group(name)
    elif kind == 1:
        file[name] = h5py.SoftLink(random.choice(("/none", f"/{name}", "/")))
    elif kind == 2:
        file[name] = h5py.ExternalLink(random.choice(("/dev/zero", "none.nc")), "/x")
    elif kind == 3:
        file.create_dataset(name, (8,), "f8", external=[("/dev/zero", 0, 64)])
    elif kind == 4:
        layout = h5py.VirtualLayout((4,), "f8")
        layout[:] = h5py.VirtualSource("/dev/zero", "x", (4,))
        file.create_virtual_dataset(name, layout)
    else:
        file[name] = np.dtype("f8")


_OF_PARTS = [_remove, _rename, _replace, _replace, _number, _number, _text, _text, _attribute,
             _attribute, _huge, _other]  # fmt: skip


# -------------------------------------------------------------------------------- readers
def read_result(file: Path) -> None:
    """All that is made of a result from a file: each of it must refuse by itself."""
    ds = fd.load(file)
    for make in (fd.case_of, initial_state, TrackedModel.of):
        try:
            make(ds)
        except InputError:
            continue


def read_tracks(file: Path) -> None:
    """Tracks, and the measurements that fits make of them."""
    load_tracks(file)
    for make in (recognize, lambda file: shapes(file, load_factor=[0.2 * i for i in range(6)])):
        try:
            make(file)
        except InputError:
            continue
    netcdf.read(file, "")


TARGETS = (
    Target("netcdf", results, read_result, ".nc", mutate=damage),
    Target("tracks", tracks, read_tracks, ".nc", mutate=damage),
)
os.environ["HDF5_USE_FILE_LOCKING"] = "FALSE"
