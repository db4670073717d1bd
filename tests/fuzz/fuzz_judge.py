"""Runs a fuzzer in a process of its own, stops what hangs or eats memory, and counts."""

from __future__ import annotations

import json
import os
import selectors
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fuzz_worker import MEBIBYTES, SECONDS

import foldyn

WORKER = Path(__file__).with_name("fuzz_worker.py")
MOST_FINDINGS = 20
"""Findings after which a fuzzer stops."""
_STARTS = 120.0  # s, in which the process imports and reads sound input


@dataclass
class Report:
    """What came of a fuzzer.

    Attributes
    ----------
    findings : list of (int, str)
        Number of the mutation, and what was wrong with how it was read.
    slowest : float
        Longest time (s) that an input took.
    memory : int
        Most memory (MiB) that an input took.
    """

    target: str
    seed: int
    accepted: int = 0
    refused: int = 0
    findings: list[tuple[int, str]] = field(default_factory=list)
    slowest: float = 0.0
    memory: int = 0

    @property
    def mutations(self) -> int:
        """How many inputs were read."""
        return self.accepted + self.refused

    def __str__(self) -> str:
        """Say what was found, and how to see it again."""
        lines = [f"{self.target}: {self.mutations} mutations, {self.accepted} accepted, "
                 f"{self.refused} refused, {len(self.findings)} findings, slowest "
                 f"{self.slowest:.2f} s, {self.memory} MiB"]  # fmt: skip
        for number, text in self.findings:
            again = f"python tests/fuzz {self.target} --seed {self.seed} --show {number}"
            lines.append(f"\n{again}\n{text}")
        return "\n".join(lines)


def fuzz(target: str, mutations: int, seed: int = 0, worker: Path = WORKER) -> Report:
    """Read damaged inputs with a target of `fuzz_targets`, each number from 0 on."""
    report = Report(target, seed)
    number = 0
    with tempfile.TemporaryDirectory() as folder:
        while number < mutations and len(report.findings) < MOST_FINDINGS:
            here = Path(folder) / str(number)
            here.mkdir()
            number = _run(report, worker, number, mutations, here)
    return report


def _run(report: Report, worker: Path, first: int, end: int, here: Path) -> int:
    """Let one process work; return the number that the next one begins with."""
    source = Path(foldyn.__file__).parents[1]
    path = os.pathsep.join(filter(None, (str(source), os.environ.get("PYTHONPATH"))))
    process = subprocess.Popen(
        [sys.executable, worker, report.target, str(report.seed), str(first), str(end), here],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": path},
    )
    try:
        number, stopped = first, ""
        for line in _lines(process):
            if isinstance(line, str):
                stopped = line
                break
            if "number" in line:
                _count(report, line)
                number = line["number"] + 1
                if len(report.findings) >= MOST_FINDINGS:
                    return number
    finally:
        process.kill()
        process.wait()
        process.stdout.close()  # type: ignore[union-attr]
    if number == end:
        return number
    told = here.with_suffix(".told").read_text(errors="replace")[-2000:]
    _count(report, {"number": number, "accepted": False, "finding": f"{stopped}\n{told}"})
    return number + 1


def _count(report: Report, line: dict[str, Any]) -> None:
    report.accepted += line["accepted"]
    report.refused += not line["accepted"]
    report.slowest = max(report.slowest, line.get("seconds", 0.0))
    report.memory = max(report.memory, line.get("memory", 0))
    if "finding" in line:
        report.findings.append((line["number"], line["finding"]))


def _lines(process: subprocess.Popen[bytes]) -> Iterator[dict[str, Any] | str]:
    """What a worker says, and at last why it had to be stopped, where it had to be."""
    pipe = process.stdout
    assert pipe is not None
    allowed, limit, rest = _STARTS, 1 << 40, b""
    heard = time.monotonic()
    with selectors.DefaultSelector() as selector:
        selector.register(pipe, selectors.EVENT_READ)
        while True:
            if selector.select(0.02):
                piece = os.read(pipe.fileno(), 1 << 16)
                if not piece:
                    yield f"ended with {_status(process.wait())}"
                    return
                *lines, rest = (rest + piece).split(b"\n")
                heard = time.monotonic()
                for line in map(json.loads, lines):
                    if "number" not in line:
                        allowed, limit = SECONDS + 1.0, line["memory"] + MEBIBYTES
                    yield line
            elif time.monotonic() - heard > allowed:
                yield f"hung for {allowed:.0f} s"
                return
            if _resident(process.pid) > limit:
                yield f"took more than {MEBIBYTES} MiB"
                return


def _resident(pid: int) -> float:
    """Most memory of a process or one that it has started, in MiB; 0 if the system is silent."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except (OSError, IndexError):
        return 0.0
    own = pages * os.sysconf("SC_PAGE_SIZE") / 2**20
    return max([own, *(_resident(int(child)) for child in children)])


def _status(code: int) -> str:
    return signal.Signals(-code).name if code < 0 else f"exit status {code}"
