"""Motions of many models on the GPU, with one block of threads for each model."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.gpu.arrays import topology
from foldyn.dynamics.gpu.checks import METHODS, lacking
from foldyn.dynamics.gpu.engine import BlockEngine, Launches, Places, take
from foldyn.dynamics.motion import Motion
from foldyn.errors import InputError

AT_ONCE = 16384  # models per launch; more would not be faster


def integrate(motions: Sequence[Motion]) -> set[int]:
    """Integrate motions that have room for samples; return the indices of failures.

    Motions with the same topology and method run together; their steps may differ.
    """
    alike: dict[Any, list[int]] = {}
    known: dict[int, Any] = {}  # preparations, which several starts can share
    for k, motion in enumerate(motions):
        packed = motion.packed
        if id(packed) not in known:
            known[id(packed)] = topology(packed)
        alike.setdefault((motion.method.name, known[id(packed)]), []).append(k)
    wrong = set[int]()
    for own in alike.values():
        for first in range(0, len(own), AT_ONCE):
            some = own[first : first + AT_ONCE]
            sound = _integrated([motions[k] for k in some])
            wrong |= {k for k, well in zip(some, sound, strict=True) if not well}
    return wrong


def integrate_prepared(motions: Sequence[Motion]) -> set[int]:
    """Integrate the motions that have GPU kernels; return the indices of successes."""
    taken = [k for k, motion in enumerate(motions) if _is_taken(motion)]
    wrong = integrate([motions[k] for k in taken])
    for k in wrong:  # the CPU run will report the failure
        motions[taken[k]].device = "cpu"
    return {k for number, k in enumerate(taken) if number not in wrong}


def _is_taken(motion: Motion) -> bool:
    """Whether a motion has GPU kernels, and room for its samples."""
    if motion.kind not in METHODS or lacking(motion.case, motion.packed):
        return False
    with suppress(InputError):  # the CPU run will report the reason
        motion.restart()
        motion.make_room()
        return True
    return False


def _integrated(motions: Sequence[Motion]) -> NDArray:
    """Integrate motions of one topology and method; return whether each (m,) succeeded."""
    clock = time.perf_counter()
    plans, method = [motion.plan for motion in motions], motions[0].method
    states = [motion.state for motion in motions]
    u, v, carry, angle = (
        np.stack([getattr(state, name) for state in states])
        for name in ("u", "v", "carry", "angle")
    )
    places = Places(u, v, carry, np.zeros((len(motions), 4)), angle)
    launches = Launches([motion.packed for motion in motions], plans, method.name, places, False)
    steps = np.array([plan.steps for plan in plans])
    between = np.array([motion.recheck_after for motion in motions])
    done, sample = np.zeros((2, len(motions)), np.int64)
    sound = np.ones(len(motions), bool)
    while (moving := sound & ((done < steps) | (sample == 0))).any():
        checked = done - done % between + between
        last = np.minimum(np.minimum(steps, checked), done + launches.fits())
        first = done + ((method.name == "central_difference") & (done > 0))
        first = np.where(moving, first, last + 1)
        written, wrong = launches.run(first, last, sample)
        sound &= ~wrong & np.isfinite(written.energy).all(axis=(0, 2))
        for k in np.flatnonzero(moving).tolist():
            out, end = motions[k].output.window, int(last[k])
            take(written, k, out, states[k], plans[k], end, method.evaluations)
            sample[k] = motions[k].stored
        done = np.where(moving, last, done)
        look = moving & sound & ((done == checked) | (done == steps))
        if look.any():
            u = launches.places().u if (done < steps).any() else u
            for k in np.flatnonzero(look).tolist():
                sound[k] = motions[k].may_continue(int(done[k]), u[k])
    share, engine = (time.perf_counter() - clock) / len(motions), BlockEngine()
    for motion in motions:
        motion.integrated_by(engine, share)
    return sound
