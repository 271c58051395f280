"""ROS 2 messages of tracked objects in, messages of predictions out: pure functions for the messages of rclpy and of
rosbags alike, which have the same fields."""

from __future__ import annotations

import math
import uuid
from collections.abc import Callable, Collection, Iterable, Iterator
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from ._rows import names_of
from ._sila import Prediction

# Of messages, as their packages define them; for bags that do not bring the definitions themselves.
_AUTOWARE = {
    "TrackedObjects": "std_msgs/Header header\nTrackedObject[] objects",
    "TrackedObject": "unique_identifier_msgs/UUID object_id\nfloat32 existence_probability\n"
    "ObjectClassification[] classification\nTrackedObjectKinematics kinematics\nShape shape",
    "ObjectClassification": "uint8 label\nfloat32 probability",
    "TrackedObjectKinematics": "geometry_msgs/PoseWithCovariance pose_with_covariance\n"
    "geometry_msgs/TwistWithCovariance twist_with_covariance\n"
    "geometry_msgs/AccelWithCovariance acceleration_with_covariance\n"
    "uint8 orientation_availability\nbool is_stationary",
    "Shape": "uint8 type\ngeometry_msgs/Polygon footprint\ngeometry_msgs/Vector3 dimensions",
}
_PREDICTED = {
    "PredictedObjects": "std_msgs/Header header\nPredictedObject[] objects",
    "PredictedObject": "unique_identifier_msgs/UUID object_id\nfloat32 existence_probability\n"
    "ObjectClassification[] classification\nPredictedObjectKinematics kinematics\nShape shape",
    "PredictedObjectKinematics": "geometry_msgs/PoseWithCovariance initial_pose_with_covariance\n"
    "geometry_msgs/TwistWithCovariance initial_twist_with_covariance\n"
    "geometry_msgs/AccelWithCovariance initial_acceleration_with_covariance\nPredictedPath[] predicted_paths",
    "PredictedPath": "geometry_msgs/Pose[] path\nbuiltin_interfaces/Duration time_step\nfloat32 confidence",
}
_VISION = {
    "Detection3DArray": "std_msgs/Header header\nDetection3D[] detections",
    "Detection3D": "std_msgs/Header header\nObjectHypothesisWithPose[] results\nBoundingBox3D bbox\nstring id",
    "ObjectHypothesisWithPose": "ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose",
    "ObjectHypothesis": "string class_id\nfloat64 score",
    "BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size",
}
#: The text of each message by package and name.
DEFINITIONS = {
    "autoware_perception_msgs": _AUTOWARE | _PREDICTED,
    "autoware_auto_perception_msgs": _AUTOWARE,
    "vision_msgs": _VISION,
}
#: Types of messages that have tracked objects.
TRACKED_TYPES = (
    "autoware_perception_msgs/msg/TrackedObjects",
    "autoware_auto_perception_msgs/msg/TrackedObjects",
    "vision_msgs/msg/Detection3DArray",
)
_AUTOWARE_LABELS = ("unknown", "car", "truck", "bus", "trailer", "motorcycle", "bicycle", "pedestrian")
_CODES = {name: code for code, name in enumerate(_AUTOWARE_LABELS)} | {"person": 7}
_BOX = 0  # Shape.BOUNDING_BOX
_STEP_M = 0.01  # a shorter step has no direction


class TrackedObject(NamedTuple):
    """An object of a message: its id, empty if it has none, the name of its most likely class, and its Pose message."""

    id: str
    label: str
    score: float
    pose: Any
    source: Any


def message_type(name: str) -> Any:
    """The class of a message, e.g. "geometry_msgs/msg/Pose", of the ROS 2 that is installed."""
    package, _, kind = name.split("/")
    return getattr(import_module(package + ".msg"), kind)


def time_s(message: Any) -> float:
    """The stamp of a message, 0 if it is not set."""
    return float((message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec) / 1e9)


def tracked_objects(message: Any, pedestrian_labels: Collection[str] = ()) -> Iterator[TrackedObject]:
    """The objects of a TrackedObjects or Detection3DArray; classes of `pedestrian_labels` are named "pedestrian".

    Raises TypeError for any other message.
    """
    if hasattr(message, "objects"):
        seen = map(_of_autoware, message.objects)
    elif hasattr(message, "detections"):
        seen = map(_of_vision, message.detections)
    else:
        raise TypeError(f"expected TrackedObjects or Detection3DArray, found {type(message).__name__}")
    labels = names_of(pedestrian_labels)
    for tracked in seen:
        yield tracked._replace(label="pedestrian") if tracked.label in labels else tracked


def detections(message: Any, *, pedestrian_labels: Collection[str] = ()) -> list[tuple[str, float, float, str]]:
    """The detections of a message for `Stream.update`: (id, x, y, label) of each object that has an id, in metres in the frame
    of the message."""
    objects = tracked_objects(message, pedestrian_labels)
    return [(one.id, one.pose.position.x, one.pose.position.y, one.label) for one in objects if one.id]


def turned(covariance: Any, rotation: Any) -> np.ndarray:
    """The covariance of a pose (6 x 6, row by row: position, then rotation about the fixed axes) in a frame that is turned by a
    Quaternion message."""
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = np.kron(np.eye(2), np.eye(3) + 2.0 * (w * skew + skew @ skew))
    return np.ravel(turn @ np.reshape(covariance, (6, 6)) @ turn.T)


def _of_autoware(tracked: Any) -> TrackedObject:
    best = max(tracked.classification, key=lambda c: c.probability, default=None)
    code, score = (0, 0.0) if best is None else (int(best.label), float(best.probability))
    label = _AUTOWARE_LABELS[code] if code < len(_AUTOWARE_LABELS) else f"class {code}"
    pose = tracked.kinematics.pose_with_covariance.pose
    return TrackedObject(bytes(tracked.object_id.uuid).hex(), label, score, pose, tracked)


def _of_vision(detection: Any) -> TrackedObject:
    name = getattr(detection, "id", "") or getattr(detection, "tracking_id", "")
    best = max(detection.results, key=lambda r: r.hypothesis.score, default=None)
    label, score = ("", 0.0) if best is None else (str(best.hypothesis.class_id), float(best.hypothesis.score))
    return TrackedObject(name, label, score, detection.bbox.center, detection)


def predicted_objects(
    message: Any,
    predictions: Iterable[Prediction],
    *,
    types: Callable[[str], Any] = message_type,
    pedestrian_labels: Collection[str] = (),
) -> Any:
    """The PredictedObjects (autoware_perception_msgs) that answers a message: its objects that have ids, in its frame
    and at its time, with a path for each mode of their prediction.

    `predictions`: those that `Stream.update` gave for `detections(message)`. An object without one (no pedestrian, seen
    for too short a time, or not due by `stride_s`) has no path. A path begins at the position in the message, its points
    are `time_step` apart and look ahead; equal paths are one, with the sum of their weights as `confidence`. Message types have no
    place for the covariances of a prediction. An object of a Detection3DArray gets speed and heading from its most
    likely path, and a UUID made from its id if this is none. `types` gives the class of a message by its name.
    """
    now = time_s(message)
    by_track = {p.track: p for p in predictions if abs(p.t0_s - now) < 1e-3}
    objects = [
        _predicted(tracked, by_track.get(tracked.id), types)
        for tracked in tracked_objects(message, pedestrian_labels)
        if tracked.id
    ]
    return types("autoware_perception_msgs/msg/PredictedObjects")(header=message.header, objects=objects)


def _predicted(tracked: TrackedObject, prediction: Prediction | None, types: Callable[[str], Any]) -> Any:
    paths = [] if prediction is None else list(_paths(tracked.pose, prediction, types))
    source = tracked.source
    if hasattr(source, "kinematics"):
        known = {name: getattr(source, name) for name in ("object_id", "existence_probability", "classification", "shape")}
        state = source.kinematics
        pose, twist, accel = state.pose_with_covariance, state.twist_with_covariance, state.acceleration_with_covariance
    else:
        known = _of_detection(tracked, prediction, types)
        pose, twist, accel = _state(tracked.pose, prediction, types)
    kinematics = types("autoware_perception_msgs/msg/PredictedObjectKinematics")(
        initial_pose_with_covariance=pose,
        initial_twist_with_covariance=twist,
        initial_acceleration_with_covariance=accel,
        predicted_paths=paths,
    )
    return types("autoware_perception_msgs/msg/PredictedObject")(kinematics=kinematics, **known)


def _paths(pose: Any, prediction: Prediction, types: Callable[[str], Any]) -> Iterator[Any]:
    weights: dict[bytes, float] = {}
    for mode in prediction.modes:  # a mode of the variant "wide" has the path of another
        key = mode.path_m.tobytes()
        weights[key] = weights.get(key, 0.0) + mode.weight
    step_ns = round(prediction.times_s[0] * 1e9)
    step = types("builtin_interfaces/msg/Duration")(sec=step_ns // 10**9, nanosec=step_ns % 10**9)
    for key, weight in weights.items():
        points_m = np.vstack([[pose.position.x, pose.position.y], np.frombuffer(key).reshape(-1, 2)])
        path = [
            _pose(point, pose.position.z, _turn(heading, types) if heading is not None else pose.orientation, types)
            for point, heading in zip(points_m, _headings_rad(points_m), strict=True)
        ]
        yield types("autoware_perception_msgs/msg/PredictedPath")(path=path, time_step=step, confidence=weight)


def _headings_rad(points_m: np.ndarray) -> list[float | None]:
    """The direction to the next point; the last one before where it is too near; None before the first."""
    headings: list[float | None] = []
    for x, y in np.diff(points_m, axis=0):
        before = headings[-1] if headings else None
        headings.append(math.atan2(y, x) if math.hypot(x, y) >= _STEP_M else before)
    return [*headings, headings[-1]]


def _pose(point_m: Any, z_m: float, orientation: Any, types: Callable[[str], Any]) -> Any:
    position = types("geometry_msgs/msg/Point")(x=float(point_m[0]), y=float(point_m[1]), z=z_m)
    return types("geometry_msgs/msg/Pose")(position=position, orientation=orientation)


def _turn(heading_rad: float, types: Callable[[str], Any]) -> Any:
    half = heading_rad / 2.0
    return types("geometry_msgs/msg/Quaternion")(x=0.0, y=0.0, z=math.sin(half), w=math.cos(half))


def _of_detection(
    tracked: TrackedObject, prediction: Prediction | None, types: Callable[[str], Any]
) -> dict[str, Any]:
    try:
        key = uuid.UUID(tracked.id)
    except ValueError:
        key = uuid.uuid5(uuid.NAMESPACE_OID, tracked.id)
    code = _CODES["person"] if prediction is not None else _CODES.get(tracked.label.lower(), 0)
    return {
        "object_id": types("unique_identifier_msgs/msg/UUID")(uuid=np.frombuffer(key.bytes, dtype=np.uint8)),
        "existence_probability": tracked.score,
        "classification": [
            types("autoware_perception_msgs/msg/ObjectClassification")(label=code, probability=tracked.score)
        ],
        "shape": types("autoware_perception_msgs/msg/Shape")(
            type=_BOX, footprint=types("geometry_msgs/msg/Polygon")(points=[]), dimensions=tracked.source.bbox.size
        ),
    }


def _state(pose: Any, prediction: Prediction | None, types: Callable[[str], Any]) -> tuple[Any, Any, Any]:
    """Pose, twist (in the frame of the object) and acceleration messages, with the velocity of the most likely path."""
    speed_mps = 0.0
    orientation = pose.orientation
    if prediction is not None:
        x, y = prediction.modes[0].path_m[0] - [pose.position.x, pose.position.y]
        speed_mps = math.hypot(x, y) / prediction.times_s[0]
        orientation = _turn(math.atan2(y, x), types) if math.hypot(x, y) >= _STEP_M else orientation
    stated = types("geometry_msgs/msg/Pose")(position=pose.position, orientation=orientation)
    vector = types("geometry_msgs/msg/Vector3")
    zero, ahead = vector(x=0.0, y=0.0, z=0.0), vector(x=float(speed_mps), y=0.0, z=0.0)
    unknown = np.zeros(36)
    twist = types("geometry_msgs/msg/Twist")(linear=ahead, angular=zero)
    accel = types("geometry_msgs/msg/Accel")(linear=zero, angular=zero)
    return (
        types("geometry_msgs/msg/PoseWithCovariance")(pose=stated, covariance=unknown),
        types("geometry_msgs/msg/TwistWithCovariance")(twist=twist, covariance=unknown),
        types("geometry_msgs/msg/AccelWithCovariance")(accel=accel, covariance=unknown),
    )
