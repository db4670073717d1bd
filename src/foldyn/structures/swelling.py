"""Panels that heat, moisture or growth would stretch and curl if they were free.

A bar that would have the stretch 1 + e gets the constant second Piola-Kirchhoff stress -S(1 + e),
with S the law of the bar: then the bar has no force at that stretch.

A panel that would curl to a paraboloid w = kappa r^2 / 2, toward its front, has no moment if each
hinge inside it turns as the paraboloid through its nodes does. A wing at the distance h from an
axis of length L, and at the position s along it, then rises above the axis by kappa (h^2 + s^2 - s
L) / 2, so that the dihedral of a hinge decreases by the sum, over its wings, of

    kappa (h - s (L - s) / h) / 2.

The same applies to a fold: its panels meet at an angle between their tangents, but its dihedral is
measured between chords of nodes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.following import Following


class Swelling(NamedTuple):
    """Additions to a structure due to swollen panels.

    Membranes and plates have quadratic energies: for these, the free strains and angles, and the
    forces conjugate to them; see `mechanics.heat`.
    """

    turns: NDArray  # (nr,) changes of rest angles, rad
    forces: Following
    free: tuple[NDArray, NDArray]  # Green strains (s,), angles (q,) rad
    push: tuple[NDArray, NDArray]  # forces of `free`: (s,) J, (q,) N m
    stress: NDArray = np.zeros(0)  # (nb,) stress of single bars, divided by Young's modulus


def chord_turns(corners: NDArray) -> NDArray:
    """(h - s (L - s) / h) / 2 (n,), m, for corners (n, 3, 3): two axis ends and a wing."""
    start, end, wing = np.moveaxis(corners, 1, 0)
    axis, arm = end - start, wing - start
    length = np.linalg.norm(axis, axis=1)
    along = np.einsum("ni,ni->n", arm, axis) / length
    reach = np.linalg.norm(np.cross(arm, axis), axis=1) / length
    return 0.5 * (reach - along * (length - along) / reach)


def place_of(triangles: NDArray, wanted: NDArray) -> NDArray:
    """Rows (n,) of the triangles `wanted` (n, 3), whose corners may be in any order."""
    known, sought = np.split(_numbers(np.concatenate([triangles, wanted])), [len(triangles)])
    order = np.argsort(known, kind="stable")
    place = order[np.searchsorted(known[order], sought, "right") - 1]
    if not np.array_equal(known[place], sought):
        raise KeyError("a triangle that the structure does not have")
    return place


def _numbers(triangles: NDArray) -> NDArray:
    """A number (n,) for each triangle (n, 3), equal if the corners are the same."""
    low, middle, high = np.sort(triangles, axis=1).T
    size = int(triangles.max(initial=0)) + 1
    return (low * size + middle) * size + high


class Chords(NamedTuple):
    """Wings of n hinges, w per hinge: effect of panel curvature on the hinges' angles."""

    panel: NDArray  # (w, n)
    turn: NDArray  # (w, n) `chord_turns` of the wings, m

    def turns(self, curvature: NDArray) -> NDArray:
        """Changes (n,), rad, of the angles for panel curvatures (np,), 1/m."""
        return -(curvature[self.panel] * self.turn).sum(axis=0)


def chords(x: NDArray, triangles: NDArray, panel: NDArray, hinges: NDArray) -> Chords:
    """`Chords` of hinges (n, 2 + w), axis and wings, between triangles (nt, 3) of points x.

    panel : (nt,) panel of each triangle.
    """
    panels, turns = [], []
    for wing in range(2, hinges.shape[1]):
        corners = hinges[:, [0, 1, wing]]
        place = place_of(triangles, corners)
        own, start = triangles[place], corners[:, :1]
        forward = np.roll(own, -1, axis=1)[own == start] == corners[:, 1]
        # the front of a panel at a junction may be on the other side
        turns.append(np.where(forward == (wing == 2), 1.0, -1.0) * chord_turns(x[corners]))
        panels.append(panel[place])
    return Chords(np.array(panels), np.array(turns))


def mean_of_neighbors(pairs: NDArray, triangles: NDArray, value: NDArray) -> NDArray:
    """Mean (k,) of `value` (nt,) over the triangles (nt, 3) at each pair of nodes (k, 2)."""
    sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)).reshape(-1, 2)
    size = int(triangles.max(initial=0)) + 1
    key = np.sort(pairs) @ [size, 1]
    place = np.searchsorted(np.sort(key), sides @ [size, 1])
    order = np.argsort(key)[place]
    count = np.bincount(order, minlength=len(pairs))
    return np.bincount(order, np.repeat(value, 3), minlength=len(pairs)) / count
