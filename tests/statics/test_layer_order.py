"""The order of layers: what folds flat gets one that nothing crosses, what does not is refused."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import ComputationError, InputError
from foldyn.patterns.frames import composed
from foldyn.statics.folding.layer_order import flat_state, layer_constraints, layer_order

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
    spans, count = np.sort(np.stack([ends[:-1], ends[1:]], axis=1), axis=1), len(widths)

    def is_free(height, k):
        """Nothing between two panels at the crease k that covers it or is folded there too."""
        low, high = sorted(height[[k, k + 1]])
        up = (height[k + 1] > height[k]) == (k % 2 == 0)  # panel k faces up where k is even
        at, between = ends[k + 1], (low < height) & (height < high)
        covers = (spans[:, 0] < at - 1e-9) & (spans[:, 1] > at + 1e-9)
        # folds at the same place, on the same side, have both panels between or none
        beside = [p for p in range(k % 2, count - 1, 2) if p != k and abs(ends[p + 1] - at) < 1e-9]
        pairs = all(between[p] == between[p + 1] for p in beside)
        return up == (letters[k] == "V") and not (covers & between).any() and pairs

    heights = (np.argsort(order) for order in itertools.permutations(range(count)))
    return any(all(is_free(height, k) for k in range(count - 1)) for height in heights)


WIDTHS = [(1, 1, 1, 1), (2, 1, 2), (1, 0.6, 1, 0.6), (1, 0.5, 0.5, 1), (1, 0.4, 0.7, 0.5, 1)]


@pytest.mark.parametrize("widths", WIDTHS)
def test_strips_have_an_order_where_trying_all_finds_one(widths):
    cases = ["".join(letters) for letters in itertools.product("MV", repeat=len(widths) - 1)]
    expected = {letters: stacks(widths, letters) for letters in cases}
    assert {letters: found(strip(widths, letters)) for letters in cases} == expected
    assert set(expected.values()) == ({True, False} if len(set(widths)) > 1 else {True})


def check_points(pattern, angles, rows):
    """Look at a flat state from above in many places: layers, and the folds between them."""
    state, above = flat_state(pattern, angles, CLOSED), {}
    for f, g, s in rows.tolist():
        up = s if state.up[g] else -s
        above[f, g], above[g, f] = up, -up
    corners = [
        state.points[list(face)][:: 1 if up else -1]
        for face, up in zip(pattern.faces, state.up, strict=True)
    ]

    def depth(face, x):
        """Distance of x inside a convex panel, negative outside."""
        a = corners[face]
        along = np.roll(a, -1, axis=0) - a
        along /= np.linalg.norm(along, axis=1)[:, None]
        return (along[:, 0] * (x - a)[:, 1] - along[:, 1] * (x - a)[:, 0]).min()

    small, random, panels = 1e-3 * pattern.size, np.random.default_rng(3), range(len(corners))
    seen = 0
    creases = zip(pattern.creases.tolist(), pattern.crease_faces.tolist(), angles, strict=True)
    for (a, b), (one, other), angle in creases:
        share = random.uniform(0.05, 0.95)
        at = (1 - share) * state.points[a] + share * state.points[b]
        for face in panels:
            if face not in (one, other) and depth(face, at) >= small:
                seen += 1  # what the crease runs through is not between the panels of the crease
                assert above[face, one] == above[face, other], ((a, b), face)
        if abs(angle) > CLOSED:  # fronts face each other across a valley
            assert (above[other, one] > 0) == (bool(state.up[one]) == (angle > 0))
    for _ in range(200):
        x = random.uniform(state.points.min(axis=0), state.points.max(axis=0))
        here = [face for face in panels if depth(face, x) > small]
        heights = sorted(sum(above[f, g] > 0 for g in here if g != f) for f in here)
        assert heights == list(range(len(here)))  # no cycles
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
    message = r"lies flat when folded, but no order .*found at panels 0, 1"
    with pytest.raises(InputError, match=message):
        fd.fold(strip([2, 1, 2], "VV"), fraction=1.0, steps=4)
    assert fd.fold(strip([2, 1, 2], "VM"), fraction=1.0, steps=4).layers is not None


def test_a_folded_state_that_lies_flat_says_its_order():
    folding = fd.fold(strip([1, 1, 1], "VM"), fraction=1.0, steps=4)
    told = "2 creases are closed: panels lie on each other in an order without"
    assert told in folding.report()
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


def side_by_side(one, other):
    """Two separate patterns as one, and how many panels the first has."""
    shift = len(one.vertices)
    faces = [*one.faces, *(tuple(v + shift for v in face) for face in other.faces)]
    letters = [*one.assignments, *other.assignments]
    return fd.Pattern(np.vstack([one.vertices, other.vertices]), faces, letters), len(one.faces)


@pytest.mark.parametrize("turn", [0.0, 50.0, 90.0])
def test_separate_sheets_have_layers_of_their_own(turn):
    # each lies flat, in planes that the angle `turn` parts: their layers are those of each alone
    alone = [flat(strip([1.0, 0.9, 0.8], "MV")), flat(strip([0.7, 0.6, 0.5, 0.6], "VVM"))]
    (one, first), (other, second) = alone
    other = other.rotated(turn, (1, 0.3, 0.2)).moved((5, 1, 0.4))
    both, panels = side_by_side(one, other)
    angles = np.concatenate([first, second])
    rows = layer_order(both, flat_state(both, angles, CLOSED)).tolist()
    for sheet, own, shift in ((one, first, 0), (other, second, panels)):
        told = layer_order(sheet, flat_state(sheet, own, CLOSED))
        assert len(told)
        assert [[f + shift, g + shift, s] for f, g, s in told.tolist()] == [
            row for row in rows if (row[0] >= panels) == (shift > 0)
        ]


def test_separate_sheets_fold_to_the_layers_of_each():
    both, _ = side_by_side(strip([0.6, 0.5], "V"), strip([0.4, 0.5, 0.3], "MM").moved((3, 0, 0)))
    folding = fd.fold(both, 180.0, steps=4)
    assert folding.layers is not None
    pairs = {tuple(row) for row in folding.layers[:, :2].tolist()}
    assert pairs >= {(0, 1), (2, 3), (3, 4)} and not pairs & {(0, 2), (1, 2), (0, 3), (1, 3)}
    assert f"({len(pairs)} pairs that overlap)" in folding.report()


def test_no_order_is_told_of_layers_that_are_not_flat():
    folded, angles = flat(strip([1.0, 1.0, 1.0], "MV"))
    bent = folded.vertices + [[0, 0, 0.4 * (k == 3)] for k in range(len(folded.vertices))]
    folded = folded.changed(vertices=bent)
    with pytest.raises(ComputationError, match="panels 0 and 1 lie on each other"):
        layer_order(folded, flat_state(folded, angles, CLOSED))
