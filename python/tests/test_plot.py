import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
import sila
from sila import plot
from sila._ellipse import ellipse, steps_at


@pytest.fixture(autouse=True)
def close():
    yield
    plt.close("all")


def test_an_ellipse_holds_its_share():
    covariance = np.array([[2.0, 0.7], [0.7, 0.5]])
    drawn = np.random.default_rng(5).multivariate_normal([1.0, -3.0], covariance, size=40000)
    outline = ellipse([1.0, -3.0], covariance, 0.8, points=200)
    inside = plt.matplotlib.path.Path(outline).contains_points(drawn).mean()
    assert inside == pytest.approx(0.8, abs=0.01)  # five deviations of the share of 40000 draws
    with pytest.raises(ValueError, match="coverage: expected a number between 0 and 1, found 90"):
        ellipse([0.0, 0.0], covariance, 90)


def test_ellipses_stand_where_they_are_wanted_and_within_the_horizon():
    times = np.arange(1, 18) * 0.2
    assert [round(times[i], 6) for i in steps_at(times, None)] == [3.4]
    assert [round(times[i], 6) for i in steps_at(times, (2, 1, 5))] == [1.0, 2.0]


def test_every_picture_is_drawn(tmp_path, model, place, unseen, predictions):
    some = next(p for p in predictions if len(p.modes) > 1)
    pictures = {
        "tracks": plot.tracks(place.tracks, scene=place.scene),
        "time": plot.tracks(place.tracks, colour="time"),
        "frame": plot.curb_frame(place.scene),
        "primitives": plot.primitives(model, scene=place.scene),
        "graph": plot.primitive_graph(model, scene=place.scene),
        "prediction": plot.predictions(some, tracks=unseen.tracks, scene=unseen.scene, coverage=(0.5, 0.9)),
        "curve": plot.learning_curve(model, errors=[(20, 1.0), (60, 0.8)]),
    }
    for name, ax in pictures.items():
        ax.figure.savefig(tmp_path / f"{name}.png", dpi=50)
        picture = plt.imread(tmp_path / f"{name}.png")
        assert len(np.unique(picture.reshape(-1, picture.shape[-1]), axis=0)) > 20, f"{name} is empty"


def test_predictions_are_labelled_with_their_coverage(predictions):
    labels = [text.get_text() for text in plot.predictions(predictions[0], coverage=0.95).get_legend().get_texts()]
    assert "at 5 s: 95 % coverage" in labels
    assert any(re.fullmatch(r"mode 1( \(.+\))?: \d+ %", label) for label in labels)


def test_a_track_without_a_sample_before_t0_is_drawn_after_it(predictions, unseen):
    last = predictions[-1]
    track = next(track for track in unseen.tracks if track.id == last.tracklet)
    after = track.times_s > last.t0_s
    rest = sila.Track(track.id, track.times_s[after], track.positions_m[after])
    assert len(plot.predictions(last, tracks=[rest], at_s=2).lines) > 0


def test_the_label_says_which_seconds_the_ellipses_are_of(predictions):
    ax = plot.predictions(predictions[:2], coverage=(0.9, 0.5), at_s=(1, 3))
    assert "at 1, 3 s: 50 %, 90 % coverage" in [text.get_text() for text in ax.get_legend().get_texts()]


def test_without_predictions_only_the_picture_is_drawn():
    ax = plot.predictions([], image=np.zeros((72, 128)))
    assert (len(ax.images), len(ax.lines), ax.get_legend()) == (1, 0, None)


def test_predictions_are_drawn_on_an_image_by_its_camera(tmp_path, unseen, predictions):
    camera = tmp_path / "camera.json"
    camera.write_text(
        '{"image_points": [[60, 690], [1220, 690], [860, 130], [420, 130]],'
        '"ground_points": [[-30, -30], [30, -30], [30, 30], [-30, 30]]}'
    )
    picture = np.zeros((720, 1280, 3), dtype=np.uint8)
    plt.imsave(tmp_path / "p.png", picture)
    expected = sila.Stream(camera=camera).to_image(predictions[0].modes[0].path_m)
    for image in (picture, tmp_path / "p.png"):
        ax = plot.predictions(predictions[0], tracks=unseen.tracks, image=image, camera=camera)
        assert any(np.array_equal(line.get_xydata(), expected, equal_nan=True) for line in ax.lines)
        assert (ax.get_xlim(), ax.get_ylim()) == ((-0.5, 1279.5), (719.5, -0.5))
    with pytest.raises(ValueError, match="image: expected camera="):
        plot.predictions(predictions[0], image=picture)


def test_the_picture_points_down_where_the_scene_does():
    scene = sila.Scene(origin=[0, 0], axis_1=[1, 0], axis_2=[0, -1], sidewalk_width_m=2, y_axis="down")
    assert plot.curb_frame(scene).yaxis_inverted()


def test_the_curve_ends_at_the_size_of_the_model(model):
    x, y = plot.learning_curve(model).lines[0].get_data()
    assert (x[-1], y[-1]) == (model.tracks, model.size)


def test_the_truth_of_a_model_in_pixels_is_drawn_in_pixels():
    t = 0.1 * np.arange(80)
    walks = {f"{i}": np.c_[t + i, 300 + 50 * t, 400 + 20 * i + 20 * t] for i in range(12)}
    model = sila.learn(walks, units="pixels")
    prediction = sila.predict(model, walks)[0]
    seen = walks[prediction.track][:, 1:]
    for given in (walks, sila.as_tracks(walks, config=model.config)):
        ax = plot.predictions(prediction, tracks=given, image=np.zeros((900, 900)))
        before = next(line.get_xydata() for line in ax.lines if line.get_color() == "black")
        np.testing.assert_allclose(before, seen[: len(before)], atol=1e-6)
    ax = plot.predictions(prediction, tracks=walks)
    before = next(line.get_xydata() for line in ax.lines if line.get_color() == "black")
    scale = prediction.metres_per_pixel
    np.testing.assert_allclose(before, seen[: len(before)] * [scale, -scale], atol=1e-6)


@pytest.mark.parametrize("kind", [np.float32, np.int64])
def test_seconds_and_coverage_may_be_numbers_of_numpy(predictions, kind):
    ax = plot.predictions(predictions[0], coverage=np.float32(0.5), at_s=kind(2))
    assert "at 2 s: 50 % coverage" in [text.get_text() for text in ax.get_legend().get_texts()]


def test_bad_arguments_are_named(place):
    for draw in (plot.primitives, plot.primitive_graph, plot.learning_curve):
        with pytest.raises(TypeError, match="model: expected a sila.Model, found str"):
            draw("m.sila")
    with pytest.raises(ValueError, match="colour: expected speed or time, found red"):
        plot.tracks(place.tracks, colour="red")
    with pytest.raises(ValueError, match=r"errors: expected shape \(n, 2\), found \(2,\)"):
        plot.learning_curve(sila.Model(), errors=[1, 2])
