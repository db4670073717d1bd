"""Damaged input is read or refused: no traceback, no hang, no gigabyte, nothing written."""

from __future__ import annotations

from pathlib import Path

import pytest
from fuzz_judge import fuzz
from fuzz_targets import TARGETS

from pairwise import FEW, beyond

SHORT = 10 if FEW else 20  # a few seconds


@pytest.mark.parametrize("target", beyond(TARGETS, 4))
def test_damaged_input_is_read_or_refused(target):
    report = fuzz(target, SHORT, seed=1)
    assert not report.findings, str(report)
    assert report.mutations == SHORT
    assert report.refused  # what is damaged shows


# ------------------------------------------------------------------------ the judge itself

FAULTS = {
    "raises": ("raise KeyError('mutated')", "KeyError"),
    "recurs": ("read(file)", "RecursionError"),
    "sleeps": ("import time; time.sleep(60)", "hung for"),
    "eats": ("kept = [bytearray(1 << 24) for _ in range(1000)]", "took more than 1024 MiB"),
    "eats quickly": ("bytearray(1100 << 20)", "MiB"),
    "writes": ("file.with_name('new').write_text('')", "changed its folder"),
    "prints": ("print('here', flush=True)", "wrote b'here"),
    "warns": ("import warnings; warnings.warn('overflow', RuntimeWarning)", "RuntimeWarning"),
    "dies": ("import os; os.abort()", "SIGABRT"),
    "leaves": ("import os; os._exit(3)", "exit status 3"),
    "talks": ("e = InputError(''); e.args = ('word ' * 2000,); raise e", "of 10000 letters"),
}


@pytest.mark.matrix
def test_the_judge_finds_every_kind_of_fault(tmp_path):
    kinds = list(FAULTS)
    body = "\n".join(f"        case {i}:\n            {FAULTS[kind][0]}"
                     for i, kind in enumerate(kinds))  # fmt: skip
    worker = tmp_path / "worker.py"
    worker.write_text(f"""
import sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from pathlib import Path
from foldyn.errors import InputError
import fuzz_worker
from fuzz_target import Target

class Faults(Target):
    def mutated(self, seed, number, seeds):
        return str(number).encode()

def read(file):
    match int(file.read_bytes()):
{body}
        case {len(kinds)}:
            raise InputError("refused")

target = Faults("faults", lambda _: [b"100"], read)
_, _, seed, first, end, here = sys.argv
fuzz_worker.work(target, 0, range(int(first), int(end)), Path(here))
""")
    report = fuzz("faults", len(kinds) + 2, worker=worker)
    found = dict(report.findings)
    assert list(found) == list(range(len(kinds))), str(report)
    for i, kind in enumerate(kinds):
        assert FAULTS[kind][1] in found[i], (kind, found[i])
    assert (report.accepted, report.refused) == (2 + 2, len(kinds) - 2)
