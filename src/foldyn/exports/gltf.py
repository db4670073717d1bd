"""GLB, the binary form of glTF 2.0: one JSON document and the arrays that it refers to.

Source of the format: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html. Written by hand, as
the library for the format leaves all of this to its caller (decision 7).
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

TRIANGLES, LINES = 4, 1
"""Modes of primitives."""
_COMPONENT = {"f4": 5126, "u4": 5125}
_SHAPE = {1: "SCALAR", 3: "VEC3"}
_VERTICES, _INDICES = 34962, 34963


@dataclass
class Content:
    """Content of a file, filled step by step.

    Attributes
    ----------
    document : dict
        The JSON document.
    binary : bytearray
        The arrays, one after the other.
    """

    document: dict[str, Any] = field(default_factory=lambda: {"accessors": [], "bufferViews": []})
    binary: bytearray = field(default_factory=bytearray)

    def positions(self, points: NDArray, name: str = "") -> int:
        """Add points (n, 3) of vertices, or their displacements; return the accessor's number."""
        return self._add(points, "f4", _VERTICES, True, name)

    def indices(self, numbers: ArrayLike, name: str = "") -> int:
        """Add vertex numbers of any shape; return the accessor's number."""
        return self._add(np.ravel(numbers), "u4", _INDICES, False, name)

    def numbers(self, values: ArrayLike, name: str = "") -> int:
        """Add numbers of an animation; return the accessor's number."""
        return self._add(np.ravel(values), "f4", None, True, name)

    def _add(self, values: NDArray, kind: str, target: int | None, bounds: bool, name: str) -> int:
        own = np.ascontiguousarray(values, f"<{kind}")
        rows = own.reshape(len(own), -1)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": own.nbytes}
        self.document["bufferViews"].append(view | ({"target": target} if target else {}))
        self.binary += own.tobytes()
        about: dict[str, Any] = {
            "bufferView": len(self.document["bufferViews"]) - 1,
            "componentType": _COMPONENT[kind],
            "count": len(own),
            "type": _SHAPE[rows.shape[1]],
        }
        if bounds:
            about |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.document["accessors"].append(about | ({"name": name} if name else {}))
        return len(self.document["accessors"]) - 1

    def glb(self) -> bytes:
        """Return the content of the file."""
        buffers = [{"byteLength": len(self.binary)}]
        text = json.dumps({**self.document, "buffers": buffers}, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = b"".join(
            struct.pack("<I4s", len(chunk), kind) + chunk
            for kind, chunk in ((b"JSON", text), (b"BIN\0", bytes(self.binary)))
        )
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def linear(color: str) -> list[float]:
    """Opaque color "#rrggbb" in linear light, as materials need it (IEC 61966-2-1)."""
    parts = [int(color[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    light = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return [*light, 1.0]
