"""Experiments: the recorded numbers, resumed runs, rejected files, measures that are right."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("scipy")
import sila
from sila.experiments import Forecast, Method, kernel_forecast, read_experiment, run_experiment, runner
from sila.experiments.curves import growth_table
from sila.experiments.experiment import Overrides
from sila.experiments.measures import NOMINAL, measures_of, modes_of, reliability_of
from sila.experiments.program import run
from sila.experiments.protocol import first_tracks, protocol_of, runs_of
from sila.experiments.tables import compare

GOLDEN = Path(__file__).parent / "golden"
PEERS = Path(__file__).parents[2] / "experiments/peers"
SCENE = {"name": "four-way", "simulate": {"tracks": 75, "occlusions_per_min": 0, "cut_share": 0}}
SMALL = {
    "trials": 1,
    "test_tracks": 10,
    "train_tracks": 30,
    "bootstraps": 200,
    "config": {"profile": "paper"},
    "scenes": [SCENE],
    "methods": ["sila"],
}


def written(folder, **changes):
    path = folder / "e.json"
    path.write_text(json.dumps({**SMALL, **changes}))
    return path


def csv_of(folder, file, changes=None):
    experiment = json.loads(file.read_text()) | (changes or {})
    (folder / "e.json").write_text(json.dumps(experiment))
    assert run([str(folder / "e.json"), "--out", str(folder / "out"), "--threads", "1"]) == 0
    return pd.read_csv(folder / "out/results.csv")


@pytest.mark.parametrize(
    ("golden", "changes"),
    [("experiment.csv", {}), ("experiment_places.csv", {"kind": "places", "orders": 2, "trials": 1})],
)
def test_the_numbers_are_those_recorded(tmp_path, golden, changes):
    expected = pd.read_csv(GOLDEN / golden)
    found = csv_of(tmp_path, GOLDEN / "experiment.json", changes)
    keys = ["place", "method", "trial", "order"]
    expected, found = (table.sort_values(keys, ignore_index=True) for table in (expected, found))
    assert found[keys].values.tolist() == expected[keys].values.tolist()
    for column in expected.columns.difference([*keys, "seconds_per_episode"]):
        np.testing.assert_allclose(found[column], expected[column], rtol=1e-9, atol=1e-12, err_msg=column)


def test_goes_on_where_it_was_interrupted_and_rejects_results_of_another_making(tmp_path, capsys):
    path, out = written(tmp_path, methods=["sila", "knn"], trials=2), tmp_path / "out"
    assert run([str(path), "--out", str(out), "--trials", "1"]) == 0
    kept = (out / "runs/001-four-way-sila.json").read_text()
    (out / "runs/001-four-way-knn.json").unlink()
    assert run([str(path), "--out", str(out)]) == 0
    assert "1 of 4 runs" in capsys.readouterr().err
    assert (out / "runs/001-four-way-sila.json").read_text() == kept
    changed = [str(path), "--out", str(out), "--set", "predict.max_modes=2"]
    assert run(changed) == 1
    assert "--redo" in capsys.readouterr().err
    assert run([*changed, "--redo"]) == 0
    results = json.loads((out / "results.json").read_text())
    assert len(results["curves"]) == 4
    assert results["made_with"]["versions"]["sila"] == sila.__version__
    assert results["made_with"]["revision"] == sila.revision
    assert "| knn |" in (out / "table.md").read_text()


def test_a_damaged_run_is_named_and_made_anew(tmp_path, capsys):
    command = [str(written(tmp_path)), "--out", str(tmp_path / "out")]
    assert run(command) == 0
    kept = next((tmp_path / "out/runs").iterdir())
    whole = kept.read_text()
    for damaged in (whole[:100], "", "[]", json.dumps({"key": json.loads(whole)["key"]}), json.dumps({"key": 3})):
        kept.write_text(damaged)
        assert run(command) == 1
        assert f"the run file {kept} is damaged; delete it or give --redo" in capsys.readouterr().err
    assert run([*command, "--redo"]) == 0
    assert json.loads(kept.read_text())["key"] == json.loads(whole)["key"]


def test_workers_give_the_same_numbers(tmp_path):
    path = written(tmp_path, methods=["sila", "linear"], split="both")
    one, two = tmp_path / "one", tmp_path / "two"
    run_experiment(read_experiment(path, Overrides(seed=7)), one)
    assert run([str(path), "--out", str(two), "--seed", "7", "--workers", "2"]) == 0
    times = ["seconds_per_episode", "us_per_prediction", "training_s"]
    tables = [pd.read_csv(folder / "results.csv").drop(columns=times) for folder in (one, two)]
    pd.testing.assert_frame_equal(*tables, rtol=1e-12)
    assert set(tables[0]["split"]) == {"time", "track"}


def test_figures_are_drawn_as_png(tmp_path):
    assert run([str(written(tmp_path, methods=["linear"])), "--out", str(tmp_path / "out"), "--png"]) == 0
    assert {".svg", ".png"} <= {path.suffix for path in (tmp_path / "out").glob("errors.*")}


def test_energy_is_in_the_table_where_the_machine_tells_it(tmp_path, monkeypatch):
    zone = tmp_path / "intel-rapl:0"
    zone.mkdir()
    (zone / "max_energy_range_uj").write_text("9999999\n")
    (zone / "energy_uj").write_text("9000000\n")
    monkeypatch.setattr(runner, "ENERGY_COUNTERS", tmp_path)
    before = runner.energy_counters()
    (zone / "energy_uj").write_text("500000\n")  # it began again
    assert runner.joules_since(before) == 1.5
    path = written(tmp_path, methods=["linear"])
    assert run([str(path), "--out", str(tmp_path / "with")]) == 0
    assert "training [J]" in (tmp_path / "with" / "table.md").read_text()
    (zone / "energy_uj").unlink()
    assert runner.energy_counters() == []
    assert run([str(path), "--out", str(tmp_path / "without")]) == 0
    assert "training [J]" not in (tmp_path / "without" / "table.md").read_text()


def test_a_split_larger_than_the_data_takes_fewer_if_allowed(tmp_path):
    experiment = read_experiment(written(tmp_path, test_tracks=50, train_tracks=150, take_fewer=True))
    protocol = protocol_of(experiment, runs_of(experiment)[0])
    tracks = len(experiment.scenes[0].tracks)
    assert len(protocol.test_sites[0].test) >= round(tracks / 4)
    assert len(protocol.training[0]) <= tracks - len(protocol.test_sites[0].test)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_people_too_fast_for_a_window_leave_empty_cells(tmp_path):
    scenes = [SCENE, {**SCENE, "name": "fast", "test_speed": 10}]
    path = written(tmp_path, take_fewer=True, scenes=scenes)
    assert run([str(path), "--out", str(tmp_path / "out"), "--threads", "1"]) == 0
    rows = pd.read_csv(tmp_path / "out" / "results.csv").set_index("place")
    assert rows.windows["four-way"] > 0 and rows.windows["fast"] == 0
    assert np.isfinite(rows.ade_ratio["four-way"]) and np.isnan(rows.ade_ratio["fast"])


def test_without_a_scene_the_frame_is_of_the_first_batch_and_the_windows_are_the_same(tmp_path):
    methods = ["sila", {"name": "without a scene", "method": "sila", "scene": False}]
    experiment = read_experiment(written(tmp_path, methods=methods))
    given, made = (protocol_of(experiment, run_) for run_ in runs_of(experiment))
    frames = [tracks.frame(0) for tracks in (given.training[0], made.training[0], made.test_sites[0].test)]
    assert not np.allclose(frames[0].origin_m, frames[1].origin_m)
    np.testing.assert_array_equal(frames[1].origin_m, frames[2].origin_m)
    config, first_batch = experiment.scenes[0].config, given.training[0].take(list(range(20)))
    expected = given.training[0].without_scene(first_batch, config).frame(0)
    np.testing.assert_array_equal(frames[1].origin_m, expected.origin_m)
    windows = [protocol.test_sites[0].test.windows(config, 1.6) for protocol in (given, made)]
    assert windows[0].track_ids == windows[1].track_ids
    np.testing.assert_array_equal(windows[0].future_m, windows[1].future_m)


def test_transfer_learns_elsewhere_and_beside_it_here(tmp_path):
    scenes = [{**SCENE, "name": name, "simulate": {**SCENE["simulate"], "seed": n}} for n, name in enumerate("abc", 1)]
    experiment = read_experiment(written(tmp_path, kind="transfer", scenes=scenes))
    runs = runs_of(experiment)
    assert [run.method for run in runs] == ["sila", "sila here"] * 3
    for run_ in runs:
        protocol = protocol_of(experiment, run_)
        assert len(protocol.training) == (1 if run_.here else 2)
        assert [site.name for site in protocol.test_sites] == [run_.scene]


def test_learning_curves_are_of_the_first_tracks_from_the_beginning(tmp_path):
    ridge = {"name": "ridge", "method": f"{PEERS / 'ridge.py'}:Ridge"}
    path = written(tmp_path, methods=["sila", ridge], tracks=[1, 20, 500])
    assert run([str(path), "--out", str(tmp_path / "out"), "--plots"]) == 0
    found = pd.read_csv(tmp_path / "out/curves.csv").set_index(["method", "tracks"])
    whole = pd.read_csv(tmp_path / "out/results.csv").set_index("method")
    assert found.index.tolist() == [(m, n) for m in ("sila", "ridge") for n in (1, 20, 30)]  # there are no 500
    assert found.loc[("sila", 30), "ratio"] == whole.loc["sila", "ratio"]
    run_experiment(read_experiment(written(tmp_path, methods=["sila", ridge], train_tracks=20)), tmp_path / "few")
    few = pd.read_csv(tmp_path / "few/results.csv").set_index("method")
    for method in ("sila", "ridge"):
        for name in ("ratio", "ade_ratio", "nll"):
            assert found.loc[(method, 20), name] == pytest.approx(few.loc[method, name], rel=1e-9)
    table = (tmp_path / "out/table.md").read_text()
    assert "| place | method | 1 | 20 | 500 | all |" in table
    assert "All: four-way 30 tracks." in table
    assert (tmp_path / "out/curves_four-way.svg").exists()


def test_means_of_learning_curves_have_intervals(tmp_path):
    ridge = {"name": "ridge", "method": f"{PEERS / 'ridge.py'}:Ridge"}
    scenes = [{**SCENE, "name": name, "simulate": {**SCENE["simulate"], "seed": n}} for n, name in enumerate("ab", 1)]
    path = written(tmp_path, methods=["sila", ridge], scenes=scenes, tracks=[10])
    assert run([str(path), "--out", str(tmp_path / "out")]) == 0
    table = (tmp_path / "out/table.md").read_text()
    pairs = table[table.index("## Paired comparisons: weighted MHD") :]
    _, method, against, _, difference, interval, _ = next(
        (cell.strip() for cell in line.split("|")[1:]) for line in pairs.splitlines() if line.startswith("| mean | ridge | sila")
    )
    curve = table[table.index("Means: differences") :]
    row = next(line for line in curve.splitlines() if line.startswith(f"| {method} | {against} |"))
    few, whole = (cell.strip() for cell in row.split("|")[3:5])
    assert whole == f"{difference.strip('*')} ({interval})"
    assert few != whole


def test_a_learning_curve_of_places_goes_on_at_the_next_place(tmp_path):
    scenes = [{**SCENE, "name": name, "simulate": {**SCENE["simulate"], "seed": n}} for n, name in enumerate("ab", 1)]
    path = written(tmp_path, kind="places", scenes=scenes, tracks=[30, 40])
    experiment = read_experiment(path)
    training = protocol_of(experiment, runs_of(experiment)[0]).training
    assert [len(tracks) for tracks in first_tracks(training, 40)] == [30, 10]
    run_experiment(experiment, tmp_path / "out")
    found = pd.read_csv(tmp_path / "out/curves.csv")
    assert found[["tracks", "place"]].values.tolist() == [[n, place] for n in (30, 40, 60) for place in "ab"]


def gaussians(windows, deviation_m, steps=5):
    paths = np.zeros((windows, 1, steps, 2))
    return Forecast(np.ones((windows, 1)), paths, np.tile(deviation_m**2 * np.eye(2), (windows, 1, steps, 1, 1)))


def test_the_size_after_a_share_of_the_episodes_is_known_for_any_number_of_them():
    for episodes in range(2, 60):
        checkpoints = [{"episode": n, "size": n, "tracks": n, "seconds": 1.0} for n in range(1, episodes + 1)]
        table = growth_table([{"scene": "a", "method": "sila", "checkpoints": checkpoints}])
        assert "nan" not in table and f"| {episodes} | 1.00 |" in table


def test_measures_of_a_gaussian_are_those_of_the_textbook():
    truth = np.random.default_rng(1).normal(size=(2000, 5, 2)) * 0.7
    values, _ = measures_of(modes_of(gaussians(2000, 0.7)), truth, [True] * 2000, [""] * 2000)
    assert values["area_68_m2"].mean() == pytest.approx(-2 * np.log(0.32) * np.pi * 0.49, rel=0.01)
    assert values["area_95_m2"].mean() == pytest.approx(-2 * np.log(0.05) * np.pi * 0.49, rel=0.02)
    # E|X - Y| - E|X - X'| / 2 of equal Gaussians in the plane: half of sqrt(pi) sigma
    assert values["energy_score_m"].mean() == pytest.approx(0.5 * np.sqrt(np.pi) * 0.7, rel=0.03)
    narrow, _ = measures_of(modes_of(gaussians(2000, 0.5)), truth, [True] * 2000, [""] * 2000)
    assert narrow["energy_score_m"].mean() > values["energy_score_m"].mean()
    assert narrow["area_68_m2"].mean() < 0.6 * values["area_68_m2"].mean()
    for at_equal_coverage in (values, narrow):  # circles that hold 68 % of the truths, whatever the density says
        area = at_equal_coverage["equal_area_68_m2"].mean()
        assert area == pytest.approx(-2 * np.log(0.32) * np.pi * 0.49, rel=0.05)
    narrowest, _ = measures_of(modes_of(gaussians(2000, 0.2)), truth, [True] * 2000, [""] * 2000)
    assert np.isnan(narrowest["equal_area_95_m2"]).all()  # beyond its samples


def test_a_density_without_error_covers_what_it_says():
    truth = np.random.default_rng(2).normal(size=(40000, 1, 2)) * 0.7
    (found,) = measures_of(modes_of(gaussians(40000, 0.7, 1)), truth, [True] * 40000, [""] * 40000)[1]["people"].values()
    assert np.ravel(found[1]) / 40000 == pytest.approx(NOMINAL, abs=0.007)


@pytest.mark.parametrize("of_each", [1, 50])
def test_the_windows_of_one_person_are_not_independent(of_each):
    truth = np.repeat(np.random.default_rng(1).normal(size=(400, 1, 2)) * 0.7, of_each, 0)
    people = np.repeat(np.arange(400), of_each).astype(str)
    found = measures_of(modes_of(gaussians(len(truth), 0.7, 1)), truth, [True] * len(truth), people)[1]["people"]
    windows, held = (np.array(column) for column in zip(*found.values()))
    reliability = reliability_of(held, windows)
    by_chance = np.sqrt(2 / np.pi) * np.mean([np.sqrt(p * (1 - p) / 400) for p in NOMINAL])
    assert windows.tolist() == [of_each] * 400
    assert reliability.best_average == pytest.approx(1 - by_chance, abs=0.002)
    assert reliability.average == pytest.approx(reliability.best_average, abs=0.015)
    assert reliability.best_least < reliability.best_average
    assert reliability_of(held, 2 * windows).average < 0.8  # a density that holds half as many as it says


def test_the_kernel_of_samples_grows_with_their_spread():
    paths = np.random.default_rng(2).normal(size=(1, 20, 3, 2)) * np.array([1.0, 2.0, 4.0])[:, None]
    forecast = kernel_forecast(np.ones((1, 20)), paths, 0.2)
    assert forecast.weights.sum() == pytest.approx(1.0)
    assert (np.diff(np.linalg.det(forecast.covariances_m2[0, 0])) > 0).all()


def result(method, trial, error, people=30):
    sums = {f"p{p}": {"mhd_m": error * (1 + 0.1 * p), "constant_mhd_m": 1 + 0.1 * p} for p in range(people)}
    return {"split": "time", "method": method, "trial": trial, "order": 0, "places": {"a": {"people": sums}}}


def test_comparisons_find_the_difference_with_an_interval_round_it():
    results = [result("sila", 1, 0.8), result("other", 1, 0.9), result("other", 2, 5.0)]  # trial 2 has no partner
    results[1]["places"]["a"]["people"]["p3"]["mhd_m"] += 1.0
    found = {(c.method, c.against): c for c in compare(results, "sila", 500, 1)}
    assert found["sila", "constant velocity"].difference == pytest.approx(-0.2)
    other = found["other", "sila"]
    assert other.people == 30
    assert other.low == pytest.approx(0.1, abs=1e-9)  # samples without the one person whose error differs
    assert other.low < other.difference < other.high
    assert compare(results, "sila", 500, 1) == compare(results, "sila", 500, 1)


def test_means_are_given_without_the_places_used_for_choices_as_well(tmp_path):
    scenes = [SCENE | {"name": name, "used_for_choices": name == "a"} for name in "abc"]
    path = written(tmp_path, scenes=scenes, methods=["sila", "knn"])
    written_results = run_experiment(read_experiment(path), tmp_path / "out")
    summary = {(s["place"], s["method"]): s["ratio"]["mean"] for s in written_results["summary"]}
    table = (tmp_path / "out/table.md").read_text()
    part = table.split("# Mean over the places not used for choices\n\nWithout a. ")[1].split("\n#")[0]
    assert f"| sila | {(summary['b', 'sila'] + summary['c', 'sila']) / 2:.3f} |" in part
    means = {c["place"]: c for c in written_results["comparisons"] if c["method"] == "knn" and c["against"] == "sila"}
    unused = means["mean of places not used for choices"]
    assert unused["difference"] == pytest.approx((means["b"]["difference"] + means["c"]["difference"]) / 2)
    assert unused["people"] == means["b"]["people"] + means["c"]["people"]


def test_a_clone_at_another_commit_is_refused(tmp_path, monkeypatch):
    from sila.experiments.markdown import made_with

    class Own(Method):
        upstream = "owner/own", "HEAD~0", "own"

    monkeypatch.setenv("PEERS", str(tmp_path))
    assert made_with([Own])["versions"]["owner/own"] == "HEAD~0 (a copy, not checked)"
    git = ["git", "-C", str(tmp_path / "own"), "-c", "user.name=a", "-c", "user.email=a@b"]
    subprocess.run(["git", "init", "--quiet", str(tmp_path / "own")], check=True)
    subprocess.run([*git, "commit", "--quiet", "--allow-empty", "-m", "Begin"], check=True)
    commit = subprocess.run([*git, "rev-parse", "HEAD"], check=True, capture_output=True, text=True).stdout[:7]
    Own.upstream = "owner/own", commit, "own"
    assert made_with([Own])["versions"]["owner/own"] == commit
    Own.upstream = "owner/own", "1234567", "own"
    with pytest.raises(ValueError, match=f"is at {commit}, expected 1234567"):
        made_with([Own])


def test_kernel_density_is_that_of_scipy():
    from scipy.stats import gaussian_kde
    from sila.experiments.field_measures import kde_log_density

    samples = np.random.default_rng(3).normal(size=(1, 50, 1, 2)) * [1.0, 0.3]
    truth = np.array([[[0.4, -0.2]]])
    expected = gaussian_kde(samples[0, :, 0].T).logpdf(truth[0, 0])[0]
    assert kde_log_density(samples, truth)[0, 0] == pytest.approx(expected, abs=1e-6)


def test_collisions_are_found_between_steps():
    from sila.experiments.field_measures import collides

    east = np.stack([np.arange(12.0), np.zeros(12)], -1)
    west = np.stack([11 - np.arange(12.0), np.zeros(12)], -1)  # they meet between two steps
    far = east + [0, 50]

    def of(*paths):
        return collides(np.stack(paths), np.stack(paths)).tolist()

    assert of(east, west, far) == [True, True, False]
    assert of(east, west + [0, 0.5]) == [False, False]
    assert of(east) == [False]  # a person alone has no collision
    assert collides(np.stack([east, far]), np.stack([east, west])).tolist() == [True, False]


def test_trajnet_files_are_as_documented_and_read_by_its_tool(tmp_path):
    from sila.experiments.trajnet import write_trajnet

    seen, true = np.zeros((8, 2)), np.ones((12, 2))
    paths = np.stack([np.stack([true + 0.5, true])])
    truth, predicted = write_trajnet(tmp_path, "a", [("17#2", 30, seen, true)], paths)
    rows = [json.loads(line) for line in predicted.read_text().splitlines()]
    assert rows[0] == {"scene": {"id": 0, "p": 0, "s": 23, "e": 42, "fps": 2.5, "tag": [0, []]}}
    expected = {"f": 31, "p": 0, "x": 1.5, "y": 1.5, "prediction_number": 0, "scene_id": 0}
    assert rows[1] == {"track": expected}
    tools = pytest.importorskip("trajnetplusplustools")  # in the environment of `make peers`
    _, of_truth = tools.Reader(str(truth), scene_type="paths").scene(0)
    _, found = tools.Reader(str(predicted), scene_type="paths").scene(0)
    first = [row for row in found[0] if row.prediction_number == 0]
    assert len(of_truth[0]) == 20
    assert tools.metrics.average_l2(of_truth[0], first) == pytest.approx(0.5 * 2**0.5)
