"""The modes and frequency responses of a case file: one for each of its mass rules."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cases.casefile import CaseFile
from foldyn.cli.runs import Run, with_key
from foldyn.errors import ComputationError, InputError, MotionInterrupted

if TYPE_CHECKING:
    import xarray

    from foldyn.dynamics import Progress


class VibrationRun:
    """What modes and frequency responses with one mass rule share."""

    def __init__(self, case_file: CaseFile, rule: str) -> None:
        several = len(case_file.masses) > 1
        self.rule = rule
        self.file = f"result-{rule}.nc" if several else "result.nc"
        self.place = f"{case_file.path}: " + (f'mass = "{rule}": ' if several else "")
        self.case = case_file.case(rule)
        self.arguments = {**case_file.analysis.arguments, **stored_state(case_file, rule)}

    def guarded(self, compute: Callable[[], xarray.Dataset]) -> xarray.Dataset:
        """Compute it; what fails is told with the name of the file.

        What a search for the equilibrium or a simulated motion has come to is no result of this
        kind, and is not kept.
        """
        try:
            return compute()
        except InputError as error:
            raise InputError(self.place + with_key(str(error))) from None
        except ComputationError as error:
            raise ComputationError(str(error)) from None
        except MotionInterrupted as stop:
            raise KeyboardInterrupt(str(stop)) from None


class ModesRun(VibrationRun):
    """The modes with one mass rule; see `cli.runs.Run`."""

    def compute(self, progress: bool, begun: Callable[[], None]) -> xarray.Dataset:
        """Find the modes, which is one piece of work."""
        from tqdm import tqdm

        from foldyn.linear import modes

        text = f"modes with mass rule {self.rule} (first use compiles kernels)"
        with tqdm(bar_format=text, leave=False, disable=not progress):
            result = self.guarded(lambda: modes(self.case, **self.arguments))
        begun()
        return result

    def line(self, result: xarray.Dataset) -> str:
        """Frequencies and effort."""
        rigid, unstable = result["rigid"].values, result["eigenvalue"].values < 0.0
        elastic = result["frequency"].values[~rigid & ~unstable]
        special = [
            f"{int(found.sum())} {what}"
            for found, what in ((rigid, "rigid"), (unstable, "unstable"))
            if found.any()
        ]
        reach = f", {elastic[0]:.4g} to {elastic[-1]:.4g} Hz" if len(elastic) else ""
        count = result.sizes["mode"]
        told = f" ({', '.join(special)})" if special else ""
        return (
            f"  {self.rule}: {count} mode{'s' if count > 1 else ''}{told}{reach}, "
            f"{result.attrs['wall_seconds']:.1f} s"
        )


class Modes:
    """All modes of a case file; see `cli.runs.Task`."""

    def __init__(self, case_file: CaseFile, figures: bool) -> None:
        self.case_file = case_file
        self.runs: Mapping[str, Run] = {
            rule: ModesRun(case_file, rule) for rule in case_file.masses
        }

    def compiles(self) -> bool:
        """The bar says so."""
        return False

    def write(self, results: Mapping[str, xarray.Dataset], folder: Path) -> Path:
        """Draw the modes."""
        from foldyn.report import write_modes

        return write_modes(self.case_file, results, folder)


class ResponseRun(VibrationRun):
    """The frequency response with one mass rule; see `cli.runs.Run`."""

    def compute(self, progress: bool, begun: Callable[[], None]) -> xarray.Dataset:
        """Compute the response.

        `frf` refuses bad input before it tells of its first progress.
        """
        from foldyn.linear import frf

        bar = _bar(progress)
        told = False

        def tell(now: Progress) -> None:
            nonlocal told
            if not told:
                bar.clear()
                begun()
            told = True
            bar.total = now.duration
            bar.update(now.time - bar.n)

        try:
            return self.guarded(lambda: frf(self.case, progress=tell, **self.arguments))
        finally:
            bar.close()

    def line(self, result: xarray.Dataset) -> str:
        """Method, frequencies and effort."""
        f = result["frequency"].values
        count = f"{len(f)} frequencies" if len(f) > 1 else "1 frequency"
        return (
            f"  {self.rule}: {result.attrs['method']}, {count} from {f[0]:.4g} to {f[-1]:.4g} Hz, "
            f"{result.attrs['wall_seconds']:.1f} s"
        )


class Responses:
    """All frequency responses of a case file; see `cli.runs.Task`."""

    def __init__(self, case_file: CaseFile, figures: bool) -> None:
        self.case_file = case_file
        self.runs: Mapping[str, Run] = {
            rule: ResponseRun(case_file, rule) for rule in case_file.masses
        }

    def compiles(self) -> bool:
        """The bar says so."""
        return False

    def write(self, results: Mapping[str, xarray.Dataset], folder: Path) -> Path:
        """Draw the responses."""
        from foldyn.report import write_responses

        return write_responses(self.case_file, results, folder)


def _bar(shown: bool) -> Any:
    """Bar of a response: what it counts depends on the method."""
    from tqdm import tqdm

    layout = "{desc}: {percentage:3.0f} %|{bar}| [{elapsed}<{remaining}]"
    text = "response (first use compiles kernels)"
    return tqdm(total=1.0, desc=text, bar_format=layout, leave=False, disable=not shown)


def stored_state(case_file: CaseFile, rule: str) -> dict[str, Any]:
    """Arguments for a state of a stored result: the state, and how far its folds are folded."""
    if case_file.start is None:
        return {}
    from foldyn.dynamics import initial_state
    from foldyn.results import load
    from foldyn.results.contents import check_variable

    factors: list[float] = []

    def read(path: Path, at: int) -> Any:
        result = load(path)
        state = initial_state(result, at)
        if "load_factor" in result:
            factors.append(float(check_variable(result, "load_factor", ("step",))[at]))
        return state

    state = case_file.initial(rule, read)
    return {"state": state, **({"load_factor": factors[0]} if factors else {})}
