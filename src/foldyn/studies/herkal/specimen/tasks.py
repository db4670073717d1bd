"""Computations of the specimen's study, each kept, so that an interrupted study resumes."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from foldyn import experiment, plots
from foldyn.errors import ComputationError, InputError
from foldyn.experiment import Fit, Measurement, TimeHistory
from foldyn.experiment.calibration.fit_page import write_fit
from foldyn.input_files import file_digest, from_json, read_text
from foldyn.results import netcdf, save
from foldyn.store import Store, program, warn_of_damage
from foldyn.studies.herkal import calibration
from foldyn.studies.herkal.specimen import evaluation, synthetic
from foldyn.studies.herkal.specimen.measured import Data, measurement
from foldyn.studies.herkal.specimen.synthetic import PAPERS, Shot
from foldyn.studies.pool import Task
from foldyn.writing import scratch, whole, write_text

# Files and folders on which results depend, in addition to the solvers.
COMPUTING = (
    "experiment", "studies/herkal/calibration.py", "studies/herkal/specimen",
    "studies/herkal/cases",
)  # fmt: skip
FOLDER = "specimen"
NOTE = "synthetic data: the specimen's own are not public"
PHOTOS, FILM, FOUND, COMPARED = "photographs.nc", "film.nc", "found.json", "front.nc"
TRUTH = "film-truth.nc"
MODES, IN_AIR = "modes.nc", "modes-air.nc"
RESPONSES = {"published": "frf-published.nc", "air": "frf-air.nc", "fitted": "frf-fitted.nc"}


def _read(file: Path) -> tuple[str, dict[str, str]]:
    settings, files = file.read_text(encoding="utf-8").splitlines()
    return settings, {**from_json(files)}


def _write_stamp(file: Path, stamp: str, files: dict[str, str]) -> None:
    write_text(f"{stamp}\n{json.dumps(files)}\n", file)


# a part's files with their digests; `Part.result` reports damage by the name of the file
STAMPS: Store[dict[str, str]] = Store(_read, _write_stamp, warns=False)


@dataclass(frozen=True)
class Part(Task):
    """A part of the study; its result is the digests of the part's files, by file name.

    Attributes
    ----------
    part : str
        One of `PARTS`.
    shot : Shot
        Settings of the synthetic film; photographs always have the paper's settings.
    data : Data
    """

    part: str
    shot: Shot = PAPERS
    data: Data = field(default_factory=Data)
    store = STAMPS

    @property
    def name(self) -> str:
        """Name of the part."""
        return f"specimen-{self.part}"

    @property
    def note(self) -> str:
        """Note on every figure."""
        return NOTE if self.data.synthetic else ""

    def settings(self) -> dict[str, Any]:
        """Everything on which the result depends."""
        shot = asdict(self.shot) if self.data.synthetic else {}
        data = self.data.digests()
        if self.part == "film":
            data.pop("static", None)
        return {"program": program(*COMPUTING), "data": data, "shot": shot}

    def file(self, folder: Path) -> Path:
        """File of its result in a folder."""
        return folder / FOLDER / f".{self.part}.done"

    def result(self, folder: Path) -> dict[str, str] | None:
        """Digests of the files; None if one is missing, damaged, or made with other settings."""
        files = super().result(folder)
        for name, digest in (files or {}).items():
            if _digest(folder / FOLDER / name) != digest:
                warn_of_damage(folder / FOLDER / name)
                return None
        return files

    def compute(self, folder: Path) -> dict[str, str]:
        """Write the files of the part into a folder.

        Raises
        ------
        ComputationError
            A part on which this part depends has not been computed.
        """
        inside = folder / FOLDER
        inside.mkdir(parents=True, exist_ok=True)
        missing = [one for one in self._needed() if not one.there(folder)]
        if missing:
            raise ComputationError(f"it needs {missing[0].name}, which failed")
        self.file(folder).unlink(missing_ok=True)
        compute, names = PARTS[self.part]
        compute(self, inside)
        return {name: _digest(inside / name) for name in names if (inside / name).is_file()}

    def _needed(self) -> list[Part]:
        seen, then = parts(self.shot, self.data)
        return {"fit": seen, "response": then[:1]}.get(self.part, [])


def parts(shot: Shot, data: Data) -> tuple[list[Part], list[Part]]:
    """Independent parts, and the parts that depend on them, in order."""
    first = ["photographs"] if data.synthetic else []
    first += ["film"] if data.synthetic or data.film is not None else []
    return [Part(p, shot, data) for p in first], [Part(p, shot, data) for p in ("fit", "response")]


def _model() -> experiment.TrackedModel:
    return experiment.TrackedModel.of(calibration.pressed(evaluation.FACTORS))


def _photographs(part: Part, folder: Path) -> None:
    loads = [0.0, *calibration.WEIGHTS]
    with scratch(folder, PHOTOS) as there:
        files = synthetic.photograph(there, PAPERS)
        tracks = experiment.track_photos(files, _model(), loads=loads)
        picture = experiment.read_photo(files[-1])
    last = len(loads) - 1
    _draw(plots.draw_overlay(picture, tracks, at=last, title=part.note), folder / "photograph.png")
    experiment.save_tracks(tracks, folder / PHOTOS)


def _film(part: Part, folder: Path) -> None:
    if part.data.film is not None:
        _tracked(part, part.data.film, folder)
        return
    with scratch(folder, FILM) as there:  # the film takes most of a gigabyte
        file = there / synthetic.TRACKED
        film = synthetic.film(there, part.shot)
        experiment.write_film(film, file)
        netcdf.write(film.truth(), folder / TRUTH)
        _tracked(part, file, folder)


def _tracked(part: Part, file: Path, folder: Path) -> None:
    film = experiment.open_film(str(file))
    tracks = experiment.track_film(film, _model())
    at = int(tracks.attrs["match_frame"])
    _draw(plots.draw_overlay(film.picture(at), tracks, at=at, title=part.note), folder / "film.png")
    experiment.save_tracks(tracks, folder / FILM)


def _static(
    part: Part, folder: Path, changes: Mapping[str, Any] | None = None
) -> list[Measurement]:
    """The static test; empty if only a release was measured."""
    file = part.data.static
    if file is not None and file.suffix.lower() == ".csv":
        return [measurement(file, part.data.label)]
    if file is None and not part.data.synthetic:
        return []
    tracks = experiment.load_tracks(file or folder / PHOTOS)
    return evaluation.static_test(tracks, part.data.label, changes)


def _history(part: Part, folder: Path) -> TimeHistory | None:
    """The release, if there is one."""
    file = part.data.release
    if file is None and not part.data.synthetic:
        return None
    tracked = file is None or part.data.film is not None
    found = measurement(folder / FILM if tracked else file, part.data.label)  # type: ignore[arg-type]
    assert isinstance(found, TimeHistory)
    return replace(found, name="film" if tracked else found.name)


def _fit(part: Part, folder: Path) -> None:
    kept: dict[str, Any] = {"folder": folder / "evaluations"}
    found: dict[str, Any] = {}
    changes: dict[str, Any] = {}
    for stale in ("folds", "damping", "models"):
        shutil.rmtree(folder / stale, ignore_errors=True)
    static = _static(part, folder)
    if static:
        folds = calibration.fit_folds(static, **kept)
        if len(static) > 1:  # displacements were found with other folds: find them anew
            static = _static(part, folder, calibration.changes_of(folds))
            folds = calibration.fit_folds(static, **kept)
        changes = calibration.changes_of(folds)
        _write(folds, folder / "folds", part.note)
        found |= {"folds": folds.summary(), "weights": _weights(static)}
    measured = _history(part, folder)
    if measured is not None:
        released = evaluation.fit_release(measured, folder / "models", changes, **kept)
        _write(released.fits[evaluation.FILM_SUPPORT], folder / "damping", part.note)
        truth = netcdf.read(folder / TRUTH, "") if part.data.synthetic else None
        front = evaluation.compared(released, evaluation.motions(released), truth)
        netcdf.write(front, folder / COMPARED)
        _draw(plots.plot_steps(released.free.steps, title=part.note), folder / "steps.png")
        found |= {
            "press": released.press,
            "damping": {support: one.summary() for support, one in released.fits.items()},
        }
        changes |= released.fits[evaluation.FILM_SUPPORT].values
    found["changes"] = changes
    write_text(json.dumps(found, indent=2) + "\n", folder / FOUND)


def _draw(figure: Figure, picture: Path) -> None:
    with whole(picture) as part:
        figure.savefig(part)


def _weights(static: list[Measurement]) -> dict[str, list[float]]:
    one = next(one for one in static if isinstance(one, experiment.ForceDisplacement))
    return {"displacement": np.asarray(one.displacement).tolist(), "force": one.force.tolist()}


def _write(one: Fit, folder: Path, note: str) -> None:
    folder.mkdir(exist_ok=True)
    write_fit(one, folder, f"Paper specimen: {folder.name}", note, figures="png")
    one.save(folder / "fit.json")


def _response(part: Part, folder: Path) -> None:
    changes = read_found(folder)["changes"]
    folds = {key: value for key, value in changes.items() if not key.startswith("damping.")}
    air = calibration.IN_AIR
    for kind, given, name in (
        ("frf", {}, RESPONSES["published"]),
        ("frf", air, RESPONSES["air"]),
        ("frf", changes, RESPONSES["fitted"]),
        ("modes", folds, MODES),
        ("modes", {**folds, **air}, IN_AIR),
    ):
        save(calibration.shipped(f"specimen-{kind}", given).run(), folder / name)


# Computation of each part, and the files that it writes for other parts or for the page.
PARTS: Mapping[str, tuple[Callable[[Part, Path], None], tuple[str, ...]]] = {
    "photographs": (_photographs, (PHOTOS,)),
    "film": (_film, (FILM, TRUTH)),
    "fit": (_fit, (FOUND, COMPARED)),
    "response": (_response, (*RESPONSES.values(), MODES, IN_AIR)),
}


def read_found(folder: Path) -> dict[str, Any]:
    """Read the results of the fits."""
    file = folder / FOUND
    try:
        found = from_json(read_text(file, "what a fit has found", 64, "compute it again"))
        return {**found, "changes": {**found["changes"]}}
    except (InputError, TypeError, KeyError) as error:
        said = str(error) if isinstance(error, InputError) else "it lacks what a fit finds"
        raise InputError(f"{file}: is damaged: {said}; remove it to compute it again") from None


def _digest(file: Path) -> str:
    """Digest of a file; "" if it cannot be read."""
    try:
        return file_digest(file) if file.is_file() else ""
    except OSError:
        return ""
