"""Check, before CUDA is imported, whether a GPU supports a case and whether there is one."""

from __future__ import annotations

import importlib.util
from dataclasses import MISSING, fields
from typing import Any

import numpy as np
from numba import config

from foldyn.cases import Case
from foldyn.dynamics.system import PackedCase
from foldyn.errors import InputError
from foldyn.mechanics.constant_damping import DampingMatrix
from foldyn.mechanics.membranes_term import MembranesTerm
from foldyn.mechanics.springs import SpringsTerm
from foldyn.mechanics.viscous import Viscous, ViscousTerm
from foldyn.structures.bars_hinges import BarsHingesTerm
from foldyn.structures.bars_plates import BarsPlatesTerm

# fields of a case that are checked
FIELDS = "structure", "supports", "loads", "damping", "masses", "contact"
METHODS = "rk4", "central_difference"
OLDEST = 12, 0  # oldest CUDA version of a driver that works
TERMS = MembranesTerm, SpringsTerm, DampingMatrix, ViscousTerm
MOST_GROUPS, MOST_BARS, MOST_KINDS = 8, 16, 3  # energy groups; bars of a panel; kinds of panels


def check_gpu(method: str) -> None:
    """Refuse a method without GPU kernels or a machine without GPU, and name what is missing."""
    if method not in METHODS:
        raise InputError(
            f' = "gpu": {method} has no GPU kernel; choose one of {", ".join(METHODS)}, or '
            'device = "cpu"',
            "device",
        )
    if why := no_card():
        raise InputError(f' = "gpu": {why}', "device")


def no_card() -> str:
    """Reason why no GPU can be used here, with the remedy; empty if one can."""
    if config.ENABLE_CUDASIM:  # type: ignore[attr-defined]
        return ""
    if importlib.util.find_spec("numba_cuda") is None:
        return (
            "numba-cuda is not installed; install it with: "
            'pip install "foldyn[gpu]" "numba-cuda[cu13]"'
        )
    from numba import cuda

    if not cuda.is_available():
        return (
            "no NVIDIA GPU with a driver is found here (check with nvidia-smi); "
            'device = "cpu" needs none'
        )
    version = tuple(cuda.driver.driver.get_version())
    if version < OLDEST:
        return (
            f"the driver of the GPU is too old: it has CUDA {version[0]}.{version[1]}, and CUDA "
            f"{OLDEST[0]}.{OLDEST[1]} is needed; update it"
        )
    return ""


def check_taken(case: Case, packed: PackedCase) -> None:
    """Refuse a case that has a part without GPU kernel, and name the part."""
    if lack := lacking(case, packed):
        raise InputError(f' = "gpu": {lack} has no GPU kernel; use device = "cpu"', "device")


def lacking(case: Case, packed: PackedCase) -> str:
    """Name of a part of the case that has no GPU kernel; empty if all parts have one.

    A field or term that is not listed here counts as unsupported.
    """
    for field in fields(case):
        if field.name not in FIELDS and not _is_default(field, getattr(case, field.name)):
            return f"{field.name} of the case"
    system, body = packed.system, packed.body
    if type(body.sheet) not in (BarsHingesTerm, BarsPlatesTerm):
        return f"the model {type(body.sheet).__name__.removesuffix('Term')}"
    bars = packed.model.bars if type(body.sheet) is BarsPlatesTerm else packed.model
    if packed.model.addresses.any() or bars.addresses.any():
        return "a law of your own"
    if not packed.mass.lumped:
        return "a constraint" if len(system.ties.slave) else "a mass matrix that is not diagonal"
    drives = {
        "a support that moves": system.moves, "a rest angle that changes": system.turns,
        "a load that depends on the displacement": system.follows,
    }  # fmt: skip
    for what, there in drives.items():
        if there:
            return what
    for term in body.others:
        if type(term) not in TERMS:
            return f"the term {type(term).__name__.removesuffix('Term')}"
        if term.histories:
            return "a spring or cable that follows a history"
        if isinstance(term, SpringsTerm) and term.springs.lines.addresses.any():
            return "a bar with a law of your own"
        if isinstance(term, ViscousTerm) and _mixed(term.elements):
            return "a damper at nodes and at dofs without mass"
        if isinstance(term, MembranesTerm) and len(term.membranes.stiffness) > MOST_BARS:
            return f"a panel with more than {MOST_BARS} bars and gives"
    for kind, what in ((SpringsTerm, "springs"), (ViscousTerm, "dampers")):
        if sum(isinstance(term, kind) for term in body.others) > 1:
            return f"a second set of {what}"
    if sum(isinstance(term, MembranesTerm) for term in body.others) > MOST_KINDS:
        return f"a sheet with more than {MOST_KINDS} kinds of panels"
    return f"more than {MOST_GROUPS} energies" if len(body.energy_groups) > MOST_GROUPS else ""


def _mixed(elements: Viscous) -> bool:
    """Whether dampers act on dofs without mass beside those of nodes."""
    dofs = elements.dofs[len(elements.axial) :]
    return bool((elements.hidden_turn.any(axis=1) & (dofs[:, 0] != dofs[:, 1])).any())


def _is_default(field: Any, value: Any) -> bool:
    """Whether a field of a case has its default value."""
    default = field.default if field.default_factory is MISSING else field.default_factory()
    return value is default or (value is not None and np.array_equal(value, default))
