"""`foldyn track`: a film, or photographs, to histories of corners and nodes."""

from __future__ import annotations

import math
import os
import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cli.folder import check_folder, elsewhere, reason, unwritten
from foldyn.cli.signals import ENDINGS
from foldyn.cli.speech import speech
from foldyn.errors import ComputationError, InputError
from foldyn.studies import find_case
from foldyn.values import number
from foldyn.values import whole as whole_number
from foldyn.writing import whole

if TYPE_CHECKING:
    import argparse

    import xarray

    from foldyn.experiment import TrackedModel, Tracking

_SHOWN = 3  # nodes in the figure of histories
_KEPT = "\nfoldyn: kept what was computed: "


def add_track(commands: Any) -> None:
    """Add the command and its arguments."""
    track: argparse.ArgumentParser = commands.add_parser(
        "track",
        help="camera tracking of a film, or of photographs",
        description="Track the corners of a folded sheet in a film, or find the nodes of a model "
        "in photographs; histories go to OUT (NetCDF), a CSV file and figures beside it.",
    )
    track.add_argument("inputs", nargs="+", metavar="VIDEO|PHOTO", help="a film, or photographs")
    track.add_argument("--roi", metavar="X,Y,W,H", help="region of interest (pixels)")
    track.add_argument("--scale", metavar="METRES", help="metres per pixel, in the front plane")
    track.add_argument(
        "--reference",
        action="append",
        metavar="PX1,PY1,PX2,PY2,METRES",
        help="a known length between two pixels, instead of --scale; may be given twice",
    )
    track.add_argument(
        "--model",
        metavar="CASE|RESULT",
        help="case file, shipped case or path (NetCDF) whose nodes are recognized; the states of "
        "a path, also that of a static case, are tried",
    )
    track.add_argument("--out", default="tracks.nc", help="file to write (default: tracks.nc)")
    track.add_argument(
        "--rate", metavar="HZ", help="frames per second, where the film says another"
    )
    track.add_argument("--distance", metavar="METRES", help="from the camera to the front plane")
    track.add_argument("--up", default="-x", help="the model's axis that points up (--up=-x)")
    track.add_argument("--facing", default="z", help="the model's axis towards the camera (z)")
    track.add_argument(
        "--match",
        default="first",
        help="frame in which the model is recognized: first (default) or last",
    )
    track.add_argument("--nodes", metavar="N,N,...", help="nodes that must be found")
    track.add_argument("--loads", metavar="N,N,...", help="load of each photograph (N)")
    track.add_argument("--reach", metavar="PIXELS", help="length of the edges that make a corner")
    track.add_argument("--no-figures", action="store_true", help="write NetCDF and CSV only")
    track.add_argument("--quiet", action="store_true", help="no progress bar and no summary")


def track(given: Namespace) -> Path:
    """Run the command; returns the path of the tracks."""
    from foldyn import experiment

    experiment.opencv()  # nothing else is worth a look without it
    out = Path(given.out)
    if out.suffix != ".nc":
        raise InputError(f"--out {given.out}: name a file that ends in .nc")
    check_folder(out.parent, given.out, [out.name, out.with_suffix(".csv").name])
    photos = _are_photos(given.inputs)
    how = _tracking(given)
    roi = None if given.roi is None else tuple(wholes("--roi", given.roi, 4))
    rate = None if given.rate is None else numbers("--rate", given.rate, 1)[0]
    loads = None if given.loads is None else numbers("--loads", given.loads)
    if loads is not None and not photos:
        raise InputError("--loads: a film has times; loads belong to photographs")
    film = None if photos else experiment.open_film(given.inputs[0], roi, rate)  # type: ignore
    model = None if given.model is None else model_of(given.model)
    if photos and model is None:
        raise InputError(
            "--model: photographs need one: from one to the next points move too far to be "
            "followed, and only a model tells which is which"
        )
    say = speech(given.quiet)
    tell, close = _progress(given, None if film is None else film.path)
    try:
        if film is None:
            ds = experiment.track_photos(given.inputs, model, how, loads, roi, tell)  # type: ignore
        else:
            ds = experiment.track_film(film, model, how, tell)
    finally:
        close()
    out.parent.mkdir(parents=True, exist_ok=True)
    _save(ds, out)
    say(summary(ds))
    say(f"wrote {out}, {out.with_suffix('.csv')}")
    if not given.no_figures:
        say(f"wrote {', '.join(_figures(ds, out, given.inputs, film))}")
    return out


def _save(ds: xarray.Dataset, out: Path) -> None:
    """Save the tracks and their table, the tracks elsewhere where there is no room."""
    from foldyn import experiment

    try:
        with ENDINGS.saving():
            experiment.save_tracks(ds, out)
            experiment.write_csv(ds, out.with_suffix(".csv"))
    except (OSError, InputError) as error:
        saved = elsewhere(out, lambda path: experiment.save_tracks(ds, path), reason(error))
        raise ComputationError(f"{unwritten(out, reason(error))}{_KEPT}{saved}") from None
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted{_KEPT}{out}") from None


def numbers(name: str, text: str, count: int | None = None) -> list[float]:
    """Numbers that a person gave, separated by commas."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"{name} {text}: give numbers separated by commas") from None
    if count is not None and len(values) != count:
        raise InputError(f"{name} {text}: {len(values)} numbers; {count} are needed")
    if not all(map(math.isfinite, values)):
        raise InputError(f"{name} {text}: every number must be finite")
    return [number(name, value) for value in values]


def wholes(name: str, text: str, count: int | None = None) -> list[int]:
    """Whole numbers that a person gave, separated by commas."""
    values = numbers(name, text, count)
    for value in values:
        if not value.is_integer():
            raise InputError(f"{name} {text}: {value:g} is not a whole number")
    return [whole_number(name, int(value)) for value in values]


def model_of(name: str) -> TrackedModel:
    """Model of a result, of a case at rest, or with all states of the path of a static case."""
    import foldyn as fd
    from foldyn.experiment import TrackedModel

    if name.endswith(".nc"):
        return TrackedModel.of(fd.load(name))
    case_file = fd.read_case(find_case(name))
    static = case_file.analysis.kind == "statics"
    return TrackedModel.of(case_file.run() if static else case_file.case())


def summary(ds: xarray.Dataset) -> str:
    """What was tracked, in a few words."""
    import numpy as np

    along = "photo" if "photo" in ds.dims else "time"
    known = np.isfinite(ds["position_px"].values[..., 0])
    what = "photographs" if along == "photo" else "frames"
    text = f"{ds.sizes[along]} {what}, {ds.sizes['point']} points, measured in {known.mean():.1%}"
    if "displacement" in ds:
        rms = ", ".join(f"{value:.2g}" for value in ds.attrs["match_rms_px"])
        counts = ", ".join(str(value) for value in ds.attrs["matched_nodes"])
        text += (
            f"\n{counts} of {ds.sizes['node']} nodes recognized, {rms} pixels rms from the model; "
            f"{ds.attrs['metres_per_pixel']:.5g} m per pixel"
        )
    return text


def _are_photos(inputs: Sequence[str]) -> bool:
    """Whether the inputs are photographs; they are all of a kind, and a film is alone."""
    from foldyn.experiment.tracking.films import PHOTOS

    photos = [Path(name).suffix.lower() in PHOTOS for name in inputs]
    if any(photos) and not all(photos):
        raise InputError(f"{inputs[photos.index(False)]}: give a film or photographs, not both")
    if not any(photos) and len(inputs) > 1:
        raise InputError(f"{inputs[1]}: one film at a time")
    for name in inputs:
        if os.path.isdir(name):
            raise InputError(f"{name}: is a folder; give a film, or all photographs in it")
        if not os.path.isfile(name):
            raise InputError(f"{name}: there is no such file")
    if photos == [True]:
        raise InputError(
            f"{inputs[0]}: one photograph alone shows no displacement; give at least two, the "
            "first one unloaded"
        )
    return all(photos)


def _tracking(given: Namespace) -> Tracking:
    from foldyn.experiment import CornerSettings, Placing, Scale, Tracking, scale_of_lengths

    if given.scale is not None and given.reference:
        raise InputError("--scale, --reference: give one or the other")
    scale = None
    if given.scale is not None:
        scale = Scale(numbers("--scale", given.scale, 1)[0]).metres_per_pixel
    if given.reference:
        lengths = [numbers("--reference", one, 5) for one in given.reference]
        scale = scale_of_lengths(lengths).metres_per_pixel
    distance = None if given.distance is None else numbers("--distance", given.distance, 1)[0]
    nodes = None if given.nodes is None else tuple(wholes("--nodes", given.nodes))
    if nodes is not None and given.model is None:
        raise InputError("--nodes: which nodes there are is known with a --model only")
    reach = None if given.reach is None else numbers("--reach", given.reach, 1)[0]
    return Tracking(
        corners=CornerSettings(reach=reach),
        placing=Placing(given.up, given.facing, scale, distance),
        match=given.match,
        nodes=nodes,
    )


def _progress(given: Namespace, film: Path | None) -> tuple[Callable[[int], None], Callable]:
    from tqdm import tqdm

    total = len(given.inputs) if film is None else None
    hidden = given.quiet or not sys.stderr.isatty()
    unit = "photo" if film is None else "frame"
    bar = tqdm(total=total, unit=unit, disable=hidden, leave=False)

    def tell(number: int) -> None:
        bar.update()

    return tell, bar.close


def _figures(ds: xarray.Dataset, out: Path, inputs: Sequence[str], film: Any) -> list[str]:
    """Draw the overlays and histories; returns the names of their files."""
    from foldyn import plots
    from foldyn.experiment import read_photo

    written = []
    try:
        if film is not None:
            at = int(ds.attrs["match_frame"]) if "displacement" in ds else 0
            pictures = {f"{out.stem}-overlay.png": (film.picture(at), at)}
        else:
            pictures = {
                f"{out.stem}-overlay-{k}.png": (read_photo(name), k)
                for k, name in enumerate(inputs)
            }
        for name, (picture, at) in pictures.items():
            with whole(out.with_name(name)) as part:
                plots.draw_overlay(picture, ds, at).savefig(part)
            written.append(str(out.with_name(name)))
        if "displacement" in ds:
            history = plots.plot_tracks(ds, _best(ds))
            with whole(out.with_name(f"{out.stem}-history.png")) as part:
                history.savefig(part)
            written.append(str(out.with_name(f"{out.stem}-history.png")))
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted while figures were drawn{_KEPT}{out}") from None
    except (InputError, OSError) as error:
        raise ComputationError(f"figures: {reason(error)}{_KEPT}{out}") from None
    return written


def _best(ds: xarray.Dataset) -> list[int]:
    """Nodes that move most among those that were measured most of the time."""
    import numpy as np

    moved = ds["displacement"].values
    known = np.isfinite(moved)
    high = np.where(known, moved, -np.inf).max(axis=0)
    low = np.where(known, moved, np.inf).min(axis=0)
    span = np.where(np.isfinite(high - low), high - low, 0.0).max(axis=1)
    span[ds["tracked"].values < 0.9 * ds["tracked"].values.max()] = -1.0
    return sorted(int(node) for node in np.argsort(-span)[:_SHOWN])
