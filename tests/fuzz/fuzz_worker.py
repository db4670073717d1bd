"""The process in which damaged inputs are read: it says of each how that ended.

It lives in a folder of its own, `here`, which nothing but the input may change. What it says goes
to a pipe of its own, one JSON object a line; standard output and error must stay empty.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import time
import traceback
import warnings
from pathlib import Path
from typing import Any

from fuzz_target import Target

from foldyn.errors import FoldynWarning, InputError

SECONDS = 5.0
"""Time that an input may take."""
MEBIBYTES = 1024
"""Memory that an input may take above what the process has at first."""
LINES, LETTERS = 20, 5000
"""Size of a message."""


def work(target: Target, seed: int, numbers: range, here: Path) -> None:
    """Read the damaged inputs of some numbers."""
    say = os.fdopen(os.dup(1), "w", buffering=1)
    told = os.open(here.with_suffix(".told"), os.O_RDWR | os.O_CREAT | os.O_TRUNC)
    os.dup2(told, 1)
    os.dup2(told, 2)
    os.chdir(here)
    os.environ["TMPDIR"] = str(here)
    file = here / f"input{target.suffix}"
    seeds = target.seeds(here)
    for sound in seeds:
        file.write_bytes(sound)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)
            target.read(file)  # what is sound is read
    first = _memory("VmRSS")
    os.ftruncate(told, 0)
    os.lseek(told, 0, os.SEEK_SET)
    print(json.dumps({"memory": first}), file=say)
    for number in numbers:
        file.write_bytes(target.mutated(seed, number, seeds))
        before = _state(here)
        _forget_peak()
        start = time.perf_counter()
        outcome = _read(target, file)
        seconds = time.perf_counter() - start
        memory = max(_memory("VmHWM"), _memory_of_children()) - first
        if seconds > SECONDS:
            outcome["finding"] = f"took {seconds:.1f} s"
        if memory > MEBIBYTES:
            outcome["finding"] = f"took {memory} MiB"
        if _state(here) != before:
            outcome["finding"] = f"changed its folder: {sorted(os.listdir(here))}"
        if os.fstat(told).st_size:
            outcome["finding"] = f"wrote {os.pread(told, 500, 0)!r}"
            os.ftruncate(told, 0)
            os.lseek(told, 0, os.SEEK_SET)
        print(json.dumps({"number": number, "seconds": seconds, "memory": memory, **outcome}),
              file=say)  # fmt: skip


def _read(target: Target, file: Path) -> dict[str, Any]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            target.read(file)
            outcome: dict[str, Any] = {"accepted": True}
        except InputError as error:
            outcome = {"accepted": False} | _message(str(error))
        except BaseException as error:
            last = "".join(traceback.format_exception(error)[-4:])
            outcome = {"accepted": False, "finding": f"{type(error).__name__}: {last[-1500:]}"}
    for one in caught:
        if not issubclass(one.category, FoldynWarning):
            said = f"{one.category.__name__}: {one.message} ({one.filename}:{one.lineno})"
            outcome.setdefault("finding", said[:1500])
        else:
            outcome |= _message(str(one.message))
    return outcome


def _message(text: str) -> dict[str, str]:
    if text.count("\n") < LINES and len(text) <= LETTERS:
        return {}
    size = f"{len(text)} letters in {text.count(chr(10)) + 1} lines"
    return {"finding": f"a message of {size}: {text[:300]} ..."}


def _state(folder: Path) -> list[tuple[str, int, int]]:
    return sorted((one.name, one.stat().st_size, one.stat().st_mtime_ns)
                  for one in os.scandir(folder))  # fmt: skip


def _memory(name: str) -> int:
    """Memory of this process in MiB; 0 where the system does not tell."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return 0
    return int(next((line.split()[1] for line in lines if line.startswith(name)), "0")) // 1024


def _memory_of_children() -> int:
    """Most memory of a process that this one had started, in MiB."""
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024


def _forget_peak() -> None:
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return


if __name__ == "__main__":
    from fuzz_targets import TARGETS

    _name, _seed, _first, _end, _here = sys.argv[1:]
    work(TARGETS[_name], int(_seed), range(int(_first), int(_end)), Path(_here))
