"""What is told while kernels are compiled."""

from __future__ import annotations

import sys
from itertools import pairwise

import pytest
from jit_lab import ASK, copy_package, python

from foldyn.cli.streams import noticed
from foldyn.notice import NOTICE, PER_KERNEL, Notice, on_terminal


class Compiler:
    """Kernels that each take some seconds to compile, on a clock of their own."""

    def __init__(self, seconds, share=1.0):
        self.told, self.now, self.seconds = [], 0.0, seconds
        self.notice = Notice(self.told.append, lambda: self.now, lambda: share * self.now)

    def compile(self, kernels):
        """Compile the last of some kernels, which needs all others of them."""
        *others, whole = kernels
        self.notice.begin(whole, lambda: kernels)
        for one in others:
            self.notice.begin(one, lambda: [])
            self.now += self.seconds
            self.notice.end()
        self.now += self.seconds
        self.notice.end()
        self.now += 1000.0  # something else meanwhile


def test_each_part_of_the_work_is_told_once_with_what_is_missing():
    slow = Compiler(2.0)
    slow.compile(range(150))
    slow.compile(range(140, 160))  # ten more
    slow.compile(range(160, 161))
    assert slow.told == [
        "compiling 150 kernels for their first use, about 20 s; others may follow when they are "
        "needed, and all are kept for later runs",
        "compiling 10 more kernels, about 20 s",  # at the pace of those before
    ]
    assert pytest.approx(21.0) == 150 * PER_KERNEL


@pytest.mark.parametrize(
    ("seconds", "share", "ends", "told"),
    [
        # the first may be small; others have the processor for three quarters of the time
        (0.1, 0.25, [30, 80], [" 5 s", " 30 s"]),
        (0.01, 1.0, range(1, 31), []),  # short waits are not worth a word
        # none of the first is told, as it should not take that long
        (6.0, 1.0, [10, 20, 45], [" a minute", " 2.5 minutes"]),
    ],
)
def test_it_tells_of_the_time_that_kernels_take_here(seconds, share, ends, told):
    compiler = Compiler(seconds, share)
    for begin, end in pairwise([0, *ends]):
        compiler.compile(range(begin, end))
    assert [text.partition("about")[2].partition(";")[0] for text in compiler.told] == told


TOLD = f"""
import foldyn.notice
foldyn.notice.NOTICE.tell = print
foldyn.notice.PER_KERNEL = 1.0
{ASK}
"""


@pytest.mark.matrix
def test_a_kernel_that_is_compiled_tells_how_many_are_missing(tmp_path):
    """The probe, the history and the law that it calls, and what these call; later nothing."""
    package = copy_package(tmp_path)
    first, again = (
        python(package, TOLD, NUMBA_CACHE_DIR=str(tmp_path / "kernels")).stdout for _ in range(2)
    )
    message, numbers = first.splitlines()
    assert message.startswith("compiling ") and " kernels for their first use, about " in message
    assert 5 <= int(message.split()[1]) <= 40
    assert again.split()[:2] == numbers.split()[:2] and "compiling" not in again


def test_a_command_prints_it_and_a_script_tells_a_terminal_alone(capsys, monkeypatch):
    with noticed(quiet=False):
        NOTICE.tell("compiling")
    assert capsys.readouterr() == ("compiling\n", "")
    with noticed(quiet=True):
        NOTICE.tell("compiling")
    on_terminal("compiling")  # nobody watches standard error here
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    on_terminal("compiling")
    assert capsys.readouterr() == ("", "compiling\n")
