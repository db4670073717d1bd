"""Large models in strips and on several threads: the same force, bit by bit the same each time."""

from __future__ import annotations

import subprocess
import sys
import threading
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from samples import CUBIC, relative
from test_blocks import random_model

import foldyn as fd
from foldyn import mechanics
from foldyn.jit.compiled import shared
from foldyn.jit.intrinsics import borrowed
from foldyn.mechanics import force as force_module
from foldyn.mechanics import threads as threads_module
from foldyn.mechanics.model import node_order, renumber
from foldyn.mechanics.strips import reach, shares, strips
from foldyn.mechanics.threads import BROKEN, part, run_together, team, wait
from named_models import named
from pairwise import in_pairs

# relative to the norm of the force: sums of some ten numbers in another order
ROUNDING = 1e-14
LAWS = {
    "mixed": {"fold_law": fd.EnhancedLinear(75, 285)},
    "enhanced": {"fold_law": fd.EnhancedLinear(), "bend_law": fd.EnhancedLinear()},
    "linear": {"fold_law": "linear", "bend_law": "linear", "bar_law": "linear"},
    "own": {"bend_law": CUBIC},
}


@shared
def again_and_again(model, u, force, work, times, step):
    """Evaluations that would read what is being written, did the threads not wait.

    The force as threads compute it: called from a function that has let go of Python's lock. In
    between every thread moves its own nodes by a step along the force.
    """
    model, work = borrowed(model), borrowed(work)
    first, last = work.strips.own[0], work.strips.own[1]
    for _ in range(times):
        mechanics.internal_force(model, u, force, work)
        for i in range(first, last):
            for c in range(3):
                u[i, c] -= step * force[i, c]
        wait(work.team)


def sheet(cells, laws="mixed"):
    """Model of a Miura sheet numbered along it, and a displacement."""
    s = fd.discretize(
        fd.patterns.miura(cells=cells, dihedral=100), fd.Sheet(1e6, 0.25, 0.01), **named(LAWS[laws])
    )
    model, _ = renumber(s.model, node_order(s.model))
    u = np.random.default_rng(0).uniform(-0.02, 0.02, model.rest.shape)
    return model, u


def alone(model, u):
    out, work = np.full_like(u, np.nan), mechanics.force_scratch(model)
    mechanics.internal_force(model, u, out, work)
    return out, work.angle


def together(model, u, works):
    out = np.full_like(u, np.nan)
    arguments = [(model, u, out, work, 1, 0.0) for work in works]
    run_together(again_and_again, [work.team for work in works], arguments)
    return out


def in_windows_of(monkeypatch, nodes):
    """Let buffers hold few nodes, so that a small model needs many strips."""
    smaller = lambda model, count: strips(model, count, nodes)  # noqa: E731
    monkeypatch.setattr(force_module, "strips", smaller)


@pytest.mark.parametrize("laws", LAWS)
@pytest.mark.parametrize("cells", [(1, 1), (2, 2), (3, 5), (12, 3), (40, 2), (7, 7)])
def test_strips_give_the_force_of_the_whole(monkeypatch, cells, laws):
    model, u = sheet(cells, laws)
    force, angle = alone(model, u)
    in_windows_of(monkeypatch, 64)
    work = mechanics.force_scratch(model)
    assert len(work.strips.lowest) > 1 or len(model.rest) <= max(64, 4 * reach(model))
    for _ in range(2):  # buffers keep nothing from one evaluation to the next
        out = np.full_like(u, np.nan)
        mechanics.internal_force(model, u, out, work)
        assert relative(out, force) < ROUNDING
    np.testing.assert_array_equal(work.angle, angle)


@pytest.mark.matrix
@pytest.mark.parametrize(("count", "window", "laws"), in_pairs([2, 3, 4], [64, 16384], LAWS))
def test_threads_agree_to_rounding_and_repeat_to_the_bit(monkeypatch, count, window, laws):
    model, u = sheet((60, 2), laws)
    force, angle = alone(model, u)
    in_windows_of(monkeypatch, window)
    works = mechanics.force_scratches(model, count)
    assert len(works) == count
    first = together(model, u, works)
    assert relative(first, force) < ROUNDING
    np.testing.assert_array_equal(works[0].angle, angle)
    for _ in range(10):
        np.testing.assert_array_equal(together(model, u, works), first)


@pytest.mark.matrix
def test_evaluations_in_a_compiled_loop_do_not_overtake_each_other():
    """200 evaluations in which every thread moves its own nodes along the force."""
    model, u = sheet((60, 2))
    ends = []
    for count in (1, 2, 2, 3):
        works, moved, force = mechanics.force_scratches(model, count), u.copy(), np.empty_like(u)
        arguments = [(model, moved, force, work, 200, 1e-5) for work in works]
        run_together(again_and_again, [work.team for work in works], arguments)
        ends.append(moved)
    assert relative(ends[0], u) > 0.1
    np.testing.assert_array_equal(ends[1], ends[2])
    assert relative(ends[1] - u, ends[0] - u) < 1e-11
    assert relative(ends[3] - u, ends[0] - u) < 1e-11


@pytest.mark.matrix
def test_every_element_and_node_belongs_to_one_strip(monkeypatch):
    model, _ = sheet((60, 2))
    n = len(model.rest)
    for count in (1, 2, 3, 5):
        parts = strips(model, count, 64)
        assert [int(part.own[0]) for part in parts] == [*shares(model, count)[:-1]]
        lowest = np.concatenate([part.lowest for part in parts])
        covered = np.concatenate([np.arange(a, b) for a, b in lowest])
        assert sorted(covered) == list(range(n))
        for one in parts:
            done = one.finished[one.edge :]
            assert np.concatenate([np.arange(a, b) for a, b in done]).tolist() == list(
                range(*one.own)
            )
            # no strip touches more nodes than the buffers have rows
            low = np.minimum(one.lowest[:, 0], one.finished[:, 0])
            assert (one.fresh[:, 1] - low).max() <= one.rows


@pytest.mark.matrix
def test_work_is_shared_evenly():
    model, _ = sheet((60, 2))
    cuts = shares(model, 4)
    owner = np.searchsorted(cuts, model.hinges.min(axis=1), side="right")
    counts = np.bincount(owner)[1:]
    assert len(counts) == 4
    assert counts.max() < 1.2 * counts.min()


@pytest.mark.matrix
def test_models_that_cannot_be_shared_stay_on_one_thread():
    """Elements between random nodes reach through the whole model; so do small sheets'."""
    tangled = random_model(200, 200, 200)
    assert len(mechanics.force_scratches(tangled, 2)) == 1
    assert len(mechanics.force_scratches(sheet((1, 1))[0], 2)) == 1
    empty = random_model(0, 0, 0)
    u = np.zeros((60, 3))
    works = mechanics.force_scratches(empty, 3)
    assert not together(empty, u, works).any()


@pytest.mark.matrix
def test_threads_are_used_for_large_models_as_far_as_allowed(monkeypatch):
    model, _ = sheet((60, 2))
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setattr(threads_module.config, "NUMBA_NUM_THREADS", 3)
    assert mechanics.threads_for(model) == 1
    monkeypatch.setattr(threads_module, "HINGES_EACH", 100)
    assert mechanics.threads_for(model) == 3
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    assert mechanics.threads_for(model) == 2
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert mechanics.threads_for(model) == 1


def test_a_failure_on_one_thread_ends_the_waiting_of_the_others():
    members = team(3)

    def fail_or_wait(number):
        if number == 1:
            raise MemoryError("no room")
        while members[0].state[BROKEN] == 0:
            pass

    with pytest.raises(MemoryError, match="no room"):
        run_together(fail_or_wait, members, [(k,) for k in range(3)])


@pytest.mark.matrix
def test_waiting_ends_when_the_team_is_broken():
    members = team(2)
    members[0].state[BROKEN] = 1
    waiter = threading.Thread(target=wait_once, args=(members[0],), daemon=True)
    waiter.start()
    waiter.join(60)
    assert not waiter.is_alive()


@shared
def wait_once(member):
    wait(member)


@shared
def shares_of(member, count):
    return part(member, count)


@pytest.mark.matrix
def test_parts_of_a_count_follow_each_other():
    for count in (0, 1, 2, 7, 100):
        parts = [shares_of(member, count) for member in team(3)]
        assert parts[0][0] == 0
        assert parts[-1][1] == count
        assert all(a[1] == b[0] for a, b in pairwise(parts))


@pytest.mark.matrix
def test_a_forked_process_can_use_threads_too():
    """Pools of threads that outlive a call would not survive this."""
    if not hasattr(__import__("os"), "fork"):
        pytest.skip("no fork here")
    code = """
import multiprocessing, sys
sys.path[:0] = {places}
from test_threads import alone, sheet, together
from foldyn import mechanics
from samples import relative
model, u = sheet((60, 2))
def error(_=None):
    return relative(together(model, u, mechanics.force_scratches(model, 2)), alone(model, u)[0])
assert error() < 1e-13
with multiprocessing.get_context("fork").Pool(1) as pool:
    assert pool.apply_async(error).get(60) < 1e-13
"""
    here = Path(__file__).parent
    code = code.format(places=[str(here), str(here.parent)])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
