"""The motions of a case file: one for each of its mass rules."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from foldyn.cases.casefile import CaseFile
from foldyn.cli.runs import Run, with_key
from foldyn.errors import InputError

if TYPE_CHECKING:
    import xarray

    from foldyn.dynamics import Motion


class MotionRun:
    """The motion with one mass rule; see `cli.runs.Run`."""

    def __init__(self, case_file: CaseFile, rule: str, figures: bool) -> None:
        several = len(case_file.masses) > 1
        self.rule = rule
        self.file = f"result-{rule}.nc" if several else "result.nc"
        self.place = f"{case_file.path}: " + (f'mass = "{rule}": ' if several else "")
        self.motion = self._prepare(case_file, figures)

    def _prepare(self, case_file: CaseFile, figures: bool) -> Motion:
        from foldyn.dynamics import prepare, start_of
        from foldyn.signals.spectrum import MINIMUM_SAMPLES

        start = start_of(case_file, self.rule)
        arguments = case_file.analysis.arguments
        try:
            motion = prepare(case_file.case(self.rule), initial=start, **arguments)
        except InputError as error:
            raise InputError(self.place + with_key(str(error))) from None
        samples = motion.expected_samples
        if figures and samples < MINIMUM_SAMPLES:
            raise InputError(
                f"{self.place}output.every: gives {samples} samples, spectra need "
                f"{MINIMUM_SAMPLES}: lower it, lengthen analysis.duration, or run with --no-figures"
            )
        return motion

    def compute(self, progress: bool, begun: Callable[[], None]) -> xarray.Dataset:
        """Integrate the motion."""
        begun()
        return self.motion.run(progress)

    def line(self, result: xarray.Dataset) -> str:
        """Method and its reason if it was chosen, steps, speed and accuracy."""
        a = result.attrs
        per_second = a["steps"] / max(a["wall_seconds"], 1e-9)
        size = f"{a['dt']:.3g} s"
        if "smallest_step" in a:
            size = f"{a['smallest_step']:.3g} to {a['largest_step']:.3g} s"
        how = f"critical {a['critical_step']:.3g} s"
        if "iterations" in a:
            how = f"{a['iterations'] / max(a['steps'], 1):.1f} iterations each"
            how += f", {a['halved_steps']} in parts" if a["halved_steps"] else ""
        chosen = ""
        if "method_reason" in a:
            chosen = f"  {self.rule}: {a['method']}, {a['method_reason']}\n"
        return (
            f"{chosen}  {self.rule}: {a['steps']} steps of {size} ({how}), "
            f"{per_second:,.0f} steps/s, energy error {a['energy_error']:.1e}"
        )


class Motions:
    """All motions of a case file; see `cli.runs.Task`."""

    def __init__(self, case_file: CaseFile, figures: bool) -> None:
        from foldyn.dynamics.timing import check_samples

        self.case_file = case_file
        motions = {rule: MotionRun(case_file, rule, figures) for rule in case_file.masses}
        self.runs: Mapping[str, Run] = motions
        self._motions = list(motions.values())
        case = case_file.case()
        try:  # all of them together
            check_samples(
                sum(run.motion.expected_samples for run in motions.values()),
                len(case.structure.nodes),
                len(case.supported_dofs),
                len(motions),
            )
        except InputError as error:
            raise InputError(f"{case_file.path}: {with_key(str(error))}") from None

    def compiles(self) -> bool:
        """Whether the integrator is used for the first time."""
        from foldyn.dynamics import compiled

        return not all(compiled(run.motion.method.name) for run in self._motions)

    def write(self, results: Mapping[str, xarray.Dataset], folder: Path) -> Path:
        """Draw the motions."""
        from foldyn.report import write_motion

        return write_motion(self.case_file, results, folder)
