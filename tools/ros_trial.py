"""For tools/check_ros: writes the message packages, or starts the node and talks to it."""

import argparse
import signal
import subprocess
import sys
import time
from pathlib import Path

CMAKE = """cmake_minimum_required(VERSION 3.14)
project({name})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
set(needed std_msgs geometry_msgs unique_identifier_msgs builtin_interfaces)
foreach(package ${{needed}})
  find_package(${{package}} REQUIRED)
endforeach()
file(GLOB messages RELATIVE ${{CMAKE_CURRENT_SOURCE_DIR}} msg/*.msg)
rosidl_generate_interfaces(${{PROJECT_NAME}} ${{messages}} DEPENDENCIES ${{needed}})
ament_package()
"""
PACKAGE = """<package format="3">
<name>{name}</name><version>0.0.0</version><description>For a trial</description>
<maintainer email="sila@example.com">sila</maintainer><license>none</license>
<buildtool_depend>ament_cmake</buildtool_depend><member_of_group>rosidl_interface_packages</member_of_group>
<export><build_type>ament_cmake</build_type></export></package>
"""
TF2_ROS = """
import threading
class TransformException(Exception): pass
class Buffer:
    def lookup_transform(self, target, source, moment, timeout):
        if source == "nowhere": raise TransformException(f'"{source}" does not exist')
        assert (target, source, timeout.nanoseconds) == ("map", "camera", 100_000_000), (target, source)
        return moment.nanoseconds
class TransformListener:
    def __init__(self, buffer, node, spin_thread): pass
"""
TF2_GEOMETRY = """
from geometry_msgs.msg import Point, Pose
def do_transform_pose(pose, transform):
    moved = Point(x=pose.position.x + 100.0, y=pose.position.y, z=pose.position.z)
    return Pose(position=moved, orientation=pose.orientation)
"""


def write_messages(folder: Path) -> None:
    """The packages of messages as colcon builds them, with the definitions that sila reads bags with."""
    from sila._ros_messages import DEFINITIONS

    for name in ("autoware_perception_msgs", "vision_msgs"):
        (folder / name / "msg").mkdir(parents=True)
        (folder / name / "CMakeLists.txt").write_text(CMAKE.format(name=name))
        (folder / name / "package.xml").write_text(PACKAGE.format(name=name))
        for message, text in DEFINITIONS[name].items():
            (folder / name / "msg" / f"{message}.msg").write_text(text + "\n")


def tracked(t, people, frame):
    from autoware_perception_msgs.msg import ObjectClassification, TrackedObject, TrackedObjects

    message = TrackedObjects()
    for number, (x, y) in people:
        one = TrackedObject(classification=[ObjectClassification(label=7, probability=1.0)])
        one.object_id.uuid[:2] = number % 256, number // 256
        one.kinematics.pose_with_covariance.pose.position.x, one.kinematics.pose_with_covariance.pose.position.y = x, y
        message.objects.append(one)
    return stamped(message, t, frame)


def detected(t, people, frame):
    from vision_msgs.msg import Detection3D, Detection3DArray, ObjectHypothesisWithPose

    message = Detection3DArray()
    for number, (x, y) in people:
        result = ObjectHypothesisWithPose()
        result.hypothesis.class_id, result.hypothesis.score = "walker", 1.0
        one = Detection3D(id=str(number), results=[result])
        one.bbox.center.position.x, one.bbox.center.position.y = x, y
        message.detections.append(one)
    return stamped(message, t, frame)


def stamped(message, t, frame):
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = int(t), round(t % 1 * 1e9)
    return message


def frames(tracks):
    """(t, [(number, (x, y)), ...]) at 5 Hz of tracks."""
    by_time: dict[int, list] = {}
    for number, track in enumerate(tracks):
        for t, point in zip(track.times_s, track.positions_m):
            by_time.setdefault(round(t * 5), []).append((number, tuple(map(float, point))))
    return [(1000.0 + step / 5, dict(people).items()) for step, people in sorted(by_time.items())]


def talk(folder: Path, kind: str, frame: str) -> None:
    """Starts the node, sends it simulated pedestrians as messages of a kind, waiting for each answer, and ends it."""
    import rclpy
    import sila
    from autoware_perception_msgs.msg import PredictedObjects
    from rclpy.qos import QoSProfile

    make = tracked if kind == "TrackedObjects" else detected
    model = folder / f"{kind}.sila"
    model.unlink(missing_ok=True)
    program = folder / "install/sila_ros/lib/sila_ros/predict.py"
    settings = {"model": model, "input": kind, "batch": 10, "pedestrian_labels": "[walker]"}
    command = [sys.executable, program, "--ros-args", "-r", "~/input:=/tracks", "-r", "~/output:=/predictions"]
    node = subprocess.Popen(command + [word for key, value in settings.items() for word in ("-p", f"{key}:={value}")])
    mine, answers = rclpy.create_node("trial"), []
    mine.create_subscription(PredictedObjects, "/predictions", answers.append, 10)
    output = mine.create_publisher(type(make(0.0, [], frame)), "/tracks", QoSProfile(depth=10))

    def wait(done, seconds):
        until = time.monotonic() + seconds
        while not done():
            assert time.monotonic() < until and node.poll() is None, "no answer of the node"
            rclpy.spin_once(mine, timeout_sec=0.05)

    wait(lambda: output.get_subscription_count() and mine.count_publishers("/predictions"), 60)
    if frame != "map":
        output.publish(make(1.0, [], "nowhere"))  # dropped
    paths = 0
    for count, (t, people) in enumerate(frames(sila.simulate(tracks=30, seed=3).tracks), 1):
        output.publish(make(t, people, frame))
        wait(lambda: len(answers) == count, 20)
        shift, answer = (0.0 if frame == "map" else 100.0), answers[-1]
        assert answer.header.frame_id == "map" and len(answer.objects) == len(people)
        for (_, (x, y)), one in zip(people, answer.objects):
            for path in one.kinematics.predicted_paths:
                assert (path.path[0].position.x, path.path[0].position.y) == (x + shift, y)
                assert len(path.path) == 26 and path.time_step.nanosec == 200_000_000
            weights = [path.confidence for path in one.kinematics.predicted_paths]
            assert not weights or abs(sum(weights) - 1.0) < 1e-5
            paths += len(weights)
    node.send_signal(signal.SIGINT)
    assert node.wait(60) == 0, "the node failed at its end"
    learnt = sila.Model.load(model)
    assert len(learnt.episode_ids) >= 3 and paths > 1000, (learnt, paths)
    print(f"{kind} in {frame}: {len(answers)} answers with {paths} paths, then {learnt}")
    mine.destroy_node()


def refused(folder: Path, setting: str, reason: str) -> None:
    """The node ends with a sentence that has the reason."""
    command = [sys.executable, folder / "install/sila_ros/lib/sila_ros/predict.py", "--ros-args", "-p", setting]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ended.returncode == 1 and reason in ended.stderr and "Traceback" not in ended.stderr, ended


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--messages", action="store_true")
    options = parser.parse_args()
    if options.messages:
        write_messages(options.folder)
        return
    import os

    import rclpy

    for name, text in (("tf2_ros", TF2_ROS), ("tf2_geometry_msgs", TF2_GEOMETRY)):
        (options.folder / "tf2").mkdir(exist_ok=True)
        (options.folder / "tf2" / f"{name}.py").write_text(text)
    os.environ["PYTHONPATH"] = f"{options.folder / 'tf2'}:{os.environ.get('PYTHONPATH', '')}"
    rclpy.init()
    refused(options.folder, "input:=Tracks", "input: expected TrackedObjects or Detection3DArray, found Tracks")
    (options.folder / "broken.sila").write_text("no model")
    refused(options.folder, f"model:={options.folder / 'broken.sila'}", "broken.sila")
    talk(options.folder, "TrackedObjects", "map")
    talk(options.folder, "Detection3DArray", "camera")


if __name__ == "__main__":
    main()
