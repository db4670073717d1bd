"""`foldyn warm-up`: kernels compiled before they are needed."""

from __future__ import annotations

import time
from argparse import Namespace
from typing import Any

from foldyn.cli.streams import speech
from foldyn.values import choice


def add_warm_up(commands: Any) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "warm-up",
        help="compile the usual kernels now, so that first runs need not",
        description="Compile the kernels of motions that are not kept on disk yet, and say how "
        "many and for how long; seconds where all is there.",
    )
    command.add_argument(
        "--methods", nargs="+", metavar="NAME",
        help="integrators, or all (default: rk4 generalized_alpha)",
    )  # fmt: skip
    command.add_argument(
        "--models", nargs="+", metavar="NAME",
        help="presets of bars and hinges, shell, or all (default: plate herkal)",
    )  # fmt: skip
    command.add_argument("--quiet", action="store_true", help="print nothing")
    command.set_defaults(force=False)


def run_warm_up(given: Namespace) -> None:
    """Run the command."""
    from foldyn.dynamics import METHODS
    from foldyn.dynamics.warm_up import MODELS, USUAL, together, warm_up

    say = speech(given.quiet)
    methods = _chosen("--methods", given.methods, USUAL["methods"], tuple(METHODS))
    models = _chosen("--models", given.models, USUAL["models"], MODELS)
    pairs = together(methods, models)
    for number, (method, model) in enumerate(pairs, 1):
        say(f"{number} of {len(pairs)}: {method}, {model}")
        began = time.perf_counter()
        count = warm_up(method, model)
        seconds = time.perf_counter() - began
        say(f"    {f'compiled {count} functions in' if count else 'ready:'} {seconds:.1f} s")


def _chosen(
    field: str, given: list[str] | None, usual: tuple[str, ...], known: tuple[str, ...]
) -> tuple[str, ...]:
    """What is asked for, each once."""
    if given is None:
        return usual
    if "all" in given:
        return known
    return tuple(dict.fromkeys(choice(field, name, ("all", *known)) for name in given))
