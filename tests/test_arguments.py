"""Arguments of all public functions and data classes: NumPy's numbers, and what is none at all."""

from __future__ import annotations

import inspect
import os
import re
import tomllib
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import tomli_w
import xarray as xr

import foldyn as fd
from foldyn.cases.document import from_document, to_document
from foldyn.errors import FoldynError, FoldynWarning, InputError
from foldyn.patterns import GENERATORS
from named_models import named
from pairwise import beyond
from public_calls import DATA, PATTERNS, case, pattern, sheet, solved

MADE = {"Structure", "Shell", "Superelements", "Folding", "Fidelity", "View"}
"""Made by functions."""
KEPT = {"ModelOptions", "ShellOptions", "SuperelementsOptions", "Measure"}
"""Checked by the functions that take them."""
OWN = {"BarLaw", "HingeLaw", "CustomBarLaw", "CustomHingeLaw"}
"""For laws of users, which are functions."""
LEFT = {"name", "boards", "custom", "memory", "continuation", "origin", "options", "sample"}
"""Parameters that calls may leave out."""
WRONG = (
    None, "word", 5.5, -1, True, [], [None], ["a"], {"a": 1}, object(), np.array([1.0, 2.0]),
    np.array("x"), [[1, 2], [3]], lambda *_: 0, float("nan"), 10**400, 1j, b"x", {1, 2},
)  # fmt: skip


@pytest.fixture(scope="module")
def calls(tmp_path_factory):
    folder = tmp_path_factory.mktemp("calls")
    before = os.getcwd()
    os.chdir(folder)  # names of files that are accepted
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        made = solved(folder)
    yield {**DATA, **PATTERNS, **made}
    os.chdir(before)


SOLVED = (
    "simulate", "simulate_many", "trace", "switch_branch", "landscape", "modes", "buckling", "frf",
    "random_response", "spectrum_response", "stresses", "margins", "imperfect", "bands",
    "effective", "swept_sine", "bifurcation_diagram", "poincare_section", "lyapunov_exponent",
    "basins", "fold", "critical_step", "initial_state", "mac", "case_of", "latched", "attitude",
    "save", "load", "export", "view", "read_case", "flat_foldable", "read_pattern", "diagnose",
    "write_pattern", "sweep", "sensitivity", "design", "fit", "fidelity", "periodic_motion",
    "response_curve", "backbone",
)  # fmt: skip
"""Calls of `solved`, which computes."""
NAMES = (*DATA, *PATTERNS, *SOLVED)
EACH = [*DATA, *PATTERNS, *beyond(SOLVED, 12)]


@pytest.mark.matrix
def test_every_public_name_and_parameter_has_a_call(calls):
    assert tuple(calls) == NAMES
    public = {n for n in fd.__all__ if callable(getattr(fd, n)) and n not in MADE | KEPT | OWN}
    assert public | set(GENERATORS) == set(NAMES)
    for name, (function, arguments) in calls.items():
        known = inspect.signature(function).parameters
        several = {"Sheet", "PanelSheet", "Fix", "Impose", "Actuate", "TotalForce", "Spring"}
        several |= {"Dashpot", "Link", "Cable", "Bar"}
        missing = set(known) - set(arguments) - LEFT - {"history"}
        assert not missing or name in several, (name, missing)


def outcome(function: Any, arguments: dict[str, Any]) -> Any:
    """What a call returns, or the message of its error, so that two can be compared."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)
            found = function(**arguments)
    except FoldynError as error:
        return str(error)
    if isinstance(found, xr.Dataset):
        return {name: values.values.tolist() for name, values in found.data_vars.items()}
    for attributes in (("vertices", "faces", "assignments"), ("nodes", "fold_stiffness")):
        if all(hasattr(found, each) for each in attributes):
            return repr([np.asarray(getattr(found, a), object).tolist() for a in attributes])
    return re.sub(r"np\.str_\(('[^']*')\)", r"\1", repr(found))


def alike(value: Any) -> list[Any]:
    """The same number or text in other kinds."""
    if isinstance(value, bool):
        return [np.bool_(value), np.array(value)]
    if isinstance(value, int):
        small = [np.uint8(value)] if 0 <= value < 256 else []
        return [np.array(value), np.int32(value), np.int64(value), *small]
    if isinstance(value, float):
        half = [np.float32(value)] if float(np.float32(value)) == value else []
        counts = [int(value), np.int64(value)] if value.is_integer() else []
        return [np.array(value), *half, *counts, np.float64(value)]
    return [np.str_(value)] if isinstance(value, str) else []


def leaves(value: Any, place: tuple = ()) -> Iterator[tuple[tuple, Any]]:
    if isinstance(value, bool | int | float | str):
        yield place, value
    elif type(value) in (list, tuple, dict):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(item, (*place, key))


def put(value: Any, place: tuple, new: Any) -> Any:
    if not place:
        return new
    key, *inner = place
    if isinstance(value, dict):
        return {**value, key: put(value[key], tuple(inner), new)}
    return type(value)(
        put(item, tuple(inner), new) if k == key else item for k, item in enumerate(value)
    )


@pytest.mark.parametrize("name", EACH)
def test_numbers_of_numpy_are_numbers(calls, name):
    """Calls that compute have each as an array, which is least like a number, and as one more."""
    function, arguments = calls[name]
    few = slice(0, 2) if name in SOLVED else slice(None)
    expected = outcome(function, arguments)
    for place, value in leaves(arguments):
        for other in alike(value)[few]:
            found = outcome(function, put(arguments, place, other))
            assert found == expected, f"{place} = {other!r}"
    for key, value in arguments.items():
        if isinstance(value, list) and value and all(isinstance(v, int | float) for v in value):
            assert outcome(function, {**arguments, key: np.array(value)}) == expected, key


@pytest.mark.parametrize("name", EACH)
def test_what_is_of_the_wrong_kind_is_refused(calls, name):
    function, arguments = calls[name]
    for key in arguments:
        for wrong in WRONG:
            if key == "models" and (wrong is None or (isinstance(wrong, list) and not wrong)):
                continue  # accepted, and takes long
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", FoldynWarning)
                    function(**{**arguments, key: wrong})
            except FoldynError:
                pass
            except Exception as error:
                pytest.fail(f"{name}: {key} = {wrong!r}: {type(error).__name__}: {error}")


NUMBER, COUNT = (np.float64, np.array, np.float32), (np.int64, np.array, np.int32)


@pytest.mark.parametrize(("real", "whole"), list(zip(NUMBER, COUNT, strict=True)))
@pytest.mark.parametrize("kind", ["bars", "shell"])
def test_a_case_of_numpys_numbers_is_written_and_read(real, whole, kind, tmp_path):
    """Through TOML and through a stored result."""
    material = fd.Sheet(real(1e6), real(0.25), real(0.5**6), density=real(1000.0))
    creases = {"crease_stiffness": real(0.5), "crease_rest": real(90.0)}
    law = fd.Plastic(real(0.5), kinematic=real(0.25), law=fd.EnhancedLinear(real(45), real(315)))
    if kind == "bars":
        structure = fd.discretize(pattern(), material, **named(creases), fold_law=law)
    else:
        structure = fd.shell(pattern(), material, divisions=whole(2), **creases)
    made = fd.Case(
        structure,
        [fd.Fix([whole(0), whole(1), 2, 3], np.str_("xyz")), fd.Spring(real(2.0), whole(4))],
        [fd.Force([whole(4)], np.array([0, 0, 1e-3]), fd.Ramp(real(0.5), np.bool_(True)))],
        [fd.Rayleigh(real(0.5)), fd.CreaseDamping(real(0.25), [whole(0)])],
        [fd.PointMass(whole(5), real(0.25))],
        fd.Contact(thickness=real(0.125), panels=np.bool_(True)),
    )
    document = to_document(made)
    assert not document.obstacles
    sections = tomllib.loads(tomli_w.dumps(document.sections))
    assert to_document(from_document(sections, document.arrays)).sections == document.sections
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)  # the loads do not act at rest
        found = fd.modes(made.altered(contact=None), count=whole(2))
    fd.save(found, tmp_path / "modes.nc")
    again = to_document(fd.case_of(fd.load(tmp_path / "modes.nc")))
    del document.sections["contact"]
    assert again.sections == document.sections


def test_a_folding_stands_for_its_pattern():
    flat = fd.Pattern([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)], ["V"])
    folding = fd.fold(flat, 90)
    for make in (fd.discretize, fd.shell):
        one, other = make(folding, sheet()), make(folding.pattern, sheet())
        np.testing.assert_array_equal(one.nodes, other.nodes)
        assert one.pattern is folding.pattern
    with pytest.raises(InputError, match="pattern: got Case, give a Pattern"):
        fd.discretize(case(), sheet(), preset="plate")
