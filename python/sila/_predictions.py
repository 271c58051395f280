"""Predictions of many tracks."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ._rows import Items, counted, text_of
from ._sila import Prediction

if TYPE_CHECKING:
    import pandas


class Predictions(Items[Prediction]):
    """Predictions in the order of their tracks and times. A slice, a mask or a list of indices gives Predictions."""

    _type = Prediction

    def __init__(self, predictions: Iterable[Prediction] = ()) -> None:
        super().__init__(predictions)

    def __repr__(self) -> str:
        tracks = len({prediction.tracklet for prediction in self})
        return f"Predictions({counted(len(self), 'prediction')} for {counted(tracks, 'track')})"

    def of(self, track: str | int) -> Predictions:
        """Those of one track, by its id in the input."""
        name = text_of(track)
        return Predictions(prediction for prediction in self if prediction.track == name)

    def to_frame(self) -> pandas.DataFrame:
        """One row a mode and time: track_id, t0, fallback, novelty, mode, weight, variant, t, x, y, cov_xx, cov_xy,
        cov_yy."""
        import pandas

        frames = [frame_of(prediction) for prediction in self]
        return pandas.concat(frames, ignore_index=True) if frames else pandas.DataFrame(columns=_TYPES).astype(_TYPES)

    def to_ndjson(self, path: str | os.PathLike[str] | None = None, *, digits: int = 3) -> str:
        """The lines that `sila predict --digits` writes, 17: every number in full; also to a file if one is named."""
        text = "".join(prediction.to_json(digits) + "\n" for prediction in self)
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text


#: Of the columns without a row, so that they can be joined with others.
_TYPES = dict.fromkeys("track_id t0 fallback novelty mode weight variant t x y cov_xx cov_xy cov_yy".split(), "float64")
_TYPES |= {"track_id": "string", "fallback": "bool", "mode": "int64", "variant": "string"}


def frame_of(prediction: Prediction) -> pandas.DataFrame:
    """A prediction as a data frame, one row a mode and time; seconds after t0, metres, world frame."""
    import pandas

    paths, covariances = prediction.paths_m, prediction.covariances_m2
    modes, steps = paths.shape[:2]
    return pandas.DataFrame(
        {
            "track_id": prediction.track,
            "t0": prediction.t0_s,
            "fallback": prediction.fallback,
            "novelty": prediction.novelty,
            "mode": np.repeat(np.arange(modes), steps),
            "weight": np.repeat(prediction.weights, steps),
            "variant": np.repeat([mode.variant for mode in prediction.modes], steps),
            "t": np.tile(prediction.times_s, modes),
            "x": paths[..., 0].ravel(),
            "y": paths[..., 1].ravel(),
            "cov_xx": covariances[..., 0, 0].ravel(),
            "cov_xy": covariances[..., 0, 1].ravel(),
            "cov_yy": covariances[..., 1, 1].ravel(),
        }
    )
