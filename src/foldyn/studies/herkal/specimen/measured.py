"""What the study of the specimen is given: measured files, or nothing and then synthetic data."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from foldyn.errors import InputError
from foldyn.experiment import ForceDisplacement, History, Measurement, load_tracks, open_film
from foldyn.experiment.calibration.measured_files import recognize
from foldyn.experiment.calibration.measured_paths import Shapes
from foldyn.experiment.tracking.films import PHOTOS
from foldyn.studies.herkal.specimen.prepared import prepare

SYNTHETIC = "synthetic"
AXIS = "x"


@dataclass(frozen=True)
class Data:
    """Measured files; synthetic ones where there is none at all.

    Attributes
    ----------
    static : Path or None
        Forces over displacements or shapes (CSV), or tracks of photographs with loads.
    release : Path or None
        A film, its tracks, or histories (CSV).
    """

    static: Path | None = None
    release: Path | None = None

    @property
    def synthetic(self) -> bool:
        """Whether nothing was measured."""
        return self.static is None and self.release is None

    @property
    def film(self) -> Path | None:
        """The release, where it is a film that is still to be tracked."""
        is_film = self.release is not None and self.release.suffix not in (".nc", ".csv")
        return self.release if is_film else None

    @property
    def label(self) -> str:
        """What figures call the data."""
        return SYNTHETIC if self.synthetic else "measured"

    @property
    def files(self) -> dict[str, Path]:
        """The files by what they are."""
        files = {"static": self.static, "release": self.release}
        return {what: file for what, file in files.items() if file is not None}

    @property
    def names(self) -> list[str]:
        """Names of the files."""
        return [file.name for file in self.files.values()]

    def digests(self) -> dict[str, str]:
        """Digests of the files, by what they are."""
        return {what: _digest(file) for what, file in self.files.items()}


def data_of(names: Sequence[str]) -> Data:
    """Sort files by what is in them.

    Raises
    ------
    InputError
        A file cannot be read, holds nothing of a static test or of a release, or there are two of
        a kind.
    """
    found: dict[str, Path] = {}
    for name in names:
        file = Path(name)
        if not file.is_file():
            what = "is a folder; name a file in it" if file.is_dir() else "there is no such file"
            raise InputError(f"--data {name}: {what}")
        kind = _kind(file)
        if kind in found:
            raise InputError(
                f"--data {name}: {found[kind]} is a {kind} test, too; give one of each"
            )
        found[kind] = file.resolve()
    return Data(**found)


def measurement(file: Path, label: str) -> Measurement:
    """Measurement in a file, along the axis of the specimen."""
    return recognize(file, AXIS, label=label, name=file.stem)


def _kind(file: Path) -> str:
    """Whether a file is of a static test ("static") or of a release ("release")."""
    if file.suffix.lower() in PHOTOS:
        raise InputError(
            f"--data {file}: track photographs first, foldyn track PHOTO PHOTO ... --model "
            "herkal/specimen --loads N,N,... and give their tracks (*.nc)"
        )
    if file.suffix == ".csv":
        told = measurement(file, "")
        if isinstance(told, ForceDisplacement):
            return "static"
        if isinstance(told, Shapes):
            raise InputError(
                f"--data {file}: shapes without forces say nothing of the stiffness; give forces "
                "over displacements, or tracks of photographs with loads"
            )
        return _released(told)
    if file.suffix == ".nc":
        tracks = load_tracks(file)
        if "photo" not in tracks.dims:
            return _released(measurement(file, ""))
        if "load" not in tracks.coords or "displacement" not in tracks:
            raise InputError(
                f"--data {file}: photographs without loads, or without a model: track them with "
                "--loads and --model herkal/specimen"
            )
        return "static"
    open_film(str(file))  # says why, where it is none
    return "release"


def _released(told: Measurement) -> str:
    assert isinstance(told, History)
    prepare(told)  # says at the door why it is no release
    return "release"


def _digest(file: Path) -> str:
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()[:16]
