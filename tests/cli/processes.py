"""The command as a process of its own, which is killed, starved of space, or has no streams."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import foldyn as fd

SOURCE = str(Path(fd.__file__).parents[1])
COMMAND = [sys.executable, "-m", "foldyn.cli.main"]
PATIENCE = 120.0  # s, for what takes seconds


def start(
    folder: Path, *arguments: str | bytes, changes: dict[str, str | None] | None = None,
    command: list[str] = COMMAND, **how: Any,
) -> subprocess.Popen[str]:  # fmt: skip
    """Start a command in a folder; `changes` of the environment, None removes."""
    environment = {**os.environ, "PYTHONPATH": SOURCE, "MPLBACKEND": "Agg", **(changes or {})}
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | how
    return subprocess.Popen(
        [*command, *arguments],
        cwd=folder,
        env={key: value for key, value in environment.items() if value is not None},
        text=True,
        errors="surrogateescape",
        **streams,
    )


def ended(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    """Exit status and what was said on both streams, with no traceback."""
    out, err = process.communicate(timeout=PATIENCE)
    assert "Traceback" not in (err or ""), err
    return process.returncode, out or "", err or ""


def wait_for(condition: Callable[[], object], seconds: float = PATIENCE) -> None:
    """Wait until something holds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.02)


def wait_for_line(process: subprocess.Popen[str], text: str) -> None:
    """Wait until the process has said something."""
    assert process.stdout is not None
    while text not in (line := process.stdout.readline()):
        assert line, "the process has ended"


def children(process: int) -> list[int]:
    """Processes whose parent it is (Linux), but for multiprocessing's own bookkeeper."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((place / "stat").read_text().rpartition(")")[2].split()[1])
            keeper = b"resource_tracker" in (place / "cmdline").read_bytes()
        except (OSError, ValueError):
            continue
        if parent == process and not keeper:
            found.append(int(place.name))
    return found


def running(process: int) -> bool:
    """Whether a process is there and no zombie (Linux)."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in "ZX"
