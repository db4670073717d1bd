"""Progress reports of long runs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from foldyn.errors import InputError


class Progress(NamedTuple):
    """State of a run: simulated time and duration (s), steps done, relative energy error."""

    time: float
    duration: float
    steps: int
    energy_error: float


Reporter = Callable[[Progress], None]


@contextmanager
def reported(choice: bool | Reporter | None) -> Iterator[Reporter]:
    """Reporter for the argument `progress`: none, a bar on stderr (True), or the user's own."""
    if choice is not None and not isinstance(choice, bool) and not callable(choice):
        raise InputError(f" = {choice!r}: give True, False or a function of a Progress", "progress")
    if choice is not True:
        yield choice if callable(choice) else lambda _: None
        return
    from tqdm import tqdm

    layout = "{l_bar}{bar}| {n:.3g}/{total:.3g} s [{elapsed}<{remaining}{postfix}]"
    first: list[float] = []  # time of the first report: compilation is over then
    bar = tqdm(total=1.0, bar_format=layout, leave=False, mininterval=0.0)

    def show(state: Progress) -> None:
        bar.total = state.duration
        if not first:
            first.append(time.perf_counter())
        pace = state.steps / max(time.perf_counter() - first[0], 1e-9)
        text = f"{pace:,.0f} steps/s, energy error {state.energy_error:.1e}"
        bar.set_postfix_str(text, refresh=False)
        bar.update(state.time - bar.n)

    with bar:
        yield show
