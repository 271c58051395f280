"""Scores of the probabilities that people start and stop, in experiments."""

import json

import numpy as np
import pytest

pytest.importorskip("scipy")
from sila.experiments.changes import changes_table, forecasts_of, skill_of
from sila.experiments.program import run


def test_the_skill_is_that_of_the_definition():
    people = [[(0.9, True), (0.2, False)]] * 15 + [[(0.4, True)], [(0.4, False)]] * 5
    found = skill_of(people, 500, 1)
    stated, happened = np.array([forecast for person in people for forecast in person], dtype=float).T
    base = happened.mean() * (1 - happened.mean())
    assert found.skill == pytest.approx(1 - ((stated - happened) ** 2).mean() / base)
    assert (found.windows, found.people, found.rate) == (40, 25, 0.5)
    assert found.low < found.skill < found.high
    # 15 windows of 0.9 that all happened, 15 of 0.2 of which none did, 10 of 0.4 of which half did
    assert found.calibration_error == pytest.approx((15 * 0.1 + 15 * 0.2 + 10 * 0.1) / 40)
    assert skill_of([[(0.5, True)]] * 9 + [[(0.5, False)]] * 100, 500, 1) is None
    assert skill_of([[(0.5, True)]] * 10 + [[(0.5, False)]] * 100, 500, 1) is not None


def test_forecasts_are_of_people_at_the_last_horizon_within_the_limit():
    windows = [
        {"track": "7", "standing": True, "changes": [[0.1, False], [0.2, True], [0.3, True]]},
        {"track": "7#2", "standing": False, "changes": [[0.4, False], [0.5, False], [0.6, True]]},
        {"track": "8", "standing": True, "changes": []},
    ]
    assert forecasts_of(windows, [1, 2, 3]) == {"start": {"7": [(0.2, True)]}, "stop": {"7": [(0.5, False)]}}
    assert forecasts_of(windows, [1, 2, 2.4])["start"] == {"7": [(0.3, True)]}


def test_an_experiment_has_them_in_its_table(tmp_path):
    scene = {"name": "four-way", "simulate": {"tracks": 150, "seed": 3}}
    experiment = {"trials": 1, "test_share": 0.5, "batch": 40, "bootstraps": 100, "scenes": [scene], "methods": ["sila"]}
    (tmp_path / "e.json").write_text(json.dumps(experiment))
    assert run([str(tmp_path / "e.json"), "--out", str(tmp_path / "out"), "--threads", "1"]) == 0
    table = (tmp_path / "out/table.md").read_text()
    assert "## Starting and stopping" in table
    assert "| four-way | walking people stop | sila |" in table
    assert changes_table([], "time", 100, 1) == ""
