"""Cost of contact: `python benchmarks/contact.py`.

First the time of an explicit step with contact and without, of Miura sheets of paper that vibrate
in the open, so that nothing touches. Runs with and without contact take turns; the quickest of each
counts. Then search and force where two sheets lie on each other, beside those of ipctk, where it is
installed, on one thread.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from importlib.util import find_spec

import numpy as np

import foldyn as fd
from foldyn.errors import FoldynWarning
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.kernels import add_contact
from foldyn.mechanics.contact.search import list_pairs

# cells, steps of a run
SHEETS = {(4, 3): 20_000, (30, 30): 200, (100, 100): 20}
METHODS = ("rk4", "central_difference")
TURNS = 3
LAYERS = ((4, 3), (30, 30), (100, 100))  # cells of each of two sheets
NEAR = 0.7  # of the thickness: distance of the two
PAPER = fd.Sheet(1.219e9, 0.2, 0.24e-3, 690.0, length_scale_ratio=2.7)


def sheet(cells: tuple[int, int], dihedral: float) -> fd.Structure:
    """A folded sheet."""
    pattern = fd.patterns.miura(cells=cells, a=0.02, b=0.02, panel_angle=60, dihedral=dihedral)
    return fd.discretize(pattern, PAPER, mass="mixed_voronoi", preset="plate")


def step_times(structure: fd.Structure, method: str, steps: int) -> tuple[float, float]:
    """Seconds of a step without contact and with it."""
    start = 0.02 * np.random.default_rng(1).standard_normal(structure.nodes.shape)
    best, dt = [np.inf, np.inf], 0.5 * fd.critical_step(fd.Case(structure), method)
    for _ in range(TURNS):
        for k, contact in enumerate((None, fd.Contact())):
            case = fd.Case(structure, contact=contact)
            run = fd.simulate(
                case, steps * dt, method=method, dt=dt, every_steps=steps,
                initial=fd.State(velocity=start),
            )  # fmt: skip
            best[k] = min(best[k], float(run.attrs["wall_seconds"]) / steps)
    return best[0], best[1]


def list_time(structure: fd.Structure) -> tuple[float, int]:
    """Seconds of a list of near pairs, and how many pairs it has."""
    contact = fd.Case(structure, contact=fd.Contact()).contact_term
    contact.contact(np.zeros(structure.nodes.size))
    tables, kept = contact.tables, contact.memory
    seconds = quickest(lambda: list_pairs(tables, kept.listed, kept))
    return seconds, int(kept.counts.listed_first + kept.counts.listed_second)


def quickest(function: Callable[[], object]) -> float:
    """Seconds of a call, the least of a few."""
    best = np.inf
    for _ in range(2 * TURNS):
        begun = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - begun)
    return float(best)


def two_sheets(cells: tuple[int, int]) -> tuple[fd.Structure, np.ndarray]:
    """Two sheets that are apart at rest, and the displacement (n, 3) that lays one on the other."""
    pattern = fd.patterns.miura(cells=cells, a=0.02, b=0.02, panel_angle=60, dihedral=60)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)  # that they have no edge in common
        both = pattern.joined(pattern.moved((0.0, 0.0, 0.05)))
    structure = fd.discretize(both, PAPER, preset="plate")
    u = np.zeros_like(structure.nodes)
    upper = len(pattern.vertices)
    a, b, c = (structure.nodes[structure.triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    tilt = np.abs(normals[:, 2] / np.linalg.norm(normals, axis=1)).mean()
    u[upper:, 2] = NEAR * PAPER.thickness / tilt - 0.05
    return structure, u


def own_times(structure: fd.Structure, u: np.ndarray) -> tuple[float, int, float, int]:
    """Seconds of the search, pairs that it lists, seconds of the force, pairs that touch."""
    contact = fd.Case(structure, contact=fd.Contact()).contact_term
    contact.contact(u.ravel())
    tables, kept = contact.tables, contact.memory
    search = quickest(lambda: list_pairs(tables, u, kept))
    use_near(kept)
    angles, force = structure.body.angles(u.ravel()), np.zeros_like(u)
    kept.counts.watched, kept.counts.hinges = 1, 1
    seconds = quickest(lambda: add_contact(tables, u, angles, force, kept))
    counts = kept.counts
    listed = int(counts.listed_first + counts.listed_second)
    return search, listed, seconds, int(counts.near_first + counts.near_second)


def use_near(kept: Memory) -> None:
    """Have the pairs that touch among the near ones, and no others, as in a motion."""
    for kind, name in enumerate(("first", "second")):
        near = np.flatnonzero(kept.gap[kind, : getattr(kept.counts, f"listed_{name}")] < 0.0)
        kept.near[kind, : len(near)] = near
        setattr(kept.counts, f"near_{name}", len(near))


def ipctk_times(structure: fd.Structure, u: np.ndarray) -> tuple[float, int, float, int]:
    """The same by ipctk: candidates within the same distance, then those that act."""
    import ipctk

    ipctk.set_num_threads(1)
    thickness, skin = (
        PAPER.thickness,
        fd.Case(structure, contact=fd.Contact()).contact_term.tables.skin,
    )
    mesh = ipctk.CollisionMesh(
        np.asfortranarray(structure.nodes), ipctk.edges(structure.triangles), structure.triangles
    )
    x = np.asfortranarray(structure.nodes + u)
    candidates, collisions = ipctk.Candidates(), ipctk.NormalCollisions()

    def find() -> None:
        candidates.build(mesh, x, 0.5 * (thickness + skin))
        collisions.build(candidates, mesh, x, thickness)  # looks at distances, as the other does

    search = quickest(find)
    potential = ipctk.BarrierPotential(thickness, 1.0)
    seconds = quickest(lambda: potential.gradient(collisions, mesh, x))
    return search, len(candidates), seconds, len(collisions)


def main() -> None:
    """Print two tables."""
    steps_table()
    print("\n| dofs | by | search (ms) | pairs | ns a pair | force (ms) | touch | ns a pair |")
    print("|---|---|---|---|---|---|---|---|")
    ways = {"foldyn": own_times} | ({"ipctk": ipctk_times} if find_spec("ipctk") else {})
    for cells in LAYERS:
        structure, u = two_sheets(cells)
        for name, times in ways.items():
            search, listed, force, touching = times(structure, u)
            print(
                f"| {u.size:,} | {name} | {1e3 * search:.2f} | {listed:,} | "
                f"{1e9 * search / listed:.0f} | {1e3 * force:.3f} | {touching:,} | "
                f"{1e9 * force / touching:.0f} |",
                flush=True,
            )


def steps_table() -> None:
    """Print the times of steps."""
    print("| dofs | method | without (us) | with (us) | ratio | list (ms) | pairs |")
    print("|---|---|---|---|---|---|---|")
    for cells, steps in SHEETS.items():
        structure = sheet(cells, 60.0)
        listed, pairs = list_time(structure)
        for method in METHODS:
            off, on = step_times(structure, method, steps)
            print(
                f"| {structure.nodes.size:,} | `{method}` | {1e6 * off:.1f} | {1e6 * on:.1f} | "
                f"{on / off:.2f} | {1e3 * listed:.2f} | {pairs:,} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
