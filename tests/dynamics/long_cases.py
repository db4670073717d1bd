"""Motions that are killed and go on; run as a script with a file and the arguments in JSON, one."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from contact_cases import folded_from_both_ends, on_slope

import foldyn as fd
from foldyn.dynamics import motion
from one_hinge import WING, one_hinge

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1000.0)


def sheet(thickness: float = 0.01, force: float = 0.05) -> fd.Case:
    """A cell that swings on a base that moves, under loads with jumps."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, thickness, 1000.0), preset="plate")
    base = fd.BaseMotion("x", fd.Harmonic(2.0), 0.001)
    loads = [fd.Force([6, 7, 8], (force, 0, 0), fd.Pulse(duration=0.3))]
    return fd.Case(s, [fd.Fix([0, 1, 2]), base], loads, fd.Rayleigh(2.0, 1e-5))


def actuated() -> fd.Case:
    """A fold with a law that depends on its rest angle, which moves."""
    pattern = fd.patterns.simple_fold(dihedral=120)
    s = fd.discretize(
        pattern, SHEET, fold_law=fd.EnhancedLinear(theta1=90, theta2=270), preset="plate"
    )
    swing = fd.Actuate("all", 220.0, fd.Ramp(0.5, smooth=True))
    return fd.Case(s, [fd.Fix([2, 3])], [swing], fd.Rayleigh(alpha=0.5))


def creeping() -> fd.Case:
    """A hinge with memory under a constant force."""
    law = fd.Prony([0.5, 0.2], [0.02, 0.3], law="linear")
    return one_hinge(law, loads=[fd.Force([WING], (0, 0, 3e-4))], hold=False)


def sliding() -> fd.Case:
    """A strip that slides down a slope, held back by friction."""
    return on_slope(30.0, 0.3)


def touching() -> fd.Case:
    """A strip that folds onto itself and rubs."""
    return folded_from_both_ends(fd.Contact(friction=0.3))


def blown() -> fd.Case:
    """A cell that folds by itself in gusts of a dense gas, which moves with it."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=120)
    s = fd.discretize(pattern, SHEET, preset="plate")
    gas = fd.Air(10.0, (0.4, 0.0, 0.8), history=fd.Harmonic(3.0), resolution=2)
    fold = fd.Actuate("all", fraction=0.6, history=fd.Ramp(0.5, smooth=True))
    return fd.Case(s, [fd.Fix([0, 1, 2])], [fold], air=gas)


def warmed() -> fd.Case:
    """A cell that stretches and curls as it gets warm and cold again."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=110)
    s = fd.discretize(pattern, SHEET, preset="plate")
    heat = fd.Temperature(40.0, expansion=2e-4, curvature=1e-3, history=fd.HalfSine(duration=0.5))
    return fd.Case(s, [fd.Fix([0, 1, 2])], [heat])


CASES = {
    "sheet": sheet, "actuated": actuated, "creeping": creeping, "sliding": sliding,
    "touching": touching, "blown": blown, "warmed": warmed,
}  # fmt: skip


def simulated(name: str, changes: dict[str, Any] | None = None, **options: Any) -> xarray.Dataset:
    """The motion of one of them, looked after every few steps."""
    motion.CHUNK, motion.REPORT_EVERY = 16, 0.0
    return fd.simulate(CASES[name](**(changes or {})), **{"method": "rk4", **options})


def same(one: xarray.Dataset, other: xarray.Dataset, also: tuple[str, ...] = ()) -> None:
    """Two results have the same bits, and the same attributes but for the time that they took."""
    assert set(one.variables) == set(other.variables)
    assert set(one.coords) == set(other.coords)
    for name in one.variables:
        assert one[name].dims == other[name].dims
        assert np.array_equal(one[name].values, other[name].values), name
        assert one[name].attrs == other[name].attrs
    aside = {"wall_seconds", "motion", *also}
    first, second = ({k: v for k, v in ds.attrs.items() if k not in aside} for ds in (one, other))
    assert first == second


class Killed(BaseException):
    """What ends a run without a word."""


def look_often(monkeypatch, chunk: int = 16) -> None:
    """Look after every few steps; what the processor does is not waited for on the disk."""
    monkeypatch.setattr(os, "fsync", lambda _: None)
    monkeypatch.setattr(motion, "CHUNK", chunk)
    monkeypatch.setattr(motion, "REPORT_EVERY", 0.0)


def killed_and_resumed(run: Callable[..., xarray.Dataset], file: Path, **given: Any):
    """The motion, killed after seven tenths of it and resumed."""

    def stop(now):
        if now.time > 0.7 * given["duration"]:
            raise Killed

    kept = given | {"store": file, "checkpoint": 1e-9, "resume": True}
    with pytest.raises(Killed):
        run(**kept, progress=stop)
    return run(**kept)


if __name__ == "__main__":
    simulated(**json.loads(sys.argv[1]))
