"""Scene files from maps: OpenStreetMap or Lanelet2, both OSM XML.

    python -m sila.maps MAP.osm [TRACKS] [--origin LAT LON] > corner.json

A corner is where two straight pieces of one curb would meet without the bend between them (Lanelet2 `type=curbstone`, OSM `barrier=kerb`). A map without
such bends has its corners where the extended centre lines of two ways to walk on meet: lanelets with `subtype=crosswalk` or `walkway`, pairs of lines
`type=zebra`, `zebra_marking` or `pedestrian_marking`, OSM `highway=footway`, `pedestrian` or `crossing`, `footway=crossing` or `sidewalk`. Axes lead along
them and enclose the block. With TRACKS the primary corner is the one nearest to most of them. Crosswalks are listed as `crosswalks`.

Positions are metres east and north of the origin: of latitude and longitude 0 for a map within 0.1 degrees of them, as Lanelet2 maps in a frame of their own
are, else of the mean of the nodes. Degrees are scaled as at the origin, which costs a few centimetres below 1 km. `local_x` and `local_y` are used
instead if every node has them.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import xml.etree.ElementTree as xml
from collections import Counter
from dataclasses import dataclass
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._sila import Scene
from ._tracks import TracksLike, as_tracks
from .errors import FormatError

Points = NDArray[np.float64]
_WIDTH_M = 3.0  # where the map says none, as of a frame made from tracks
_STRAIGHT_M = 0.2  # how far a straight piece of a line leaves its chord
_SHORTEST_M = {"curb": 12.0, "walk": 4.0, "crossing": 3.0}  # of a piece; those of bends of curbs are shorter
_REACH_M = 20.0  # from a piece to where it would meet another: more than the radius of the bend
_SAME_M = 3.0  # corners nearer to each other are one
_SMALLEST_SINE = np.sin(np.radians(20.5))  # of the angle between the axes, as in scene files


@dataclass(frozen=True)
class Way:
    """A straight piece of a curb or of the centre line of a way to walk on. `kind`: curb, walk or crossing."""

    kind: str
    line: int  # the line of the map that it is a piece of
    start: Points
    vector: Points
    width_m: float

    @property
    def centre(self) -> Points:
        return self.start + self.vector / 2


def ways_of(path: str | Path, origin: tuple[float, float] | None = None) -> list[Way]:
    """The straight curbs and ways to walk on, those of one line in their order; metres. Raises FormatError for what is no XML,
    nodes without a position and a map without such ways."""
    try:
        root = xml.parse(path).getroot()
        at = _positions(list(root.iter("node")), origin)
        nodes = {way.get("id"): [nd.get("ref") for nd in way.iter("nd")] for way in root.iter("way")}
    except (xml.ParseError, OSError) as error:
        raise FormatError(str(path), 0, "a map as OSM XML", str(error)) from None
    except ValueError as error:
        raise FormatError(str(path), 0, "nodes with lat and lon, or local_x and local_y", str(error)) from None
    lines = {way: np.array([at[i] for i in ids if i in at]).reshape(-1, 2) for way, ids in nodes.items()}
    found: dict[str, list[Any]] = {"curb": [], "walk": [], "crossing": [], "edge": []}
    for way in root.iter("way"):
        if (kind := _kind(_tags(way))) and len(lines[way.get("id")]) > 1:
            found[kind].append((lines[way.get("id")], _WIDTH_M))
    for relation in root.iter("relation"):
        kind = {"crosswalk": "crossing", "walkway": "walk"}.get(_tags(relation).get("subtype", ""))
        sides = [
            lines.get(m.get("ref"), np.empty((0, 2)))
            for m in relation.iter("member")
            if m.get("role") in ("left", "right")
        ]
        if kind and len(sides) == 2 and min(map(len, sides)) > 1:
            found[kind].append(_between(*sides))
    edges = [line for line, _ in found.pop("edge")]
    while len(edges) > 1:
        edge = edges.pop()
        edges.sort(key=lambda other: float(np.hypot(*(other.mean(0) - edge.mean(0)))), reverse=True)
        found["crossing"].append(_between(edge, edges.pop()))
    found["curb"] = [(line, _WIDTH_M) for line in _joined([line for line, _ in found["curb"]])]
    entries = [(kind, *entry) for kind, of_kind in found.items() for entry in of_kind]
    ways = [Way(kind, i, a, b - a, w) for i, (kind, line, w) in enumerate(entries) for a, b in _straight(line, kind)]
    if not ways:
        raise FormatError(str(path), 0, "curbs, crosswalks or footways", f"none in {len(lines)} ways")
    return ways


def scene_json(
    path: str | Path, tracks: TracksLike | None = None, origin: tuple[float, float] | None = None
) -> dict[str, Any]:
    """The scene file of a map. Raises FormatError as ways_of, and for a map without a corner."""
    ways = ways_of(path, origin)
    corners = [_corner(a, b) for a, b in pairwise(ways) if a.kind == "curb" and a.line == b.line]
    if not any(corners):
        corners = [_corner(a, b) for a, b in combinations([w for w in ways if w.kind != "curb"], 2) if a.line != b.line]
    kept: list[dict[str, Any]] = []
    for corner in filter(None, corners):
        if all(np.hypot(*np.subtract(corner["origin"], other["origin"])) > _SAME_M for other in kept):
            kept.append({"name": str(len(kept) + 1), **corner})
    if not kept:
        raise FormatError(str(path), 0, "two curbs or ways that meet at a corner", f"none of {len(ways)} straight ones")
    nearest = [0]
    if tracks is not None:
        middles = [np.median(track.positions_m, axis=0) for track in as_tracks(tracks)]
        nearest = [int(np.argmin([np.hypot(*(corner["origin"] - middle)) for corner in kept])) for middle in middles]
    primary = kept[Counter(nearest).most_common(1)[0][0]]
    crosswalks = [
        {"centre": w.centre.round(3).tolist(), "direction": _unit(w.vector), "width_m": round(w.width_m, 2)}
        for w in ways
        if w.kind == "crossing"
    ]
    scene = {"y_axis": "up", "units": "metres", "primary_corner": primary["name"], "corners": kept}
    return {**primary, "name": Path(path).stem, **scene, "crosswalks": crosswalks}


def scene_from_map(
    path: str | Path, tracks: TracksLike | None = None, *, origin: tuple[float, float] | None = None
) -> Scene:
    """The scene of a map, see sila.maps. `origin`: latitude and longitude of the point (0, 0) of the tracks."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scene.json"
        file.write_text(json.dumps(scene_json(path, tracks, origin)))
        return Scene.load(file)


def _tags(element: xml.Element) -> dict[str, str]:
    return {str(tag.get("k")): str(tag.get("v")) for tag in element.iter("tag")}


def _kind(tags: dict[str, str]) -> str | None:
    if tags.get("type") == "curbstone" or tags.get("barrier") == "kerb":
        return "curb"
    if tags.get("type") in ("zebra", "zebra_marking", "pedestrian_marking"):
        return "edge"
    if "crossing" in (tags.get("footway"), tags.get("highway")):
        return "crossing"
    return "walk" if tags.get("highway") in ("footway", "pedestrian") or tags.get("footway") == "sidewalk" else None


def _positions(nodes: list[xml.Element], origin: tuple[float, float] | None) -> dict[str | None, Points]:
    tags = [_tags(node) for node in nodes]
    if all("local_x" in of_node and "local_y" in of_node for of_node in tags):
        points = np.array([[float(of_node[key]) for key in ("local_x", "local_y")] for of_node in tags])
    else:
        degrees = np.array([[float(str(node.get(key))) for key in ("lat", "lon")] for node in nodes])
        mean = degrees.mean(axis=0)
        origin = origin or (0.0, 0.0) if np.abs(mean).max() < 0.1 else origin or tuple(mean)
        phi = np.radians(origin[0])  # metres of a degree of latitude and longitude, WGS 84
        scale = 111132.95 - 559.82 * np.cos(2 * phi), 111412.84 * np.cos(phi) - 93.5 * np.cos(3 * phi)
        points = ((degrees - origin) * scale)[:, ::-1]
    return dict(zip((node.get("id") for node in nodes), points))


def _between(left: Points, right: Points) -> tuple[Points, float]:
    """The centre line of a strip between two straight edges, and its width."""
    left, right = left[[0, -1]], right[[0, -1]]
    if (left[1] - left[0]) @ (right[1] - right[0]) < 0:
        right = right[::-1]
    centre = (left + right) / 2
    return centre, abs(_cross(_unit(centre[1] - centre[0]), centre[0] - left[0])) * 2


def _joined(lines: list[Points]) -> list[Points]:
    """Lines that begin where another ends are one."""
    for i, j in combinations(range(len(lines)), 2):
        for a, b in ((a, b) for a in (lines[i], lines[i][::-1]) for b in (lines[j], lines[j][::-1])):
            if np.hypot(*(a[-1] - b[0])) < 0.1:
                return _joined([*(line for k, line in enumerate(lines) if k not in (i, j)), np.r_[a, b[1:]]])
    return lines


def _straight(line: Points, kind: str) -> list[Points]:
    """The ends of its straight pieces."""
    pieces, first = [], 0
    for i in range(1, len(line)):
        if i + 1 < len(line) and _bend_m(line[first : i + 2]) < _STRAIGHT_M:
            continue
        if np.hypot(*(line[i] - line[first])) >= _SHORTEST_M[kind]:
            pieces.append(line[[first, i]])
        first = i
    return pieces


def _bend_m(line: Points) -> float:
    """The largest distance from the chord."""
    chord, inner = line[-1] - line[0], line[1:-1] - line[0]
    share = np.clip(inner @ chord / max(chord @ chord, 1e-9), 0.0, 1.0)
    return float(np.hypot(*(inner - share[:, None] * chord).T).max())


def _cross(a: Any, b: Any) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _unit(vector: Points) -> list[float]:
    return [float(entry) for entry in (vector / np.hypot(*vector)).round(6)]


def _corner(a: Way, b: Way) -> dict[str, Any] | None:
    """Where two ways would meet, if they do."""
    if abs(_cross(_unit(a.vector), _unit(b.vector))) <= _SMALLEST_SINE:
        return None
    shares = np.linalg.solve(np.c_[a.vector, -b.vector], b.start - a.start)  # 0 and 1 at the ends
    origin = a.start + shares[0] * a.vector
    if any(np.hypot(*way.vector) * max(-s, s - 1.0) > _REACH_M for way, s in zip((a, b), shares)):
        return None
    axes = [(way.centre - origin) * (-1.0 if way.kind == "crossing" else 1.0) for way in (a, b)]  # it leaves the block
    first, second = axes if _cross(*axes) > 0 else axes[::-1]
    width_m = round((a.width_m + b.width_m) / 2, 2)
    return {
        "origin": origin.round(3).tolist(),
        "axis_1": _unit(first),
        "axis_2": _unit(second),
        "sidewalk_width_m": width_m,
    }


def main(arguments: list[str] | None = None) -> None:
    style: Any = {"formatter_class": argparse.RawDescriptionHelpFormatter}
    parser = argparse.ArgumentParser(prog="python -m sila.maps", description=__doc__, **style)
    parser.add_argument("map", metavar="MAP.osm")
    parser.add_argument("tracks", nargs="?", metavar="TRACKS", help="track file in the frame of the map")
    parser.add_argument("--origin", nargs=2, type=float, metavar=("LAT", "LON"), help="of (0, 0) of the tracks")
    given = parser.parse_args(arguments)
    try:
        print(json.dumps(scene_json(given.map, given.tracks, given.origin), indent=2))
    except ValueError as error:
        sys.exit(f"sila.maps: {error}")


if __name__ == "__main__":
    main()
