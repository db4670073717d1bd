"""From tracked histories to the free vibration to which a model is fitted.

The steps are the paper's: cut the window, start at the first turning point, subtract the final
position, and remove the trend.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foldyn import signals
from foldyn.errors import InputError
from foldyn.experiment import TimeHistory
from foldyn.studies.herkal.calibration import SEEN, WATCHED

GAP = 1 / 30  # s, longest gap that is filled: a third of a period
SLOWEST = 60.0  # smallest number of frames per second
SLACK = 0.015  # s, largest error of the instant of the release
SETTLED = 0.1  # share of the record, at its end, over which the final position is averaged
ROUNDED = 0.01  # largest rounding error of times, relative to the interval between them
FEWEST = 0.5  # smallest share of frames in which a node must be measured
HELD = 0.0125  # s: shortest time for which the node must stand still before the release
AVERAGED = 0.05  # s, over which the held position is averaged
STILL = 0.05  # largest drift of the held node, relative to its motion after the release
SLOW = 0.1  # largest speed of a held node, relative to its maximum speed
ENOUGH = 8  # smallest number of frames in which the watched node is measured


@dataclass(frozen=True, eq=False)
class FreeVibration:
    """Histories of a free vibration from the first turning point after a release.

    Attributes
    ----------
    history : TimeHistory
        Displacements of all nodes relative to their final positions, NaN while lost; time is 0 at
        the release, as accurately as it is known.
    whole : ndarray, shape (t, m)
        The same displacements with short gaps filled; NaN throughout for nodes with longer gaps.
    before : ndarray, shape (m,)
        Displacement of the nodes before the release (m), relative to the final position.
    released : float
        Time of the release in the record (s).
    steps : mapping of str to (time, values)
        Record of the watched node after each step (s, m).
    """

    history: TimeHistory
    whole: NDArray[np.float64]
    before: NDArray[np.float64]
    released: float
    steps: Mapping[str, tuple[NDArray[np.float64], NDArray[np.float64]]]

    @property
    def nodes(self) -> list[int]:
        """Numbers of the nodes."""
        return numbers_of(self.history)

    def of(self, nodes: list[int], name: str) -> TimeHistory:
        """History of some of the nodes."""
        columns = [self.nodes.index(node) for node in nodes]
        return replace(self.history, nodes=nodes, values=self.history.values[:, columns], name=name)

    def whole_of(self, one: TimeHistory) -> TimeHistory | None:
        """History of nodes that were never lost for long, with gaps filled; None without them.

        The model is not shifted in time to fit this history, because spectra do not depend on
        shifts.
        """
        columns = [self.nodes.index(node) for node in numbers_of(one)]
        kept = [k for k in columns if np.isfinite(self.whole[:, k]).all()]
        if not kept:
            return None
        nodes = [self.nodes[k] for k in kept]
        return replace(one, nodes=nodes, values=self.whole[:, kept], align=0.0)


def numbers_of(history: TimeHistory) -> list[int]:
    """Numbers of the nodes of a history."""
    return np.ravel(history.nodes).astype(int).tolist()


def _release_of(x: NDArray[np.float64], step: float, name: str) -> tuple[int, int]:
    """Find the release: the beginning of the fastest motion of a record.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Record of a node; NaN while it is lost.
    step : float
        Sampling interval (s).
    name : str
        Name of the record, for messages.

    Returns
    -------
    first, released : int
        First and last sample of the time in which the node is held still; the release follows.

    Raises
    ------
    InputError
        There are too few samples, or the node is not still before it moves.
    """
    known = np.flatnonzero(np.isfinite(x))
    if known.size < ENOUGH:
        raise InputError(f"{name} was measured in {known.size} frames; at least {ENOUGH} needed")
    speed = np.diff(x[known]) / np.diff(known)
    k = int(np.argmax(np.abs(speed)))
    least, sign = SLOW * abs(speed[k]), np.sign(speed[k])
    while k > 0 and sign * speed[k - 1] > least:
        k -= 1
    released = int(known[k])
    wander = np.abs(x[: released + 1] - x[released])
    moving = np.flatnonzero(wander > STILL * np.abs(x[known[k:]] - x[released]).max())
    first = max(int(moving[-1]) + 1 if moving.size else 0, released - round(AVERAGED / step))
    if (released - first) * step < HELD:
        raise InputError(
            f"{name} is not still for {HELD:g} s before its fastest motion, "
            f"{released * step:.3g} s after the beginning, so it is unknown how far the specimen "
            "was pressed; give a film that begins while the specimen is held"
        )
    return first, released


def _filled(x: NDArray[np.float64], start: int, stop: int, gap: int) -> NDArray[np.float64]:
    """Part of a record with short gaps filled; NaN throughout if a gap is longer."""
    known = np.flatnonzero(np.isfinite(x))
    before, after = known[known <= start], known[known >= stop - 1]
    if not before.size or not after.size:
        return np.full(stop - start, np.nan)
    first, last = int(before[-1]), int(after[0])
    if np.diff(known[(known >= first) & (known <= last)]).max() - 1 > gap:
        return np.full(stop - start, np.nan)
    return signals.fill_gaps(x[first : last + 1], gap)[start - first : stop - first]


def prepare(measured: TimeHistory) -> FreeVibration:
    """Prepare the histories of a film in which a specimen is held and released.

    Parameters
    ----------
    measured : TimeHistory
        Histories of all tracked nodes along the axis, including `WATCHED`, which marks the release.

    Raises
    ------
    InputError
        The watched node was not measured, is not still before the release, was lost for long while
        it swings, or does not swing; or there are fewer than 60 frames per second.
    """
    nodes, name = numbers_of(measured), f"{measured.name}: node {WATCHED}"
    if WATCHED not in nodes:
        raise InputError(f"{name} was not measured; its motion shows the release")
    column, time = nodes.index(WATCHED), _even(measured.time)
    step = float(time[1] - time[0])
    if step * SLOWEST > 1.001:
        raise InputError(
            f"{measured.name}: {1.0 / step:.3g} frames per second are too few for a vibration of "
            f"10 Hz; {SLOWEST:g} are needed"
        )
    gap = round(GAP / step)
    held, released = _release_of(measured.values[:, column], step, name)
    stop = min(len(time), released + 1 + round(SEEN / step))
    window = measured.values[released:stop]
    first, swing = _known(window[:, column], name, gap)
    stop = released + first + len(swing)
    turn = first + _turn(swing, name)
    x = measured.values[released + turn : stop]
    last = _mean(x[-max(1, round(SETTLED * len(x))) :])
    seen = np.isfinite(last) & (np.isfinite(x).mean(axis=0) >= FEWEST)
    final = last[seen]
    times = time[released + turn : stop] - time[released]
    kept = [node for node, there in zip(nodes, seen, strict=True) if there]
    history = replace(
        measured, nodes=kept, time=times, values=x[:, seen] - final,
        align=min(SLACK, float(times[0])),
        detrend="linear", delay=0.0,
    )  # fmt: skip
    records = measured.values[:, seen].T
    whole = np.stack([_filled(one, released + turn, stop, gap) for one in records], axis=1)
    whole -= final
    before = _mean(measured.values[held : released + 1, seen]) - final
    shown = swing[turn - first :]
    resting = signals.subtract_final(shown, SETTLED)
    since = time - time[released]
    steps = {
        "as tracked": (since, measured.values[:, column]),
        "from the release on": (since[released:stop], window[:, column]),
        "from the first turning point on": (times, shown),
        "less its final position": (times, resting),
        "without the line of best fit": (times, signals.remove_trend(resting)),
    }
    return FreeVibration(history, whole, before, float(time[released]), steps)


def _even(time: NDArray[np.float64]) -> NDArray[np.float64]:
    """Evenly spaced times, if the given times differ from even spacing only by rounding."""
    even = np.linspace(time[0], time[-1], len(time))
    if np.abs(time - even).max() > ROUNDED * (even[1] - even[0]):
        signals.sampling_interval(time)  # reports the error
    return even


def _turn(swing: NDArray[np.float64], name: str) -> int:
    """Index of the first turning point."""
    try:
        return signals.first_turning_point(swing)
    except InputError:
        raise InputError(
            f"{name} does not swing back after it moved fastest: no release, or one that is damped "
            "too much; cut the film so that the release is its fastest motion"
        ) from None


def _known(x: NDArray[np.float64], name: str, gap: int) -> tuple[int, NDArray[np.float64]]:
    """Record of the watched node after its last long gap, and the index of its first sample."""
    known = np.flatnonzero(np.isfinite(x))
    long = np.flatnonzero(np.diff(known) - 1 > gap)
    first, last = (int(known[long[-1] + 1]) if len(long) else int(known[0])), int(known[-1])
    if last + 1 - first < len(x) // 2:
        raise InputError(
            f"{name} was lost for more than {gap} frames while it swings; light the specimen "
            "better, or film it from nearer"
        )
    return first, signals.fill_gaps(x[first : last + 1], gap)


def _mean(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean over time of the measured samples, shape (m,); NaN for nodes without samples."""
    known = np.isfinite(x)
    count = known.sum(axis=0)
    return np.where(count > 0, np.where(known, x, 0.0).sum(axis=0) / np.maximum(count, 1), np.nan)
