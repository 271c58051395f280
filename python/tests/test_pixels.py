"""Tracks in pixels without a camera: the scale is measured by how fast people walk."""

import numpy as np
import pandas
import pytest
import sila
import sila.plot


def walks(scale=1.0, count=12):
    """Tracks by id with the columns t, u, v [pixels], 54 pixels a second."""
    t = 0.1 * np.arange(80)
    return {f"{i}": np.c_[t + i, scale * (300 + 50 * t + i), scale * (400 + 20 * i + 20 * t)] for i in range(count)}


@pytest.fixture(scope="module")
def model():
    return sila.learn(walks(), units="pixels")


def test_a_model_in_pixels_keeps_the_scale_and_predicts_pixels(model, tmp_path):
    scale = model.config["metres_per_pixel"]
    assert scale == pytest.approx(1.3 / np.hypot(50, 20), rel=1e-6)
    assert "pixels of" in model.describe()
    prediction = sila.predict(model, walks(), at_end=True)[0]
    assert np.allclose(prediction.paths_px * [scale, -scale], prediction.paths_m)
    assert np.allclose(prediction.paths_px[0, 0], walks()["0"][-1, 1:], atol=40)
    ax = sila.plot.predictions(prediction, image=np.zeros((700, 1000)))
    assert any(np.allclose(line.get_xydata()[-1], prediction.paths_px[0, -1]) for line in ax.lines)
    assert '"u":[' in prediction.to_json() and '"u":[' not in prediction.to_json().split('"cov"')[0]
    model.save(tmp_path / "m.sila")
    with sila.Stream(tmp_path / "m.sila") as stream:
        for t, u, v in walks()["0"]:
            live = stream.update(t, [("0", u, v)])
        assert np.allclose(live[0].paths_px[0], prediction.paths_px[0], atol=1.0)
        assert np.allclose(stream.to_image(live[0].paths_m[0]), live[0].paths_px[0])


def test_files_tables_and_arrays_in_pixels_give_the_same_model(model, tmp_path):
    rows = pandas.DataFrame(
        [(i, *row) for i, track in walks().items() for row in track], columns=["track_id", "t", "x", "y"]
    )
    rows.to_csv(tmp_path / "pixels.csv", index=False)
    assert sila.learn(rows, units="pixels") == model
    assert sila.learn(tmp_path / "pixels.csv", units="pixels") == model
    again = sila.learn(tmp_path / "pixels.csv", model=model, units="pixels")
    assert again == model, "the same batch is known"
    read = sila.read_tracks(tmp_path / "pixels.csv", config=model.config)
    assert sila.predict(model, read) == sila.predict(model, walks())


def test_a_file_with_frame_numbers_needs_a_rate_and_its_boxes_are_pixels(model, tmp_path):
    boxes = tmp_path / "mot.txt"
    boxes.write_text(
        "".join(
            f"{round(10 * t)},{1 + int(name)},{u - 10},{v - 50},20,50,1,-1,-1,-1\n"
            for name, track in walks().items()
            for t, u, v in track
        )
    )
    learnt = sila.learn(boxes, units="pixels", frames_per_second=10)
    assert learnt.config["metres_per_pixel"] == pytest.approx(model.config["metres_per_pixel"])
    for files in ([boxes], iter([boxes])):
        assert len(sila.predict(learnt, files, frames_per_second=10, at_end=True)) == len(walks())
    short = {"predict": {"horizon_s": 3}}
    assert sila.evaluate(learnt, boxes, frames_per_second=10, config=short).groups["all"]["windows"] > 0
    with pytest.raises(ValueError, match="frames_per_second"):
        sila.learn(boxes, units="pixels")
    with pytest.raises(ValueError, match="frames_per_second: expected files"):
        sila.predict(learnt, walks(), frames_per_second=10)
    for verb in (sila.learn, sila.read_tracks):
        with pytest.raises(sila.FormatError, match="found pixels; give"):
            verb(boxes, frames_per_second=10)


def test_what_is_not_in_pixels_is_rejected(model, place, tmp_path):
    tracks = sila.Tracks(place.tracks)
    for wrong, words in [
        ({"tracks": tracks}, "in metres"),
        ({"tracks": list(tracks)}, "in metres"),
        ({"tracks": walks(), "scene": place.scene}, "scene"),
        ({"tracks": walks(), "model": sila.learn(tracks)}, "learnt in metres"),
        ({"tracks": walks(), "model": model, "units": "metres"}, "learnt in pixels"),
        ({"tracks": walks(count=3)}, "3 of the first 3 tracks walk"),
        ({"tracks": walks(), "units": "feet"}, "metres or pixels"),
    ]:
        with pytest.raises(ValueError, match=words):
            sila.learn(wrong.pop("tracks"), **({"units": "pixels"} | wrong))
    (tmp_path / "camera.json").write_text('{"homography": [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 1]]}')
    with pytest.raises(ValueError, match="metres_per_pixel"):
        sila.Stream(model, camera=tmp_path / "camera.json")
    with pytest.raises(ValueError, match="not of one scale"):
        sila.fuse(model, sila.learn(tracks))
    with pytest.raises(ValueError, match="in metres"):
        _ = sila.predict(sila.learn(tracks), tracks[:1])[0].paths_px


def test_a_prior_of_a_place_in_pixels_leaves_the_scale_to_the_next_place(model):
    prior = sila.make_prior([model])
    assert "metres_per_pixel" not in prior.config
    nearer = sila.learn(walks(scale=2.0), units="pixels", model=prior)
    assert nearer.config["metres_per_pixel"] == pytest.approx(model.config["metres_per_pixel"] / 2, rel=1e-6)
