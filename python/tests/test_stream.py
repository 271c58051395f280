"""sila.Stream: what `sila serve` does, in process."""

import copy
import json
import pickle
import subprocess
import sys
import threading
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import sila
from sila._program import PROGRAM

CAMERA = {"homography": [[0.02, 0.0, -6.0], [0.0, -0.1, 70.0], [0.0, 0.002, 0.1]]}


def rows_of(simulation):
    """(t, id, x, y) in order of time; every detection has a time of its own."""
    rows = [
        (float(t) + 1e-5 * number, track.id, float(x), float(y))
        for number, track in enumerate(simulation.reported)
        for t, (x, y) in zip(track.times_s, track.positions_m, strict=True)
    ]
    return sorted(rows)


def walk(stream, ids=("a",), start_s=0.0, steps=40, speed_mps=1.2):
    """People who walk side by side: all their predictions."""
    found = []
    for k in range(steps):
        t = start_s + 0.1 * k
        found += stream.update(t, {name: (speed_mps * 0.1 * k, 1.0 + 2 * i) for i, name in enumerate(ids)})
    return found


@pytest.fixture(scope="module")
def rows():
    return rows_of(sila.simulate(layout="acute", tracks=30, seed=5))


@pytest.mark.parametrize("with_scene", [True, False])
def test_predictions_and_model_are_those_of_the_service(tmp_path, rows, place, with_scene):
    place.scene.save(tmp_path / "scene.json")
    scene = tmp_path / "scene.json" if with_scene else None
    lines = "".join(json.dumps({"t": t, "id": key, "x": x, "y": y}) + "\n" for t, key, x, y in rows)
    command = [PROGRAM, "serve", "--stdin", "--wait", "--http", "off", "--model", "m.sila", "--batch", "10"]
    command += ["--every", "0.8", "--scene", str(scene)] if with_scene else ["--every", "0.8"]
    run = subprocess.run(command, cwd=tmp_path, input=lines, capture_output=True, text=True, check=True)
    found = []
    with sila.Stream(scene=scene, batch=10, stride_s=0.8) as stream:
        for t, key, x, y in rows:
            found += stream.update(t, [(key, x, y)])
            stream.wait()
    assert len(found) > 100
    assert "".join(prediction.to_json() + "\n" for prediction in found) == run.stdout
    assert stream.model == sila.Model.load(tmp_path / "m.sila")
    assert stream.model.tracks == stream.counts["tracks_learnt"] > 20
    assert len({prediction.fallback for prediction in found}) == 2, "learning takes effect while the stream runs"


def test_learning_goes_on_in_the_background(rows):
    stream = sila.Stream(batch=5)
    for t, key, x, y in rows:
        stream.update(t, [(key, x, y)])
    stream.wait()
    learnt = stream.model
    assert learnt.episodes >= 1 and stream.counts["episodes"] >= 1
    assert not all(prediction.fallback for prediction in walk(stream, ids=[f"late{i}" for i in range(4)], start_s=1e4))
    stream.close()
    assert stream.model.tracks > learnt.tracks == sum(e["tracks"] for e in learnt.history)


def test_a_file_keeps_every_episode(tmp_path, rows):
    path = tmp_path / "m.sila"
    with sila.Stream(path, batch=10) as stream:
        for t, key, x, y in rows:
            stream.update(t, [(key, x, y)])
    first = stream.model
    assert sila.Model.load(path) == first
    with sila.Stream(path, batch=10) as again:
        assert again.model == first
        walk(again, ids=["a", "b"])
    assert again.model.tracks == first.tracks + 2
    assert sila.Model.load(path) == again.model


def test_a_model_is_continued_and_stays_as_it_was(model, place):
    before = model.tracks
    with sila.Stream(model, scene=place.scene) as stream:
        walk(stream)
    assert model.tracks == before
    assert stream.model.tracks == before + 1


def test_detections_may_be_given_in_five_forms():
    pairs = [("7", 1.0, 2.0), ("8", 3.0, 4.0)]
    forms = [
        lambda k: [(7, 0.1 * k, 2.0), ("8", 3.0, 0.1 * k)],
        lambda k: {7: (0.1 * k, 2.0), "8": np.array([3.0, 0.1 * k])},
        lambda k: np.array([[7, 0.1 * k, 2.0], [8, 3.0, 0.1 * k]]),
        lambda k: pd.DataFrame({"id": [7.0, 8.0], "x": [0.1 * k, 3.0], "y": [2.0, 0.1 * k]}),
        lambda k: (row for row in [("7", 0.1 * k, 2.0, "person"), ("8", 3.0, 0.1 * k, "")]),
    ]
    found = []
    for form in forms:
        stream = sila.Stream()
        found.append([prediction for k in range(40) for prediction in stream.update(0.1 * k, form(k))])
    assert {prediction.track for prediction in found[0]} == {key for key, _, _ in pairs}
    assert all(other == found[0] for other in found[1:])
    assert isinstance(stream.update(4.0, {}), sila.Predictions)


def test_what_the_service_rejects_is_counted_by_reason():
    stream = sila.Stream(config={"service": {"max_ids": 2}})
    walk(stream)
    accepted = stream.counts["detections"]
    stream.update(2.0, [("a", 1.0, 1.0)])
    stream.update(4.0, [("a", np.nan, 1.0), ("b", 0.0, np.inf), ("c", 1e9, 0.0), ("d", 0.0, 0.0, "car")])
    stream.update(np.nan, [("a", 1.0, 1.0)])
    stream.update(4.0, [("", 1.0, 1.0), (None, 1.0, 1.0), (np.nan, 1.0, 1.0), ("x" * 65, 1.0, 1.0)])
    stream.update(100.0, [("a", 1.0, 1.0)])
    stream.update(3.9, [("b", 9.0, 9.0), ("c", 5.0, 5.0)])
    counts = stream.counts
    assert counts["rejected"] == {
        "late": 1,
        "not_usable": 5,
        "not_a_detection": 4,
        "off_clock": 1,
        "too_many_ids": 1,
    }
    assert counts["detections"] == accepted + 1
    assert counts["detections"] == counts["not_due"] + counts["predictions"] + counts["superseded"]
    assert stream.metrics["rejected"] == 12


def test_a_repeated_detection_gives_no_second_prediction():
    stream = sila.Stream()
    walk(stream)
    row = ("a", 4.8, 1.0)
    assert len(stream.update(4.0, [row, row])) == 1
    assert len(stream.update(4.0, [row])) == 0
    assert stream.counts["rejected"] == {}


def test_empty_frames_end_tracks():
    stream = sila.Stream(batch=1)
    walk(stream)
    stream.update(5.0, [])
    assert stream.counts["tracks"] == 0
    stream.update(20.0, np.array([]))
    stream.wait()
    assert stream.counts["tracks"] == stream.counts["episodes"] == 1


def test_what_is_no_detection_is_an_error(tmp_path):
    stream = sila.Stream()
    for wrong, words in [
        ([("a", 1.0)], r"expected \(id, x, y\)"),
        ([("a", "left", 1.0)], "expected numbers x, y"),
        ([("a", 0.0, 0.0, 0.0)], "expected a text or a whole number as label, found 0.0"),
        ({"a": (0.0, 0.0, 0.0)}, r"expected id: \(x, y\), found \('a', 0.0, 0.0, 0.0\)"),
        (np.zeros((2, 2)), r"expected shape \(n, 3\)"),
        (pd.DataFrame({"id": ["a"], "x": [0.0]}), "expected the columns"),
        (SimpleNamespace(xyxy=np.zeros((1, 4)), tracker_id=None), "no tracker_id"),
        (SimpleNamespace(xyxy=np.zeros((4, 3)), tracker_id=[1, 2, 3, 4]), r"xyxy: expected shape \(n, 4\), found \(4, 3\)"),
        (SimpleNamespace(xyxy=np.zeros((2, 4)), tracker_id=[1]), "tracker_id: expected 2 ids, found 1"),
    ]:
        with pytest.raises(ValueError, match=words):
            stream.update(0.0, wrong)
    for wrong in (3, "a,1,2", None, [{"id": 1, "x": 0.0, "y": 0.0}]):
        with pytest.raises(TypeError, match="detections: expected"):
            stream.update(0.0, wrong)
    with pytest.raises(TypeError, match="t: expected seconds"):
        stream.update("0", [])
    stream.close()
    stream.close()
    with pytest.raises(ValueError, match="closed"):
        stream.update(1.0, [])
    with pytest.raises(ValueError, match="no camera"):
        stream.to_image([[0.0, 0.0]])
    with pytest.raises(sila.FormatError, match="service.batch"):
        sila.Stream(batch=0)
    with pytest.raises(TypeError, match="model"):
        sila.Stream(3)
    (tmp_path / "no.sila").write_text("no model")
    with pytest.raises(sila.FormatError, match="no.sila"):
        sila.Stream(tmp_path / "no.sila")
    with pytest.raises(sila.FormatError, match="none.json"):
        sila.Stream(camera=tmp_path / "none.json")


def test_a_camera_makes_metres_of_image_points(tmp_path):
    (tmp_path / "camera.json").write_text(json.dumps(CAMERA))
    seen, known = sila.Stream(camera=tmp_path / "camera.json"), sila.Stream()
    boxes = []
    for k in range(40):
        ground = np.array([[0.12 * k, 8.0]])
        ((u, v),) = seen.to_image(ground)
        boxes.append(SimpleNamespace(xyxy=np.array([[u - 10, v - 60, u + 10, v]]), tracker_id=np.array([7])))
        ours = seen.update(0.1 * k, boxes[-1])
        theirs = known.update(0.1 * k, [(7, *ground[0])])
        assert len(ours) == len(theirs)
    assert ours[0].track == "7"
    np.testing.assert_allclose(ours[0].paths_m, theirs[0].paths_m, atol=1e-6)
    points = sila.Stream(camera=tmp_path / "camera.json")
    assert points.update(3.9, boxes[-1]) == sila.Predictions()
    points.update(4.0, [(8, 300.0, -60.0)])
    assert points.counts["rejected"] == {"not_usable": 1}, "above the horizon"


def test_a_scene_with_a_camera_needs_to_know_what_positions_are(tmp_path):
    corner = {"origin": [0, 0], "axis_1": [1, 0], "axis_2": [0, 1], "sidewalk_width_m": 2.5}
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps({**corner, "camera": CAMERA.get("camera", CAMERA)}))
    with pytest.raises(ValueError, match="scene has a camera: expected camera="):
        sila.Stream(scene=scene)
    assert sila.Stream(scene=scene, camera=scene).to_image([[2.0, 8.0]]).shape == (1, 2)
    with pytest.raises(ValueError, match="no camera"):
        sila.Stream(scene=scene, camera=False).to_image([[2.0, 8.0]])


def test_person_classes_name_the_labels_of_pedestrians():
    stream = sila.Stream(person_classes=["0", "Cyclist"])
    stream.update(0.0, [("a", 0.0, 0.0, 0), ("b", 1.0, 0.0, "cyclist"), ("c", 2.0, 0.0, "person"), ("d", 3.0, 0.0)])
    assert stream.counts["rejected"] == {"not_usable": 1}
    assert stream.counts["detections"] == 3


FORKED = """
import os, sila, sys
stream = sila.Stream()
if os.fork() == 0:
    for call in (stream.close, lambda: stream.update(0.0, [])):
        try:
            call()
        except RuntimeError as error:
            print(error)
    sys.exit()
os.wait()
stream.close()
"""


def test_a_forked_process_learns_that_the_stream_is_not_its_own():
    run = subprocess.run([sys.executable, "-c", FORKED], capture_output=True, text=True, timeout=60, check=True)
    assert run.stdout == 2 * "Stream: the stream belongs to another process; make one in this process\n"


def test_a_stream_is_not_copied_and_warns_if_it_is_not_closed():
    stream = sila.Stream()
    for copied in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="cannot be copied or pickled"):
            copied(stream)
    with pytest.warns(ResourceWarning, match=r"unclosed Stream\(0 detections"):
        del stream


def test_pixels_without_a_camera_are_a_warning(rows):
    stream = sila.Stream()
    with pytest.warns(UserWarning, match="look like pixels"):
        for t, key, x, y in rows:
            stream.update(t, [(key, 40 * x, 40 * y)])
        stream.close()


def test_several_threads_may_use_one_stream():
    stream = sila.Stream(batch=2)
    threads = [threading.Thread(target=walk, args=(stream, [f"{name}"])) for name in "abcd"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    counts = stream.counts
    assert counts["detections"] + sum(counts["rejected"].values()) == 4 * 40
    stream.close()
