"""Films and case files that the tests share."""

from __future__ import annotations

import fit_cases
import pytest


@pytest.fixture(scope="session")
def pressed(tmp_path_factory):
    """A case file of a fold that is pressed."""
    return fit_cases.write(tmp_path_factory.mktemp("pressed"))


@pytest.fixture(scope="session")
def swung(tmp_path_factory):
    """A case file of a fold that swings."""
    return fit_cases.write(tmp_path_factory.mktemp("swung"), fit_cases.SWUNG)


@pytest.fixture(scope="session")
def sharp(tmp_path_factory):
    """Four periods, sharp and without noise; frame 30 repeats the one before."""
    from miura_film import Scene, make_film, model

    from foldyn.experiment import write_film

    path = tmp_path_factory.mktemp("film") / "sharp.mkv"
    film = make_film(80, dropped=(30,), samples=4)
    write_film(film, path)
    return Scene(path, film, film.truth(), model())


@pytest.fixture(scope="session")
def tracked(sharp):
    """The tracks of that film."""
    from miura_film import DISTANCE, SCALE

    from foldyn.experiment import Placing, Tracking, track_film

    tracking = Tracking(placing=Placing(metres_per_pixel=SCALE, distance=DISTANCE))
    return track_film(str(sharp.path), sharp.model, tracking=tracking)
