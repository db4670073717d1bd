"""What a public object shows of itself in a session or a notebook: one short line."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn import signals
from foldyn.linear import linearize

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
MANY = list(range(50))


@pytest.fixture(scope="module")
def snapping():
    """The landscape of a Kresling tower that is pressed down."""
    return fd.landscape(fd.read_case(fd.studies.find_case("gallery/kresling")).run())


def _objects():
    pattern = fd.patterns.miura(cells=(6, 5))
    s = fd.discretize(pattern, SHEET)
    case = fd.Case(s, [fd.Fix(MANY, "xy"), fd.Impose(MANY, "z", [0.0] * 50)], [], fd.Rayleigh(0.1))
    t = np.linspace(0.0, 4.0, 401)
    ringing = np.exp(-t) * np.cos(2 * np.pi * 3 * t)
    table = fd.Table(t, ringing)
    shell = fd.shell(fd.patterns.simple_fold(), SHEET, 3)
    return {
        "pattern": pattern,
        "structure": s,
        "shell": shell,
        "case": case,
        "long case": fd.Case(s, [fd.Fix(k) for k in range(20)], [fd.Force(99, (0, 0, 1), table)]),
        "table": table,
        "state": fd.State(np.zeros((len(s.nodes), 3)), np.ones((len(s.nodes), 3))),
        "force": fd.Force(MANY, (0, 0, 1)),
        "actuate": fd.Actuate(MANY, [90.0] * 50),
        "peaks": signals.find_peaks(np.arange(1.0, 402.0), np.abs(ringing)),
        "decrement": signals.log_decrement(ringing, 0.01),
        "poles": signals.matrix_pencil(ringing, 0.01),
        "linearized": linearize(fd.Case(shell, [fd.Fix("xmin")])),
        "case file": fd.read_case(fd.studies.find_case("herkal/case1")),
    }


@pytest.mark.parametrize("name", list(_objects()))
def test_one_short_line(name):
    text = repr(_objects()[name])
    assert "\n" not in text and len(text) < 900, text
    assert "0x" not in text  # no address


def test_short_ones_are_shown_whole():
    assert repr(fd.Fix([4, 5], "xz")) == "Fix(nodes=(4, 5), axes='xz')"
    assert repr(fd.Fix([4], "xz")) == "Fix(nodes=(4,), axes='xz')"  # Python's own tuple of one
    assert repr(fd.State(np.zeros((9, 3)))) == "State(displacement=<float64 (9, 3)>)"
    assert "(0, 1, 2, 3, 4, 5, ... 50 in all)" in repr(fd.Fix(MANY))


def test_a_landscape_says_its_states_heights_and_barriers(snapping):
    found = snapping
    text, there, back = repr(found), found.barrier(0, 1), found.barrier(1, 0)
    assert "\n" not in text and len(text) < 300
    for state in found.states:
        word = "stable" if state.stable else "unstable"
        assert f"{word} at {state.stroke:.4g} m ({state.energy:.3g} J)" in text
    assert f"barriers {there:.3g} J there and {back:.3g} J back" in text
    assert len(repr(found.states[0])) < 200
