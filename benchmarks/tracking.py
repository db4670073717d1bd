"""Tracking at the paper's resolution and rate: `python benchmarks/tracking.py [FOLDER]`.

The paper specimen, pressed by 30 mm and released, is filmed for 2 s at 240 frames/s with 2268 x
4032 pixels, once sharp and once with blur and noise; both films are tracked from their files with
the path of the static case as model. Printed: error against the true motion, wrong identities,
frequency and damping from the film and from the motion, frames per second, peak memory. The
films (2 GB) stay in FOLDER, default tracking-films, and are not made again. Their making takes
1 to 1.5 s of one processor a frame.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import xarray as xr

import foldyn as fd
from foldyn import experiment as ex

FRONT = [i * 7 + j for i in range(9) for j in (1, 3, 5)]
"""Nodes of the ridges, in the plane next to the camera."""
RATE, DURATION, SIZE = 240.0, 2.0, (2268, 4032)
DISTANCE, SCALE = 0.5, 8e-5  # m, m per pixel in the front plane
NODE = 8  # node 9 of the paper
LONGEST = 8  # frames of a gap that is filled: a third of a period
WRONG = 5.0  # pixels: the nearest other node is 60 away
SENSORS = {
    "sharp": ex.Sensor(samples=16),
    "blurred": ex.Sensor(exposure=1 / 2000, read_noise=1.5, shot_noise=3.0, samples=10),
}


def prepare(folder: Path) -> None:
    """Make the path, the motion and the films that are not there yet."""
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / "path.nc").exists():
        file = fd.read_case(fd.studies.find_case("herkal/specimen"))
        fd.save(file.run(), folder / "path.nc")
    path = fd.load(folder / "path.nc")
    if not (folder / "motion.nc").exists():
        pressed = int(np.abs(path.displacement.sel(node=3, axis="x").values - 0.03).argmin())
        case = fd.read_case(fd.studies.find_case("herkal/specimen-release")).case()
        case = fd.Case(case.structure, case.supports, [], case.damping)
        motion = fd.simulate(
            case,
            duration=DURATION + 0.1,
            method="generalized_alpha",
            initial=fd.initial_state(path, at=pressed),
            interval=0.001,
        )
        fd.save(motion, folder / "motion.nc")
    for kind in SENSORS:
        if not (folder / f"{kind}.nc").exists():
            film = film_of_specimen(fd.load(folder / "motion.nc"), kind)
            ex.write_film(film, folder / f"{kind}.mkv")
            film.truth().to_netcdf(folder / f"{kind}.nc", engine="h5netcdf")


def film_of_specimen(motion: xr.Dataset, kind: str) -> ex.SyntheticFilm:
    """The film of the released specimen."""
    rest = motion.rest_position.values
    middle = 0.5 * (rest.min(axis=0) + rest.max(axis=0))
    middle[2] = rest[:, 2].max()
    camera = ex.Camera.looking_at(
        middle,
        DISTANCE,
        metres_per_pixel=SCALE,
        size=SIZE,
        k1=0.03,
        k2=-0.01,
        turned=(2.0, -1.5, 1.0),
    )
    return ex.film_of(motion, camera, rate=RATE, duration=DURATION, sensor=SENSORS[kind], seed=1)


def measure(folder: Path, kind: str) -> dict[str, float]:
    """Track a film and compare with the truth."""
    model = ex.TrackedModel.of(fd.load(folder / "path.nc"))
    start = time.perf_counter()
    tracks = ex.track_film(str(folder / f"{kind}.mkv"), model)
    seconds = time.perf_counter() - start
    peak = peak_memory()
    ex.save_tracks(tracks, folder / f"{kind}-tracks.nc")
    truth = xr.load_dataset(folder / f"{kind}.nc", engine="h5netcdf")
    count = model.vertices
    seen = np.full((tracks.sizes["time"], count, 2), np.nan)
    node = tracks.node_of_point.values
    seen[:, node[node >= 0]] = tracks.position_px.values[:, node >= 0]
    error = np.hypot(*np.moveaxis(seen - truth.position_px.values[:, :count], -1, 0))
    front, back = error[:, FRONT], np.delete(error, FRONT, axis=1)
    dt = 1.0 / RATE
    moved = tracks.displacement.sel(node=NODE, axis="x").values
    begin = after_gaps(moved)
    film = free_vibration(moved[begin:], dt)
    true = free_vibration(truth.position.sel(node=NODE, axis="x").values[begin:], dt)
    return {
        "front rms (px)": float(np.sqrt(np.nanmean(front**2))),
        "front measured": float(np.isfinite(front).mean()),
        "front wrong": int((front > WRONG).sum()),
        "back rms (px)": float(np.sqrt(np.nanmean(back**2))),
        "back measured": float(np.isfinite(back).mean()),
        "back wrong": int((back > WRONG).sum()),
        "frequency, film/motion - 1": film[0] / true[0] - 1.0,
        "damping, film/motion - 1": film[1] / true[1] - 1.0,
        "from (s)": begin * dt,
        "frequency (Hz)": film[0],
        "damping ratio": film[1],
        "frames per second": tracks.sizes["time"] / seconds,
        "peak memory (MiB)": peak,
    }


def peak_memory() -> float:
    """Peak memory of this process (MiB), without that of the one that started it."""
    status = Path("/proc/self/status")
    if status.exists():  # Linux: what getrusage says there is inherited
        (line,) = (one for one in status.read_text().splitlines() if one.startswith("VmHWM"))
        return int(line.split()[1]) / 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def after_gaps(x: np.ndarray) -> int:
    """First sample after the last gap that is too long to be filled."""
    known = np.flatnonzero(np.isfinite(x))
    long = np.flatnonzero(np.diff(known) - 1 > LONGEST)
    return int(known[long[-1] + 1]) if len(long) else int(known[0])


def free_vibration(x: np.ndarray, dt: float) -> tuple[float, float]:
    """Frequency (Hz) and damping ratio of the release: from its first turn on."""
    filled = fd.signals.fill_gaps(x, longest=LONGEST)
    filled = filled[fd.signals.first_turning_point(filled) :]
    found = fd.signals.log_decrement(fd.signals.subtract_final(filled), dt)
    return found.damped_frequency, found.damping_ratio


def main(folder: Path) -> None:
    """Measure each film in a process of its own, for its peak memory."""
    prepare(folder)
    rows = {}
    for kind in SENSORS:
        command = [sys.executable, __file__, str(folder), kind]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        rows[kind] = json.loads(done.stdout)
    for name in rows["sharp"]:
        print(f"{name:28}", *(f"{rows[kind][name]:10.4g}" for kind in SENSORS))


if __name__ == "__main__":
    place = Path(sys.argv[1] if len(sys.argv) > 1 else "tracking-films")
    if len(sys.argv) > 2:
        print(json.dumps(measure(place, sys.argv[2])))
    else:
        main(place)
