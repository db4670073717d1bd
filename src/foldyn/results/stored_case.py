"""The case of a result, in its variable `case`: a TOML text that ends with a table of arrays.

A line ``faces = "<i8 36 AAAAAAAAAAAEAAAA..."`` has the data type, the shape, and the bytes in
base64, exact to the bit. This table is parsed here, because tomllib would take 90 ms per MB. Rest
positions are a variable of their own, as scripts use them in plots.
"""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import tomli_w
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases.document import Document
from foldyn.errors import InputError
from foldyn.input_files import from_toml
from foldyn.results.quantities import PLACE
from foldyn.values import show

CASE_VARIABLES = ("case", "rest_position")
"""Variables of the case, which every result has."""
_ARRAYS = "\n[arrays]\n"


def case_variables(document: Document) -> dict[str, Any]:
    """Variables of a case, from the document that describes it."""
    arrays = dict(document.arrays)
    rest = arrays.pop("rest_position")
    lines = (f'{name} = "{_written(array)}"\n' for name, array in arrays.items())
    text = "".join([tomli_w.dumps(document.sections), _ARRAYS, *lines])
    told = {"long_name": "the case (TOML)"}
    return {"case": ((), text, told), "rest_position": (PLACE, rest, {"units": "m"})}


def sections_of(ds: xr.Dataset) -> str:
    """Text of the stored case, without the arrays."""
    return str(ds["case"].values[()]).partition(_ARRAYS)[0]


def document_of(ds: xr.Dataset) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Sections of the stored case, and the arrays that the sections refer to.

    Raises
    ------
    InputError
        The text is damaged.
    """
    text, _, table = str(ds["case"].values[()]).partition(_ARRAYS)
    try:
        sections = from_toml(text)
    except InputError as error:
        raise InputError(f"the stored case is damaged: it {error}") from None
    lines = (line.partition(" = ")[::2] for line in table.splitlines())
    arrays = {name: _read(name, value) for name, value in lines}
    if "rest_position" in ds.variables:
        arrays["rest_position"] = ds["rest_position"].values
    return sections, arrays


def _written(array: NDArray) -> str:
    shape = ",".join(map(str, array.shape))
    return f"{array.dtype.str} {shape} {base64.b64encode(array.tobytes()).decode()}"


def _read(name: str, text: str) -> NDArray:
    try:
        kind, shape, data = text.strip('"').split(" ")
        values = np.frombuffer(base64.b64decode(data, validate=True), np.dtype(kind))
        return values.reshape([int(size) for size in shape.split(",") if size]).copy()
    except Exception as error:  # damage may lead to any error
        raise InputError(
            f"the stored case is damaged: its array {show(name)} cannot be read"
        ) from error
