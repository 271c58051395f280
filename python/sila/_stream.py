"""The live service in process: detections in, predictions out, learning in the background."""

from __future__ import annotations

import ctypes
import json
import os
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from . import _sila
from ._config import ConfigLike, merged
from ._predictions import Predictions
from ._rows import counted, file_named, floats_of, label_for, labels_of_frame, names_of, number, text_of, warn
from ._sila import Model
from ._tracks import SceneLike
from ._verbs import _model, _place, _settings

#: Ids, positions of shape (n, 2) and labels, one entry a detection.
_Rows = tuple[list[str], Any, list[str]]


class Stream:
    """Does inside the process what `sila serve` does for one tracker: each `update` returns the predictions that
    are due, and finished tracks are learnt in a background thread.

    `model`: a Model to continue, or the path of a model file to continue or create, in which each episode is stored;
    without one a new model. `scene` as for `learn`. `camera`: the path of a camera file (docs/formats.md); positions
    are then image points [pixels] on the ground, as the foot of a box. If the scene has a camera, give this file, or
    False for positions in metres. `person_classes`: labels that are pedestrians, instead of the usual names.
    `stride_s`: seconds between the predictions of a pedestrian, 0: one for each detection. `batch`: finished tracks
    that make an episode. `config` changes the configuration of the model; its group `service` has the limits. Methods
    may be called from several threads.

    Warns once if positions do not seem to be metres, and of each episode that fails. Raises FormatError for a model or
    camera file that cannot be used, or a configuration out of range.
    """

    def __init__(
        self,
        model: Model | str | os.PathLike[str] | None = None,
        *,
        scene: SceneLike | None = None,
        camera: str | os.PathLike[str] | Literal[False] | None = None,
        person_classes: str | Sequence[str] = (),
        stride_s: float | None = None,
        batch: int | None = None,
        config: ConfigLike = None,
    ) -> None:
        file = Path(model) if isinstance(model, (str, os.PathLike)) else None
        if file is not None:
            start = Model.load(file) if file.exists() else Model()
        else:
            start = Model() if model is None else _model("model", model)
        service = {name: value for name, value in (("stride_s", stride_s), ("batch", batch)) if value is not None}
        settings = merged(_settings("model", start, config), {"service": service})
        self._person_classes = names_of(person_classes)
        camera_file = None if camera is None or camera is False else file_named("camera", camera)
        place = _place(scene, start, [], settings)
        self._process, self._closed = os.getpid(), False
        self._own = _sila.LiveStream(start, file, place, camera_file, camera is False, settings)
        self._warn()

    @property
    def _live(self) -> _sila.LiveStream:
        if os.getpid() != self._process:  # a fork, which has no thread that learns
            raise RuntimeError("Stream: the stream belongs to another process; make one in this process")
        return self._own

    def __del__(self) -> None:
        if (own := self.__dict__.get("_own")) is None:  # the constructor has raised
            return
        if os.getpid() != self._process:  # keep it: its end would wait for a thread that the fork does not have
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(own))
        elif not self._closed:
            warnings.warn(f"unclosed {self!r}: its last tracks are not learnt", ResourceWarning, source=self)

    def update(self, t: float, detections: Any) -> Predictions:
        """Takes the detections of the time `t` [s] and returns the predictions that are due, in their order.

        `detections`: tuples (id, x, y) or (id, x, y, label); a dictionary from id to (x, y); an array of shape (n, 3)
        with the columns id, x, y; a data frame with the columns track_id or id, x, y (and label, class or
        category); or, with a camera, Detections of Supervision that have ids, all of them pedestrians. Metres in the
        frame of the scene, or pixels.

        `counts["rejected"]` counts what the rules of the service reject, by reason. Raises ValueError or TypeError for
        what is no detection at all, and ValueError after `close`.
        """
        t_s = number("t", t, "seconds")
        ids, points, labels = _rows(detections, self._person_classes)
        predictions = Predictions(self._live.update(t_s, ids, points, labels))
        self._warn()
        return predictions

    def close(self) -> None:
        """Ends all tracks and learns them, the last in a smaller batch; returns when it is done. `model` and `counts`
        stay."""
        self._live.close()
        self._closed = True
        self._warn()

    def wait(self) -> None:
        """Returns when no whole batch waits to be learnt; so the result for a recording does not depend on speed."""
        self._live.wait()
        self._warn()

    @property
    def model(self) -> Model:
        """The model after the last complete episode; with a model file, what the file has now."""
        return self._live.model

    @property
    def counts(self) -> dict[str, Any]:
        """Counts of detections and tracks. Detections that were not rejected are
        detections = not_due + predictions + superseded; `rejected` has the others by reason (docs/service.md)."""
        return self._live.counts()

    @property
    def metrics(self) -> dict[str, Any]:
        """Errors beside constant velocity, coverage, novelty and drift of recent pedestrians, as on the live page."""
        metrics: dict[str, Any] = json.loads(self._live.metrics())
        return metrics

    def to_image(self, points_m: Any) -> np.ndarray:
        """Points (n, 2) on the ground [m] as image points (n, 2) [pixels]; NaN behind the camera. Raises ValueError
        without a camera."""
        return self._live.to_image(points_m)

    def _warn(self) -> None:
        warn(self._live.take_warnings())

    def __enter__(self) -> Stream:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __getstate__(self) -> object:
        raise TypeError("Stream: a stream cannot be copied or pickled; its model can")

    def __repr__(self) -> str:
        counts = ", ".join(counted(self.counts[f"{noun}s"], noun) for noun in ("detection", "prediction"))
        return f"Stream({counts}, {self.model!r})"


def _rows(detections: Any, person_classes: list[str]) -> _Rows:
    if hasattr(detections, "xyxy"):
        return _of_boxes(detections)
    if hasattr(detections, "columns"):
        return _of_frame(detections, person_classes)
    if isinstance(detections, np.ndarray):
        if detections.size == 0:  # np.array([]) has one dimension
            return [], np.empty((0, 2)), []
        if detections.ndim != 2 or detections.shape[1] != 3:
            raise ValueError(f"detections: expected shape (n, 3) with the columns id, x, y; found {detections.shape}")
        return [text_of(key) for key in detections[:, 0]], _points(detections[:, 1:]), [""] * len(detections)
    several: Any = None if isinstance(detections, (str, bytes)) else detections
    try:
        if isinstance(detections, Mapping):
            several = [(key, *position) for key, position in detections.items()]
        several = list(several)
        if any(isinstance(entry, (str, Mapping)) for entry in several):
            raise TypeError
        entries: list[Any] = [tuple(entry) for entry in several]
    except TypeError:
        raise TypeError(f"detections: expected (id, x, y) tuples, found {detections!r:.80}") from None
    for entry in entries:
        if len(entry) not in (3, 4) or (isinstance(detections, Mapping) and len(entry) == 4):
            expected = "id: (x, y)" if isinstance(detections, Mapping) else "(id, x, y) or (id, x, y, label)"
            raise ValueError(f"detections: expected {expected}, found {entry!r}")
        if len(entry) == 4 and isinstance(entry[3], (float, np.floating)) and text_of(entry[3]):
            raise ValueError(f"detections: expected a text or a whole number as label, found {entry[3]!r} in {entry!r}")
    labels = [label_for(text_of(entry[3]), person_classes) if len(entry) == 4 else "" for entry in entries]
    return [text_of(entry[0]) for entry in entries], _points([entry[1:3] for entry in entries]), labels


def _of_frame(frame: Any, person_classes: list[str]) -> _Rows:
    key = next((name for name in ("track_id", "id") if name in frame.columns), None)
    if key is None or not {"x", "y"} <= set(frame.columns):
        found = ", ".join(map(str, frame.columns))
        raise ValueError(f"detections: expected the columns track_id or id, x, y; found {found}")
    labels = labels_of_frame("detections", frame, person_classes) or [""] * len(frame)
    return [text_of(value) for value in frame[key]], _points(frame[["x", "y"]]), labels


def _of_boxes(detections: Any) -> _Rows:
    """The feet of boxes: the middle of the bottom edge."""
    boxes = floats_of(detections.xyxy)
    if len(boxes) == 0:
        return [], np.empty((0, 2)), []
    if detections.tracker_id is None:
        raise ValueError("detections: they have no tracker_id; run a tracker first")
    if boxes.ndim != 2 or boxes.shape[1] != 4:
        raise ValueError(f"detections: xyxy: expected shape (n, 4), found {boxes.shape}")
    if len(detections.tracker_id) != len(boxes):
        raise ValueError(f"detections: tracker_id: expected {len(boxes)} ids, found {len(detections.tracker_id)}")
    feet = np.column_stack([(boxes[:, 0] + boxes[:, 2]) / 2.0, boxes[:, 3]])
    return [text_of(key) for key in detections.tracker_id], feet, [""] * len(boxes)


def _points(given: Any) -> Any:
    try:
        return floats_of(given).reshape(-1, 2)
    except (TypeError, ValueError) as error:
        raise ValueError(f"detections: expected numbers x, y; {error}") from None
