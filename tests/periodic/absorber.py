"""Duffing's oscillator with a nonlinear absorber (T. Detroux, G. Habib, L. Masset and G. Kerschen,
Mech. Syst. Signal Process. 60-61, 2015, arXiv:1604.05524), with the numbers of the example of two
degrees of freedom with cubic springs in NLvib (M. Krack and J. Gross, Harmonic Balance for
Nonlinear Vibration Problems, 2019), which shows a Neimark-Sacker point:

    m1 x'' + c1 x' + k1 x + k3 x^3 + c2 (x' - y') + k2 (x - y) + k4 (x - y)^3 = F sin(2 pi f t),
    m2 y'' + c2 (y' - x') + k2 (y - x) + k4 (y - x)^3 = 0.

Two triangles: one of a node held at both others, as in `duffing`, and one whose first two nodes are
linked to that node. Their thicknesses make k4 the right share of k3.
"""

import warnings
from functools import cache

import numpy as np

import foldyn as fd

MASS, STIFFNESS, DASHPOT = (1.0, 0.05), (1.0, 0.0453), (0.002, 0.013)
CUBIC, FORCE = (1.0, 0.0042), 0.11
NODES = X, Y = 2, 5
STAND = 3, 4  # what the absorber stands on, which moves with X


@cache
def structure():
    one = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.8, 0]])
    pattern = fd.Pattern(np.vstack([one, one + np.array([0, 2, 0])]), [[0, 1, 2], [3, 4, 5]])

    def of(modulus):
        thin = fd.PanelSheet([1], thickness=0.01 * CUBIC[1] / CUBIC[0])
        sheet = fd.Sheet(modulus, 0.3, 0.01, panels=[thin])
        return fd.discretize(pattern, sheet, scheme="n4b5", bar_law="linear")

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fd.errors.FoldynWarning)
        trial, u = of(1e3), np.zeros((6, 3))
        u[X, 2] = 1.0
        return of(1e3 * CUBIC[0] / trial.internal_force(u)[X, 2])


def case(frequency=0.15, force=FORCE):
    s = structure()
    supports = [fd.Fix([0, 1], "xyz"), fd.Fix([X, Y, *STAND], "xy"), fd.Link([X, *STAND], "z")]
    for nodes, stiffness, coefficient in zip((None, [(X, Y)]), STIFFNESS, DASHPOT, strict=True):
        where = {"nodes": [X]} if nodes is None else {"between": nodes}
        supports += [
            fd.Spring(stiffness, direction="z", **where),
            fd.Dashpot(coefficient, direction="z", **where),
        ]
    load = fd.Force([X], (0, 0, force), history=fd.Harmonic(frequency))
    masses = [fd.PointMass([node], m) for m, node in zip(MASS, NODES, strict=True)]
    return fd.Case(s, supports, [load], masses=masses)
