"""Tasks that run in processes; each keeps its own result, so that interrupted work resumes.

A file records the settings of its task and a digest of the program's sources; results of another
version of the program are recomputed.
"""

from __future__ import annotations

import time
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import xarray

from foldyn.errors import OF_MODELS, FoldynError, FoldynWarning
from foldyn.store import Store
from foldyn.sweeps.pool import pool_of

SETTINGS = "study_settings"


class Task(ABC):
    """A computation whose result is kept by `store` in a file named `name` plus `suffix`.

    A task is hashable and can be sent to another process.
    """

    store: ClassVar[Store[Any]]
    suffix: ClassVar[str] = ".nc"

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the task, and of its file."""

    @abstractmethod
    def settings(self) -> dict[str, Any]:
        """Everything on which the result depends."""

    @abstractmethod
    def compute(self, folder: Path) -> Any:
        """Compute the result, which may depend on other results in the folder."""

    def file(self, folder: Path) -> Path:
        """File of the result in a folder."""
        return folder / f"{self.name}{self.suffix}"

    def result(self, folder: Path) -> Any:
        """The result in a folder; None if it is missing or was computed with other settings."""
        return self.store.find(self.file(folder), self.settings())

    def there(self, folder: Path) -> bool:
        """Whether the result is in a folder."""
        return self.result(folder) is not None

    def make(self, folder: Path) -> None:
        """Compute the result and store it in a folder."""
        self.store.keep(self.file(folder), self.settings(), self.compute(folder))


def datasets(read: Callable[[Path], xarray.Dataset], write: Callable[..., Any]) -> Store:
    """Store of datasets that are read and written by these functions."""

    def stamped(file: Path) -> tuple[str, xarray.Dataset]:
        found = read(file)
        return found.attrs.get(SETTINGS, ""), found

    def stamp(file: Path, settings: str, result: xarray.Dataset) -> None:
        write(result.assign_attrs({SETTINGS: settings}), file)

    return Store(stamped, stamp)


@dataclass(frozen=True)
class Done:
    """Outcome of a task.

    Attributes
    ----------
    task : Task
    seconds : float
        Computing time; 0 if skipped.
    skipped : bool
        Whether the result already existed.
    failure : str
        Reason why the task failed, or "".
    warnings : tuple of str
        Warnings of the task.
    """

    task: Task
    seconds: float = 0.0
    skipped: bool = False
    failure: str = ""
    warnings: tuple[str, ...] = ()


def run(
    tasks: Iterable[Task],
    folder: Path,
    tell: Callable[[Done], None] = lambda done: None,
    processes: int = 2,
) -> list[Done]:
    """Run tasks whose results are not yet in a folder.

    Parameters
    ----------
    tasks : iterable of Task
        Tasks, the longest first.
    folder : Path
        Existing folder for the results.
    tell : callable
        Called with the outcome of each task.
    processes : int
        Number of parallel processes; 1 means this process.

    Returns
    -------
    list of Done
        Outcomes of all tasks; a failing task does not stop the others.
    """
    ended: list[Done] = []

    def end(done: Done) -> None:
        ended.append(done)
        tell(done)

    left: list[Task] = []
    for task in dict.fromkeys(tasks):
        if task.there(folder):
            end(Done(task, skipped=True))
        else:
            left.append(task)
    with pool_of(partial(_make, folder=folder), min(processes, max(len(left), 1))) as pool:
        pool.each(left, lambda _, done: end(done))
    return ended


def _make(task: Task, folder: Path) -> Done:
    began = time.perf_counter()
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            task.make(folder)
            failure = ""
        except FoldynError as error:
            failure = str(error)
    messages = [
        str(one.message)
        for one in told
        if issubclass(one.category, FoldynWarning) and not issubclass(one.category, OF_MODELS)
    ]
    return Done(task, time.perf_counter() - began, False, failure, tuple(dict.fromkeys(messages)))
