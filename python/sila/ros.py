"""Tracked pedestrians from ROS 2 bags, and predictions for Foxglove (`pip install sila[ros]`; no ROS is needed); and
for a node of ROS 2 `detections` and `predicted_objects`, which need neither.

Positions are taken as they are, in the frame that the messages name: record them in a fixed frame such as "map".
"""

from __future__ import annotations

import os
import sqlite3
import struct
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ._config import ConfigLike, merged
from ._ellipse import ellipse, steps_at
from ._ros_messages import (
    DEFINITIONS,
    TRACKED_TYPES,
    detections,
    message_type,
    predicted_objects,
    time_s,
    tracked_objects,
    turned,
)
from ._sila import Prediction, Track
from ._tracks import Tracks, TracksLike, as_tracks, clean_rows
from .errors import FormatError

__all__ = [
    "detections",
    "message_type",
    "predicted_objects",
    "read_tracks",
    "time_s",
    "tracked_objects",
    "tracked_topics",
    "turned",
    "write_predictions",
]

@dataclass
class _Rows:
    ids: list[str] = field(default_factory=list)
    t: list[float] = field(default_factory=list)
    xy: list[tuple[float, float]] = field(default_factory=list)
    labels: list[str] = field(default_factory=list)
    frames: set[str] = field(default_factory=set)
    without_id: int = 0


def tracked_topics(bag: str | os.PathLike[str]) -> dict[str, str]:
    """The topics of a bag from which tracks can be read, and their types."""
    with _open(bag) as reader:
        return {c.topic: c.msgtype for c in reader.connections if c.msgtype in TRACKED_TYPES}


def read_tracks(
    bag: str | os.PathLike[str],
    *,
    topic: str | None = None,
    pedestrian_labels: Collection[str] = (),
    frame_id: str | None = None,
    config: ConfigLike = None,
) -> Tracks:
    """Tracks of a ROS 2 bag (a folder with sqlite3 or MCAP storage, or one .mcap file): times as in the headers [s],
    positions [m] in the frame of the messages.

    Reads autoware TrackedObjects and vision_msgs Detection3DArray whose detections have ids. `topic` may be left out
    if the bag has one such topic. Objects of another class are dropped and counted; `pedestrian_labels` are further
    class names (vision_msgs leaves them to the detector) that mean pedestrians. With `frame_id`, only messages in that
    frame are read; without it there must be one frame. Rows are cleaned as those of files are (group `clean`).
    """
    rows = _Rows()
    with _open(bag) as reader:
        wanted = _connections(bag, reader, topic)
        for connection, stamp_ns, data in reader.messages(connections=wanted):
            message = reader.deserialize(data, connection.msgtype)
            if frame_id is None or message.header.frame_id == frame_id:
                _add(message, time_s(message) or stamp_ns / 1e9, pedestrian_labels, rows)
    if len(rows.frames) > 1:
        raise FormatError(os.fspath(bag), 0, "positions in one frame (or frame_id)", ", ".join(sorted(rows.frames)))
    if not rows.ids:
        found = f"{rows.without_id} objects without an id" if rows.without_id else "no object"
        raise FormatError(os.fspath(bag), 0, "tracked objects with ids", found)
    times, points, where = np.array(rows.t), np.array(rows.xy), os.fspath(bag)
    tracks = clean_rows(rows.ids, times, points, rows.labels, where, merged("{}", config))
    tracks.report.update(rows_without_id=rows.without_id, frame_id=rows.frames.pop())
    return tracks


@contextmanager
def _extra() -> Iterator[None]:
    try:
        yield
    except ImportError as error:
        raise ImportError(f"sila.ros needs {error.name}: pip install 'sila[ros]'") from error


@contextmanager
def _open(bag: str | os.PathLike[str]) -> Iterator[Any]:
    """A reader of a bag; what it complains of at opening and reading becomes a FormatError with the bag's name."""
    with _extra():
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.rosbag2 import ReaderError
        from rosbags.serde import SerdeError
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    path = Path(bag)
    if not path.exists():
        raise FormatError(str(path), 0, "a ROS 2 bag", "no such file or folder")
    store = get_typestore(Stores.ROS2_HUMBLE)
    for package, messages in DEFINITIONS.items():
        types: dict[str, Any] = {}
        for name, text in messages.items():
            types.update(get_types_from_msg(text, f"{package}/msg/{name}"))
        store.register(types)
    try:
        with AnyReader([path], default_typestore=store) as reader:
            yield reader
    except (AnyReaderError, ReaderError, SerdeError, sqlite3.Error, struct.error, OSError) as error:
        raise FormatError(str(path), 0, "a ROS 2 bag", str(error)) from error


def _connections(bag: str | os.PathLike[str], reader: Any, topic: str | None) -> list[Any]:
    known = [c for c in reader.connections if c.msgtype in TRACKED_TYPES]
    topics = sorted({c.topic for c in known})
    if topic is None and len(topics) == 1:
        return known
    wanted = [c for c in known if c.topic == topic]
    if not wanted:
        expected = "one topic of tracked objects" if topic is None else f"tracked objects on {topic}"
        raise FormatError(os.fspath(bag), 0, expected, ", ".join(topics) or "no topic of a type that can be read")
    return wanted


def _add(message: Any, t: float, pedestrian_labels: Collection[str], rows: _Rows) -> None:
    for tracked in tracked_objects(message, pedestrian_labels):
        if not tracked.id:
            rows.without_id += 1
            continue
        rows.ids.append(tracked.id)
        rows.labels.append(tracked.label)
        rows.t.append(t)
        rows.xy.append((tracked.pose.position.x, tracked.pose.position.y))
        rows.frames.add(message.header.frame_id)


_COLOURS = ((0.76, 0.25, 0.05), (0.11, 0.31, 0.85), (0.02, 0.47, 0.34), (0.49, 0.13, 0.81), (0.63, 0.38, 0.03))


def write_predictions(
    path: str | os.PathLike[str],
    predictions: Iterable[Prediction],
    *,
    tracks: TracksLike | None = None,
    frame_id: str = "map",
    topic: str = "/sila/predictions",
    coverage: float = 0.9,
    at_s: Sequence[float] | None = None,
    lifetime_s: float = 1.0,
) -> int:
    """Writes predictions as an MCAP file of foxglove.SceneUpdate messages, which Foxglove's 3D panel shows; gives the
    number of messages.

    One entity a track, replaced by its next prediction or gone after `lifetime_s`: a line for each mode, the fainter
    the lighter; at the seconds `at_s` after t0 (at the horizon if there are none) the ellipse that is to hold the share
    `coverage`; with `tracks` also what was observed. Log times are t0 on the clock of the input, which must not be negative.
    """
    with _extra():
        from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
        from mcap_protobuf.writer import Writer

    observed = {} if tracks is None else {track.id: track for track in as_tracks(tracks)}
    some = sorted(predictions, key=lambda prediction: prediction.t0_s)
    if some and some[0].t0_s < 0.0:
        raise ValueError(f"write_predictions: predictions: expected t0_s >= 0, found {some[0].t0_s}")
    with open(path, "wb") as file, Writer(file) as writer:
        for prediction in some:
            update = SceneUpdate()
            entity = update.entities.add()
            _head(entity, prediction, frame_id, lifetime_s)
            _draw(entity, prediction, observed.get(prediction.tracklet), coverage, at_s)
            now = round(prediction.t0_s * 1e9)
            writer.write_message(topic=topic, message=update, log_time=now, publish_time=now)
    return len(some)


def _head(entity: Any, prediction: Prediction, frame_id: str, lifetime_s: float) -> None:
    entity.id = prediction.tracklet
    entity.frame_id = frame_id
    entity.timestamp.FromNanoseconds(round(prediction.t0_s * 1e9))
    entity.lifetime.FromNanoseconds(round(lifetime_s * 1e9))
    entity.metadata.add(key="track", value=prediction.track)
    entity.metadata.add(key="fallback", value=str(prediction.fallback).lower())
    entity.metadata.add(key="novelty", value=f"{prediction.novelty:.3f}")
    entity.metadata.add(key="weights", value=", ".join(f"{weight:.3f}" for weight in prediction.weights))


def _draw(
    entity: Any, prediction: Prediction, track: Track | None, coverage: float, at_s: Sequence[float] | None
) -> None:
    if track is not None:
        seen = track.positions_m[track.times_s <= prediction.t0_s + 1e-6]
        _line(entity, seen, (0.1, 0.1, 0.1), 1.0, thickness_m=0.08, closed=False)
    for number, mode in enumerate(prediction.modes):
        colour = _COLOURS[number % len(_COLOURS)]
        strength = 0.25 + 0.75 * mode.weight / prediction.modes[0].weight
        _line(entity, mode.path_m, colour, strength, thickness_m=0.12, closed=False)
        covariances = mode.covariances_m2
        for step in steps_at(prediction.times_s, at_s):
            outline = ellipse(mode.path_m[step], covariances[step], coverage, points=32)
            _line(entity, outline, colour, 0.5 * strength, thickness_m=0.04, closed=True)


def _line(
    entity: Any, points_m: Any, colour: Sequence[float], alpha: float, *, thickness_m: float, closed: bool
) -> None:
    line = entity.lines.add()
    line.type = line.LINE_LOOP if closed else line.LINE_STRIP
    line.thickness = thickness_m
    line.pose.orientation.w = 1.0
    line.color.r, line.color.g, line.color.b = colour
    line.color.a = alpha
    for x, y in points_m:
        line.points.add(x=x, y=y)
