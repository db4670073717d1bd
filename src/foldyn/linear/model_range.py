"""Warnings about frequencies at which a model lacks the vibrations of single panels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import ModelRangeWarning, warn
from foldyn.structures.discretized import Discretized
from foldyn.structures.plate_frequency import range_of


def warn_beyond(
    structure: Discretized,
    frequency: NDArray,
    name: str = "",
    internal: int | None = None,
) -> None:
    """Warn about frequencies (k,), Hz, above the range of the model.

    Parameters
    ----------
    structure : Discretized
    frequency : (k,)
        Frequencies of modes, of responses, or the highest of each band; nan is ignored.
    name : str
        Name of the numbered items, "mode" or "band"; empty if the frequencies are the input.
    internal : int or None
        Internal amplitudes of each panel; None if the analysis has none.
    """
    limit, share = range_of(structure, internal or 0)
    above = np.flatnonzero(frequency > limit)
    if not len(above):
        return
    what = f"frequencies up to {frequency[above].max():.4g} Hz lie"
    if name:
        together = len(above) > 2 and above[-1] - above[0] == len(above) - 1
        numbers = f"{above[0] + 1} to {above[-1] + 1}"
        numbers = numbers if together else ", ".join(str(k + 1) for k in above)
        what = f"{name} {numbers} lies" if len(above) == 1 else f"{name}s {numbers} lie"
    remedy = "take the shell, fd.shell"
    if internal == 0:
        scheme = "" if structure.options.scheme == "n5b8e" else 'preset = "n5b8e" with '
        remedy = f"take {scheme}internal = 3, or the shell"
    warn(
        f"{what} above {limit:.4g} Hz, {share:g} of the panels' own frequency, where most modes of "
        f"this model are more than 10 % off or missing: {remedy}",
        "fidelity.md#vibration",
        ModelRangeWarning,
    )
