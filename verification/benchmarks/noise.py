"""Random vibration: Miles' formula."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import foldyn as fd
from verification.benchmarks.benchmark import Benchmark

MASS, STIFFNESS, ZETA = 0.3, 500.0, 0.02
DENSITY = 0.2  # m2/s3


def chain(stiffness: Sequence[float], masses: Sequence[float], zeta: float = ZETA) -> fd.Case:
    """Masses on nodes 1, 2, ... that move along x, each on a spring from the node before.

    The sheet around them hardly resists, and has no mass.
    """
    soft = fd.Sheet(1e-9, 0.3, 1e-3)
    made = fd.discretize(fd.patterns.simple_fold(dihedral=120), soft, preset="plate")
    moving = list(range(1, len(masses) + 1))
    others = [node for node in range(len(made.nodes)) if node not in moving]
    supports = [fd.Fix(others, "xyz"), fd.Fix(moving, "yz")]
    supports += [
        fd.Spring(k, between=[(node - 1, node)], direction="x")
        for node, k in zip(moving, stiffness, strict=True)
    ]
    points = [fd.PointMass([node], m) for node, m in zip(moving, masses, strict=True)]
    return fd.Case(made, supports, damping=fd.ModalDamping(zeta), masses=points)


FREQUENCY = np.sqrt(STIFFNESS / MASS) / (2.0 * np.pi)


def shaken() -> float:
    """Acceleration (rms, m/s2) of a mass on a shaken base; the noise goes far beyond its peak."""
    noise = fd.SpectralDensity([1e-3, 1e4], [DENSITY, DENSITY], "m2/s3")
    found = fd.random_response(chain([STIFFNESS], [MASS]), base={"x": noise})
    return float(found.acceleration_rms.sel(node=1, axis="x"))


BENCHMARKS = [
    Benchmark(
        "one mass under white noise", "Miles (1954), formula", "point mass on a spring", "",
        "rms acceleration", "m/s²", (float(np.sqrt(np.pi * FREQUENCY * DENSITY / (4.0 * ZETA))),),
        0.002, shaken,
    ),
]  # fmt: skip
