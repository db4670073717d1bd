"""The equilibrium path of a case file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cases.casefile import CaseFile
from foldyn.cli.runs import Run, with_key
from foldyn.errors import InputError

if TYPE_CHECKING:
    import xarray

    from foldyn.statics import Point


class PathRun:
    """The path; see `cli.runs.Run`."""

    file = "result.nc"

    def __init__(self, case_file: CaseFile) -> None:
        from foldyn.dynamics import start_of
        from foldyn.statics import Settings

        self.place = f"{case_file.path}: "
        self.case = case_file.case()
        self.arguments = dict(case_file.analysis.arguments)
        self.arguments["settings"] = Settings(**case_file.analysis.settings)
        self.arguments["start"] = start_of(case_file)

    def compute(self, progress: bool, begun: Callable[[], None]) -> xarray.Dataset:
        """Follow the path.

        `trace` refuses bad input, a mechanism for example, before it finds the first point.
        """
        from foldyn.statics import trace

        bar = _bar(progress)
        found = 0

        def tell(point: Point) -> None:
            nonlocal found
            if not found:
                bar.clear()
                begun()
            found += 1
            bar.set_postfix_str(f"load factor {point.factor:.4g}", refresh=False)
            bar.update()

        try:
            return trace(self.case, progress=tell, **self.arguments)
        except InputError as error:
            raise InputError(self.place + with_key(str(error))) from None
        finally:
            bar.close()

    def line(self, result: xarray.Dataset) -> str:
        """Points, what is special about them, effort."""
        a, kinds = result.attrs, result["point"].values
        limits, crossings = int((kinds == "limit").sum()), int((kinds == "bifurcation").sum())
        special = f" ({_count(limits, 'limit point')}, {_count(crossings, 'bifurcation')})"
        unstable = f", {a['unstable_points']} of them unstable," if a["unstable_points"] > 0 else ""
        return (
            f"  {a['method']}: {_count(result.sizes['step'], 'point')}"
            f"{special if limits or crossings else ''}{unstable} to the load factor "
            f"{float(result['load_factor'][-1]):.4g}, {a['newton_iterations']} iterations, "
            f"{a['wall_seconds']:.1f} s"
        )


class Paths:
    """The one path of a case file; see `cli.runs.Task`."""

    def __init__(self, case_file: CaseFile, figures: bool) -> None:
        self.case_file = case_file
        self.runs: Mapping[str, Run] = {"path": PathRun(case_file)}

    def compiles(self) -> bool:
        """The bar says so: the first kernels are compiled while `trace` still checks."""
        return False

    def write(self, results: Mapping[str, xarray.Dataset], folder: Path) -> Path:
        """Draw the path."""
        from foldyn.report import write_path

        return write_path(self.case_file, results["path"], folder)


def _bar(shown: bool) -> Any:
    """Bar of points: how many there will be is not known."""
    from tqdm import tqdm

    layout = "points: {n_fmt}{postfix} [{elapsed}]"
    bar = tqdm(bar_format=layout, leave=False, mininterval=0.0, disable=not shown)
    bar.set_postfix_str("first use compiles kernels, up to half a minute")
    return bar


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
