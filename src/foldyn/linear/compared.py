"""`Fidelity`: the result of a comparison with the shell, mode by mode, and its advice."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from textwrap import fill
from typing import NamedTuple

import numpy as np
import xarray

from foldyn.errors import InputError
from foldyn.linear.advice import OWN, advice, percent
from foldyn.linear.matched import LEAST
from foldyn.values import choice

ABREAST, WIDE = 4, 79  # models side by side in plain text, and characters of a line

__all__ = ["OWN", "ComparedMode", "Fidelity"]


class ComparedMode(NamedTuple):
    """A mode of the shell and its partner in a model.

    Attributes
    ----------
    mode : int
        Number of the elastic mode of the shell, from 1.
    shell : float
        Frequency of the mode, Hz, extrapolated in mesh size.
    mesh_error : float
        Relative error of the finest mesh against it.
    below : bool
        Whether it lies below 0.6 of the plate frequency.
    error : float
        Relative error of the partner's frequency; infinite if the mode is lost, i.e. no mode of the
        model has a MAC of 0.5 or more with it.
    mac : float
        Modal assurance criterion of the two.
    """

    mode: int
    shell: float
    mesh_error: float
    below: bool
    error: float
    mac: float


@dataclass(frozen=True, eq=False, repr=False)
class Fidelity:
    """A comparison of models with the shell, from `foldyn.fidelity`.

    Parameters
    ----------
    result : xarray.Dataset
        Numbers of the comparison, from `fidelity` or from `fd.load` of such a result.
        Dimensions mode and model; the attribute `limit` is 0.6 of the plate frequency (Hz).

    Raises
    ------
    InputError
        Not a result of this kind.
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
        """One line: how many modes of which models."""
        below = int((self.result["frequency"].values < self.limit).sum())
        return (
            f"<Fidelity of {', '.join(self.models)}: {self.result.sizes['mode']} modes, {below} "
            f"below {self.limit:.4g} Hz>"
        )

    def __str__(self) -> str:
        """A table in plain text, and the advice."""
        return f"{_text(self)}\n\n{_wrapped(self.advice)}"

    @property
    def models(self) -> tuple[str, ...]:
        """Names of the models: "own", then the others."""
        return tuple(self.result["model"].values.tolist())

    @property
    def limit(self) -> float:
        """0.6 of the plate frequency, Hz: above it, panels vibrate as plates."""
        return float(self.result.attrs["limit"])

    @property
    def advice(self) -> str:
        """The model to use and up to which frequency, and the limits of the comparison."""
        return advice(self.result)

    def table(self, model: str = OWN) -> tuple[ComparedMode, ...]:
        """Modes of the shell, each paired with a mode of the model."""
        one = self.result.sel(model=choice("model", model, self.models))
        names = ("mode", "frequency", "mesh_error", "error", "mac")
        columns = (one[name].values.tolist() for name in names)
        return tuple(
            ComparedMode(mode, shell, mesh, shell < self.limit, error, mac)
            for mode, shell, mesh, error, mac in zip(*columns, strict=True)
        )


def _wrapped(text: str) -> str:
    """A text in lines, with numbers kept next to their units."""
    held = re.sub(r"(\d) (%|Hz)", "\\1\u00a0\\2", text)
    return fill(held, WIDE).replace("\u00a0", " ")


def _text(found: Fidelity) -> str:
    """Modes and errors of all models in aligned columns, in blocks of models."""
    parts = [
        _columns(found, found.models[k : k + ABREAST]) for k in range(0, len(found.models), ABREAST)
    ]
    parts.append("\n".join(legend(found)))
    return "\n\n".join(parts)


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
        lines.append(f"shell: graded toward vertices, within {radius:g} m of which it is stiff")
    return lines


def _columns(found: Fidelity, models: tuple[str, ...]) -> str:
    """Modes and errors of some models."""
    result = found.result.sel(model=list(models))
    tables = [found.table(model) for model in models]
    rows = [["mode", "shell", *(text for model in models for text in (model, "MAC"))]]
    for every in zip(*tables, strict=True):
        first = every[0]
        row = [f"{first.mode}{'' if first.below else ' *'}", f"{first.shell:.4g} Hz"]
        for mode in every:
            row += [percent(mode.error) if math.isfinite(mode.error) else "lost"]
            row += [f"{mode.mac:.2f}"]
        rows.append(row)
    if "deflection" in result:
        row = ["small loads", f"{result['deflection'].item():.4g} m"]
        for error in result["deflection_error"].values.tolist():
            row += [percent(error) if math.isfinite(error) else "soft", ""]
        rows.append(row)
    ratios = (text for ratio in result["cost_ratio"].values for text in (f"1/{ratio:.0f}", ""))
    rows.append(["cost", f"{result['seconds'].item():.2g} s", *ratios])
    wide = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for first, *others in rows:
        shell, *cells = (text.rjust(n) for text, n in zip(others, wide[1:], strict=True))
        pairs = map(" ".join, zip(cells[::2], cells[1::2], strict=True))
        lines.append("  ".join([first.ljust(wide[0]), shell, *pairs]).rstrip())
    return "\n".join(lines)
