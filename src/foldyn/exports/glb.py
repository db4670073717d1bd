"""GLB: a moving sheet, for Blender and browsers.

The file holds node positions at rest and, as morph targets, displacements at each key or in each
mode. Weights that change linearly in time interpolate between keys. There are no normals, so a
viewer shades every triangle flat. Lengths are meters; our z axis, which points up, becomes the
format's y axis.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from foldyn import __version__
from foldyn.cases import Case
from foldyn.formats.writers import warn_of_boards
from foldyn.patterns.palette import BLACK, CREASE_NAMES, CREASES, PAPER
from foldyn.results import Shapes, shapes_of
from foldyn.values import number
from foldyn.viewer.sheet import KINDS, edge_pieces
from foldyn.writing import write_bytes

TRIANGLES, LINES = 4, 1
"""Mode numbers of primitives in glTF."""
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

    def indices(self, numbers: ArrayLike) -> int:
        """Add vertex numbers of any shape; return the accessor's number."""
        return self.add(np.ravel(numbers), "", "u4", _INDICES)

    def add(
        self, values: NDArray, name: str = "", kind: str = "f4", target: int | None = _VERTICES
    ) -> int:
        """Add an array, by default of points (n, 3); return the accessor's number."""
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
        if kind == "f4":
            about |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.document["accessors"].append(about | ({"name": name} if name else {}))
        return len(self.document["accessors"]) - 1

    def glb(self) -> bytes:
        """Return the content of the file."""
        buffers = [{"byteLength": len(self.binary)}]
        text = json.dumps({**self.document, "buffers": buffers}, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        parts = (b"JSON", text), (b"BIN\0", bytes(self.binary))
        chunks = b"".join(struct.pack("<I4s", len(part), kind) + part for kind, part in parts)
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def linear(color: str) -> list[float]:
    """Opaque color "#rrggbb" in linear light, as materials need it (IEC 61966-2-1)."""
    parts = [int(color[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    light = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return [*light, 1.0]


MOST_KEYS = 120
"""Default largest number of keys of a motion or a path."""
PATH_SECONDS, SWING_SECONDS = 8.0, 2.0
"""Default length (s) of a path, and of one period of a mode."""
SHORTEST, LONGEST = 1e-3, 1e6
"""Bounds of the length of an animation, s."""
SWING_KEYS = 32
UPRIGHT = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]
"""Quaternion of the rotation that turns the upward axis z into y."""


class Animation(NamedTuple):
    """Weights (keys, targets) of the morph targets, from 0 to 1, at times (s)."""

    name: str
    times: NDArray[np.float64]
    weights: NDArray[np.float64]


def write(
    result: xr.Dataset,
    path: Path,
    case: Case,
    *,
    every: int | None = None,
    frames: int | None = None,
    scale: float = 1.0,
    seconds: float | None = None,
) -> list[Path]:
    """Write the sheet of a result with one animation, or one per mode.

    Parameters
    ----------
    result : xarray.Dataset
        A motion, an equilibrium path, modes or a folding.
    path : Path
    case : Case
        Case of the result.
    every, frames : int, optional
        Make a key of every n-th sample and the last one, or this many keys, evenly spread over the
        samples; by default all samples, at most `MOST_KEYS` keys.
    scale : float
        Factor on all displacements.
    seconds : float, optional
        Length of the animation: by default the duration of the motion, `PATH_SECONDS` for a path,
        and `SWING_SECONDS` for one period of a mode.
    """
    warn_of_boards(case.structure.pattern)
    kind = result.attrs["foldyn_result"]
    if every is None and frames is None and kind != "modes":
        frames = MOST_KEYS
    shapes = shapes_of(result, every, frames=frames, scale=scale)
    if seconds is not None:
        seconds = number("seconds", seconds, least=SHORTEST, most=LONGEST, unit="s")
    if kind == "modes":
        shapes = _there_and_back(shapes)
        animations = _swings(shapes.titles, seconds or SWING_SECONDS)
    else:
        timed = kind == "trajectory"
        times = shapes.values - shapes.values[0] if timed else np.arange(float(len(shapes.values)))
        if times[-1] > 0.0:
            times *= (seconds or (times[-1] if timed else PATH_SECONDS)) / times[-1]
        animations = [Animation("motion" if timed else "path", times, np.eye(len(times)))]
    write_bytes(_content(case, shapes, animations).glb(), path)
    return [path]


def _there_and_back(shapes: Shapes) -> Shapes:
    """Each mode and its opposite, because Blender allows no negative weights."""
    back = [f"{title}, back" for title in shapes.titles]
    both = np.concatenate([shapes.displacement, -shapes.displacement])
    return shapes._replace(titles=shapes.titles + back, displacement=both)


def _swings(titles: list[str], seconds: float) -> list[Animation]:
    """One period of each mode, from shapes as `_there_and_back` orders them."""
    count = len(titles) // 2
    phase = np.linspace(0.0, 2.0 * np.pi, SWING_KEYS + 1)
    there = np.sin(phase)[:, None]
    weights = np.concatenate([np.maximum(there, 0.0), np.maximum(-there, 0.0)], axis=1)
    times = seconds * phase / phase[-1]
    return [
        Animation(titles[k], times, np.repeat(weights, count, axis=1) * np.tile(own, 2))
        for k, own in enumerate(np.eye(count))
    ]


def _content(case: Case, shapes: Shapes, animations: list[Animation]) -> Content:
    """The scene: one mesh of panels and lines."""
    content, name = Content(), case.structure.pattern.name or "sheet"
    primitives, materials = _primitives(content, case)
    nodes = {"POSITION": content.add(shapes.nodes, "nodes")}
    moved = zip(shapes.displacement, shapes.titles, strict=True)
    targets = [{"POSITION": content.add(each, title)} for each, title in moved]
    shared = {"attributes": nodes, "targets": targets}
    content.document |= {
        "asset": {"version": "2.0", "generator": f"Foldyn {__version__}"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": name, "rotation": UPRIGHT}],
        "meshes": [
            {
                "name": name,
                "primitives": [shared | each for each in primitives],
                "weights": [0.0] * len(shapes.titles),
                "extras": {"targetNames": shapes.titles},
            }
        ],
        "materials": materials,
        "animations": [_animation(content, each) for each in animations],
    }
    return content


def _primitives(content: Content, case: Case) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Panels, and the lines of each kind, with their materials."""
    structure = case.structure
    paper = {"baseColorFactor": linear(PAPER), "metallicFactor": 0.0, "roughnessFactor": 0.9}
    panels = {"name": "panels", "doubleSided": True, "pbrMetallicRoughness": paper}
    materials: list[dict[str, Any]] = [panels]
    faces = content.indices(structure.triangles)
    primitives = [{"mode": TRIANGLES, "material": 0, "indices": faces}]
    pairs, kind, *_ = edge_pieces(structure.pattern, structure.nodes, structure.edge_nodes)
    for row, letter in enumerate(KINDS):
        if not (kind == row).any():
            continue
        color = {"baseColorFactor": linear(CREASES.get(letter, BLACK)), "metallicFactor": 0.0}
        lines = content.indices(pairs[kind == row])
        primitives.append({"mode": LINES, "material": len(materials), "indices": lines})
        line = {"name": CREASE_NAMES.get(letter, "boundary"), "pbrMetallicRoughness": color}
        materials.append(line | {"extensions": {"KHR_materials_unlit": {}}})
    return primitives, materials


def _animation(content: Content, animation: Animation) -> dict[str, Any]:
    values = animation.times, animation.weights.ravel()
    times, weights = (content.add(each, target=None) for each in values)
    return {
        "name": animation.name,
        "samplers": [{"input": times, "output": weights, "interpolation": "LINEAR"}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
    }
