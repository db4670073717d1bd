"""Case files of each kind of analysis that take milliseconds, to be swept."""

from __future__ import annotations

import gc
import os
import time

from numba.core.dispatcher import Dispatcher

from case_texts import HELD_FOLD_TEXT, HELD_MIURA_TEXT, MIURA_TEXT, MODES_TEXT, PLATE

MODES = MODES_TEXT
DAMPED = HELD_MIURA_TEXT + "[damping]\nalpha = 0.2\n"
FRF = f"""{DAMPED}{PLATE}[[drive]]
nodes = [8]
force = [0, 0, 1]
[analysis]
kind = "frf"
frequencies = {{ first = 0.1, last = 3, count = 291 }}
"""
MOTION = f"""{DAMPED}[[loads]]
nodes = [8]
force = [0, 0, 1e-4]
history = {{ kind = "pulse", duration = 0.1 }}
[analysis]
kind = "dynamics"
duration = 40.0
dt = 0.02
method = "newmark"
[output]
interval = 0.02
"""
BANDS = f"""{MIURA_TEXT}{PLATE}[analysis]
kind = "bands"
count = 5
points = 17
zone = 6
attenuation = 20
"""
PATH = f"""{HELD_FOLD_TEXT}[model]
bend_law = "linear"
fold_law = "linear"
[[loads]]
nodes = [0, 1]
force = [-1e-3, 0, 0]
[analysis]
kind = "statics"
steps = 4
"""


def slow_measure(result, case) -> float:
    """A frequency, after a while."""
    time.sleep(0.1)
    return float(result["frequency"][0])


def compiled_here(result, case) -> list[float]:
    """The process, and how many kernels it has compiled instead of loading them."""
    # by type: proxies of what is gone, of other tests, raise where they are asked
    found = [one for one in gc.get_objects() if issubclass(type(one), Dispatcher)]
    return [os.getpid(), sum(sum(one.stats.cache_misses.values()) for one in found)]


def fails_sometimes(result, case) -> float:
    """No number for some sheets."""
    if case.structure.sheet.thickness > 0.015:
        raise ZeroDivisionError("too thick")
    return 1.0
