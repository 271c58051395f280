"""Predictions of many tracks."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
        """The predictions of one track, by its id in the input."""
        name = text_of(track)
        return Predictions(prediction for prediction in self if prediction.track == name)

    def to_frame(self) -> pandas.DataFrame:
        """One row for each mode and time: track_id, t0 [s], fallback, novelty, mode, weight, variant, t [s after t0],
        x, y [m], cov_xx, cov_xy, cov_yy [m²]."""
        return frame_of(*self)

    def to_ndjson(self, path: str | os.PathLike[str] | None = None, *, digits: int = 3) -> str:
        """The lines that `sila predict --digits` writes, 17: every number in full; also to a file if one is named."""
        text = "".join(prediction.to_json(digits) + "\n" for prediction in self)
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text


def frame_of(*predictions: Prediction) -> pandas.DataFrame:
    """Predictions as a data frame, one row a mode and time; seconds after t0, metres, world frame."""
    import pandas

    modes = [(prediction, number, mode) for prediction in predictions for number, mode in enumerate(prediction.modes)]
    steps = np.array([len(prediction.times_s) for prediction, _, _ in modes], dtype=int)

    def repeated(kind: type, values: Iterable[Any]) -> Any:
        return np.repeat(np.array([*values], dtype=kind), steps)

    t = np.concatenate([np.empty(0), *(prediction.times_s for prediction, _, _ in modes)])
    xy = np.concatenate([np.empty((0, 2)), *(mode.path_m for _, _, mode in modes)])
    covariances = np.concatenate([np.empty((0, 2, 2)), *(mode.covariances_m2 for _, _, mode in modes)])
    return pandas.DataFrame(
        {
            "track_id": repeated(str, (prediction.track for prediction, _, _ in modes)),
            "t0": repeated(float, (prediction.t0_s for prediction, _, _ in modes)),
            "fallback": repeated(bool, (prediction.fallback for prediction, _, _ in modes)),
            "novelty": repeated(float, (prediction.novelty for prediction, _, _ in modes)),
            "mode": repeated(int, (number for _, number, _ in modes)),
            "weight": repeated(float, (mode.weight for _, _, mode in modes)),
            "variant": repeated(str, (mode.variant for _, _, mode in modes)),
            "t": t,
            "x": xy[:, 0],
            "y": xy[:, 1],
            "cov_xx": covariances[:, 0, 0],
            "cov_xy": covariances[:, 0, 1],
            "cov_yy": covariances[:, 1, 1],
        }
    )
