"""Motions on several threads: the same as on one to rounding, and bit by bit from run to run."""

from __future__ import annotations

from functools import partial
from itertools import cycle

import numpy as np
import pytest
from long_cases import killed_and_resumed, look_often, same
from measured import agree
from moving_sheets import HEAVY

import foldyn as fd
from foldyn.dynamics import methods
from foldyn.dynamics.methods import ExplicitEngine, threads_of
from foldyn.dynamics.system import pack
from foldyn.errors import InstabilityError, PenetrationError
from pairwise import beyond

METHODS = ("rk4", "central_difference")
# of the largest value of each variable, after some steps: forces are summed in another order
ROUNDING = 1e-11
SMOOTH = fd.Ramp(1.0, smooth=True)


def sheet(**options):
    """A long Miura sheet, so that threads can cut it across."""
    pattern = fd.patterns.miura(cells=(60, 2), dihedral=100)
    return fd.discretize(pattern, HEAVY, **options, preset="herkal")


SHEET = sheet()
TIP = len(SHEET.pattern.vertices) - 1


def case(structure=SHEET, loads=None, supports=()):
    if loads is None:
        loads = [fd.Force([TIP - 4, TIP], (0.0, 1.0, 2.0), fd.HalfSine(0.1)),
                 fd.Gravity((0, 0, -0.01))]  # fmt: skip
    return fd.Case(structure, [fd.Fix(range(5)), *supports], loads, fd.Rayleigh(3.0, 1e-7))


def on(monkeypatch, threads, what, method, duration=0.02, **options):
    monkeypatch.setattr(methods, "threads_of", lambda packed: threads)
    ds = fd.simulate(what, duration, method=method, **options)
    assert ds.attrs["threads"] == threads
    return ds


# a base that moves while the tip is pulled aside
MOVES = [fd.BaseMotion("z", fd.Harmonic(0.5), 1e-3), fd.Impose([TIP], "x", 2e-3, SMOOTH)]
TURNED = [*case().loads, fd.Actuate("all", fraction=0.02, history=SMOOTH)]
KINDS = {
    "plain": lambda: case(sheet(fold_law=fd.EnhancedLinear(75, 285))),
    "moved": lambda: case(supports=MOVES),
    "turned": lambda: case(loads=TURNED),
    "consistent mass": lambda: case(sheet(mass="consistent"), supports=MOVES),
}


def shared(monkeypatch, threads, alone, what, method, **given):
    """The motion on some threads; that of one to rounding, and the same again."""
    found, again = (on(monkeypatch, threads, what, method, **given) for _ in range(2))
    agree(found, alone, ROUNDING)
    same(found, again)
    return found


def half_steps(what, method, steps, every):
    dt = 0.5 * fd.critical_step(what, method)
    return {"duration": steps * dt, "dt": dt, "every_steps": every}


@pytest.mark.parametrize(("kind", "method"), beyond(zip(KINDS, cycle(METHODS), strict=False), 3))
def test_threads_share_a_motion(monkeypatch, method, kind):
    what = KINDS[kind]()
    given = half_steps(what, method, 120, 7)
    alone = on(monkeypatch, 1, what, method, **given)
    assert float(np.abs(alone["displacement"]).max()) > 1e-4
    threads = 2 if kind in ("plain", "turned") else 3
    shared(monkeypatch, threads, alone, what, method, **given)


def closing(contact: fd.Contact | None = None, dihedral: float = 1.6) -> tuple[fd.Case, fd.State]:
    """A long Miura sheet, nearly closed, that closes at once; on a base that moves."""
    s = fd.discretize(
        fd.patterns.miura(cells=(30, 1), dihedral=dihedral),
        HEAVY,
        fold_law="linear",
        preset="plate",
    )
    z, down = s.nodes[:, 2], fd.Ramp(0.2, smooth=True)
    ground = fd.Plane((0, 0, z.min() - 0.0049), (0, 0, 1), friction=0.3)
    press = fd.Plane((0, 0, z.max() + 0.0049), (0, 0, -1), 0.2, (0.002, 0, -0.002), down)
    supports = [fd.Fix(nodes=[0, 1]), fd.BaseMotion("y", fd.Harmonic(2.0), 1e-4)]
    contact = contact or fd.Contact(friction=0.4, planes=[ground, press])
    weight, slowed = fd.Gravity((0, 0, -0.01)), fd.Rayleigh(alpha=3.0)
    v = np.outer(s.nodes[0, 0] - s.nodes[:, 0], [1.0, 0.0, 0.0])
    return fd.Case(s, supports, [weight], slowed, contact=contact), fd.State(velocity=v)


@pytest.mark.parametrize(("method", "threads"), beyond([("central_difference", 3), ("rk4", 2)]))
def test_threads_share_what_touches(monkeypatch, method, threads):
    what, start = closing()
    given = half_steps(what, method, 40, 20) | {"initial": start}
    alone = on(monkeypatch, 1, what, method, **given)
    assert (alone.contact_force.values[-1] > 0.0).mean() > 0.5  # panels touch,
    assert float(np.abs(alone.plane_force[-1]).max()) > 0.0  # and planes are met
    assert alone.attrs["shortest_contact_step"] < given["dt"]
    found = shared(monkeypatch, threads, alone, what, method, **given)
    assert found.attrs["contact_lists"] == alone.attrs["contact_lists"]
    assert found.attrs["energy_error"] == pytest.approx(alone.attrs["energy_error"], rel=1e-3)


@pytest.mark.matrix
@pytest.mark.parametrize("method", METHODS)
def test_where_nothing_touches_threads_give_the_bits_of_a_motion_without_contact(
    monkeypatch, method
):
    what, _ = closing(fd.Contact(), dihedral=100.0)
    given = half_steps(what, method, 60, 30)
    found = on(monkeypatch, 2, what, method, **given)
    without = on(monkeypatch, 2, what.altered(contact=None), method, **given)
    assert found.attrs["contact_lists"] == 1 and float(found.contact.max()) == 0.0
    for name in ("displacement", "velocity", "work", "reaction"):
        np.testing.assert_array_equal(found[name].values, without[name].values)


def test_small_structures_and_what_cannot_be_shared_run_on_one_thread(monkeypatch):
    monkeypatch.setattr("foldyn.mechanics.threads.HINGES_EACH", 100)
    monkeypatch.setattr("foldyn.mechanics.threads.config.NUMBA_NUM_THREADS", 2)
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    called = fd.Force(nodes=[TIP], vector=(0, 0, 1.0), history=lambda t: 1.0)
    touching, law = closing()[0], fd.Prony([0.5], [0.02], law="linear")
    remembering = fd.discretize(touching.structure.pattern, HEAVY, fold_law=law, preset="plate")
    small = fd.discretize(fd.patterns.miura(), HEAVY, preset="herkal")
    for what, threads in (
        (case(), 2),
        (touching, 2),
        (case(loads=[called]), 1),
        (case(loads=[fd.Pressure(1.0)]), 1),
        (case(supports=[fd.Link([TIP - 1, TIP], axes="z")], loads=[]), 1),
        (fd.Case(small, [fd.Fix([0])]), 1),
        (fd.Case(remembering, touching.supports, contact=fd.Contact()), 1),
    ):
        assert threads_of(pack(what, 1e-4)) == threads


@pytest.mark.parametrize("method", METHODS)
def test_all_threads_stop_where_one_finds_the_motion_wrong(monkeypatch, method):
    rushing = np.zeros_like(SHEET.nodes)
    rushing[TIP, 2] = 1e5  # through its neighbors within a step
    said = []
    for threads in (1, 2):
        with pytest.raises((PenetrationError, InstabilityError)) as stopped:
            on(monkeypatch, threads, fd.Case(SHEET), method, initial=fd.State(velocity=rushing))
        said.append(str(stopped.value))
    assert said[0] == said[1]


@pytest.mark.filterwarnings("ignore:steps of")
@pytest.mark.parametrize("what", [case(), closing(fd.Contact(), 100.0)[0]], ids=["", "contact"])
@pytest.mark.parametrize("method", METHODS)
def test_a_load_that_is_not_finite_stops_all_threads(monkeypatch, method, what):
    """No list of pairs can be made then, which all must learn."""
    table = fd.Table([0.0, 0.001, 0.0011], [1.0, 1.0, 1e50])
    blow = fd.Force([len(what.structure.pattern.vertices) - 1], (0, 0, 1e50), table)
    for threads in (1, 2):
        with pytest.raises(InstabilityError, match="no longer finite"):
            on(monkeypatch, threads, what.altered(loads=[blow]), method, duration=0.1)


@pytest.mark.parametrize("method", beyond(METHODS[::-1]))
def test_a_motion_that_is_killed_goes_on_to_the_same_bits(monkeypatch, tmp_path, method):
    look_often(monkeypatch)
    what, start = closing()
    given = half_steps(what, method, 40, 20) | {"initial": start}
    whole = on(monkeypatch, 2, what, method, **given)
    resume_from = ExplicitEngine.resume_from

    def forgetful(self, arrays):
        """What a new process would not know."""
        for array in (self._threads[0].angle, *self._scratches[0][6:8]):
            array[:] = 3.0
        resume_from(self, arrays)

    monkeypatch.setattr(ExplicitEngine, "resume_from", forgetful)
    run = partial(on, monkeypatch, 2, what, method)
    same(killed_and_resumed(run, tmp_path / "run.nc", **given), whole)
