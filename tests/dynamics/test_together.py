"""Motions on several threads: the same as on one to rounding, and bit by bit from run to run."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.dynamics import methods
from foldyn.dynamics.methods import threads_of
from foldyn.dynamics.system import pack
from foldyn.errors import InstabilityError, PenetrationError

METHODS = ("rk4", "central_difference")
# of the largest value of each variable, after 200 steps: forces are summed in another order
ROUNDING = 1e-11
STEPS = 200


def sheet(**options):
    """A long Miura sheet, so that threads can cut it across."""
    pattern = fd.patterns.miura(cells=(60, 2), dihedral=100)
    return fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1000.0), **options, preset="herkal")


def case(structure=None, loads=None, damping=None):
    structure = structure or sheet(fold_law=fd.EnhancedLinear(75, 285))
    last = len(structure.pattern.vertices) - 1
    if loads is None:
        pulse = fd.Force(nodes=[last - 4, last], vector=(0.0, 1.0, 2.0), history=fd.HalfSine(0.1))
        loads = [pulse, fd.Gravity((0, 0, -0.01))]
    return fd.Case(
        structure, [fd.Fix(nodes=range(5))], loads, damping or fd.Rayleigh(alpha=3.0, beta=1e-7)
    )


def on(monkeypatch, threads, what, method, **options):
    monkeypatch.setattr(methods, "threads_of", lambda packed: threads)
    ds = fd.simulate(what, duration=options.pop("duration", 0.02), method=method, **options)
    assert ds.attrs["threads"] == threads
    return ds


def shaken(structure):
    """The case on a base that moves, its tip pulled aside."""
    tip = len(structure.pattern.vertices) - 1
    ramp = fd.Ramp(1.0, smooth=True)
    moves = [fd.BaseMotion("z", fd.Harmonic(0.5), 1e-3), fd.Impose([tip], "x", 2e-3, ramp)]
    plain = case(structure)
    return fd.Case(structure, [*plain.supports, *moves], plain.loads, plain.damping)


def folding(structure):
    """The case with all creases turned."""
    turned = fd.Actuate("all", fraction=0.02, history=fd.Ramp(1.0, smooth=True))
    plain = case(structure)
    return fd.Case(structure, plain.supports, [*plain.loads, turned], plain.damping)


KINDS = {
    "plain": lambda: case(),
    "moved": lambda: shaken(sheet()),
    "turned": lambda: folding(sheet()),
    "consistent mass": lambda: shaken(sheet(mass="consistent")),
}


@pytest.mark.matrix
@pytest.mark.parametrize("threads", [2, 3])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("method", METHODS)
def test_threads_share_a_motion(monkeypatch, method, kind, threads):
    what = KINDS[kind]()
    dt = 0.5 * fd.critical_step(what, method)
    options = {"duration": STEPS * dt, "dt": dt, "every": 7}
    alone = on(monkeypatch, 1, what, method, **options)
    found = on(monkeypatch, threads, what, method, **options)
    assert float(np.abs(alone["displacement"]).max()) > 1e-4
    for name in alone.data_vars:
        if alone[name].dtype.kind == "f" and "time" in alone[name].dims:
            scale = float(np.abs(alone[name]).max())
            assert float(np.abs(found[name] - alone[name]).max()) < ROUNDING * scale, name
    again = on(monkeypatch, threads, what, method, **options)
    for name in found.data_vars:
        np.testing.assert_array_equal(found[name].values, again[name].values)


def test_small_structures_and_what_cannot_be_shared_run_on_one_thread(monkeypatch):
    monkeypatch.setattr("foldyn.mechanics.threads.HINGES_EACH", 100)
    monkeypatch.setattr("foldyn.mechanics.threads.config.NUMBA_NUM_THREADS", 2)
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    plain = case()
    tip = len(plain.structure.pattern.vertices) - 1
    assert threads_of(pack(plain, 1e-4)) == 2
    called = fd.Force(nodes=[tip], vector=(0, 0, 1.0), history=lambda t: 1.0)
    s = plain.structure
    for other in (
        case(s, [called]),
        case(s, [fd.Pressure(1.0)]),
        fd.Case(s, [fd.Fix(nodes=range(5)), fd.Link([tip - 1, tip], axes="z")]),
    ):
        assert threads_of(pack(other, 1e-4)) == 1
    small = fd.discretize(fd.patterns.miura(), fd.Sheet(1e6, 0.25, 0.01, 1000.0), preset="herkal")
    assert threads_of(pack(fd.Case(small, [fd.Fix(nodes=[0])]), 1e-4)) == 1


@pytest.mark.parametrize("method", METHODS)
def test_all_threads_stop_where_one_finds_the_motion_wrong(monkeypatch, method):
    structure = sheet()
    rushing = np.zeros_like(structure.nodes)
    tip = len(structure.pattern.vertices) - 1
    rushing[tip, 2] = 1e5  # through its neighbors within a step
    what = fd.Case(structure)
    start = fd.State(velocity=rushing)
    with pytest.raises((PenetrationError, InstabilityError)) as alone:
        on(monkeypatch, 1, what, method, initial=start)
    with pytest.raises((PenetrationError, InstabilityError)) as found:
        on(monkeypatch, 2, what, method, initial=start)
    assert str(found.value) == str(alone.value)


@pytest.mark.filterwarnings("ignore:steps of")
@pytest.mark.parametrize("method", METHODS)
def test_a_load_that_is_not_finite_stops_all_threads(monkeypatch, method):
    table = fd.Table([0.0, 0.001, 0.0011], [1.0, 1.0, 1e50])
    structure = sheet()
    tip = len(structure.pattern.vertices) - 1
    loads = [fd.Force(nodes=[tip], vector=(0, 0, 1e50), history=table)]
    for threads in (1, 2):
        with pytest.raises(InstabilityError, match="no longer finite"):
            on(monkeypatch, threads, case(structure, loads), method, duration=0.1)
