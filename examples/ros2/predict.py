#!/usr/bin/env python3
"""A ROS 2 node: tracked objects in, predicted objects out, learning in the background (docs/python.md, *A ROS 2 node*).

    ros2 run sila_ros predict.py --ros-args -p model:=corner.sila -r '~/input:=/tracks' -r '~/output:=/predictions'
"""

import sys

import rclpy
import sila
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rclpy.time import Time
from sila import ros

INPUTS = {
    "TrackedObjects": "autoware_perception_msgs/msg/TrackedObjects",
    "Detection3DArray": "vision_msgs/msg/Detection3DArray",
}
_REPORT_S = 30.0
_TF_WAIT = Duration(seconds=0.1)


class Predict(Node):
    """Answers each message of `~/input` with one of `~/output`.

    Parameters: `model`, the model file to continue or create, empty: kept in memory; `scene`, a scene file, empty: that
    of the model; `frame`, the frame that is fixed to the ground, in which positions are learnt and predicted; `input`,
    the name of the input's type; `pedestrian_labels`, names of classes that mean pedestrians; `stride_s`, seconds
    between the predictions of a pedestrian, 0: one for each message; `batch`, finished tracks that make an episode.
    """

    def __init__(self) -> None:
        super().__init__("sila")
        given = {
            name: self.declare_parameter(name, value).value
            for name, value in {"model": "", "scene": "", "frame": "map", "input": "TrackedObjects"}.items()
        }
        labels = self.declare_parameter("pedestrian_labels", [""]).value
        stride_s, batch = self.declare_parameter("stride_s", 0.0).value, self.declare_parameter("batch", 20).value
        if given["input"] not in INPUTS:
            raise ValueError(f"input: expected {' or '.join(INPUTS)}, found {given['input']}")
        self._labels, self._frame = [label for label in labels if label], given["frame"]
        self._buffer = None
        model, scene = given["model"] or None, given["scene"] or None
        self._stream = sila.Stream(model, scene=scene, camera=False, stride_s=stride_s, batch=batch)
        # A subscription for sensor data receives from any publisher; a subscriber of the predictions may lose none.
        output = ros.message_type("autoware_perception_msgs/msg/PredictedObjects")
        self._output = self.create_publisher(output, "~/output", QoSProfile(depth=10))
        kind = ros.message_type(INPUTS[given["input"]])
        self.create_subscription(kind, "~/input", self._answer, qos_profile_sensor_data)
        self.create_timer(_REPORT_S, self._report)

    def _answer(self, message) -> None:
        if not ros.time_s(message):
            message.header.stamp = self.get_clock().now().to_msg()
        if message.header.frame_id != self._frame and not self._transform(message):
            return
        detections = ros.detections(message, pedestrian_labels=self._labels)
        predictions = self._stream.update(ros.time_s(message), detections)
        self._output.publish(ros.predicted_objects(message, predictions, pedestrian_labels=self._labels))

    def _transform(self, message) -> bool:
        """Moves the objects of a message into the fixed frame; false, with a warning, without a transform."""
        from tf2_geometry_msgs import do_transform_pose
        from tf2_ros import Buffer, TransformException, TransformListener

        if self._buffer is None:  # a node and a thread of its own, as a transform may arrive after the message
            self._buffer = Buffer()
            self._listener = TransformListener(self._buffer, rclpy.create_node("sila_tf"), spin_thread=True)
        header = message.header
        try:
            moment = Time.from_msg(header.stamp)
            transform = self._buffer.lookup_transform(self._frame, header.frame_id, moment, timeout=_TF_WAIT)
        except TransformException as error:
            self.get_logger().warning(f"message dropped: {error}", throttle_duration_sec=5.0)
            return False
        for tracked in ros.tracked_objects(message):
            moved = do_transform_pose(tracked.pose, transform)
            tracked.pose.position, tracked.pose.orientation = moved.position, moved.orientation
            if hasattr(tracked.source, "kinematics"):
                state = tracked.source.kinematics.pose_with_covariance
                state.covariance = ros.turned(state.covariance, transform.transform.rotation)
        header.frame_id = self._frame
        return True

    def _report(self) -> None:
        self.get_logger().info(f"{self._stream}, rejected {self._stream.counts['rejected']}")

    def close(self) -> None:
        """Learns the tracks that are left; ROS is shut down already and has no logger."""
        self._stream.close()
        print(f"predict.py: {self._stream}, rejected {self._stream.counts['rejected']}", file=sys.stderr)


def main() -> None:
    rclpy.init()
    try:
        node = Predict()
    except (ImportError, ValueError) as error:  # sila.FormatError is a ValueError
        sys.exit(f"predict.py: {error}")
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    node.close()


if __name__ == "__main__":
    main()
