"""Motions that are kept on the disk: killed, resumed, larger than memory, on a full disk."""

from __future__ import annotations

import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from long_cases import same, sheet, simulated

import foldyn as fd
from foldyn.dynamics import METHODS, motion, output
from foldyn.dynamics.checkpoint import CHECKPOINT
from foldyn.errors import ComputationError, InputError, MotionInterrupted
from foldyn.results import columns, netcdf

OFTEN = 1e-9  # seconds: a checkpoint whenever there is an opportunity


class Killed(BaseException):
    """What ends a run without a word."""


@pytest.fixture(autouse=True)
def short_stretches(monkeypatch):
    """Look after every few steps; what the processor does is not waited for on the disk."""
    monkeypatch.setattr(os, "fsync", lambda _: None)
    monkeypatch.setattr(motion, "CHUNK", 16)
    monkeypatch.setattr(motion, "REPORT_EVERY", 0.0)


def in_pieces(file: Path, calls: int, name: str, **options):
    """The motion, killed at every `calls` looks and resumed; how often it was killed."""
    kills = 0
    while True:
        left = [calls]

        def look(_, left=left):
            left[0] -= 1
            if left[0] < 0:
                raise Killed

        try:
            found = simulated(
                name, **options, store=file, checkpoint=OFTEN, resume=True, progress=look
            )
        except Killed:
            kills += 1
            continue
        return found, kills


def cut_off(**options):
    """The motion of the sheet, killed half-way."""

    def stop(now):
        if now.time > 0.5:
            raise Killed

    with pytest.raises(Killed):
        simulated("sheet", **options, progress=stop)


KINDS = {  # name of the case, its arguments, and what of the methods
    "sheet": (METHODS, {"duration": 1.0, "every": 0.01}),
    "steps": (["dormand_prince", "newmark"], {"duration": 1.0, "every": 3}),
    "fixed": (["newmark", "energy_momentum"], {"duration": 1.0, "every": 0.02, "dt": 0.005}),
    "actuated": (["rk4", "generalized_alpha"], {"duration": 0.6, "every": 0.01}),
    "creeping": (
        ["rk4", "dormand_prince", "generalized_alpha"],
        {"duration": 1.0, "every": 0.01, "dt": 0.002},
    ),
    "sliding": (["newmark", "energy_momentum"], {"duration": 0.02, "every": 0.001}),
    "touching": (["dormand_prince"], {"duration": 0.24, "every": 0.01}),
}
RUNS = [(kind, method) for kind, (methods, _) in KINDS.items() for method in methods]


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
@pytest.mark.parametrize(("kind", "method"), RUNS)
def test_a_run_that_is_killed_again_and_again_gives_the_same_bits(tmp_path, kind, method):
    options = {"method": method, **KINDS[kind][1]}
    name = "sheet" if kind in ("steps", "fixed") else kind
    whole = simulated(name, **options)
    calls = 6 if METHODS[method].implicit else 3
    found, kills = in_pieces(tmp_path / "run.nc", calls, name, **options)
    assert kills >= 3
    same(found, whole)
    assert os.listdir(tmp_path) == ["run.nc"]


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_what_the_user_samples_goes_on_too(tmp_path):
    def tip(u, v, t):
        return u[7] * t

    sample = {"tip": fd.Quantity("m s", "something", ("axis",), tip)}
    options = {"duration": 1.0, "every": 0.01, "sample": sample}
    found, kills = in_pieces(tmp_path / "run.nc", 3, "sheet", **options)
    assert kills >= 1
    same(found, simulated("sheet", **options))


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
@pytest.mark.parametrize("method", ["rk4", "dormand_prince", "newmark"])
@pytest.mark.parametrize("every", [0.004, 1])
def test_samples_that_memory_does_not_hold_are_the_same(tmp_path, monkeypatch, method, every):
    """Room for some sixteen; the file is written and read in pieces as well."""
    whole = simulated("sheet", duration=0.8, every=every, method=method)
    for module in (columns, output, netcdf):
        monkeypatch.setattr(module, "PIECE", 4000)
    monkeypatch.setattr(netcdf, "CHUNK", 3000)
    file = tmp_path / "run.nc"
    found = simulated("sheet", duration=0.8, every=every, method=method, store=file)
    same(found, whole)
    same(fd.load(file), whole)
    at_a_time = fd.load(file, whole=False).displacement[5:9, 3]
    np.testing.assert_array_equal(at_a_time, whole.displacement[5:9, 3])
    assert os.listdir(tmp_path) == ["run.nc"]


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_a_motion_goes_on_only_as_it_was_begun(tmp_path):
    options = {"duration": 1.0, "every": 0.01, "store": tmp_path / "run.nc", "checkpoint": OFTEN}
    cut_off(**options)
    thrown = np.zeros((13, 3))
    thrown[8, 2] = 0.1
    for changes, name in [
        ({"changes": {"thickness": 0.02}}, r"sheet\.thickness = 0\.01, which is 0\.02 now"),
        ({"changes": {"force": 0.06}}, r"loads\[0\]\.force = \[0\.05, 0\.0, 0\.0\]"),
        ({"method": "central_difference"}, 'method = "rk4"'),
        ({"duration": 2.0}, r"duration = 1\.0, which is 2\.0 now"),
        ({"every": 4}, "every"),
        ({"sample": {"own": lambda u, v, t: 0.0}}, r"sample = \[\]"),
        ({"initial": fd.State(velocity=thrown)}, "initial"),
    ]:
        with pytest.raises(InputError, match=rf"was begun with .*{name}"):
            simulated("sheet", **{**options, **changes}, resume=True)
    with pytest.raises(InputError, match=r"up to t = 0\.\d+ s: go on with it by resume=True"):
        simulated("sheet", **options)
    found = simulated("sheet", **options, resume=True)
    del options["store"], options["checkpoint"]
    same(found, simulated("sheet", **options))


def test_another_program_does_not_go_on(tmp_path, monkeypatch):
    options = {"duration": 1.0, "every": 0.01, "store": tmp_path / "run.nc", "checkpoint": OFTEN}
    cut_off(**options)
    monkeypatch.setattr("foldyn.dynamics.checkpoint.program", lambda *_: "another")
    with pytest.raises(InputError, match="was begun with the version of Foldyn"):
        simulated("sheet", **options, resume=True)


def test_a_finished_motion_is_only_read(tmp_path):
    options = {"duration": 0.2, "every": 0.01, "store": tmp_path / "run.nc", "resume": True}
    first = simulated("sheet", **options)
    looked = []
    again = simulated("sheet", **options, progress=looked.append)
    assert not looked
    same(first, again)
    assert again.attrs["wall_seconds"] == first.attrs["wall_seconds"]
    simulated("sheet", {"force": 0.06}, **options, progress=looked.append)
    assert looked


def test_ctrl_c_says_what_is_kept(tmp_path):
    options = {"duration": 1.0, "every": 0.01, "store": tmp_path / "run.nc", "checkpoint": OFTEN}

    def stop(now):
        if now.time > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(
        MotionInterrupted, match=r"keeps it up to t = 0\.\d+ s: go on by"
    ) as stopped:
        simulated("sheet", **options, progress=stop)
    whole = simulated("sheet", duration=1.0, every=0.01)
    there = stopped.value.partial
    assert there.sizes["time"] > 50
    np.testing.assert_array_equal(there.displacement, whole.displacement[: there.sizes["time"]])
    same(simulated("sheet", **options, resume=True), whole)


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_a_motion_that_fails_is_stored_until_then(tmp_path):
    file = tmp_path / "run.nc"
    with pytest.raises(ComputationError) as failed:
        simulated(
            "sheet", duration=4.0, every=1, dt=0.0175, force=True, store=file, checkpoint=OFTEN
        )
    with pytest.raises(ComputationError) as wanted:
        simulated("sheet", duration=4.0, every=1, dt=0.0175, force=True)
    assert str(failed.value) == str(wanted.value)
    same(failed.value.partial, wanted.value.partial, ("stopped_because",))
    assert "stopped_because" in fd.load(file).attrs
    assert os.listdir(tmp_path) == ["run.nc"]


def test_bad_arguments_are_refused_before_anything_is_computed(tmp_path):
    for given, text in [
        ({"store": tmp_path / "run.csv"}, "only NetCDF"),
        ({"store": tmp_path / "none" / "run.nc"}, "does not exist"),
        ({"store": 3}, "store = 3"),
        ({"store": tmp_path / "run.nc", "checkpoint": 0.0}, "checkpoint"),
        ({"store": tmp_path / "run.nc", "resume": 1}, "resume = 1"),
        ({"resume": True}, "store: there is nothing to go on with"),
    ]:
        with pytest.raises(InputError, match=text):
            fd.simulate(sheet(), 0.2, every=0.01, **given)


def test_what_is_damaged_is_refused(tmp_path):
    options = {"duration": 1.0, "every": 0.01, "store": tmp_path / "run.nc", "checkpoint": OFTEN}
    cut_off(**options)
    folder = tmp_path / "run.nc.unfinished"
    content = (folder / "velocity.f8").read_bytes()
    (folder / "velocity.f8").write_bytes(content[:-100])
    with pytest.raises(
        InputError, match=r"velocity\.f8: is damaged: samples .* are missing or have changed"
    ):
        simulated("sheet", **options, resume=True)
    changed = np.frombuffer(content).copy()
    changed[len(changed) // 3] += 0.4
    (folder / "velocity.f8").write_bytes(changed.tobytes())
    with pytest.raises(InputError, match=r"velocity\.f8: is damaged"):
        simulated("sheet", **options, resume=True)
    (folder / "velocity.f8").write_bytes(content)
    checkpoint = (folder / CHECKPOINT).read_bytes()
    (folder / CHECKPOINT).write_bytes(checkpoint[: len(checkpoint) // 2])
    with pytest.raises(InputError, match=r"is damaged, or .*; remove that folder to begin anew"):
        simulated("sheet", **options, resume=True)


def test_samples_that_change_while_it_runs_do_not_become_a_result(tmp_path):
    file = tmp_path / "run.nc"

    def harm(now):
        if now.time > 0.9:
            with (tmp_path / "run.nc.unfinished" / "displacement.f8").open("r+b") as samples:
                samples.seek(5000)
                samples.write(b"wrong")

    with pytest.raises(ComputationError, match=r"displacement\.f8: was changed"):
        simulated("sheet", duration=1.0, every=0.01, store=file, checkpoint=OFTEN, progress=harm)
    assert not file.exists()


# ------------------------------------------------------------------ processes
TESTS = Path(__file__).resolve().parents[1]
LONG = {"name": "sheet", "duration": 200.0, "every": 0.05, "checkpoint": 0.02}


def started(options, limit=None):
    """The run in a process of its own."""

    def limited():
        if limit:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    paths = [str(TESTS), str(TESTS / "dynamics"), *filter(None, [os.environ.get("PYTHONPATH")])]
    script = str(TESTS / "dynamics" / "long_cases.py")
    return subprocess.Popen(
        [sys.executable, "-W", "ignore", script, json.dumps(options)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)}, preexec_fn=limited,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def refused(other: int, options) -> None:
    """Another process that writes there is named."""
    with pytest.raises(InputError, match=rf"run\.nc: is being written by process {other} on"):
        simulated(**options)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_sigkill_at_random_moments_with_a_second_process(tmp_path):
    file, chance = tmp_path / "run.nc", random.Random(3)
    options = {**LONG, "store": str(file), "resume": True}
    checkpoint = tmp_path / "run.nc.unfinished" / CHECKPOINT
    killed, reached = 0, [0.0]
    while killed < 3:
        process = started(options)
        made = set()  # so far, the one before among them
        while process.poll() is None:
            if checkpoint.exists():
                made.add(checkpoint.stat().st_mtime_ns)
            if len(made) > 3:
                if not killed:
                    process.send_signal(signal.SIGSTOP)  # in the midst of it, as long as it takes
                    for resume in (True, False):
                        refused(process.pid, {**LONG, "store": file, "resume": resume})
                    process.send_signal(signal.SIGCONT)
                time.sleep(chance.uniform(0.0, 0.1))  # some more, and one may be being made
                process.send_signal(signal.SIGKILL)
                break
            time.sleep(0.002)
        assert process.wait() == -signal.SIGKILL, process.stderr.read()
        killed += 1
        with np.load(checkpoint) as kept:
            reached.append(json.loads(kept["about"].tobytes())["reached"])
    assert all(np.diff(reached) > 0.0)
    process = started(options)
    assert process.wait() == 0, process.stderr.read()
    whole = simulated("sheet", duration=LONG["duration"], every=LONG["every"])
    same(fd.load(file), whole)


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_a_full_disk_keeps_the_last_checkpoint_and_says_so(tmp_path):
    """No file may be larger than some number of bytes, as where there is no room."""
    options = {**LONG, "store": str(tmp_path / "run.nc"), "duration": 50.0}
    process = started(options, limit=150_000)
    said = process.communicate()[1]
    assert process.returncode == 1
    assert "ComputationError" in said
    assert "cannot be written (File too large): make room" in said
    assert "keeps it up to t = " in said
    found = simulated(**{**options, "resume": True})
    same(found, simulated("sheet", duration=50.0, every=LONG["every"]))


def test_a_disk_that_is_full_from_the_beginning(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(columns.Columns, "append", full)
    with pytest.raises(ComputationError, match=r"No space left on device.*nothing of the motion"):
        simulated("sheet", duration=1.0, store=tmp_path / "run.nc", checkpoint=OFTEN)


@pytest.mark.matrix
def test_memory_does_not_grow_with_the_length(tmp_path):
    """A run 20 times longer takes at most 5 % more memory at its peak."""
    peaks = []
    for k, duration in enumerate((20.0, 400.0)):
        options = {**LONG, "checkpoint": 5.0, "every": 0.005, "duration": duration}
        process = started({**options, "store": str(tmp_path / f"{k}.nc")})
        _, status, used = os.wait4(process.pid, 0)
        assert status == 0
        peaks.append(used.ru_maxrss)
    assert peaks[1] < 1.05 * peaks[0]
