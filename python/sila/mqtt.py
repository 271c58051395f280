"""Detections from a topic of an MQTT broker, predictions to another (`pip install sila[mqtt]`): python -m sila.mqtt"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import threading
import time
import uuid
from collections import Counter
from datetime import datetime, timezone
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

try:
    import paho.mqtt.client as mqtt
    from paho.mqtt.enums import CallbackAPIVersion
    from paho.mqtt.packettypes import PacketTypes
    from paho.mqtt.properties import Properties
except ImportError as error:
    raise ImportError("sila.mqtt needs paho-mqtt: pip install 'sila[mqtt]'") from error

from ._config import assignments, config
from ._stream import Stream

EXAMPLE = "example: python -m sila.mqtt --broker localhost --topic tracks --out-topic predictions --model corner.sila"
#: What the functions below and Stream.update raise for a message that is no detection.
_MALFORMED = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
_SESSION_S = 600  # while the connection is lost, the broker keeps messages for this time
_SIGNALS = {signal.SIGINT, signal.SIGTERM}
_FLUSH_S = 5.0  # at the end, for the last predictions


def objects_of(message: Any) -> tuple[float, list[Any]]:
    """The time [s] of a line of the service, an event of Frigate or a frame of an Axis camera, and its objects for
    `detection`. Both raise one of _MALFORMED for anything else."""
    frame = (message.get("data") or message).get("frame")
    if isinstance(frame, dict):
        moment = datetime.fromisoformat(frame["timestamp"].replace("Z", "+00:00"))
        moment = moment if moment.tzinfo else moment.replace(tzinfo=timezone.utc)
        return moment.timestamp(), list(frame["observations"])
    after = message.get("after")
    return (_number(message["t"]), [message]) if after is None else (_number(after["frame_time"]), [after])


def detection(seen: Any) -> tuple[str, float, float, str]:
    """(id, x, y, label) of an object; of a box the foot, the middle of its bottom edge."""
    key, box, label = seen.get("id"), seen.get("box"), seen.get("label") or ""
    if "bounding_box" in seen:  # Axis
        key, label = seen["track_id"], (seen.get("class") or {}).get("type") or "unknown"
        box = [seen["bounding_box"][edge] for edge in ("left", "top", "right", "bottom")]
    if isinstance(key, bool) or not isinstance(key, (str, int)):
        raise TypeError("id: expected a text or a whole number")
    if box is None:
        return str(key), _number(seen["x"]), _number(seen["y"]), str(label)
    left, top, right, bottom = map(_number, box)
    if left >= right or top >= bottom:
        raise ValueError("box: expected positive width and height")
    return str(key), (left + right) / 2.0, bottom, str(label)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(f"expected a number, found {value!r}")
    return float(value)


class _TopicStream:
    """A Stream between two topics. The callbacks run on the thread of the client, which predicts, too: a message is
    acknowledged when its predictions are handed over."""

    def __init__(self, options: argparse.Namespace) -> None:
        changes = assignments(options.config, options.set)
        self.options, self.limit = options, min(config(changes)["service"]["max_queued_lines"], 60000)
        self.totals = dict.fromkeys(("messages", "handed", "acknowledged", "failed"), 0)
        self.rejected = Counter[str]()
        self.connection, self.camera, self.reported_s = "", options.frigate_camera, 0.0
        self.client = self._client()
        settings = {"person_classes": options.person, "stride_s": options.every, "batch": options.batch}
        self.stream = Stream(options.model, scene=options.scene, camera=options.camera, config=changes, **settings)

    def _client(self) -> Any:
        options = self.options
        client = mqtt.Client(CallbackAPIVersion.VERSION2, options.client_id, protocol=mqtt.MQTTv5)
        client.subscribe(options.topic)  # raises ValueError for an invalid topic; nothing is connected yet
        outputs = (options.out_topic, options.out_topic + "/counts")
        if set("+#") & set(outputs[0]) or any(mqtt.topic_matches_sub(options.topic, topic) for topic in outputs):
            raise ValueError(f"--out-topic: expected a topic outside of --topic, found {options.out_topic}")
        if options.username is not None:
            file = options.password_file
            client.username_pw_set(options.username, file and Path(file).read_text(encoding="utf-8").split("\n")[0])
        if options.tls is not None:
            client.tls_set(options.tls or None)  # raises OSError for a file that is not there or holds no certificate
        client.max_queued_messages_set(self.limit)
        client.reconnect_delay_set(1, 30)
        client.on_connect, client.on_disconnect, client.on_connect_fail = self._connected, self._lost, self._lost
        client.on_subscribe, client.on_publish, client.on_message = self._subscribed, self._published, self._arrived
        session = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]
        session.SessionExpiryInterval = _SESSION_S
        client.connect_async(*_address(options.broker, options.tls), clean_start=False, properties=session)
        return client

    def run(self) -> dict[str, Any]:
        """Predicts until SIGINT or SIGTERM, which the caller has blocked, learns what is left, and gives the counts."""
        network = threading.Thread(target=self.client.loop_forever, args=(1.0, True), daemon=True)
        network.start()
        while network.is_alive() and signal.sigtimedwait(_SIGNALS, 0.5) is None:
            pass
        failed = not network.is_alive()
        until_s = time.monotonic() + _FLUSH_S
        while self._unpublished() > 0 and self.connection == "connected" and time.monotonic() < until_s:
            time.sleep(0.02)
        self.client.on_disconnect = None
        self.client.disconnect()
        network.join()
        self.stream.close()
        if failed:
            raise RuntimeError("the connection ended by the error above")
        return self._counts()

    def _unpublished(self) -> int:
        return self.totals["handed"] - self.totals["acknowledged"]

    def _counts(self) -> dict[str, Any]:
        live = self.stream.counts
        sent = {"messages": self.totals["messages"], "not_published": self.totals["failed"] + self._unpublished()}
        return {**sent, **live, "rejected": dict(self.rejected + Counter(live["rejected"]))}

    def _connected(self, client: Any, data: Any, flags: Any, reason: Any, _properties: Any) -> None:
        if reason.is_failure:
            return self._lost(client, data, flags, reason)
        client.subscribe(self.options.topic, qos=1)

    def _lost(self, _client: Any, _data: Any, *details: Any) -> None:
        self._say("not reachable", f" ({details[1] if details else 'no answer'}); trying again")

    def _say(self, connection: str, more: str = "") -> None:
        if connection != self.connection:
            _say(f"broker {self.options.broker}: {connection}{more}")
        self.connection = connection

    def _subscribed(self, _client: Any, _data: Any, _id: Any, reasons: Any, _properties: Any) -> None:
        rejected = f"subscription to {self.options.topic} rejected ({reasons[0]})"
        self._say(rejected if reasons[0].is_failure else "connected")

    def _published(self, _client: Any, _data: Any, _id: Any, reason: Any, _properties: Any) -> None:
        self.totals["acknowledged"] += 1
        self.totals["failed"] += reason.is_failure

    def _arrived(self, _client: Any, _data: Any, message: Any) -> None:
        self.totals["messages"] += 1
        for line in filter(bytes.strip, message.payload.splitlines()):
            try:
                if message.retain:
                    self._reject("retained", line)
                else:
                    self._predict(json.loads(line), line)
            except (json.JSONDecodeError, UnicodeDecodeError, RecursionError):
                self._reject("not_json", line)
            except _MALFORMED:
                self._reject("not_a_detection", line)
        if time.monotonic() > self.reported_s + 1.0:
            self.reported_s = time.monotonic()
            self._publish("/counts", json.dumps(self._counts()), retain=True)

    def _predict(self, message: Any, line: bytes) -> None:
        t_s, objects = objects_of(message)
        if isinstance(message.get("after"), dict):
            self.camera = self.camera or message["after"].get("camera")
            if message["after"].get("camera") != self.camera:
                return self._reject("other_camera", line)
        detections = []
        for seen in objects:
            try:
                detections.append(detection(seen))
            except _MALFORMED:
                self._reject("not_a_detection", line)
        for prediction in self.stream.update(t_s, detections) if detections or not objects else ():
            self._publish("", prediction.to_json(self.options.digits))

    def _publish(self, suffix: str, payload: str, retain: bool = False) -> None:
        sent = self.client.publish(self.options.out_topic + suffix, payload, qos=1, retain=retain)
        self.totals["failed" if sent.rc == mqtt.MQTT_ERR_QUEUE_SIZE else "handed"] += 1

    def _reject(self, reason: str, line: bytes) -> None:
        if reason not in self.rejected:
            _say(f"{reason}: {line[:200].decode(errors='replace')}; this and further ones are counted")
        self.rejected[reason] += 1


def _address(broker: str, tls: str | None) -> tuple[str, int]:
    try:
        where = urlsplit("//" + broker)
        return where.hostname or "localhost", where.port or (1883 if tls is None else 8883)
    except ValueError as error:
        raise ValueError(f"--broker: expected HOST[:PORT], found {broker}") from error


def _say(sentence: str) -> None:
    print(f"sila: {sentence}", file=sys.stderr, flush=True)


def _parser() -> argparse.ArgumentParser:
    text = "Predict the detections of an MQTT topic as they come, learn while predicting, publish the predictions."
    parser = argparse.ArgumentParser(prog="python -m sila.mqtt", description=text, epilog=EXAMPLE)
    add = parser.add_argument
    add("--broker", default="localhost", metavar="HOST[:PORT]", help="broker of MQTT 5 [localhost:1883; TLS: 8883]")
    add("--tls", nargs="?", const="", metavar="CA", help="encrypted, by the certificates in this file [the system's]")
    add("--topic", required=True, help="of detections: lines of the service, events of Frigate, frames of Axis")
    add("--out-topic", required=True, metavar="TOPIC", help="of predictions; TOPIC/counts has the counts")
    add("--model", required=True, metavar="M.sila", help="model file to create or to continue")
    add("--scene", metavar="FILE", help="scene file [the frame of the model, made from its first tracks]")
    add("--camera", metavar="FILE", help="camera file: positions are image points [pixels]")
    add("--frigate-camera", metavar="NAME", help="camera whose events are read [that of the first event]")
    add("--person", action="append", default=[], metavar="CLASS", help="label of pedestrians instead of the usual ones")
    add("--every", type=float, metavar="S", help="seconds between predictions of a pedestrian [each detection]")
    add("--batch", type=int, metavar="N", help="finished tracks that make an episode [20]")
    add("--digits", type=int, default=3, help="decimals of metres and seconds [3]")
    add("--config", metavar="FILE", help="JSON file with configuration")
    add("--set", action="append", default=[], metavar="PATH=VALUE", help="one configuration value; see `sila config`")
    add("--client-id", default="sila-" + uuid.uuid4().hex[:18], metavar="ID", help="name at the broker [a random one]")
    add("--username", metavar="NAME", help="for a broker that asks for it, with --password-file")
    add("--password-file", metavar="FILE", help="file whose first line is the password")
    return parser


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)  # for all threads; `run` waits for them
    try:
        counts = _TopicStream(options).run()
    except (ValueError, TypeError, OSError, RuntimeError) as error:
        _say(str(error))
        return 1
    print(json.dumps(counts))
    return 0


if __name__ == "__main__":
    sys.exit(main())
