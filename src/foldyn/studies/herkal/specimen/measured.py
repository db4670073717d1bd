"""Data for the study of the specimen: measured files, or synthetic data if no file is given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from foldyn.errors import InputError
from foldyn.experiment import ForceDisplacement, Measurement, TimeHistory, load_tracks, open_film
from foldyn.experiment.calibration.measured_files import recognize
from foldyn.experiment.tracking.films import PHOTOS
from foldyn.input_files import check_file, file_digest
from foldyn.studies.herkal.calibration import FOLD_RANGES, FULL, SYNTHETIC
from foldyn.studies.herkal.specimen import evaluation
from foldyn.studies.herkal.specimen.prepared import prepare

AXIS = "x"


@dataclass(frozen=True)
class Data:
    """Measured files; data are synthetic if there are no files.

    Attributes
    ----------
    static : Path or None
        Forces at displacements, or shapes (CSV), or tracks of photographs with loads.
    release : Path or None
        A film, its tracks, or histories (CSV).
    """

    static: Path | None = None
    release: Path | None = None

    @property
    def synthetic(self) -> bool:
        """Whether the data are synthetic."""
        return self.static is None and self.release is None

    @property
    def film(self) -> Path | None:
        """The file of the release, if it is a film that is still to be tracked."""
        is_film = self.release is not None and self.release.suffix.lower() not in (".nc", ".csv")
        return self.release if is_film else None

    @property
    def label(self) -> str:
        """Label of the data in figures."""
        return SYNTHETIC if self.synthetic else "measured"

    @property
    def files(self) -> dict[str, Path]:
        """The files by kind."""
        files = {"static": self.static, "release": self.release}
        return {what: file for what, file in files.items() if file is not None}

    def digests(self) -> dict[str, str]:
        """Digests of the files by kind."""
        return {what: _digest(file) for what, file in self.files.items()}


def data_of(names: Sequence[str]) -> Data:
    """Sort files by their content.

    Raises
    ------
    InputError
        A file cannot be read, holds neither a static test nor a release, or there are two files of
        a kind.
    """
    found: dict[str, Path] = {}
    for name in names:
        file = Path(name)
        try:
            kind = _kind(check_file(file, "a file in it"))
        except InputError as error:
            said = str(error)
            raise InputError(f"--data {said if str(file) in said else f'{file}: {said}'}") from None
        if kind in found:
            what = {"static": "a static test", "release": "a release"}[kind]
            raise InputError(f"--data {name}: {found[kind]} is {what}, too; give one of each")
        found[kind] = file.resolve()
    return Data(**found)


def measurement(file: Path, label: str) -> Measurement:
    """Measurement in a file along the specimen's axis."""
    return recognize(file, AXIS, label=label, name=file.stem)


def _kind(file: Path) -> str:
    """Kind of measurement in a file: a static test ("static") or a release ("release").

    All errors in the file are reported here, before anything is computed.
    """
    suffix = file.suffix.lower()
    if suffix in PHOTOS:
        raise InputError(
            "track photographs first, foldyn track PHOTO PHOTO ... --model herkal/specimen "
            "--loads N,N,... and give their tracks (*.nc)"
        )
    if suffix == ".nc":
        tracks = load_tracks(file)
        if "photo" in tracks.dims:
            evaluation.static_test(tracks, "")
            return "static"
        evaluation.check_tracks(tracks)
    elif suffix != ".csv":
        open_film(str(file))
        return "release"
    given = measurement(file, "")
    if isinstance(given, ForceDisplacement):
        _check_forces(given)
        return "static"
    if not isinstance(given, TimeHistory):
        raise InputError(
            "shapes without forces say nothing of the stiffness; give forces over displacements, "
            "or tracks of photographs with loads (*.nc)"
        )
    evaluation.press_of(prepare(given))
    return "release"


def _check_forces(given: ForceDisplacement) -> None:
    """Refuse points that do not determine the folds."""
    moved, most = given.displacement, FULL * evaluation.FACTORS[-1]
    if len(moved) < len(FOLD_RANGES):
        raise InputError(
            f"{len(moved)} measured force(s); at least {len(FOLD_RANGES)} are needed to find "
            f"{len(FOLD_RANGES)} parameters"
        )
    if not ((moved > 0.0) & (moved <= most)).all():
        raise InputError(
            f"displacements of the top are {1e3 * moved.min():.3g} to {1e3 * moved.max():.3g} mm; "
            f"they must be positive (downwards) and at most {1e3 * most:.3g} mm"
        )
    if not (given.force > 0.0).all():
        raise InputError(f"a force is {given.force.min():.3g} N; pressing forces are positive")


def _digest(file: Path) -> str:
    state = file.stat()
    return _digest_of(file, state.st_size, state.st_mtime_ns)


@cache
def _digest_of(file: Path, size: int, changed: int) -> str:
    """Digest of a file with this size and time, cached because a long film takes seconds."""
    return file_digest(file)
