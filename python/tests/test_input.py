"""Data frames mean what the same text in a file means, files are read by their scene, and mistakes are named."""

import datetime
import io
import json
import pickle
import sys
import warnings

import numpy as np
import pandas
import pytest
import sila
import sila.plot
import sila.ros

WALK = np.column_stack([np.arange(0.0, 12.0, 0.25), np.arange(48) * 0.3, np.arange(48) * -0.1])


def frame(**columns):
    return pandas.DataFrame(WALK, columns=["t", "x", "y"]).assign(**({"track_id": "a"} | columns))


@pytest.fixture
def halves(tmp_path):
    """A file in units of 2 m, and the scene that says so."""
    (tmp_path / "halves.csv").write_text(frame(x=WALK[:, 1] / 2, y=WALK[:, 2] / 2).to_csv(index=False))
    (tmp_path / "scene.json").write_text(
        '{"name": "place", "origin": [0, 0], "axis_1": [1, 0], "axis_2": [0, 1], "sidewalk_width_m": 2,'
        ' "files": [{"path": "halves.csv", "metres_per_unit": 2}]}'
    )
    return tmp_path / "halves.csv", tmp_path / "scene.json"


def test_an_arrow_table_is_read_by_the_names_of_its_columns():
    class Table:
        columns = WALK.T.tolist()
        column_names = ["t", "x", "y", "track_id"]

        def to_pandas(self):
            return frame()

    assert sila.as_tracks(Table()) == sila.as_tracks(frame())


def test_a_path_is_read_by_the_scene_in_every_verb(halves, model):
    path, scene = halves
    tracks = sila.read_tracks(path, scene=scene)
    assert np.allclose(tracks[0].positions_m, WALK[:, 1:])
    assert sila.learn(path, scene=scene) == sila.learn(tracks, scene=scene)
    assert sila.train_batch(path, scene=scene) == sila.train_batch(tracks, scene=scene)
    assert sila.predict(model, path, scene=scene) == sila.predict(model, tracks, scene=scene)
    assert sila.explain(model, path, scene=scene) == sila.explain(model, tracks, scene=scene)
    assert sila.evaluate(model, path, scene=scene) == sila.evaluate(model, tracks, scene=scene)
    fitted = [sila.Predictor(scene).partial_fit(given).model_ for given in (path, tracks)]
    assert fitted[0] == fitted[1]
    drawn = sila.plot.tracks(path, scene=scene).collections[-1].get_segments()
    assert np.concatenate(drawn).max() == pytest.approx(WALK[-1, 1])


def test_what_is_odd_in_a_scene_is_a_warning_once_a_call(halves, model):
    path, scene = halves
    scene.write_text(scene.read_text().replace('"axis_2": [0, 1]', '"axis_2": [0, -1]'))
    given = sila.Scene.load(scene)
    for call in (
        lambda: sila.read_tracks(path, scene=scene),
        lambda: sila.predict(model, path, scene=scene),
        lambda: sila.learn(path, scene=given),
    ):
        with pytest.warns(UserWarning, match="axis_1 and axis_2 are mirrored") as caught:
            call()
        assert [warning.filename for warning in caught] == [__file__]


def test_a_broken_scene_is_an_error_beside_a_data_frame(tmp_path):
    (tmp_path / "scene.json").write_text("{")
    with pytest.raises(sila.FormatError):
        sila.read_tracks(frame(), scene=tmp_path / "scene.json")


@pytest.mark.parametrize("label", [None, np.nan, pandas.NA, "", " person"])
def test_a_row_without_a_class_is_a_pedestrian(label):
    assert sila.as_tracks(frame(label=pandas.Series([label] * 48, dtype=object))).report["rows_kept"] == 48


@pytest.mark.parametrize("missing", [None, np.nan, pandas.NA, "", " "])
def test_rows_without_an_id_are_dropped(missing):
    rows = frame(track_id=pandas.Series([missing] * 3 + ["a"] * 45, dtype=object), label="person")
    tracks = sila.as_tracks(rows)
    assert [track.id for track in tracks] == ["a"]
    assert (tracks.report["rows_read"], tracks.report["rows_kept"]) == (48, 45)
    assert tracks.report["dropped"]["missing_cells"]["rows"] == 3
    with pytest.raises(sila.FormatError, match="dropped rows that have too few columns: 3"):
        sila.as_tracks(rows[:4])


def test_a_masked_or_missing_number_is_not_a_position():
    masked = np.ma.masked_where(np.arange(48)[:, None] == [9, 20, 30], WALK)
    assert sila.as_tracks([masked]).report["dropped"]["not_finite"]["rows"] == 3
    assert sila.as_tracks([frame(x=pandas.Series([pandas.NA, *WALK[1:, 1]], dtype=object))]).report["rows_kept"] == 47
    stream = sila.Stream()
    stream.update(0.0, [("a", pandas.NA, 0.0), ("b", 0.0, 0.0), ("c", *np.ma.masked_less([-1, 1], 0))])
    stream.update(1.0, np.ma.masked_equal([[7, 5, 1], [8, 3, 1]], 5))
    stream.update(2.0, pandas.DataFrame({"id": [1, 2], "x": [pandas.NA, 1], "y": 0}))
    assert stream.counts["detections"] == 3 and stream.counts["rejected"] == {"not_usable": 4}


NOON = pandas.Timestamp("2026-01-02 12:00", tz="UTC")
STAMPS = [NOON + pandas.Timedelta(t, "s") for t in WALK[:, 0]]


@pytest.mark.parametrize(
    "t",
    [
        pandas.Series(STAMPS),
        pandas.Series(STAMPS).dt.tz_localize(None),
        pandas.Series(STAMPS).dt.tz_convert("Europe/Zurich"),
        pandas.Series([stamp.isoformat() for stamp in STAMPS]),
        pandas.Series([stamp.to_pydatetime() for stamp in STAMPS], dtype=object),
    ],
    ids=["dates", "without zone", "zone", "text", "objects"],
)
def test_dates_become_the_seconds_of_a_file(t, tmp_path):
    frame(t=[stamp.isoformat() for stamp in STAMPS]).to_csv(tmp_path / "dates.csv", index=False)
    assert sila.as_tracks(frame(t=t)) == sila.read_tracks(tmp_path / "dates.csv")


@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
def test_unix_times_are_read_in_the_unit_of_their_size_as_in_files(unit, tmp_path):
    table = frame(t=pandas.Series(STAMPS).dt.as_unit(unit).astype("int64"))
    table.to_csv(tmp_path / "unix.csv", index=False)
    assert sila.as_tracks(table) == sila.read_tracks(tmp_path / "unix.csv")


def test_durations_become_seconds_and_missing_ones_are_dropped():
    durations = pandas.Series(pandas.to_timedelta(WALK[:, 0], "s"))
    for t in (durations, durations.astype(object)):
        assert np.array_equal(sila.as_tracks(frame(t=t))[0].times_s, WALK[:, 0])
    assert sila.as_tracks(frame(t=pandas.Series([pandas.NaT, *STAMPS[1:]]))).report["rows_kept"] == 47
    with pytest.raises(ValueError, match="numbers in the columns t, x, y, or dates in t"):
        sila.as_tracks(frame(t="soon"))
    with pytest.raises(ValueError, match="numbers in the columns t, x, y"):
        sila.as_tracks(frame(t=datetime.time(12)))


def test_suspicious_units_are_a_warning_once_a_call(tmp_path, model):
    rows = pandas.concat([frame(track_id=i, x=60 * WALK[:, 1] + i, y=60 * WALK[:, 2]) for i in range(6)])
    rows.to_csv(tmp_path / "pixels.csv", index=False)
    config = {"clean": {"max_speed_mps": 100}}
    for call in (
        lambda: sila.read_tracks(tmp_path / "pixels.csv", config=config),
        lambda: sila.read_tracks(rows, config=config),
        lambda: sila.learn(rows, config=config),
        lambda: sila.predict(model, tmp_path / "pixels.csv", config=config),
    ):
        with pytest.warns(UserWarning, match=r'these look like pixels.*units="pixels"') as caught:
            call()
        assert [warning.filename for warning in caught] == [__file__]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sila.learn(rows, units="pixels")


def test_one_class_may_be_given_as_a_text(tmp_path):
    frame(label="walker 2").to_csv(tmp_path / "t.csv", index=False)
    assert len(sila.read_tracks(tmp_path / "t.csv", person_classes="walker 2")) == 1
    with sila.Stream(person_classes="walker 2") as stream:
        stream.update(0.0, [("a", 0.0, 0.0, "walker 2")])
        assert stream.counts["rejected"] == {}


def test_classes_of_a_data_frame_may_be_named():
    rows = pandas.concat([frame(label=0), frame(label=1, track_id="b")])
    assert [track.id for track in sila.read_tracks(rows, person_classes=[1])] == ["b"]
    assert sila.read_tracks(rows, person_classes=[1]).report["dropped"]["other_label"]["rows"] == 48


@pytest.mark.parametrize("name", ["class", "class_name", "category", "Label"])
def test_a_data_frame_has_its_classes_under_the_names_of_files(name, tmp_path):
    rows = pandas.concat([frame(**{name: "car"}), frame(**{name: "person", "track_id": "b"})])
    rows.to_csv(tmp_path / "t.csv", index=False)
    assert [track.id for track in sila.as_tracks(rows)] == ["b"]
    assert sila.as_tracks(rows) == sila.read_tracks(tmp_path / "t.csv") == sila.as_tracks({"b": rows[48:], "a": rows[:48]})
    assert [track.id for track in sila.read_tracks(rows, person_classes="car")] == ["a"]
    with sila.Stream(person_classes="car") as stream:
        stream.update(0.0, rows[["x", "y", "track_id", name]].iloc[[0, 48]])
        assert stream.counts["rejected"] == {"not_usable": 1}
        with pytest.raises(ValueError, match="person_classes: expected a column of classes, .* found id, x, y"):
            stream.update(1.0, pandas.DataFrame({"id": ["a"], "x": [0.0], "y": [0.0]}))
    with pytest.raises(ValueError, match="person_classes: expected a column of classes, .* found t, x, y, track_id"):
        sila.read_tracks(frame(), person_classes="car")


def test_frames_in_a_dictionary_or_a_list_are_read_by_their_columns():
    rows = pandas.concat([frame(), frame(track_id="b", label="car"), frame(track_id="c")])
    shuffled = {key: group[["y", "label", "x", "t"]] for key, group in rows.groupby("track_id")}
    assert sila.as_tracks(shuffled) == sila.as_tracks(rows) == sila.as_tracks(dict(list(rows.groupby("track_id"))))
    assert sila.as_tracks([frame(), WALK]) == sila.as_tracks([WALK, WALK])
    with pytest.raises(ValueError, match="columns t, x, y; t missing in x, y"):
        sila.as_tracks([frame()[["x", "y"]]])


def test_blanks_around_an_id_do_not_make_another_person(tmp_path):
    rows = frame(track_id=[" a", "a", "a ", "a"] * 12)
    rows.to_csv(tmp_path / "t.csv", index=False)
    assert sila.as_tracks(rows) == sila.read_tracks(tmp_path / "t.csv") and len(sila.as_tracks(rows)) == 1


def test_one_row_is_said_as_the_program_says_it():
    dropped = "dropped rows that are not finite: 1; dropped rows that stand alone .*: 2"
    with pytest.raises(sila.FormatError, match="at least one track of two samples, found " + dropped):
        sila.as_tracks({"a": [[0.0, 0.0, 0.0], [1.0, np.nan, 1.0]], "b": [[0.0, 0.0, 0.0]]})


MISTAKES = {
    "no ids": (
        sila.FormatError,
        r"data frame: expected rows with an id \(track_id\), found none in 48 rows",
        lambda model: sila.as_tracks(frame(track_id=None)),
    ),
    "a column twice": (
        ValueError,
        "tracks: expected columns of different names, found x twice",
        lambda model: sila.as_tracks(pandas.concat([frame(), frame()[["x"]]], axis=1)),
    ),
    "open file": (TypeError, "path of a file, found an open file", lambda model: sila.learn(io.StringIO("track_id,t,x,y"))),
    "open file to read": (TypeError, "an open file .StringIO.", lambda model: sila.read_tracks(io.StringIO("t"))),
    "scene without files": (ValueError, "found neither", lambda model: sila.read_tracks(scene=sila.Scene.of_model(model))),
    "no prediction": (TypeError, "expected sila.Prediction, found int", lambda model: sila.Predictions([1])),
    "no model to draw": (TypeError, "model: .* found list", lambda model: sila.plot.learning_curve([])),
    "batch": (ValueError, "batch: .* from 1 to 2147483647", lambda model: sila.learn({"a": WALK}, batch=10**30)),
    "threads": (ValueError, "threads .* from 0 to 2147483647", lambda model: sila.learn({"a": WALK}, threads=10**12)),
    "large seed": (ValueError, "seed: .* found 1180591620", lambda model: sila.split_tracks({"a": WALK}, seed=2**70)),
    "no split": (ValueError, 'split_tracks: by = "None"', lambda model: sila.split_tracks({"a": WALK}, by=None)),
    "no Unicode": (ValueError, r"expected valid Unicode, found 'a\\ud800'", lambda model: sila.as_tracks({"a\ud800": WALK})),
    "two keys of one text": (
        ValueError,
        "tracks: expected keys of different text, found 1 and '1'",
        lambda model: sila.as_tracks({1: WALK, "1": WALK + [0, 9, 9]}),
    ),
    "a file twice": (
        ValueError,
        "paths: expected each file once, found ./t.csv twice",
        lambda model: sila.learn(["t.csv", "./t.csv"]),
    ),
    "number as paths": (TypeError, "paths: .* found int", lambda model: sila.read_tracks(5)),
    "number in paths": (TypeError, "paths: .* found int", lambda model: sila.read_tracks(["a", 5])),
    "model, not a list": (TypeError, "models: expected a list", lambda model: sila.make_prior(model)),
    "no models": (ValueError, "models: expected at least one", lambda model: sila.make_prior([])),
    "no stride": (TypeError, "stride_s: expected seconds", lambda model: sila.predict(model, {}, stride_s=None)),
    "text as stride": (TypeError, "stride_s: expected seconds", lambda model: sila.explain(model, {}, stride_s="1")),
    "one track to split": (ValueError, "found 1 to learn from and 0 held back of 1", lambda model: split_one()),
    "scale of a model in metres": (
        ValueError,
        "metres_per_pixel = 0.02, but the model was learnt in metres",
        lambda model: sila.predict(model, {"a": WALK}, config={"metres_per_pixel": 0.02}),
    ),
    "scale of a stream in metres": (
        ValueError,
        "metres_per_pixel = 0.02, but the model was learnt in metres",
        lambda model: sila.Stream(model, config={"metres_per_pixel": 0.02}),
    ),
    "seed": (ValueError, "seed: expected a whole .* found 1.5", lambda model: sila.split_tracks({"a": WALK}, seed=1.5)),
    "share": (TypeError, "test_share: .* found '1'", lambda model: sila.split_tracks({"a": WALK}, test_share="1")),
    "format": (ValueError, 'format = "3" is not one of csv', lambda model: sila.read_tracks("t.csv", format=3)),
    "unit": (TypeError, "metres_per_unit: .* '2'", lambda model: sila.read_tracks("t.csv", metres_per_unit="2")),
    "rate": (TypeError, "frames_per_second: .* '2'", lambda model: sila.predict(model, "t.csv", frames_per_second="2")),
    "camera": (TypeError, "camera: .* found {}", lambda model: sila.read_tracks("t.csv", camera={})),
    "camera of a stream": (TypeError, "camera: .* found True", lambda model: sila.Stream(camera=True)),
    "classes": (TypeError, "person_classes: .* 0.5", lambda model: sila.read_tracks("t.csv", person_classes=0.5)),
    "flag": (TypeError, "at_end: .* 'no'", lambda model: sila.predict(model, {"a": WALK}, at_end="no")),
    "flag of explain": (TypeError, "at_end: .* 'no'", lambda model: sila.explain(model, {"a": WALK}, at_end="no")),
    "no detections": (TypeError, r"detections: .* found \[1, 2\]", lambda model: sila.Stream().update(0.0, [1, 2])),
    "no positions": (TypeError, "detections: .* found {1: 3}", lambda model: sila.Stream().update(0.0, {1: 3})),
    "no configuration": (TypeError, "config: .* found {1}", lambda model: sila.config({"predict.horizon_s": {1}})),
    "coverage": (ValueError, "coverage: .* found 'a'", lambda model: draw(model, coverage="a")),
    "interval": (ValueError, "interval_s = 0.1, but the model began with 0.2; keep it", lambda model: at_100_ms(model)),
    "text in a table": (ValueError, "could not convert string to float: 'n/a'$", lambda model: sila.as_tracks(frame(x="n/a"))),
    "text as a date": (ValueError, "dates in t; .* ISO8601 format.$", lambda model: sila.as_tracks(frame(t="soon"))),
    "milliseconds": (
        sila.FormatError,
        "stand alone .*: 96; .* 250 s apart; are the stamps frames or milliseconds",
        lambda model: sila.as_tracks({name: WALK * [1000, 1, 1] for name in "ab"}),
    ),
    "tables in a list": (
        ValueError,
        r"tracks\[0\]: expected one track, found several track_id",
        lambda model: sila.as_tracks([frame(track_id=range(48))]),
    ),
    "path without numbers": (
        ValueError,
        "path_m: expected finite numbers, found another in row 1",
        lambda model: sila.predict(model, {"a": WALK})[0].nonconformity_scores([[0, 0], [np.nan, 0]]),
    ),
}


def split_one():
    return sila.split_tracks({"a": WALK}, by="track")


def draw(model, **options):
    return sila.plot.predictions(sila.predict(model, {"a": WALK}), **options)


def at_100_ms(model):
    return sila.predict(model, {"a": WALK}, config={"sampling.interval_s": 0.1})


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_frequent_mistake_is_named(mistake, model):
    error, words, call = MISTAKES[mistake]
    with pytest.raises(error, match=words):
        call(model)


def test_whole_numbers_of_numpy_are_whole_numbers(model):
    assert sila.learn({"a": WALK}, batch=np.int64(20), threads=np.int32(1)) == sila.learn({"a": WALK})
    found = sila.predict(model, {7: WALK})
    assert len(found) > 0 and found.of(7) == found.of(np.int64(7)) == found.of("7") == found


def test_a_missing_extra_is_named(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(ImportError, match=r"sila.ros needs rosbags.*: pip install 'sila\[ros\]'"):
        sila.ros.tracked_topics(tmp_path)


def test_a_flag_of_numpy_is_a_flag(model):
    assert sila.predict(model, {7: WALK}, at_end=np.bool_(True)) == sila.predict(model, {7: WALK}, at_end=True)


def test_an_evaluation_without_windows_has_no_errors(model):
    found = sila.evaluate(model, {"a": WALK})
    rows = found.to_frame().set_index("group")
    assert rows.loc["standing", "windows"].eq(0).all() and rows.loc["standing", "ade_m"].isna().all()
    assert rows.loc["moving", "ade_m"].notna().all() and "coverage" not in rows
    last = rows[rows["predictor"] == "model"].loc["moving", "coverage_90"].iloc[-1]
    assert found.metric("coverage_90") == last
    with pytest.raises(ValueError, match="name: expected one of weighted_mhd_m, .*coverage_90, found coverage$"):
        found.metric("coverage")


def test_mistakes_name_the_argument_and_ids_may_be_whole_numbers():
    path = [[0, 0], [1, 1]]
    assert sila.Track(7, [0, 1], path).id == "7" and sila.Track(np.int64(7), [0, 1], path).id == "7"
    for id in (True, 1.5):
        with pytest.raises(TypeError, match="id: expected a text or a whole number"):
            sila.Track(id, [0, 1], path)
    with pytest.raises(ValueError, match=r"id: expected valid Unicode, found 'a\\ud800'"):
        sila.Track("a\ud800", [0, 1], path)
    with pytest.raises(ValueError, match=r"b: expected finite numbers, found another in row 1"):
        sila.modified_hausdorff_m(path, [[0, 0], [np.nan, 1]])
    for call in (sila.Model().save, sila.Model.load):
        with pytest.raises(ValueError, match="expected a file name, found an empty text"):
            call("")


def test_a_copied_scene_keeps_its_camera_and_the_classes_of_its_files(tmp_path):
    homography = [[0.02, 0, 0], [0, 0.02, 0], [0, 0, 1]]
    scene = {"origin": [0, 0], "axis_1": [1, 0], "axis_2": [0, 1], "sidewalk_width_m": 2, "name": "c"}
    file = {"path": "t.csv", "person_classes": ["walker"]}
    (tmp_path / "s.json").write_text(json.dumps({**scene, "camera": {"homography": homography}, "files": [file]}))
    rows = "".join(f"a,{0.1 * i},{100 + 5 * i},200,walker\n" for i in range(60))
    (tmp_path / "t.csv").write_text("track_id,t,x,y,label\n" + rows)
    with_camera = sila.Scene.load(tmp_path / "s.json")
    copied = pickle.loads(pickle.dumps(with_camera))
    assert copied == with_camera
    assert sila.read_tracks(scene=copied) == sila.read_tracks(scene=with_camera)
    assert len(sila.read_tracks(scene=copied)) == 1
    (tmp_path / "n.json").write_text(json.dumps({**scene, "files": [file]}))
    assert sila.Scene.load(tmp_path / "n.json") != with_camera
