"""Kernels read the fields of a named tuple from a context."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from foldyn.dynamics.motion_state import TALLY
from foldyn.jit.compiled import inner, kernel
from foldyn.jit.context import Context


class Part(NamedTuple):
    yes: bool
    line: NDArray
    size: float


class Owner(NamedTuple):
    part: Part
    number: int
    table: NDArray
    tally: np.record
    last: Part


@inner
def _told(part):
    return part.size * part.line[1] if part.yes else -1.0


@kernel
def _read(own):
    own.tally.steps += own.number
    own.table[1, 2] = 7.0
    return _told(own.part), _told(own.last), own.table.shape[0], own.number


def test_fields_are_those_of_the_tuple():
    line, table, tally = np.array([1.0, 2.0, 3.0]), np.zeros((2, 3)), np.zeros(1, TALLY)[0]
    owner = Owner(Part(True, line, 2.5), -4, table, tally, Part(False, line[1:], 0.5))
    assert _read(Context(owner)) == (5.0, -1.0, 2, -4)
    assert tally.steps == -4 and table[1, 2] == 7.0
    last = Part(True, np.arange(6.0)[::2], 0.5)  # of another layout, and so of another type
    assert _read(Context(owner._replace(last=last)))[:2] == (5.0, 1.0)


def test_what_is_no_tuple_of_arrays_and_numbers_has_no_place():
    with pytest.raises(TypeError, match="str has no place in a context"):
        Context(Part(True, np.zeros(2), "2.5"))  # type: ignore[arg-type]
