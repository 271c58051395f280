import pickle

import pytest
import sila
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, KFold, cross_val_score, learning_curve


@pytest.fixture
def predictor(place):
    return sila.Predictor(place.scene, batch=15, predict__horizon_s=3.0)


def test_parameters_come_from_the_configuration(predictor):
    params = predictor.get_params()
    assert params["predict__horizon_s"] == 3.0
    assert params["fuse__similarity_threshold"] == sila.config()["fuse"]["similarity_threshold"]
    predictor.set_params(fuse={"similarity_threshold": 0.4}, batch=5)
    assert predictor.get_params()["fuse__similarity_threshold"] == 0.4
    assert predictor.batch == 5


def test_a_bad_parameter_changes_nothing(predictor):
    with pytest.raises(sila.FormatError, match="similarity_threshold"):
        predictor.set_params(batch=3, fuse__similarity_treshold=0.4)
    assert predictor.batch == 15


@pytest.mark.parametrize("given", [{"predict.horizon_s": 3}, {"predict": {"mode.s": 3}}])
def test_a_name_with_a_dot_is_refused(given):
    with pytest.raises(ValueError, match=r"expected predict__\w+ \(two underscores\), found predict(\.|__)"):
        sila.Predictor(**given)


def test_partial_fit_is_one_episode(predictor, place):
    for first in (0, 20, 40):
        predictor.partial_fit(place.tracks[first : first + 20])
    assert predictor.model_.episodes == 3
    expected = sila.learn(place.tracks[:60], scene=place.scene, batch=20, config={"predict": {"horizon_s": 3.0}})
    assert predictor.model_ == expected


def test_fit_learns_anew(predictor, place):
    assert predictor.fit(place.tracks).fit(place.tracks[:30]).model_.tracks == 30


def test_predict_gives_one_prediction_a_track(predictor, place, unseen):
    found = predictor.fit(place.tracks).predict(unseen.tracks)
    assert len(found) == len(unseen.tracks)
    assert found[0].times_s[-1] == pytest.approx(3.0)


def test_score_is_minus_the_mean_error(predictor, place, unseen):
    predictor.fit(place.tracks)
    assert predictor.score(unseen.tracks) == -predictor.evaluate(unseen.tracks).metric(group="all") < 0.0


def test_what_is_not_fitted_says_so(predictor, place):
    with pytest.raises(ValueError, match="not fitted"):
        predictor.predict(place.tracks)
    assert len(sila.Predictor().fit(place.tracks).model_.sites) == 1  # without a scene: a frame of the tracks


def test_clones_and_pickles(predictor, place):
    copied = clone(predictor)
    assert copied.get_params() == predictor.get_params()
    assert not hasattr(copied, "model_")
    predictor.fit(place.tracks[:20])
    assert pickle.loads(pickle.dumps(predictor)).model_ == predictor.model_


def test_a_clone_keeps_the_fields_of_a_profile():
    copied = clone(sila.Predictor(profile="paper", predict__horizon_s=3.0))
    expected = sila.config({"profile": "paper", "predict.horizon_s": 3.0})
    assert sila.config(copied._settings()) == expected
    assert copied.get_params()["predict__own_deviation"] is expected["predict"]["own_deviation"] is True


def test_a_search_may_be_over_profiles():
    copied = clone(sila.Predictor(predict__horizon_s=3.0)).set_params(profile="paper")
    assert sila.config(copied._settings()) == sila.config({"profile": "paper", "predict.horizon_s": 3.0})


def test_cross_validation_and_search(predictor, place):
    folds = KFold(3, shuffle=True, random_state=0)
    scores = cross_val_score(predictor, place.tracks, cv=folds)
    assert scores.shape == (3,)
    assert (scores < 0.0).all()
    search = GridSearchCV(predictor, {"fuse__similarity_threshold": [0.5, 0.9]}, cv=folds)
    search.fit(place.tracks)
    assert search.best_params_["fuse__similarity_threshold"] in (0.5, 0.9)
    assert search.best_estimator_.model_.tracks == len(place.tracks)


def test_learning_curve(predictor, place):
    sizes, _, scores = learning_curve(predictor, list(place.tracks), None, cv=3, train_sizes=[0.5, 1.0])
    assert sizes.tolist() == [len(place.tracks) * 2 // 3 // 2, len(place.tracks) * 2 // 3]
    assert scores.shape == (2, 3)
