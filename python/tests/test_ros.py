"""Bags are written here, message by message, as trackers write them."""

from dataclasses import astuple
from types import SimpleNamespace

import numpy as np
import pytest
import sila
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from sila import ros
from sila._ros_messages import DEFINITIONS

# Version 8 has no message definitions in the bag.
STORAGES = [(StoragePlugin.SQLITE3, 8), (StoragePlugin.SQLITE3, 9), (StoragePlugin.MCAP, 9)]
TRACKED = "autoware_perception_msgs/msg/TrackedObjects"
DETECTED = "vision_msgs/msg/Detection3DArray"
PREDICTED = "autoware_perception_msgs/msg/PredictedObjects"


@pytest.fixture(scope="module")
def store():
    store = get_typestore(Stores.ROS2_HUMBLE)
    for package, messages in DEFINITIONS.items():
        for name, text in messages.items():
            store.register(get_types_from_msg(text, f"{package}/msg/{name}"))
    return store


class Messages:
    def __init__(self, store):
        self.store = store

    def make(self, name, **values):
        return self.store.types[name](**values)

    def header(self, t, frame):
        seconds = int(t)
        stamp = self.make("builtin_interfaces/msg/Time", sec=seconds, nanosec=round((t - seconds) * 1e9))
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)

    def vector(self, x=0.0, y=0.0, z=0.0, kind="Vector3"):
        return self.make(f"geometry_msgs/msg/{kind}", x=float(x), y=float(y), z=float(z))

    def pose(self, x, y):
        turn = self.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
        return self.make("geometry_msgs/msg/Pose", position=self.vector(x, y, 1.0, kind="Point"), orientation=turn)

    def tracked(self, t, people, frame="map"):
        zeros = np.zeros(36)
        turn = self.make("geometry_msgs/msg/Twist", linear=self.vector(), angular=self.vector())
        accel = self.make("geometry_msgs/msg/Accel", linear=self.vector(), angular=self.vector())
        objects = []
        for number, x, y, label in people:
            package = "autoware_perception_msgs/msg/"
            kinematics = self.make(
                package + "TrackedObjectKinematics",
                pose_with_covariance=self.make(
                    "geometry_msgs/msg/PoseWithCovariance", pose=self.pose(x, y), covariance=zeros
                ),
                twist_with_covariance=self.make("geometry_msgs/msg/TwistWithCovariance", twist=turn, covariance=zeros),
                acceleration_with_covariance=self.make(
                    "geometry_msgs/msg/AccelWithCovariance", accel=accel, covariance=zeros
                ),
                orientation_availability=0,
                is_stationary=False,
            )
            shape = self.make(
                package + "Shape",
                type=1,
                footprint=self.make("geometry_msgs/msg/Polygon", points=[]),
                dimensions=self.vector(0.6, 0.6, 1.7),
            )
            classes = [
                self.make(package + "ObjectClassification", label=0, probability=0.1),
                self.make(package + "ObjectClassification", label=label, probability=0.9),
            ]
            uuid = np.full(16, number, dtype=np.uint8)
            objects.append(
                self.make(
                    package + "TrackedObject",
                    object_id=self.make("unique_identifier_msgs/msg/UUID", uuid=uuid),
                    existence_probability=0.9,
                    classification=classes,
                    kinematics=kinematics,
                    shape=shape,
                )
            )
        return self.make(TRACKED, header=self.header(t, frame), objects=objects)

    def detected(self, t, people, frame="map"):
        detections = []
        for name, x, y, label in people:
            hypothesis = self.make("vision_msgs/msg/ObjectHypothesis", class_id=label, score=0.8)
            pose = self.make("geometry_msgs/msg/PoseWithCovariance", pose=self.pose(0.0, 0.0), covariance=np.zeros(36))
            result = self.make("vision_msgs/msg/ObjectHypothesisWithPose", hypothesis=hypothesis, pose=pose)
            box = self.make("vision_msgs/msg/BoundingBox3D", center=self.pose(x, y), size=self.vector(0.6, 0.6, 1.7))
            detections.append(
                self.make(
                    "vision_msgs/msg/Detection3D", header=self.header(t, frame), results=[result], bbox=box, id=name
                )
            )
        return self.make(DETECTED, header=self.header(t, frame), detections=detections)


def write_bag(path, store, storage, topics):
    with Writer(path, version=storage[1], storage_plugin=storage[0]) as writer:
        for topic, (kind, messages) in topics.items():
            connection = writer.add_connection(topic, kind, typestore=store)
            for message in messages:
                stamp = message.header.stamp
                writer.write(
                    connection, stamp.sec * 10**9 + stamp.nanosec + 5 * 10**6, store.serialize_cdr(message, kind)
                )
    return path


TIMES = 1_700_000_000.0 + np.arange(30) * 0.1


def path_of(person):
    steps = np.arange(30)
    return np.column_stack([person * 4.0 + 0.13 * steps, 2.0 - 0.05 * person * steps])


@pytest.mark.parametrize("storage", STORAGES, ids=lambda storage: f"{storage[0].name}-{storage[1]}")
def test_autoware_tracked_pedestrians_are_read(tmp_path, store, storage):
    make = Messages(store)
    messages = [
        make.tracked(t, [(1, *path_of(1)[k], 7), (2, *path_of(2)[k], 7), (3, *path_of(3)[k], 1)])
        for k, t in enumerate(TIMES)
    ]
    bag = write_bag(tmp_path / "bag", store, storage, {"/perception/tracking/objects": (TRACKED, messages)})
    assert ros.tracked_topics(bag) == {"/perception/tracking/objects": TRACKED}
    tracks = ros.read_tracks(bag)
    assert [track.id for track in tracks] == ["01" * 16, "02" * 16]
    for person, track in zip((1, 2), tracks, strict=True):
        np.testing.assert_allclose(track.times_s, TIMES, rtol=0, atol=1e-6)
        assert np.array_equal(track.positions_m, path_of(person))
    assert tracks.report["dropped"]["other_label"]["rows"] == 30
    assert tracks.report["frame_id"] == "map"


@pytest.mark.parametrize("storage", STORAGES, ids=lambda storage: f"{storage[0].name}-{storage[1]}")
def test_detections_with_ids_are_read_and_those_without_counted(tmp_path, store, storage):
    make = Messages(store)
    messages = [
        make.detected(t, [("17", *path_of(1)[k], "walker_7"), ("", *path_of(2)[k], "pedestrian")])
        for k, t in enumerate(TIMES)
    ]
    bag = write_bag(tmp_path / "bag", store, storage, {"/tracks": (DETECTED, messages)})
    tracks = ros.read_tracks(bag, pedestrian_labels=["walker_7"])
    assert [track.id for track in tracks] == ["17"]
    assert np.array_equal(tracks[0].positions_m, path_of(1))
    assert tracks.report["rows_without_id"] == 30


def test_a_single_mcap_file_is_a_bag(tmp_path, store):
    make = Messages(store)
    messages = [make.tracked(t, [(1, *path_of(1)[k], 7)]) for k, t in enumerate(TIMES)]
    bag = write_bag(tmp_path / "bag", store, STORAGES[-1], {"/tracks": (TRACKED, messages)})
    assert len(ros.read_tracks(next(bag.glob("*.mcap")))) == 1


def test_two_topics_or_two_frames_must_be_distinguished(tmp_path, store):
    make = Messages(store)
    near = [make.detected(t, [("a", *path_of(1)[k], "person")]) for k, t in enumerate(TIMES)]
    far = [make.detected(t, [("b", *path_of(2)[k], "person")], frame="base_link") for k, t in enumerate(TIMES)]
    two = write_bag(tmp_path / "two", store, STORAGES[-1], {"/a": (DETECTED, near), "/b": (DETECTED, far)})
    with pytest.raises(sila.FormatError, match="one topic of tracked objects, found /a, /b"):
        ros.read_tracks(two)
    assert [track.id for track in ros.read_tracks(two, topic="/b")] == ["b"]
    mixed = write_bag(tmp_path / "mixed", store, STORAGES[-1], {"/a": (DETECTED, near + far)})
    with pytest.raises(sila.FormatError, match="one frame .* found base_link, map"):
        ros.read_tracks(mixed)
    assert [track.id for track in ros.read_tracks(mixed, frame_id="map")] == ["a"]


def test_what_is_no_bag_is_rejected_by_name(tmp_path, store):
    with pytest.raises(sila.FormatError, match="nowhere"):
        ros.read_tracks(tmp_path / "nowhere")
    (tmp_path / "broken.mcap").write_bytes(b"no bag at all")
    with pytest.raises(sila.FormatError, match="broken.mcap"):
        ros.read_tracks(tmp_path / "broken.mcap")
    (tmp_path / "empty").mkdir()
    with pytest.raises(sila.FormatError, match="empty"):
        ros.read_tracks(tmp_path / "empty")
    make = Messages(store)
    messages = [make.tracked(t, [(1, *path_of(1)[k], 7)]) for k, t in enumerate(TIMES)]
    whole = next(write_bag(tmp_path / "whole", store, STORAGES[-1], {"/a": (TRACKED, messages)}).glob("*.mcap"))
    for share in (0.2, 0.5, 0.9):
        (tmp_path / "cut.mcap").write_bytes(whole.read_bytes()[: int(share * whole.stat().st_size)])
        with pytest.raises(sila.FormatError, match="cut.mcap"):
            ros.read_tracks(tmp_path / "cut.mcap")
    messages = [make.detected(t, [("", 0.0, 0.0, "person")]) for t in TIMES]
    nameless = write_bag(tmp_path / "nameless", store, STORAGES[-1], {"/a": (DETECTED, messages)})
    with pytest.raises(sila.FormatError, match="30 objects without an id"):
        ros.read_tracks(nameless)


def test_predictions_are_written_for_foxglove(tmp_path, predictions, unseen):
    path = tmp_path / "predictions.mcap"
    some = predictions[:12]
    assert ros.write_predictions(path, some, tracks=unseen.tracks, coverage=0.8, at_s=(1, 2, 5), lifetime_s=1.5) == 12
    with path.open("rb") as file:
        found = list(make_reader(file).iter_messages())
    assert {schema.name for schema, _, _ in found} == {"foxglove.SceneUpdate"}
    assert {(schema.encoding, channel.message_encoding) for schema, channel, _ in found} == {("protobuf", "protobuf")}
    by_time = sorted(some, key=lambda prediction: prediction.t0_s)
    for (_, channel, message), prediction in zip(found, by_time, strict=True):
        entity = SceneUpdate.FromString(message.data).entities[0]
        assert (channel.topic, message.log_time) == ("/sila/predictions", round(prediction.t0_s * 1e9))
        assert (entity.id, entity.frame_id, entity.lifetime.ToNanoseconds()) == (prediction.tracklet, "map", 1_500_000_000)
        paths = [line for line in entity.lines if line.type == line.LINE_STRIP]
        assert len(paths) == 1 + len(prediction.modes)  # what was observed comes first
        for line, mode in zip(paths[1:], prediction.modes, strict=True):
            assert np.array_equal([(point.x, point.y) for point in line.points], mode.path_m)
        ellipses = [line for line in entity.lines if line.type == line.LINE_LOOP]
        assert len(ellipses) == 3 * len(prediction.modes)


def answered(tmp_path, store, kind, messages):
    """The messages of a bag and what a node would answer, written to a second bag and read again, with the predictions
    that each answer was made of."""
    asked = write_bag(tmp_path / "asked", store, STORAGES[-1], {"/tracks": (kind, messages)})
    answers, given = [], []
    with AnyReader([asked], default_typestore=store) as reader, sila.Stream() as stream:
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found = ros.detections(message, pedestrian_labels=["walker_7"])
            given.append(stream.update(ros.time_s(message), found))
            answers.append(
                ros.predicted_objects(message, given[-1], types=store.types.__getitem__, pedestrian_labels=["walker_7"])
            )
    bag = write_bag(tmp_path / "answered", store, STORAGES[-1], {"/predictions": (PREDICTED, answers)})
    with AnyReader([bag], default_typestore=store) as reader:
        read = [reader.deserialize(data, connection.msgtype) for connection, _, data in reader.messages()]
    return list(zip(messages, read, given, strict=True))


def xy(poses):
    return np.array([(pose.position.x, pose.position.y) for pose in poses])


def headings(poses):
    return np.array([2.0 * np.arctan2(pose.orientation.z, pose.orientation.w) for pose in poses])


def check_paths(answer, start, prediction):
    """The paths of an object are the modes of its prediction, from where the message saw it."""
    paths = answer.kinematics.predicted_paths
    assert np.array_equal({path.path[0].position.z for path in paths}, {1.0})
    expected = {mode.path_m.tobytes() for mode in prediction.modes}
    assert {np.ascontiguousarray(xy(path.path)[1:]).tobytes() for path in paths} == expected
    assert len(paths) == len(expected)
    assert sum(path.confidence for path in paths) == pytest.approx(1.0, abs=1e-6)
    for path in paths:
        assert np.array_equal(xy(path.path)[0], start)
        assert path.time_step.sec + path.time_step.nanosec / 1e9 == pytest.approx(prediction.times_s[0], abs=1e-9)
        steps = np.diff(xy(path.path), axis=0)
        moving = np.hypot(*steps.T) > 0.02
        ahead = np.arctan2(steps[:, 1], steps[:, 0])
        np.testing.assert_allclose(np.exp(1j * headings(path.path)[:-1][moving]), np.exp(1j * ahead[moving]), atol=1e-9)


def test_tracked_objects_are_answered_with_their_predicted_paths(tmp_path, store):
    make = Messages(store)
    people = [(1, 7), (2, 7), (3, 1)]
    messages = [make.tracked(t, [(who, *path_of(who)[k], label) for who, label in people]) for k, t in enumerate(TIMES)]
    seen = answered(tmp_path, store, TRACKED, messages)
    assert [len(given) for _, _, given in seen[:4]] == [0, 0, 0, 0]
    assert all(len(given) == 2 for _, _, given in seen[5:])
    for message, answer, given in seen:
        assert astuple(answer.header) == astuple(message.header)
        for before, after in zip(message.objects, answer.objects, strict=True):
            assert np.array_equal(before.object_id.uuid, after.object_id.uuid)
            assert [c.label for c in after.classification] == [c.label for c in before.classification]
            assert astuple(after.shape.dimensions) == astuple(before.shape.dimensions)
            position = before.kinematics.pose_with_covariance.pose.position
            assert astuple(after.kinematics.initial_pose_with_covariance.pose.position) == astuple(position)
            mine = given.of(bytes(before.object_id.uuid).hex())
            if mine:
                check_paths(after, (position.x, position.y), mine[0])
            else:
                assert after.kinematics.predicted_paths == []


def test_detections_are_answered_with_heading_speed_and_uuid(tmp_path, store):
    make = Messages(store)
    known = "12345678-1234-5678-1234-567812345678"
    names = ["17", known, ""]
    messages = [
        make.detected(t, [(name, *path_of(1 + n)[k], ["walker_7", "person", "person"][n]) for n, name in enumerate(names)])
        for k, t in enumerate(TIMES)
    ]
    seen = answered(tmp_path, store, DETECTED, messages)
    uuids = {tuple(bytes(answer.objects[0].object_id.uuid)) for _, answer, _ in seen}
    assert len(uuids) == 1
    for message, answer, given in seen[5:]:
        assert [len(answer.objects), bytes(answer.objects[1].object_id.uuid).hex()] == [2, known.replace("-", "")]
        for before, after, name in zip(message.detections, answer.objects, names, strict=False):
            position, (prediction,) = before.bbox.center.position, given.of(name)
            check_paths(after, (position.x, position.y), prediction)
            assert after.classification[0].label == 7
            assert after.existence_probability == pytest.approx(0.8)
            assert astuple(after.shape.dimensions) == astuple(before.bbox.size)
            step = prediction.modes[0].path_m[0] - [position.x, position.y]
            state = after.kinematics
            speed_mps = np.hypot(*step) / prediction.times_s[0]
            assert state.initial_twist_with_covariance.twist.linear.x == pytest.approx(speed_mps)
            assert headings([state.initial_pose_with_covariance.pose])[0] == pytest.approx(np.arctan2(*step[::-1]))


def test_absurd_positions_and_old_predictions_have_no_path(store):
    make = Messages(store)
    with sila.Stream() as stream:
        for k, t in enumerate(TIMES):
            message = make.tracked(t, [(1, *path_of(1)[k], 7), (2, np.nan, 0.0, 7)])
            predictions = stream.update(ros.time_s(message), ros.detections(message))
        assert stream.counts["rejected"]["not_usable"] == len(TIMES)
    types = store.types.__getitem__
    now = ros.predicted_objects(message, predictions, types=types)
    assert [len(one.kinematics.predicted_paths) > 0 for one in now.objects] == [True, False]
    later = ros.predicted_objects(make.tracked(TIMES[-1] + 0.1, [(1, 0.0, 0.0, 7)]), predictions, types=types)
    assert later.objects[0].kinematics.predicted_paths == []
    with pytest.raises(TypeError, match="expected TrackedObjects or Detection3DArray, found"):
        ros.detections(make.header(0.0, "map"))


def test_a_covariance_turns_with_its_frame():
    half = np.sqrt(0.5)
    quarter = SimpleNamespace(x=0.0, y=0.0, z=half, w=half)
    given = np.diag([4.0, 0.01, 0.2, 1.0, 2.0, 3.0])
    given[0, 1] = given[1, 0] = 0.1
    expected = np.diag([0.01, 4.0, 0.2, 2.0, 1.0, 3.0])
    expected[0, 1] = expected[1, 0] = -0.1
    np.testing.assert_allclose(ros.turned(np.ravel(given), quarter), np.ravel(expected), atol=1e-12)


def test_a_label_given_as_a_text_is_one_name(store):
    message = Messages(store).tracked(1.0, [(1, 0.0, 0.0, 1)])
    (car,) = ros.tracked_objects(message)
    assert [one.label for one in ros.tracked_objects(message, f"{car.label},person")] == [car.label]
    assert [one.label for one in ros.tracked_objects(message, car.label)] == ["pedestrian"]
