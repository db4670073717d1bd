"""Starts of folding: a branch that leaves the flat state, or the folded state itself.

In the flat state bars do not feel displacements across the sheet, and fold angles are linear in
them. A first least-squares step toward small angles of the assigned signs therefore costs no
energy; minimizing the energy with its one-sided terms then closes the panels again. The result is a
branch on which every mountain and valley folds as assigned, if there is one.

Some patterns have no such branch with plane panels (in a crane, vertices make conflicting demands
on a crease). Their folded state may still be isometric, if the rotations across the creases around
every vertex close. It is found by composing these rotations panel by panel, and opened to the
angles wanted.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns import Pattern
from foldyn.statics.folding.energy import Aim, FoldEnergy, Shape, Stiffness
from foldyn.statics.folding.minimum import minimum

FIRST_TURN = math.radians(8.0)
PERTURBED = Stiffness(bends=30.0, creases=1.0, sides=0.0)  # bars hardly matter


def opened(energy: FoldEnergy, stiffness: Stiffness) -> Shape:
    """Shape near the start, in which mountains and valleys have begun to fold as assigned."""
    turned = energy.creases(energy.start.turns)
    least = np.where(energy.signs == 0.0, 0.0, FIRST_TURN)
    if (energy.signs * turned >= least).all():
        return energy.start
    wish = np.where(energy.signs * turned < least, energy.signs * least, turned)
    wish = np.where(energy.signs == 0.0, np.nan, wish)
    most = np.full(len(least), math.pi)
    perturbed = minimum(energy, energy.start, Aim(wish, least, most), PERTURBED, iterations=3)
    free = Aim(np.full(len(least), np.nan), least, most)
    return minimum(energy, perturbed, free, stiffness, iterations=100)


def ajar(energy: FoldEnergy, folded: Shape) -> Shape:
    """Shape near a folded one, in which creases have begun to open."""
    turns = energy.creases(folded.turns)
    none, most = np.zeros_like(turns), np.full(len(turns), math.pi)
    aim = Aim(turns - FIRST_TURN * np.sign(turns), none, most)
    return minimum(energy, folded, aim, PERTURBED, iterations=3)


def composed(pattern: Pattern, angles: NDArray) -> tuple[NDArray, float]:
    """Vertices (n, 3) of a flat pattern folded by angles (nc,), rad, and the closing error, m.

    The error is the largest deviation of a vertex, as one of its panels has it, from the mean.
    """
    axes = pattern.vertices[np.concatenate([pattern.creases, pattern.welds]).astype(np.int64)]
    turns = np.concatenate([angles, np.zeros(len(pattern.welds))])
    neighbors: list[list[tuple[int, int, float]]] = [[] for _ in pattern.faces]
    sides = [*pattern.crease_faces.tolist(), *pattern.weld_faces.tolist()]
    for k, (front, back) in enumerate(sides):
        neighbors[front].append((back, k, -1.0))
        neighbors[back].append((front, k, 1.0))
    placed: dict[int, tuple[NDArray, NDArray]] = {}
    for first in range(len(pattern.faces)):
        if first in placed:
            continue
        placed[first] = np.eye(3), np.zeros(3)
        queue = deque([first])
        while queue:
            face = queue.popleft()
            rotation, shift = placed[face]
            for other, k, way in neighbors[face]:
                if other not in placed:
                    a, b = axes[k]
                    own = _rotation(b - a, way * turns[k])
                    placed[other] = rotation @ own, rotation @ (a - own @ a) + shift
                    queue.append(other)
    total, count = np.zeros_like(pattern.vertices), np.zeros(len(pattern.vertices))
    images = []
    for number, face in enumerate(pattern.faces):
        rotation, shift = placed[number]
        corners = list(face)
        image = pattern.vertices[corners] @ rotation.T + shift
        images.append((corners, image))
        total[corners] += image
        count[corners] += 1.0
    mean = np.where(count[:, None] > 0.0, total / np.maximum(count, 1.0)[:, None], pattern.vertices)
    gap = max(float(np.abs(image - mean[corners]).max()) for corners, image in images)
    return mean, gap


def _rotation(axis: NDArray, angle: float) -> NDArray:
    """Matrix (3, 3) of a right-handed rotation (Rodrigues)."""
    u = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
