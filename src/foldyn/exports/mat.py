"""MAT, version 5, for MATLAB and Octave: ``run = load("run.mat")`` reads it as a struct.

Arrays keep their dimensions, complex numbers stay complex. All numbers are doubles; numbers of
nodes, vertices and supports start at 1. `faces` has a row for each panel, padded with NaN for
``patch("Vertices", run.vertices, "Faces", run.faces)``. Units and meanings are in the structs
`units` and `labels`, facts about the run in `attributes`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.exports.chosen import ALONG, chosen_fields, quantities_of
from foldyn.results.contents import pattern_of
from foldyn.results.frames import chosen_samples
from foldyn.results.stored_case import sections_of
from foldyn.writing import whole

MOST = 2**31 - 1
"""Largest size of a variable in version 5, in bytes."""
LONGEST = 63
"""Largest number of letters of a name in MATLAB."""
KEYWORDS = frozenset({
    "break", "case", "catch", "classdef", "continue", "else", "elseif", "end", "for", "function",
    "global", "if", "otherwise", "parfor", "persistent", "return", "spmd", "switch", "try", "while",
})  # fmt: skip
COUNTED = ("node", "support_node")
"""Variables that hold node numbers."""


def write(
    result: xr.Dataset,
    path: Path,
    case: None,
    *,
    fields: str | Sequence[str] | None = None,
    every: int | None = None,
    frames: int | None = None,
) -> list[Path]:
    """Write a result with its pattern.

    Parameters
    ----------
    result : xarray.Dataset
    path : Path
    case : None
        Not needed.
    fields : str or sequence of str, optional
        Names of the variables of the result; by default all. Coordinates and the pattern are always
        included.
    every : int, optional
        Take every n-th sample, and the last one.
    frames : int, optional
        Take this many samples, evenly spread.

    Raises
    ------
    InputError
        A variable exceeds the format's 2 GB.
    """
    from scipy.io import savemat

    along = ALONG[result.attrs["foldyn_result"]]
    samples = chosen_samples(result.sizes[along], every, frames)
    taken = result if every is None and frames is None else result.isel({along: samples})
    pattern = pattern_of(result)
    names = [*map(str, result.coords), *chosen_fields(quantities_of(result), fields)]
    content = {name: _values(taken[name]) for name in names}
    for name, values in content.items():
        _check_size(name, values)
    attributes = {
        key: str(value) if isinstance(value, str) else np.asarray(value, float)
        for key, value in result.attrs.items()
    }
    content |= {
        "vertices": pattern.vertices,
        "faces": _faces(pattern.faces),
        "creases": pattern.creases + 1.0,
        "assignments": "".join(pattern.assignments),
        "case_file": sections_of(result),
        "units": _texts(result, names, "units"),
        "labels": _texts(result, names, "long_name"),
        "attributes": _named(attributes),
    }
    with whole(path) as part:
        savemat(part, _named(content), appendmat=False, long_field_names=True, oned_as="column")
    return [path]


def _values(variable: xr.DataArray) -> NDArray:
    """Convert values to MATLAB types."""
    values = variable.values
    if values.dtype.kind in "UOST":
        return values.astype(object)
    if values.dtype.kind == "c":
        return values
    return values.astype(float) + (variable.name in COUNTED)


def _check_size(name: str, values: NDArray) -> None:
    if values.nbytes > MOST:
        raise InputError(
            f": {name} has {values.nbytes / 2**30:.2g} GiB, and a MAT file of version 5 holds "
            "variables below 2; take fewer samples, as with every = 10, or other fields",
            "result",
        )


def _faces(faces: Sequence[Sequence[int]]) -> NDArray[np.float64]:
    """Vertices of each panel, counted from 1 and padded with nan."""
    return np.transpose([*zip_longest(*faces, fillvalue=np.nan)]) + 1.0


def _texts(result: xr.Dataset, names: Iterable[str], key: str) -> dict[str, str]:
    return _named({name: str(result[name].attrs.get(key, "")) for name in names})


def _named(content: dict[str, Any]) -> dict[str, Any]:
    """Rename variables to unique names that MATLAB allows."""
    out: dict[str, Any] = {}
    for name, value in content.items():
        out[_name(name, out)] = value
    return out


def _name(text: str, taken: Iterable[str]) -> str:
    """A MATLAB name: letters, digits and underscores, starting with a letter, not a keyword."""
    clean = re.sub(r"\W", "_", text, flags=re.ASCII)
    clean = clean if clean[:1].isalpha() and clean not in KEYWORDS else f"x_{clean}"
    choices = (clean[:LONGEST], *(f"{clean[: LONGEST - 6]}_{k}" for k in range(2, 9)))
    return next(name for name in choices if name not in taken)
