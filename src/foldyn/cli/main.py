"""The `foldyn` command: its arguments and exit statuses.

0: done; 1: the computation failed, what was computed is kept and named; 2: bad input, one
message, nothing written.
"""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Sequence

from foldyn import __version__
from foldyn.errors import ComputationError, FoldynWarning, InputError

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def parser() -> argparse.ArgumentParser:
    """Arguments of the command."""
    top = argparse.ArgumentParser(
        prog="foldyn", description="Statics and dynamics of origami structures."
    )
    top.add_argument("--version", action="version", version=f"foldyn {__version__}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")

    run = commands.add_parser(
        "run",
        help="run a case file",
        description="Run a case file: figures, report.html and result.nc go to a folder.",
    )
    run.add_argument("case", help="case file (TOML), or the name of a shipped one: see foldyn info")
    run.add_argument("--out", help="folder of the results (default: NAME-results)")
    run.add_argument(
        "--no-figures", action="store_true", help="write the result only, no figures and report"
    )
    run.add_argument("--quiet", action="store_true", help="no progress bar and no summary")

    commands.add_parser(
        "info",
        help="versions, threads, optional parts, shipped cases",
        description="Versions, threads, optional parts found or missing, shipped cases.",
    )
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status."""
    given = parser().parse_args(arguments)
    with warnings.catch_warnings():
        warnings.simplefilter("always", FoldynWarning)
        warnings.showwarning = _show_warning
        try:
            if given.command == "run":
                from foldyn.cli.run import run

                run(given.case, given.out, figures=not given.no_figures, quiet=given.quiet)
            else:
                from foldyn.cli.info import info

                print(info())
        except InputError as error:
            print(f"foldyn: {error}", file=sys.stderr)
            return BAD_INPUT
        except ComputationError as error:
            print(f"foldyn: {error}", file=sys.stderr)
            return FAILED
        except MemoryError:
            print("foldyn: not enough memory: take fewer cells or samples", file=sys.stderr)
            return BAD_INPUT
        except BrokenPipeError:  # the reader of our output has left, as `head` does
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return FAILED
        except OSError as error:  # a full disk, a folder that vanished during the run
            print(f"foldyn: cannot write the results: {error}", file=sys.stderr)
            return FAILED
        except KeyboardInterrupt as stop:
            print(f"foldyn: {str(stop) or 'interrupted'}", file=sys.stderr)
            return INTERRUPTED
    return DONE


def _show_warning(message: Warning | str, category: type[Warning], *_: object) -> None:
    name = "" if issubclass(category, FoldynWarning) else f"{category.__name__}: "
    print(f"foldyn: warning: {name}{message}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
