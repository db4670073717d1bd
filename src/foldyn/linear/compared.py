"""`Fidelity`: models beside superelements or the shell, mode by mode."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from textwrap import fill
from typing import NamedTuple

import numpy as np
import xarray

from foldyn.cases.models import SUPERELEMENTS
from foldyn.errors import InputError
from foldyn.linear.reference import LEAST, NO_LIMIT
from foldyn.values import choice

ABREAST, WIDE = 4, 79  # in plain text: models side by side, and characters per line

__all__ = ["OWN", "ComparedMode", "Fidelity"]
OWN = "own"
"""Name of the case's own model."""
WITHIN = "10 % up to"
LARGEST = 0.10  # error of a usable model
MESH = 0.02  # larger mesh errors are mentioned
SCOPE = (
    "Only small vibrations about rest and small loads were compared: motions and loads that turn "
    "creases far are not covered."
)


def against(result: xarray.Dataset) -> str:
    """What the models are compared with, in sentences."""
    return SUPERELEMENTS if result.attrs["reference"] == SUPERELEMENTS else "the shell"


def percent(value: float) -> str:
    """Format a fraction with its sign: "+2.1 %", "-34 %"."""
    return f"{100.0 * value:+.{0 if abs(value) >= 0.1 else 1}f} %"


def size(value: float) -> str:
    """Format the size of a fraction, without a sign."""
    return percent(abs(value))[1:]


def _mesh(result: xarray.Dataset) -> Iterator[str]:
    """Errors of the reference itself."""
    if "touched_clamp" in result.attrs:
        yield (
            f"No mesh converges: {NO_LIMIT.format(result.attrs['touched_clamp'])}. Clamp an edge "
            "of that panel, not its corner alone."
        )
        return
    below = int((result["frequency"].values < result.attrs["limit"]).sum())
    error = np.abs(result["mesh_error"].values[: below or None])
    if result.attrs["reference"] == SUPERELEMENTS:
        if error.max() > MESH:
            yield (
                f"The superelements are themselves up to {size(float(error.max()))} off, by their "
                "own estimate."
            )
        return
    unsettled = ", ".join(str(k + 1) for k in np.flatnonzero(np.isnan(error)))
    if unsettled:
        yield (
            f"The meshes of the shell have not converged for mode{'s' * (',' in unsettled)} "
            f"{unsettled}, so that errors there are uncertain; compare again with finer divisions."
        )
    elif error.max() > MESH:
        yield (
            f"The finer mesh of the shell is itself about {size(float(error.max()))} off its "
            "limit: compare again with finer divisions."
        )


class ComparedMode(NamedTuple):
    """A mode of the reference, superelements or the shell, and its partner in a model.

    Attributes
    ----------
    mode : int
        Number of the elastic mode of the reference, from 1.
    shell : float
        Frequency of the mode, Hz, for the limit of fine meshes.
    mesh_error : float
        Relative error of the frequency on the finest mesh, or as superelements estimate it.
    below : bool
        Whether the mode lies below 0.6 of the plate frequency.
    error : float
        Relative error of the partner's frequency; infinite if the mode is lost, i.e. no mode of the
        model has a MAC of 0.5 or more with it.
    mac : float
        Modal assurance criterion of the mode and its partner.
    """

    mode: int
    shell: float
    mesh_error: float
    below: bool
    error: float
    mac: float


@dataclass(frozen=True, eq=False, repr=False)
class Fidelity:
    """A comparison of models with superelements or the shell, from `foldyn.fidelity`.

    Parameters
    ----------
    result : xarray.Dataset
        Numbers of the comparison, from `fidelity`, or from a file by `fd.load`.
        Dimensions mode and model; the attribute `limit` is 0.6 of the plate frequency (Hz).

    Raises
    ------
    InputError
        Not a result of a comparison.
    """

    result: xarray.Dataset

    def __post_init__(self) -> None:
        """Check the kind of the result."""
        kind = getattr(self.result, "attrs", {}).get("foldyn_result")
        if kind != "fidelity":
            raise InputError(
                f": is {'no result' if kind is None else f'a result of the kind {kind}'}; give one "
                "of fidelity",
                "result",
            )

    def __repr__(self) -> str:
        """One line with the models and the number of modes."""
        below = int((self.result["frequency"].values < self.limit).sum())
        return (
            f"<Fidelity of {', '.join(self.models)}: {self.result.sizes['mode']} modes, {below} "
            f"below {self.limit:.4g} Hz>"
        )

    def __str__(self) -> str:
        """A table in plain text, and notes."""
        return "\n\n".join([_text(self), *(fill(note, WIDE) for note in self.notes)])

    @property
    def models(self) -> tuple[str, ...]:
        """Names of the models: "own", then the others."""
        return tuple(self.result["model"].values.tolist())

    @property
    def limit(self) -> float:
        """0.6 of the plate frequency, Hz: above it, panels vibrate as plates."""
        return float(self.result.attrs["limit"])

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know about the numbers, in sentences."""
        soft = int(self.result["soft_hinges"].sel(model=OWN))
        told = (
            f"{soft} hinges of the case's own model are superlinear and have no stiffness at rest: "
            "take linear bends, or judge it with a secant amplitude (secant = 1, in degrees)."
        )
        return (*_mesh(self.result), *([told] if soft else []), SCOPE)

    def holds_to(self, model: str = OWN) -> float:
        """Frequency (Hz) of the highest mode up to which a model is within 10 %; 0 if none is."""
        error = np.abs(self.result["error"].sel(model=choice("model", model, self.models)).values)
        good = int((np.append(error, np.inf) > LARGEST).argmax())
        return float(self.result["frequency"].values[good - 1]) if good else 0.0

    def table(self, model: str = OWN) -> tuple[ComparedMode, ...]:
        """Modes of the reference, each paired with a mode of the model."""
        one = self.result.sel(model=choice("model", model, self.models))
        names = ("mode", "frequency", "mesh_error", "error", "mac")
        columns = (one[name].values.tolist() for name in names)
        return tuple(
            ComparedMode(mode, shell, mesh, shell < self.limit, error, mac)
            for mode, shell, mesh, error, mac in zip(*columns, strict=True)
        )


def _text(found: Fidelity) -> str:
    """Modes and errors of all models in aligned columns, in blocks of models."""
    models = found.models
    parts = [_columns(found, models[k : k + ABREAST]) for k in range(0, len(models), ABREAST)]
    return "\n\n".join([*parts, "\n".join(legend(found))])


def legend(found: Fidelity) -> list[str]:
    """Meaning of the words and signs that the table contains."""
    deflection = found.result.get("deflection_error")
    lines = [f"{OWN}: the model of the case"]
    if not np.isfinite(found.result["error"].values).all():
        lines.append(f"lost: no mode of the model has this shape (MAC below {LEAST:g})")
    if deflection is not None and not np.isfinite(deflection.values).all():
        lines.append("soft: the model at rest has no stiffness against these loads")
    if any(not mode.below for mode in found.table()):
        lines.append(f"* above 0.6 of the plate frequency, {found.limit:.4g} Hz")
    if "vertex_radius" in found.result.attrs:
        radius = found.result.attrs["vertex_radius"]
        name = found.result.attrs["reference"]
        lines.append(f"{name}: graded toward vertices, within {radius:g} m of which it is stiff")
    return lines


def _columns(found: Fidelity, models: tuple[str, ...]) -> str:
    """Modes and errors of some models."""
    result = found.result.sel(model=list(models))
    tables = [found.table(model) for model in models]
    header = [text for model in models for text in (model, "MAC")]
    rows = [["mode", result.attrs["reference"], *header]]
    for every in zip(*tables, strict=True):
        first = every[0]
        row = [f"{first.mode}{'' if first.below else ' *'}", f"{first.shell:.4g} Hz"]
        for mode in every:
            row += [percent(mode.error) if math.isfinite(mode.error) else "lost", f"{mode.mac:.2f}"]
        rows.append(row)
    if "deflection" in result:
        row = ["small loads", f"{result['deflection'].item():.4g} m"]
        for error in result["deflection_error"].values.tolist():
            row += [percent(error) if math.isfinite(error) else "soft", ""]
        rows.append(row)
    held = (text for model in models for text in (f"{found.holds_to(model):.4g} Hz", ""))
    rows.append([WITHIN, "", *held])
    wide = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for first, *others in rows:
        shell, *cells = (text.rjust(n) for text, n in zip(others, wide[1:], strict=True))
        pairs = map(" ".join, zip(cells[::2], cells[1::2], strict=True))
        lines.append("  ".join([first.ljust(wide[0]), shell, *pairs]).rstrip())
    return "\n".join(lines)
