"""The experiment: camera tracking, synthetic films to plan and to test it, and calibration.

OpenCV is an optional part (``pip install foldyn[experiment]``), looked for when it is used.
"""

from __future__ import annotations

from foldyn.experiment.camera import Camera
from foldyn.experiment.corners import CornerSettings, find_corners
from foldyn.experiment.films import Film, open_film, read_photo
from foldyn.experiment.fit import Course, fit
from foldyn.experiment.fitted import Descent, Estimate, Fit, Score
from foldyn.experiment.follow import FollowSettings, follow
from foldyn.experiment.junctions import refine
from foldyn.experiment.matching import Match, Placing, match_nodes
from foldyn.experiment.measured_motions import History, Spectrum
from foldyn.experiment.measured_paths import ForceDisplacement, Shapes
from foldyn.experiment.measurement import Measurement
from foldyn.experiment.models import Model
from foldyn.experiment.opencv import opencv
from foldyn.experiment.paper import Look
from foldyn.experiment.parameters import Parameter
from foldyn.experiment.picture import Sensor
from foldyn.experiment.scale import Scale, scale_of_lengths, scale_of_target
from foldyn.experiment.store import load_tracks, save_tracks, write_csv
from foldyn.experiment.synthetic import SyntheticFilm, film_of, photos_of, write_film
from foldyn.experiment.tracks import Tracking, track_film, track_photos

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
