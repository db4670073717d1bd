"""Evaluations of a model; each one is computed once, and kept in a file."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from foldyn.results.seal import seal, sound
from foldyn.store import Store, name_of
from foldyn.sweeps.pool import Pool
from foldyn.writing import made_folder, whole

Point = TypeVar("Point")
_VALUE = "value "  # prefix, in files, of the names of values


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Values of a model at a point.

    Attributes
    ----------
    values : dict of str to ndarray
    failure : str
        Why values are missing; "" if none are.
    warnings : str
        Text of the warnings; "" if there were none.
    seconds : float
        Computing time.
    lasting : bool
        Whether a repetition would give the same. If not (such as after a lack of memory), the
        evaluation is not kept.
    """

    values: Mapping[str, NDArray] = field(default_factory=dict)
    failure: str = ""
    warnings: str = ""
    seconds: float = 0.0
    lasting: bool = True


class Evaluations(Generic[Point]):
    """Evaluations at points, each computed once. Several threads may use it at the same time.

    Parameters
    ----------
    pool : Pool
        Computes an `Evaluation` for a point.
    stamp : callable
        Returns everything that a point's evaluation depends on, as JSON types.
    folder : path, optional
        Folder that keeps every evaluation; stored evaluations are not recomputed.
    tell : callable, optional
        Called with each point, its evaluation, and whether the evaluation was found in the folder.
    """

    def __init__(
        self,
        pool: Pool[Point, Evaluation],
        stamp: Callable[[Point], Any],
        folder: str | os.PathLike[str] | None = None,
        tell: Callable[[Point, Evaluation, bool], None] | None = None,
    ) -> None:
        self.pool, self.stamp, self.tell = pool, stamp, tell
        self.folder = None if folder is None else made_folder(folder)
        self.computed = self.found = 0
        self._known: dict[Point, Evaluation] = {}
        self._lock = Lock()

    def at(
        self,
        points: Sequence[Point],
        lost: Callable[[Point, str], Evaluation] | None = None,
        first: bool = False,
    ) -> list[Evaluation]:
        """Evaluations at several points, in parallel as far as the pool allows.

        Parameters
        ----------
        points : sequence
        lost : callable, optional
            As in `Pool.each`.
        first : bool
            Compute one point before the others, so that the others find the kernels compiled.
        """
        new = [point for point in dict.fromkeys(points) if not self._look(point)]
        if new:
            self.pool.each(new, self._keep, lost, first)
        return [self._known[point] for point in points]

    def _look(self, point: Point) -> bool:
        """Whether a point is known, or stored in the folder."""
        if point not in self._known and self.folder is not None:
            name = name_of(self.stamp(point))
            found = KEPT.find(self.folder / f"{name}.npz", name)
            if found is not None:
                self._count(point, found, True)
        return point in self._known

    def _keep(self, point: Point, found: Evaluation) -> None:
        if self.folder is not None and found.lasting:
            name = name_of(self.stamp(point))
            KEPT.keep(self.folder / f"{name}.npz", name, found)
        self._count(point, found, False)

    def _count(self, point: Point, found: Evaluation, kept: bool) -> None:
        with self._lock:
            self._known[point] = found
            self.found += kept
            self.computed += not kept
            if self.tell is not None:
                self.tell(point, found, kept)


def _read(file: Path) -> tuple[str, Evaluation]:
    """Stamp and evaluation in a file; raise ValueError if it is damaged."""
    if not sound(file):
        raise ValueError
    with np.load(file) as kept:
        names = [name for name in kept.files if name.startswith(_VALUE)]
        values = {name.removeprefix(_VALUE): kept[name] for name in names}
        if any(array.dtype.kind not in "iuf" for array in values.values()):
            raise ValueError
        failure, warnings = str(kept["failure"]), str(kept["warnings"])
        return str(kept["stamp"]), Evaluation(values, failure, warnings, float(kept["seconds"]))


def _write(file: Path, stamp: str, found: Evaluation) -> None:
    texts = {"stamp": stamp, "failure": found.failure, "warnings": found.warnings}
    values: dict[str, Any] = {f"{_VALUE}{name}": array for name, array in found.values.items()}
    facts: dict[str, Any] = {name: np.array(text) for name, text in texts.items()}
    with whole(file) as part:
        np.savez(part, seconds=np.array(found.seconds), **facts, **values)
        seal(part)


KEPT: Store[Evaluation] = Store(_read, _write, warns=False)
"""Files with seals; a damaged file counts as missing."""
