"""Scenes from maps: Lanelet2 and OpenStreetMap, written here, and those of SinD if they are beside the checkout."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
import sila
from sila import _program, maps

DATA = Path(os.environ.get("SILA_DATA_DIR", Path(__file__).parents[3] / "shared/data"))
PER_DEGREE = 111319.49  # metres at the equator; of latitude 110574.4


def osm(points, ways, relations=(), local=False):
    """A map of points [m], ways (id, points, tags) and relations (left, right, tags)."""
    tags = lambda given: "".join(f'<tag k="{k}" v="{v}"/>' for k, v in given.items())
    number = {name: -i for i, name in enumerate(points, 1)}  # as of an editor
    nodes = ""
    for i, (x, y) in points.items():
        place = f'lat="{y / 110574.4:.12f}" lon="{x / PER_DEGREE:.12f}"' if not local else 'lat="49" lon="8"'
        nodes += f'<node id="{number[i]}" {place}>{tags({"local_x": x, "local_y": y} if local else {})}</node>'
    lines = "".join(
        f'<way id="{i}">{"".join(f"<nd ref={chr(34)}{number.get(p, 99)}{chr(34)}/>" for p in of_way)}{tags(given)}</way>'
        for i, of_way, given in ways
    )
    lanelets = "".join(
        f'<relation id="{i}"><member type="way" role="left" ref="{left}"/><member type="way" role="right" ref="{right}"/>'
        f"{tags({'type': 'lanelet', **given})}</relation>"
        for i, (left, right, given) in enumerate(relations, 1)
    )
    return f'<?xml version="1.0"?><osm version="0.6">{nodes}{lines}{lanelets}</osm>'


# A curb that comes from the east, bends with a radius of 8 m and goes on to the north; it is cut in two where the bend begins.
BEND = {f"b{i}": (8 - 8 * np.sin(a), 8 - 8 * np.cos(a)) for i, a in enumerate(np.radians(np.arange(0, 91, 10)))}
CURB = {"e": (60.0, 0.0), **BEND, "n": (0.0, 50.0)}
CURBS = [("1", ["b0", "e"], {"type": "curbstone"}), ("2", [*BEND, "n"], {"type": "curbstone", "subtype": "low"})]
# Two crosswalks that meet at (0, 0), 4 m and 3 m wide, of which one has its edges against each other.
CROSSINGS = {
    "a": (3, 2),
    "b": (20, 2),
    "c": (20, -2),
    "d": (3, -2),
    "f": (-1.5, -3),
    "g": (-1.5, -20),
    "h": (1.5, -3),
    "i": (1.5, -20),
}
FOOTWAY, CROSSING = {"highway": "footway"}, {"footway": "crossing"}
EDGES = [("1", "ab", {}), ("2", "cd", {}), ("3", "fg", {}), ("4", "hi", {})]


def walked(points, count, lateral=0.1):
    """Tracks along a polyline at 1 m a sample, side by side."""
    points = np.array(points, float)
    length = np.r_[0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
    at = np.arange(0, length[-1], 1.0)
    xy = np.c_[np.interp(at, length, points[:, 0]), np.interp(at, length, points[:, 1])]
    return {f"{i}": np.c_[0.8 * np.arange(len(at)), xy + lateral * i] for i in range(count)}


@pytest.mark.parametrize("local", [False, True])
def test_the_corner_of_a_curb_is_where_its_straight_pieces_would_meet(tmp_path, local):
    (tmp_path / "map.osm").write_text(osm(CURB, CURBS, local=local))
    scene = maps.scene_json(tmp_path / "map.osm")
    np.testing.assert_allclose(scene["origin"], [0, 0], atol=0.25)
    np.testing.assert_allclose([scene["axis_1"], scene["axis_2"]], [[1, 0], [0, 1]], atol=0.03)
    assert 0.2 < scene["origin_uncertainty_m"] < 0.6  # of lines that are known to 0.2 m at their ends
    frame = maps.scene_from_map(tmp_path / "map.osm").frame()
    np.testing.assert_allclose(frame.origin_m, [0, 0], atol=0.25)


BLOCK = {"a": (0, 0), "b": (20, 0), "c": (20, 20), "d": (0, 20), "m": (10, 0), "n": (20, 9)}


@pytest.mark.parametrize("shift", range(6))
def test_a_closed_curb_has_the_same_corners_wherever_it_starts(tmp_path, shift):
    ring = "ambncd"[shift:] + "ambncd"[:shift]
    (tmp_path / "map.osm").write_text(osm(BLOCK, [("1", ring + ring[0], {"barrier": "kerb"})]))
    scene = maps.scene_json(tmp_path / "map.osm", walked([(20, 40), (20, 21), (40, 21)], 5))
    found = [corner["origin"] for corner in scene["corners"]]
    np.testing.assert_allclose(found, [(0, 20), (0, 0), (20, 0), (20, 20)], atol=0.01)
    np.testing.assert_allclose(scene["origin"], (20, 20), atol=0.01)
    assert scene["tracks"] == 5


def test_a_closed_footway_is_not_cut_where_it_starts(tmp_path):
    (tmp_path / "map.osm").write_text(osm(BLOCK, [("1", "mbncdam", FOOTWAY), ("2", "ab", FOOTWAY | CROSSING)]))
    walkways = maps.scene_json(tmp_path / "map.osm")["walkways"]
    centres = sorted(walkway["centre"] for walkway in walkways)
    np.testing.assert_allclose(centres, [(0, 10), (10, 0), (10, 20), (20, 10)], atol=0.01)


def test_a_curb_may_be_the_bound_of_a_walkway(tmp_path):
    points = CURB | {"w": (10.0, 3.0), "v": (60.0, 3.0)}
    walkway = ("1", "3", {"subtype": "walkway"})
    (tmp_path / "map.osm").write_text(osm(points, [*CURBS, ("3", "wv", {"type": "virtual"})], [walkway]))
    scene = maps.scene_json(tmp_path / "map.osm")
    np.testing.assert_allclose(scene["origin"], [0, 0], atol=0.25)
    (found,) = scene["walkways"]
    np.testing.assert_allclose([found["centre"], found["direction"]], [[34.5, 1.5], [1, 0]], atol=0.02)
    assert found["width_m"] == pytest.approx(3, abs=0.03)


def test_the_uncertainty_of_a_corner_covers_errors_of_the_map(tmp_path):
    random, errors, stated = np.random.default_rng(1), [], 0.0
    for _ in range(20):
        moved = {name: np.add(at, random.normal(0, 0.2 if name in "en" else 0.01, 2)) for name, at in CURB.items()}
        (tmp_path / "map.osm").write_text(osm(moved, CURBS))
        scene = maps.scene_json(tmp_path / "map.osm")
        errors.append(np.hypot(*scene["origin"]))
        stated = scene["origin_uncertainty_m"]
    assert np.sqrt(np.mean(np.square(errors))) < stated


@pytest.mark.parametrize("kind", ["lanelet", "marked lanelet", "zebra", "osm"])
def test_crosswalks_have_centres_widths_and_a_corner(tmp_path, kind):
    lines, relations, points = EDGES, (), CROSSINGS
    if kind in ("zebra", "marked lanelet"):
        lines = [(i, nodes, {"type": "zebra"}) for i, nodes, _ in EDGES]
    if "lanelet" in kind:
        relations = [("1", "2", {"subtype": "crosswalk"}), ("3", "4", {"subtype": "crosswalk"})]
    elif kind == "osm":
        points = {"a": (3, 0), "b": (20, 0), "f": (0, -3), "g": (0, -20)}
        lines = [(i, nodes, {"highway": "footway", "footway": "crossing"}) for i, nodes in (("1", "ab"), ("2", "fg"))]
    (tmp_path / "map.osm").write_text(osm(points, lines, relations))
    tracks = {**walked([(0, 0.5), (25, 0.5)], 4), "across": walked([(9, -6), (11, 6)], 1)["0"]}
    scene = maps.scene_json(tmp_path / "map.osm", tracks)
    np.testing.assert_allclose(scene["origin"], [0, 0], atol=0.02)
    np.testing.assert_allclose([scene["axis_1"], scene["axis_2"]], [[-1, 0], [0, 1]][::-1], atol=1e-3)
    found = sorted(scene["crosswalks"], key=lambda crosswalk: crosswalk["centre"][0])
    np.testing.assert_allclose([c["centre"] for c in found], [[0, -11.5], [11.5, 0]], atol=0.02)
    assert [abs(c["direction"][0]) > 0.999 for c in found] == [False, True]
    widths = [3, 3] if kind == "osm" else [3, 4]
    np.testing.assert_allclose([c["width_m"] for c in found], widths, atol=0.03)
    assert [c["tracks"] for c in found] == [0, 4]


@pytest.mark.filterwarnings("ignore:none of . tracks comes within 12 m of a corner")
def test_tracks_from_curb_to_curb_make_the_crosswalks_of_a_map_without(tmp_path):
    other = {f"{name}2": (x, -14 - y) for name, (x, y) in CURB.items()}
    curbs = CURBS + [(f"{i}2", [f"{name}2" for name in nodes], given) for i, nodes, given in CURBS]
    (tmp_path / "map.osm").write_text(osm(CURB | other, curbs))
    tracks = walked([(28, 6), (30, -20)], 5, lateral=0.3)
    (crosswalk,) = maps.scene_json(tmp_path / "map.osm", tracks)["crosswalks"]
    np.testing.assert_allclose(crosswalk["centre"], [29.9, -7], atol=0.7)
    heading = np.degrees(np.arctan2(*crosswalk["direction"][::-1]))
    assert heading % 180 == pytest.approx(np.degrees(np.arctan2(-26, 2)) % 180, abs=2)
    assert crosswalk["tracks"] == 5 and 0.1 < crosswalk["centre_uncertainty_m"] < 0.7
    assert maps.scene_json(tmp_path / "map.osm", walked([(28, 6), (30, -20)], 2))["crosswalks"] == []


def test_tracks_choose_the_primary_corner_and_learn_with_it(tmp_path):
    far = {f"{name}2": (200 - x, 100 - y) for name, (x, y) in CURB.items()}
    curbs = CURBS + [(f"{i}2", [f"{name}2" for name in nodes], given) for i, nodes, given in CURBS]
    (tmp_path / "map.osm").write_text(osm(CURB | far, curbs))
    assert len(maps.scene_json(tmp_path / "map.osm")["corners"]) == 2
    tracks = walked([(195, 97), (170, 97)], 6)
    scene = maps.scene_from_map(tmp_path / "map.osm", tracks)
    np.testing.assert_allclose(scene.frame().origin_m, [200, 100], atol=0.3)
    assert maps.scene_json(tmp_path / "map.osm", tracks)["tracks"] == 6
    assert sila.learn(tracks, scene=scene).tracks == 6


def test_a_primary_corner_that_no_track_passes_is_a_warning(tmp_path):
    (tmp_path / "map.osm").write_text(osm(CURB, CURBS))
    with pytest.warns(UserWarning, match="none of 2 tracks comes within 12 m of a corner .* the primary .*, 1$"):
        maps.scene_json(tmp_path / "map.osm", walked([(40, 2), (60, 2)], 2))


@pytest.mark.parametrize(
    "origin",
    [(np.nan, 0), (0, np.inf), (91, 0), (0, -181), (48,), (1, 2, 3), 48, "48", ("a", "b"), (True, 0), np.ones((2, 2))],
)
def test_an_origin_that_is_no_point_of_the_earth_is_rejected(tmp_path, origin):
    (tmp_path / "map.osm").write_text(osm(CURB, CURBS))
    expected = "origin: expected two numbers, latitude from -90 to 90 and longitude from -180 to 180; found "
    with pytest.raises(ValueError, match=expected) as error:
        maps.scene_from_map(tmp_path / "map.osm", origin=origin)
    assert repr(origin) in str(error.value)


def test_an_origin_may_be_an_array(tmp_path):
    (tmp_path / "map.osm").write_text(osm(CURB, CURBS))
    origins = (0, 1e-4), [0, 1e-4], np.array([0, 1e-4])
    found = [maps.scene_json(tmp_path / "map.osm", origin=origin)["origin"] for origin in origins]
    assert found[0] == found[1] == found[2]
    assert found[0][0] == pytest.approx(-11.13, abs=0.3)


def test_degrees_are_scaled_at_the_origin(tmp_path):
    text = "".join(
        f'<node id="{i}" lat="{lat}" lon="{lon}"/>'
        for i, (lat, lon) in enumerate([(49, 8), (49.001, 8), (49.001, 8.001)], 1)
    )
    way = '<way id="{}"><nd ref="{}"/><nd ref="{}"/><tag k="highway" v="footway"/></way>'
    (tmp_path / "map.osm").write_text(f"<osm version='0.6'>{text}{way.format(1, 1, 2)}{way.format(2, 2, 3)}</osm>")
    walkways = maps.scene_json(tmp_path / "map.osm", origin=(49.0, 8.0))["walkways"]
    centres = [walkway["centre"] for walkway in walkways]
    np.testing.assert_allclose(centres, [[0, 55.6], [36.58, 111.2]], atol=0.02)  # WGS 84 at 49 degrees


@pytest.mark.parametrize(
    "text, words",
    [
        ("no map", "OSM XML"),
        ("<osm version='0.6'/>", "footways, found none in 0 ways"),
        (osm(CROSSINGS, EDGES), "footways, found none in 4 ways"),
        (osm({"a": (0, 0)}, [("1", "ab", FOOTWAY)]), "none in 1 way"),
        (osm({"a": ("east", 0)}, [], local=True), "map.osm: expected numbers in local_x of the nodes, found 'east'"),
        (osm({"a": (0, "nan")}, [], local=True), "numbers in local_y of the nodes, found 'nan'"),
        ("<osm version='0.6'><node id='1'/></osm>", "nodes with lat and lon"),
        ("<osm version='0.6'><node id='1' lat='49' lon='8'/></osm>", "--origin LAT LON.* around 49.00000 8.00000"),
        (osm({"a": (0, 0), "b": (9, 0)}, [("1", "ab", FOOTWAY)]), "meet at a corner, found none of 1 straight"),
    ],
)
def test_a_file_that_is_no_usable_map_is_rejected(tmp_path, text, words):
    (tmp_path / "map.osm").write_text(text)
    with pytest.raises(sila.FormatError, match=words):
        maps.scene_json(tmp_path / "map.osm")


def test_tracks_beside_the_map_are_rejected(tmp_path):
    (tmp_path / "map.osm").write_text(osm(CURB, CURBS))
    with pytest.raises(sila.FormatError, match="tracks in metres in the frame of the map.* found tracks near 9"):
        maps.scene_json(tmp_path / "map.osm", walked([(900, 5), (950, 5)], 3))


def test_a_missing_reader_is_named_with_the_remedy(tmp_path, monkeypatch):
    (tmp_path / "map.osm").write_text(osm(CURB, CURBS))
    monkeypatch.setitem(__import__("sys").modules, "osmium", None)
    with pytest.raises(ImportError, match=r"needs osmium: pip install 'sila\[map\]'"):
        maps.scene_json(tmp_path / "map.osm")


@pytest.fixture
def program(tmp_path, capsys, monkeypatch):
    """`sila scene make` beside a map and the tracks of six people at its corner."""
    (tmp_path / "map.osm").write_text(osm(CURB, CURBS))
    sila.Tracks(sila.as_tracks(walked([(40, 2), (2, 2), (2, 40)], 6))).save(tmp_path / "tracks.csv")

    def run(*arguments):
        monkeypatch.setattr("sys.argv", ["sila", "scene", "make", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            _program.main()
        return ended.value.code, *capsys.readouterr()

    return run


def test_the_program_prints_a_scene_file_or_one_sentence(tmp_path, program):
    tracks = tmp_path / "tracks.csv"
    code, made, said = program(tracks, "--map", tmp_path / "map.osm")
    assert code == 0 and "which 6 tracks pass; the scene has 1 corner, 0 crosswalks and 0 walkways" in said
    assert json.loads(made)["corners"][0]["tracks"] == 6
    (tmp_path / "made.json").write_text(made)
    assert sila.learn(tmp_path / "tracks.csv", scene=tmp_path / "made.json").tracks == 6
    code, made, said = program(tracks, f"--map={tmp_path / 'none.osm'}")
    assert (code, made) == (1, "") and said.startswith("sila: ") and "none.osm" in said and said.count("\n") == 1
    for option, value, named in (("--format", "foo", "foo"), ("--fps", "0", "frames_"), ("--set", "x", "--set")):
        code, made, said = program(tracks, "--map", tmp_path / "map.osm", option, value)
        assert (code, made) == (2, "") and named in said and said.count("\n") == 1, said
    code, made, said = program(tracks, "--map", tmp_path / "map.osm", "--seed", "3")
    assert (code, made) == (2, "") and "with --map expected only the options above, found --seed 3" in said


def test_the_program_prints_a_warning_as_one_line(tmp_path, program):
    sila.Tracks(sila.as_tracks(walked([(40, 2), (60, 2)], 3))).save(tmp_path / "far.csv")
    code, made, said = program(tmp_path / "far.csv", "--map", tmp_path / "map.osm")
    assert code == 0 and json.loads(made)["tracks"] == 0
    warning, summary = said.splitlines()
    assert warning.startswith("warning: none of 3 tracks comes within 12 m of a corner"), said
    assert "which 0 tracks pass" in summary


def test_the_program_names_its_own_arguments(tmp_path, program):
    code, made, said = program("--map", tmp_path / "map.osm")
    assert (code, made) == (2, "") and said.startswith("sila: tracks: expected track files, or --scene with"), said
    code, made, said = program(tmp_path / "tracks.csv", "--map", tmp_path / "map.osm", "--origin", "nan", "0")
    assert (code, made) == (2, "") and said.startswith("sila: origin: expected two numbers"), said
    assert said.endswith("found [nan, 0.0]\n")


def test_a_scene_from_a_map_keeps_camera_and_recordings(tmp_path, program):
    square = {"homography": [[2, 0, 0], [0, -2, 0], [0, 0, 1]], "seen": [0, 0]}
    (tmp_path / "camera.json").write_text(json.dumps(square))
    pixels = {name: rows * [1, 0.5, -0.5] for name, rows in walked([(40, 2), (2, 2), (2, 40)], 6).items()}
    sila.Tracks(sila.as_tracks(pixels)).save(tmp_path / "pixels.csv")
    camera = ["--camera", tmp_path / "camera.json"]
    code, made, said = program(tmp_path / "pixels.csv", "--map", tmp_path / "map.osm", *camera)
    assert code == 0 and json.loads(made)["camera"] == square, said
    scene = json.loads(made) | {"files": [{"path": "pixels.csv"}]}
    assert scene["tracks"] == 6
    (tmp_path / "made.json").write_text(json.dumps(scene))
    code, made, said = program("--scene", tmp_path / "made.json", "--map", tmp_path / "map.osm", "--json")
    assert code == 0 and json.loads(made) == scene, said


# Zebra crossings as measured by hand in the drone pictures of SinD (centre [m], direction [degrees]). The pictures were registered to
# the maps by a homography of the ends of stop lines and islands (residual 0.3 m in the median, 0.8 m at most), not by crosswalks. The
# ends of those that are hidden lie in shade or glare: they have a point of their centre line.
PICTURES = {
    "Xian/Xi'an_Shanglin.osm": [((-33.2, 23.2), 103.6), ((-3.1, 7.4), 13.1)],
    "Changchun/Changchun_Pudong.osm": [
        ((-22.1, 9.5), 3.3),
        ((-20.6, -14.9), 3.3),
        ((-33.7, -3.7), 92.5),
        ((-9.0, -2.3), 94.6),
    ],
}
HIDDEN = [((16.1, 41.2), 109.2), ((-10.4, 50.8), 15.1)]  # Xian


@pytest.mark.skipif(not (DATA / "sind").is_dir(), reason="the recorded tracks are not here")
@pytest.mark.parametrize(
    "file, tolerance_m", [("Xian/Xi'an_Shanglin.osm", 1.0), ("Changchun/Changchun_Pudong.osm", 1.5)]
)
def test_the_crosswalks_of_sind_are_where_the_pictures_show_them(file, tolerance_m):
    city = DATA / "sind" / Path(file).parent
    scene = maps.scene_json(DATA / "sind" / file, city / "Ped_smoothed_tracks.csv")
    assert len(scene["crosswalks"]) == 4
    for seen, degrees in PICTURES[file] + (HIDDEN if "Xian" in file else []):
        found = min(scene["crosswalks"], key=lambda c: float(np.hypot(*np.subtract(c["centre"], seen))))
        turned = np.degrees(np.arctan2(*found["direction"][::-1])) - degrees
        assert abs((turned + 90) % 180 - 90) < 10
        off = np.subtract(seen, found["centre"])
        across = off @ [-found["direction"][1], found["direction"][0]]
        assert abs(across) < tolerance_m
        if (seen, degrees) not in HIDDEN:
            assert np.hypot(*off) < tolerance_m


@pytest.mark.skipif(not (DATA / "sind").is_dir(), reason="the recorded tracks are not here")
@pytest.mark.parametrize("file", PICTURES)
def test_the_corners_of_sind_are_those_that_were_fitted_by_hand(file):
    city = Path(file).parent
    scene = maps.scene_json(DATA / "sind" / file, DATA / "sind" / city / "Ped_smoothed_tracks.csv")
    hand = json.loads((DATA / f"scenes/sind_{str(city).lower()}.json").read_text())
    assert len(scene["corners"]) == 4
    for corner in hand["corners"]:
        near = min(scene["corners"], key=lambda c: float(np.hypot(*np.subtract(c["origin"], corner["origin"]))))
        assert np.hypot(*np.subtract(near["origin"], corner["origin"])) < 0.7
        assert abs(near["tracks"] - corner["tracks_passing_within_12m"]) <= 1
        assert bool(corner["primary"]) == (near["name"] == scene["primary_corner"])
