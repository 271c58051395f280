"""sila.mqtt with a broker, Debian's mosquitto: what arrives in a topic is predicted into another."""

import json
import shutil
import signal
import socket
import subprocess
import sys
import time

import paho.mqtt.client as paho
import pytest
import sila
from sila.mqtt import detection, objects_of

MOSQUITTO = shutil.which("mosquitto", path="/usr/sbin:/usr/bin:/usr/local/sbin:/usr/local/bin")
needs_broker = pytest.mark.skipif(MOSQUITTO is None, reason="there is no mosquitto (tools/setup --python installs it)")
CAMERA = {"homography": [[0.02, 0.0, -6.0], [0.0, -0.1, 70.0], [0.0, 0.002, 0.1]]}


class Broker:
    def __init__(self, folder, settings="allow_anonymous true\n"):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.file = folder / "mosquitto.conf"
        self.file.write_text(f"listener {self.port} 127.0.0.1\n{settings}")
        self.process = None

    def start(self):
        command = [MOSQUITTO, "-c", str(self.file)]
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wait_for(self.answers)
        return self

    def answers(self):
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", self.port)) == 0

    def stop(self):
        if self.process is not None:
            self.process.terminate()
            self.process.wait()


class Listener:
    """A client of the broker that sends detections and keeps what is published."""

    def __init__(self, broker, topic="out"):
        self.got = []
        self.subscribed = False
        self.client = paho.Client(paho.CallbackAPIVersion.VERSION2)
        self.client.on_message = lambda _client, _data, message: self.got.append(message.payload.decode())
        self.client.on_subscribe = lambda *_: setattr(self, "subscribed", True)
        self.client.connect("127.0.0.1", broker.port)
        self.client.subscribe(topic, qos=1)
        self.client.loop_start()
        wait_for(lambda: self.subscribed)

    def send(self, *messages, topic="in", **options):
        for message in messages:
            text = message if isinstance(message, (str, bytes)) else json.dumps(message)
            self.client.publish(topic, text, qos=1, **options).wait_for_publish(10)

    def close(self):
        self.client.disconnect()
        self.client.loop_stop()


class Program:
    def __init__(self, folder, broker, *options):
        self.said = folder / "stderr"
        given = ["--broker", f"127.0.0.1:{broker.port}", "--topic", "in", "--out-topic", "out", "--model", "m.sila"]
        command = [sys.executable, "-m", "sila.mqtt", *given, *map(str, options)]
        with open(self.said, "w") as said:
            self.process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=said, text=True)

    def wait_until_it_says(self, text, times=1):
        wait_for(lambda: self.said.read_text().count(text) >= times)

    def end(self, number=signal.SIGTERM):
        self.process.send_signal(number)
        output, _ = self.process.communicate(timeout=30)
        assert self.process.returncode == 0, self.said.read_text()
        return json.loads(output)


def wait_for(happens, limit_s=30.0):
    until_s = time.monotonic() + limit_s
    while not happens():
        assert time.monotonic() < until_s, "it did not happen in time"
        time.sleep(0.02)


def walk(steps, first=0, name="a"):
    return [{"t": 0.1 * k, "id": name, "x": 0.13 * k, "y": 1.0} for k in range(first, first + steps)]


@pytest.fixture
def broker(tmp_path):
    broker = Broker(tmp_path)
    yield broker
    broker.stop()


@pytest.fixture
def program(tmp_path, broker):
    started = []

    def start(*options):
        started.append(Program(tmp_path, broker, *options))
        return started[-1]

    yield start
    for one in started:
        one.process.kill()


@needs_broker
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_predictions_of_one_topic_come_out_of_another_and_tracks_are_learnt(tmp_path, broker, program, number):
    listener = Listener(broker.start())
    sila_mqtt = program("--batch", 2)
    sila_mqtt.wait_until_it_says("connected")
    lines = [line for pair in zip(walk(40, name="a"), walk(40, name="b")) for line in pair]
    listener.send(*lines[:60], "\n".join(map(json.dumps, lines[60:])))
    with sila.Stream() as stream:
        expected = [
            p.to_json() for line in lines for p in stream.update(line["t"], [(line["id"], line["x"], line["y"])])
        ]
    wait_for(lambda: len(listener.got) >= len(expected))
    assert listener.got == expected and len(expected) > 60
    counts = sila_mqtt.end(number)
    assert counts["messages"] == 61 and counts["predictions"] == len(expected) and counts["not_published"] == 0
    assert sila.Model.load(tmp_path / "m.sila").tracks == 2
    listener.close()
    totals = Listener(broker, "out/counts")
    wait_for(lambda: totals.got)
    assert 0 < json.loads(totals.got[0])["messages"] <= 61
    totals.close()


@needs_broker
def test_a_broker_may_be_absent_at_first_and_restart_later(broker, program):
    sila_mqtt = program()
    sila_mqtt.wait_until_it_says("not reachable")
    listener = Listener(broker.start())
    sila_mqtt.wait_until_it_says("connected")
    listener.send(*walk(20))
    wait_for(lambda: len(listener.got) >= 10)
    before = len(listener.got)
    broker.stop()
    sila_mqtt.wait_until_it_says("not reachable", times=2)
    broker.start()
    sila_mqtt.wait_until_it_says(": connected", times=2)
    wait_for(lambda: listener.client.is_connected())
    listener.client.subscribe("out", qos=1)
    listener.send(*walk(20, first=20))
    wait_for(lambda: len(listener.got) >= before + 20)
    counts = sila_mqtt.end()
    assert (counts["messages"], counts["rejected"], counts["not_published"]) == (40, {}, 0)
    assert sila_mqtt.said.read_text().count("\n") == 4, "one sentence for each change"
    listener.close()


@needs_broker
def test_the_certificate_of_the_broker_is_checked(tmp_path, program, broker):
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=broker"]
    command += ["-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key), "-out", str(certificate)]
    subprocess.run(command, check=True, capture_output=True)
    with open(broker.file, "a") as file:
        file.write(f"user root\ncertfile {certificate}\nkeyfile {key}\n")
    broker.start()
    unknown = program("--tls")
    unknown.wait_until_it_says("not reachable")
    unknown.end()
    trusting = program("--tls", certificate)
    trusting.wait_until_it_says(": connected")
    trusting.end()


@needs_broker
def test_with_a_name_nothing_is_lost_while_the_program_restarts(broker, program):
    listener = Listener(broker.start())
    sila_mqtt = program("--client-id", "corner")
    sila_mqtt.wait_until_it_says(": connected")
    listener.send(*walk(20))
    wait_for(lambda: listener.got and json.loads(listener.got[-1])["t0"] > 1.85)
    assert sila_mqtt.end()["messages"] == 20
    listener.send(*walk(20, first=20))
    sila_mqtt = program("--client-id", "corner")
    wait_for(lambda: json.loads(listener.got[-1])["t0"] > 3.85)
    listener.close()
    broker.stop()
    sila_mqtt.wait_until_it_says("not reachable")
    counts = sila_mqtt.end()
    assert counts["messages"] == 20 and counts["not_published"] == 0, "it ends without a broker, too"


@needs_broker
def test_messages_that_are_no_detections_are_counted_and_skipped(broker, program):
    listener = Listener(broker.start())
    listener.send({"t": 0, "id": "old", "x": 0, "y": 0}, retain=True)
    sila_mqtt = program()
    sila_mqtt.wait_until_it_says("connected")
    bad = ["{", b"\xff\xfe\xfd", "[" * 100000, "[1]", "3", "null", "{}", '{"t": 0, "id": true, "x": 0, "y": 0}']
    bad += ['{"t": "0", "id": 1, "x": 0, "y": 0}', '{"t": 0, "id": "\\ud800", "x": 0, "y": 0}', '{"frame": {}}']
    bad += ['{"after": {}}', '{"data": 1}', f'{{"t": 0, "id": 1, "x": 1{"0" * 400}, "y": 0}}']
    bad += ['{"t": NaN, "id": 1, "x": 0, "y": 0}', '{"t": 0, "id": 1, "x": NaN, "y": 0}']
    bad += ['{"frame": {"timestamp": "yesterday", "observations": []}}', '{"t": 0, "id": "", "x": 0, "y": 0}']
    listener.send(*bad, *walk(10), "", "\n\n")
    wait_for(lambda: listener.got)
    counts = sila_mqtt.end()
    assert counts["rejected"].pop("retained") == 1
    assert sum(counts["rejected"].values()) == len(bad) and counts["rejected"]["not_json"] == 3
    assert counts["detections"] == 10 and counts["messages"] == len(bad) + 13
    listener.close()


def event(k, camera="door", name="1700000000.5-abc"):
    """Someone walks to the right; the foot of the box is the image point (300 + 4 k, 500)."""
    box = [290 + 4 * k, 400, 310 + 4 * k, 500]
    seen = {"id": name, "camera": camera, "frame_time": 1.7e9 + 0.1 * k, "label": "person", "box": box}
    return {"type": "update", "before": seen, "after": seen}


@needs_broker
def test_events_of_a_frigate_camera_become_metres(tmp_path, broker, program):
    (tmp_path / "camera.json").write_text(json.dumps(CAMERA))
    listener = Listener(broker.start())
    sila_mqtt = program("--camera", "camera.json", "--frigate-camera", "door", "--every", "0.5")
    sila_mqtt.wait_until_it_says("connected")
    listener.send(*(event(k, camera) for k in range(30) for camera in ("yard", "door")))
    with sila.Stream(camera=tmp_path / "camera.json", stride_s=0.5) as stream:
        expected = [
            p for k in range(30) for p in stream.update(1.7e9 + 0.1 * k, [("1700000000.5-abc", 300 + 4 * k, 500)])
        ]
    wait_for(lambda: len(listener.got) >= len(expected))
    assert listener.got == [p.to_json() for p in expected] and len(expected) > 3
    assert sila_mqtt.end()["rejected"] == {"other_camera": 30}
    listener.close()


@needs_broker
def test_a_broker_that_rejects_the_password_is_said(tmp_path, program, broker):
    broker.file.write_text(broker.file.read_text().replace("allow_anonymous true", "allow_anonymous false"))
    broker.start()
    (tmp_path / "password").write_text("secret\n")
    sila_mqtt = program("--username", "me", "--password-file", "password")
    sila_mqtt.wait_until_it_says("not reachable (Not authorized)")
    sila_mqtt.end()


def test_frames_of_axis_are_read():
    box = {"left": 0.4, "top": 0.2, "right": 0.5, "bottom": 0.8}
    person = {"track_id": 7, "bounding_box": box, "class": {"type": "Human"}}
    frame = {
        "timestamp": "2024-05-01T10:00:00.250000Z",
        "observations": [person, {"track_id": "8", "bounding_box": box}],
    }
    for message in ({"frame": frame}, {"data": {"frame": frame}}):
        t_s, objects = objects_of(message)
        assert t_s == 1714557600.25
        assert [detection(seen) for seen in objects] == [("7", 0.45, 0.8, "Human"), ("8", 0.45, 0.8, "unknown")]
    with pytest.raises(ValueError, match="box"):
        detection({**person, "bounding_box": {**box, "right": 0.4}})


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--topic", "a/#", "--out-topic", "a/out"], "--out-topic"),
        (["--topic", "a", "--out-topic", "b/#"], "--out-topic"),
        (["--topic", "a/#/b", "--out-topic", "c"], "subscription filter"),
        (["--topic", "a", "--out-topic", "c", "--camera", "none.json"], "none.json"),
        (["--topic", "a", "--out-topic", "c", "--password-file", "none", "--username", "me"], "none"),
        (["--topic", "a", "--out-topic", "c", "--broker", "localhost:port"], "--broker"),
        (["--topic", "a", "--out-topic", "c", "--set", "service.batch=0"], "service.batch"),
    ],
)
def test_wrong_options_end_in_one_sentence(tmp_path, options, says):
    command = [sys.executable, "-m", "sila.mqtt", "--model", "m.sila", *options]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 1 and run.stderr.count("\n") == 1 and says in run.stderr
