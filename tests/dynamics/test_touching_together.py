"""Motions with contact on several threads: that of one to rounding, the same bits each time."""

from __future__ import annotations

import os

import numpy as np
import pytest
from test_together import on

import foldyn as fd
from foldyn.dynamics import motion
from foldyn.dynamics.methods import Compiled, threads_of
from foldyn.dynamics.system import pack
from foldyn.errors import InstabilityError

METHODS = ("rk4", "central_difference")
# of the largest value of each variable: forces are summed in another order
ROUNDING = 1e-11
SOFT = fd.Sheet(1e6, 0.25, 0.01, 1000.0)
STEPS = 60


def closing(contact: fd.Contact | None = None, dihedral: float = 1.6) -> tuple[fd.Case, fd.State]:
    """A long Miura sheet, nearly closed, that closes at once; on a base that moves."""
    s = fd.discretize(fd.patterns.miura(cells=(30, 1), dihedral=dihedral), SOFT, fold_law="linear")
    z = s.nodes[:, 2]
    ground = fd.Plane((0, 0, z.min() - 0.0049), (0, 0, 1), friction=0.3)
    press = fd.Plane(
        (0, 0, z.max() + 0.0049), (0, 0, -1), motion=(0.002, 0, -0.002),
        history=fd.Ramp(0.2, smooth=True), friction=0.2,
    )  # fmt: skip
    case = fd.Case(
        s, [fd.Fix(nodes=[0, 1]), fd.BaseMotion("y", fd.Harmonic(2.0), 1e-4)],
        [fd.Gravity((0, 0, -0.01))], fd.Rayleigh(alpha=3.0),
        contact=contact or fd.Contact(friction=0.4, planes=[ground, press]),
    )  # fmt: skip
    v = np.zeros_like(s.nodes)
    v[:, 0] = -1.0 * (s.nodes[:, 0] - s.nodes[0, 0])
    return case, fd.State(velocity=v)


def options(case: fd.Case, method: str) -> dict:
    dt = 0.5 * fd.critical_step(case, method)
    return {"duration": STEPS * dt, "dt": dt, "every": STEPS // 2}


def compare(found, alone, accuracy):
    """Variables over time agree."""
    for name in alone.data_vars:
        if alone[name].dtype.kind == "f" and "time" in alone[name].dims:
            scale = float(np.abs(alone[name]).max())
            assert float(np.abs(found[name] - alone[name]).max()) <= accuracy * scale, name


@pytest.mark.matrix
@pytest.mark.parametrize("method", METHODS)
def test_threads_share_what_touches(monkeypatch, method):
    case, start = closing()
    given = options(case, method) | {"initial": start}
    alone = on(monkeypatch, 1, case, method, **given)
    assert (alone.contact_force.values[-1] > 0.0).mean() > 0.5  # panels touch,
    assert float(np.abs(alone.plane_force[-1]).max()) > 0.0  # and planes are met
    assert alone.attrs["shortest_contact_step"] < given["dt"]
    for threads in (2, 3):
        found = on(monkeypatch, threads, case, method, **given)
        compare(found, alone, ROUNDING)
        assert found.attrs["contact_lists"] == alone.attrs["contact_lists"]
        assert found.attrs["energy_error"] == pytest.approx(alone.attrs["energy_error"], rel=1e-3)
    again = on(monkeypatch, 3, case, method, **given)
    for name in found.data_vars:
        np.testing.assert_array_equal(found[name].values, again[name].values)


@pytest.mark.parametrize("method", METHODS)
def test_where_nothing_touches_threads_give_the_bits_of_a_motion_without_contact(
    monkeypatch, method
):
    case, _ = closing(fd.Contact(), dihedral=100.0)
    given = options(case, method)
    found = on(monkeypatch, 2, case, method, **given)
    without = on(monkeypatch, 2, case.altered(contact=None), method, **given)
    assert found.attrs["contact_lists"] == 1 and float(found.contact.max()) == 0.0
    for name in ("displacement", "velocity", "work", "reaction"):
        np.testing.assert_array_equal(found[name].values, without[name].values)


@pytest.mark.filterwarnings("ignore:steps of")
@pytest.mark.parametrize("method", METHODS)
def test_all_threads_stop_where_positions_are_not_finite(monkeypatch, method):
    """No list of pairs can be made then, which all must learn."""
    case, _ = closing(fd.Contact(), dihedral=100.0)
    s = case.structure
    table = fd.Table([0.0, 0.001, 0.0011], [1.0, 1.0, 1e50])
    blow = fd.Force(nodes=[len(s.pattern.vertices) - 1], vector=(0, 0, 1e50), history=table)
    for threads in (1, 2):
        with pytest.raises(InstabilityError, match="no longer finite"):
            on(monkeypatch, threads, case.altered(loads=[blow]), method, duration=0.1)


def test_contact_alone_keeps_no_motion_on_one_thread(monkeypatch):
    monkeypatch.setattr("foldyn.mechanics.threads.HINGES_EACH", 100)
    monkeypatch.setattr("foldyn.mechanics.threads.config.NUMBA_NUM_THREADS", 2)
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    case, _ = closing()
    assert threads_of(pack(case, 1e-4)) == 2
    s = fd.discretize(case.structure.pattern, SOFT, fold_law=fd.Prony([0.5], [0.02], law="linear"))
    remembering = fd.Case(s, case.supports, case.loads, contact=fd.Contact())
    assert threads_of(pack(remembering, 1e-4)) == 1


class Killed(BaseException):
    """What ends a run without a word."""


@pytest.mark.matrix
@pytest.mark.parametrize("method", METHODS)
def test_a_motion_that_is_killed_goes_on_to_the_same_bits(monkeypatch, tmp_path, method):
    monkeypatch.setattr(os, "fsync", lambda _: None)
    monkeypatch.setattr(motion, "CHUNK", 16)
    monkeypatch.setattr(motion, "REPORT_EVERY", 0.0)
    case, start = closing()
    given = options(case, method) | {"initial": start}
    whole = on(monkeypatch, 2, case, method, **given)
    resume_from = Compiled.resume_from

    def forgetful(self, arrays):
        """What a new process would not know."""
        for array in (self._works[0].angle, *self._memories[0][6:8]):
            array[:] = 3.0
        resume_from(self, arrays)

    def stop(now):
        if now.time > 0.7 * given["duration"]:
            raise Killed

    monkeypatch.setattr(Compiled, "resume_from", forgetful)
    kept = given | {"store": tmp_path / "run.nc", "checkpoint": 1e-9, "resume": True}
    with pytest.raises(Killed):
        on(monkeypatch, 2, case, method, **kept, progress=stop)
    found = on(monkeypatch, 2, case, method, **kept)
    for name in whole.data_vars:
        np.testing.assert_array_equal(found[name].values, whole[name].values)
