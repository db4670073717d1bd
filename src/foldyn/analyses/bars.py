"""Progress bars of analyses."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from foldyn.errors import ComputationError, MotionInterrupted


class _Hidden:
    """Stands for a bar that is not shown."""

    n = total = 0.0

    def nothing(self, *_: Any, **__: Any) -> None:
        """Do nothing."""

    clear = close = update = set_postfix_str = set_description_str = nothing


def bar(shown: bool, **options: Any) -> Any:
    """Progress bar of tqdm, or a stand-in.

    tqdm is imported only if the bar is shown: the lock of tqdm outlives killed processes, such as
    workers of a fit.
    """
    if not shown:
        return _Hidden()
    from tqdm import tqdm

    return tqdm(leave=False, **options)


def share_bar(shown: bool, text: str) -> Any:
    """Progress bar of a computation that reports its completed share, from 0 to 1."""
    layout = "{desc}: {percentage:3.0f} %|{bar}| [{elapsed}<{remaining}]"
    return bar(shown, total=1.0, desc=text, bar_format=layout)


@contextmanager
def bar_closed(bar: Any, keeps: bool = False) -> Iterator[Any]:
    """Close a progress bar at the end.

    Partial results of an equilibrium search or a simulated motion are dropped: they belong to
    another kind of analysis.

    keeps : whether the partial result of an interrupted computation belongs to this kind.
    """
    try:
        yield bar
    except ComputationError as error:
        raise ComputationError(str(error)) from None
    except MotionInterrupted as stop:
        if keeps:
            raise
        raise KeyboardInterrupt(str(stop)) from None
    finally:
        bar.close()
