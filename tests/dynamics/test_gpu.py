"""Motions on a GPU: the kernels in Numba's CUDA simulator, and what is refused."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.dynamics.gpu import checks
from foldyn.errors import InputError

PATTERN = fd.patterns.miura((1, 1), panel_angle=60.0, dihedral=110.0)
SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
HELD = fd.Fix(np.flatnonzero(PATTERN.vertices[:, 0] <= 1e-9))


@pytest.mark.matrix
def test_kernels_in_the_simulator():
    asked = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-n", "0"]
    done = subprocess.run(
        [*asked, Path(__file__).with_name("on_gpu.py")], capture_output=True, text=True,
        env=os.environ | {"NUMBA_ENABLE_CUDASIM": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]


@pytest.fixture
def card(monkeypatch):
    """As if there were one."""
    monkeypatch.setattr(checks, "check_gpu", lambda method: None)
    monkeypatch.setattr("foldyn.dynamics.driver.check_gpu", lambda method: None)


def sheet(**options) -> fd.Case:
    return fd.Case(fd.discretize(PATTERN, SHEET, **options), [HELD])


LUMPED = {"mass": "mixed_voronoi"}
REFUSED = {
    "panels bend as plates": lambda: sheet(preset="n5b8e"),
    "not diagonal": lambda: sheet(preset="herkal", mass="consistent"),
    "the term ": lambda: fd.Case(
        fd.discretize(PATTERN, SHEET, **LUMPED), [HELD], contact=fd.Contact()
    ),
    "a support that moves": lambda: fd.Case(
        fd.discretize(PATTERN, SHEET, **LUMPED),
        [HELD, fd.Impose([8], "z", 1e-3, fd.HalfSine(0.01))],
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_has_no_kernel_is_named(card, what):
    with pytest.raises(InputError, match=f"{what}.*has no GPU kernel"):
        fd.simulate(REFUSED[what](), 1e-3, device="gpu")


def test_a_method_without_kernels_is_named():
    with pytest.raises(InputError, match="newmark has no GPU kernel; choose one of rk4"):
        fd.simulate(sheet(), 1e-3, "newmark", device="gpu")
    with pytest.raises(InputError, match=r"device.*choose"):
        fd.simulate(sheet(), 1e-3, device="tpu")


def test_without_a_package_or_a_card(monkeypatch):
    why = "not installed"
    if importlib.util.find_spec("numba_cuda") is not None:
        monkeypatch.setattr("numba.cuda.is_available", lambda: False)
        why = "no GPU of NVIDIA"
    with pytest.raises(InputError, match=why):
        fd.simulate(sheet(), 1e-3, device="gpu")


def test_a_card_that_is_too_small(monkeypatch):
    from foldyn.dynamics.gpu import card

    monkeypatch.setattr(card, "free_memory", lambda: 1e6)
    with pytest.raises(InputError, match=r"3 models of 9 nodes needs .* GiB on the card"):
        card.check_size(1e9, "3 models of 9 nodes")


def test_arrays_of_one_model_are_copied_at_once():
    from foldyn.dynamics.gpu import card

    array = np.arange(12.0).reshape(4, 3)[None]
    assert array.strides[0] == 0  # whose rows Numba would copy one by one
    flat = card.flat_strides(array)
    assert flat.strides[0] > 0
    np.testing.assert_array_equal(flat, array)
