"""SVG picture of a pattern, shown for the pattern in a notebook."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns.palette import CREASES, PAPER
from foldyn.patterns.topology import around, edge_of

WIDTH, HEIGHT, MARGIN = 520.0, 300.0, 8.0  # pixels
VIEW = (28.0, -60.0)  # elevation above the xy plane and azimuth around z (degrees) of the view
MOST_PANELS = 600  # patterns with more panels have no picture in a notebook
MOST_WORDS = 200  # most characters of the caption
FRONT, BACK = bytes.fromhex(PAPER[1:]), (217, 195, 154)
# Color, width and dashes of edges, by the letter of the edge; "B" is for boundaries.
LINES = {
    "M": (CREASES["M"], "1.6", ""), "V": (CREASES["V"], "1.6", "5 3"),
    "F": (CREASES["F"], "1.2", "1.5 2"),
    "U": ("#B8578E", "1.4", "5 2 1 2"),  # darker than in figures: thin lines
    "B": ("#444", "1.1", ""),
}  # fmt: skip


def picture(pattern: Any, words: str = "") -> str | None:
    """Picture of a `Pattern` as HTML with a caption; None if it has too many panels.

    Panels are drawn from back to front; an edge is drawn together with the nearer of its panels.
    """
    if len(pattern.faces) > MOST_PANELS:
        return None
    words = words if len(words) <= MOST_WORDS else f"{words[: MOST_WORDS - 4]} ..."
    right, up, toward = directions(*VIEW)
    x = pattern.vertices @ np.stack([right, -up, toward], axis=1)
    used = sorted({corner for face in pattern.faces for corner in face})
    low, size = x[used, :2].min(axis=0), np.ptp(x[used, :2], axis=0)
    room = np.array([WIDTH, HEIGHT]) - 2 * MARGIN
    scale = float((room / np.maximum(size, 1e-9 * size.max())).min())
    places = np.round((x[:, :2] - low) * scale + MARGIN, 1)
    width, height = np.ceil(size * scale + 2 * MARGIN).astype(int).tolist()
    body = "".join(_panels(pattern, places, x[:, 2], toward))
    return (
        f'<figure style="margin: 0"><svg xmlns="http://www.w3.org/2000/svg" width="{width}" '
        f'height="{height}" viewBox="0 0 {width} {height}" role="img" '
        f'aria-label="{escape(words)}" fill="none" stroke-linejoin="round">{body}</svg>'
        f"<figcaption><code>{escape(words)}</code></figcaption></figure>"
    )


def _panels(pattern: Any, places: NDArray, depth: NDArray, toward: NDArray) -> list[str]:
    """Panels and edges from back to front."""
    letters = dict(zip(map(tuple, pattern.creases.tolist()), pattern.assignments, strict=True))
    letters |= {tuple(pair): "B" for pair in pattern.boundary.tolist()}
    order = np.argsort([depth[list(face)].mean() for face in pattern.faces], kind="stable")
    edges_of = [[edge_of(a, b) for a, b in around(face)] for face in pattern.faces]
    last = {edge: face for face in order.tolist() for edge in edges_of[face]}  # nearest face
    facing = (pattern.face_normals @ toward).tolist()
    out = []
    for face in order.tolist():
        corners = " ".join(f"{a:g} {b:g}" for a, b in places[list(pattern.faces[face])].tolist())
        base, bright = (FRONT if facing[face] >= 0.0 else BACK), 0.72 + 0.28 * abs(facing[face])
        fill = "".join(f"{round(bright * part):02x}" for part in base)
        out.append(f'<path d="M{corners}z" fill="#{fill}"/>')
        for edge in edges_of[face]:
            if last[edge] == face and edge in letters:
                color, width, dashes = LINES[letters[edge]]
                (a, b), (c, d) = places[list(edge)].tolist()
                dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
                out.append(
                    f'<path d="M{a:g} {b:g} {c:g} {d:g}" stroke="{color}" '
                    f'stroke-width="{width}"{dashed}/>'
                )
    return out


def directions(elevation: float, azimuth: float) -> NDArray:
    """Unit vectors (3, 3) to the right, up and towards the viewer, from angles in degrees."""
    e, a = np.radians([elevation, azimuth])
    toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.array([right, np.cross(toward, right), toward])
