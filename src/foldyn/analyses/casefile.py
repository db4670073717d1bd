"""A case file that has been read, and what a kind of analysis gives to it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from inspect import signature
from pathlib import Path
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.analyses.provenance import Call, provenance
from foldyn.analyses.sections import CaseSchema, DesignSection, SweepSection
from foldyn.analyses.start import Start, start_of
from foldyn.arguments import arguments
from foldyn.cases import Case, State
from foldyn.cases.models import MODELS
from foldyn.dynamics import Keeping
from foldyn.dynamics.motion import Motion
from foldyn.errors import InputError, within
from foldyn.linear import refinement
from foldyn.patterns import Pattern
from foldyn.patterns.picture import picture
from foldyn.report.album import Album, ByRule, filled
from foldyn.report.page import write_report
from foldyn.report.sections import Section
from foldyn.structures import Sheet
from foldyn.values import choice
from foldyn.viewer import stage

Begun = Callable[[], None]
Compute = Callable[[bool, Begun], xarray.Dataset]
"""Computes a result, with or without a bar; calls its second argument, once or more often, after
all input has been accepted."""


@runtime_checkable
class Kept(Protocol):
    """A computation that can be kept on the disk while it runs, and go on from there."""

    kept: Keeping | None

    def keep(self, keeping: Keeping, shown: bool) -> None:
        """Say how it is kept, and whether its result is to be shown, for which memory must do."""


@runtime_checkable
class Moving(Protocol):
    """A computation of a motion, which may be integrated beside others before it is called."""

    motion: Motion
    integrated: bool


@dataclass(frozen=True, eq=False)
class Output:
    """What to keep and show.

    Attributes
    ----------
    nodes : ndarray of int64
        Nodes that figures and spectra show.
    named : bool
        Whether the file names these nodes; otherwise they are the default.
    axis : str or None
        Component that figures show, "x", "y" or "z", of a path also "-x", "-y" or "-z"; None: the
        one in which a node moves most.
    animation : str or None
        Film of the motion that is written beside the page, "gif" or "mp4"; None: none.
    max_frequency : float or None
        Of a motion: where the axes of spectra end (Hz); None: at half the sampling rate.
    shapes : int, tuple of int or None
        Of a path: how many deformed shapes are drawn, or the numbers of their points. Of modes:
        how many are drawn, or their numbers.
    quantity : str or None
        Of a frequency response: "receptance", "mobility" or "accelerance"; None: what it is.
    """

    nodes: NDArray[np.int64]
    named: bool = False
    axis: str | None = None
    animation: str | None = None
    max_frequency: float | None = None
    shapes: int | tuple[int, ...] | None = None
    quantity: str | None = None


class Analysis(ABC):
    """One kind of analysis, as a case file asks for it.

    A new kind is a subclass of this in a file of its own, listed in `analyses.registry`.

    Attributes
    ----------
    kind : str
        What a case file calls it.
    schema : type
        What such a case file looks like.
    files : tuple of str
        Figures, without their suffix, and animations that its page may come with.
    needs_density : str
        Beginning of a message, "a motion needs"; "" where it does without.
    takes : sequence of str
        Names of the arguments that may take the place of the file's.
    moving : bool
        Whether its results move, and are shown so at the top of their page.
    by_mass : bool
        Whether each mass rule of a file has a result of its own; otherwise its first has the one.
    arguments : dict
        Keyword arguments of its function: of `simulate`, `trace`, `modes` or `frf`.
    """

    kind: ClassVar[str]
    schema: ClassVar[type[CaseSchema]]
    files: ClassVar[tuple[str, ...]]
    needs_density: ClassVar[str]
    takes: ClassVar[Sequence[str]]
    moving: ClassVar[bool] = False
    by_mass: ClassVar[bool] = True

    def __init__(self, arguments: dict[str, Any]) -> None:
        self.arguments = arguments

    @classmethod
    def of(cls, schema: Any, case: Case) -> Self:
        """What the checked sections of a case file ask for."""
        return cls({k: value for k, value in schema.analysis.values().items() if k != "kind"})

    @abstractmethod
    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """Check a computation with one mass rule, as far as possible before it starts.

        changes : arguments that take the place of the file's.
        """

    @abstractmethod
    def line(self, name: str, result: xarray.Dataset) -> str:
        """Summarize the computation with the mass rule `name` in a line."""

    @staticmethod
    @abstractmethod
    def sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterable[Section]:
        """Sections of the page about results, by mass rule; the album draws their figures."""

    def page(
        self, case_file: CaseFile, results: ByRule, folder: Path, call: Call | None = None,
        figures: str | None = None,
    ) -> Path:  # fmt: skip
        """Show results, by mass rule, in an existing folder; returns the path of report.html.

        call : how they were asked for.
        figures : what figures are written as, "png", "svg" or "pdf"; None: none are drawn.
        """
        cases = {mass: case_file.case(mass) for mass in results}
        shown = case_file.output.nodes.tolist()
        sections = [
            *([stage(results, cases, case_file.heading, shown)] if self.moving else []),
            *filled(self.sections(case_file, results, Album(folder, figures))),
            *provenance(case_file, results, call),
        ]
        return write_report(sections, folder / "report.html", title=case_file.heading)

    def check(self, computations: Sequence[Compute], figures: bool) -> None:  # noqa: B027
        """Refuse computations of several mass rules that cannot run, or be drawn, together."""

    def shown(self, case: Case) -> NDArray[np.int64]:
        """Nodes to show where the file names none: those with a force, else all that can move."""
        return case.loaded_nodes if case.loaded_nodes.size else movable(case)


def movable(case: Case) -> NDArray[np.int64]:
    """Vertices that supports do not hold altogether."""
    vertices = len(case.structure.pattern.vertices)
    return np.flatnonzero(~case.fixed[:vertices].all(axis=1))


def arguments_of(function: Callable[..., Any]) -> tuple[str, ...]:
    """Names of the arguments of an analysis' function, but for what `run` itself gives."""
    own = {"case", "progress", "options", "kept"}
    return tuple(name for name in signature(function).parameters if name not in own)


def counted(number: int, what: str) -> str:
    """Write a number with its noun: "1 point", "2 points"."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


@dataclass(frozen=True, eq=False, repr=False)
class CaseFile:
    """A case file that has been read and checked.

    Attributes
    ----------
    path : Path
        The file.
    title : str
        Its title, or "".
    pattern : Pattern
    sheet : Sheet
    model : str
        "bars_and_hinges" or "shell".
    masses : list of str
        Mass rules, one or several to compare.
    analysis : Analysis
        What to compute; its `arguments` are those of `simulate`, `trace`, `modes` or `frf`.
    output : Output
    with_values : callable
        The file with other values of some keys, by key: ``with_values({"pattern.dihedral": 80})``.
    text : str
        What the file said when it was read; "" of a document that was not read from one.
    """

    path: Path
    title: str
    pattern: Pattern
    sheet: Sheet
    model: str
    masses: list[str]
    analysis: Analysis
    output: Output
    _schema: CaseSchema = field(repr=False)
    _make: Callable[[str], Case] = field(repr=False)
    with_values: Callable[[Mapping[str, Any]], CaseFile] = field(repr=False)
    _cases: dict[str, Case] = field(repr=False)
    text: str = field(default="", repr=False)

    def __repr__(self) -> str:
        """One line: the file, what it asks for, of what."""
        model = self.model.replace("_", " ")
        return f"<CaseFile {self.path}: {self.analysis.kind} of {model}, mass {self.masses}>"

    def _repr_html_(self) -> str | None:
        """A picture for notebooks."""
        return picture(self.pattern, repr(self))

    @property
    def heading(self) -> str:
        """Title of its page: its own, or the name of the file."""
        return self.title or self.path.stem

    @property
    def sweep(self) -> SweepSection | None:
        """Its table [sweep], None where it has none."""
        return self._schema.sweep

    @property
    def design(self) -> DesignSection | None:
        """Its table [design], None where it has none."""
        return self._schema.design

    @property
    def start_keys(self) -> dict[str, Any]:
        """What its table [initial] says; nothing where it has none."""
        section = getattr(self._schema, "initial", None)
        if section is None:
            return {}
        return {key: value for key, value in section.values().items() if key in section.stated}

    def case(self, mass: str | None = None) -> Case:
        """Case with one of the mass rules, by default the first that the file names."""
        rule = self._rule(mass)
        if rule not in self._cases:
            self._cases[rule] = self._make(rule)
        return self._cases[rule]

    @property
    def structures(self) -> Mapping[str, Any]:
        """Structures of the cases made so far, by mass rule."""
        return {rule: case.structure for rule, case in self._cases.items()}

    def initial(self, mass: str | None = None) -> State | None:
        """State that the motion or path starts from, or about which modes swing; None for rest.

        Parameters
        ----------
        mass : str, optional
            Mass rule, by default the first that the file names: it decides where the center of
            mass is.

        Raises
        ------
        InputError
            A support holds a node that the rigid motion moves; the result cannot be read or has
            other nodes.
        """
        return self.start(mass).state

    def start(self, mass: str | None = None) -> Start:
        """As `initial`, with the load factor of a stored state."""
        section = getattr(self._schema, "initial", None)
        with within("initial", self.path):
            return start_of(section, self.case(mass), self.path.parent)

    def run(
        self, mass: str | None = None, progress: bool = False, **changes: Any
    ) -> xarray.Dataset:
        """Compute what the file asks for.

        Parameters
        ----------
        mass : str, optional
            Mass rule, by default the first that the file names.
        progress : bool
            Whether to show a bar.
        **changes
            Arguments of `simulate`, `trace`, `modes` or `frf` that take the place of the file's.

        Returns
        -------
        xarray.Dataset
            What that function returns.

        Raises
        ------
        InputError
            The message names the file and the key.
        ComputationError
            The computation fails; what was computed until then is its `partial`.

        Examples
        --------
        >>> import foldyn as fd
        >>> case_file = fd.read_case(fd.studies.find_case("herkal/case1-static"))
        >>> path = case_file.run(load_factors=[0.0, 0.5])
        >>> path["load_factor"].values.tolist()
        [0.0, 0.5]
        """
        return self.computation(mass, **changes).run(progress)

    def computation(self, mass: str | None = None, **changes: Any) -> Computation:
        """A computation that is checked, but not begun; arguments as of `run`."""
        return Computation(self, self._rule(mass), changes)

    @contextmanager
    def placing(self, mass: str | None = None) -> Iterator[None]:
        """Put the file, the mass rule and the table of the key before bad input."""
        try:
            yield
        except InputError as error:
            if error.file is not None:
                raise
            place = self.named(mass) + self._section(error.key)
            raise error.within(place, self.path) from None

    def named(self, mass: str | None) -> str:
        """A mass rule for the beginning of a message, where the file has several."""
        return f'mass = "{mass}": ' if mass and len(self.masses) > 1 else ""

    def _section(self, key: str) -> str:
        """Table in which the file has a key, with a dot; "" for what is none."""
        for name in ("analysis", "output", "model"):
            if key in arguments(type(getattr(self._schema, name))):
                return f"{name}."
        return ""

    def _rule(self, mass: str | None) -> str:
        if mass is None:
            return self.masses[0]
        return choice("mass", mass, MODELS[self.model].masses)


class Computation:
    """One result of a case file, checked as far as possible before it is computed.

    Attributes
    ----------
    file : str
        Name for the file of the result.
    """

    def __init__(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> None:
        self.case_file, self.mass = case_file, mass
        for name in changes:
            choice("run: argument", name, case_file.analysis.takes)
        self.file = f"result-{mass}.nc" if len(case_file.masses) > 1 else "result.nc"
        with case_file.placing(mass):
            self.compute = case_file.analysis.prepare(case_file, mass, changes)

    @property
    def place(self) -> str:
        """Beginning of messages about it."""
        return f"{self.case_file.path}: {self.case_file.named(self.mass)}"

    def result(self, progress: bool = False, begun: Begun = lambda: None) -> xarray.Dataset:
        """Compute it; `begun` is called, at least once, when all input has been accepted."""
        with self.case_file.placing(self.mass):
            return self.compute(progress, begun)

    def run(self, progress: bool = False, begun: Begun = lambda: None) -> xarray.Dataset:
        """The result with what it says of its mesh, for whoever looks at it."""
        result = self.result(progress, begun)
        judged = refinement(self.case_file.case(self.mass))
        return result if judged is None else result.assign_attrs(judged.facts())
