"""Tracks of corners, and of a model's nodes, from a film or photographs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError, warn
from foldyn.experiment.tracking.corners import CornerSettings, find_corners
from foldyn.experiment.tracking.films import Film, checked_box, open_film, read_photo
from foldyn.experiment.tracking.follow import TRACKED, FollowSettings, Guide, Step, follow
from foldyn.experiment.tracking.matching import Match, Placing, by_model, match_nodes
from foldyn.experiment.tracking.tracks_dataset import add_displacements, tracks_of
from foldyn.experiment.tracking.view import TrackedModel, hidden_nodes

_GUIDING = 6  # with fewer tracked nodes, the model's states do not guide the search
_WHOLE = 0.95  # a film with a smaller share of its declared frames is incomplete


@dataclass(frozen=True)
class Tracking:
    """Settings for tracking a film or photographs.

    Attributes
    ----------
    corners : CornerSettings
    following : FollowSettings
    placing : Placing
        How the camera sees the model.
    match : {"first", "last"}
        Frame in which the model's nodes are recognized; in that frame the specimen must be in one
        of the model's states.
    nodes : tuple of int or None
        Nodes that must be found; None means as many as possible.
    """

    corners: CornerSettings = field(default_factory=CornerSettings)
    following: FollowSettings = field(default_factory=FollowSettings)
    placing: Placing = field(default_factory=Placing)
    match: str = "first"
    nodes: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        if self.match not in ("first", "last"):
            raise InputError(f'--match {self.match!r}: use "first" or "last"')

    def centered(self, size: tuple[int, ...], box: tuple[int, ...]) -> Tracking:
        """Copy with the camera's axis in the middle of the image, unless the axis is given."""
        if self.placing.axis is not None:
            return self
        u, v = (0.5 * (np.array(size) - 1.0) - np.array(box[:2])).tolist()
        return replace(self, placing=replace(self.placing, axis=(u, v)))

    def reach(self, shape: tuple[int, ...]) -> float:
        """Length of the edges that make a corner (pixels); refused if too long for the picture."""
        reach, most = self.corners.reach_in(shape), 0.25 * min(shape)
        if self.corners.reach is not None and reach > most:
            raise InputError(
                f"--reach {reach:g}: at most {most:g} pixels, a quarter of the picture, are "
                "possible; about a quarter of the distance between corners is right"
            )
        return reach


def track_film(
    film: Film | str,
    model: TrackedModel | None = None,
    *,
    tracking: Tracking | None = None,
    tell: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """Track the corners in a film.

    Parameters
    ----------
    film : Film or path
    model : TrackedModel, optional
        Model to recognize in the film; the result then includes its nodes' displacements.
    tracking : Tracking
    tell : callable, optional
        Called with the number of each finished frame.

    Returns
    -------
    xarray.Dataset
        `position_px` (time, point, uv), pixels of the whole image, NaN where a point is lost;
        `error_px` (time, point), the standard error of the position; `status` (time, point): 0
        lost, 1 found again, 2 tracked; `repeated` (time): the frame repeats the previous one. With
        a model, `displacement` (time, node, axis) in m from rest, NaN where lost and along the line
        of sight, `node_of_point` (point), -1 for none, and figures of quality of each node.

    Raises
    ------
    InputError
        There are no corners, the model does not fit them, there are fewer points than requested
        nodes, or the film has a single frame.

    Warns
    -----
    FoldynWarning
        The film has fewer frames than it declares.
    """
    film = film if isinstance(film, Film) else open_film(film)
    tracking = (tracking or Tracking()).centered(film.size, film.box)
    first = last = next(film.frames())[1]
    reach = tracking.reach(first.shape)
    match, guide, unseen = None, None, None
    if model is not None and tracking.match == "first":
        match = _matched(first, model, tracking, f"{film.path}, first frame")
        guide = _guide_of(match, model)
        nodes = np.arange(model.vertices)
        corners = match.expected[nodes].copy()
        corners[match.node] = match.uv
        unseen = ~np.isin(nodes, match.node)
    else:
        corners = find_corners(first, tracking.corners, place=f"{film.path}, first frame")
        nodes = np.full(len(corners), -1)

    def frames() -> Iterator[tuple[float, NDArray[np.uint8]]]:
        nonlocal last
        for time, frame in film.frames():
            last = frame
            yield time, frame

    steps: list[Step] = []
    for step in follow(
        frames(), corners, reach=reach, settings=tracking.following, unseen=unseen, guide=guide
    ):
        steps.append(step)
        if tell is not None:
            tell(len(steps))
    _check_length(film, len(steps))
    if model is not None and match is None:
        match = _matched(last, model, tracking, f"{film.path}, last frame")
        nodes = _linked(steps, match, 0.5 * reach)
    ds = tracks_of(steps, nodes, film.size, film.box)
    matched = 0 if tracking.match == "first" else len(steps) - 1
    ds.attrs |= {"source": film.path.name, "rate": film.rate, "match_frame": matched}
    return _in_metres(ds, model, [] if match is None else [match], tracking)


def track_photos(
    paths: Sequence[Any],
    model: TrackedModel,
    *,
    tracking: Tracking | None = None,
    loads: ArrayLike | None = None,
    roi: tuple[int, int, int, int] | None = None,
    tell: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """Find the nodes of a model in photographs, one for each load.

    The model is recognized separately in each photograph, in one of its states, since nodes may
    move farther than their spacing between photographs.

    Parameters
    ----------
    paths : sequence of path
        At least two photographs.
    model : TrackedModel
        Model, with the states of a path if the specimen changes its shape.
    tracking : Tracking
    loads : array_like, shape (number of photographs,), optional
    roi : tuple of int, optional
        Region of interest: column, row, width, height.
    tell : callable, optional
        Called with the number of each finished photograph.

    Returns
    -------
    xarray.Dataset
        As in `track_film`, along the dimension `photo` instead of `time`, with the coordinate
        `load` if loads are given.

    Raises
    ------
    InputError
        There is only one photograph, photographs differ in size, there are no corners, or the model
        does not fit.
    """
    if len(paths) < 2:
        raise InputError(
            f"{paths[0] if paths else 'photographs'}: one photograph alone shows no displacement; "
            "give at least two, the first one unloaded"
        )
    if loads is not None and np.shape(loads) != (len(paths),):
        raise InputError(f"--loads: {np.size(loads)} loads for {len(paths)} photographs")
    whole = read_photo(paths[0])
    size = whole.shape[::-1]
    x, y, width, height = box = checked_box(roi, *size)
    tracking = (tracking or Tracking()).centered(size, box)
    tracking.reach((height, width))
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
        match = _matched(photo, model, tracking, str(path))
        position = np.full((model.vertices, 2), np.nan)
        position[match.node] = match.uv
        status = (TRACKED * np.isfinite(position[:, 0])).astype(np.int8)
        steps.append(Step(float(number), position, np.zeros(len(position)), status, False))
        matches.append(match)
        if tell is not None:
            tell(number + 1)
    ds = tracks_of(steps, np.arange(model.vertices), size, box, "photo")
    if loads is not None:
        ds = ds.assign_coords(load=("photo", np.asarray(loads, dtype=np.float64), {"units": "N"}))
    ds.attrs |= {"source": ", ".join(str(getattr(path, "name", path)) for path in paths)}
    return _in_metres(ds, model, matches, tracking)


def _guide_of(match: Match, model: TrackedModel) -> Guide:
    """Guide for points, of which the first are the model's vertices in order.

    In each frame the guide takes the state whose projection is nearest to the tracked nodes, and
    corrects each node by the residuals of its neighbors. Lost nodes that a panel hides in that
    state are not searched for.
    """
    count, view = model.vertices, match.view
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
        expected[:count] = by_model(place[:count], flat[nearest], np.arange(count))
        expected[:count][hidden[nearest] & ~known] = np.inf
        return expected

    return guide


def _check_length(film: Film, frames: int) -> None:
    """Refuse a film of one frame, and warn if a film ends early."""
    if frames < 2:
        raise InputError(f"{film.path}: one frame alone shows no motion; give a longer film")
    if frames < _WHOLE * film.declared:
        message = (
            f"{film.path}: breaks off: {frames} frames can be read, it should have "
            f"{film.declared}; the tracks end there. Copy it from the camera again"
        )
        warn(message, "tracking.md#limits")


def _matched(
    image: NDArray[np.uint8], model: TrackedModel, tracking: Tracking, place: str
) -> Match:
    """Find the corners of a picture, and the model's nodes among them."""
    corners = find_corners(image, tracking.corners, place=place)
    asked = tracking.nodes or ()
    wrong = [node for node in asked if not 0 <= node < model.vertices]
    if wrong:
        raise InputError(f"--nodes: {wrong[0]}: the model has vertices 0 to {model.vertices - 1}")
    if len(asked) > len(corners):
        raise InputError(
            f"{place}: {len(corners)} points are tracked, fewer than the {len(asked)} nodes asked "
            "for: take a sharper picture, a larger --roi, or fewer --nodes"
        )
    return match_nodes(
        image, corners, states=model.states, triangles=model.triangles,
        nodes=np.arange(model.vertices), placing=tracking.placing,
        reach=tracking.corners.reach_in(image.shape), place=place,
    )  # fmt: skip


def _linked(steps: list[Step], match: Match, apart: float) -> NDArray[np.int64]:
    """Node of each tracked point, found from its position in the last frame."""
    last = next(step for step in reversed(steps) if not step.repeated)
    nodes = np.full(len(last.position), -1)
    for node, uv in zip(match.node, match.uv, strict=True):
        distance = np.hypot(*(last.position - uv).T)
        if np.nanmin(distance, initial=np.inf) < apart:
            nodes[int(np.nanargmin(distance))] = node
    return nodes


def _in_metres(
    ds: xr.Dataset, model: TrackedModel | None, matches: Sequence[Match], tracking: Tracking
) -> xr.Dataset:
    """Add the displacements of the nodes, and the scale."""
    known = tracking.placing.metres_per_pixel
    if model is None:
        return ds.assign_attrs({} if known is None else {"metres_per_pixel": known})
    asked = tracking.nodes or ()
    missing = [node for node in asked if node not in ds["node_of_point"].values]
    if missing:
        raise InputError(
            f"--nodes: {len(missing)} of the {len(asked)} nodes asked for were not tracked, such "
            f"as node {missing[0]}: take fewer, or another --match"
        )
    return add_displacements(ds, model, matches, tracking.placing)
