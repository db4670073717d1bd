"""Ends of motions stored in a folder, so that an interrupted grid can continue."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.cases.document import to_document
from foldyn.errors import InputError
from foldyn.program import program
from foldyn.results.seal import seal, sound
from foldyn.store import Store, name_of
from foldyn.values import show
from foldyn.writing import made_folder, whole


class KeptEnds:
    """Ends of motions, each batch stored in a file of its own.

    Parameters
    ----------
    folder : path or None
        Folder of the files; None stores nothing.
    case : Case
    how : mapping
        All else that the ends depend on, as JSON data.

    Raises
    ------
    InputError
        The case cannot be written down, so that stored ends might belong to another one.
    """

    def __init__(
        self, folder: str | os.PathLike[str] | None, case: Case, how: Mapping[str, Any]
    ) -> None:
        self._folder = None
        if folder is None:
            return
        if not isinstance(folder, str | os.PathLike):
            raise InputError(f" = {show(folder)}: give the path of a folder", "folder")
        document = to_document(case)
        if document.obstacles:
            raise InputError(
                f": nothing of this case can be kept: {document.obstacles[0]}; leave it out",
                "folder",
            )
        arrays = {name: _digest([array]) for name, array in document.arrays.items()}
        self._about = {
            "program": program("attractors"), "case": document.sections, "arrays": arrays, **how,
        }  # fmt: skip
        self._folder = made_folder(folder)

    def of(self, starts: Sequence[State], compute: Callable[[], NDArray]) -> NDArray[np.float64]:
        """Ends of motions from some starts, stored or computed."""
        if self._folder is None:
            return compute()
        numbers = [
            part
            for one in starts
            for part in (one.displacement, one.velocity, one.origin and one.origin.displacement)
        ]
        about = json.loads(json.dumps({**self._about, "starts": _digest(numbers)}, default=str))
        name = name_of(about)
        file = self._folder / f"{name}.npz"
        found = _KEPT.find(file, name)
        if found is None:
            found = compute()
            _KEPT.keep(file, name, found)
        return found


def _digest(arrays: Sequence[Any]) -> str:
    """Digest of arrays, some of which may be None."""
    found = hashlib.sha256()
    for array in arrays:
        values = np.zeros(0) if array is None else np.ascontiguousarray(array)
        found.update(f"{values.dtype}{values.shape}".encode() + values.tobytes())
    return found.hexdigest()


def _read(file: Path) -> tuple[str, NDArray[np.float64]]:
    if not sound(file):
        raise ValueError
    with np.load(file) as kept:
        return str(kept["stamp"]), kept["ends"]


def _write(file: Path, stamp: str, ends: NDArray[np.float64]) -> None:
    with whole(file) as part:
        np.savez(part, stamp=np.array(stamp), ends=ends)
        seal(part)


_KEPT: Store[NDArray[np.float64]] = Store(_read, _write, warns=False)
