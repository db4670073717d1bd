"""What a dataset from a file must hold, before anything is computed from it."""

from __future__ import annotations

import numpy as np
import xarray as xr

from foldyn.errors import InputError

NUMBERS, WHOLES, TEXTS = "iuf", "iu", "UOST"
"""Kinds of data types."""
_KINDS = {NUMBERS: "numbers", WHOLES: "whole numbers", TEXTS: "texts"}


def check_variable(
    ds: xr.Dataset, name: str, dims: tuple[str, ...], kind: str = NUMBERS, place: str = ""
) -> xr.DataArray:
    """Return a variable that a dataset must have, over these dimensions and of this kind.

    Raises
    ------
    InputError
        It is another, or there is none.
    """
    found = ds.variables.get(name)
    if found is not None and found.dims == dims and found.dtype.kind in kind:
        return ds[name]
    over = f" over {', '.join(dims)}" if dims else ""
    has = (
        "lacks it" if found is None else f"has {found.dtype} over {', '.join(map(str, found.dims))}"
    )
    raise InputError(
        f"{place}the result's variable {name} must be {_KINDS[kind]}{over}; it {has}: it is "
        "damaged, or was changed"
    )


def whole_attribute(ds: xr.Dataset, name: str) -> int:
    """Attribute that is a whole number; 0 where there is none."""
    value = ds.attrs.get(name, 0)
    if not isinstance(value, int | np.integer):
        raise InputError(f"its attribute {name} must be a whole number: the result is damaged")
    return int(value)
