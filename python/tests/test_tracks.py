import copy
import gzip
import json
import pickle
import warnings

import numpy as np
import pandas
import pytest
import sila

WALK = np.column_stack([np.arange(0.0, 3.0, 0.25), np.arange(12) * 0.3, np.arange(12) * -0.1])  # (12, 3)


def same(a, b):
    return len(a) == len(b) and all(
        np.array_equal(p.times_s, q.times_s) and np.array_equal(p.positions_m, q.positions_m)
        for p, q in zip(a, b, strict=True)
    )


def test_arrays_have_the_shapes_that_were_given():
    track = sila.Track("7", WALK[:, 0], WALK[:, 1:])
    assert track.times_s.shape == (12,)
    assert track.positions_m.shape == (12, 2)
    assert np.array_equal(track.positions_m, WALK[:, 1:])
    assert repr(track) == "Track('7', 12 samples, 2.8 s)"


def test_arrays_of_a_track_are_views_that_cannot_be_written_and_outlive_it():
    track = sila.Track("7", WALK[:, 0], WALK[:, 1:])
    positions = track.positions_m
    with pytest.raises(ValueError, match="read-only"):
        positions[0, 0] = 1.0
    del track
    assert np.array_equal(positions, WALK[:, 1:])


def test_a_column_major_slice_is_read_by_its_meaning_and_not_by_its_memory():
    wide = np.asfortranarray(np.hstack([WALK, WALK]))
    assert same([sila.Track("7", wide[:, 0], wide[:, 1:3])], [sila.Track("7", WALK[:, 0], WALK[:, 1:])])


def test_a_wrong_shape_is_rejected_with_the_argument_and_both_shapes():
    with pytest.raises(ValueError, match=r"positions_m: expected shape \(n, 2\), found shape \(12, 3\)"):
        sila.Track("7", WALK[:, 0], WALK)
    with pytest.raises(ValueError, match=r"times_s: expected shape \(n,\), found shape \(12, 1\)"):
        sila.Track("7", WALK[:, :1], WALK[:, 1:])
    with pytest.raises(ValueError, match=r"tracks\['a'\]: expected shape \(n, 3\) .* found \(12, 2\)"):
        sila.as_tracks({"a": WALK[:, :2]})
    with pytest.raises(ValueError, match=r"a list or a dictionary .* found one array .* \(12, 3\); put it in a list"):
        sila.as_tracks(WALK)
    with pytest.raises(ValueError, match=r"positions_m: expected numbers of shape \(n, 2\), found str"):
        sila.Track("7", WALK[:, 0], "here")


def test_durations_are_no_seconds_and_masked_numbers_are_missing():
    with pytest.raises(ValueError, match=r"times_s: expected numbers of shape \(n,\), found dates or durations"):
        sila.Track("a", np.arange(3).astype("timedelta64[ms]"), np.zeros((3, 2)))
    masked = np.ma.masked_array([[0, 0], [1, 0], [2, 0]], mask=[[0, 0], [1, 0], [0, 0]])
    with pytest.raises(ValueError, match="finite"):
        sila.Track("a", [0, 1, 2], masked)


def test_times_that_do_not_increase_are_rejected_by_name():
    with pytest.raises(ValueError, match="7"):
        sila.Track("7", WALK[::-1, 0], WALK[:, 1:])


def test_frames_dictionaries_and_files_give_the_same_tracks(tmp_path):
    arrays = {"a": WALK, "b": WALK + [0.5, 3.0, 1.0]}
    rows = pandas.DataFrame(np.concatenate(list(arrays.values())), columns=["t", "x", "y"])
    rows["track_id"] = np.repeat(list(arrays), 12)
    from_dict, from_frame = sila.as_tracks(arrays), sila.as_tracks(rows.sample(frac=1.0, random_state=1))
    from_dict.save(tmp_path / "walks.csv")
    from_file = sila.read_tracks(tmp_path / "walks.csv")
    (tmp_path / "walks.csv.gz").write_bytes(gzip.compress((tmp_path / "walks.csv").read_bytes()))
    assert [track.id for track in from_dict] == ["a", "b"]
    for other in (
        from_frame,
        from_file,
        sila.as_tracks(tmp_path / "walks.csv.gz"),
        sila.as_tracks([tmp_path / "walks.csv"]),
    ):
        assert same(other, from_dict)
        assert [track.input_id for track in other] == ["a", "b"]


def test_whole_numbers_in_a_float_column_are_the_ids_of_the_file():
    rows = pandas.DataFrame(WALK, columns=["t", "x", "y"]).assign(track_id=17.0)
    assert [track.id for track in sila.as_tracks(rows)] == ["17"]


def test_a_frame_without_a_column_is_rejected_by_its_name():
    with pytest.raises(ValueError, match="t missing in track_id, x, y"):
        sila.as_tracks(pandas.DataFrame({"track_id": [1], "x": [0.0], "y": [0.0]}))


def test_read_tracks_takes_a_data_frame_and_no_options_of_files():
    rows = pandas.DataFrame(WALK, columns=["t", "x", "y"]).assign(track_id="a")
    assert same(sila.read_tracks(rows), sila.as_tracks(rows))
    with pytest.raises(ValueError, match="t missing in time, x, y, track_id"):
        sila.read_tracks(rows.rename(columns={"t": "time"}))
    with pytest.raises(ValueError, match="frames_per_second: for files"):
        sila.read_tracks(rows, frames_per_second=10.0)


def test_boxes_become_metres_through_a_camera(tmp_path):
    camera = tmp_path / "camera.json"
    camera.write_text('{"homography": [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 1]]}')
    rows = "".join(f"{i},1,{100 + 2 * i},50,20,50,1,-1,-1,-1\n{i},2,0,0,5,5,1,-1,-1,-1\n" for i in range(10))
    (tmp_path / "mot.txt").write_text(rows)
    track = sila.read_tracks(tmp_path / "mot.txt", frames_per_second=10.0, camera=camera)[0]
    np.testing.assert_allclose(track.positions_m[[0, -1]], [[1.1, 1.0], [1.28, 1.0]])
    with pytest.raises(sila.FormatError, match="homography"):
        camera.write_text('{"homography": [[0, 0, 0], [0, 0, 0], [0, 0, 1]]}')
        sila.read_tracks(tmp_path / "mot.txt", frames_per_second=10.0, camera=camera)


def test_a_camera_that_contradicts_itself_is_a_warning(tmp_path):
    image = [[0, 0], [100, 0], [100, 100], [0, 100], [50, 50]]
    ground = [[0, 0], [10, 0], [10, 10], [0, 10], [9, 2]]
    (tmp_path / "camera.json").write_text(json.dumps({"image_points": image, "ground_points": ground}))
    (tmp_path / "boxes.csv").write_text("track_id,t,x,y\na,0,10,10\na,0.1,11,10\n")
    with pytest.warns(UserWarning, match="pair 5 of 5 lies"):
        sila.read_tracks(tmp_path / "boxes.csv", camera=tmp_path / "camera.json")
    with pytest.warns(UserWarning, match="pair 5 of 5 lies"):
        sila.Stream(camera=tmp_path / "camera.json").close()


def test_every_row_is_accounted_for():
    rows = pandas.DataFrame(WALK, columns=["t", "x", "y"]).assign(track_id="a", label="pedestrian")
    rows.loc[3, "x"] = np.nan
    rows.loc[5, "label"] = "car"
    report = sila.as_tracks(rows).report
    assert report["rows_read"] == 12
    assert report["rows_kept"] == 10
    assert {reason: entry["rows"] for reason, entry in report["dropped"].items()} == {"not_finite": 1, "other_label": 1}


def test_columns_in_another_order_are_a_warning(place):
    given = {track.id: np.c_[track.positions_m, track.times_s] for track in place.reported[:20]}
    with pytest.warns(UserWarning, match=r"of \d+ rows \d+ dropped, .* after a jump; are the columns t, x, y\?") as caught:
        tracks = sila.as_tracks(given)
    assert len(caught) == 1 and len(tracks) > 20
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sila.as_tracks({track.id: np.c_[track.times_s, track.positions_m] for track in place.reported})


def test_no_rows_are_no_tracks():
    assert len(sila.as_tracks({})) == 0


def test_a_gap_splits_and_the_tracklets_keep_the_id_of_the_input():
    walk = WALK.copy()
    walk[6:, 0] += 10.0
    tracks = sila.as_tracks({"a": walk})
    assert [(track.id, track.input_id) for track in tracks] == [("a", "a"), ("a#2", "a")]


def test_the_gap_is_a_configuration_field():
    walk = WALK.copy()
    walk[6:, 0] += 10.0
    assert len(sila.as_tracks({"a": walk}, config={"clean": {"max_gap_s": 20.0, "max_speed_mps": 50.0}})) == 1


def test_tracks_behave_as_a_sequence(place):
    tracks = place.tracks
    assert len(tracks[:7]) == 7
    assert tracks[[3, 1]][0] == tracks[3]
    mask = np.zeros(len(tracks), dtype=bool)
    mask[5] = True
    assert list(tracks[mask]) == [tracks[5]]
    assert tracks[:2] + tracks[2:] == tracks
    assert repr(tracks) == f"Tracks({len(tracks)} tracks, {sum(map(len, tracks))} samples)"


def test_a_frame_of_tracks_gives_the_tracks_again(place):
    assert same(sila.as_tracks(place.tracks.to_frame()), place.tracks)


def test_people_of_two_recordings_with_one_id_are_not_written_as_one(tmp_path):
    both = sila.as_tracks({"a": WALK}) + sila.as_tracks({"a": WALK + [0.0, 9.0, 9.0]})
    for write in (both.to_frame, lambda: both.save(tmp_path / "t.csv")):
        with pytest.raises(ValueError, match="expected different ids, found 'a' twice"):
            write()


def test_tracks_pickle_and_copy(place):
    for copied in (pickle.loads(pickle.dumps(place.tracks)), copy.deepcopy(place.tracks), copy.copy(place.tracks)):
        assert copied == place.tracks
    assert place.tracks[0] != place.tracks[1]
    assert place.tracks[0] != "0"


def two_recordings(folder):
    """Files with clocks that overlap and ids of their own."""
    for name in ("a", "b"):
        rows = "".join(f"{name}{i},{0.1 * k},{k},{i}\n" for i in range(3) for k in range(20))
        (folder / f"{name}.csv").write_text("track_id,t,x,y\n" + rows)
    return sila.read_tracks([folder / "a.csv", folder / "b.csv"])


def test_copies_keep_the_recordings(tmp_path):
    both = two_recordings(tmp_path)
    assert [track.recording for track in both] == [0, 0, 0, 1, 1, 1]
    for copied in (pickle.loads(pickle.dumps(both)), copy.deepcopy(both)):
        assert copied == both and [track.recording for track in copied] == [0, 0, 0, 1, 1, 1]
    last = both[5]
    made = sila.Track(last.id, last.times_s, last.positions_m, input_id=last.input_id, recording=1)
    assert made == last
    assert sila.Track(last.id, last.times_s, last.positions_m, input_id=last.input_id) != last


def test_one_table_of_recordings_that_overlap_is_a_warning(tmp_path):
    both = two_recordings(tmp_path)
    with pytest.warns(UserWarning, match="Tracks.save: recordings that overlap in time become one"):
        both.save(tmp_path / "both.csv")
    with pytest.warns(UserWarning, match="Tracks.to_frame: recordings that overlap"):
        both.to_frame()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        both[:3].to_frame()
        apart = sila.Track("c", both[0].times_s + 100, both[0].positions_m, recording=2)
        sila.Tracks([*both[:3], apart]).to_frame()


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(sila.FormatError) as caught:
        sila.read_tracks(tmp_path / "nobody.csv")
    assert caught.value.path.endswith("nobody.csv")
    assert caught.value.found
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_what_is_no_track_is_rejected_by_its_type():
    with pytest.raises(TypeError, match="tracks: expected tracks, .* found int"):
        sila.as_tracks(3)
    with pytest.raises(ValueError, match="found neither"):
        sila.read_tracks()


def test_a_split_holds_back_a_share_and_keeps_people_together(place):
    train, test = sila.split_tracks(place.tracks, test_share=0.25, seed=3, by="track")
    assert len({track.input_id for track in test}) == 15  # of 60 people
    assert not {track.input_id for track in test} & {track.input_id for track in train}
    assert sorted(track.id for track in train + test) == sorted(track.id for track in place.tracks)
    assert sila.split_tracks(place.tracks, test_share=0.25, seed=3, by="track")[1] == test


def test_a_split_by_time_learns_from_no_companion(place):
    train, test = sila.split_tracks(place.tracks, test_share=0.25, seed=3)
    assert len({track.input_id for track in test}) == 15
    assert train
    for held in test:
        assert all(t.times_s[0] > held.times_s[-1] + 5 or t.times_s[-1] < held.times_s[0] - 5 for t in train)
