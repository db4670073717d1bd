"""Motions on a GPU: the kernels in Numba's CUDA simulator, and what is refused."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from on_gpu import CASE_FILE

import foldyn as fd
from foldyn.cli.main import main
from foldyn.dynamics.driver import prepare, prepared
from foldyn.dynamics.gpu import checks, choice
from foldyn.errors import InputError
from foldyn.mechanics.springs import SpringsTerm
from foldyn.sweeps.run_sweep import AT_ONCE, SideBySide
from named_models import named

PATTERN = fd.patterns.miura((1, 1), panel_angle=60.0, dihedral=110.0)
SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
MOTION = (
    CASE_FILE.partition("[[loads]]")[0]
    + """
[analysis]
kind = "dynamics"
duration = 1e-3
"""
)
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
    return fd.Case(fd.discretize(PATTERN, SHEET, **named(options)), [HELD])


LUMPED = {"mass": "mixed_voronoi", "preset": "plate"}
PLATES = lambda: sheet(preset="n5b8e", mass="mixed_voronoi")  # noqa: E731
OWN = fd.CustomBarLaw(lambda s: 0.5 * (s - 1) ** 2, lambda s: (s - 1) / s, lambda s: 1 / s**3)
REFUSED = {
    "the model Shell": lambda: fd.Case(fd.shell(PATTERN, SHEET, divisions=1), [HELD]),
    "not diagonal": lambda: sheet(preset="herkal", mass="consistent"),
    "the term ": lambda: fd.Case(
        fd.discretize(PATTERN, SHEET, **LUMPED), [HELD], contact=fd.Contact()
    ),
    "a bar with a law of your own": lambda: fd.Case(
        fd.discretize(PATTERN, SHEET, **LUMPED), [HELD, fd.Bar((0, 8), 1.0, law=OWN)]
    ),
    "a support that moves": lambda: fd.Case(
        fd.discretize(PATTERN, SHEET, **LUMPED),
        [HELD, fd.Impose([8], "z", 1e-3, fd.HalfSine(0.01))],
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_has_no_kernel_is_named(card, what):
    with pytest.raises(InputError, match=f"{what}.*has no GPU kernel"):
        fd.simulate(REFUSED[what](), 1e-3, method="rk4", device="gpu")


def test_what_is_added_to_cases_is_refused_until_kernels_know_it():
    @dataclass(frozen=True, eq=False)
    class Charged(fd.Case):
        charge: Any = None

    given = fd.discretize(PATTERN, SHEET, **LUMPED), [HELD]
    packed = prepare(fd.Case(*given), 1e-3, method="rk4").packed
    assert not checks.lacking(Charged(*given), packed)
    assert checks.lacking(Charged(*given, charge=1.2), packed) == "charge of the case"
    several = packed._replace(body=packed.body.with_terms(*[springs()] * 2))
    assert checks.lacking(fd.Case(*given), several) == "a second set of springs"
    other = packed._replace(body=packed.body.with_terms(Unknown(springs().springs)))
    assert checks.lacking(fd.Case(*given), other) == "the term Unknown"


class Unknown(SpringsTerm):
    """A term of a kind that derives from one with kernels."""


def springs() -> SpringsTerm:
    return fd.Case(sheet().structure, [HELD, fd.Spring(1.0, nodes=[8])]).body.term(SpringsTerm)


@pytest.mark.matrix
def test_the_device_is_named_in_a_case_file_and_on_the_command_line(tmp_path, monkeypatch, capsys):
    file = tmp_path / "case.toml"
    file.write_text(MOTION)
    monkeypatch.setattr(checks, "no_card", lambda: "no GPU is here")
    command = ["run", str(file), "--out", str(tmp_path / "out"), "--no-figures"]
    assert main([*command, "--device", "gpu"]) == 2
    assert 'case.toml: analysis.device = "gpu": no GPU is here' in capsys.readouterr().err
    file.write_text(MOTION + 'device = "gpu"\nmethod = "newmark"\n')
    with pytest.raises(InputError, match=r"analysis.device.*newmark has no GPU kernel"):
        fd.read_case(file).run()
    with pytest.raises(InputError, match="newmark has no GPU kernel"):
        fd.sweep(file, {"sheet.density": [1.0, 2.0]}, measures=["largest_displacement"])
    found = fd.sweep(
        file,
        {"sheet.density": [1.0, 2.0]},
        measures=["largest_displacement"],
        device="cpu",
        processes=1,
    )
    assert found.attrs["device"] == "cpu"
    file.write_text(MOTION.replace('"dynamics"\nduration = 1e-3', '"modes"'))
    assert main([*command, "--device", "gpu"]) == 2
    assert "--device: is for motions" in capsys.readouterr().err
    with pytest.raises(InputError, match=r"device.*only motions"):
        fd.sweep(file, {"sheet.density": [1.0, 2.0]}, measures=["frequency"], device="gpu")
    with pytest.raises(InputError, match=r"device.*choose"):
        fd.sweep(file, {"sheet.density": [1.0]}, measures=["frequency"], device="tpu")
    monkeypatch.setattr(checks, "no_card", lambda: "")
    file.write_text(MOTION)
    with pytest.raises(InputError, match="leave scheduler out"):
        fd.sweep(
            file, {"sheet.density": [1.0]}, measures=["largest_displacement"], device="gpu",
            scheduler="tcp://x:1",
        )  # fmt: skip


def test_few_or_short_motions_stay_on_the_cpu(monkeypatch):
    motion = prepare(sheet(**LUMPED), 1.0, "central_difference")
    reason = {count: choice.choose([motion], count, 2)[1] for count in (4, 1000)}
    assert reason[4] == "a GPU pays from 10 models on"
    assert "s on a GPU" in reason[1000]
    monkeypatch.setattr(choice, "COMPILING", 0.0)
    monkeypatch.setattr(choice, "no_card", lambda: "no GPU is here; buy one")
    assert choice.choose([motion], 1000, 2) == ("cpu", "no GPU is here")
    monkeypatch.setattr(choice, "no_card", lambda: "")
    assert choice.choose([motion], 1000, 2)[0] == "gpu"
    for other, why in ((REFUSED["the term "](), "the term "), (PLATES(), "plates")):
        device, reason = choice.choose([prepare(other, 1.0, "central_difference")], 1000, 2)
        assert device == "cpu" and why in reason
    monkeypatch.setattr(choice, "LARGEST", 30)
    assert choice.choose([motion], 1000, 2)[1].startswith("models of more than 30 dofs")


def test_superposed_modes_and_releases_stay_on_the_cpu():
    panel = fd.Pattern(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), [[0, 1, 2]])
    cases = {
        "modal": fd.Case(fd.superelements(panel, SHEET, divisions=4)),
        "a motion with releases": sheet(**LUMPED).altered(supports=[fd.Fix("xmin", until=0.5)]),
    }
    for name, case in cases.items():
        motion = prepared(case, 1.0, interval=0.1)
        assert choice.choose([motion], 1000, 2) == ("cpu", f"{name} has no GPU kernel")
        assert SideBySide(None, motion).count == AT_ONCE


def test_a_method_without_kernels_is_named():
    with pytest.raises(InputError, match="newmark has no GPU kernel; choose one of rk4"):
        fd.simulate(sheet(), 1e-3, method="newmark", device="gpu")
    with pytest.raises(InputError, match=r"device.*choose"):
        fd.simulate(sheet(), 1e-3, method="rk4", device="tpu")


def test_without_a_package_or_a_card(monkeypatch):
    why = "not installed"
    if importlib.util.find_spec("numba_cuda") is not None:
        monkeypatch.setattr("numba.cuda.is_available", lambda: False)
        why = "no NVIDIA GPU"
    with pytest.raises(InputError, match=why):
        fd.simulate(sheet(), 1e-3, method="rk4", device="gpu")


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
