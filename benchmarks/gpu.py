"""A GPU against two processor cores: what must hold of it, its speed, and what limits it.

    python benchmarks/gpu.py [agreement] [sweeps] [models] [sheets] [largest] [--out measured.csv]
    ncu --clock-control none -k regex:advance --set full python benchmarks/gpu.py --profile 100 303

Miura sheets of N5B8 panels (100 x 100 cells have 241,203 dofs, 303 x 303 have 2,207,055) and
specimens of 4 x 3 cells, 333 dofs: 512 different ones, of more each several times. `--profile`
runs launches of up to STEPS steps of `rk4` for each size, for Nsight Compute (the last one counts),
and counts the work that they do at least.
"""

# ruff: noqa: E402  (the environment must be set before the imports)

from __future__ import annotations

import os

CORES = 2
os.sched_setaffinity(0, set(sorted(os.sched_getaffinity(0))[:CORES]))
os.environ["NUMBA_NUM_THREADS"] = str(CORES)

import argparse
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import machine
import numpy as np
import xarray
from ensemble import specimen
from problem import SHAKE, case_of

import foldyn as fd
from foldyn.dynamics.driver import prepare
from foldyn.dynamics.gpu import card
from foldyn.dynamics.gpu.engine import Launches, Places
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.motion_state import StepPlan

warnings.simplefilter("ignore")
METHODS = "rk4", "central_difference"
SMALL, SHEETS = (4, 3), ((4, 3), (30, 30), (60, 60), (100, 100))
LARGEST = 303, 303
COUNTS = 1, 8, 64, 512, 4096
DIFFERENT, POINTS = 512, 64
PART = 0.05  # of the critical step: the energies of shaken sheets balance
STEPS = 40  # of a launch that is profiled
CASE_FILE = """
[pattern]
kind = "miura"
cells = [4, 3]
panel_angle = 60
dihedral = 120
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
[model]
preset = "herkal"
fold_law = "enhanced"
[damping]
alpha = 0.0628
[[supports]]
nodes = "xmin"
[[loads]]
nodes = "xmax"
force = [0, 0, -1e-3]
history = {{ kind = "half_sine", duration = 0.5 }}
[analysis]
kind = "dynamics"
method = "rk4"
duration = {duration}
[output]
interval = 0.05
"""


def shaken(case: fd.Case) -> fd.State:
    """A start at random."""
    moved = SHAKE * np.random.default_rng(0).standard_normal(case.fixed.shape)
    return fd.State(np.where(case.fixed, 0.0, moved))


def off(mine: xarray.Dataset, alone: xarray.Dataset, *names: str) -> float:
    """Largest difference of variables, relative to the largest value of any of them."""
    pairs = [(mine[name].values, alone[name].values) for name in names]
    return max(np.abs(a - b).max() for a, b in pairs) / max(np.abs(b).max() for _, b in pairs)


def told(what: str, mine: Any, again: Any, alone: Any) -> None:
    """Say how far the same motions are apart."""
    same = all(mine[name].equals(again[name]) for name in mine.data_vars if name != "case")
    energies = [name for name in mine.data_vars if mine[name].attrs.get("units") == "J"]
    print(
        f"{what}: displacement off by {off(mine, alone, 'displacement'):.1e}, energies by "
        f"{off(mine, alone, *energies):.1e}; their errors {mine.attrs['energy_error']:.3e} and "
        f"{alone.attrs['energy_error']:.3e}; two runs {'are' if same else 'ARE NOT'} bit-identical",
        flush=True,
    )


def plates_of(cells: tuple[int, int], stiffer: float = 1.0) -> fd.Case:
    """A Miura sheet of `n5b8e`, clamped along an edge of one panel and held at the others' ends."""
    pattern = fd.patterns.miura(cells, panel_angle=60.0, dihedral=120.0)
    x = pattern.vertices[:, 0]
    held, far = np.flatnonzero(x <= 1e-9), np.flatnonzero(x >= x.max() - 1e-9)
    edge = next((a, b) for a, b in pattern.boundary.tolist() if {a, b} <= {*held.tolist()})
    structure = fd.discretize(
        pattern, fd.Sheet(1e6 * stiffer, 0.25, 0.01, density=1.0), preset="n5b8e",
        fold_law="enhanced", mass="mixed_voronoi", clamped=[edge],
    )  # fmt: skip
    load = fd.Force(far, (0.0, 0.0, -1e-4))
    return fd.Case(structure, [fd.Fix(held)], [load], fd.Rayleigh(alpha=0.0628))


def agreement() -> None:
    """Motions of 1,000 steps on both."""
    for method in METHODS:
        sheets = [case_of(cells, "enhanced") for cells in ((4, 3), (30, 30))]
        plates = [plates_of(cells) for cells in ((4, 3), (15, 15))]
        for case in sheets + plates:
            dt = PART * fd.critical_step(case, method)
            given = {"dt": dt, "every_steps": 100, "initial": shaken(case)}
            one, two = (
                fd.simulate(case, 1000 * dt, method=method, device="gpu", **given) for _ in range(2)
            )
            what = case.structure.massless or "hinges"
            told(f"{method}, {case.fixed.size} dofs, {what}", one, two, fd.simulate(
                case, 1000 * dt, method=method, **given
            ))  # fmt: skip
        specimens = [specimen("enhanced", k) for k in range(16)]
        for cases in (specimens, [plates_of(SMALL, 1.0 + 0.01 * k) for k in range(16)]):
            dt = PART * fd.critical_step(cases[-1], method)
            given = {"dt": dt, "every_steps": 100, "method": method, "initial": shaken(cases[0])}
            one, two = (fd.simulate_many(cases, 1000 * dt, device="gpu", **given) for _ in range(2))
            alone = fd.simulate_many(cases, 1000 * dt, device="cpu", **given)
            told(f"{method}, {len(cases)} models of {cases[0].fixed.size} dofs", one, two, alone)


def prepared(case: fd.Case, method: str) -> Motion:
    """A motion with a step that is right for all of these sheets."""
    dt = 0.2 * fd.critical_step(case_of((2, 2), "enhanced"), method)
    return prepare(case, 10_000 * dt, method, dt, 10_000, shaken(case), force=True)


def launches_of(motions: list[Motion], wide: bool) -> Launches:
    """Them on the card."""
    states = [motion.state for motion in motions]
    u, v, carry, angle = (
        np.stack([getattr(state, name) for state in states])
        for name in ("u", "v", "carry", "angle")
    )
    places = Places(u, v, carry, np.zeros((len(motions), 4)), angle)
    plans = [motion.plan for motion in motions]
    return Launches([m.packed for m in motions], plans, motions[0].method.name, places, wide)


def seconds(launches: Launches, count: int, steps: int) -> float:
    """Seconds of a step of all models, from one launch."""

    def run(first: int, last: int) -> float:
        clock = time.perf_counter()
        ends = (np.full(count, number) for number in (first, last, 1))
        launches.run(*ends)
        return time.perf_counter() - clock

    run(1, 2)
    short, long = run(3, 3 + steps // 4), run(5 + steps // 4, 5 + steps // 4 + steps)
    return (long - short) / (steps - steps // 4)


def of_two_cores(method: str) -> float:
    """Steps of specimens per second by two processes, each on a core."""
    command = [sys.executable, __file__, "--alone", method]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(CORES)]
    return sum(1.0 / float(each.communicate()[0]) for each in running)


def alone(method: str) -> None:
    """Print the seconds of a step of a specimen."""
    case = specimen("enhanced", 0)
    dt = 0.2 * fd.critical_step(case, method)
    fd.simulate(case, 100 * dt, method=method, dt=dt, every_steps=100)
    print(
        fd.simulate(case, 4e4 * dt, method=method, dt=dt, every_steps=40_000).attrs["wall_seconds"]
        / 4e4
    )


def throughput() -> list[str]:
    """Model steps per second of many specimens; rows of the table."""
    cases, rows = [specimen("enhanced", k) for k in range(DIFFERENT)], []
    for method in METHODS:
        processor = of_two_cores(method)
        motions = [prepared(case, method) for case in cases]
        for count in COUNTS:
            some = (motions * -(-count // DIFFERENT))[:count]
            launches = launches_of(some, wide=False)
            speed = count / seconds(launches, count, 2000 if count < 1000 else 400)
            rows.append(f"models,{method},{count},{speed:.4g},{processor:.4g}")
            print(f"{rows[-1]}: {speed / processor:.1f} times two cores", flush=True)
    return rows


def sheets() -> list[str]:
    """Seconds of a step of one sheet; rows of the table."""
    rows = []
    for cells in SHEETS:
        case = case_of(cells, "enhanced")
        for method in METHODS if cells == SHEETS[-1] else METHODS[:1]:
            mine = seconds(launches_of([prepared(case, method)], wide=True), 1, 2000)
            rows.append(row(case, method, mine))
    return rows


def row(case: fd.Case, method: str, mine: float) -> str:
    """The line of a sheet, whose steps the processor takes, too."""
    steps = max(20, int(2e6 / case.fixed.size))
    dt = 0.2 * fd.critical_step(case_of((2, 2), "enhanced"), method)
    given = {"dt": dt, "every_steps": steps, "initial": shaken(case), "force": True}
    own = fd.simulate(case, steps * dt, method=method, **given).attrs
    return line(case, method, mine, own["wall_seconds"] / own["steps"], own["threads"])


def line(case: fd.Case, method: str, mine: float, alone: float, cores: int) -> str:
    """The line of a sheet in the table."""
    text = f"dofs,{method},{case.fixed.size},{mine:.4g},{alone:.4g}"
    print(f"{text}: {alone / mine:.1f} times {cores} cores", flush=True)
    return text


def largest() -> list[str]:
    """A motion of a very large sheet, from its pattern to its result."""
    clock = [time.perf_counter()]
    case = case_of(LARGEST, "enhanced")
    clock.append(time.perf_counter())
    dt = 0.2 * fd.critical_step(case_of((2, 2), "enhanced"))
    motion = prepare(case, 1000 * dt, "rk4", dt, 500, shaken(case), device="gpu")
    clock.append(time.perf_counter())
    print(f"case and preparation: {np.diff(clock)} s", flush=True)
    out = motion.run()
    clock.append(time.perf_counter())
    made, checked, run = np.diff(clock)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(
        f"{case.fixed.size} dofs, 1,000 steps of rk4: {made:.0f} s for the case, {checked:.0f} s "
        f"for the checks of simulate, {run:.0f} s for the motion, of which "
        f"{out.attrs['wall_seconds']:.2f} s are steps; energy error "
        f"{out.attrs['energy_error']:.1e}; peak {peak:.1f} GiB of memory",
        flush=True,
    )
    motion.make_room()
    mine = seconds(launches_of([motion], wide=True), 1, 200)
    motion.device, motion.plan = "cpu", motion.plan._replace(end=20 * dt, steps=20, every_steps=20)
    motion.integrate()
    return [line(case, "rk4", mine, motion.seconds / 20, CORES)]


def sweeps() -> None:
    """Whether sweeps choose the card, to the same values; and a case file that names it."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "case.toml"
        file.write_text(CASE_FILE.format(duration=6.0))
        values, found = np.linspace(1e6, 2e6, POINTS), {}
        many = [specimen("enhanced", k) for k in range(POINTS)]
        dt = 0.2 * fd.critical_step(many[-1])
        given = {"dt": dt, "every_steps": 10_000, "method": "rk4"}
        attributes = fd.simulate_many(many, 20_000 * dt, **given).attrs
        why = f"{attributes['device']} ({attributes['device_reason']})"
        print(f"simulate_many of {POINTS}: on {why}; {attributes['wall_seconds']:.1f} s")
        for count in (POINTS, 4):
            clock = time.perf_counter()
            given = {"sheet.youngs_modulus": values[:count].tolist()}
            out = fd.sweep(file, given, measures=["largest_displacement"])
            clock = time.perf_counter() - clock
            assert not out.attrs["failed"], out.failure.values
            found[count] = out.largest_displacement.values
            why = f"{out.attrs['device']} ({out.attrs['device_reason']})"
            print(f"sweep of {count} points: on {why}; {clock:.1f} s", flush=True)
        apart = np.abs(found[POINTS][:4] / found[4] - 1.0).max()
        print(f"  largest displacements of both are the same but for {apart:.1e}", flush=True)
        command = [sys.executable, "-m", "foldyn.cli.main", "run", file, "--no-figures"]
        for more in (["--device", "gpu", "--out", f"{folder}/run"], ["--device", "gpu"]):
            if "--out" not in more:
                file.write_text(file.read_text().replace('"rk4"', '"newmark"'))
            done = subprocess.run([*command, *more], capture_output=True, text=True, check=False)
            print(f"foldyn run --device gpu: status {done.returncode}, {done.stderr[-300:]}")
        attributes = fd.load(f"{folder}/run/result.nc").attrs
        print({name: attributes[name] for name in ("device", "steps", "energy_error")}, flush=True)


def peaks() -> None:
    """The bandwidth of the card, and its rate in double precision, by kernels of their own."""
    from numba import cuda, float64

    @cuda.jit
    def copied(a, b):
        for i in range(cuda.grid(1), a.size, cuda.gridsize(1)):
            b[i] = a[i]

    @cuda.jit
    def multiplied(out, steps):
        x, y, z, w = float64(cuda.grid(1)), 1.0, 2.0, 3.0
        for _ in range(steps):
            x, y, z, w = x * 0.5 + 1.0, y * 0.5 + 1.0, z * 0.5 + 1.0, w * 0.5 + 1.0
        out[cuda.grid(1)] = x + y + z + w

    def fastest(launch: Any) -> float:
        times = []
        for _ in range(6):
            cuda.synchronize()
            clock = time.perf_counter()
            launch()
            cuda.synchronize()
            times.append(time.perf_counter() - clock)
        return min(times)

    count, blocks = 2**28, 16 * cuda.get_current_device().MULTIPROCESSOR_COUNT
    a, b = cuda.to_device(np.ones(count)), cuda.device_array(count)
    moved = 16.0 * count / fastest(lambda: copied[blocks, 512](a, b))
    rate = 8.0 * 4096 * blocks * 256 / fastest(lambda: multiplied[blocks, 256](b, 4096))
    print(f"{card.name()}: copies {moved / 1e12:.2f} TB/s, {rate / 1e12:.1f} TFLOP/s", flush=True)


def work(launches: Launches) -> tuple[float, float]:
    """Bytes that a step of `rk4` must move at least, and its operations, of one model."""
    elements, nodes, counts = launches._elements, launches._nodes, launches._counts
    size = lambda values: (  # noqa: E731
        sum(map(size, values)) if isinstance(values, tuple) else getattr(values, "nbytes", 0)
    )
    read = size(tuple(elements)) + size((nodes.start, nodes.entry, nodes.mass, nodes.inverse))
    slots = 2 * 24 * counts.slots  # written and read
    nodal = 8 * 3 * counts.nodes * (2 + 2 * 6)  # displacement, velocity, state, sums
    bars, hinges = len(elements.bar_code), len(elements.hinge_code)
    return 4.0 * (read + slots + nodal), 4.0 * (44 * bars + 222 * hinges + 36 * counts.nodes)


def profile(sizes: list[int]) -> None:
    """One launch of each size, for Nsight Compute, after one that compiles."""
    peaks()
    for cells in sizes:
        case = case_of((cells, cells), "enhanced")
        launches = launches_of([_unchecked(case)], wide=True)
        each = seconds(launches, 1, STEPS)
        moved, done = work(launches)
        print(
            f"{case.fixed.size} dofs: {1e3 * each:.3f} ms a step; at least {moved / 1e6:.0f} MB, "
            f"{moved / each / 1e12:.2f} TB/s; {done / each / 1e12:.2f} TFLOP/s; "
            f"{launches._blocks} blocks of {launches._threads} threads",
            flush=True,
        )


def _unchecked(case: fd.Case) -> Any:
    """What `launches_of` needs of a motion, without a critical step."""
    from types import SimpleNamespace

    from foldyn.dynamics.initial import begin
    from foldyn.dynamics.methods import METHODS as INTEGRATORS
    from foldyn.dynamics.system import pack

    dt = 1.4e-4  # s, a fifth of the critical one
    u, packed = shaken(case).displacement, pack(case, 0.05 * dt)
    plan = StepPlan(0.0, 1e4 * dt, dt, 10_000, 10_000, 0.0, 0.0, 0.0, np.zeros(0))
    state = begin(case, u, np.zeros_like(u), None, None, plan, packed)
    return SimpleNamespace(packed=packed, plan=plan, state=state, method=INTEGRATORS["rk4"])


def main() -> None:
    """Measure and print."""
    given = argparse.ArgumentParser(description=__doc__)
    parts = {
        "agreement": agreement, "sweeps": sweeps, "models": throughput, "sheets": sheets,
        "largest": largest,
    }  # fmt: skip
    given.add_argument("parts", nargs="*", help=f"{', '.join(parts)}; all by default")
    given.add_argument("--out", type=Path)
    given.add_argument("--alone", choices=METHODS)
    given.add_argument("--profile", type=int, nargs="+")
    options = given.parse_args()
    if options.alone:
        return alone(options.alone)
    print(*machine.describe(None), f"GPU: {card.name()}", sep="\n", flush=True)
    if options.profile:
        return profile(options.profile)
    rows = ["kind,method,size,gpu,cpu"]
    for part in options.parts or parts:
        rows += parts[part]() or []
    if options.out:
        options.out.write_text("\n".join(rows) + "\n")
    return None


if __name__ == "__main__":
    main()
