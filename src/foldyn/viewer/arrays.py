"""Arrays in a page: quantized to integers, differenced over time, deflated.

Values over time are stored as a sum of a few shapes times their histories (a singular value
decomposition; "proper orthogonal decomposition" in the literature of motions). A page with 20
shapes holds all samples of a motion at every node in the space of some pictures. Histories change
little from sample to sample, so first or second differences of the rounded values compress well;
the smaller of the two is stored. Bytes of equal significance are grouped. The page's `data.js`
decodes all of this.
"""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

_TYPES = {"i1": "i8", "i2": "i16", "u1": "u8", "u2": "u16", "u4": "u32", "f4": "f32"}
"""Names that the page uses for number types."""


LARGEST = 2**15 - 1


@dataclass
class Arrays:
    """Arrays of a page, by name.

    Attributes
    ----------
    about : dict
        Metadata of each array for the page: "type", "shape", "differences" and "step".
    packed : dict of bytes
        Content of each array, deflated.
    """

    about: dict[str, dict[str, Any]] = field(default_factory=dict)
    packed: dict[str, bytes] = field(default_factory=dict)

    def exact(self, name: str, values: ArrayLike, kind: str) -> str:
        """Add an array in a type such as "f4" or "u4"; return its name."""
        return self._add(name, np.asarray(values).astype(kind))

    def changing(self, name: str, values: NDArray, tolerance: float) -> dict[str, Any]:
        """Add values (t, ...) over time, to a relative tolerance; return their description.

        The description names "shapes" and "histories", whose product the values are, or "values" if
        storing them directly takes less space.
        """
        flat = np.nan_to_num(np.asarray(values, float).reshape(len(values), -1))
        about: dict[str, Any] = {"shape": list(np.shape(values))}
        step = 2.0 * max(tolerance, 0.5 / LARGEST) * (float(np.abs(flat).max(initial=0.0)) or 1.0)
        histories, shapes, sizes = factors(flat, 0.5 * step)
        if not len(sizes) or histories.size + shapes.size >= flat.size:
            whole = np.rint(flat / step).astype(np.int16)
            return about | {"values": self._add(name, whole, 2, step)}
        return about | {
            "histories": self._add(f"{name}.histories", histories, 2),
            "shapes": self._add(f"{name}.shapes", shapes),
            "sizes": sizes.tolist(),
        }

    def texts(self) -> dict[str, str]:
        """Base64 text of the arrays, by name."""
        return {name: base64.b64encode(each).decode() for name, each in self.packed.items()}

    def html(self, key: str) -> str:
        """HTML elements that hold the arrays, hidden by browsers, named key.name."""
        return "\n".join(
            f'<script type="text/plain" data-array="{key}.{name}">{text}</script>'
            for name, text in self.texts().items()
        )

    def _add(self, name: str, values: NDArray, differences: int = 0, step: float = 1.0) -> str:
        passes, content = min(
            ((k, _deflated(_differences(values, k))) for k in range(differences + 1)),
            key=lambda found: len(found[1]),
        )
        self.about[name] = {
            "type": _TYPES[values.dtype.str[1:]],
            "shape": list(values.shape),
            "differences": passes,
            "step": step,
        }
        self.packed[name] = content
        return name


def factors(values: NDArray, error: float) -> tuple[NDArray, NDArray, NDArray]:
    """Factor values (t, m) into histories (t, r), shapes (r, m) and sizes (r,).

    Both are 16-bit integers. All parts have about the same absolute accuracy, so small parts have
    small integers.

    error : largest error allowed.
    """
    left, size, right = np.linalg.svd(values, full_matrices=False)
    reach = np.abs(right).max(axis=1, initial=1e-300)
    left, right = left * (size * reach), right / reach[:, None]
    swing, step = np.abs(left).max(axis=0), error
    while True:
        step = max(step, float(swing.max()) / LARGEST)
        kept = swing > 0.5 * step
        levels = np.ceil(swing[kept] / step)
        histories = np.rint(left[:, kept] / step).astype(np.int16)
        shapes = np.rint(right[kept] * levels[:, None]).astype(np.int16)
        sizes = step / levels
        off = np.abs(values - (histories * sizes) @ shapes).max(initial=0.0)
        if off <= error or step <= 2.0 * float(swing.max()) / LARGEST:
            return histories, shapes, sizes
        step *= max(0.5, 0.9 * error / off)


def _differences(values: NDArray, passes: int) -> NDArray:
    """Differences from sample to sample, with integer wrap-around like the page's sums."""
    before = np.zeros((passes, *values.shape[1:]), values.dtype)
    return np.diff(values, passes, axis=0, prepend=before)


def _deflated(values: NDArray) -> bytes:
    """Deflate columns over time one after the other, with bytes of equal significance grouped."""
    columns = values.reshape(len(values), -1).T if values.ndim > 1 else values
    whole = np.ascontiguousarray(columns).reshape(-1)
    weights = whole.view(np.uint8).reshape(-1, whole.itemsize).T
    deflate = zlib.compressobj(6, zlib.DEFLATED, -15)
    return deflate.compress(weights.tobytes()) + deflate.flush()
