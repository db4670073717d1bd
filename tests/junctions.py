"""Patterns with edges of three and more panels."""

import numpy as np
from scipy.spatial.transform import Rotation

import foldyn as fd

SHEET = fd.Sheet(2e9, 0.3, thickness=2e-3, density=900.0, length_scale_ratio=3.0)
ANGLES = 0.0, 80.0, 200.0, 290.0


def star(angles=ANGLES, welded=False, length=0.2, width=0.1, backwards=(1,)):
    """Rectangles that meet at one edge (0, 1), each at an angle (degrees) about it.

    backwards : panels listed the other way around.
    """
    vertices, faces = [(0.0, 0.0, 0.0), (length, 0.0, 0.0)], []
    for number, angle in enumerate(np.radians(angles)):
        y, z = width * np.cos(angle), width * np.sin(angle)
        vertices += [(0.0, y, z), (length, y, z)]
        face = (0, 1, 2 * number + 3, 2 * number + 2)
        faces.append(face[::-1] if number in backwards else face)
    return fd.Pattern(vertices, faces, welds=[(0, 1)] if welded else ())


def stack(nx=1, ny=1, dihedral=110.0):
    """Two Miura layers, one the other's mirror image, that share the zigzag lines of ridges."""
    layer = fd.patterns.miura((nx, ny), a=0.04, b=0.04, dihedral=dihedral)
    top = layer.vertices[:, 2].max()
    return layer, layer.joined(layer.mirrored("z", about=(0.0, 0.0, top)), inner=True)


def copied(pattern, seed):
    """The pattern turned, mirrored or not, and renumbered; with the new numbers of its vertices.

    Faces begin anywhere, and run either way where a front is not shared with others.
    """
    rng = np.random.default_rng(seed)
    matrix = Rotation.random(rng=rng).as_matrix() @ np.diag([1.0, 1.0, rng.choice([-1.0, 1.0])])
    number = rng.permutation(len(pattern.vertices))
    vertices = np.empty_like(pattern.vertices)
    vertices[number] = pattern.vertices @ matrix.T
    faces = []
    for face in pattern.faces:
        new = np.roll(number[list(face)], rng.integers(len(face))).tolist()
        faces.append(tuple(new[:: rng.choice([-1, 1])]))
    order = rng.permutation(len(faces))
    welds = number[pattern.welds].reshape(-1, 2).tolist()
    with np.errstate(all="ignore"):
        made = fd.Pattern(vertices, [faces[k] for k in order], welds=welds)
    return made, number, np.argsort(order)


def crease_of(pattern):
    """Row of each crease, by its edge and its two panels."""
    rows = zip(pattern.creases.tolist(), pattern.crease_faces.tolist(), strict=True)
    return {(tuple(edge), frozenset(panels)): k for k, (edge, panels) in enumerate(rows)}
