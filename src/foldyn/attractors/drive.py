"""The harmonic drive of a case: its frequency, and the case with other histories or levels."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np

from foldyn import cases
from foldyn.cases import Case, Constant, Harmonic, History, as_history
from foldyn.cases.releases import refuse_releases
from foldyn.cases.springs import refuse_varying
from foldyn.errors import InputError

WHOLE = 1e-9  # relative tolerance for integer ratios of frequencies
HARMONIC = (
    'fd.Harmonic(frequency=...) (in a case file, history = { kind = "harmonic", frequency = ... })'
)
SIZES: Mapping[type, str] = {
    cases.Force: "vector",
    cases.TotalForce: "total",
    cases.LineLoad: "force_per_length",
    cases.Gravity: "acceleration",
    cases.Pressure: "pressure",
    cases.CreaseMoment: "moment",
    cases.Temperature: "change",
    cases.Impose: "value",
    cases.BaseMotion: "value",
    cases.Plane: "motion",
    cases.Air: "velocity",
}
"""The field that holds the size of a load, of a support's or plane's motion, or of the wind."""


def drive_frequency(case: Case) -> float:
    """Lowest frequency (Hz) of the harmonic histories of a case; 0.0 without any.

    Raises
    ------
    InputError
        The other frequencies are not multiples of the lowest, so that the drive has no period.
    """
    driven = [part for _, part in _parts(case) if _is_driven(part)]
    return lowest_frequency([part.history.frequency for part in driven])


def lowest_frequency(frequencies: Sequence[float]) -> float:
    """The lowest frequency (Hz), of which all others must be multiples; 0.0 without any."""
    lowest = min(frequencies, default=0.0)
    for frequency in frequencies:
        ratio = frequency / lowest
        if abs(ratio - round(ratio)) > WHOLE * ratio:
            raise InputError(
                f"history.frequency = {frequency:g}: is no multiple of the lowest one "
                f"({lowest:g} Hz), so that the drive has no period; give multiples"
            )
    return lowest


def driven_frequency(case: Case, name: str) -> float:
    """`drive_frequency` of a case; refuses cases without drive, or with a drive not harmonic."""
    check_harmonic(case, name)
    if frequency := drive_frequency(case):
        return frequency
    raise InputError(f"case: nothing drives it; give a load or a support the history {HARMONIC}")


def check_harmonic(case: Case, name: str) -> None:
    """Refuse histories that are neither harmonic nor constant, and stiffness that varies."""
    refuse_varying(case)
    refuse_releases(case, name)
    for place, part in _parts(case):
        history = as_history(getattr(part, "history", None))
        if not isinstance(history, Constant | Harmonic):
            raise InputError(
                f": is of the kind {history.kind!r}, and {name} takes harmonic and constant ones; "
                f"give {HARMONIC}, or leave it out",
                f"{place}.history",
            )


def with_histories(case: Case, history: Callable[[Harmonic], History]) -> Case:
    """The case with other histories in place of its harmonic histories."""
    return _altered(case, lambda part: replace(part, history=history(part.history)))


def at_frequency(case: Case, frequency: float) -> Case:
    """The case with another lowest drive frequency (Hz); higher ones keep their ratio to it."""
    ratio = frequency / drive_frequency(case)
    return with_histories(case, lambda own: replace(own, frequency=ratio * own.frequency))


def at_level(case: Case, level: float) -> Case:
    """The case with its harmonic loads, gusts and moving supports and planes scaled by a level.

    Raises
    ------
    InputError
        The case has creases that are actuated harmonically; their angles cannot be scaled.
    """

    def scaled(part: Any) -> Any:
        if type(part) not in SIZES:
            raise InputError(
                f"amplitudes: {type(part).__name__} has no size to scale; vary the frequency, or "
                "drive by a force or a support"
            )
        field = SIZES[type(part)]
        size = level * np.asarray(getattr(part, field), float)
        return replace(cast(Any, part), **{field: size.tolist()})

    return _altered(case, scaled)


def _altered(case: Case, change: Callable[[Any], Any]) -> Case:
    """The case, with each part that has a harmonic history changed."""

    def changed(parts: Sequence[Any]) -> list[Any]:
        return [change(part) if _is_driven(part) else part for part in parts]

    contact = case.contact
    if contact is not None:
        contact = replace(contact, planes=changed(contact.planes))
    air = case.air if case.air is None else changed([case.air])[0]
    loads, supports = changed(case.loads), changed(case.supports)
    return case.altered(loads=loads, supports=supports, contact=contact, air=air)


def _parts(case: Case) -> Iterator[tuple[str, Any]]:
    """Parts that may have an active history, each with its field (for messages)."""
    planes = () if case.contact is None else case.contact.planes
    listed = {"loads": case.loads, "supports": case.supports, "contact.planes": planes}
    for name, parts in listed.items():
        yield from ((f"{name}[{k}]", part) for k, part in enumerate(parts))
    if case.air is not None and case.air.blows:
        yield "air", case.air


def _is_driven(part: Any) -> bool:
    return isinstance(getattr(part, "history", None), Harmonic)  # in still air it has no effect
