"""The paper specimen with creases that relax: it drifts back, and fits tell by how much."""

from __future__ import annotations

import pytest

import foldyn as fd
from foldyn import experiment
from foldyn.experiment import Parameter, Sight, TimeHistory
from foldyn.studies.herkal import calibration
from foldyn.studies.herkal.calibration import DAMPING, FRONT, FULL
from foldyn.studies.herkal.specimen import evaluation, synthetic, tasks

NODES = (8, 22, 36)  # one in each third of the height
TRUE = {
    **DAMPING,
    "model.fold_law.ratios[0]": synthetic.RATIO,
    "model.fold_law.times[0]": synthetic.TIME,
}
PARAMETERS = [
    *calibration.DAMPING_RANGES,
    Parameter("model.fold_law.ratios[0]", 0.1, 0.0, 0.5),
    Parameter("model.fold_law.times[0]", 0.3, 0.05, 3.0),
]


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:.*time step is too coarse")  # as coarse as the data's
def test_a_film_tells_drift_and_decay(tmp_path):
    """From the film of a sheet that is the model but for its creases; 3 minutes once compiled.

    The model is seen by the camera, and where it finds a node at rest is not known to a tenth of a
    pixel: the mean of each history counts for nothing.
    """
    pytest.importorskip("cv2")
    shot = synthetic.COARSE
    film = synthetic.film(tmp_path, shot, synthetic.RELAXING)
    experiment.write_film(film, tmp_path / "film.mkv")
    tracks = experiment.track_film(experiment.open_film(str(tmp_path / "film.mkv")), tasks._model())
    along, since = tracks.displacement.sel(axis="x"), tracks.time.values - shot.held
    held = along.sel(node=list(FRONT)).values[since < -0.005].mean(axis=0)
    press = FULL * evaluation.load_factor(calibration.pressed(evaluation.FACTORS), FRONT, held)
    assert press == pytest.approx(calibration.PRESSED, rel=2e-3)
    path = calibration.released_case(
        tmp_path / "model", synthetic.RELAXING, press=press, support="glued", duration=shot.free
    )
    kept = (since > 0.015) & (since < shot.free - 0.01)
    nodes = [node for node in FRONT if tracks.tracked.sel(node=node) > 0.6]
    values = along.sel(node=nodes).values[kept]
    data = TimeHistory(
        nodes=nodes, time=since[kept], values=values, axis="x", align=0.003, detrend="constant",
        sight=Sight.of(tracks),
    )  # fmt: skip
    found = fd.fit(path, [data], PARAMETERS)
    for one in found.estimates:
        assert one.lower < TRUE[one.key] < one.upper, one
        assert one.upper - one.lower < 0.2 * TRUE[one.key]
    assert found.scores[0].rms < 1.2e-5  # m, of a drift of 2e-4
