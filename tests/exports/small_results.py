"""One small result of each kind: a fold of two panels, its edge pulled."""

from __future__ import annotations

from functools import cache

import numpy as np

import foldyn as fd


@cache
def case():
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    sheet = fd.Sheet(1e6, 0.25, 0.01, 1.0)
    structure = fd.discretize(pattern, sheet, bend_law="linear", fold_law="linear")
    supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    pull = fd.Force([0, 1], (-1e-3, 0, 0))
    return fd.Case(structure, supports, [pull], damping=fd.Rayleigh(alpha=0.5))


@cache
def motion():
    return fd.simulate(case(), 0.5, method="rk4", interval=0.1)


@cache
def modes():
    return fd.modes(case().altered(loads=()), 4)


@cache
def response():
    return fd.frf(
        case().altered(loads=()), fd.Force(0, (-1e-3, 0, 0)), frequencies=np.linspace(0.0, 2.0, 21)
    )


@cache
def path():
    return fd.trace(case(), steps=4)


@cache
def backbone():
    return fd.backbone(case().altered(loads=()), amplitudes=(1e-3, 0.01), harmonics=3)
