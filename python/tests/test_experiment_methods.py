"""Methods of experiments: baselines of one's own, the forecasts that they give, and those of others."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("scipy")
from sila.experiments import Method, read_experiment, run_experiment
from sila._config import merged
from sila._sila import FramedTracks
from sila.experiments.field import CONFIG, predicted, read_scene
from sila.experiments.methods import METHODS
from sila.experiments.methods.cliff import fit_mixture
from sila.experiments.program import run
from sila.experiments.protocol import Protocol, protocol_of, runs_of
from sila.experiments.runner import method_and_batches
from sila.experiments.sampler import Sampler
from test_experiments import written

PEERS = Path(__file__).parents[2] / "experiments/peers"


CHECKED = """

class Checked(Damped):
    def predict(self, windows):
        assert windows.future_m.shape[1] == 0  # hidden
        return super().predict(windows)
"""


def test_the_new_baseline_of_the_page_runs(tmp_path):
    page = (Path(__file__).parents[2] / "docs/experiments.md").read_text()
    (tmp_path / "damped.py").write_text(page.split("```python\n")[1].split("```")[0] + CHECKED)
    (tmp_path / "gone.py").write_text("import no_such_package\n")
    own = {"name": "own", "method": "damped.py:Checked", "parameters": {"ridge_m2": 0.5}}
    path = written(tmp_path, methods=["sila", own, {"name": "gone", "method": "gone.py:Gone"}])
    written_results = run_experiment(read_experiment(path), tmp_path / "out")
    table = pd.read_csv(tmp_path / "out/results.csv").set_index("method")
    assert 0.5 < table.loc["own", "ratio"] < 1.05
    assert table.loc["own", "nll"] < table.loc["own", "constant_nll"]
    assert "no_such_package" in written_results["not_run_here"]["gone"]
    assert "gone (not run here)" in (tmp_path / "out/table.md").read_text()


def test_only_methods_in_metres_have_a_right_angle_at_an_oblique_corner(tmp_path):
    oblique = [{"name": "acute", "simulate": {"layout": "acute", "tracks": 120}}]
    methods = ["sila", {"name": "paper", "method": "sila", "config": {"profile": "paper"}}]
    experiment = read_experiment(written(tmp_path, config={}, scenes=oblique, methods=methods))
    frames = [protocol_of(experiment, run).training[0].frame(0) for run in runs_of(experiment)[:2]]
    assert [frame.axes[0] @ frame.axes[1] for frame in frames] == pytest.approx([0.0, 0.5])


def test_a_method_without_companions_learns_and_predicts_each_person_alone():
    config = merged("{}", {"simulate": {"tracks": 40}})
    tracks = FramedTracks.simulated(config)
    strangers = tracks.without_companions()

    def paths(name, tracks):
        method = METHODS[name](config)
        method.fit(tracks)
        return [prediction.modes[0].path_m for prediction in method.predict(tracks.windows(config, 0.8))]

    alone = paths("sila without companions", tracks)
    assert np.array_equal(alone, paths("sila", strangers))
    assert not np.array_equal(alone, paths("sila", tracks))


def test_people_of_several_scenes_that_are_learnt_at_once_are_strangers(tmp_path):
    experiment = read_experiment(written(tmp_path, methods=["batch"]))
    tracks = experiment.scenes[0].tracks
    _, (joined,) = method_and_batches(experiment, runs_of(experiment)[0], Protocol([tracks, tracks]))
    assert len(set(joined.ids)) == len(joined) == 2 * len(tracks)
    assert joined.recordings == [0] * len(tracks) + [1] * len(tracks)


WRONG = """
from dataclasses import replace

import numpy as np
from sila.experiments import Method
from sila.experiments.method import constant_fallback


class Wrong(Method):
    parameters = {"how": ""}

    def partial_fit(self, tracks): ...

    def predict(self, windows):
        found = constant_fallback(windows)
        paths, covariances = found.paths_m, found.covariances_m2
        return {
            "single": lambda: replace(found, weights=np.float32([[0.3, 0.6, 0.1]] * len(paths)),
                                      paths_m=paths.repeat(3, 1), covariances_m2=np.float32(covariances.repeat(3, 1))),
            "steps": lambda: replace(found, weights=np.repeat([[[0.2], [0.8]]], windows.steps, 2).repeat(len(paths), 0),
                                     paths_m=paths.repeat(2, 1), covariances_m2=covariances.repeat(2, 1)),
            "unused": lambda: replace(found, weights=np.repeat([[1.0, 0.0]], len(paths), 0),
                                      paths_m=np.concatenate([paths, np.nan * paths], 1),
                                      covariances_m2=np.concatenate([covariances, 0 * covariances], 1)),
            "tenth": lambda: replace(found, weights=0.1 * found.weights),
            "negative": lambda: replace(found, weights=np.repeat([[1.5, -0.5]], len(paths), 0),
                                        paths_m=paths.repeat(2, 1), covariances_m2=covariances.repeat(2, 1)),
            "none": lambda: None,
            "short": lambda: replace(found, paths_m=paths[:, :, :-1]),
            "nan": lambda: replace(found, paths_m=np.nan * paths),
            "flat": lambda: replace(found, covariances_m2=0 * covariances),
            "skew": lambda: replace(found, covariances_m2=covariances + [[0, 9], [-9, 0]]),
            "asymmetric": lambda: replace(found, covariances_m2=covariances + [[1, 0.1], [0, 1]]),
            "far": lambda: replace(found, paths_m=paths + 2e6),
            "few": lambda: [],
            "flag": lambda: replace(found, fallback=np.ones(3)),
            "ragged": lambda: replace(found, weights=[[1.0], [0.5, 0.5]]),
            "raises": lambda: windows.nothing,
        }[self.how]()
"""


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("tenth", ["weights: expected the sum 1, found 0.1 in window 0 (track "]),
        ("negative", ["weights: expected at least 0, found -0.5"]),
        ("none", ["expected a Forecast, found NoneType"]),
        ("short", ["paths_m: expected numbers of shape (", ", 1, 25, 2), found float64 of (", ", 1, 24, 2)"]),
        ("nan", ["paths_m: expected finite numbers within 1e+06 m of the person, found [nan, nan] in window 0"]),
        ("flat", ["covariances_m2: expected positive definite, found [[0.0, 0.0], [0.0, 0.0]]"]),
        ("skew", ["covariances_m2: expected positive definite"]),
        ("asymmetric", ["covariances_m2: expected symmetric"]),
        ("far", ["paths_m: expected finite numbers within 1e+06 m of the person"]),
        ("few", [" predictions, one a window, found 0"]),
        ("flag", ["fallback: expected True or False, found array"]),
        ("ragged", ["weights: expected an array of numbers; ", "inhomogeneous"]),
        ("raises", ["no attribute 'nothing'", 'own.py", line 38', "lambda: windows.nothing"]),
    ],
)
def test_a_wrong_forecast_is_rejected_with_the_method_and_the_window(tmp_path, how, words, capsys):
    (tmp_path / "own.py").write_text(WRONG)
    path = written(tmp_path, methods=[{"name": "own", "method": "own.py:Wrong", "parameters": {"how": how}}])
    assert run([str(path), "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err
    assert all(word in said for word in ["trial 1, four-way, own: ", *words]), said
    assert how == "raises" or "Wrong.predict: " in said


@pytest.mark.parametrize("how", ["single", "steps", "unused"])
def test_a_forecast_in_any_form_that_fits_is_scored(tmp_path, how):
    (tmp_path / "own.py").write_text(WRONG)
    path = written(tmp_path, methods=[{"name": "own", "method": "own.py:Wrong", "parameters": {"how": how}}])
    run_experiment(read_experiment(path), tmp_path / "out")
    assert pd.read_csv(tmp_path / "out/results.csv")["ratio"][0] == pytest.approx(1)


SIZED = """
import numpy as np
from sila.experiments import Method
from sila.experiments.method import constant_fallback


class Sized(Method):
    size, bytes = {size}

    def partial_fit(self, tracks): ...

    def predict(self, windows):
        return constant_fallback(windows)
"""


@pytest.mark.parametrize(
    ("size", "found"),
    [
        ("'big', 8", "size: expected a number, found 'big'"),
        ("1, None", "bytes: expected a number"),
        ("np.nan, 8", "size: expected a finite number, found nan"),
    ],
)
def test_a_size_that_is_no_number_is_rejected_with_the_method(tmp_path, size, found, capsys):
    (tmp_path / "own.py").write_text(SIZED.format(size=size))
    path = written(tmp_path, methods=[{"name": "own", "method": "own.py:Sized"}])
    assert run([str(path), "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err
    assert f"trial 1, four-way, own: Sized.{found}" in said, said


def test_a_size_may_be_a_number_of_numpy(tmp_path):
    (tmp_path / "own.py").write_text(SIZED.format(size="np.int64(7), np.float32(2.5)"))
    path = written(tmp_path, methods=[{"name": "own", "method": "own.py:Sized"}])
    run_experiment(read_experiment(path), tmp_path / "out")
    table = pd.read_csv(tmp_path / "out/results.csv")
    assert (table["size"][0], table["bytes"][0]) == (7, 2.5)


def test_a_batch_whose_tracks_are_too_short_teaches_knn_nothing(tmp_path):
    path = written(tmp_path, methods=["knn"], config={"predict": {"observe_s": 6.0, "horizon_s": 9.0}}, batch=1)
    run_experiment(read_experiment(path), tmp_path / "out")
    assert pd.read_csv(tmp_path / "out/results.csv")["size"].max() > 0  # of the longer ones


def test_cliff_finds_two_streams_one_of_them_across_the_cut():
    random = np.random.default_rng(7)
    west = np.arange(300) % 3 == 0
    direction = np.where(west, np.pi, 0) + 0.15 * random.normal(size=300)
    samples = np.stack(
        [(direction + np.pi) % (2 * np.pi) - np.pi, np.where(west, 0.8, 1.5) + 0.1 * random.normal(size=300)], -1
    )
    weights, means, _ = fit_mixture(samples)
    assert len(weights) == 2
    east = weights.argmax()
    assert weights[east] == pytest.approx(2 / 3, abs=0.01)
    assert means[east] == pytest.approx([0, 1.5], abs=0.05)
    assert abs(means[1 - east][0]) == pytest.approx(np.pi, abs=0.05)


def test_cliff_follows_a_stream_round_a_corner(tmp_path):
    experiment = read_experiment(written(tmp_path, methods=["cliff"]))
    protocol = protocol_of(experiment, runs_of(experiment)[0])
    method: Method = experiment.methods[0].cls(experiment.methods[0].configs[0], beta=0.1)
    method.fit(protocol.training[0])
    windows = protocol.test_sites[0].test.windows(experiment.methods[0].configs[0], 1.6)
    again = [method.predict(windows.without_future()).paths_m for _ in range(2)]
    np.testing.assert_array_equal(*again)
    assert method.size > 10
    assert np.isfinite(again[0]).all()


def test_peers_without_their_code_are_not_run_here(tmp_path, monkeypatch):
    monkeypatch.setenv("PEERS", str(tmp_path))
    methods = [f"{PEERS / 'trajevo.py'}:TrajEvo", f"{PEERS / 'constant_velocity.py'}:ConstantVelocity"]
    entries = [{"name": name, "method": method} for name, method in zip(("trajevo", "cv"), methods)]
    (tmp_path / "trajevo/ctrv").mkdir(parents=True)
    (tmp_path / "trajevo/ctrv/model.py").write_text("import no_such_package\n")
    entries.append({"name": "baseline", "method": methods[0], "parameters": {"baseline": "ctrv"}})
    entries.append({"name": "mdn", "method": f"{PEERS / 'mdn.py'}:Mdn"})
    results = run_experiment(read_experiment(written(tmp_path, methods=["sila", *entries])), tmp_path / "out")
    assert "no base_lstm.py" in results["not_run_here"]["mdn"]
    assert "no zara2.py" in results["not_run_here"]["trajevo"]
    assert "no_such_package" in results["not_run_here"]["baseline"]
    table = pd.read_csv(tmp_path / "out/results.csv").set_index("method")
    assert table.loc["cv", "ade_ratio"] == pytest.approx(1.0, abs=1e-12)
    assert (table["bytes"] > 0).all()


def test_a_method_with_neighbours_runs_in_an_experiment(tmp_path):
    entry = {"name": "social force", "method": f"{PEERS / 'social_force.py'}:SocialForce"}
    run_experiment(read_experiment(written(tmp_path, methods=["sila", entry])), tmp_path / "out")
    table = pd.read_csv(tmp_path / "out/results.csv").set_index("method")
    assert 0.9 < table.loc["social force", "ade_ratio"] < 2


class Straight(Sampler):
    def sample(self, past_m, samples=2):
        steps = np.arange(1, 13)[:, None] * (past_m[:, -1:] - past_m[:, -2:-1])
        return np.repeat((past_m[:, -1:] + steps)[None], samples, axis=0)


def test_a_sampler_in_place_is_scored_on_the_people_held_back(tmp_path):
    frames = np.arange(30)
    rows = [[f"{10 * frame}\t{person}\t{0.4 * frame}\t{person}" for frame in frames] for person in (1, 2)]
    (tmp_path / "two.txt").write_text("\n".join(sum(rows, [])))
    scene = read_scene("two", ["two.txt"], tmp_path, merged("{}", CONFIG))
    chosen = np.flatnonzero([track == scene.track_ids[0] for track in scene.track_ids])
    assert 0 < len(chosen) < len(scene.track_ids)
    found = list(predicted(Straight(), scene, scene.tracks, chosen, seed=1))
    assert np.concatenate([windows for windows, _, _ in found]).tolist() == chosen.tolist()
    for windows, mean, samples in found:
        assert np.allclose(mean, scene.true_m[windows], atol=0.05)
        assert samples.shape == (len(windows), 100, 12, 2)
