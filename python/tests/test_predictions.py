import copy
import json
import pickle

import numpy as np
import pytest
import sila


def test_arrays_agree_with_the_modes(predictions):
    for prediction in predictions:
        modes, steps = len(prediction.modes), len(prediction.times_s)
        assert prediction.paths_m.shape == (modes, steps, 2)
        assert prediction.covariances_m2.shape == (modes, steps, 2, 2)
        assert prediction.weights.sum() == pytest.approx(1.0)
        assert np.all(np.diff(prediction.weights) <= 0.0)
        for index, mode in enumerate(prediction.modes):
            assert np.array_equal(mode.path_m, prediction.paths_m[index])
            assert np.array_equal(mode.covariances_m2, prediction.covariances_m2[index])
    assert max(len(prediction.modes) for prediction in predictions) > 1


def test_arrays_agree_with_the_line_of_json(predictions):
    for prediction in predictions[:5]:
        line = json.loads(prediction.to_json(digits=17))
        assert line["track"] == prediction.track
        for index, mode in enumerate(line["modes"]):
            assert np.array_equal(np.column_stack([mode["x"], mode["y"]]), prediction.paths_m[index])
            covariances = prediction.covariances_m2[index].reshape(-1, 4)[:, [0, 1, 3]]
            assert np.array_equal(np.array(mode["cov"]), covariances)
        assert np.array_equal(line["t"], prediction.times_s)


def test_the_line_of_json_is_rounded_to_the_digits_asked_for(predictions):
    for prediction in predictions[:5]:
        for line, digits in ((json.loads(prediction.to_json()), 3), (json.loads(prediction.to_json(digits=5)), 5)):
            paths_m = np.array([np.column_stack([mode["x"], mode["y"]]) for mode in line["modes"]])
            assert np.abs(paths_m - prediction.paths_m).max() <= 0.5001 * 10.0**-digits
            assert sum(mode["weight"] for mode in line["modes"]) == pytest.approx(1.0, abs=1e-12)
    assert predictions.to_ndjson(digits=17) == "".join(p.to_json(17) + "\n" for p in predictions)
    with pytest.raises(ValueError, match="digits = 18"):
        predictions[0].to_json(18)


def test_predictions_are_chosen_by_a_mask_or_a_list(predictions):
    chosen = predictions[np.arange(len(predictions)) < 3]
    assert isinstance(chosen, sila.Predictions) and chosen == predictions[[0, 1, 2]] == predictions[:3]
    assert predictions[np.int64(-1)] == list(predictions)[-1]
    assert len(predictions[[]]) == 0


def test_a_frame_has_a_row_a_mode_and_time(predictions):
    prediction = next(p for p in predictions if len(p.modes) > 1)
    frame = prediction.to_frame()
    assert len(frame) == prediction.paths_m.shape[0] * prediction.paths_m.shape[1]
    second = frame[frame["mode"] == 1]
    assert np.array_equal(second[["x", "y"]].to_numpy(), prediction.paths_m[1])
    assert np.array_equal(second["t"].to_numpy(), prediction.times_s)
    assert set(second["weight"]) == {prediction.weights[1]}
    assert len(predictions.to_frame()) == sum(p.paths_m[..., 0].size for p in predictions)
    empty = sila.Predictions().to_frame()
    assert list(empty.columns) == list(frame.columns)
    numbers = [name for name in frame if name not in ("track_id", "variant")]
    assert (empty[numbers].dtypes == frame[numbers].dtypes).all()


def test_a_region_says_of_each_point_whether_it_is_inside(predictions):
    prediction = next(p for p in predictions if p.regions)
    probabilities = [probability for probability, _ in prediction.regions]
    assert probabilities == sorted(probabilities)
    levels = np.array([levels for _, levels in prediction.regions])
    assert levels.shape == (len(probabilities), len(prediction.times_s))
    assert np.all(np.diff(levels, axis=0) >= 0.0), "a region of more probability is no smaller"
    at_centre = prediction.nonconformity_scores(prediction.paths_m[0])
    far_away = prediction.nonconformity_scores(prediction.paths_m[0] + 1000.0)
    assert at_centre.shape == far_away.shape == prediction.times_s.shape
    assert np.all(far_away > levels[-1])
    assert np.all(prediction.nonconformity_scores(prediction.paths_m[0][:3]) == at_centre[:3])
    with pytest.raises(ValueError, match="path_m: expected at most"):
        prediction.nonconformity_scores(np.zeros((len(prediction.times_s) + 1, 2)))
    with pytest.raises(ValueError, match=r"path_m: expected shape \(n, 2\)"):
        prediction.nonconformity_scores(np.zeros((3, 3)))


def test_outcomes_are_probabilities_at_whole_seconds_and_the_horizon(predictions):
    for prediction in predictions:
        outcomes = prediction.outcomes
        assert outcomes["within_s"] == pytest.approx([1.0, 2.0, 3.0, 4.0, 5.0])
        kinds = np.array([outcomes[kind] for kind in ("stays", "straight", "left", "right", "back")])
        assert np.all(kinds >= 0.0) and kinds.sum(0) == pytest.approx(np.ones(5))
        assert np.linalg.norm(prediction.heading) == pytest.approx(1.0)
        line = json.loads(prediction.to_json(17, outcomes=True))["outcomes"]
        assert line["position"] == prediction.position_m.tolist() and line["straight"] == outcomes["straight"]
        assert "outcomes" not in json.loads(prediction.to_json())


def test_nearest_probabilities_are_those_of_the_line(predictions):
    for prediction in predictions:
        nearest = prediction.nearest_probabilities
        assert nearest.shape == prediction.weights.shape and nearest.sum() == pytest.approx(1.0)
        modes = json.loads(prediction.to_json(17, outcomes=True))["modes"]
        assert [mode["nearest"] for mode in modes] == nearest.tolist()
        assert all("nearest" not in mode for mode in json.loads(prediction.to_json())["modes"])


def test_manners_and_novelty_are_said_of_every_prediction(predictions):
    for prediction in predictions:
        assert 0.0 <= prediction.novelty <= 1.0
        assert {mode.variant for mode in prediction.modes} <= {"expected", "slower", "faster", "left", "right", "wide"}
    frame = predictions.to_frame()
    assert {"expected", "slower"} <= set(frame["variant"])


def test_explaining_says_why(model, unseen, predictions):
    lines = sila.explain(model, unseen.tracks, scene=unseen.scene)
    assert len(lines) == len(predictions)
    for line, prediction in zip(lines, predictions, strict=True):
        assert line["track"] == prediction.track
        assert len(line["explanation"]["modes"]) == len(prediction.modes)


def test_predictions_pickle_and_copy_bit_for_bit(predictions):
    assert pickle.loads(pickle.dumps(predictions)) == predictions
    assert copy.deepcopy(predictions[0]) == predictions[0]
    assert predictions[0] != predictions[1]


def test_left_and_right_of_a_place_with_y_down_survive_pickling(place):
    down = sila.Scene(origin=[0, 0], axis_1=[0, 1], axis_2=[1, 0], sidewalk_width_m=3, y_axis="down")
    made = sila.predict(sila.learn(place.tracks, scene=down), place.tracks[:5], scene=down)
    kept = pickle.loads(pickle.dumps(made))
    assert any(one.outcomes["left"] != one.outcomes["right"] for one in made)
    assert [one.outcomes for one in made] == [one.outcomes for one in kept]


def test_what_is_written_is_what_is_shown(tmp_path, predictions):
    text = predictions.to_ndjson(tmp_path / "p.ndjson")
    assert (tmp_path / "p.ndjson").read_text() == text
    assert len(text.splitlines()) == len(predictions)
    one = predictions.of(predictions[0].track)
    assert {prediction.track for prediction in one} == {predictions[0].track}
    assert (
        repr(predictions)
        == f"Predictions({len(predictions)} predictions for {len({p.tracklet for p in predictions})} tracks)"
    )


def test_the_horizon_can_be_changed_without_learning_anew(model, unseen, predictions):
    shorter = sila.predict(model, unseen.tracks, scene=unseen.scene, config={"predict": {"horizon_s": 2.0}})
    assert shorter[0].times_s[-1] == pytest.approx(2.0)
    assert np.array_equal(shorter[0].paths_m, predictions[0].paths_m[:, : len(shorter[0].times_s)])


def test_what_comes_after_t0_changes_no_prediction(model, unseen, predictions):
    track = unseen.tracks[0]
    first = predictions.of(track.id)[0]
    until = track.times_s <= first.t0_s + 1e-9
    cut = sila.Track(track.id, track.times_s[until], track.positions_m[until])
    assert sila.predict(model, cut, scene=unseen.scene, at_end=True)[0] == first


def test_at_the_end_there_is_one_prediction_a_track(model, unseen):
    found = sila.predict(model, unseen.tracks, scene=unseen.scene, at_end=True)
    assert [prediction.tracklet for prediction in found] == [track.id for track in unseen.tracks]
    assert [prediction.t0_s for prediction in found] == [track.times_s[-1] for track in unseen.tracks]


def test_companions_in_another_chunk_count(model, monkeypatch):
    tracks = sila.simulate(tracks=40, seed=3).tracks
    together = sila.predict(model, tracks)
    monkeypatch.setattr("sila._verbs._CHUNK", 7)
    assert list(sila.predict(model, tracks)) == list(together)


@pytest.mark.parametrize("verb", [sila.predict, sila.explain])
@pytest.mark.parametrize("at_end", [False, True])
def test_tracks_that_are_too_short_are_counted_and_not_predicted(verb, at_end, model, unseen):
    long, t = unseen.tracks[0], np.array([0.0, 0.1, 0.2, 0.3])
    given = [sila.Track("one", t[:1], [[0, 0]]), sila.Track("four", t, np.c_[t, t]), long]
    with pytest.warns(UserWarning, match=r"no prediction of 2 of 3 tracks shorter than .*min_observe_s = 0.4 s") as caught:
        found = verb(model, given, scene=unseen.scene, at_end=at_end)
    assert [warning.filename for warning in caught] == [__file__]
    assert found and all((f["track"] if verb is sila.explain else f.tracklet) == long.id for f in found)


def test_an_unfitted_model_still_answers(unseen):
    found = sila.predict(sila.Model(), unseen.tracks, scene=unseen.scene)
    assert all(prediction.fallback for prediction in found)
