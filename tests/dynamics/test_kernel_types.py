"""Compiled loops are made for types of arguments: cases of one kind have the same ones."""

from __future__ import annotations

import numpy as np
import pytest
from numba import typeof

import foldyn as fd
from foldyn.dynamics.equation import EquationOfMotion
from foldyn.dynamics.motion_state import TALLY, Course
from foldyn.dynamics.system import pack, scratch
from foldyn.mechanics.clamps import clamp_blocks
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.mechanics.springs import axial_blocks
from foldyn.mechanics.tangent import _add_bars, _add_hinges
from foldyn.structures import PRESETS

MODELS = (*PRESETS, "shell")
FOLD = fd.patterns.simple_fold(a=1.0, b=1.3, dihedral=100)
SHEET = fd.Sheet(1e6, 0.3, 0.01, density=100.0)
HELD = fd.Fix([0, 1])
SPRING = fd.Spring(2.0, [4])
TURN = fd.Actuate([0], 150.0, fd.Ramp(0.2))


def packed(model, supports=(), loads=(), contact=None, **options):
    if model == "shell":
        structure = fd.shell(FOLD, SHEET, 2, **options)
    else:
        structure = fd.discretize(FOLD, SHEET, preset=model, **options)
    return pack(fd.Case(structure, [HELD, *supports], loads, contact=contact), 1e-4)


def test_loops_see_one_type_whatever_a_case_consists_of():
    """Else they would be compiled for each, as they were for nested models."""
    plane = fd.Contact(planes=[fd.Plane((0, 0, -2), (0, 0, 1))], panels=False)
    cases = [
        packed("herkal"),
        packed("herkal", [SPRING, fd.Impose([2], "z", 0.1, fd.Ramp(0.2))], [TURN]),
        packed("plate", [SPRING], contact=plane, clamped=[(0, 1)], mass="mixed_voronoi"),
    ]
    kinds = set()
    for one in cases:
        (work,) = one.body.workspaces(1)
        still = np.zeros((one.system.rows, 3))
        course = Course(still, still, still, np.zeros(1, TALLY)[0], np.zeros(0))
        equation = EquationOfMotion(one, work, scratch(one.system), course, False)
        kinds.add((typeof(equation.still), typeof(course)))
    assert len(kinds) == 1


@pytest.mark.parametrize("loads", [(), [TURN], [fd.Gravity("-z"), fd.Pressure(1.0)]])
@pytest.mark.parametrize("supports", [(), [SPRING]])
def test_what_does_not_depend_on_the_model_has_one_type(supports, loads):
    wanted = typeof(packed("herkal").system)
    for model in MODELS:
        assert typeof(packed(model, supports, loads).system) == wanted, model


def test_what_touches_has_one_type():
    plane = fd.Plane((0, 0, -2), (0, 0, 1))
    contacts = [fd.Contact(), fd.Contact(planes=[plane], panels=False), fd.Contact(thickness=0.01)]
    tables = [
        packed(model, contact=of).body.find(ContactTerm).tables
        for model in MODELS
        for of in contacts
    ]
    assert len({typeof(arrays) for arrays in tables}) == 1
    whole = [array for array in tables[0] if isinstance(array, np.ndarray)]
    assert all(array.flags.writeable for array in whole)


def test_arrays_that_cannot_be_written_compile_nothing_more():
    structure = fd.discretize(FOLD, SHEET, clamped=[(0, 1)])
    body = fd.Case(structure, [SPRING]).body
    for may in (True, False):
        q = np.zeros(3 * len(structure.nodes))
        q.flags.writeable = may
        body.tangent(q)
    for kernel in (_add_bars, _add_hinges, axial_blocks, clamp_blocks):
        assert len(kernel.signatures) == 1
