"""The vibration of the paper's specimen, computed from shipped cases and compared with the paper.

`python -m verification.herkal.vibration` prints the table (about a minute).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import xarray

from foldyn.analyses import CaseFile
from foldyn.cases import Rayleigh
from foldyn.linear import character
from foldyn.signals import LogDecrement, log_decrement
from foldyn.studies.herkal.calibration import IN_AIR, WATCHED, shipped
from foldyn.studies.herkal.specimen.evaluation import corner_peaks
from foldyn.studies.herkal.specimen.page import ORDINALS
from foldyn.studies.herkal.targets import Verdict, verdicts
from verification.herkal.calibration import peak

TOP = 3  # top node in the middle
RELEASED = 2.0  # s: time at which the weight is removed
SETTLED = 0.05  # s from the release to the first minimum
PAIR, ALONE = Rayleigh(14.4, 4.1e-4), Rayleigh(15.8)


def specimen(
    name: str, damping: Rayleigh | None = None, changes: Mapping[str, Any] | None = None
) -> CaseFile:
    """Shipped case file of the specimen (such as "modes" or "frf-published"), optionally changed.

    Parameters
    ----------
    name : str
    damping : Rayleigh, optional
        Damping that replaces the damping of the file.
    changes : mapping, optional
        Changed values of keys.
    """
    own = {} if damping is None else asdict(damping)
    damped = {f"damping.{key}": value for key, value in own.items()}
    return shipped(f"specimen-{name}", {**(changes or {}), **damped})


class Peaks(NamedTuple):
    """Frequencies (Hz) and damping ratios of peaks; these are nan without half-power points."""

    frequencies: tuple[float, ...]
    damping: tuple[float, ...]


def response(
    published: bool = False, mass: str = "circumcenter", damping: Rayleigh = PAIR,
    air: bool = False, **changes: Any,
) -> Peaks:  # fmt: skip
    """Peaks of the specimen's response to a sine of 0.001 N on each top node.

    Parameters
    ----------
    published : bool
        Whether the folds have a moment at rest, as published.
    mass : str
    damping : Rayleigh
    air : bool
        Whether to include the mass of the surrounding air.
    **changes
        Further arguments of `frf`.
    """
    name = "frf-published" if published else "frf"
    damping = replace(damping, state="initial" if published else "rest")
    found = corner_peaks(specimen(name, damping, IN_AIR if air else None).run(mass, **changes))
    return Peaks(tuple(one.frequency for one in found), tuple(one.textbook for one in found))


@dataclass(frozen=True, eq=False)
class Release:
    """Free vibration of node 8 along x after the weight is removed.

    Attributes
    ----------
    decrement : LogDecrement
        Logarithmic decrement from the maxima, as in the paper; few maxima exceed a tenth of the
        first.
    frequency, damping_ratio : float
        Frequency (Hz) and damping of the strongest decaying cosine between 7 and 12 Hz: the motion
        has several modes, and maxima do not separate them.
    motion : xarray.Dataset
    """

    decrement: LogDecrement
    frequency: float
    damping_ratio: float
    motion: xarray.Dataset


def released() -> Release:
    """Free vibration of the specimen after its weight is removed."""
    motion = specimen("release").run()
    late = motion.sel(time=slice(RELEASED + SETTLED, None))
    x = late["displacement"].sel(node=WATCHED, axis="x").values
    step = float(late["time"][1] - late["time"][0])
    frequency, ratio = peak(x, step)
    return Release(log_decrement(x, step, frequency=frequency), frequency, ratio, motion)


def shapes(published: bool = False, mass: str = "circumcenter") -> xarray.Dataset:
    """Modes of the specimen with their character: variables `name` and `share_of_name`."""
    found = specimen("modes-published" if published else "modes").run(mass)
    what = character(found, "x")
    return found.assign(name=what["name"], share_of_name=what["share"].max("kind"))


def vibration() -> list[Verdict]:
    """The paper's values and ours, for stress-free folds and circumcenter mass."""
    pair = response()
    computed = {}
    for which, frequency, ratio in zip(ORDINALS, pair.frequencies, pair.damping, strict=False):
        computed[f"frf_{which}_peak"] = frequency
        computed[f"half_power_{which}"] = 100.0 * ratio
    decrement = released().decrement
    computed |= {
        "release_frequency": decrement.damped_frequency,
        "release_damping": 100.0 * decrement.damping_ratio,
    }
    return verdicts("specimen", computed)


def line(verdict: Verdict) -> str:
    """One line of text."""
    target = verdict.target
    return (
        f"{target.what}: {verdict.computed:.4g} {target.unit} beside "
        f"{verdict.asked} ({target.source}), {verdict.deviation:+.1%}: {verdict.word}"
    )


if __name__ == "__main__":
    for verdict in vibration():
        print(line(verdict))
    print("peaks in air (Hz):", *(f"{peak:.4g}" for peak in response(air=True).frequencies))
