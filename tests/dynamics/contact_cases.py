"""Cases with contact: sheets that collide, fold onto themselves, snap and slide."""

from __future__ import annotations

import numpy as np

import foldyn as fd
from contact_sheets import SHEET, strip

G = 9.81
PULSE = fd.HalfSine(0.02)


def two_sheets() -> tuple[fd.Structure, np.ndarray]:
    """Two free sheets above each other, askew, and the nodes of the upper one."""
    w = 0.04
    grid = np.array([[i * w, j * w, 0.0] for j in (0, 1) for i in (0, 1, 2)])
    turned = grid @ np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]]).T + [0.01, -0.01, 0.002]
    turned[:, 2] += 0.02 * turned[:, 0]
    faces = [(0, 1, 4, 3), (1, 2, 5, 4), (6, 7, 10, 9), (7, 8, 11, 10)]
    pattern = fd.Pattern(np.vstack([grid, turned]), faces, name="two sheets")
    s = fd.discretize(pattern, SHEET, fold_law="linear", preset="plate")
    upper = np.zeros(len(s.nodes), bool)
    upper[6:12] = upper[s.centers[2:]] = True
    return s, upper


def folded_from_both_ends(contact: fd.Contact | None) -> fd.Case:
    """A strip of three panels whose outer ones fold onto the middle one, which is held."""
    return fd.Case(
        strip(), [fd.Fix(nodes=[2, 3, 4, 5])], [fd.Actuate([0, 1], 8.0, fd.Ramp(0.25))],
        fd.Rayleigh(alpha=20.0), contact=contact,
    )  # fmt: skip


def tower(force: float, contact: fd.Contact | None, history=PULSE, alpha: float = 200.0) -> fd.Case:
    """The Kresling tower of the gallery, its top pushed down."""
    pattern = fd.patterns.kresling(sides=6, radius=0.04, height=0.06, twist=30, storeys=1)
    s = fd.discretize(pattern, SHEET, membrane="bars", preset="plate")
    push = fd.Force(nodes=list(range(6, 12)), vector=(0, 0, -force), history=history)
    return fd.Case(
        s, [fd.Fix(nodes=list(range(6)))], [push], fd.Rayleigh(alpha=alpha), contact=contact
    )


def on_slope(angle: float, friction: float, alpha: float = 0.0) -> fd.Case:
    """A flat strip that lies on a slope of some degrees; the slope is the x-y plane."""
    s, a = strip(2), np.radians(angle)
    plane = fd.Plane((0, 0, -0.4965 * SHEET.thickness), (0, 0, 1), friction=friction)
    gravity = fd.Gravity((G * np.sin(a), 0, -G * np.cos(a)))
    contact = fd.Contact(panels=False, planes=[plane])
    return fd.Case(s, [], [gravity], fd.Rayleigh(alpha=alpha), contact=contact)
