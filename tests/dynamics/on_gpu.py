"""The kernels of the GPU against the CPU: run by `test_gpu` in Numba's CUDA simulator.

On a machine with a GPU, ``python -m pytest tests/dynamics/on_gpu.py`` runs them on the card.
"""

from __future__ import annotations

import os
from dataclasses import replace
from itertools import cycle

import numpy as np
import pytest
from measured import agree

import foldyn as fd
from foldyn.dynamics.driver import prepare
from foldyn.dynamics.gpu import choice
from foldyn.dynamics.gpu.checks import METHODS, lacking
from foldyn.errors import ComputationError, FoldynWarning, InputError, MotionInterrupted
from named_models import named

STEPS, END = {"dt": 1e-5, "every_steps": 2}, 4e-5
SOME = ["central_difference"] if os.environ.get("NUMBA_ENABLE_CUDASIM") == "1" else METHODS
"""Methods of most tests: the simulator, which is slow, has the one of fewer force evaluations."""
LAWS = {
    "enhanced": (fd.EnhancedLinear(), fd.EnhancedLinear()),
    "locking": (fd.EnhancedLinear(120, 240, rest="as_published"), "superlinear"),
    "plate": (fd.PlateSuperlinear(2.0), fd.PlateSuperlinear(1.0)),
    "linear": ("linear", "linear"),
}


CASE_FILE = """
[pattern]
kind = "miura"
cells = [1, 1]
panel_angle = 60
dihedral = 110
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
[model]
preset = "plate"
mass = "mixed_voronoi"
[[supports]]
nodes = [0, 1, 2]
[[loads]]
nodes = [6]
force = [0, 0, -1e-3]
[analysis]
kind = "dynamics"
method = "central_difference"
duration = 2e-3
[output]
interval = 2e-4
"""


def case(
    k: int = 0, laws: str = "enhanced", damping=None, supports=(), welds: int = 0, **options
) -> fd.Case:  # fmt: skip
    """A cell, whose geometry, stiffness, mass, loads and damping go by the number."""
    pattern = fd.patterns.miura((1, 1), panel_angle=60.0, dihedral=110.0 + 2 * k)
    if welds:
        plain = dict.fromkeys(("assignments", "families", "fold_angles"))
        pattern = pattern.changed(welds=pattern.creases[:welds], **plain)
    material = fd.Sheet(1e6 * (1.0 + 0.1 * k), 0.25, 0.01, density=1.0 + 0.05 * k)
    fold, bend = LAWS[laws]
    given = {"mass": "mixed_voronoi", "fold_law": fold, "bend_law": bend, **options}
    x = pattern.vertices[:, 0]
    held, far = np.flatnonzero(x <= 1e-9), np.flatnonzero(x >= x.max() - 1e-9)
    loads = [fd.Force(far, (0, 0, -2e-3 * (k + 1)), fd.HalfSine(2e-4 * (1 + k)))]
    if k % 2:
        loads += [fd.Gravity((0, 0, -9.81)), fd.Force(far[:1], (1e-3, 0, 0), lambda t: 1 + t)]
    structure = fd.discretize(pattern, material, **named(given))
    return fd.Case(structure, [fd.Fix(held), *supports], loads, damping or fd.Rayleigh(0.2 * k))


def shaken(of: fd.Case, seed: int = 0) -> fd.State:
    """A state at random."""
    return fd.State(1e-4 * np.random.default_rng(seed).standard_normal(of.fixed.shape) * ~of.fixed)


SPRINGS = [
    fd.Spring(3.0, nodes=[7, 8]), fd.Spring(7.0, nodes=[5], direction=(1, 2, -1)),
    fd.Spring(4.0, between=[(3, 7)]), fd.Spring(2.0, between=[(4, 8)], rest_length=0.4),
    fd.Bar((3, 8), 0.5), fd.Bar((6, 8), 0.5, law="ogden", rest_length=0.9),
    fd.Bar((5, 7), 0.5, law="linear", rest_length=0.9),
]  # fmt: skip
DASHPOTS = [
    fd.Dashpot(0.01, nodes=[7]), fd.Dashpot(0.02, nodes=[8], direction="x"),
    fd.Dashpot(0.005, between=[(4, 8)]),
]  # fmt: skip
CREASES = [fd.Rayleigh(0.1), fd.CreaseDamping(1e-5, "mountain"), fd.CreaseDamping(2e-5, "valley")]
CASES = {
    **{laws: {"laws": laws} for laws in LAWS},
    "springs": {"supports": SPRINGS},
    "dampers": {"supports": DASHPOTS, "damping": CREASES, "preset": "merlin2"},
    "stiffness": {"damping": fd.Rayleigh(0.3, 1e-6), "supports": [*SPRINGS, *DASHPOTS]},
    "bars": {"preset": "herkal"},
    "bars of another law": {"preset": "merlin2", "laws": "locking", "bar_law": "linear"},
}


PLATES = {"preset": "n5b8e", "bend_law": "linear"}
OF_PLATES = {
    "held": {},
    "clamped": {"clamped": [(0, 1)], "damping": fd.Rayleigh(0.3, 1e-6)},
    "damped": {"damping": CREASES, "supports": [*SPRINGS, *DASHPOTS], "laws": "plate"},
    "bars": {"membrane": "bars", "laws": "locking"},
    "welded": {"welds": 1},
}
PAIRS = [*zip(OF_PLATES, cycle(METHODS), strict=False), ("clamped", "rk4")]


@pytest.mark.parametrize(("name", "method"), [*zip(CASES, cycle(METHODS), strict=False)])
def test_a_motion_is_that_of_the_cpu(method, name):
    each = case(1, **CASES[name])
    assert not lacking(each, prepare(each, END, **STEPS).packed)
    given = {"method": method, "initial": shaken(each), **STEPS}
    mine = fd.simulate(each, END, device="gpu", **given)
    alone = fd.simulate(each, END, **given)
    agree(mine, alone, 1e-9)
    np.testing.assert_allclose(mine.displacement, alone.displacement, rtol=0, atol=1e-16)
    assert mine.attrs["energy_error"] == pytest.approx(
        alone.attrs["energy_error"], rel=1e-6, abs=1e-10
    )
    assert mine.attrs["force_evaluations"] == alone.attrs["force_evaluations"]
    assert mine.attrs["device"]


@pytest.mark.filterwarnings("ignore::foldyn.errors.StretchWarning")
@pytest.mark.parametrize(("name", "method"), PAIRS)
def test_a_motion_of_plates_is_that_of_the_cpu(method, name):
    each = case(1, **PLATES | OF_PLATES[name])
    given = {"method": method, "initial": shaken(each), **STEPS}
    mine, again = (fd.simulate(each, END, device="gpu", **given) for _ in range(2))
    alone = fd.simulate(each, END, **given)
    agree(mine, alone, 1e-11)  # energies of creases are differences of small angles
    gap = np.abs(mine.displacement - alone.displacement).max()
    assert gap <= 1e-12 * np.abs(alone.displacement).max()
    stored = [sum(each[n] for n in each if str(n).startswith("strain")) for each in (mine, alone)]
    np.testing.assert_allclose(*stored, rtol=1e-12)
    assert all(mine[name].equals(again[name]) for name in mine.data_vars)


def test_a_motion_of_plates_goes_on_with_their_edge_angles():
    each = case(1, **PLATES)
    given = {"method": "central_difference", "device": "gpu", **STEPS}
    begun = fd.simulate(each, END, initial=shaken(each), **given)
    alone = fd.simulate(each, END, initial=shaken(each), **(given | {"device": "cpu"}))
    gap = np.abs(begun.continuation - alone.continuation).max()
    assert gap <= 1e-12 * np.abs(alone.continuation).max()


@pytest.mark.parametrize("options", [{}, PLATES])
@pytest.mark.parametrize("method", SOME)
def test_many_are_those_of_the_cpu(method, options):
    cases = [case(k, **options) for k in range(2)]
    given = {"method": method, "initial": [shaken(c, k) for k, c in enumerate(cases)], **STEPS}
    mine = fd.simulate_many(cases, END, device="gpu", **given)
    agree(mine, fd.simulate_many(cases, END, **given), 1e-9)
    again = fd.simulate_many(cases, END, device="gpu", **given)
    assert all(mine[name].equals(again[name]) for name in mine.data_vars)


@pytest.mark.parametrize("method", SOME)
def test_samples_do_not_depend_on_the_pieces(monkeypatch, method):
    each = case(1)
    given = {"initial": shaken(each), "device": "gpu", **STEPS}
    whole = fd.simulate(each, END, method=method, **given)
    monkeypatch.setattr("foldyn.dynamics.gpu.engine.Launches.fits", lambda *_: np.array([3]))
    agree(fd.simulate(each, END, method=method, **given), whole, 0.0)
    agree(fd.simulate_many([each], END, method=method, **given).isel(model=0), whole, 1e-12)


@pytest.mark.parametrize("method", SOME)
def test_motions_side_by_side_have_steps_of_their_own(monkeypatch, method):
    from foldyn.dynamics.gpu.many import integrate_prepared  # no import where there is no GPU

    monkeypatch.setattr("foldyn.dynamics.gpu.engine.Launches.fits", lambda self: 2 * self._every)
    motions, alone = [], []
    for k, (dt, every) in enumerate(((1e-5, 2), (2.5e-5, 1), (5e-6, 3))):
        given = {"method": method, "dt": dt, "every_steps": every, "initial": shaken(case(k), k)}
        motions.append(prepare(case(k), 5e-5, **given))
        alone.append(fd.simulate(case(k), 5e-5, **given))
    motions.append(prepare(case(), 5e-5, "dormand_prince"))
    assert integrate_prepared(motions) == {0, 1, 2}
    for motion, other in zip(motions[:3], alone, strict=True):
        mine = motion.result()
        agree(mine, other, 1e-9)
        np.testing.assert_array_equal(mine.time, other.time)
        assert mine.attrs["device"]
        assert mine.attrs["force_evaluations"] == other.attrs["force_evaluations"]


def test_a_sweep_on_a_gpu_is_that_of_the_cpu(tmp_path, monkeypatch):
    file = tmp_path / "case.toml"
    file.write_text(CASE_FILE)
    vary, given = {"sheet.youngs_modulus": [1e6, 2e6]}, {"processes": 1}
    vary["model.fold_law"] = ["enhanced", "linear"]  # a kernel for each kind
    alone = fd.sweep(file, vary, measures=["largest_displacement"], device="cpu", **given)
    monkeypatch.setattr(choice, "FEWEST", 4)
    monkeypatch.setattr(choice, "COMPILING", 0.0)
    monkeypatch.setattr(choice, "EVALUATION", 1.0)
    mine = fd.sweep(file, vary, measures=["largest_displacement"], **given)
    assert alone.attrs["device"] == "cpu" != mine.attrs["device"]
    assert "s on a GPU" in mine.attrs["device_reason"]
    assert not mine.attrs["failed"]
    np.testing.assert_allclose(mine.largest_displacement, alone.largest_displacement, rtol=1e-9)
    few = fd.sweep(file, {"sheet.density": [1.0, 2.0]}, measures=["largest_displacement"], **given)
    assert few.attrs["device"] == "cpu"
    assert few.attrs["device_reason"] == "a GPU pays from 4 models on"
    same = fd.simulate_many([case(), case(2)] * 2, END, method="rk4", **STEPS)
    assert same.attrs["device"] == mine.attrs["device"]


def test_what_goes_wrong_is_told_as_by_the_cpu():
    each = case()
    each = replace(each, loads=[])
    given = {"dt": 1e-3, "every_steps": 5, "force": True, "initial": shaken(each)}
    given["method"] = "central_difference"
    with pytest.raises(ComputationError) as mine:
        fd.simulate(each, 0.03, device="gpu", **given)
    with pytest.raises(ComputationError) as alone:
        fd.simulate(each, 0.03, **given)
    assert str(mine.value) == str(alone.value)
    with pytest.warns(FoldynWarning, match="1 of 1 motions ended"):
        many = fd.simulate_many([each], 0.03, device="gpu", **given)
    assert str(many.outcome[0].values) == str(alone.value)


@pytest.mark.parametrize("method", SOME)
def test_an_engine_goes_on_from_a_checkpoint(method):
    each = case(1)
    ends = []
    for stops in ((5,), (2, 5)):
        motion = prepare(each, 5e-5, method, initial=shaken(each), device="gpu", **STEPS)
        motion.output.begin()
        kept = {}
        for stop in stops:
            engine = motion.method.engine(each, motion.packed, motion.state, motion.plan, "gpu")
            if kept:
                engine.resume_from(kept)
            engine.advance(motion.output.window, stop - int(motion.state.tally.steps))
            kept = engine.checkpoint_arrays()
        ends.append(kept)
    for name, array in ends[0].items():
        np.testing.assert_array_equal(ends[1][name], array, err_msg=name)


def test_a_motion_that_was_cut_off_goes_on(tmp_path, monkeypatch):
    each = case(1)
    monkeypatch.setattr("foldyn.dynamics.motion.CHUNK", 2)
    monkeypatch.setattr("foldyn.dynamics.motion.REPORT_EVERY", 0.0)
    given = {"initial": shaken(each), "device": "gpu", "method": "central_difference", **STEPS}
    whole = fd.simulate(each, END, **given)

    def cut(progress):
        if progress.steps:
            raise KeyboardInterrupt

    kept = {"store": tmp_path / "run.nc", "checkpoint": 1e-9}
    with pytest.raises(MotionInterrupted):
        fd.simulate(each, END, progress=cut, **given, **kept)
    with pytest.raises(InputError, match="device"):
        fd.simulate(each, END, **(given | {"device": "cpu"}), **kept, resume=True)
    agree(fd.simulate(each, END, **given, **kept, resume=True), whole, 0.0)
