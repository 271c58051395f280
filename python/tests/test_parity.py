"""The program and the package are two doors to one library: the same case gives the same numbers, to the last bit."""

import json
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
import sila
from sila._program import PROGRAM

LEARN = ["--set", "fuse.similarity_threshold=0.6", "--batch", "17"]
CHANGES = {"fuse": {"similarity_threshold": 0.6}}


def program(*arguments):
    run = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout


def unseen_in(folder):
    return folder / "unseen.csv", "--scene", folder / "unseen.scene.json", "--model", folder / "m.sila"


@pytest.fixture(scope="module", params=["acute", "t-junction"])
def case(request, tmp_path_factory):
    """Simulated, learnt and written by the program."""
    folder = tmp_path_factory.mktemp("parity")
    for name, seed, tracks in (("seen", 3, 50), ("unseen", 4, 20)):
        size = ("--tracks", tracks, "--seed", seed)
        program("simulate", "--layout", request.param, *size, "--out", folder / f"{name}.csv")
    scene = folder / "seen.scene.json"
    program("learn", folder / "seen.csv", "--scene", scene, "--model", folder / "m.sila", *LEARN)
    return request.param, folder


def test_simulation(case):
    layout, folder = case
    simulated = sila.simulate(layout=layout, tracks=50, seed=3)
    simulated.reported.save(folder / "ours.csv")
    assert (folder / "ours.csv").read_bytes() == (folder / "seen.csv").read_bytes()
    written = sila.Scene.load(folder / "seen.scene.json")
    assert [simulated.scene.frame(corner=k) for k in range(len(written.corners))] == [
        written.frame(corner=k) for k in range(len(written.corners))
    ]


def test_learning(case):
    layout, folder = case
    simulated = sila.simulate(layout=layout, tracks=50, seed=3)
    theirs = sila.Model.load(folder / "m.sila")
    assert sila.learn(simulated.tracks, scene=simulated.scene, batch=17, config=CHANGES) == theirs
    frame = simulated.reported.to_frame()
    ours = sila.learn(frame, scene=folder / "seen.scene.json", batch=17, config=CHANGES)
    assert ours == theirs
    assert ours.config == theirs.config
    kept = [{key: value for key, value in e.items() if key != "seconds"} for e in ours.history]
    assert kept == [{key: value for key, value in e.items() if key != "seconds"} for e in theirs.history]


def test_prediction(case):
    _, folder = case
    options = ["--every", "1.6", "--horizon", "3.4", "--observe", "2"]
    lines = program("predict", *unseen_in(folder), *options)
    ours = sila.predict(
        sila.Model.load(folder / "m.sila"),
        folder / "unseen.csv",
        scene=folder / "unseen.scene.json",
        stride_s=1.6,
        config={"predict": {"horizon_s": 3.4, "observe_s": 2.0, "min_observe_s": 2.0}},
    )
    assert len(ours) > 10
    assert ours.to_ndjson() == lines


def test_evaluation(case):
    _, folder = case
    printed = json.loads(program("evaluate", *unseen_in(folder), "--json"))
    ours = sila.evaluate(sila.Model.load(folder / "m.sila"), folder / "unseen.csv", scene=folder / "unseen.scene.json")
    assert ours.groups == printed["groups"]
    assert ours.skipped == printed["skipped"]
    assert ours.outcomes == printed["outcomes"] and ours.changes == printed["changes"]


def test_fusion(case):
    _, folder = case
    model = sila.Model.load(folder / "m.sila")
    other = sila.learn(folder / "unseen.csv", scene=folder / "unseen.scene.json")
    other.save(folder / "other.sila")
    program("fuse", folder / "m.sila", folder / "other.sila", "--out", folder / "both.sila")
    ours, theirs = sila.fuse(model, other), sila.Model.load(folder / "both.sila")
    assert ours == theirs
    assert ours.history == theirs.history
    assert ours.config == theirs.config


def test_the_command_that_pip_installs_is_the_program():
    commands = ([PROGRAM], [Path(sysconfig.get_path("scripts")) / "sila"], [sys.executable, "-m", "sila"])
    for arguments, code in ((["--version"], 0), (["inspect", "nowhere.sila"], 1), (["inspekt"], 2)):
        theirs, *ours = (
            subprocess.run([*command, *arguments], capture_output=True, text=True, check=False) for command in commands
        )
        for run in ours:
            assert (run.returncode, run.stdout, run.stderr) == (theirs.returncode, theirs.stdout, theirs.stderr)
        assert theirs.returncode == code
    assert program("--version").split("(")[0] == f"sila {sila.__version__} "
    assert sila.revision in program("--version")
