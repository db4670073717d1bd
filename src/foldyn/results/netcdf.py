"""Results and other datasets in NetCDF files, written and read completely or not at all.

A seal at the end of a file reveals damage. HDF5 ignores bytes after the end of its data, and cuts
them off when another program changes the file. Such a file has no seal and is read without this
check, like files of older programs.

NetCDF has no complex numbers. A complex variable of a result is therefore stored as two variables,
its real and its imaginary part, which are joined again on loading.
"""

from __future__ import annotations

import faulthandler
import io
import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeVar

import h5netcdf
import h5py
import numpy as np
import xarray as xr
from xarray.backends import list_engines

from foldyn.errors import FoldynError, InputError, within
from foldyn.input_files import check_file, path_of
from foldyn.results.attributes import FORMAT
from foldyn.results.columns import PIECE, pieces
from foldyn.results.contents import check_result, whole_attribute
from foldyn.results.seal import seal, sound
from foldyn.values import flag
from foldyn.writing import target_of, whole

ENGINE = "h5netcdf"
OTHERS = (
    ".cp", ".csv", ".dat", ".dxf", ".fold", ".gif", ".glb", ".html", ".inp", ".json", ".mat",
    ".mp4", ".npy", ".npz", ".obj", ".opx", ".parquet", ".pkl", ".png", ".stl", ".svg", ".tcl",
    ".toml", ".tsv", ".txt", ".uff", ".unv", ".vtk", ".vtkhdf", ".vtu", ".xlsx", ".xml", ".zarr",
)  # fmt: skip
"""Suffixes that belong to other kinds of files."""
_PARTS = ("real", "imag")
_WHOLE = "part_of_complex"  # attribute of both parts: the name of the complex variable
MOST_PACKED = 1100
"""Largest number of bytes that one byte of a file may expand to; deflate packs at most 1032."""
ALONG = "time"
"""Dimension along which variables may be long."""
CHUNK = 2**20
"""Bytes of a chunk of a variable, which is the least that can be read at once."""
LEAST_MEMORY = 2**29
"""Bytes that reading a file without a seal may take, in addition to the file's content."""
LEAST_SECONDS, PER_SECOND = 2, 50_000
"""Computing time (s) allowed for a file without a seal, and bytes per further second."""


def save(ds: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a result to a NetCDF file.

    The file appears only when it is complete; a file of the same name is replaced.

    Parameters
    ----------
    ds : xarray.Dataset
        A result.
    path : path
        Name of the file, such as ``run.nc``; the folder must exist.

    Raises
    ------
    InputError
        Not a result, or a path that cannot be written, or whose suffix belongs to another kind of
        file, such as ``run.csv``.
    """
    check_result(ds, "cannot save: the dataset ")
    write(_split(ds), path)


def load(path: str | os.PathLike[str], whole: bool = True) -> xr.Dataset:
    """Read a result from a NetCDF file.

    Parameters
    ----------
    path : path
        A file that `save` wrote.
    whole : bool, default True
        Whether to read everything into memory. Otherwise each access reads from the file what it
        needs, for results larger than memory; the file must then stay in place.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    InputError
        There is no such file, or it is not a Foldyn result.
    """
    path, whole = path_of(path), flag("whole", whole)
    ds = read(path, "is not a Foldyn result (it cannot be read as NetCDF)", whole)
    check_result(ds, f"{path}: ")
    with within("", path):
        layout = whole_attribute(ds, "foldyn_format")
    if layout != FORMAT:
        remedy = "update Foldyn" if layout > FORMAT else "compute it again"
        raise InputError(
            f"{path}: was written by Foldyn {ds.attrs.get('foldyn_version')} in format {layout}, "
            f"and this version reads format {FORMAT}; {remedy}"
        )
    try:
        return _joined(ds)
    except (KeyError, TypeError, ValueError):
        raise InputError(
            f"{path}: is damaged: a complex variable lacks its real or imaginary part; restore it "
            "from a copy, or compute it again"
        ) from None


def write(ds: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a dataset to a file, which appears only once it is complete.

    Raises
    ------
    InputError
        The path cannot be written, or its suffix belongs to another kind of file.
    OSError
        The disk is full, or fails.
    """
    path = check_target(path)
    try:
        with whole(path) as part:
            fill(part, lambda sink: _write_pieces(ds, sink, ENGINE))
            seal(part)
    except PermissionError:
        raise InputError(f"{path}: may not be written; choose another folder") from None


def check_target(path: str | os.PathLike[str]) -> Path:
    """Return the path of a file to be written; refuse one that cannot be written.

    Raises
    ------
    InputError
        The path is a folder, its folder does not exist, or its suffix belongs to another kind of
        file.
    """
    path = path_of(path)
    if path.is_dir():
        raise InputError(f"{path}: is a folder; give the name of a file")
    if path.suffix.lower() in OTHERS:
        raise InputError(
            f"{path}: only NetCDF is written; name the file {path.stem}.nc, or write it for other "
            "programs by fd.export"
        )
    return target_of(path)


def fill(path: Path, write_to: Callable[[Sink], Any]) -> None:
    """Write an HDF5 file; if writing fails, raise the disk's error rather than HDF5's."""
    with Sink(path, "w+") as sink:
        try:
            write_to(sink)
        except Exception:
            if sink.failure is None:
                raise
        if sink.failure is not None:
            raise sink.failure


def read(path: str | os.PathLike[str], unreadable: str, into_memory: bool = True) -> xr.Dataset:
    """Read a dataset into memory; lazily if `into_memory` is off and the file has a seal.

    Raises
    ------
    InputError
        There is no such file, or it is damaged or not NetCDF; for unreadable files the message
        contains `unreadable`.
    """
    path = check_file(path, "a NetCDF file")
    try:
        sealed = sound(path)
        if sealed is False:
            raise InputError(
                f"{path}: is damaged: its checksum does not match its content; restore it from a "
                "copy, or compute it again"
            )
        if sealed:
            return _opened(path, into_memory)
        size = path.stat().st_size  # as HDF5 may crash on a damaged file
        list_engines()  # done here so that no forked process needs to
        seconds, memory = LEAST_SECONDS + size // PER_SECOND, LEAST_MEMORY + 3 * MOST_PACKED * size
        return apart(lambda: _opened(path), seconds, memory)
    except InputError:
        raise
    except PermissionError:
        raise InputError(f"{path}: may not be read") from None
    except Exception as error:  # libraries raise any kind of error on damaged files
        raise InputError(
            f"{path}: {unreadable}; if it was one before, it is damaged: restore it from a copy, "
            "or compute it again"
        ) from error


def _opened(path: Path, into_memory: bool = True) -> xr.Dataset:
    _check_header(path)
    opened: Any = xr.load_dataset if into_memory else partial(xr.open_dataset, cache=False)
    with warnings.catch_warnings(action="ignore"):  # xarray's warnings about odd content
        ds = opened(path, engine=ENGINE, decode_times=False, decode_timedelta=False)
    for name, variable in ds.variables.items():
        if variable.shape != tuple(ds.sizes[dim] for dim in variable.dims):
            raise ValueError(f"{name}: {variable.shape} does not fit its dimensions")
    return ds


def _check_header(path: Path) -> None:
    """Refuse a file with missing parts, or one that declares more than it can hold.

    The check precedes any reading: a link may lead to an endless file, and a declared size may
    exceed the memory.
    """
    declared = 0
    with h5py.File(path) as file:
        for name in file:
            own = isinstance(file.get(name, getlink=True), h5py.HardLink)
            item: Any = file[name] if own else None
            if not isinstance(item, h5py.Dataset) or item.external or item.is_virtual:
                raise InputError(f"{path}: is no file of ours: {name} is not a variable in it")
            if item.size and not _is_bare(item):
                declared += item.size * item.dtype.itemsize
    size = path.stat().st_size
    if declared > MOST_PACKED * size:
        raise InputError(
            f"{path}: is damaged: it declares {declared:.3g} bytes of numbers in a file of {size}; "
            "restore it from a copy, or compute it again"
        )


def _is_bare(item: h5py.Dataset) -> bool:
    """Whether an item is only a dimension, without values."""
    name = item.attrs.get("NAME")
    return isinstance(name, bytes) and name.startswith(b"This is a netCDF dimension but not a")


class Sink(io.FileIO):
    """A new file, open for reading and writing, that records failures instead of raising them.

    When the disk is full, HDF5 cannot close its file, and the process ends in a segmentation fault.
    So HDF5 writes through this class. After the first failure, writes seem to succeed, and the
    failure is raised at the end. Only the dataset itself is held in memory.

    Attributes
    ----------
    failure : BaseException or None
        Error that ended the writing: a full disk, or an interruption.
    """

    failure: BaseException | None = None

    def write(self, data: Any, /) -> int:
        """Write all the data, or record the failure."""
        left = memoryview(data).cast("B")
        size, end = len(left), self.tell() + len(left)
        try:
            while len(left) and self.failure is None:
                left = left[super().write(left) :]
        except BaseException as failure:
            self.failure = failure
        self.seek(end)
        return size

    def truncate(self, size: int | None = None, /) -> int:
        """Set the size, or record the failure."""
        try:
            if self.failure is None:
                return super().truncate(size)
        except BaseException as failure:
            self.failure = failure
        return self.tell() if size is None else size

    def readinto(self, buffer: Any, /) -> int:
        """Read; bytes that could not be written are returned as zeros."""
        room = memoryview(buffer).cast("B")
        found = 0
        if self.failure is None:
            try:
                found = super().readinto(room) or 0
            except BaseException as failure:
                self.failure = failure
        if self.failure is not None:
            room[found:] = bytes(len(room) - found)
            return len(room)
        return found


def _split(ds: xr.Dataset) -> xr.Dataset:
    """Replace each complex variable by its real and imaginary parts."""
    split = ds
    for name, variable in ds.data_vars.items():
        if np.issubdtype(variable.dtype, np.complexfloating):
            own = {**variable.attrs, _WHOLE: str(name)}
            parts = {f"{name}_{part}": getattr(variable, part).assign_attrs(own) for part in _PARTS}
            split = split.drop_vars(str(name)).assign(parts)
    return split


def _joined(ds: xr.Dataset) -> xr.Dataset:
    """Rejoin complex variables from their parts."""
    for name in dict.fromkeys(part.attrs.get(_WHOLE) for part in ds.data_vars.values()):
        if name is None:
            continue
        real, imag = (ds[f"{name}_{part}"] for part in _PARTS)
        if real.dims != imag.dims or {real.dtype.kind, imag.dtype.kind} != {"f"}:
            raise TypeError(name)
        # real + 1j * imag would turn the other part of an infinite number into nan
        whole = np.empty(real.shape, np.complex128)
        whole.real, whole.imag = real.values, imag.values
        own = {key: value for key, value in real.attrs.items() if key != _WHOLE}
        ds = ds.drop_vars([f"{name}_{part}" for part in _PARTS])
        ds = ds.assign({name: (real.dims, whole, own)})
    return ds


def _write_pieces(ds: xr.Dataset, sink: Any, engine: Literal["h5netcdf"]) -> None:
    """Write a dataset to an open file; long variables along `ALONG` are written in pieces."""
    along = {name: v for name, v in ds.variables.items() if v.dims[:1] == (ALONG,)}
    if all(variable.nbytes <= PIECE for variable in along.values()):
        ds.to_netcdf(sink, engine=engine)
        return
    count = ds.sizes[ALONG]
    chunks = {}
    for name, v in along.items():
        rows = min(count, max(1, CHUNK // max(1, v.nbytes // count)))
        chunks[str(name)] = {"chunksizes": (rows, *v.shape[1:])}
    first = ds.isel({ALONG: slice(0, 1)})
    first.to_netcdf(sink, engine=engine, unlimited_dims=[ALONG], encoding=chunks)
    with h5netcdf.File(sink, "r+") as file:
        file.resize_dimension(ALONG, count)
        for name, variable in along.items():
            for rows in pieces(count, variable.nbytes // count):
                file.variables[str(name)][rows] = variable[rows].values


T = TypeVar("T")
IDLE = 4
"""Ratio of allowed wall time to allowed computing time, as the machine may be busy."""


def apart(make: Callable[[], T], seconds: int, memory: int) -> T:
    """Return the result of a function, computed in a fork of this process.

    A fork is only safe on Linux; elsewhere the function is called in this process.

    Parameters
    ----------
    make : callable
        Function without arguments whose result can be pickled.
    seconds : int
        CPU time after which the fork is ended; its wall time may be `IDLE` times as long.
    memory : int
        Bytes that the fork may allocate in addition to those of this process.

    Raises
    ------
    FoldynError
        Raised by the function.
    OSError
        The function failed in another way, or the fork crashed or exceeded a limit.
    """
    if sys.platform != "linux":
        return make()
    reading, writing = os.pipe()
    # warnings about threads, which the child does not need
    with warnings.catch_warnings(action="ignore", category=DeprecationWarning):
        child = os.fork()
    if child == 0:
        os.close(reading)
        _answer(make, seconds, memory, writing)
    os.close(writing)
    value: Any
    try:
        with os.fdopen(reading, "rb") as pipe:
            made, value = pickle.load(pipe)
    except Exception:
        made, value = False, OSError("its process crashed or took too much")
    finally:
        os.waitpid(child, 0)
    if not made:
        raise value
    return value


def _answer(make: Callable[[], Any], seconds: int, memory: int, writing: int) -> None:
    """Send the function's result, and end this process whatever happens."""
    try:
        for number in (signal.SIGALRM, signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        signal.alarm(IDLE * seconds)
        _limit(seconds, memory)
        faulthandler.disable()
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        try:
            answer = True, make()
        except FoldynError as error:
            answer = False, error
        except BaseException as error:
            answer = False, OSError(f"{type(error).__name__}: {error}")
        with os.fdopen(writing, "wb") as pipe:
            pickle.dump(answer, pipe, protocol=5)
    finally:
        os._exit(0)


def _limit(seconds: int, memory: int) -> None:
    import resource  # not available on Windows

    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    wanted = pages * resource.getpagesize() + memory
    if most == resource.RLIM_INFINITY or wanted < most:
        resource.setrlimit(resource.RLIMIT_AS, (wanted, most))
