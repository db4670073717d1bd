"""`foldyn track`: track corners and nodes in a film or photographs."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cli.folder import check_folder, drawing, rescued
from foldyn.cli.options import add, add_figures, add_switches
from foldyn.cli.signals import ENDINGS
from foldyn.cli.streams import Clock, noted_warnings, progress_bar, speech
from foldyn.errors import ComputationError, InputError
from foldyn.input_files import check_file
from foldyn.studies import find_case
from foldyn.values import number, parsed
from foldyn.values import whole as whole_number
from foldyn.writing import whole

if TYPE_CHECKING:
    import argparse

    import xarray
    from matplotlib.figure import Figure

    from foldyn.cases import Case
    from foldyn.experiment import Tracking
    from foldyn.experiment.tracking.tracks_page import Footage

QUALITY = 75
"""JPEG quality of pictures in a page, in percent."""
_KEPT = "\nfoldyn: kept what was computed: "


def add_track(commands: Any) -> None:
    """Add the command and its arguments."""
    track: argparse.ArgumentParser = commands.add_parser(
        "track",
        help="camera tracking of a film, or of photographs",
        description="Track the corners of a folded sheet in a film, or find the nodes of a model "
        "in photographs. Histories go to OUT (NetCDF), a CSV file and figures to the same folder.",
    )
    track.add_argument("inputs", nargs="+", metavar="VIDEO|PHOTO", help="a film, or photographs")
    add(track, str, {
        "--roi X,Y,W,H": "region of interest (pixels)",
        "--scale METRES": "metres per pixel, in the front plane",
    })  # fmt: skip
    known = "a known length between two pixels, instead of --scale; may be given twice"
    add(track, str, {"--reference PX1,PY1,PX2,PY2,METRES": known}, action="append")
    add(track, str, {
        "--model CASE|RESULT": "case file, shipped case or path (NetCDF) whose nodes are "
        "recognized; the states of a path, also that of a static case, are tried",
    })  # fmt: skip
    track.add_argument("--out", default="tracks.nc", help="file to write (default: tracks.nc)")
    add(track, str, {
        "--rate HZ": "frames per second, where the film says another",
        "--distance METRES": "from the camera to the front plane",
    })  # fmt: skip
    track.add_argument("--up", default="-x", help="the model's axis that points up (--up=-x)")
    track.add_argument("--facing", default="z", help="the model's axis towards the camera (z)")
    frames = "frame in which the model is recognized: first (default) or last"
    add(track, str, {"--match": frames}, default="first")
    add(track, str, {
        "--nodes N,N,...": "nodes that must be found",
        "--loads N,N,...": "load of each photograph (N)",
        "--reach PIXELS": "length of the edges that make a corner",
    })  # fmt: skip
    add_switches(track)
    add_figures(track)


def track(given: Namespace) -> Path:
    """Run `foldyn track`; return the path of the tracks."""
    from foldyn import experiment
    from foldyn.analyses.provenance import Call
    from foldyn.experiment.tracking.tracks_page import write_tracks_page

    clock = Clock.now()
    experiment.opencv()  # fail first if OpenCV is missing
    out = Path(given.out)
    if out.suffix != ".nc":
        raise InputError(f"--out {given.out}: name a file that ends in .nc")
    names = [out.with_suffix(end).name for end in (".nc", ".csv", ".html")]
    check_folder(out.parent, given.out, names)
    photos = _are_photos(given.inputs)
    settings = _tracking(given)
    roi, rate = whole_numbers(given, "roi", 4), one_number(given, "rate")
    loads = numbers(given, "loads")
    if loads is not None and not photos:
        raise InputError("--loads: a film has times; loads belong to photographs")
    film = None if photos else experiment.open_film(given.inputs[0], roi, rate=rate)  # type: ignore
    thing = None if given.model is None else modeled(given.model)
    model = None if thing is None else experiment.TrackedModel.of(thing)
    if photos and model is None:
        raise InputError(
            "--model: photographs need one: from one to the next points move too far to be "
            "followed, and only a model tells which is which"
        )
    say = speech(given.quiet)
    total, unit = (len(given.inputs), "photo") if film is None else (None, "frame")
    with noted_warnings() as noted, progress_bar(given.quiet, total=total, unit=unit) as bar:

        def tell(number: int) -> None:
            bar.update()

        if film is None:
            named: Any = {"tracking": settings, "loads": loads, "roi": roi, "tell": tell}
            ds = experiment.track_photos(given.inputs, model, **named)  # type: ignore
        else:
            ds = experiment.track_film(film, model, tracking=settings, tell=tell)
    out.parent.mkdir(parents=True, exist_ok=True)
    _save(ds, out)
    say(summary(ds))
    say(f"wrote {out}, {out.with_suffix('.csv')}")
    if not given.no_figures:
        with drawing(out, f"{_KEPT}{out}"):
            # without a model only figures can show what was tracked
            form = given.figures or (None if "displacement" in ds else "png")
            written = [] if form is None else _figures(ds, out, given.inputs, film, form)
            call = Call(given.typed, tuple(noted), **clock.spent())
            page = write_tracks_page(ds, out, _footage(given, written, thing, film, ds), call)
            say(f"wrote {', '.join([*written, str(page)])}")
    return out


def _save(ds: xarray.Dataset, out: Path) -> None:
    """Save the tracks and their table; if the disk is full, save the tracks elsewhere."""
    from foldyn import experiment

    try:
        with ENDINGS.saving():
            experiment.save_tracks(ds, out)
            experiment.write_csv(ds, out.with_suffix(".csv"))
    except (OSError, InputError) as error:
        saved, failure = rescued(out, lambda path: experiment.save_tracks(ds, path), error)
        raise ComputationError(f"{failure}{_KEPT}{saved}") from None
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted{_KEPT}{out}") from None


def numbers(given: Namespace, name: str, count: int | None = None) -> list[float] | None:
    """Parse an option's numbers, separated by commas; None if not given."""
    text = getattr(given, name)
    return None if text is None else _numbers(f"--{name}", text, count)


def one_number(given: Namespace, name: str) -> float | None:
    """Parse an option's number; None if not given."""
    found = numbers(given, name, 1)
    return None if found is None else found[0]


def whole_numbers(given: Namespace, name: str, count: int | None = None) -> tuple[int, ...] | None:
    """Parse an option's whole numbers, separated by commas; None if not given."""
    values = numbers(given, name, count)
    if values is None:
        return None
    for value in values:
        if not value.is_integer():
            raise InputError(f"--{name} {getattr(given, name)}: {value:g} is not a whole number")
    return tuple(whole_number(f"--{name}", int(value)) for value in values)


def _numbers(option: str, text: str, count: int | None) -> list[float]:
    try:
        values = [parsed(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"{option} {text}: give numbers separated by commas") from None
    if count is not None and len(values) != count:
        raise InputError(f"{option} {text}: {len(values)} numbers; {count} are needed")
    return [number(option, value) for value in values]


def modeled(name: str) -> Case | xarray.Dataset:
    """Read the model: a result, a case at rest, or the path of a static case."""
    import foldyn as fd

    if name.endswith(".nc"):
        return fd.load(name)
    case_file = fd.read_case(find_case(name))
    return case_file.run() if case_file.analysis.kind == "statics" else case_file.case()


def summary(ds: xarray.Dataset) -> str:
    """Summarize what was tracked."""
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
    """Whether the inputs are photographs; refuse a mixture, and several films."""
    from foldyn.experiment.tracking.films import PHOTOS

    photos = [Path(name).suffix.lower() in PHOTOS for name in inputs]
    if any(photos) and not all(photos):
        raise InputError(f"{inputs[photos.index(False)]}: give a film or photographs, not both")
    if not any(photos) and len(inputs) > 1:
        raise InputError(f"{inputs[1]}: one film at a time")
    for name in inputs:
        check_file(name, "a film, or all photographs in it")
    if photos == [True]:
        raise InputError(
            f"{inputs[0]}: one photograph alone shows no displacement; give at least two, the "
            "first one unloaded"
        )
    return all(photos)


def _tracking(given: Namespace) -> Tracking:
    """Settings of the tracking from the options."""
    from foldyn.experiment import CornerSettings, Placing, Scale, Tracking, scale_of_lengths

    if given.scale is not None and given.reference:
        raise InputError("--scale, --reference: give one or the other")
    scale = one_number(given, "scale")
    if scale is not None:
        scale = Scale(scale).metres_per_pixel
    if given.reference:
        lengths = [_numbers("--reference", one, 5) for one in given.reference]
        scale = scale_of_lengths(lengths).metres_per_pixel
    nodes = whole_numbers(given, "nodes")
    if nodes is not None and given.model is None:
        raise InputError("--nodes: needs a --model, which says what nodes there are")
    return Tracking(
        corners=CornerSettings(reach=one_number(given, "reach")),
        placing=Placing(given.up, given.facing, scale, one_number(given, "distance")),
        match=given.match,
        nodes=nodes,
    )


def _figures(
    ds: xarray.Dataset, out: Path, inputs: Sequence[str], film: Any, form: str
) -> list[str]:
    """Draw overlays and histories; return the names of their files."""
    from foldyn import plots
    from foldyn.experiment import read_photo
    from foldyn.experiment.tracking.tracks_page import most_moved

    written: list[str] = []

    def save(name: str, figure: Figure) -> None:
        file = out.with_name(f"{out.stem}-{name}.{form}")
        with whole(file) as part:
            figure.savefig(part)
        written.append(str(file))

    if film is not None:
        at = int(ds.attrs["match_frame"]) if "displacement" in ds else 0
        save("overlay", plots.draw_overlay(film.picture(at), ds, at=at))
    else:
        for k, name in enumerate(inputs):
            save(f"overlay-{k}", plots.draw_overlay(read_photo(name), ds, at=k))
    if "displacement" in ds:
        save("history", plots.plot_tracks(ds, most_moved(ds)))
    return written


def _footage(
    given: Namespace, written: Sequence[str], thing: Case | xarray.Dataset | None, film: Any,
    tracks: xarray.Dataset,
) -> Footage:  # fmt: skip
    """Describe the film or photographs that were tracked, for the page."""
    from foldyn.cases import Case
    from foldyn.experiment import read_photo
    from foldyn.experiment.tracking.tracks_page import Footage, spread
    from foldyn.report import Picture
    from foldyn.results import case_of

    case = thing if thing is None or isinstance(thing, Case) else case_of(thing)
    overlays = [name for name in written if "-overlay" in name and name.endswith(".png")]
    figures = [Picture(name, "The model where it was recognized.") for name in overlays]
    options = ("model", "scale", "reference", "distance", "match", "nodes", "reach")
    settings = {name: str(value) for name in options if (value := getattr(given, name))}
    if film is None:
        pictures = dict(enumerate(_jpeg(read_photo(name)) for name in given.inputs))
    else:
        pictures = spread(tracks.sizes["time"], lambda frame: _jpeg(film.picture(frame)))
    return Footage(given.inputs, pictures, figures, case, settings)


def _jpeg(picture: Any) -> bytes:
    """Encode a gray picture as JPEG, for a page."""
    from foldyn.experiment import opencv

    cv2 = opencv()
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes()
