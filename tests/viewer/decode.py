"""What the page's data.js does, in Python: arrays of a stage as they were."""

from __future__ import annotations

import zlib

import numpy as np

TYPES = {"u8": "u1", "u16": "u2", "u32": "u4", "i8": "i1", "i16": "i2", "f32": "f4"}


def decoded(arrays, name):
    about = arrays.about[name]
    kind = np.dtype(TYPES[about["type"]])
    raw = np.frombuffer(zlib.decompress(arrays.packed[name], -15), np.uint8)
    columns = np.ascontiguousarray(raw.reshape(kind.itemsize, -1).T).view(kind).reshape(-1)
    rows = about["shape"][0]
    columns = columns.reshape(-1, rows)
    for _ in range(about["differences"]):
        columns = np.cumsum(columns, axis=1, dtype=kind)
    return columns.T.reshape(about["shape"])


def changing(arrays, about):
    """Values over time (t, ...)."""
    if "values" in about:
        values = decoded(arrays, about["values"]) * arrays.about[about["values"]]["step"]
    else:
        histories = decoded(arrays, about["histories"]) * np.array(about["sizes"])
        values = histories @ decoded(arrays, about["shapes"]).astype(float)
    return values.reshape(about["shape"])
