import copy
import pickle
import threading
import time
import warnings

import numpy as np
import pytest
import sila


@pytest.mark.parametrize("learn", [sila.learn, sila.train_batch])
def test_a_model_without_motion_is_a_warning(learn):
    with pytest.warns(UserWarning, match="no motion was learnt: .* too few or too short") as caught:
        assert learn({"a": [[0.0, 0.0, 0.0], [0.1, 0.1, 0.0]]}).size == 0
    assert [warning.filename for warning in caught] == [__file__]


def test_an_empty_model_knows_nothing():
    assert sila.Model().size == 0
    assert sila.Model().history == []


def test_learning_gives_a_new_model_and_leaves_the_old_one(place, model):
    before = copy.copy(model)
    more = sila.learn(place.tracks[:10], scene=place.scene, model=model)
    assert model == before
    assert more != model
    assert (more.episodes, more.tracks) == (model.episodes + 1, len(place.tracks) + 10)


def test_a_prior_is_the_first_model_of_a_new_place(model, place):
    prior = sila.make_prior([model])
    assert (prior.size, prior.tracks, model.prior_windows) == (0, 0, 0)
    assert prior.prior_windows > 100
    learnt = sila.learn(place.tracks[:20], scene=place.scene, model=prior)
    assert learnt.prior_windows == prior.prior_windows
    assert learnt.size > 0
    with pytest.raises(ValueError, match="no error statistics"):
        sila.make_prior([sila.Model()])
    simulated = sila.make_prior(config={"predict": {"horizon_s": 3}})
    assert (simulated.size, simulated.config["predict"]["horizon_s"]) == (0, 3)
    assert simulated.prior_windows > 1000
    with pytest.raises(TypeError, match="config: expected only without models"):
        sila.make_prior([model], config={})


def test_a_model_tells_what_it_holds(model, place):
    assert model.size == len(model.primitives) + len(model.transitions) > 0
    assert repr(model).startswith(f"Model(size={model.size}: {len(model.primitives)} primitives, ")
    expected = [(1, 20), (2, 20), (3, 20), (4, len(place.tracks) - 60)]
    assert [(episode["number"], episode["tracks"]) for episode in model.history] == expected
    assert model.inspect()["size"] == model.size
    primitive = model.primitives[0]
    assert primitive.cells.shape == primitive.centres.shape == primitive.velocities.shape == (len(primitive), 2)
    assert primitive.cells.dtype == np.int32
    assert np.all(np.linalg.norm(primitive.velocities, axis=1) <= 1.0 + 1e-12)
    np.testing.assert_allclose(np.diff(primitive.centres, axis=0), np.diff(primitive.cells, axis=0) * model.cell_widths)
    for transition in model.transitions:
        assert 0 <= transition.from_primitive < len(model.primitives)
        assert 0 <= transition.to_primitive < len(model.primitives)
        assert transition.count > 0
        assert transition.sites == {0: transition.count}
    (site,) = model.sites
    assert (site.episodes, site.tracks) == (model.episodes, model.tracks)
    assert site.frame == place.scene.frame()
    assert model.inspect()["sites"][0]["tracks"] == model.tracks


def test_a_model_comes_back_from_its_file_and_from_a_pickle(tmp_path, model):
    model.save(tmp_path / "corner.sila")
    for other in (
        sila.Model.load(tmp_path / "corner.sila"),
        pickle.loads(pickle.dumps(model)),
        copy.copy(model),
        copy.deepcopy(model),
    ):
        assert other == model
        assert other.config == model.config
        assert other.history == model.history


def test_an_empty_model_pickles():
    assert pickle.loads(pickle.dumps(sila.Model())) == sila.Model()


def test_a_file_that_is_no_model_is_rejected_and_left(tmp_path, model):
    path = tmp_path / "notes.txt"
    path.write_text("not a model, but a pedestrian's notes about the weather of the last weeks\n" * 20)
    with pytest.raises(sila.FormatError, match="notes.txt"):
        sila.Model.load(path)
    with pytest.raises(sila.FormatError):
        model.save(path)
    assert path.read_text().startswith("not a model")


def test_fusing_adds_tracks_and_episodes_and_explains_itself(place, model, unseen):
    other = sila.learn(unseen.tracks, scene=unseen.scene)
    both = sila.fuse(model, other)
    assert (both.tracks, both.episodes) == (model.tracks + other.tracks, model.episodes + other.episodes)
    assert both.size <= model.size + other.size
    assert [episode["number"] for episode in both.history] == list(range(1, len(both.history) + 1))
    why = sila.explain_fusion(model, other)
    assert sila.fuse(model, other).size < model.size + other.size
    assert why["expect"] and why["reasons"]


def test_tracks_in_milliseconds_are_a_warning(model, place):
    tracks = [sila.Track(track.id, 1000 * track.times_s, track.positions_m) for track in place.tracks[:2]]
    with pytest.warns(UserWarning, match=r"learn: the samples of a track are \d+ s apart; are the times milliseconds"):
        sila.learn(tracks, scene=place.scene, model=model)


def test_fusing_two_frames_of_one_place_is_a_warning(place, unseen):
    with pytest.warns(UserWarning, match="nothing was fused, as one frame or both were made from tracks"):
        corner = sila.Scene(origin=[-9.0, 9.0], axis_1=[1.0, 0.0], axis_2=[0.0, 1.0], sidewalk_width_m=2.0)
        sila.fuse(sila.learn(place.tracks), sila.learn(unseen.tracks, scene=corner))


def test_learning_again_or_at_another_place_is_a_warning(model, place):
    with pytest.warns(UserWarning, match=r"has learnt at least (\d+) of the first \1 tracks in other batches"):
        sila.learn(place.tracks, scene=place.scene, model=model, batch=30)
    far = [sila.Track(track.id, track.times_s, track.positions_m + 5e4) for track in place.tracks]
    with pytest.warns(UserWarning, match="km from what the model has learnt: is it another place"):
        sila.learn(far, scene=place.scene, model=model)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sila.learn(place.tracks, scene=place.scene, model=model)  # known batches are not learnt again


def test_predicting_at_a_moved_corner_is_a_warning(model, place):
    frame = place.scene.frame()
    axis_1, axis_2 = frame.axes
    moved = sila.Scene(origin=frame.origin_m + [2, 0], axis_1=axis_1, axis_2=axis_2, sidewalk_width_m=3)
    with pytest.warns(UserWarning, match="is 2 m from that of site 1 of the model"):
        sila.predict(model, place.tracks[:1], scene=moved)


def test_batch_learning_is_one_episode_with_error_statistics(place):
    at_once = sila.train_batch(place.tracks, scene=place.scene)
    assert (at_once.episodes, at_once.tracks) == (1, len(place.tracks))
    kept = sila.learn(place.tracks, scene=place.scene, batch=len(place.tracks), config={"prune": {"enabled": False}})
    assert at_once.size == kept.size
    assert any(prediction.regions for prediction in sila.predict(at_once, place.tracks[:5], scene=place.scene))


def test_one_thread_and_two_learn_the_same(place):
    one, two = (sila.learn(place.tracks, scene=place.scene, threads=threads) for threads in (1, 2))
    assert one == two


def test_progress_is_reported_when_requested(place, capsys):
    sila.learn(place.tracks[:20], scene=place.scene, batch=10, progress=True)
    assert "learning" in capsys.readouterr().err
    sila.learn(place.tracks[:20], scene=place.scene, batch=10)
    assert capsys.readouterr().err == ""


def test_other_threads_run_while_one_learns(place):
    """The GIL is released: a thread that counts goes on counting during one call."""
    done = threading.Event()
    worker = threading.Thread(target=lambda: (sila.learn(place.tracks, scene=place.scene, batch=60), done.set()))
    ticks = 0
    worker.start()
    while not done.is_set():
        time.sleep(0.001)
        ticks += 1
    worker.join()
    assert ticks > 20


def test_an_exception_of_the_progress_bar_ends_the_learning(place):
    class Broken(Exception):
        pass

    def reject(*_):
        raise Broken

    with pytest.raises(Broken):
        sila._sila.learn(sila.Model(), list(place.tracks), place.scene, "{}", 20, 0, reject)


def test_bad_arguments_are_named(place, model):
    with pytest.raises(ValueError, match="batch: expected a whole number from 1 to 2147483647, found 0"):
        sila.learn(place.tracks, scene=place.scene, batch=0)
    for learn in (sila.learn, sila.train_batch):
        with pytest.raises(ValueError, match="tracks: expected at least one, found none"):
            learn([])
    with pytest.raises(TypeError, match="model: expected a sila.Model, found str"):
        sila.predict("corner.sila", place.tracks, scene=place.scene)
    with pytest.raises(TypeError, match="scene: expected .* found dict"):
        sila.learn(place.tracks, scene={})
    with pytest.raises(ValueError, match="threads"):
        sila.evaluate(model, place.tracks, scene=place.scene, threads=-1)
    with pytest.raises(ValueError, match="stride_s"):
        sila.predict(model, place.tracks, scene=place.scene, stride_s=0.0)
    with pytest.raises(ValueError, match="grid"):
        sila.learn(place.tracks, scene=place.scene, model=model, config={"learn": {"grid": {"cell_m": 2.0}}})


def test_an_evaluation_of_learnt_tracks_warns_as_the_program_does(model, place, unseen):
    with pytest.warns(UserWarning, match=r"has learnt at least (\d+) of these \1 tracks") as caught:
        sila.evaluate(model, place.tracks, scene=place.scene)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sila.evaluate(model, unseen.tracks, scene=unseen.scene)


def test_the_errors_of_windows_average_to_those_of_their_group(model, unseen):
    found = sila.evaluate(model, unseen.tracks, scene=unseen.scene)
    moving = [window for window in found.windows if window["moving"]]
    assert len(found.windows) == found.groups["all"]["windows"] > len(moving) > 0
    for of in ("model", "constant_velocity"):
        ade_m = np.mean([window[of]["ade_m"] for window in moving])
        assert ade_m == pytest.approx(found.metric("ade_m", of=of))
    assert {window["track"] for window in found.windows} <= {track.id for track in unseen.tracks}


def test_evaluation_is_a_table(model, unseen):
    found = sila.evaluate(model, unseen.tracks, scene=unseen.scene)
    frame = found.to_frame()
    assert set(frame["group"]) == {"all", "moving", "standing", "turning"}
    assert len(frame) == 4 * 2 * len(found.horizons_s)
    assert found.metric("ade_m", group="all", of="constant_velocity") > 0.0
    assert "constant velocity" in str(found)


def test_modified_hausdorff_is_the_larger_mean_of_nearest_distances():
    a = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    b = np.array([[0.0, 1.0], [0.0, 3.0]])
    nearest = np.linalg.norm(a[:, None] - b[None], axis=2)
    expected = max(nearest.min(axis=1).mean(), nearest.min(axis=0).mean())
    assert sila.modified_hausdorff_m(a, b) == pytest.approx(expected, abs=1e-14)


def test_without_a_scene_the_frame_is_made_once_and_stored(place, unseen, tmp_path):
    frame = place.tracks.to_frame()
    model = sila.learn(frame)
    model.save(tmp_path / "m.sila")
    model = sila.Model.load(tmp_path / "m.sila")
    assert len(model.sites) == 1
    shown = sila.Scene.of_model(model)
    first = np.concatenate([track.positions_m for track in place.tracks[:20]])
    axes = np.linalg.eigh(np.cov(first.T))[1]
    np.testing.assert_array_equal(shown.frame().origin_m, np.round(axes @ np.median(first @ axes, axis=0)))
    shown.save(tmp_path / "shown.json")
    predictions = sila.predict(model, unseen.tracks)
    assert len(predictions) > 0
    assert [p.to_json() for p in predictions] == [
        p.to_json() for p in sila.predict(model, unseen.tracks, scene=tmp_path / "shown.json")
    ]
    further = sila.learn(unseen.tracks, model=model)
    assert len(further.sites) == 1
    with pytest.raises(ValueError, match="leave the scene out"):
        sila.learn(unseen.tracks, model=model, scene=place.scene)
    with pytest.raises(ValueError, match="leave the scene out"):
        sila.predict(model, unseen.tracks, scene=place.scene)
