# Public names and where they live; loaded when they are first used (facade.py)

from foldyn.experiment.calibration.fit import Course as Course, fit as fit
from foldyn.experiment.calibration.fitted import Descent as Descent, Fit as Fit, Score as Score
from foldyn.experiment.calibration.histories import Spectrum as Spectrum, TimeHistory as TimeHistory
from foldyn.experiment.calibration.measured import (
    ForceDisplacement as ForceDisplacement,
    Measured as Measured,
    Shapes as Shapes,
)
from foldyn.experiment.calibration.measurement import Measurement as Measurement
from foldyn.experiment.calibration.modal import (
    DampingRatios as DampingRatios,
    ModeShapes as ModeShapes,
    NaturalFrequencies as NaturalFrequencies,
)
from foldyn.experiment.calibration.parameters import Parameter as Parameter
from foldyn.experiment.calibration.modal import FrequencyResponse as FrequencyResponse
from foldyn.experiment.calibration.fitted import Estimate as Estimate
from foldyn.experiment.camera import (
    Camera as Camera,
    Scale as Scale,
    Sight as Sight,
    opencv as opencv,
    scale_of_lengths as scale_of_lengths,
    scale_of_target as scale_of_target,
)
from foldyn.experiment.rendering.picture import Look as Look, Sensor as Sensor
from foldyn.experiment.rendering.synthetic import (
    SyntheticFilm as SyntheticFilm,
    film_of as film_of,
    photos_of as photos_of,
    write_film as write_film,
)
from foldyn.experiment.tracking.corners import (
    CornerSettings as CornerSettings,
    find_corners as find_corners,
    refine as refine,
)
from foldyn.experiment.tracking.films import (
    Film as Film,
    open_film as open_film,
    read_photo as read_photo,
)
from foldyn.experiment.tracking.follow import FollowSettings as FollowSettings, follow as follow
from foldyn.experiment.tracking.matching import (
    Match as Match,
    Placing as Placing,
    match_nodes as match_nodes,
)
from foldyn.experiment.tracking.tracks import (
    Tracking as Tracking,
    track_film as track_film,
    track_photos as track_photos,
)
from foldyn.experiment.tracking.tracks_dataset import (
    load_tracks as load_tracks,
    save_tracks as save_tracks,
    write_csv as write_csv,
)
from foldyn.experiment.tracking.view import TrackedModel as TrackedModel
