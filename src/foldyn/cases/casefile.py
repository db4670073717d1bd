"""A case file that has been read: what it says, and the cases and states that it makes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.case import Case
from foldyn.cases.initial import Initial, rigid_motion
from foldyn.cases.models import MODELS
from foldyn.cases.state import State
from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.structures import Sheet
from foldyn.values import choice, show


@dataclass(frozen=True)
class Analysis:
    """What to compute.

    Attributes
    ----------
    kind : str
        "dynamics", "statics", "modes" or "frf".
    arguments : dict
        Keyword arguments of its function: `simulate`, `trace`, `modes` or `frf`.
    settings : dict
        Of a path: arguments of its `foldyn.statics.Settings`.
    """

    kind: str
    arguments: dict[str, Any]
    settings: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Output:
    """What to keep and show.

    Attributes
    ----------
    nodes : ndarray of int64
        Nodes that figures and spectra show.
    named : bool
        Whether the file names these nodes, or they are those of the default.
    axis : str or None
        Component that figures show, "x", "y" or "z", of a path also "-x", "-y" or "-z"; None: the
        one in which a node moves most.
    animation : str
        "gif" or "mp4".
    every : int, float or None
        Of a motion: interval between samples, steps (int) or seconds (float).
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
    animation: str = "gif"
    every: int | float | None = None
    max_frequency: float | None = None
    shapes: int | tuple[int, ...] | None = None
    quantity: str | None = None


@dataclass(frozen=True, eq=False)
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
    output : Output
    start : Initial or None
        How the motion or path starts, or about what modes swing, if not at rest; `initial` makes a
        state of it.
    """

    path: Path
    title: str
    pattern: Pattern
    sheet: Sheet
    model: str
    masses: list[str]
    analysis: Analysis
    output: Output
    start: Initial | None
    _parts: Mapping[str, Any] = field(repr=False)
    _cases: dict[str, Case] = field(repr=False)

    def case(self, mass: str | None = None) -> Case:
        """Case with one of the mass rules, by default the first that the file names."""
        rule = self.masses[0] if mass is None else choice("mass", mass, MODELS[self.model].masses)
        if rule not in self._cases:
            self._cases[rule] = build(self.path, self.pattern, self.sheet, rule, self._parts)
        return self._cases[rule]

    def initial(
        self, mass: str | None = None, read: Callable[[Path, int], State] | None = None
    ) -> State | None:
        """State that the motion or path starts from, or about which modes swing; None for rest.

        Parameters
        ----------
        mass : str, optional
            Mass rule, by default the first that the file names: it decides where the center of
            mass is.
        read : callable, optional
            Gives the state of a result's file at a sample, for files that start from one:
            ``lambda path, at: fd.initial_state(fd.load(path), at)``.

        Raises
        ------
        InputError
            A support holds a node that the rigid motion moves; the result cannot be read or has
            other nodes.
        """
        if self.start is None:
            return None
        case = self.case(mass)
        if self.start.file is None:
            with placed(self.path, "initial: "):
                return rigid_motion(case, self.start)
        if read is None:
            raise InputError(
                f"{self.path}: initial.file: needs a reader: case_file.initial(read=lambda path, "
                "at: foldyn.initial_state(foldyn.load(path), at))"
            )
        place = f"{self.path}: initial.file = {show(self.start.file)}: "
        try:
            state = read(self.path.parent / self.start.file, self.start.at)
        except InputError as error:
            of_sample = str(error).startswith("at =")
            raise InputError(
                f"{self.path}: initial.{error}" if of_sample else f"{place}{error}"
            ) from None
        wanted = len(case.structure.nodes)
        for array in (state.displacement, state.velocity):
            if array is not None and len(np.asarray(array)) != wanted:
                raise InputError(
                    f"{place}holds a motion of {len(np.asarray(array))} nodes, but this structure "
                    f"has {wanted}; give a result of the same pattern and model"
                )
        return state


def build(path: Path, pattern: Pattern, sheet: Sheet, mass: str, parts: Mapping[str, Any]) -> Case:
    """Make the case of a file with one mass rule."""
    with placed(path, "model: "):
        structure = MODELS[parts["model"]].make(pattern, sheet, mass=mass, **parts["options"])
        if sheet.density is not None:
            _ = structure.mass  # a rule may refuse this pattern: say so before anything runs
    with placed(path, ""):
        return Case(structure, parts["supports"], parts["loads"], parts["damping"])


@contextmanager
def placed(path: Path, place: str) -> Iterator[None]:
    """Put the file and the place in front of an error from a lower layer."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{path}: {place}{error}") from None
