"""Abaqus: a sheet that repeats as the section of a shell or beam, or as the material of a solid.

Keywords and the order of the numbers follow the Abaqus Keywords Reference Guide. CalculiX reads the
material, too; it expands shells to solids, and has no section with a stiffness of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray

from foldyn.errors import InputError

IN_A_LINE = 8
SOLID = [0, 1, 2, 5, 4, 3]  # 11, 22, 33, 12, 13, 23 in the order of `effective`
COUPLED = 1e-6  # of twist with the rest, relative to the diagonal: a smaller one is round-off


def section(result: xarray.Dataset) -> Iterator[str]:
    """Lines of the section, or the material, of a result of `effective` in one state.

    Raises
    ------
    InputError
        A chain or tube that twists when it is stretched or bent, or several states.
    """
    if "state" in result.dims:
        raise InputError(": has several states; choose one, as result.isel(state=0)", "result")
    density = line(result["density"].item()) if "density" in result else ""
    if "membrane" in result:
        membrane, bending = result["membrane"].values, result["bending"].values
        coupling = result["coupling"].values
        matrix = np.block([[membrane, coupling], [coupling.T, bending]])
        yield "** A repeated sheet as a plate, made by Foldyn, in SI units. Elements lie in the"
        yield "** plane of its center of mass. Shells that shear need *TRANSVERSE SHEAR STIFFNESS."
        yield "*ORIENTATION, NAME=SHEET_AXES"
        yield line(*result["frame"].values[:2].ravel().tolist())
        yield "3, 0."
        weighed = f", DENSITY={density}" if density else ""
        yield f"*SHELL GENERAL SECTION, ELSET=SHEET, ORIENTATION=SHEET_AXES{weighed}"
    elif "pair" in result.coords:
        matrix = result["stiffness"].values[np.ix_(SOLID, SOLID)]
        yield "** A repeated sheet as a solid, made by Foldyn, in SI units, along the axes of space"
        yield "*MATERIAL, NAME=SOLID"
        if density:
            yield from ("*DENSITY", density)
        yield "*ELASTIC, TYPE=ANISOTROPIC"
    else:
        yield from _beam(result, density)
        return
    half = np.concatenate([matrix[: k + 1, k] for k in range(6)]).tolist()
    for k in range(0, len(half), IN_A_LINE):
        yield line(*half[k : k + IN_A_LINE])


def _beam(result: xarray.Dataset, density: str) -> Iterator[str]:
    """Lines of the section of a beam, for moduli of 1 Pa: its areas are stiffnesses."""
    stiffness, frame = result["stiffness"].values, result["frame"].values
    size = np.sqrt(np.diag(stiffness))
    if (np.abs(stiffness[1]) > COUPLED * size[1] * size)[[0, 2, 3]].any():
        raise InputError(
            ": of a chain or tube that twists when it is stretched or bent, which no general "
            "section of a beam does; use the numbers of its stiffness in a program that does",
            "result",
        )
    area, _, up, across = stiffness[0]
    bending = stiffness[2:, 2:] - np.outer(stiffness[2:, 0], stiffness[0, 2:]) / area
    yield "** A repeated chain or tube as a beam, made by Foldyn, in SI units. Nodes lie on the"
    yield "** line through its center of mass."
    weighed = f", DENSITY={line(result['density'].item() / area)}" if density else ""
    yield f"*BEAM GENERAL SECTION, ELSET=BEAM, SECTION=GENERAL{weighed}"
    yield line(area, bending[0, 0], -bending[0, 1], bending[1, 1], stiffness[1, 1])
    yield line(*frame[1].tolist())
    yield "1., 1."
    yield from ("*CENTROID", line(-across / area, up / area))


def line(*values: Any) -> str:
    """A line of data, in numbers of at most 20 columns."""
    return ", ".join(f"{one:.12g}" if isinstance(one, float) else str(one) for one in values)
