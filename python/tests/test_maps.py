"""Scenes from maps: Lanelet2 and OpenStreetMap, written here."""

import json

import numpy as np
import pytest
import sila
from sila import maps

PER_DEGREE = 111319.49  # metres at the equator; of latitude 110574.4


def osm(points, ways, relations=(), local=False):
    """A map of points [m], ways (id, points, tags) and relations (left, right, tags)."""
    tags = lambda given: "".join(f'<tag k="{k}" v="{v}"/>' for k, v in given.items())
    nodes = ""
    for i, (x, y) in points.items():
        place = f'lat="{y / 110574.4}" lon="{x / PER_DEGREE}"' if not local else 'lat="49" lon="8"'
        nodes += f'<node id="{i}" {place}>{tags({"local_x": x, "local_y": y} if local else {})}</node>'
    lines = "".join(
        f'<way id="{i}">{"".join(f"<nd ref={chr(34)}{p}{chr(34)}/>" for p in of_way)}{tags(given)}</way>'
        for i, of_way, given in ways
    )
    lanelets = "".join(
        f'<relation id="r{i}"><member type="way" role="left" ref="{left}"/><member type="way" role="right" ref="{right}"/>'
        f"{tags({'type': 'lanelet', **given})}</relation>"
        for i, (left, right, given) in enumerate(relations)
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
EDGES = [("1", "ab", {}), ("2", "cd", {}), ("3", "fg", {}), ("4", "hi", {})]


@pytest.mark.parametrize("local", [False, True])
def test_the_corner_of_a_curb_is_where_its_straight_pieces_would_meet(tmp_path, local):
    (tmp_path / "map.osm").write_text(osm(CURB, CURBS, local=local))
    scene = maps.scene_json(tmp_path / "map.osm")
    np.testing.assert_allclose(scene["origin"], [0, 0], atol=0.25)
    np.testing.assert_allclose([scene["axis_1"], scene["axis_2"]], [[1, 0], [0, 1]], atol=0.03)
    frame = maps.scene_from_map(tmp_path / "map.osm").frame()
    np.testing.assert_allclose(frame.origin_m, [0, 0], atol=0.25)


@pytest.mark.parametrize("kind", ["lanelet", "zebra", "osm"])
def test_crosswalks_have_centres_widths_and_a_corner(tmp_path, kind):
    lines, relations, points = EDGES, (), CROSSINGS
    if kind == "lanelet":
        relations = [("1", "2", {"subtype": "crosswalk"}), ("3", "4", {"subtype": "crosswalk"})]
    elif kind == "zebra":
        lines = [(i, nodes, {"type": "zebra"}) for i, nodes, _ in EDGES]
    else:
        points = {"a": (3, 0), "b": (20, 0), "f": (0, -3), "g": (0, -20)}
        lines = [(i, nodes, {"highway": "footway", "footway": "crossing"}) for i, nodes in (("1", "ab"), ("2", "fg"))]
    (tmp_path / "map.osm").write_text(osm(points, lines, relations))
    scene = maps.scene_json(tmp_path / "map.osm")
    np.testing.assert_allclose(scene["origin"], [0, 0], atol=0.01)
    np.testing.assert_allclose([scene["axis_1"], scene["axis_2"]], [[-1, 0], [0, 1]][::-1], atol=1e-3)
    found = sorted(scene["crosswalks"], key=lambda crosswalk: crosswalk["centre"][0])
    np.testing.assert_allclose([c["centre"] for c in found], [[0, -11.5], [11.5, 0]], atol=0.01)
    widths = [3, 3] if kind == "osm" else [3, 4]
    np.testing.assert_allclose([c["width_m"] for c in found], widths, atol=0.01)


def test_tracks_choose_the_primary_corner_and_learn_with_it(tmp_path):
    far = {f"{name}2": (200 - x, 100 - y) for name, (x, y) in CURB.items()}
    curbs = CURBS + [(f"{i}2", [f"{name}2" for name in nodes], given) for i, nodes, given in CURBS]
    (tmp_path / "map.osm").write_text(osm(CURB | far, curbs))
    t = 0.4 * np.arange(20)
    tracks = {f"{i}": np.c_[t, 190 - t, np.full(20, 97.0 + 0.1 * i)] for i in range(6)}
    scene = maps.scene_from_map(tmp_path / "map.osm", tracks)
    np.testing.assert_allclose(scene.frame().origin_m, [200, 100], atol=0.3)
    assert len(maps.scene_json(tmp_path / "map.osm")["corners"]) == 2
    assert sila.learn(tracks, scene=scene).tracks == 6


def test_an_origin_far_from_the_equator_is_scaled_there(tmp_path):
    text = '<osm><node id="1" lat="49.0" lon="8.0"/><node id="2" lat="49.001" lon="8.0"/><node id="3" lat="49.001" lon="8.001"/>'
    way = '<way id="{}"><nd ref="{}"/><nd ref="{}"/><tag k="highway" v="footway"/></way>'
    (tmp_path / "map.osm").write_text(text + way.format(1, 1, 2) + way.format(2, 2, 3) + "</osm>")
    lengths = [np.hypot(*way.vector) for way in maps.ways_of(tmp_path / "map.osm")]
    np.testing.assert_allclose(lengths, [111.2, 73.17], atol=0.02)  # WGS 84 at 49 degrees
    start = maps.ways_of(tmp_path / "map.osm", (49.0, 8.0))[0].start
    np.testing.assert_allclose(start, [0, 0], atol=1e-9)


def test_what_is_no_map_with_ways_is_rejected(tmp_path):
    for text, words in [
        ("no map", "OSM XML"),
        ("<osm/>", "footways, found none in 0 ways"),
        (osm(CROSSINGS, EDGES), "footways, found none in 4 ways"),
        (osm({"a": (0, 0)}, [("1", "ab", {"highway": "footway"})]), "none in 1 ways"),
        ('<osm><node id="1"/></osm>', "nodes with lat and lon"),
        (osm({"a": (0, 0), "b": (9, 0)}, [("1", "ab", {"highway": "footway"})]), "meet at a corner, found none of 1"),
    ]:
        (tmp_path / "map.osm").write_text(text)
        with pytest.raises(sila.FormatError, match=words):
            maps.scene_json(tmp_path / "map.osm")
    with pytest.raises(sila.FormatError, match="none.osm"):
        maps.ways_of(tmp_path / "none.osm")


def test_the_module_prints_a_scene_file_or_one_sentence(tmp_path, capsys):
    (tmp_path / "map.osm").write_text(osm(CURB, CURBS))
    maps.main([str(tmp_path / "map.osm")])
    assert json.loads(capsys.readouterr().out)["name"] == "map"
    with pytest.raises(SystemExit, match="sila.maps: .*none.osm"):
        maps.main([str(tmp_path / "none.osm")])
