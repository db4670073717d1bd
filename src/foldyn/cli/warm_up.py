"""`foldyn warm-up`: compile kernels ahead of their first use."""

from __future__ import annotations

import time
from argparse import Namespace
from typing import Any

from foldyn.cli.streams import progress_bar, speech


def add_warm_up(commands: Any) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "warm-up",
        help="compile all kernels now, so that first runs need not",
        description="Compile all kernels that are not on disk yet, on all processors, and say how "
        "many and for how long; seconds where all are there.",
    )
    command.add_argument("--quiet", action="store_true", help="print nothing")
    command.set_defaults(force=False)


def run_warm_up(given: Namespace) -> None:
    """Run `foldyn warm-up`."""
    from foldyn.cli.first_uses import STAGES, use
    from foldyn.threads import processors
    from foldyn.workers import Workers

    began, total, count = time.perf_counter(), 0, processors()
    with (
        progress_bar(given.quiet, total=sum(map(len, STAGES)), unit="part") as bar,
        Workers(use, count) as workers,
    ):
        for stage in STAGES:
            left = list(stage)

            def keep(name: str, compiled: int, left: list[str] = left) -> None:
                nonlocal total
                total += compiled
                left.remove(name)
                bar.update()
                bar.set_postfix_str(", ".join(left[:count]))

            bar.set_postfix_str(", ".join(left[:count]))
            workers.each(stage, keep)
    seconds = time.perf_counter() - began
    told = f"compiled {total} functions" if total else "all kernels are ready"
    speech(given.quiet)(f"{told} ({seconds:.0f} s)")
