"""Experiment files: what they may say, and mistakes in them, in one sentence each."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("scipy")
import sila
from sila.experiments import field, read_experiment
from sila.experiments.program import run
from sila.experiments.protocol import protocol_of, runs_of
from test_experiments import SMALL, written


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"trails": 3}, ["trails", "trials"]),
        ({"methods": [{"method": "sila", "confg": {}}]}, ["confg", "config"]),
        ({"methods": [{"method": "knn", "parameters": {"neighbour": 3}}]}, ["neighbour", "neighbours"]),
        ({"test_tracks": 100}, ["'four-way'", "75 tracks"]),
        ({"methods": [{"method": "sila", "config": {"predict": {"horizon_s": 3}}}]}, ["horizon_s"]),
        ({"scenes": []}, ["scenes"]),
        ({"scenes": [{"name": "a", "scene": "none.json"}]}, ["none.json"]),
        ({"kind": "transfer"}, ["at least two"]),
        ({"kind": "transfer", "methods": [{"method": "sila", "scene": False}]}, ["without a scene", "one_place"]),
        ({"methods": [{"method": "sila", "scene": "none"}]}, ["scene as true or false"]),
        ({"trials": 0}, ["trials", "1 to 10000"]),
        ({"split": "tracks"}, ["track"]),
        ({"tracks": [20, 10]}, ["tracks", "growing", "[20, 10]"]),
        ({"tracks": [-1, 10]}, ["tracks", "from 0"]),
        ({"tracks": 10}, ["tracks", "list"]),
        ({"scenes": [{"name": "a", "simulate": {}, "used_for_choices": 1}]}, ["used_for_choices as true or false"]),
        ({"scenes": [{"name": "all", "simulate": {}}]}, ["scene 1 with another name", '"all"']),
        ({"methods": ["sila", {"method": "sila", "name": "si/la"}, {"method": "sila", "name": "si la"}]}, ["si_la", "twice"]),
        ({"split": "both", "methods": [{"method": "sila", "name": n} for n in ("a", "a-track")]}, ["a-track.json", "twice"]),
        ({"tracks": [10], "every_episode": True}, ["tracks", "every_episode"]),
    ],
)
def test_what_is_no_experiment_is_rejected(tmp_path, changes, words, capsys):
    assert run([str(written(tmp_path, **changes)), "--out", str(tmp_path / "out")]) in (1, 2)
    said = capsys.readouterr().err
    assert all(word in said for word in words), said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (["--threads", "-1"], "--threads: expected at least 0, found -1"),
        (["--workers", "0"], "--workers: expected at least 1, found 0"),
        (["--trials", "0"], "--trials: expected 1 to 10000, found 0"),
        (["--seed", "-1"], "--seed: expected 0 to 9e+15, found -1"),
    ],
)
def test_a_number_outside_its_range_is_a_wrong_command_line(tmp_path, option, said, capsys):
    assert run([str(written(tmp_path)), "--out", str(tmp_path / "out"), *option]) == 2
    assert capsys.readouterr().err == f"sila: {said}\n"


@pytest.mark.parametrize("option", [["--trials", "1"], ["--json"], ["--workers", "2"]])
def test_an_option_without_effect_on_the_field_protocol_is_rejected(tmp_path, option, capsys):
    path = written(tmp_path, kind="field")
    assert run([str(path), "--out", str(tmp_path / "out"), *option]) == 2
    assert f"{option[0]}: has no effect" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"scenes": [{"name": "a"}]}, ["scene 1", '"files"']),
        ({"scenes": [{"name": "a", "scene": "x.json"}]}, ["scene 1", "scene", "files"]),
        ({"methods": [{"name": "sila", "method": "sila"}]}, ["method 1", '"learnt"']),
        ({"methods": ["sila"]}, ["method 1 to be an object"]),
        ({"methods": 2 * [{"name": "sila", "method": "sila", "learnt": "in_place"}]}, ["'sila, in_place' twice"]),
        ({"reference": "sila"}, ["a known key", '"reference"']),
        (
            {
                "methods": [{"name": "sila", "method": "sila", "learnt": "elsewhere"}],
                "scenes": [{"name": "a", "files": ["a.txt"]}],
            },
            ["a second scene"],
        ),
        ({"seed": "x"}, ["seed of type int", '"x"']),
        ({"bootstraps": 0}, ["bootstraps from 100"]),
        ({"config": {"predict": {"horizon_s": 3}}}, ["config to leave", "predict.horizon_s"]),
        ({"kind": "fields"}, ["one_place, places, transfer, field"]),
    ],
)
def test_mistakes_in_files_of_the_field_protocol_are_one_sentence(tmp_path, changes, words, capsys):
    path = tmp_path / "e.json"
    methods = [{"name": "sila", "method": "sila", "learnt": "in_place"}]
    path.write_text(json.dumps({"kind": "field", "methods": methods, "scenes": [], **changes}))
    assert run([str(path), "--out", str(tmp_path / "out"), "--data-dir", str(tmp_path)]) == 1
    said = capsys.readouterr().err
    assert all(word in said for word in words) and len(said.splitlines()) == 1, said


def test_a_method_of_the_field_protocol_that_cannot_run_is_named_with_the_reason(tmp_path, capsys):
    (tmp_path / "gone.py").write_text("import no_such_package\n")
    entry = {"name": "gone", "method": "gone.py:Gone", "learnt": "in_place"}
    (tmp_path / "e.json").write_text(json.dumps({"kind": "field", "methods": [entry], "scenes": []}))
    with pytest.raises(sila.FormatError, match="scenes"):
        field.read_field(str(tmp_path / "e.json"), str(tmp_path))
    assert capsys.readouterr().err == "gone: not run here: No module named 'no_such_package'\n"


METHOD_FILES = {
    "broken.py": "class Broken(:\n",
    "unfinished.py": "from sila.experiments import Method\n\n\nclass Own(Method):\n    {}\n",
    "gone.py": "import no_such_package\n",
    "raises.py": "import beside_raises\n\nprint(beside_raises.VALUES[3])\n",
    "beside_raises.py": "VALUES = []\n",
    "typo.py": "from sila.experiments import Forcast\n",
    "module.py": "import sila.experimnts\n",
    "relative.py": "from .beside_raises import VALUES\n",
    "weights.py": "import numpy as np\n\nWEIGHTS = np.load('none.npz')\n",
    "format.py": "import sila\n\nSCENE = sila.Scene.load('none.json')\n",
    "require.py": "from sila.experiments import Method\n\n\nclass Own(Method):\n"
    "    def partial_fit(self, tracks): ...\n    def predict(self, windows): ...\n\n"
    "    @classmethod\n    def require(cls, parameters):\n        {}\n",
}
PREDICTS = "def predict(self, windows): ..."


@pytest.mark.parametrize(
    ("methods", "body", "words"),
    [
        (["none.py:Own"], "", ["none.py", "a Python file with the class Own", "no such file"]),
        (["broken.py:Broken"], "", ["broken.py:1", "expected Python"]),
        (["unfinished.py:Own"], "pass", ["Own", "define predict"]),
        (["unfinished.py:Own"], PREDICTS, ["Own", "define partial_fit (fit is used with at_once = True)"]),
        (["unfinished.py:Own"], f"at_once = True\n    {PREDICTS}", ["define fit"]),
        (["raises.py:Own"], "", ["raises.py", "a module that can be imported", "IndexError: list index out of range"]),
        (["typo.py:Own"], "", ["typo.py", "ImportError: cannot import name 'Forcast' from 'sila.experiments'"]),
        (["module.py:Own"], "", ["module.py", "ModuleNotFoundError: No module named 'sila.experimnts'"]),
        (["relative.py:Own"], "", ["relative.py", "ImportError: attempted relative import"]),
        (["weights.py:Own"], "", ["weights.py", "FileNotFoundError: ", "none.npz"]),
        (["format.py:Own"], "", ["format.py", "none.json"]),
        (["require.py:Own"], "open('none.npz')", ["require.py", "FileNotFoundError: ", "none.npz"]),
        (["require.py:Own"], "from sila import Modell", ["require.py", "cannot import name 'Modell'"]),
        (["silo"], "", ["silo", "sila"]),
        (["sila", "sila"], "", ["'sila' twice"]),
        ([{"method": "sila", "name": 3}], "", ["method 1", 'a text "name"', "found 3"]),
        ([{"method": "sila", "thresholds": [0.5, "x"]}], "", ["e.json", "method 1, thresholds", "a number", '"x"']),
        ([{"method": "sila", "thresholds": [None]}], "", ["method 1, thresholds", "null"]),
        ([{"method": "sila", "config": {"predict": 3}}], "", ["e.json", "method 1, config", "found 3"]),
        (None, "", ['"methods"', "no such key"]),
    ],
)
def test_mistakes_in_methods_are_found_before_scenes_are_read(tmp_path, methods, body, words, capsys):
    for name, text in METHOD_FILES.items():
        (tmp_path / name).write_text(text.format(body))
    path = written(tmp_path, methods=methods)
    if methods is None:
        path.write_text(json.dumps({key: value for key, value in SMALL.items() if key != "methods"}))
    assert run([str(path), "--out", str(tmp_path / "out")]) in (1, 2)
    said = capsys.readouterr().err
    assert all(word in said for word in words) and "reading" not in said, said
    assert len(said.splitlines()) == 1 and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"reference": "knn"}, ["reference", "sila", '"knn"']),
        ({"scenes": [SMALL["scenes"][0]] * 2}, ["'four-way' twice"]),
        ({"scenes": [*SMALL["scenes"], {"name": "b", "simulate": {"tracks": -1}}]}, ["e.json", "scene 2", "simulate.tracks"]),
        ({"config": {"predict": 3}}, ["e.json", "config: predict to be an object"]),
    ],
)
def test_mistakes_in_names_are_found_before_scenes_are_read(tmp_path, changes, words, capsys):
    assert run([str(written(tmp_path, **changes)), "--out", str(tmp_path / "out")]) in (1, 2)
    said = capsys.readouterr().err
    assert all(word in said for word in words) and "reading" not in said, said


def test_code_that_a_method_requires_may_be_missing(tmp_path):
    (tmp_path / "require.py").write_text(METHOD_FILES["require.py"].format("raise ImportError('needs a GPU')"))
    methods = read_experiment(written(tmp_path, methods=["sila", "require.py:Own"])).methods
    assert [(method.cls is None, method.missing) for method in methods] == [(False, ""), (True, "needs a GPU")]


def test_other_mistakes_are_one_sentence(tmp_path, capsys):
    (tmp_path / "gone.py").write_text(METHOD_FILES["gone.py"])
    (tmp_path / "list.json").write_text("[]")
    gone = written(tmp_path, methods=["gone.py:Gone"])
    assert run([str(gone), "--out", str(gone)]) == 1
    assert capsys.readouterr().err == f"sila: {gone}: expected a folder for the results (--out), found a file\n"
    for file, words in (
        (tmp_path / "list.json", "the experiment to be an object, found []"),
        (gone, "expected a method that can run here, found none (gone.py:Gone: No module named 'no_such_package')"),
    ):
        assert run([str(file), "--out", str(tmp_path / "out")]) == 1
        assert words in capsys.readouterr().err
        assert not (tmp_path / "out").exists()


def test_noise_is_added_to_a_recorded_scene_the_same_each_time(tmp_path):
    t = np.arange(0, 40, 0.2)
    walk = [sila.Track(str(i), t + 50 * i, np.c_[1.2 * t, 0.5 * i + 0 * t]) for i in range(8)]
    rows = "".join(f"{a.id},{s},{x},{y}\n" for a in walk for s, (x, y) in zip(a.times_s, a.positions_m))
    (tmp_path / "t.csv").write_text("track_id,t,x,y\n" + rows)
    scene = {"origin": [0, 0], "axis_1": [1, 0], "axis_2": [0, 1], "sidewalk_width_m": 3, "files": [{"path": "t.csv"}]}
    (tmp_path / "s.json").write_text(json.dumps(scene))
    read = {}
    for noise in (0, 0.1, 0.1):
        file = written(tmp_path, take_fewer=True, scenes=[{"name": "s", "scene": "s.json", "noise_m": noise}])
        read.setdefault(noise, []).append(read_experiment(file).scenes[0].tracks_hash)
    assert len(set(read[0.1])) == 1 and read[0.1][0] != read[0][0]
    with pytest.raises(sila.FormatError, match="noise_m as a number"):
        read_experiment(written(tmp_path, scenes=[{"name": "s", "scene": "s.json", "noise_m": -1}]))


def test_people_held_back_can_be_faster_than_recorded(tmp_path):
    read, speeds = {}, {}
    for speed in (1, 2):
        scene = {"name": "s", "simulate": {"tracks": 40, "seed": 1}, "test_speed": speed}
        experiment = read_experiment(written(tmp_path, take_fewer=True, scenes=[scene]))
        read[speed] = experiment.scenes[0].tracks_hash
        speeds[speed] = protocol_of(experiment, runs_of(experiment)[0])
    assert read[1] != read[2]
    assert speeds[1].training[0].hash == speeds[2].training[0].hash
    recorded, faster = (speeds[speed].test_sites[0] for speed in (1, 2))
    np.testing.assert_allclose(faster.test.durations_s, np.array(recorded.test.durations_s) / 2)
    np.testing.assert_allclose(faster.present.durations_s, np.array(recorded.present.durations_s) / 2)
    with pytest.raises(sila.FormatError, match="test_speed as a number from 1 to 10"):
        read_experiment(written(tmp_path, scenes=[{"name": "s", "simulate": {}, "test_speed": 0.5}]))


def test_a_changed_method_makes_runs_of_the_field_anew(tmp_path, monkeypatch):
    entry = {"name": "m", "method": "m.py:M", "learnt": "in_place", "parameters": {}, "config": "{}", "cls": object}
    scene, made = SimpleNamespace(name="a", tracks=SimpleNamespace(hash="h")), []
    monkeypatch.setattr(field, "read_field", lambda *_: (field.Settings(), [scene], [entry]))
    monkeypatch.setattr(field, "do_field", lambda *_: made.append(1) or {"people": []})
    monkeypatch.setattr(field, "markdown", lambda *_: "")
    for text, count in (("1", 1), ("1", 1), ("2", 2)):
        (tmp_path / "m.py").write_text(text)
        field.run_field(str(tmp_path / "f.json"), str(tmp_path / "out"), None)
        assert len(made) == count
