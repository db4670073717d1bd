"""Folding, and structures of different panels, against size: `python benchmarks/folding.py`.

Flat patterns are folded to 60 %, and sheets whose panels all differ, flat and folded, are made
structures of the preset n5b8e. Processor time (s), that of a panel (ms), and over that in the
smallest pattern of a kind, and memory. `--most 25000` goes on to that many panels (2000 by
default), `--only n5b8e` leaves folding out.
"""

# ruff: noqa: E402  (the environment must be set before the imports)

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import argparse
import resource
import time
import warnings

import numpy as np

import foldyn as fd
from foldyn.errors import FoldynWarning

SHEET = fd.Sheet(youngs_modulus=1.2e9, poissons_ratio=0.2, thickness=1e-4, density=700)
SIDES = (5, 10, 19, 35, 79, 112)
CELLS = (3, 7, 13, 25, 50)  # of sheets of n5b8e, in both directions


def miura(n: int, uneven: float = 0.0) -> fd.Pattern:
    """A flat Miura-ori of n x n cells; the vertices of an uneven one are moved at random."""
    keys = {"cells": (n, n), "a": 0.02, "b": 0.02}
    flat, folded = (fd.patterns.miura(dihedral=angle, **keys) for angle in (180, 120))
    x = flat.vertices.copy()
    x[:, :2] += 0.02 * uneven * np.random.default_rng(1).normal(size=(len(x), 2))
    return fd.Pattern(x, flat.faces, folded.assignments)


def zigzags(n: int) -> fd.Pattern:
    """A folded sheet of 4 n^2 parallelograms, all different: one zigzag moved along another."""
    x, steps = np.zeros((2, 2 * n + 1, 3)), np.ones((2, 2 * n, 3))
    steps[:, 1::2] = -1.0
    steps *= np.array([[[0.0, 0.4, 0.0]], [[0.0, 0.0, 0.6]]])
    steps[0, :, 0] = steps[1, :, 1] = 1.0
    steps *= 0.02 + 0.006 * np.random.default_rng(1).random((2, 2 * n, 1))
    x[:, 1:] = np.cumsum(steps, axis=1)
    number = np.arange((2 * n + 1) ** 2).reshape(2 * n + 1, -1)
    corners = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.stack(corners, axis=-1).reshape(-1, 4).tolist()
    return fd.Pattern((x[0][:, None] + x[1]).reshape(-1, 3), faces)


KINDS = {
    "miura": miura,
    "miura, uneven": lambda n: miura(n, 0.004),
    "waterbomb": lambda n: fd.patterns.waterbomb(
        (4, max(n * n // 4, 1)), 0.02, b=0.02, dihedral=180
    ),
    "resch": lambda n: fd.patterns.resch((n, n), dihedral=180),
}
PRESETS = {"n5b8e": lambda n: miura(n, 0.01), "n5b8e, folded": zigzags}


def timed(call) -> tuple[object, float]:
    """What a call returns, and the processor time it takes (s)."""
    began = time.process_time()
    return call(), time.process_time() - began


def told(kind: str, panels: int, seconds: float, first: dict[str, float], more: str) -> None:
    """Print a row."""
    each = first.setdefault(kind, seconds / panels)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"{kind:24s}{panels:8d}{seconds:9.2f} s{1e3 * seconds / panels:7.2f} ms"
        f"{seconds / panels / each:7.2f}{peak:7.0f} MiB  "
        f"{more}",
        flush=True,
    )


def main() -> None:
    """Print the tables."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--most", type=int, default=2000)
    options.add_argument("--only", choices=[*KINDS, *PRESETS], action="append")
    given = options.parse_args()
    most, only = given.most, given.only or [*KINDS, *PRESETS]
    warnings.simplefilter("ignore", FoldynWarning)
    fd.fold(miura(1), fraction=0.6, steps=1)  # load the kernels
    fd.discretize(miura(1), SHEET, preset="n5b8e")
    first: dict[str, float] = {}
    print(f"{'fold to 60 %':24s}{'panels':>8s}{'time':>11s}{'each':>10s}{'ratio':>7s}{'peak':>11s}")
    for kind, make in KINDS.items():
        for pattern in map(make, SIDES if kind in only else ()):
            if len(pattern.faces) <= most:
                folding, seconds = timed(lambda pattern=pattern: fd.fold(pattern, fraction=0.6))
                told(kind, len(pattern.faces), seconds, first, repr(folding))
    for kind, make in PRESETS.items():
        for pattern in map(make, CELLS if kind in only else ()):
            if len(pattern.faces) <= most:
                made = lambda pattern=pattern: fd.discretize(pattern, SHEET, preset="n5b8e")  # noqa: E731
                told(kind, len(pattern.faces), timed(made)[1], first, "")


if __name__ == "__main__":
    main()
