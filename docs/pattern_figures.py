"""All patterns of Foldyn, flat and folded.

Run it to draw the pictures of docs/patterns.md:  python docs/pattern_figures.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd

P = fd.patterns
BY_DIHEDRAL = {
    "simple_fold": ({}, (180, 120, 60)),
    "miura": ({"cells": (3, 3)}, (180, 110, 50)),
    "arc_miura": ({"cells": (3, 6), "second_angle": 72}, (180, 120, 70)),
    "eggbox": ({"cells": (3, 3)}, (140, 90, 50)),
    "waterbomb": ({"cells": (5, 4)}, (180, 140, 100)),
    "yoshimura": ({"cells": (8, 4)}, (180, 169, 157.5)),
    "curved_pleat": ({"pleats": 6}, (180, 130, 90)),
    "miura_tube": ({"cells": 3}, (30, 90, 140)),
    "zipper_tubes": ({"cells": 3}, (50, 90, 130)),
    "resch": ({"cells": (4, 3)}, (180, 90, 0)),
    "square_twist": ({}, (180, 100, 30)),
}
"""Arguments of each generator, and dihedrals (degrees) at which it is drawn."""
OTHERS = {
    "kresling": {
        "twist=20": P.kresling(twist=20, storeys=4),
        "twist=20, alternating=True": P.kresling(twist=20, storeys=4, alternating=True),
        "sides=8, twist=-180/8": P.kresling(8, height=0.6, twist=-22.5, storeys=4),
    },
    "flasher": {"flat": P.flasher(), "folded=True": P.flasher(folded=True)},
}
"""States that are not told by a dihedral, by caption."""
VIEWS = {
    "flasher": [None, (38.0, -50.0)],
    "resch": [None, (30.0, -70.0), (-40.0, -75.0)],
    "square_twist": [None, (50.0, -65.0), (50.0, -65.0)],
    "yoshimura": [None, (28.0, -58.0), (28.0, -58.0)],
}
"""Elevation and azimuth (degrees) of states, if not the usual ones."""


def compute() -> tuple[dict, dict]:
    """The states of each generator by caption; once for pictures, once to check."""
    states = {
        name: {f"dihedral={d}": P.GENERATORS[name](**options, dihedral=d) for d in dihedrals}
        for name, (options, dihedrals) in BY_DIHEDRAL.items()
    }
    states |= OTHERS
    return states, states


def with_junctions() -> dict[str, fd.Pattern]:
    """Patterns in which three and more panels meet, by caption."""
    layer = P.miura(cells=(2, 2), dihedral=110)
    top = layer.vertices[:, 2].max()
    corners = [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)]
    walls = [(0, 1), (1, 2), (3, 4), (4, 5), (0, 3), (1, 4), (2, 5)]
    periods = np.array([[1.5, np.sqrt(0.75), 0.0], [1.5, -np.sqrt(0.75), 0.0]])
    foot = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
    foot = np.concatenate([foot, periods])
    cell = fd.Pattern(
        np.concatenate([foot, np.add(foot, (0.0, 0.0, 0.8))]),
        [(0, 1, 5, 4), (1, 2, 6, 5), (1, 3, 7, 5)],
    )
    return {
        "box": fd.Pattern(
            [(x, y, z) for z in (0, 2) for x, y in corners],
            [(a, b, b + 6, a + 6) for a, b in walls],
        ),
        "honeycomb": cell.repeated((3, 3), periods),
        "stack": layer.joined(layer.mirrored("z", about=(0, 0, top)), inner=True),
    }


def spans(pattern: fd.Pattern) -> np.ndarray:
    """Distances (m) of all corners of each panel."""
    corners = [pattern.vertices[list(face)] for face in pattern.faces]
    return np.concatenate([np.linalg.norm(x[:, None] - x, axis=-1).ravel() for x in corners])


def check(results: dict) -> None:
    """States of a generator have the same panels in space, and each generator is there."""
    assert set(results) == set(P.GENERATORS)
    for name in results.keys() - {"kresling", "eggbox"}:
        first, *others = [spans(pattern) for pattern in results[name].values()]
        for other in others:
            np.testing.assert_allclose(other, first, atol=1e-12)


def draw(results: dict, folder: Path) -> None:
    """One picture for each generator."""
    for name, states in results.items():
        patterns = list(states.values())
        figure = fd.plots.draw_patterns(patterns, list(states), views=VIEWS.get(name, ()))
        figure.savefig(folder / f"pattern-{name.replace('_', '-')}.png", dpi=90)
    joined = with_junctions()
    views = [None, (50.0, -60.0), None]
    figure = fd.plots.draw_patterns(list(joined.values()), list(joined), views=views)
    figure.savefig(folder / "pattern-junctions.png", dpi=90)


if __name__ == "__main__":
    drawn, results_to_check = compute()
    check(results_to_check)
    draw(drawn, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
