"""Static test: nodes in photographs between which they move farther than to their neighbors."""

from __future__ import annotations

import numpy as np
import pytest
from miura_film import DISTANCE, SCALE, camera, cv2, folded, model, moving_states

from foldyn.errors import InputError
from foldyn.experiment import Look, Placing, Sensor, Tracking, track_photos
from foldyn.experiment.rendering.picture import Studio

DIHEDRALS = (75.0, 68.0, 62.0)
PLACED = Tracking(placing=Placing(metres_per_pixel=SCALE, distance=DISTANCE))


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photos")
    studio = Studio.of(folded(75.0), camera(), Look(), Sensor(samples=4, read_noise=1.0), 2)
    states = moving_states(DIHEDRALS)
    paths = []
    for k, state in enumerate(states):
        paths.append(folder / f"load{k}.png")
        cv2.imwrite(str(paths[-1]), studio.take(state, np.random.default_rng(k))[0])
    return paths, states


@pytest.mark.matrix
def test_every_node_is_recognized_in_every_photograph(photos):
    paths, states = photos
    true = camera().project(states[:, :25])
    step = np.hypot(*(true[2] - true[0]).T).max()
    assert step > 25.0  # pixels: too far for a search around the last place
    ds = track_photos(paths, model(), tracking=PLACED, loads=[0.0, 0.1, 0.2])
    error = np.hypot(*np.moveaxis(ds["position_px"].values - true, -1, 0))
    assert np.isfinite(error).mean() > 0.85
    assert np.nanmax(error) < 2.0
    assert ds["load"].values.tolist() == [0.0, 0.1, 0.2]
    assert ds["photo"].values.tolist() == [0, 1, 2]
    # the state of the model in each: 7 and 13 degrees more folded than at rest (6 of 12)
    np.testing.assert_allclose(ds.attrs["match_state"], [6.0, 3.2, 0.8], atol=0.25)
    moved = ds["displacement"].values - (states[:, :25] - model().rest[:25])
    assert np.sqrt(np.nanmean(moved[..., 0] ** 2)) < 2e-4


@pytest.mark.matrix
def test_the_region_of_interest_shifts_nothing(photos):
    paths, states = photos
    ds = track_photos(paths[:2], model(), tracking=PLACED, roi=(10, 20, 560, 590))
    true = camera().project(states[:2, :25])
    assert np.nanmax(np.hypot(*np.moveaxis(ds["position_px"].values - true, -1, 0))) < 2.0
    moved = ds["displacement"].values - (states[:2, :25] - model().rest[:25])
    assert np.sqrt(np.nanmean(moved[..., 0] ** 2)) < 4e-4


@pytest.mark.matrix
@pytest.mark.parametrize("count", [0, 1])
def test_one_photograph_alone_is_refused(photos, count):
    with pytest.raises(InputError, match="one photograph alone"):
        track_photos(photos[0][:count], model())


def test_loads_belong_to_photographs(photos):
    with pytest.raises(InputError, match="--loads: 2 loads for 3"):
        track_photos(photos[0], model(), loads=[0.0, 1.0])
