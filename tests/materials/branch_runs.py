"""Histories of turns through the branches of laws with memory, and what holds for all of them."""

from __future__ import annotations

from dataclasses import MISSING, fields

import numpy as np

import foldyn as fd
from foldyn.jit.compiled import kernel
from foldyn.materials import HINGE_LAWS, MemoryLaw
from foldyn.materials.branch_switch import mean_moment, update


def example(kind, **given):
    """A law of a kind, whose numbers without a default are 0.1."""
    needed = [field for field in fields(kind) if field.default is MISSING]
    return kind(**{field.name: 0.1 for field in needed} | given)


LAWS = {
    name: example(kind, law="linear")
    for name, kind in HINGE_LAWS.items()
    if issubclass(kind, MemoryLaw)
} | {
    "prony": fd.Prony([0.3, 0.1], [0.02, 1.0], law="linear"),
    "plastic": fd.Plastic(0.05, isotropic=0.02, kinematic=0.1, law="linear"),
    "eyring": fd.Eyring(0.02, 1e-3, law="linear"),
}


@kernel
def branch_table(code, p, after, dt, start, out):
    """`update` and mean moments along turns (m,) with times dt (m,) between them, to `out` (m, 9).

    start : (3,) turn and state before the first.
    """
    before, one, other = start[0], start[1], start[2]
    for i in range(after.size):
        found = update(code, p, before, after[i], dt[i], one, other)
        for c in range(6):
            out[i, c] = found[c]
        mean = mean_moment(code, p, before, after[i], dt[i], one, other)
        for c in range(3):
            out[i, 6 + c] = mean[c]
        before, one, other = after[i], found[0], found[1]


def histories(law, turns, times, start=0.0):
    """State, moment, slope, energy and loss of each branch of a hinge with k = L = 1, with what
    mean moments are: (b, m, 9).

    turns : (m,) rad; times : (m,) s between them; start : turn before, at rest.
    """
    out = []
    for branch in law.branches(np.ones(1), np.ones(1)):
        table = np.empty((len(turns), 9))
        begun = np.array([start, 0.0, 0.0])
        branch_table(
            branch.code, branch.parameters[0], np.asarray(turns, float), np.asarray(times, float),
            begun, table,
        )  # fmt: skip
        out.append(table)
    return np.array(out)


def moments(law, turns, times):
    """Moments (m,), N m, of the hinge as a whole."""
    return np.asarray(turns) + histories(law, turns, times)[:, :, 2].sum(axis=0)
