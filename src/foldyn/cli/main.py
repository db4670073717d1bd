"""The `foldyn` command: its arguments and exit statuses.

Exit status 0: done; 1: the computation failed; 2: bad input, nothing written; 128 plus the number
of a signal: ended by that signal. Results computed before the end are kept, and the message names
them.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import shlex
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn

from foldyn import __version__
from foldyn.cli.convert import add_convert, convert
from foldyn.cli.design import add_design, run_design
from foldyn.cli.fit import add_fit, run_fit
from foldyn.cli.folder import reason
from foldyn.cli.folding import add_fold, run_fold
from foldyn.cli.options import add, add_figures, add_film, add_results, flag, integer, number
from foldyn.cli.signals import ENDINGS
from foldyn.cli.streams import Outlet, noticed, steady_streams
from foldyn.cli.study import add_study, study
from foldyn.cli.sweep import add_sweep, run_sweep
from foldyn.cli.track import add_track, track
from foldyn.cli.view import add_view, run_view
from foldyn.cli.warm_up import add_warm_up, run_warm_up
from foldyn.errors import ComputationError, FoldynWarning, InputError, Told, shortened
from foldyn.ram_limit import HALF, at_most

DONE, FAILED, BAD_INPUT = 0, 1, 2
OTHERS = {
    "convert": (add_convert, convert), "fold": (add_fold, run_fold), "study": (add_study, study),
    "fit": (add_fit, run_fit), "sweep": (add_sweep, run_sweep), "design": (add_design, run_design),
    "track": (add_track, track), "view": (add_view, run_view),
    "warm-up": (add_warm_up, run_warm_up),
}  # fmt: skip
"""Commands in modules of their own: the functions that add their arguments, and that run them."""
SILENT = {"OPENCV_FFMPEG_LOGLEVEL": "-8", "OPENCV_LOG_LEVEL": "SILENT"}
"""Environment variables that silence the decoders of OpenCV: we report broken films ourselves."""


class _Parser(argparse.ArgumentParser):
    """A parser that keeps its messages short."""

    def error(self, message: str) -> NoReturn:
        super().error(shortened(message))


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = _Parser(prog="foldyn", description="Statics and dynamics of origami structures.")
    top.add_argument("--version", action="version", version=f"foldyn {__version__}")
    top.set_defaults(model=None, force=True)  # of commands that lack these options
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")

    run = commands.add_parser(
        "run",
        help="run a case file",
        description="Run a case file: figures, report.html and result.nc go to a folder.",
    )
    _add_common(run, "results", film=True)
    flag(run, "--resume", "continue an interrupted motion from its last checkpoint")
    waits = "of a motion: computing time between checkpoints (default: 60)"
    add(run, number, {"--checkpoint SECONDS": waits})
    add(run, str, {"--device": "of a motion: where its steps are computed"}, choices=("cpu", "gpu"))

    modes = _add_kind(
        commands, "modes", "natural frequencies and mode shapes of a case file of any kind",
        "Natural frequencies and mode shapes of the structure of a case file of any kind",
        film=True,
    )  # fmt: skip
    add(modes, integer, {"--count": "how many modes (default: 6)"})
    _add_state(modes)

    frf = _add_kind(
        commands, "frf", "frequency response of a case file of any kind",
        "Frequency response of the structure of a case file of any kind to its [[drive]], or else "
        "to its forces or the motion of its base", film=True,
    )  # fmt: skip
    add(frf, number, {"--frequencies FIRST LAST COUNT": "frequencies (Hz), spaced evenly"})
    add(frf, str, {"--method": "direct (default), modal, impulse, ...: see the case file"})
    _add_state(frf)

    buckling = _add_kind(
        commands, "buckling",
        "load factors at which a case file of any kind buckles, and the shapes",
        "Linear buckling of the structure of a case file of any kind: all its loads grow together, "
        "without their histories",
    )  # fmt: skip
    add(buckling, integer, {
        "--count": "load factors of each sign (default: 6)",
        "--iterations": "repeat it on the path, ever closer to the first factor, so often at most",
    })  # fmt: skip

    random = _add_kind(
        commands, "random", "random vibration of a case file of any kind",
        "Root mean square response of the structure of a case file of any kind to a base that "
        "moves at random",
    )  # fmt: skip
    random.add_argument(
        "--base", nargs="+", action="append", metavar=("AXIS UNIT", "F:DENSITY"),
        help="axis, unit (g2/Hz or m2/s3) and points of the density, frequency (Hz) and value, as "
        "in --base z g2/Hz 20:0.005 80:0.04 500:0.04; again for other axes",
    )  # fmt: skip
    add(random, integer, {"--count": "how many modes (default: by the density)"})
    for name, text in (("stresses", "stresses"), ("reactions", "forces of the supports")):
        flag(random, f"--{name}", f"with root mean squares of {text}")
    _add_state(random)

    response = _add_kind(
        commands, "response", "response curve of a case file of any kind",
        "Periodic motions of the structure of a case file of any kind under its harmonic "
        "histories, along their frequency, with stability and bifurcations", models=False,
    )  # fmt: skip
    add(response, number, {
        "--frequencies FIRST LAST": "ends of the frequencies (Hz)",
        "--amplitudes FIRST LAST": "ends of the factor on the drive",
    })  # fmt: skip
    add(response, integer, {
        "--harmonics": "of the drive's frequency (default: 9)",
        "--modes": "compute in the span of so many modes, for big sheets",
        "--branches": "how many times branches are followed (default: 1)",
    })  # fmt: skip

    bands = _add_kind(
        commands, "bands",
        "bands of the sheet, chain or tube that repeats the pattern of a case file",
        "Frequencies of Bloch waves in a sheet, chain or tube whose cell is the pattern of a case "
        "file of any kind",
    )  # fmt: skip
    add(bands, integer, {"--count": "how many bands (default: 6)"})
    add(bands, str, {
        "--path G-X-M-G": "points of the Brillouin zone (default: G-X-M-Y-G; of a chain or tube "
        "G-X)",
    })  # fmt: skip
    add(bands, integer, {
        "--points N": "wave vectors along the path (default: 60)",
        "--zone N": "wave vectors along each period of the whole zone",
        "--attenuation N": "frequencies of an attenuation spectrum",
    })  # fmt: skip
    _add_state(bands)

    effective = _add_kind(
        commands, "effective",
        "stiffness of the plate or beam that is equivalent to a repeated case file",
        "Membrane, bending and coupling stiffness of a sheet whose cell is the pattern of a case "
        "file of any kind, or of a chain or tube",
    )  # fmt: skip
    _add_state(effective)

    fidelity = commands.add_parser(
        "fidelity",
        help="compare models of bars and hinges with superelements or the shell",
        description="Frequencies, shapes and small displacements of models of bars and hinges, "
        "compared with superelements, or with the shell, of the same pattern, sheet and supports, "
        "for a case file of any kind. Options not given here are taken from its [analysis], if "
        "that is of kind fidelity.",
    )
    _add_case(fidelity, "fidelity")
    add(fidelity, integer, {"--count": "how many modes (default: 6)"})
    add(fidelity, str, {
        "--reference MODEL": "what to compare with: superelements (default), or shell, which takes "
        "longer",
    })  # fmt: skip
    add(fidelity, integer, {
        "--divisions COARSE FINE": "pieces of every edge of the two shells, with --reference shell "
        "(default: 6 12, less for large patterns; 8 12 with a vertex radius)",
    })  # fmt: skip
    others = "further models to compare: standard, plate, n5b8e, bars (default: all but bars)"
    add(fidelity, str, {"--models NAME": others}, nargs="+")
    add(fidelity, number, {
        "--vertex-radius M": "distance from vertices within which panels do not stretch (m, about "
        "the thickness); shells are then graded toward vertices",
    })  # fmt: skip
    _add_secant(fidelity)

    for add_other, _ in OTHERS.values():
        add_other(commands)
    commands.add_parser(
        "schema",
        help="JSON Schema of case files, by which editors complete and check them",
        description="The JSON Schema (draft 7) of case files of this version.",
    )
    commands.add_parser(
        "info",
        help="versions, threads, optional parts, shipped cases",
        description="Versions, threads, optional parts found or missing, shipped cases.",
    )
    return top


def _add_case(command: argparse.ArgumentParser, results: str) -> None:
    """Add the arguments of all commands on case files."""
    add(command, str, {"case": "case file (TOML), or the name of a shipped one: see foldyn info"})
    add_results(command, f"NAME-{results}")
    add_figures(command)


def _add_kind(
    commands: Any, kind: str, text: str, about: str, film: bool = False, models: bool = True
) -> argparse.ArgumentParser:
    """Add a command that computes a case file of any kind as one of its own kind."""
    holds = f"what its [analysis] says, if it is of kind {kind}, holds unless given here."
    command = commands.add_parser(kind, help=text, description=f"{about}; {holds}")
    if models:
        _add_common(command, kind, film)
    else:
        _add_case(command, kind)
    return command


def _add_common(command: argparse.ArgumentParser, results: str, film: bool) -> None:
    """Add the arguments of commands on case files of any model."""
    _add_case(command, results)
    if film:
        add_film(command)
    add(command, str, {
        "--model bars_and_hinges|shell|superelements": "model instead of that of the file; results "
        f"go to NAME-MODEL-{results}",
    })  # fmt: skip
    pieces = "pieces of every edge of a shell (16), or of the panels of superelements"
    add(command, integer, {"--divisions N": pieces})


def _add_state(command: argparse.ArgumentParser) -> None:
    """Add the options for the state about which a structure vibrates."""
    add(command, str, {
        "--state rest|equilibrium|FILE": "about which state: rest (default), the equilibrium under "
        "the loads, or the last state of a result (NetCDF)",
    })  # fmt: skip
    _add_secant(command)


def _add_secant(command: argparse.ArgumentParser) -> None:
    """Add the amplitude at which superlinear hinges are linearized."""
    text = "amplitude of the hinges' turns for which superlinear hinges are linearized"
    add(command, number, {"--secant DEGREES": text})


@contextmanager
def uncollected_imports() -> Iterator[None]:
    """Import modules without garbage collection and exempt their objects from it for good.

    Importing makes some hundred thousand objects, which the collector would scan repeatedly: a
    fifth of the time of a short run. Only the first import is exempt, so garbage that earlier work
    left in the process can still be freed.
    """
    if not gc.isenabled() or "foldyn.analyses" in sys.modules:
        yield
        return
    gc.disable()
    try:
        yield
        gc.freeze()
    finally:
        gc.enable()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status."""
    with ENDINGS.heeded(), steady_streams() as out:
        return _status(arguments, out)


def _status(arguments: Sequence[str] | None, out: Outlet) -> int:
    """Run the command and report an error or signal that ended it."""
    try:
        arguments = sys.argv[1:] if arguments is None else arguments
        given = parser().parse_args(arguments)
        given.typed = shlex.join(["foldyn", *arguments])
        for name, level in SILENT.items():
            os.environ.setdefault(name, level)
        os.environ["MPLBACKEND"] = "Agg"  # figures only go to files
        with warnings.catch_warnings(action="always", category=FoldynWarning):
            warnings.showwarning = _Warnings(getattr(given, "case", ""))
            if getattr(given, "figures", None) and given.no_figures:
                raise InputError("--figures: draws figures; leave out --no-figures")
            with at_most(1.0 if given.force else HALF), noticed(getattr(given, "quiet", False)):
                _call(given)
    except (InputError, MemoryError) as error:
        return _say(reason(error), BAD_INPUT)
    except ComputationError as error:
        return _say(str(error), FAILED)
    except OSError as error:  # a full disk, or a folder that vanished during the run
        return _say(f"cannot write the results: {reason(error)}", FAILED)
    except KeyboardInterrupt as stop:
        return _say(str(stop) or "interrupted", ENDINGS.status)
    out.flush()
    if out.failure is None:
        return DONE
    # the reading program, such as `head`, has closed it
    if isinstance(out.failure, BrokenPipeError):
        return FAILED
    return _say(f"cannot write to standard output: {reason(out.failure)}", FAILED)


def _say(message: str, status: int) -> int:
    print(f"foldyn: {message}", file=sys.stderr)
    return status


def _call(given: argparse.Namespace) -> None:
    """Call the function of the chosen command."""
    if given.command == "info":
        from foldyn.cli.info import info

        print(info())
    elif given.command == "schema":
        from foldyn.analyses.registry import case_schema

        print(json.dumps(case_schema(), indent=1))
    elif given.command in OTHERS:
        OTHERS[given.command][1](given)
    else:
        with uncollected_imports():
            from foldyn.cli.run import run

        run(given)


class _Warnings:
    """Prints each warning once, prefixed with the case file's name."""

    def __init__(self, case: str) -> None:
        self.shown, self.place = Told(), f"{case}: " if case else ""

    def __call__(self, message: Warning | str, category: type[Warning], *_: object) -> None:
        name = "" if issubclass(category, FoldynWarning) else f"{category.__name__}: "
        text = f"{name}{str(message).removeprefix(self.place)}"
        if self.shown.add(text):
            print(f"foldyn: warning: {self.place}{text}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
