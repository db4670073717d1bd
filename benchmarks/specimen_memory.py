"""The paper specimen with creases that relax: `python benchmarks/specimen_memory.py`.

A film is made of a sheet that is the model but for its creases, tracked, and fitted: damping and
relaxation come out within their intervals, the true values beside them. Takes three minutes once
compiled. The model is seen by the camera, and where it finds a node at rest is not known to a tenth
of a pixel: the mean of each history counts for nothing.
"""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path

import foldyn as fd
from foldyn import experiment
from foldyn.experiment import Parameter, Sight, TimeHistory
from foldyn.studies.herkal import calibration
from foldyn.studies.herkal.calibration import DAMPING, FRONT, FULL
from foldyn.studies.herkal.specimen import evaluation, synthetic, tasks

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


def fitted(folder: Path):
    """Fit to the tracks of the film's release."""
    shot = synthetic.COARSE
    experiment.write_film(synthetic.film(folder, shot, synthetic.RELAXING), folder / "film.mkv")
    tracks = experiment.track_film(experiment.open_film(str(folder / "film.mkv")), tasks._model())
    along, since = tracks.displacement.sel(axis="x"), tracks.time.values - shot.held
    held = along.sel(node=list(FRONT)).values[since < -0.005].mean(axis=0)
    press = FULL * evaluation.load_factor(calibration.pressed(evaluation.FACTORS), FRONT, held)
    path = calibration.released_case(
        folder / "model", synthetic.RELAXING, press=press, support="glued", duration=shot.free
    )
    kept = (since > 0.015) & (since < shot.free - 0.01)
    nodes = [node for node in FRONT if tracks.tracked.sel(node=node) > 0.6]
    data = TimeHistory(
        nodes=nodes, time=since[kept], values=along.sel(node=nodes).values[kept], axis="x",
        align=0.003, detrend="constant", sight=Sight.of(tracks),
    )  # fmt: skip
    return fd.fit(path, [data], parameters=PARAMETERS)


if __name__ == "__main__":
    warnings.simplefilter("ignore")  # steps as coarse as the data's; beta as the paper has it
    with tempfile.TemporaryDirectory() as name:
        found = fitted(Path(name))
    for one in found.estimates:
        inside = "holds" if one.lower < TRUE[one.key] < one.upper else "misses"
        print(f"{one.key}: {one.lower:.4g} to {one.upper:.4g} {inside} {TRUE[one.key]:.4g}")
    print(f"misfit {1e6 * found.scores[0].rms:.1f} micrometers, of a drift of 200")
