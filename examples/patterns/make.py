"""Crease patterns as files: those of the generators, the bird base, and a crane made from it.

The crane is folded on paper: every panel of the bird base is kept where it lies on the square and
where it lies when it is folded, and each fold cuts the panels along a line in the folded state and
reflects what is beyond it. Run it to write the files:
python examples/patterns/make.py examples/patterns
"""

from __future__ import annotations

import sys
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import foldyn as fd

P = fd.patterns
SIDE = 0.15  # m, of the sheets
TINY = 1e-9
FLIPPED = {"m": "v", "v": "m"}
TOWARDS, AWAY = "VM", "MV"
"""Letters of a fold towards the one who looks at the folded state, or away: of panels that face
up, and of those that face down."""


def bird_base() -> fd.Pattern:
    """The bird base, a square of 2 m."""
    t = 2.0 - np.sqrt(2.0)
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    middles = [(0, -1), (1, 0), (0, 1), (-1, 0)]
    inner = [(t * x, t * y) for x, y in middles]
    faces, letters = [], {}
    for k in range(4):
        after, middle, peak = (k + 1) % 4, 4 + k, 8 + k
        faces += [(k, middle, peak), (middle, after, peak)]
        letters |= {(k, peak): "M", (after, peak): "M", (middle, peak): "V", (peak, 12): "M"}
    letters |= {(k, 12): "V" for k in (1, 3)}
    # only one of the diagonals is folded
    faces += [(k, 8 + k, 12, 8 + (k - 1) % 4) for k in (0, 2)]
    faces += [(8 + (k - 1) % 4, k, 12) for k in (1, 3)] + [(12, k, 8 + k) for k in (1, 3)]
    return fd.Pattern([*corners, *middles, *inner, (0, 0)], faces, letters, "bird base")


@dataclass(frozen=True)
class Layer:
    """A panel on the paper and where it lies when folded.

    paper, flat : (n, 2), counter-clockwise on the paper. letters : of the n edges, each from its
    corner to the next; small ones turn over in a reverse fold. name : of the flap and its side.
    """

    paper: np.ndarray
    flat: np.ndarray
    letters: list[str]
    name: str

    @property
    def up(self) -> bool:
        """Whether its front is seen."""
        x, y = self.flat.T
        return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) > 0.0

    def cut(self, point: np.ndarray, normal: np.ndarray, letter: str) -> Layer | None:
        """What lies on the side of a line to which its normal points, with a crease on it."""
        height = (self.flat - point) @ normal
        if height.max() < TINY:
            return None
        paper, flat, letters = [], [], []
        for k, letter_k in enumerate(self.letters):
            after = (k + 1) % len(height)
            inside, goes_on = height[k] > -TINY, height[after] > -TINY
            if inside:
                paper.append(self.paper[k])
                flat.append(self.flat[k])
                leaves = abs(height[k]) < TINY and not goes_on
                letters.append(letter if leaves else letter_k)
            if inside != goes_on and min(abs(height[[k, after]])) > TINY:
                share = height[k] / (height[k] - height[after])
                paper.append((1.0 - share) * self.paper[k] + share * self.paper[after])
                flat.append((1.0 - share) * self.flat[k] + share * self.flat[after])
                letters.append(letter if inside else letter_k)
        return Layer(np.array(paper), np.array(flat), letters, self.name)


def folded(
    layers: list[Layer], names: Collection[str], line: tuple, beyond: tuple, letters: str,
    mark: str = "",
) -> list[Layer]:  # fmt: skip
    """Layers of some names, folded along a line (two points) on the side of the point `beyond`.

    In a reverse fold what is beyond gets a mark to its name.
    """
    a, b = np.array(line, float)
    normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
    normal *= np.sign((np.array(beyond) - a) @ normal)
    found = []
    for layer in layers:
        letter = letters[0 if layer.up else 1]
        stays, moves = layer.cut(a, -normal, letter), layer.cut(a, normal, letter)
        if layer.name not in names or moves is None:
            found.append(layer)
            continue
        turned = [FLIPPED.get(each, each) if mark else each for each in moves.letters]
        flat = moves.flat - 2.0 * np.outer((moves.flat - a) @ normal, normal)
        found += [] if stays is None else [stays]
        found.append(Layer(moves.paper, flat, turned, layer.name + mark))
    return found


def reversed_flap(
    layers: list[Layer], flap: tuple[str, str], pivot: np.ndarray, before: np.ndarray,
    after: np.ndarray,
) -> list[Layer]:  # fmt: skip
    """Layers with a flap (its front and its back) reverse-folded inside at a point of its ridge.

    before, after : unit vectors along the ridge from there to the tip.
    """
    line = pivot, pivot + before + after
    for name, letters in zip(flap, (AWAY, TOWARDS), strict=True):
        layers = folded(layers, [name], line, pivot + before, letters, "'")
    return layers


def crane(neck: float = 50.0, tail: float = 60.0, head: float = -25.0) -> fd.Pattern:
    """The traditional crane, its wings up, from a square of 2 m.

    neck, tail, head : angles (degrees) of the flaps above the horizontal in the folded state.
    """
    base, low = bird_base(), np.zeros(2)
    across = np.sqrt(2.0) - 1.0
    flat = [low] * 4 + [(0, 1)] * 4 + [(across, 1)] * 2 + [(-across, 1)] * 2 + [(0, np.sqrt(2.0))]
    known = {
        tuple(pair): letter
        for pair, letter in zip(base.creases.tolist(), base.assignments, strict=True)
    }
    known |= {(k, 12): "v" for k in (1, 3)}  # the ridges of neck and tail
    known |= {(4 + k, 8 + k): "F" for k in range(4)}  # unfolded as the wings go up
    layers = []
    for face in base.faces:
        edges = zip(face, (*face[1:], face[0]), strict=True)
        letters = [known.get((min(edge), max(edge)), "B") for edge in edges]
        corner = min(face)
        peaks = [v for v in face if 8 <= v < 12]
        name = f"{corner}" if len(peaks) == 2 else f"{corner}:{peaks[0]}"
        layers.append(
            Layer(base.vertices[list(face), :2], np.array([flat[v] for v in face], float),
                  letters, name)
        )  # fmt: skip
    for names, letters in ((("0", "0:8", "0:11"), TOWARDS), (("2", "2:9", "2:10"), AWAY)):
        layers = folded(layers, names, ((0, 1), (1, 1)), (0, 0), letters)  # wings up
    narrow = np.radians(11.25)
    for side, leg, front, back in ((1, 1, 8, 9), (-1, 3, 11, 10)):
        line, out = (low, (side * np.sin(narrow), np.cos(narrow))), (side, 0)
        for names, letters in (
            ((f"{leg}:{front}", f"0:{front}", "0"), TOWARDS),
            ((f"{leg}:{back}", f"2:{back}", "2"), AWAY),
        ):
            layers = folded(layers, names, line, out, letters)
    down, pivot = np.array([0.0, -1.0]), np.array([0.0, 0.9])
    up = {side: _direction(angle) * (side, 1) for side, angle in ((1, neck), (-1, tail))}
    layers = reversed_flap(layers, ("3:11", "3:10"), pivot, down, up[-1])
    layers = reversed_flap(layers, ("1:8", "1:9"), pivot, down, up[1])
    layers = reversed_flap(layers, ("1:8'", "1:9'"), pivot + 0.55 * up[1], up[1], _direction(head))
    return _unfolded(layers, "crane")


def _direction(angle: float) -> np.ndarray:
    return np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])


def _unfolded(layers: list[Layer], name: str) -> fd.Pattern:
    """The pattern of the panels on the paper, those of one plane joined."""
    points, where = np.unique(
        np.concatenate([layer.paper for layer in layers]).round(12) + 0.0, axis=0,
        return_inverse=True,
    )  # fmt: skip
    numbers, letters, faces = iter(where.ravel().tolist()), {}, []
    for layer in layers:
        face = [next(numbers) for _ in layer.paper]
        faces.append(face)
        for a, b, letter in zip(face, face[1:] + face[:1], layer.letters, strict=True):
            if letter != "B":
                letters[min(a, b), max(a, b)] = letter.upper()
    return fd.welded(fd.Pattern(points, faces, letters, name))


def _sized(pattern: fd.Pattern) -> fd.Pattern:
    """The pattern at its size in meters."""
    return pattern.scaled(SIDE / float(np.ptp(pattern.vertices, axis=0).max()))


def compute() -> tuple[dict, dict]:
    """Patterns by the names of their files; once to write, once to check."""
    made = {
        "miura": P.miura((3, 3), dihedral=180),
        "square-twist": P.square_twist(dihedral=180),
        "waterbomb": P.waterbomb((4, 5), dihedral=180),
        "resch": P.resch((3, 3), dihedral=180),
        "bird-base": bird_base(),
        "crane": crane(),
    }
    patterns = {name: _sized(pattern) for name, pattern in made.items()}
    return patterns, patterns


def check(patterns: dict) -> None:
    """The files are those that the code makes, and bird base and crane lie flat in some order."""
    for name, pattern in patterns.items():
        stored = fd.read_pattern(Path(__file__).parent / f"{name}.fold")
        assert stored.faces == pattern.faces, name
        assert stored.assignments == pattern.assignments, name
        assert np.allclose(stored.vertices, pattern.vertices, atol=1e-12), name
    base = fd.fold(patterns["bird-base"], fraction=1.0, steps=4)
    assert base.layers is not None
    assert base.kind == "rigid"


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    for title, one in compute()[0].items():
        fd.write_pattern(one, folder / f"{title}.fold")
