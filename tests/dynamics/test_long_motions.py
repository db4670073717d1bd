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
from long_cases import Killed, look_often, same, sheet, simulated

import foldyn as fd
from foldyn.dynamics import METHODS, output
from foldyn.dynamics.checkpoint import CHECKPOINT
from foldyn.errors import ComputationError, InputError, MotionInterrupted
from foldyn.results import columns, netcdf
from pairwise import beyond

OFTEN = 1e-9  # seconds: a checkpoint whenever there is an opportunity
SECOND = {"duration": 1.0, "interval": 0.01}
pytestmark = pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")


@pytest.fixture(autouse=True)
def short_stretches(monkeypatch):
    look_often(monkeypatch)


@pytest.fixture
def kept(tmp_path) -> dict:
    """Arguments of a motion of a second that is kept."""
    return {**SECOND, "store": tmp_path / "run.nc", "checkpoint": OFTEN}


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
            given = options | {"store": file, "checkpoint": OFTEN, "resume": True}
            return simulated(name, **given, progress=look), kills
        except Killed:
            kills += 1


def cut_off(error=Killed, **options):
    """The motion of the sheet, stopped half-way."""

    def stop(now):
        if now.time > 0.5:
            raise error

    simulated("sheet", **options, progress=stop)


@pytest.fixture
def begun(kept) -> dict:
    """Arguments of one that was killed."""
    with pytest.raises(Killed):
        cut_off(**kept)
    return kept


KINDS = {  # name of the case, its arguments, and what of the methods
    "sheet": (METHODS, SECOND),
    "steps": (["dormand_prince"], {"duration": 1.0, "every_steps": 3}),
    "fixed": (["newmark"], {"duration": 1.0, "interval": 0.02, "dt": 0.005}),
    "actuated": (["rk4", "generalized_alpha"], {"duration": 0.6, "interval": 0.01}),
    "blown": (["rk4", "dormand_prince"], {"duration": 1.2, "interval": 0.02}),
    "creeping": (["dormand_prince", "generalized_alpha"], {**SECOND, "dt": 0.002}),
    "warmed": (["rk4"], {"duration": 0.5, "interval": 0.01}),
    "sliding": (["energy_momentum"], {"duration": 0.01, "interval": 0.001}),
}
RUNS = [(kind, method) for kind, (methods, _) in KINDS.items() for method in methods]


@pytest.mark.parametrize(("kind", "method"), beyond(RUNS[::-1], 4))
def test_a_run_that_is_killed_again_and_again_gives_the_same_bits(tmp_path, kind, method):
    options = {"method": method, **KINDS[kind][1]}
    name = "sheet" if kind in ("steps", "fixed") else kind
    whole = simulated(name, **options)
    calls = 40 if METHODS[method].implicit else 3
    found, kills = in_pieces(tmp_path / "run.nc", calls, name, **options)
    assert kills >= 3
    same(found, whole)
    assert os.listdir(tmp_path) == ["run.nc"]


@pytest.mark.matrix
def test_what_the_user_samples_goes_on_too(tmp_path):
    tip = fd.Quantity("m s", "something", ("axis",), lambda u, v, t: u[7] * t)
    options = {**SECOND, "sample": {"tip": tip}}
    found, kills = in_pieces(tmp_path / "run.nc", 3, "sheet", **options)
    assert kills >= 1
    same(found, simulated("sheet", **options))


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("method", "kept"),
    [
        ("rk4", {"interval": 0.004}), ("dormand_prince", {"every_steps": 1}),
        ("newmark", {"interval": 0.004}),
        *beyond([("rk4", {"every_steps": 1}), ("dormand_prince", {"interval": 0.004})]),
    ],
)  # fmt: skip
def test_samples_that_memory_does_not_hold_are_the_same(tmp_path, monkeypatch, method, kept):
    """Room for some sixteen; the file is written and read in pieces as well."""
    options = {"duration": 0.8, **kept, "method": method}
    whole = simulated("sheet", **options)
    for module in (columns, output, netcdf):
        monkeypatch.setattr(module, "PIECE", 4000)
    monkeypatch.setattr(netcdf, "CHUNK", 3000)
    file = tmp_path / "run.nc"
    same(simulated("sheet", **options, store=file), whole)
    same(fd.load(file), whole)
    at_a_time = fd.load(file, whole=False).displacement[5:9, 3]
    np.testing.assert_array_equal(at_a_time, whole.displacement[5:9, 3])
    assert os.listdir(tmp_path) == ["run.nc"]


THROWN = fd.State(velocity=0.1 * np.outer(np.arange(13) == 8, [0.0, 0.0, 1.0]))


@pytest.mark.matrix
def test_a_motion_goes_on_only_as_it_was_begun(begun, monkeypatch):
    for changes, name in [
        ({"changes": {"thickness": 0.02}}, r"sheet\.thickness = 0\.01, which is 0\.02 now"),
        ({"changes": {"force": 0.06}}, r"loads\[0\]\.force = \[0\.05, 0\.0, 0\.0\]"),
        ({"method": "central_difference"}, 'method = "rk4"'),
        ({"duration": 2.0}, r"duration = 1\.0, which is 2\.0 now"),
        ({"interval": 0.02}, r"interval = 0\.01, which is 0\.02 now"),
        ({"sample": {"own": lambda u, v, t: 0.0}}, r"sample = \[\]"),
        ({"initial": THROWN}, "initial"),
    ]:
        with pytest.raises(InputError, match=rf"was begun with .*{name}"):
            simulated("sheet", **{**begun, **changes}, resume=True)
    with pytest.raises(InputError, match=r"up to t = 0\.\d+ s: continue it by resume=True"):
        simulated("sheet", **begun)
    with monkeypatch.context() as patch:
        patch.setattr("foldyn.dynamics.checkpoint.program", lambda *_: "another")
        with pytest.raises(InputError, match="was begun with the version of Foldyn"):
            simulated("sheet", **begun, resume=True)
    same(simulated("sheet", **begun, resume=True), simulated("sheet", **SECOND))


@pytest.mark.matrix
def test_a_finished_motion_is_only_read(kept):
    first, looked = simulated("sheet", **kept, resume=True), []
    again = simulated("sheet", **kept, resume=True, progress=looked.append)
    assert not looked
    same(first, again)
    assert again.attrs["wall_seconds"] == first.attrs["wall_seconds"]
    simulated("sheet", {"force": 0.06}, **kept, resume=True, progress=looked.append)
    assert looked


@pytest.mark.matrix
def test_ctrl_c_says_what_is_kept(kept):
    said = r"keeps it up to t = 0\.\d+ s: continue it by"
    with pytest.raises(MotionInterrupted, match=said) as stopped:
        cut_off(KeyboardInterrupt, **kept)
    whole = simulated("sheet", **SECOND)
    there = stopped.value.partial
    assert there.sizes["time"] > 50
    np.testing.assert_array_equal(there.displacement, whole.displacement[: there.sizes["time"]])
    same(simulated("sheet", **kept, resume=True), whole)


@pytest.mark.matrix
def test_a_motion_that_fails_is_stored_until_then(kept, tmp_path):
    wild = {"duration": 4.0, "every_steps": 1, "interval": None, "dt": 0.0175, "force": True}
    failed = []
    for given in (kept | wild, wild):
        with pytest.raises(ComputationError) as error:
            simulated("sheet", **given)
        failed.append(error.value)
    assert str(failed[0]) == str(failed[1])
    same(failed[0].partial, failed[1].partial, ("stopped_because",))
    assert "stopped_because" in fd.load(kept["store"]).attrs
    assert os.listdir(tmp_path) == ["run.nc"]


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"store": "run.csv"}, "only NetCDF"),
        ({"store": "none/run.nc"}, "does not exist"),
        ({"store": 3}, "store = 3"),
        ({"store": "run.nc", "checkpoint": 0.0}, "checkpoint"),
        ({"store": "run.nc", "resume": 1}, "resume = 1"),
        ({"resume": True}, "store: there is nothing to resume"),
    ],
)
def test_bad_arguments_are_refused_before_anything_is_computed(given, text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=text):
        fd.simulate(sheet(), 0.2, interval=0.01, **given)


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("velocity.f8", lambda raw: raw[:-100], r"samples .* are missing or have changed"),
        ("velocity.f8", lambda raw: raw[:9000] + b"else" + raw[9004:], ""),
        (CHECKPOINT, lambda raw: raw[: len(raw) // 2], "remove that folder to start again"),
    ],
)
def test_what_is_damaged_is_refused(name, change, said, begun, tmp_path):
    file = tmp_path / "run.nc.unfinished" / name
    file.write_bytes(change(file.read_bytes()))
    with pytest.raises(InputError, match=rf"{file.name}.*is damaged.*{said}"):
        simulated("sheet", **begun, resume=True)


def test_samples_that_change_while_it_runs_do_not_become_a_result(kept, tmp_path):
    def harm(now):
        if now.time > 0.9:
            with (tmp_path / "run.nc.unfinished" / "displacement.f8").open("r+b") as samples:
                samples.seek(5000)
                samples.write(b"wrong")

    with pytest.raises(ComputationError, match=r"displacement\.f8: was changed"):
        simulated("sheet", **kept, progress=harm)
    assert not kept["store"].exists()


# ------------------------------------------------------------------ processes
TESTS = Path(__file__).resolve().parents[1]
LONG = {"name": "sheet", "duration": 100.0, "interval": 0.05, "checkpoint": 0.02}


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
def test_sigkill_at_random_moments_with_a_second_process(tmp_path):
    file, chance = tmp_path / "run.nc", random.Random(3)
    options = {**LONG, "store": str(file), "resume": True}
    checkpoint = tmp_path / "run.nc.unfinished" / CHECKPOINT
    killed, reached = 0, [0.0]
    while killed < 2:
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
    whole = simulated("sheet", duration=LONG["duration"], interval=LONG["interval"])
    same(fd.load(file), whole)


@pytest.mark.matrix
def test_a_full_disk_keeps_the_last_checkpoint_and_says_so(tmp_path):
    """No file may be larger than some number of bytes, as where there is no room."""
    options = {**LONG, "store": str(tmp_path / "run.nc"), "duration": 50.0}
    process = started(options, limit=150_000)
    said = process.communicate()[1]
    assert process.returncode == 1
    for words in (
        "ComputationError",
        "cannot be written (File too large): make room",
        "keeps it up to t = ",
    ):
        assert words in said
    found = simulated(**{**options, "resume": True})
    same(found, simulated("sheet", duration=50.0, interval=LONG["interval"]))


def test_a_disk_that_is_full_from_the_beginning(kept, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(columns.Columns, "append", full)
    with pytest.raises(ComputationError, match=r"No space left on device.*nothing of the motion"):
        simulated("sheet", **kept)


@pytest.mark.matrix
def test_memory_does_not_grow_with_the_length(tmp_path):
    """A run 20 times longer takes at most 5 % more memory at its peak."""
    peaks = []
    for k, duration in enumerate((8.0, 160.0)):
        options = {**LONG, "checkpoint": 5.0, "interval": 0.005, "duration": duration}
        process = started({**options, "store": str(tmp_path / f"{k}.nc")})
        _, status, used = os.wait4(process.pid, 0)
        assert status == 0
        peaks.append(used.ru_maxrss)
    assert peaks[1] < 1.05 * peaks[0]
