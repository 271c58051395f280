"""Learns how pedestrians move at intersections, batch by batch, and predicts their next seconds.

Lengths are metres, times seconds; positions are in the world frame of the scene; each row of an array is a point.
The C++ library computes everything, as in the program `sila`.
"""

from . import errors
from ._config import Field, config, fields
from ._evaluation import Evaluation
from ._predictions import Predictions
from ._predictor import Predictor
from ._sila import (
    CurbFrame,
    Mode,
    Model,
    Prediction,
    Primitive,
    Scene,
    Site,
    Track,
    Transition,
    modified_hausdorff_m,
)
from ._sila import revision
from ._sila import version as __version__
from ._stream import Stream
from ._tracks import Tracks, as_tracks, read_tracks, split_tracks
from ._verbs import (
    Simulation,
    evaluate,
    explain,
    explain_fusion,
    fuse,
    learn,
    make_prior,
    predict,
    simulate,
    train_batch,
)
from .errors import FormatError, NumericalError

# As in a class of Python that has __eq__ alone: equal objects must not have different hashes.
for _compared in (CurbFrame, Model, Prediction, Scene, Track):
    _compared.__hash__ = None  # type: ignore[assignment, method-assign]
del _compared

__all__ = [
    "CurbFrame",
    "Evaluation",
    "Field",
    "FormatError",
    "Mode",
    "Model",
    "NumericalError",
    "Prediction",
    "Predictions",
    "Predictor",
    "Primitive",
    "Scene",
    "Simulation",
    "Site",
    "Stream",
    "Track",
    "Tracks",
    "Transition",
    "__version__",
    "as_tracks",
    "config",
    "errors",
    "evaluate",
    "explain",
    "explain_fusion",
    "fields",
    "fuse",
    "learn",
    "make_prior",
    "train_batch",
    "modified_hausdorff_m",
    "predict",
    "read_tracks",
    "revision",
    "simulate",
    "split_tracks",
]
