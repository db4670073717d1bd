"""The order of layers: what folds flat gets one that nothing crosses, what does not is refused."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.statics.folding.layer_constraints import layer_constraints
from foldyn.statics.folding.layer_order import flat_state, layer_order
from foldyn.statics.folding.starts import composed

CLOSED = math.pi - 1e-3


def strip(widths, letters):
    """A strip of panels of these widths, each crease with its letter."""
    x = np.concatenate([[0.0], np.cumsum(widths)])
    points = [(a, b) for a in x for b in (0.0, 1.0)]
    faces = [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(len(widths))]
    return fd.Pattern(points, faces, list(letters))


def flat(pattern):
    """The pattern folded flat, and its fold angles."""
    angles = np.array([{"M": -math.pi, "V": math.pi, "F": 0.0}[a] for a in pattern.assignments])
    vertices, gap = composed(pattern, angles)
    assert gap < 1e-9
    return pattern.changed(vertices=vertices), angles


def found(pattern):
    """Whether a pattern has an order of its layers when it is folded flat."""
    folded, angles = flat(pattern)
    try:
        layer_order(folded, flat_state(folded, angles, CLOSED))
    except InputError:
        return False
    return True


def stacks(widths, letters):
    """Whether some order of a strip's panels, from below, lets it lie flat (by trying all)."""
    ends = np.concatenate([[0.0], np.cumsum([w * (-1) ** k for k, w in enumerate(widths)])])
    spans = [tuple(sorted(ends[k : k + 2])) for k in range(len(widths))]
    count = len(widths)
    for order in itertools.permutations(range(count)):
        height = np.argsort(order)

        def is_free(k, height=height):
            """Nothing between two panels at the crease k that covers it or is folded there too."""
            low, high = sorted(height[[k, k + 1]])
            up = (height[k + 1] > height[k]) == (k % 2 == 0)  # panel k faces up where k is even
            if up != (letters[k] == "V"):
                return False
            at = ends[k + 1]
            for other in range(count):
                inside = spans[other][0] < at - 1e-9 and spans[other][1] > at + 1e-9
                if inside and low < height[other] < high:
                    return False
            for other in range(count - 1):  # folds at the same place, on the same side
                if other == k or abs(ends[other + 1] - at) > 1e-9 or (other - k) % 2:
                    continue
                between = [low < height[p] < high for p in (other, other + 1)]
                if between[0] != between[1]:
                    return False
            return True

        if all(is_free(k) for k in range(count - 1)):
            return True
    return False


WIDTHS = [(1, 1, 1, 1), (2, 1, 2), (1, 0.6, 1, 0.6), (1, 0.5, 0.5, 1), (1, 0.4, 0.7, 0.5, 1)]


@pytest.mark.parametrize("widths", WIDTHS)
def test_strips_have_an_order_where_trying_all_finds_one(widths):
    cases = ["".join(letters) for letters in itertools.product("MV", repeat=len(widths) - 1)]
    expected = {letters: stacks(widths, letters) for letters in cases}
    assert {letters: found(strip(widths, letters)) for letters in cases} == expected
    assert set(expected.values()) == ({True, False} if len(set(widths)) > 1 else {True})


def check_points(pattern, angles, rows):
    """Look at a flat state from above in many places: layers, and the folds between them."""
    state = flat_state(pattern, angles, CLOSED)
    above = {}
    for f, g, s in rows.tolist():
        up = s if state.up[g] else -s
        above[f, g], above[g, f] = up, -up
    corners = [state.points[list(face)] for face in pattern.faces]
    for points, orientation in zip(corners, state.up, strict=True):
        if not orientation:
            points[:] = points[::-1].copy()

    def depth(face, x):
        """Distance of x inside a convex panel, negative outside."""
        a = corners[face]
        b = np.roll(a, -1, axis=0)
        along = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
        return (along[:, 0] * (x - a)[:, 1] - along[:, 1] * (x - a)[:, 0]).min()

    small, random = 1e-3 * pattern.size, np.random.default_rng(3)
    seen = 0
    for k, (a, b) in enumerate(pattern.creases.tolist()):
        share = random.uniform(0.05, 0.95)
        at = (1 - share) * state.points[a] + share * state.points[b]
        one, other = pattern.crease_faces[k].tolist()
        for face in range(len(pattern.faces)):
            if face in (one, other) or depth(face, at) < small:
                continue
            seen += 1  # a panel that the crease runs through is not between those of the crease
            assert above[face, one] == above[face, other], (k, face)
    for _ in range(200):
        x = random.uniform(state.points.min(axis=0), state.points.max(axis=0))
        here = [face for face in range(len(pattern.faces)) if depth(face, x) > small]
        heights = sorted(sum(above[f, g] > 0 for g in here if g != f) for f in here)
        assert heights == list(range(len(here)))  # no cycles
    for k, (one, other) in enumerate(pattern.crease_faces.tolist()):
        if abs(angles[k]) > CLOSED:  # fronts face each other across a valley
            assert (above[other, one] > 0) == (bool(state.up[one]) == (angles[k] > 0))
    return seen


FILES = Path(__file__).resolve().parents[2] / "examples" / "patterns"
FLAT = {
    "bird base": fd.read_pattern(FILES / "bird-base.fold"),
    "crane": fd.read_pattern(FILES / "crane.fold"),
    "Miura-ori": fd.patterns.miura((2, 2), dihedral=180),
    "waterbomb": fd.patterns.waterbomb((2, 2), dihedral=180),
    "square twist": fd.patterns.square_twist(dihedral=180),
}


@pytest.mark.parametrize("name", FLAT)
def test_an_order_that_is_found_has_no_crossings(name):
    folded, angles = flat(FLAT[name])
    rows = layer_order(folded, flat_state(folded, angles, CLOSED))
    assert check_points(folded, angles, rows) > 10
    turned = rows.copy()
    turned[:, 2] *= -1  # upside down, which no letter allows
    with pytest.raises(AssertionError):
        check_points(folded, angles, turned)


def test_what_has_no_order_is_refused_with_the_panels():
    # two flaps, each wider than the panel between them, fold to the same side
    with pytest.raises(
        InputError, match=r"lies flat when folded, but no order .*found at panels 0, 1"
    ):
        fd.fold(strip([2, 1, 2], "VV"), fraction=1.0, steps=4)
    assert fd.fold(strip([2, 1, 2], "VM"), fraction=1.0, steps=4).layers is not None


def test_a_folded_state_that_lies_flat_says_its_order():
    folding = fd.fold(strip([1, 1, 1], "VM"), fraction=1.0, steps=4)
    assert (
        "2 creases are closed: panels lie upon each other in an order without" in folding.report()
    )
    # panel 1 lies upon the front of 0, and panel 2 at the back of 1
    assert folding.layers[[0, 2]].tolist() == [[0, 1, 1], [1, 2, -1]]
    assert fd.fold(strip([1, 1, 1], "VM"), fraction=0.9, steps=4).layers is None


@pytest.mark.filterwarnings("ignore::foldyn.errors.CrossingWarning")
def test_an_order_that_is_given_is_kept():
    # four stamps folded as VMV have two orders; the outer ones either way; on the way they cross
    pattern = strip([1, 1, 1, 1], "VVV")
    free = fd.fold(pattern, fraction=1.0, steps=4).layers
    row = next(k for k, (f, g, _) in enumerate(free.tolist()) if (f, g) == (0, 3))
    for side in (1, -1):
        given = pattern.changed(custom={"faceOrders": [[0, 3, side]]})
        assert fd.fold(given, fraction=1.0, steps=4).layers[row].tolist() == [0, 3, side]
    wrong = pattern.changed(custom={"faceOrders": [[0, 1, -1]]})
    with pytest.raises(InputError, match="no order of its layers"):
        fd.fold(wrong, fraction=1.0, steps=4)


def test_three_panels_are_not_ordered_in_a_cycle():
    folded, angles = flat(strip([1, 1, 1], "VV"))
    constraints = layer_constraints(folded, flat_state(folded, angles, CLOSED))
    assert constraints.pairs.tolist() == [[0, 1], [0, 2], [1, 2]]
    assert constraints.triples.tolist() == [[0, 2, 1]]
