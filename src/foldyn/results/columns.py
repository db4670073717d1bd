"""Columns of numbers that grow in files, one file per column, and are read only on access.

A running checksum of each column covers the rows as they were written, not as read from the disk.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

PIECE = 2**23
"""Bytes to process at a time if data may exceed the memory."""
SUMMED = 2**18
"""Bytes read at a time for a checksum, so that they fit in the processor's cache."""
NUMBER = np.dtype("<f8")


class Column:
    """Rows of numbers at the beginning of a file.

    Parameters
    ----------
    path : Path
    row : tuple of int
        Shape of a row.
    count : int
        Number of rows.
    """

    def __init__(self, path: Path, row: tuple[int, ...], count: int) -> None:
        self._path, self._row, self._count = path, row, count
        self.shape, self.dtype = (count, *row), NUMBER

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, rows: int | slice) -> NDArray:
        """Read one row, or a copy of a slice of rows."""
        if not isinstance(rows, slice):
            number = range(self._count)[rows]
            return self._read(number, number + 1)[0]
        start, stop, step = rows.indices(self._count)
        if step == 1:
            return self._read(start, max(start, stop))
        chosen = [self._read(k, k + 1) for k in range(start, stop, step)]
        return np.concatenate(chosen) if chosen else self._read(0, 0)

    def _read(self, first: int, last: int) -> NDArray:
        size = int(np.prod(self._row, dtype=int))
        with self._path.open("rb") as file:
            file.seek(NUMBER.itemsize * size * first)
            found = np.fromfile(file, NUMBER, size * (last - first))
        return found.reshape(last - first, *self._row)


class _Lazy(BackendArray):
    """Adapter of a column to xarray's lazy arrays."""

    def __init__(self, column: Column) -> None:
        self.column, self.shape, self.dtype = column, column.shape, column.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.BASIC, self._basic
        )

    def _basic(self, key: tuple[int | slice, ...]) -> Any:
        first: Any = ... if isinstance(key[0], int) else slice(None)
        return self.column[key[0]][(first, *key[1:])]


class Columns:
    """Columns of equal length in one folder, each in a file of its own.

    Parameters
    ----------
    folder : Path
        An existing folder.
    rows : mapping of str to tuple of int
        Shape of a row of each column, by the column's name.
    count : int
        Number of rows already stored; the files may hold more.
    sums : mapping of str to int, optional
        Checksums of the stored rows, by the column's name.

    Attributes
    ----------
    names : tuple of str
    count : int
        Number of rows.
    sums : dict of str to int
        CRC-32 of the rows of each column.
    """

    def __init__(
        self, folder: Path, rows: Mapping[str, tuple[int, ...]], count: int = 0,
        sums: Mapping[str, int] | None = None,
    ) -> None:  # fmt: skip
        self._folder, self._rows = folder, dict(rows)
        self.names = tuple(rows)
        self.count = count
        self.sums = dict(sums) if sums is not None else dict.fromkeys(rows, 0)
        for name in rows:
            with self._path(name).open("ab"):
                pass

    def append(self, columns: Mapping[str, NDArray]) -> None:
        """Append the same number of rows to each column.

        Raises
        ------
        OSError
            The disk is full, or fails; the number of rows is then the same as before.
        """
        (added,) = {len(array) for array in columns.values()}
        sums = {}
        for name, array in columns.items():
            new = np.ascontiguousarray(array, NUMBER).data.cast("B") if array.size else b""
            with self._path(name).open("r+b") as file:
                file.seek(self._bytes(name) * self.count)
                file.write(new)
                file.truncate()
            sums[name] = zlib.crc32(new, self.sums[name])
        self.count, self.sums = self.count + added, sums

    def settle(self) -> None:
        """Flush all rows to the disk."""
        for name in self._rows:
            with self._path(name).open("r+b") as file:
                os.fsync(file.fileno())

    def cut(self, count: int) -> None:
        """Keep only the first `count` rows. The next `append` drops the others from the files."""
        self.count, self.sums = count, {name: self._sum(name, count) for name in self._rows}

    def damaged(self) -> Path | None:
        """Return a file that does not hold the rows that were written; None if all do."""
        for name, wanted in self.sums.items():
            with suppress(OSError):  # missing or unreadable
                if self._sum(name, self.count) == wanted:
                    continue
            return self._path(name)
        return None

    def _sum(self, name: str, count: int) -> int:
        """Checksum of the first `count` rows of a file; -1 if it has fewer."""
        left, found = self._bytes(name) * count, 0
        with self._path(name).open("rb") as file:
            while left > 0 and (piece := file.read(min(left, SUMMED))):
                found = zlib.crc32(piece, found)
                left -= len(piece)
        return -1 if left else found

    def __getitem__(self, name: str) -> Column:
        return Column(self._path(name), self._rows[name], self.count)

    def variable(self, name: str, dims: tuple[str, ...]) -> xr.Variable:
        """A column as a variable that is read on access."""
        return xr.Variable(dims, indexing.LazilyIndexedArray(_Lazy(self[name])))

    def _bytes(self, name: str) -> int:
        return NUMBER.itemsize * int(np.prod(self._rows[name], dtype=int))

    def _path(self, name: str) -> Path:
        return self._folder / f"{name}.f8"


def pieces(length: int, row_bytes: int) -> Iterator[slice]:
    """Split rows into consecutive slices, each at most `PIECE` in size."""
    step = max(1, PIECE // max(1, row_bytes))
    for first in range(0, length, step):
        yield slice(first, min(first + step, length))


def pieces_of(variable: xr.Variable) -> Iterator[NDArray]:
    """Values of a variable, in pieces along its first dimension."""
    if not variable.ndim or variable.nbytes <= PIECE:
        yield variable.values
        return
    length = variable.shape[0]
    for rows in pieces(length, variable.nbytes // length):
        yield variable[rows].values
