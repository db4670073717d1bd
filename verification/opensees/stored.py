"""Stored results of OpenSees: files in `results`, written by `run`.

`<case>-d<divisions>.json` has statics and frequencies, `<case>-d<divisions>-dt<step>.npz` a motion.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

RESULTS = Path(__file__).parent / "results"


@dataclass(frozen=True, eq=False)
class Still:
    """Statics and frequencies of a case with one mesh.

    Attributes
    ----------
    node : (k,)
        The vertices that the case file reports.
    load_factor, displacement : (m,), (m, k, 3)
        Equilibria; m.
    frequency : (f,)
        Hz, at rest.
    about : dict
        Case, divisions, sizes, versions, processor time.
    """

    node: NDArray
    load_factor: NDArray
    displacement: NDArray
    frequency: NDArray
    about: dict[str, Any]


@dataclass(frozen=True, eq=False)
class Moved:
    """A motion of a case with one mesh and time step.

    Attributes
    ----------
    node : (k,)
        The vertices that the case file reports.
    time, displacement : (m,), (m, k, 3)
        s and m.
    about : dict
        Case, divisions, dt, iterations, sizes, versions, processor time.
    """

    node: NDArray
    time: NDArray
    displacement: NDArray
    about: dict[str, Any]


def write_still(result: Still, folder: Path) -> Path:
    """Write statics and frequencies; return the file."""
    about = result.about
    path = folder / f"{about['case']}-d{about['divisions']}.json"
    arrays = {name: value.tolist() for name, value in vars(result).items() if name != "about"}
    path.write_text(json.dumps({"about": about, **arrays}, indent=1) + "\n", "utf-8")
    return path


def read_still(case: str, divisions: int, folder: Path = RESULTS) -> Still:
    """Statics and frequencies of a case."""
    found = json.loads((folder / f"{case}-d{divisions}.json").read_text("utf-8"))
    about = found.pop("about")
    return Still(**{name: np.array(value) for name, value in found.items()}, about=about)


def write_motion(result: Moved, folder: Path) -> Path:
    """Write a motion, in single precision; return the file."""
    about = result.about
    path = folder / f"{about['case']}-d{about['divisions']}-dt{about['dt']:g}.npz"
    single = result.displacement.astype(np.float32)
    arrays = {"node": result.node, "time": result.time, "displacement": single}
    np.savez_compressed(path, **arrays, about=np.array(json.dumps(about)))
    return path


def read_motion(case: str, divisions: int, dt: float, folder: Path = RESULTS) -> Moved:
    """Motion of a case."""
    with np.load(folder / f"{case}-d{divisions}-dt{dt:g}.npz") as found:
        moved, about = found["displacement"].astype(float), json.loads(str(found["about"]))
        return Moved(found["node"], found["time"], moved, about)


def stored_divisions(case: str, folder: Path = RESULTS) -> list[int]:
    """Meshes with stored statics and frequencies, from coarse to fine."""
    return sorted(int(path.stem.rpartition("-d")[2]) for path in folder.glob(f"{case}-d*.json"))


def stored_motions(case: str, folder: Path = RESULTS) -> list[tuple[int, float]]:
    """Divisions and time steps of the stored motions, from coarse to fine."""
    found = []
    for path in folder.glob(f"{case}-d*-dt*.npz"):
        divisions, dt = path.stem.removeprefix(f"{case}-d").split("-dt")
        found.append((int(divisions), float(dt)))
    return sorted(found, key=lambda one: (one[0], -one[1]))
