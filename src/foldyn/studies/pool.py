"""Tasks run in processes; each keeps its own result, so that interrupted work resumes."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Protocol

from foldyn.errors import OF_MODELS, FoldynError, FoldynWarning
from foldyn.sweeps.pool import pool_of


class Task(Protocol):
    """A computation; it is hashable and can be sent to another process."""

    @property
    def name(self) -> str:
        """Name of the task."""
        ...

    def there(self, folder: Path) -> bool:
        """Whether its result is in a folder."""
        ...

    def make(self, folder: Path) -> None:
        """Compute its result into a folder."""
        ...


@dataclass(frozen=True)
class Done:
    """Outcome of a task.

    Attributes
    ----------
    task : Task
    seconds : float
        Computing time; 0 if skipped.
    skipped : bool
        Whether its result already existed.
    failure : str
        Reason for a missing result, or "".
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
        The longest first.
    folder : Path
        Existing folder for the results.
    tell : callable
        Called with the outcome of each task.
    processes : int
        Number of parallel processes; 1 means this process.

    Returns
    -------
    list of Done
        A failing task does not stop the others.
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
