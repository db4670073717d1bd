"""The experiment: camera tracking, synthetic films to plan and to test it, and calibration.

OpenCV is an optional part (``pip install foldyn[experiment]``), looked for when it is used.
"""

from __future__ import annotations

from foldyn.experiment.calibration.fit import Course, fit
from foldyn.experiment.calibration.fitted import Descent, Estimate, Fit, Score
from foldyn.experiment.calibration.measured_motions import History, Spectrum
from foldyn.experiment.calibration.measured_paths import ForceDisplacement, Shapes
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.parameters import Parameter
from foldyn.experiment.camera import Camera
from foldyn.experiment.opencv import opencv
from foldyn.experiment.rendering.paper import Look
from foldyn.experiment.rendering.picture import Sensor
from foldyn.experiment.rendering.synthetic import SyntheticFilm, film_of, photos_of, write_film
from foldyn.experiment.tracking.corners import CornerSettings, find_corners
from foldyn.experiment.tracking.films import Film, open_film, read_photo
from foldyn.experiment.tracking.follow import FollowSettings, follow
from foldyn.experiment.tracking.junctions import refine
from foldyn.experiment.tracking.matching import Match, Placing, match_nodes
from foldyn.experiment.tracking.models import Model
from foldyn.experiment.tracking.scale import Scale, scale_of_lengths, scale_of_target
from foldyn.experiment.tracking.store import load_tracks, save_tracks, write_csv
from foldyn.experiment.tracking.tracks import Tracking, track_film, track_photos

__all__ = [
    "Camera",
    "CornerSettings",
    "Course",
    "Descent",
    "Estimate",
    "Film",
    "Fit",
    "FollowSettings",
    "ForceDisplacement",
    "History",
    "Look",
    "Match",
    "Measurement",
    "Model",
    "Parameter",
    "Placing",
    "Scale",
    "Score",
    "Sensor",
    "Shapes",
    "Spectrum",
    "SyntheticFilm",
    "Tracking",
    "film_of",
    "find_corners",
    "fit",
    "follow",
    "load_tracks",
    "match_nodes",
    "open_film",
    "opencv",
    "photos_of",
    "read_photo",
    "refine",
    "save_tracks",
    "scale_of_lengths",
    "scale_of_target",
    "track_film",
    "track_photos",
    "write_csv",
    "write_film",
]
