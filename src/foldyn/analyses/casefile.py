"""`CaseFile`, a case file that has been read, and `Analysis`, the base of kinds of analysis."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from inspect import signature
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.analyses.provenance import Call, provenance
from foldyn.analyses.sections import CaseSchema, Choice, DesignSection, SweepSection
from foldyn.analyses.start import Start, start_of
from foldyn.arguments import arguments
from foldyn.cases import Case, State
from foldyn.cases.models import MODELS
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
"""Function that computes a result, with or without a progress bar. It calls its second argument at
least once, when all input has been accepted."""


@dataclass(frozen=True, eq=False)
class Output:
    """What results keep and pages show.

    Attributes
    ----------
    nodes : ndarray of int64
        Nodes that figures and spectra show.
    named : bool
        Whether the file names the nodes; otherwise they are the default nodes.
    axis : str or None
        Component that figures show: "x", "y" or "z", for paths also "-x", "-y" or "-z". None: the
        component with the largest motion of a node.
    animation : str or None
        Format of a film next to the page, "gif" or "mp4"; None: no film.
    max_frequency : float or None
        For motions: upper end of spectra (Hz); None: half the sampling rate.
    shapes : int, tuple of int or None
        For paths: number of drawn shapes, or the numbers of their points. For modes: number of
        drawn modes, or their numbers.
    quantity : str or None
        For frequency responses: "receptance", "mobility" or "accelerance"; None: as computed.
    stresses : bool
        For paths and motions: whether the page shows stresses.
    """

    nodes: NDArray[np.int64]
    named: bool = False
    axis: str | None = None
    animation: str | None = None
    max_frequency: float | None = None
    shapes: int | tuple[int, ...] | None = None
    quantity: str | None = None
    stresses: bool = False


class Analysis(ABC):
    """A kind of analysis in case files.

    A new kind is a subclass in its own file, listed in `analyses.registry`.

    Attributes
    ----------
    kind : str
        Name of the kind in case files.
    schema : type
        Schema of case files of this kind.
    files : tuple of str
        Files that its page may show: figures without a suffix, animations with it.
    needs_density : str
        Beginning of the message about a missing density, such as "a motion needs"; "" if the
        analysis needs no density.
    takes : sequence of str
        Names of arguments of `CaseFile.run` that can override the file.
    moving : bool
        Whether results move, and are shown in motion at the top of the page.
    by_mass : bool
        Whether each mass rule of a file has its own result; if not, only the first rule has one.
    arguments : dict
        Keyword arguments of its function: `simulate`, `trace`, `modes` or `frf`.
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
        """The analysis that the checked sections of a case file define."""
        return cls({k: value for k, value in schema.analysis.values().items() if k != "kind"})

    @abstractmethod
    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """Return a computation with one mass rule, checked as far as possible.

        changes : arguments that override the file.
        """

    @abstractmethod
    def line(self, name: str, result: xarray.Dataset) -> str:
        """Summary of a result in one line; `name` is its mass rule."""

    @staticmethod
    @abstractmethod
    def sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterable[Section]:
        """Sections of the page for results by mass rule; the album draws the figures."""

    def page(
        self, case_file: CaseFile, results: ByRule, folder: Path, call: Call | None = None,
        figures: str | None = None,
    ) -> Path:  # fmt: skip
        """Write the page of results by mass rule to an existing folder; return its path.

        call : the command or call that computed them.
        figures : file format of figures, "png", "svg" or "pdf"; None: no figures.
        """
        cases = {mass: case_file.case(mass) for mass in results}
        title, output, album = case_file.heading, case_file.output, Album(folder, figures)
        colors = album.stresses if output.stresses else None
        shown = output.nodes.tolist()
        sections = [
            *([stage(results, cases, title, shown, stresses=colors)] if self.moving else []),
            *filled(self.sections(case_file, results, album)),
            *provenance(case_file, results, call),
        ]
        return write_report(sections, folder / "report.html", title=title)

    def check(self, computations: Sequence[Compute], figures: bool) -> None:  # noqa: B027
        """Refuse computations of several mass rules that cannot be run or drawn together."""

    def shown(self, case: Case) -> NDArray[np.int64]:
        """Default nodes to show: the loaded nodes, or else all nodes that can move."""
        return case.loaded_nodes if case.loaded_nodes.size else movable(case)


def movable(case: Case) -> NDArray[np.int64]:
    """Vertices that supports do not hold along all axes."""
    return np.flatnonzero(~case.fixed[: len(case.structure.pattern.vertices)].all(axis=1))


def arguments_of(function: Callable[..., Any]) -> tuple[str, ...]:
    """Names of the arguments of an analysis function, except for those that `run` provides."""
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
        Title of the file, or "".
    pattern : Pattern
    sheet : Sheet
    choice : Choice
        The kind of model, and why.
    masses : list of str
        One mass rule, or several to compare.
    analysis : Analysis
        The analysis; its `arguments` are for `simulate`, `trace`, `modes` or `frf`.
    output : Output
    with_values : callable
        Returns the file with other values of keys: ``with_values({"pattern.dihedral": 80})``.
    text : str
        Text of the file; "" if the document was not read from a file.
    """

    path: Path
    title: str
    pattern: Pattern
    sheet: Sheet
    choice: Choice
    masses: list[str]
    analysis: Analysis
    output: Output
    _schema: CaseSchema = field(repr=False)
    _make: Callable[[str], Case] = field(repr=False)
    with_values: Callable[[Mapping[str, Any]], CaseFile] = field(repr=False)
    _cases: dict[str, Case] = field(repr=False)
    text: str = field(default="", repr=False)

    def __repr__(self) -> str:
        """One line: the file, its analysis, model and mass rules."""
        model = self.model.replace("_", " ")
        return f"<CaseFile {self.path}: {self.analysis.kind} of {model}, mass {self.masses}>"

    def _repr_html_(self) -> str | None:
        """A picture for notebooks."""
        return picture(self.pattern, repr(self))

    @property
    def model(self) -> str:
        """Kind of model: "bars_and_hinges", "shell" or "superelements"."""
        return self.choice.kind

    @property
    def heading(self) -> str:
        """Title of the page: the title of the case file, or its file name."""
        return self.title or self.path.stem

    @property
    def sweep(self) -> SweepSection | None:
        """Table [sweep] of the file; None if it has none."""
        return self._schema.sweep

    @property
    def design(self) -> DesignSection | None:
        """Table [design] of the file; None if it has none."""
        return self._schema.design

    @property
    def start_keys(self) -> dict[str, Any]:
        """Keys of the table [initial] of the file; empty if it has none."""
        section = getattr(self._schema, "initial", None)
        if section is None:
            return {}
        return {key: value for key, value in section.values().items() if key in section.stated}

    def case(self, mass: str | None = None) -> Case:
        """Case with one of the mass rules, by default the first of the file."""
        rule = self._rule(mass)
        if rule not in self._cases:
            self._cases[rule] = self._make(rule)
        return self._cases[rule]

    @property
    def structures(self) -> Mapping[str, Any]:
        """Structures of the cases made so far, by mass rule."""
        return {rule: case.structure for rule, case in self._cases.items()}

    def initial(self, mass: str | None = None) -> State | None:
        """Initial state of the motion or path, or state of the vibration; None for rest.

        Parameters
        ----------
        mass : str, optional
            Mass rule, by default the first of the file; it determines the center of mass.

        Raises
        ------
        InputError
            A support holds a node that the rigid motion moves, or the result cannot be read or has
            other nodes.
        """
        return self.start(mass).state

    def start(self, mass: str | None = None) -> Start:
        """The state of `initial`, with the load factor if it is a stored state."""
        section = getattr(self._schema, "initial", None)
        with within("initial", self.path):
            return start_of(section, self.case(mass), self.path.parent)

    def run(
        self, mass: str | None = None, progress: bool = False, **changes: Any
    ) -> xarray.Dataset:
        """Run the analysis of the file.

        Parameters
        ----------
        mass : str, optional
            Mass rule, by default the first of the file.
        progress : bool
            Whether to show a progress bar.
        **changes
            Arguments of `simulate`, `trace`, `modes` or `frf` that override the file.

        Returns
        -------
        xarray.Dataset
            The result of that function.

        Raises
        ------
        InputError
            The message names the file and the key.
        ComputationError
            The computation fails; its `partial` holds the results so far.

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
        """A checked computation that has not begun; arguments as in `run`."""
        return Computation(self, self._rule(mass), changes)

    @contextmanager
    def placing(self, mass: str | None = None) -> Iterator[None]:
        """Prefix messages about bad input with the file, the mass rule and the table."""
        try:
            yield
        except InputError as error:
            if error.file is not None:
                raise
            raise error.within(self.named(mass) + self._section(error.key), self.path) from None

    def named(self, mass: str | None) -> str:
        """Prefix of messages that names the mass rule; "" if the file has only one."""
        return f'mass = "{mass}": ' if mass and len(self.masses) > 1 else ""

    def _section(self, key: str) -> str:
        """Name of the table that has a key, followed by a dot; "" if no table has it."""
        for name in ("analysis", "output", "model"):
            if key in arguments(type(getattr(self._schema, name))):
                return f"{name}."
        return ""

    def _rule(self, mass: str | None) -> str:
        return self.masses[0] if mass is None else choice("mass", mass, MODELS[self.model].masses)


class Computation:
    """Computation of one result of a case file, checked as far as possible in advance.

    Attributes
    ----------
    file : str
        File name for the result.
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
        """Prefix of messages about this computation."""
        return f"{self.case_file.path}: {self.case_file.named(self.mass)}"

    def result(self, progress: bool = False, begun: Begun = lambda: None) -> xarray.Dataset:
        """Compute the result; `begun` is called at least once, when all input has been accepted."""
        with self.case_file.placing(self.mass):
            return self.compute(progress, begun)

    def run(self, progress: bool = False, begun: Begun = lambda: None) -> xarray.Dataset:
        """Compute the result, and add its model, if that was chosen, and its mesh error."""
        result = self.result(progress, begun)
        judged = refinement(self.case_file.case(self.mass))
        told = self.case_file.choice.told
        facts = {**({"model_choice": told} if told else {}), **(judged.facts() if judged else {})}
        return result.assign_attrs(facts) if facts else result
