"""Duffing's oscillator, m z'' + c z' + k z + k3 z^3 = F sin(2 pi f t): a triangle of two nodes
held and one that moves out of its plane, on a spring.

With the law "linear" (Green strain) bars that stand at right angles to the motion have the energy
k3 z^4 / 4 exactly.
"""

import warnings
from functools import cache

import numpy as np

import foldyn as fd

K = 3.0
NODE = 2


@cache
def structure(height=0.0):
    pattern = fd.Pattern([[0, 0, 0], [1, 0, 0], [0.5, 0.8, height]], [[0, 1, 2]])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fd.errors.UnitsWarning)
        sheet = fd.Sheet(1e3, 0.3, 0.01, 1000.0)
    return fd.discretize(pattern, sheet, scheme="n4b5", bar_law="linear", mass="panel")


def oscillator(force=0.5, frequency=0.25, alpha=0.1, dashpot=0.0, height=0.0, spring=True):
    """`height` of the node above the plane of the others: two wells, at 0 and -2 height."""
    supports = [fd.Fix([0, 1], "xyz"), fd.Fix([NODE], "xy")]
    if spring:
        supports.append(fd.Spring(K, nodes=[NODE], direction="z"))
    if dashpot:
        supports.append(fd.Dashpot(dashpot, nodes=[NODE], direction="z"))
    load = fd.Force([NODE], (0, 0, force), history=fd.Harmonic(frequency))
    return fd.Case(structure(height), supports, [load], fd.Rayleigh(alpha=alpha))


def mass():
    return float(structure().mass.toarray()[NODE, NODE])


@cache
def cubic():
    """k3, N/m3."""
    case, u = oscillator(), np.zeros((3, 3))
    found = []
    for z in (0.1, 0.5, 2.0):
        u[NODE, 2] = z
        found.append((case.body.internal(case.body.dofs(u))[3 * NODE + 2] - K * z) / z**3)
    assert np.ptp(found) < 1e-12 * found[0]
    return float(found[0])
