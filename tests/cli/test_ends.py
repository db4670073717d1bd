"""Runs that are killed, interrupted, out of space, or two at once: in real processes."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from processes import COMMAND, children, ended, running, start, wait_for, wait_for_line
from test_cli_fit import CASE, FIT

import foldyn as fd
from foldyn.cli.folder import STAMP
from foldyn.cli.main import main

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
LONG = "analysis.duration = 1e4"  # half an hour
KEPT = "foldyn: kept what was computed: "


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@contextmanager
def limited(size: int) -> Iterator[None]:
    """Limit the size of the files that this process can write (bytes)."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.matrix
def test_signals_keep_what_was_computed_and_of_two_at_once_one_runs(
    workplace, tmp_path, edited
) -> None:
    workplace.write(edited(""))
    fd.read_case("case.toml").run()  # compiles, which would take each of them minutes
    workplace.write(edited(LONG))
    run = ("run", "case.toml", "--no-figures")
    others = {signal.SIGHUP: "other", signal.SIGTERM: "case-results"}
    ignored = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # which nohup lets processes ignore
    runs = {signal.SIGHUP: start(tmp_path, *run, "--out", "other")}
    signal.signal(signal.SIGHUP, ignored)
    runs[signal.SIGTERM] = start(tmp_path, *run)
    for one in runs.values():
        wait_for_line(one, "13 nodes")
    assert main(run) == 2
    out, err = workplace.capsys.readouterr()
    writes = f"another run writes to it (process {runs[signal.SIGTERM].pid}"
    assert out == "" and f"foldyn: results folder case-results: {writes}" in err
    time.sleep(2.0)  # until both motions have begun, on a busy machine too
    for number, one in runs.items():
        one.send_signal(number)
    for number, one in runs.items():
        status, _, err = ended(one)
        folder = tmp_path / others[number]
        assert status == 128 + number
        reason, kept = err.splitlines()[-2:]
        assert reason.startswith("foldyn: case.toml: interrupted at t = ")
        assert kept == f"{KEPT}{others[number]}/result.nc"
        assert names(folder)[:2] == [STAMP, "result.nc"]  # and samples, to resume from
        assert names(folder)[2:] in ([], ["result.nc.unfinished"])
        assert "interrupted" in fd.load(folder / "result.nc").attrs["stopped_because"]


@pytest.mark.matrix
def test_a_kill_between_rules_leaves_no_old_result(workplace, tmp_path, edited) -> None:
    """Then the next run takes the folder over, and clears what the dead one left."""
    folder = tmp_path / "case-results"
    rules = 'model.mass = ["panel", "centroid"]'
    text = edited(rules)
    assert workplace.run(text).status == 0
    workplace.write(edited(f"{rules}; analysis.duration = 30.0"))  # seconds each
    killed = start(tmp_path, "run", "case.toml", "--no-figures")
    wait_for_line(killed, "  panel: ")
    killed.kill()
    killed.wait()
    assert not (folder / "result-centroid.nc").exists()
    assert fd.load(folder / "result-panel.nc").sizes["time"] > 11
    assert '"state": "running"' in (folder / STAMP).read_text()
    (folder / f".result-centroid.nc.{killed.pid}.tmp.nc").write_text("cut")
    workplace.write(text)
    assert main(["run", "case.toml", "--no-figures"]) == 0
    assert names(folder) == [STAMP, "result-centroid.nc", "result-panel.nc"]


@pytest.mark.matrix
def test_ctrl_c_and_a_full_disk_while_figures_are_drawn(workplace, tmp_path, edited) -> None:
    workplace.run(edited("output.interval = 0.001"), "--out", "before")  # compiles
    stopped = start(tmp_path, "run", "case.toml", "--out", "stopped", "--figures", "png")
    wait_for_line(stopped, "drawing figures")  # takes some seconds from here on
    stopped.send_signal(signal.SIGINT)
    status, _, err = ended(stopped)
    assert (status, err) == (
        130,
        f"foldyn: interrupted while figures were drawn\n{KEPT}stopped/result.nc\n",
    )
    with limited(120_000):
        full = workplace.call("run", "case.toml", "--out", "full", "--figures", "png")
    assert full.status == 1
    reason, kept = full.err.splitlines()[-2:]
    assert reason.startswith("foldyn: case.toml: figures: ")
    assert "File too large" in reason
    assert kept == f"{KEPT}full/result.nc"
    for folder in (tmp_path / "stopped", tmp_path / "full"):
        there = names(folder)
        assert "report.html" not in there and "motion.gif" not in there
        assert not [name for name in there if name.endswith((".tmp.gif", ".tmp.png", ".tmp.html"))]
        assert fd.load(folder / "result.nc").sizes["time"] == 101


def test_exit_status_of_an_interrupt_within_code_made_from_text(tmp_path) -> None:
    """As where the signal meets the making of a dataclass; CPython would end by SIGINT itself."""
    (tmp_path / "stopped.py").write_text(
        "import sys\n"
        "from foldyn.cli import main\n"
        "def call(_):\n"
        "    exec('import os, signal; os.kill(os.getpid(), signal.SIGTERM)\\nwhile True: pass')\n"
        "main._call = call\n"
        "sys.exit(main.main(['info']))\n"
    )
    status, _, err = ended(start(tmp_path, command=[sys.executable, "-m", "stopped"]))
    assert (status, err) == (143, "foldyn: interrupted\n")


@pytest.mark.matrix
def test_no_room_for_the_result(workplace, miura) -> None:
    """Neither HDF5 nor the interpreter falls over, and nothing cut stays."""
    workplace.run(miura, "--out", "before")  # compiles
    with limited(20_000):
        done = workplace.call("run", "case.toml", "--no-figures")
    assert (done.status, done.new) == (1, [])
    (line,) = done.err.splitlines()
    assert line.startswith("foldyn: case-results/result.nc: cannot be written (File too large)")
    assert "nor can a temporary folder" in line and "--out" in line


@pytest.mark.matrix
def test_a_disk_that_is_full(tmp_path, miura) -> None:
    """A real one, of 24 kB: the result goes to the temporary folder, and is named."""
    small = ["unshare", "-rm", "sh", "-c", 'mount -t tmpfs -o size=24k none small && exec "$@"', ""]
    (tmp_path / "small").mkdir()
    (tmp_path / "elsewhere").mkdir()
    if shutil.which("unshare") is None or ended(start(tmp_path, "true", command=small))[0]:
        pytest.skip("no file system may be mounted here")
    (tmp_path / "case.toml").write_text(miura)
    command = (*COMMAND, "run", "case.toml", "--no-figures", "--out", "small/r")
    place = {"TMPDIR": str(tmp_path / "elsewhere")}
    status, _, err = ended(start(tmp_path, *command, command=small, changes=place))
    assert status == 1
    reason, kept = err.splitlines()
    assert reason.startswith("foldyn: small/r/result.nc: cannot be written (")
    assert "No space left on device" in reason
    (saved,) = (tmp_path / "elsewhere").rglob("*.nc")
    assert kept == f"{KEPT}{saved}"
    assert fd.load(saved).sizes["time"] == 11


HOLD = """
import ctypes, os
from pathlib import Path
from foldyn.workers import Workers

def hold(item):
    Path(f"{os.getpid()}.begun").touch()
    ctypes.PyDLL(None).sleep(100)  # with the interpreter's lock, as compiled code may

if __name__ == "__main__":
    with Workers(hold, 2) as workers:
        workers.each(range(2), print)
"""


@pytest.mark.matrix
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize("how", ["SIGKILL", "SIGINT"])
def test_workers_end_with_their_parent(tmp_path, how) -> None:
    (tmp_path / "hold.py").write_text(HOLD)
    parent = start(tmp_path, command=[sys.executable, "hold.py"], stderr=subprocess.DEVNULL)
    wait_for(lambda: len(list(tmp_path.glob("*.begun"))) == 2)
    both = children(parent.pid)
    assert len(both) == 2
    parent.send_signal(getattr(signal, how))
    parent.wait(timeout=30)
    wait_for(lambda: not any(map(running, both)), 5.0)


FORCES = "displacement [mm],force [mN]\n-75,1.6\n-150,4.4\n-225,8.1\n-300,13.0\n"


@pytest.mark.matrix
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_a_fit_that_is_ended_keeps_its_evaluations_and_no_workers(tmp_path) -> None:
    for name, text in (("case.toml", CASE), ("fit.toml", FIT), ("forces.csv", FORCES)):
        (tmp_path / name).write_text(text)
    kept = tmp_path / "fit-fit" / "evaluations"
    fit = ("fit", "fit.toml", "--searches", "400", "--processes", "2", "--no-figures")
    process = start(tmp_path, *fit)
    wait_for(lambda: [*kept.glob("*.npz")] or process.poll() is not None, 300.0)
    time.sleep(1.0)  # until the command has heard of it, too
    workers = children(process.pid)
    assert process.poll() is None and len(workers) == 2
    process.send_signal(signal.SIGTERM)
    process.wait(timeout=60)
    wait_for(lambda: not any(map(running, workers)), 60.0)
    there = {*kept.rglob("*")}
    _, err = process.communicate()
    assert process.returncode == 128 + signal.SIGTERM
    assert "Traceback" not in err
    named = f"{KEPT}fit-fit/evaluations; the same command continues from there"
    assert err.splitlines()[-2:] == ["foldyn: interrupted", named]
    assert {*kept.rglob("*")} == there and {one.suffix for one in there} == {".npz"}
