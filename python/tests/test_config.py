import json
import subprocess

import pytest
import sila
from sila._config import assignments
from sila._program import PROGRAM


def test_defaults_are_those_of_the_program():
    printed = subprocess.run([PROGRAM, "config", "--json"], capture_output=True, text=True, check=True).stdout
    assert sila.config() == json.loads(printed)


def test_every_field_says_its_unit_range_and_meaning():
    by_path = {field.path: field for field in sila.fields()}
    assert by_path["predict.horizon_s"].unit == "s"
    assert all(field.meaning for field in by_path.values())


def test_changes_may_be_nested_dotted_or_a_file(tmp_path):
    (tmp_path / "config.json").write_text('{"predict": {"horizon_s": 3.0}}  // three seconds will do\n')
    for changes in ({"predict": {"horizon_s": 3}}, {"predict.horizon_s": 3.0}, tmp_path / "config.json"):
        assert sila.config(changes)["predict"]["horizon_s"] == 3.0


@pytest.mark.parametrize(
    "of_file",
    [
        {"learn.field.max_pseudo_inputs": 20},
        {"learn.field": {"max_pseudo_inputs": 20}},
        {"learn": {"field.max_pseudo_inputs": 20}},
        {"learn": {"field": {"max_pseudo_inputs": 20}}},
    ],
)
def test_an_assignment_wins_over_a_dotted_or_nested_key_of_the_file(tmp_path, of_file):
    file = tmp_path / "config.json"
    file.write_text(json.dumps({**of_file, "predict.max_modes": 3}))
    changed = sila.config(assignments(file, ["learn.field.max_pseudo_inputs=30", "learn.field.outputs=independent"]))
    assert changed["learn"]["field"]["max_pseudo_inputs"] == 30
    assert changed["learn"]["field"]["outputs"] == "independent"
    assert changed["predict"]["max_modes"] == 3


def test_an_unknown_field_is_rejected_with_the_nearest_known_one():
    with pytest.raises(sila.FormatError, match="predict.horizon_s"):
        sila.config({"predict": {"horizont_s": 3.0}})


def test_a_value_out_of_range_or_of_another_type_is_rejected():
    with pytest.raises(sila.FormatError, match="fuse.similarity_threshold"):
        sila.config({"fuse": {"similarity_threshold": 1.7}})
    with pytest.raises(sila.FormatError, match="predict.max_modes"):
        sila.config({"predict": {"max_modes": "many"}})
    with pytest.raises(sila.FormatError, match="horizon_s"):
        sila.config({"predict": {"horizon_s": float("nan")}})
    with pytest.raises(TypeError, match="config: expected a dictionary or the path of a JSON file, found list"):
        sila.config([1])


def test_a_profile_is_that_of_the_program_and_yields_to_fields_beside_it():
    for name in ("default", "paper", "paper-literal"):
        command = [PROGRAM, "config", "--profile", name, "--json"]
        printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        assert sila.config({"profile": name}) == json.loads(printed)
    beside = sila.config({"profile": "paper", "predict.merge_radius_m": 1.5})["predict"]
    assert beside["merge_radius_m"] == 1.5 and beside["own_deviation"]
    with pytest.raises(sila.FormatError, match="the nearest is paper-literal"):
        sila.config({"profile": "paper-literall"})
