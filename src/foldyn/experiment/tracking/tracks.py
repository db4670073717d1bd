"""From a film or photographs to where the corners, and the nodes of a model, are."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import FoldynWarning, InputError
from foldyn.experiment.tracking.corners import CornerSettings, find_corners
from foldyn.experiment.tracking.films import Film, checked_box, open_film, read_photo
from foldyn.experiment.tracking.follow import FollowSettings, Guide, Step, follow
from foldyn.experiment.tracking.matching import (
    Match,
    Placing,
    by_neighbors,
    hidden_nodes,
    match_nodes,
)
from foldyn.experiment.tracking.models import Model

Tell = Callable[[int], None]

_GUIDING = 6  # tracked nodes, without which the states of the model tell nothing
_WHOLE = 0.95  # share of the frames told that a whole film has at least


@dataclass(frozen=True)
class Tracking:
    """How a film or photographs are tracked.

    Attributes
    ----------
    corners : CornerSettings
    following : FollowSettings
    placing : Placing
        How the model is seen.
    match : {"first", "last"}
        The frame in which the model's nodes are recognized: the one in which the specimen is in
        one of the model's states.
    nodes : tuple of int or None
        Nodes that must be found; None: as many as there are.
    """

    corners: CornerSettings = field(default_factory=CornerSettings)
    following: FollowSettings = field(default_factory=FollowSettings)
    placing: Placing = field(default_factory=Placing)
    match: str = "first"
    nodes: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        if self.match not in ("first", "last"):
            raise InputError(f'--match {self.match!r}: use "first" or "last"')


def track_film(
    film: Film | str,
    model: Model | None = None,
    tracking: Tracking | None = None,
    tell: Tell | None = None,
) -> xr.Dataset:
    """Track the corners in a film.

    Parameters
    ----------
    film : Film or path
    model : Model, optional
        Recognized in the film: its nodes' displacements are given, too.
    tracking : Tracking
    tell : callable, optional
        Called with the number of each frame that is done.

    Returns
    -------
    xarray.Dataset
        `position_px` (time, point, uv), pixels of the whole image, NaN where a point is lost;
        `error_px` (time, point), its standard error; `status` (time, point): 0 lost, 1 found
        again, 2 tracked; `repeated` (time): the frame repeats the one before. With a model,
        `displacement` (time, node, axis) in m from rest, NaN where lost and along the line of
        sight, `node_of_point` (point), -1 for none, and figures of quality of each node.

    Raises
    ------
    InputError
        No corners, a model that does not fit them, fewer points than the nodes asked for, or a film
        of one frame.

    Warns
    -----
    FoldynWarning
        The film breaks off before the end that it tells.
    """
    how = tracking or Tracking()
    film = film if isinstance(film, Film) else open_film(film)
    how = replace(how, placing=_centered(how.placing, film.size, film.box))
    first = next(film.frames())[1]
    reach = _reach(how, first.shape)
    corners = find_corners(first, how.corners, f"{film.path}, first frame")
    match: Match | None = None
    unseen = np.zeros(len(corners), bool)
    nodes = np.full(len(corners), -1)
    if model is not None and how.match == "first":
        match = _matched(first, corners, model, how, f"{film.path}, first frame")
        nodes = np.arange(model.vertices)
        corners = match.expected[nodes].copy()
        corners[match.node] = match.uv
        unseen = ~np.isin(nodes, match.node)
    guide = None if match is None or model is None else _guide_of(match, model)
    steps: list[Step] = []
    frames = _kept(film.frames(), keep := [first])
    for number, step in enumerate(follow(frames, corners, reach, how.following, unseen, guide)):
        steps.append(step)
        if tell is not None:
            tell(number + 1)
    _check_length(film, len(steps))
    last = keep[0]
    if model is not None and match is None:
        place = f"{film.path}, last frame"
        found = find_corners(last, how.corners, place)
        match = _matched(last, found, model, how, place)
        nodes = _linked(steps, match, 0.5 * reach)
    ds = _dataset(steps, np.array(film.box[:2], dtype=np.float64), nodes)
    ds["time"] = ("time", np.array([step.time for step in steps]), {"units": "s"})
    frame = 0 if how.match == "first" else len(steps) - 1
    ds.attrs |= {"source": film.path.name, "rate": film.rate, "match_frame": frame}
    ds.attrs |= {"size": np.array(film.size), "roi": np.array(film.box)}
    return _in_metres(ds, model, match, how)


def track_photos(
    paths: Sequence[Any],
    model: Model,
    tracking: Tracking | None = None,
    loads: ArrayLike | None = None,
    roi: tuple[int, int, int, int] | None = None,
    tell: Tell | None = None,
) -> xr.Dataset:
    """Find the nodes of a model in photographs, one for each load.

    In each photograph the model is recognized anew, in one of its states: nodes may have moved
    farther than their distance from one photograph to the next.

    Parameters
    ----------
    paths : sequence of path
        At least two photographs.
    model : Model
        With the states of a path, if the specimen changes its shape.
    tracking : Tracking
    loads : array_like, shape (number of photographs,), optional
    roi : tuple of int, optional
        Region of interest: column, row, width, height.
    tell : callable, optional
        Called with the number of each photograph that is done.

    Returns
    -------
    xarray.Dataset
        As `track_film` gives it, along the dimension `photo` instead of `time`, with the
        coordinate `load` where loads are given.

    Raises
    ------
    InputError
        One photograph alone, photographs of several sizes, no corners, a model that does not
        fit.
    """
    how = tracking or Tracking()
    if len(paths) < 2:
        raise InputError(
            f"{paths[0] if paths else 'photographs'}: one photograph alone shows no displacement; "
            "give at least two, the first one unloaded"
        )
    if loads is not None and np.shape(loads) != (len(paths),):
        raise InputError(f"--loads: {np.size(loads)} loads for {len(paths)} photographs")
    whole = read_photo(paths[0])
    x, y, width, height = box = checked_box(roi, *whole.shape[::-1])
    _reach(how, (height, width))
    how = replace(how, placing=_centered(how.placing, whole.shape[::-1], box))
    steps, matches = [], []
    for number, path in enumerate(paths):
        photo = read_photo(path)
        if photo.shape != whole.shape:
            sizes = [f"{one.shape[1]} x {one.shape[0]}" for one in (photo, whole)]
            raise InputError(
                f"{path}: is of {sizes[0]} pixels, {paths[0]} of {sizes[1]}: the camera must not "
                "move between photographs; give all uncut, of one size"
            )
        photo = np.ascontiguousarray(photo[y : y + height, x : x + width])
        corners = find_corners(photo, how.corners, str(path))
        match = _matched(photo, corners, model, how, str(path))
        position = np.full((model.vertices, 2), np.nan)
        position[match.node] = match.uv
        found = np.isfinite(position[:, 0])
        error = np.where(found, 0.0, np.nan)
        steps.append(Step(float(number), position, error, (2 * found).astype(np.int8), False))
        matches.append(match)
        if tell is not None:
            tell(number + 1)
    ds = _dataset(steps, np.array([x, y], dtype=np.float64), np.arange(model.vertices)).rename(
        time="photo"
    )
    ds = ds.drop_vars(["repeated", "error_px"])
    ds["photo"] = ("photo", np.arange(len(steps)))
    if loads is not None:
        ds = ds.assign_coords(load=("photo", np.asarray(loads, dtype=np.float64), {"units": "N"}))
    ds.attrs |= {"source": ", ".join(str(getattr(path, "name", path)) for path in paths)}
    ds.attrs |= {"size": np.array(whole.shape[::-1]), "roi": np.array(box)}
    return _in_metres(ds, model, matches, how)


def _guide_of(match: Match, model: Model) -> Guide:
    """Guide for points of which the first ones are the vertices of the model, in order.

    In each frame the state is taken whose projection lies nearest to the tracked nodes; what it
    misses them by is carried over to each node from its neighbors. Lost nodes that a panel hides in
    that state are not to be looked for.
    """
    count = model.vertices
    view = match.view
    flat = np.array([view.project(state[:count]) for state in model.states])
    hidden = [hidden_nodes(state, model.triangles, view)[:count] for state in model.states]

    def guide(place: NDArray[np.float64]) -> NDArray[np.float64]:
        expected = np.full(place.shape, np.nan)
        known = np.isfinite(place[:count, 0])
        if known.sum() < _GUIDING:
            return expected
        misfit = place[:count][known] - flat[:, known]
        misfit -= np.median(misfit, axis=1, keepdims=True)
        nearest = int(np.argmin(np.abs(misfit).mean(axis=(1, 2))))
        expected[:count] = by_neighbors(place[:count], flat[nearest], np.arange(count))
        expected[:count][hidden[nearest] & ~known] = np.inf
        return expected

    return guide


def _reach(how: Tracking, shape: tuple[int, ...]) -> float:
    """Length of the edges that make a corner (pixels); one that is given must fit the picture."""
    reach, most = how.corners.reach_in(shape), 0.25 * min(shape)
    if how.corners.reach is not None and reach > most:
        raise InputError(
            f"--reach {reach:g}: at most {most:g} pixels, a quarter of the picture, are possible; "
            "about a quarter of the distance between corners is right"
        )
    return reach


def _check_length(film: Film, frames: int) -> None:
    """Refuse a film of one frame, and warn of one that breaks off."""
    if frames < 2:
        raise InputError(f"{film.path}: one frame alone shows no motion; give a longer film")
    if frames < _WHOLE * film.told:
        message = (
            f"{film.path}: breaks off: {frames} frames can be read, it should have {film.told}; "
            "the tracks end there. Copy it from the camera again"
        )
        warnings.warn(message, FoldynWarning, stacklevel=3)


def _centered(placing: Placing, size: tuple[int, ...], box: tuple[int, ...]) -> Placing:
    """The camera's axis meets the middle of the whole image, unless told otherwise."""
    if placing.axis is not None:
        return placing
    middle = 0.5 * (np.array(size) - 1.0) - np.array(box[:2])
    return replace(placing, axis=(float(middle[0]), float(middle[1])))


def _kept(frames: Any, keep: list) -> Any:
    """The frames, the last one of which stays in `keep`."""
    for time, frame in frames:
        keep[0] = frame
        yield time, frame


def _matched(
    image: NDArray[np.uint8], corners: NDArray, model: Model, how: Tracking, place: str
) -> Match:
    nodes = np.arange(model.vertices)
    reach = how.corners.reach_in(image.shape)
    asked = how.nodes or ()
    wrong = [node for node in asked if not 0 <= node < model.vertices]
    if wrong:
        raise InputError(
            f"--nodes: {wrong[0]} is no vertex of the model: 0 to {model.vertices - 1}"
        )
    if len(asked) > len(corners):
        raise InputError(
            f"{place}: {len(corners)} points are tracked, fewer than the {len(asked)} nodes asked "
            "for: take a sharper picture, a larger --roi, or fewer --nodes"
        )
    return match_nodes(
        image, corners, model.states, model.triangles, nodes, how.placing, reach, place
    )


def _linked(steps: list[Step], match: Match, apart: float) -> NDArray[np.int64]:
    """Node of each tracked point, by where both are in the last frame."""
    last = next(step for step in reversed(steps) if not step.repeated)
    nodes = np.full(len(last.position), -1)
    for node, uv in zip(match.node, match.uv, strict=True):
        distance = np.hypot(*(last.position - uv).T)
        if np.nanmin(distance, initial=np.inf) < apart:
            nodes[int(np.nanargmin(distance))] = node
    return nodes


def _dataset(steps: list[Step], origin: NDArray, nodes: NDArray[np.int64]) -> xr.Dataset:
    along = ("time", "point")
    return xr.Dataset(
        {
            "position_px": (
                (*along, "uv"),
                np.array([step.position for step in steps]) + origin,
                {"units": "pixel"},
            ),
            "error_px": (along, np.array([step.error for step in steps]), {"units": "pixel"}),
            "status": (along, np.array([step.status for step in steps])),
            "repeated": (("time",), np.array([step.repeated for step in steps])),
            "node_of_point": (("point",), np.asarray(nodes, dtype=np.int64)),
        },
        {"point": np.arange(len(nodes)), "uv": ["u", "v"]},
        {"foldyn_tracks": 1},
    )


def _in_metres(
    ds: xr.Dataset, model: Model | None, match: Match | list[Match] | None, how: Tracking
) -> xr.Dataset:
    """Add the displacements of the nodes, and what is known of the scale."""
    known = how.placing.metres_per_pixel
    if model is None or match is None:
        return ds.assign_attrs({} if known is None else {"metres_per_pixel": known})
    from foldyn.experiment.tracking.displacements import add_displacements

    missing = [node for node in how.nodes or () if node not in ds["node_of_point"].values]
    if missing:
        raise InputError(
            f"--nodes: node {missing[0]} is none of the tracked points; {len(missing)} of the "
            f"{len(how.nodes or ())} nodes asked for are not: take fewer, or another --match"
        )
    return add_displacements(ds, model, match, how.placing)
