"""What a public object shows of itself in a session or a notebook: one short line."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

import foldyn as fd
from foldyn import signals
from foldyn.cases import SUPPORTS
from foldyn.cases.histories import HISTORIES
from foldyn.cases.loads import LOADS
from foldyn.cases.units import unit_of
from foldyn.linear import linearize

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
MANY = list(range(50))


@pytest.fixture(scope="module")
def snapping():
    """The landscape of a Kresling tower that is pressed down."""
    return fd.landscape(fd.read_case(fd.studies.find_case("gallery/kresling")).run())


def _objects():
    pattern = fd.patterns.miura(cells=(6, 5))
    s = fd.discretize(pattern, SHEET, preset="plate")
    case = fd.Case(s, [fd.Fix(MANY, "xy"), fd.Impose(MANY, "z", [0.0] * 50)], [], fd.Rayleigh(0.1))
    t = np.linspace(0.0, 4.0, 401)
    ringing = np.exp(-t) * np.cos(2 * np.pi * 3 * t)
    table = fd.Table(t, ringing)
    shell = fd.shell(fd.patterns.simple_fold(), SHEET, divisions=3)
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
    assert repr(fd.Fix([4, 5], "xz")) == "Fix(nodes=(4, 5), axes='xz', along=False)"
    assert repr(fd.Fix([4], "xz")).startswith("Fix(nodes=(4,), ")  # Python's own tuple of one
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


KINDS = [*SUPPORTS, *LOADS, *HISTORIES.values()]
KINDS += [fd.Sheet, fd.PanelSheet, fd.Rayleigh, fd.ModalDamping, fd.CreaseDamping, fd.PointMass]
KINDS += [fd.Contact, fd.Plane, fd.State]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_every_part_of_a_case_has_a_table_for_notebooks(kind):
    assert callable(getattr(kind, "_repr_html_", None))


def test_the_table_has_what_the_line_has_and_units():
    rows = ElementTree.fromstring(SHEET._repr_html_()).findall("tr")
    assert ["".join(row.itertext()) for row in rows] == [
        "youngs modulus1000000.0 Pa", "poissons ratio0.25", "thickness0.01 m", "density1.0 kg/m3",
        "length scale ratio1.0", "panels()",
    ]  # fmt: skip
    force = fd.Force("x > 0.5", (0, 0, -1), fd.HalfSine(0.5))
    text = force._repr_html_()
    table = ElementTree.fromstring(text)  # well formed: the selection is escaped
    assert table.findtext("caption/code") == "Force"
    assert [cell.text for cell in table.iter("td")] == [
        "'x > 0.5'", "(0.0, 0.0, -1.0) N", "HalfSine(duration=0.5)",
    ]  # fmt: skip
    assert "<svg" in fd.Case(fd.shell(fd.patterns.simple_fold(), SHEET, divisions=2))._repr_html_()


def test_a_unit_is_for_numbers():
    assert unit_of("thickness", 0.1) == "m" and unit_of("crease_stiffness", [0.1, 0.2])
    assert unit_of("force", [0, 0, 1]) == "N"
    assert unit_of("thickness", "xmin") == unit_of("mass", "panel") == ""
