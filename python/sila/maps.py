"""Scene files from maps: OpenStreetMap or Lanelet2 (`pip install 'sila[map]'`); docs/python.md, Maps, says what they have.

    sila scene make TRACKS --map MAP.osm [--origin LAT LON] > corner.json

Curbs are Lanelet2 `type=curbstone`, `road_border`, OSM `barrier=kerb`. Ways to walk on are lanelets with
`subtype=crosswalk`, `walkway` or `shared_walkway`, pairs of lines `type=zebra`, `zebra_marking` or `pedestrian_marking`,
OSM `highway=footway`, `pedestrian` or `crossing`, `footway=crossing` or `sidewalk`. Axes enclose the block.

Positions are metres: `local_x` and `local_y` if every node has them, else metres east and north of the origin, which is
latitude and longitude 0 for a map within 0.1 degrees of them. Degrees are scaled as at the origin, which costs a few
centimetres below 1 km.
"""

from __future__ import annotations

import importlib
import json
import os
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._rows import counted, number, warn
from ._sila import Scene
from ._tracks import TracksLike, as_tracks
from .errors import FormatError

Points = NDArray[np.float64]
_WIDTH_M = 3.0  # where the map says none, as of a frame made from tracks
_WIDEST_M = 15.0  # of two lines that are the edges of one crosswalk
_POINT_ERROR_M = 0.2  # of a point of the map, and how far a straight piece leaves its chord
_SHORTEST_M = {"curb": 12.0, "walk": 4.0, "crossing": 3.0}  # of a piece; those of bends of curbs are shorter
_REACH_M = 20.0  # from a piece to where it would meet another: more than the radius of the bend
_SAME_M = 3.0  # corners nearer to each other are one
_NEAR_M = 50.0  # ways farther from all tracks do not count
_PASS_M = 12.0  # tracks that come nearer to a corner pass it
_CURB_M = 4.0  # people this near to a curb begin or end a crossing there
_CROSSINGS = 3  # tracks that make a crosswalk
_SMALLEST_SINE = np.sin(np.radians(20.5))  # of the angle between the axes, as in scene files
_KINDS = {"crosswalk": "crossing", "walkway": "walk", "shared_walkway": "walk"}  # of lanelets


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

    @property
    def heading_error_rad(self) -> float:
        return float(np.sqrt(2) * _POINT_ERROR_M / np.hypot(*self.vector))

    def error_m(self, share: float) -> float:
        """Of a point of the line or its extension, across; `share`: 0 at its start, 1 at its end."""
        return float(_POINT_ERROR_M * np.hypot(share, 1.0 - share))


def scene_json(
    path: str | os.PathLike[str], tracks: TracksLike | None = None, origin: Sequence[float] | Points | None = None
) -> dict[str, Any]:
    """The scene file of a map, of the part near the tracks. Raises FormatError for a file that is no map, degrees without an
    `origin` (latitude and longitude of the point (0, 0)), no curb or way to walk on near the tracks, and no corner.
    Raises ValueError for an `origin` that is no point of the earth. Warns if no track passes a corner."""
    lines = _lines_of(path, None if origin is None else _latitude_and_longitude(origin))
    curbs = [curb for curb, _ in lines["curb"]]
    paths = [] if tracks is None else [track.positions_m for track in as_tracks(tracks)]
    ways = _near(path, _straight(lines), paths)
    walks = [way for way in ways if way.kind != "curb"]
    corners = [_corner(a, b, paths) for a, b in _consecutive(ways, curbs)]
    if not any(corners):
        corners = [_corner(a, b, paths) for a, b in combinations(walks, 2) if a.line != b.line]
    kept: list[dict[str, Any]] = []
    for corner in filter(None, corners):
        if all(np.hypot(*np.subtract(corner["origin"], other["origin"])) > _SAME_M for other in kept):
            kept.append({"name": str(len(kept) + 1), **corner})
    if not kept:
        found = f"none of {counted(len(ways), 'straight one')}"
        raise FormatError(str(path), 0, "two curbs or ways that meet at a corner", found)
    primary = max(kept, key=lambda corner: int(corner["tracks"]))
    if paths and not primary["tracks"]:
        found = f"none of {counted(len(paths), 'track')} comes within {_PASS_M:g} m of a corner of the map"
        warn([f"{found}; the primary corner is the first one, {primary['name']}"])
    scene: dict[str, Any] = {"y_axis": "up", "units": "metres", "primary_corner": primary["name"], "corners": kept}
    scene["crosswalks"] = [_strip(way, paths) for way in walks if way.kind == "crossing"] or _crossed(curbs, paths)
    scene["walkways"] = [_strip(way, paths) for way in walks if way.kind == "walk"]
    return {**primary, "name": Path(path).name.split(".osm")[0], **scene}


def scene_from_map(
    path: str | os.PathLike[str], tracks: TracksLike | None = None, *, origin: Sequence[float] | Points | None = None
) -> Scene:
    """The scene of a map, see sila.maps. `origin`: latitude and longitude of the point (0, 0) of the tracks."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scene.json"
        file.write_text(json.dumps(scene_json(path, tracks, origin)))
        return Scene.load(file)


def _latitude_and_longitude(origin: Any) -> tuple[float, float]:
    try:
        latitude, longitude = (number("origin", entry) for entry in origin)
    except (TypeError, ValueError):
        latitude = longitude = np.nan
    if not (abs(latitude) <= 90 and abs(longitude) <= 180):
        expected = "two numbers, latitude from -90 to 90 and longitude from -180 to 180"
        raise ValueError(f"origin: expected {expected}; found {origin!r}")
    return latitude, longitude


def _engine(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(f"sila.maps needs {name}: pip install 'sila[map]'") from error


def _elements(path: str | os.PathLike[str]) -> tuple[dict[int, Any], list[Any], list[Any]]:
    """Nodes (location, tags), ways (id, nodes, tags), relations (ways with roles, tags)."""
    nodes, ways, relations = {}, [], []
    try:
        for element in _engine("osmium").FileProcessor(os.fspath(path)):
            tags = dict(element.tags)
            if element.is_node():
                at = element.location
                nodes[element.id] = (np.array([at.lat, at.lon]) if at.valid() else None, tags)
            elif element.is_way():
                ways.append((element.id, [node.ref for node in element.nodes], tags))
            elif element.is_relation():
                relations.append(([(m.ref, m.role) for m in element.members if m.type == "w"], tags))
    except RuntimeError as error:
        raise FormatError(str(path), 0, "a map of OpenStreetMap or Lanelet2 (OSM XML or PBF)", str(error)) from None
    return nodes, ways, relations


def _lines_of(path: str | os.PathLike[str], origin: tuple[float, float] | None) -> dict[str, list[Any]]:
    """The lines of each kind and their widths. Curbs that share ends are one line; a strip between two lines is its centre line."""
    shapely = _engine("shapely")
    nodes, ways, relations = _elements(path)
    at = _positions(path, nodes, origin)
    points = {i: np.array([at[node] for node in of_way if node in at]) for i, of_way, _ in ways}
    found: dict[str, list[Any]] = {"curb": [], "walk": [], "crossing": [], "edge": []}
    bounds = set()  # of lanelets to walk on
    for members, tags in relations:
        sides = [ref for ref, role in members if role in ("left", "right") and len(points.get(ref, ())) > 1]
        if (kind := _KINDS.get(tags.get("subtype", ""))) and len(sides) == 2:
            found[kind].append(_between(*(points[ref] for ref in sides)))
            bounds.update(sides)
    for i, _, tags in ways:
        if (kind := _kind(tags)) and len(points[i]) > 1 and (kind == "curb" or i not in bounds):
            found[kind].append((shapely.LineString(points[i]), _WIDTH_M))
    found["crossing"] += _paired([np.array(edge.coords) for edge, _ in found.pop("edge")])
    curbs = shapely.line_merge(shapely.MultiLineString([curb for curb, _ in found["curb"]]))
    found["curb"] = [(curb, _WIDTH_M) for curb in getattr(curbs, "geoms", [curbs]) if not curb.is_empty]
    if not any(found.values()):
        raise FormatError(str(path), 0, "curbs, crosswalks or footways", f"none in {counted(len(ways), 'way')}")
    return found


def _straight(lines: dict[str, list[Any]]) -> list[Way]:
    """The straight pieces of all lines, those of one line in their order."""
    entries = [(kind, *entry) for kind, of_kind in lines.items() for entry in of_kind]
    return [
        Way(kind, i, a, b - a, width_m)
        for i, (kind, line, width_m) in enumerate(entries)
        for a, b in pairwise(np.array(_from_a_corner(line).simplify(_POINT_ERROR_M).coords))
        if np.hypot(*(b - a)) >= _SHORTEST_M[kind]
    ]


def _from_a_corner(line: Any) -> Any:
    """A closed line from its point farthest from its middle, which is not inside a straight piece; others unchanged."""
    if not line.is_closed:
        return line
    points = np.array(line.coords)
    distances = np.hypot(*(points - (points.min(axis=0) + points.max(axis=0)) / 2).T)
    first = max(range(len(points) - 1), key=lambda i: (distances[i], *points[i]))  # the same wherever the line starts
    return _engine("shapely").LineString(np.concatenate([points[first:], points[1 : first + 1]]))


def _consecutive(ways: list[Way], curbs: list[Any]) -> list[tuple[Way, Way]]:
    """Pairs of pieces that follow one another on a curb, of a closed curb also the last and the first."""
    pieces = defaultdict(list)
    for way in ways:
        if way.kind == "curb":  # the curbs are the first lines
            pieces[way.line].append(way)
    return [pair for i, of_line in pieces.items() for pair in pairwise(of_line + of_line[: curbs[i].is_closed])]


def _near(path: str | os.PathLike[str], ways: list[Way], paths: list[Points]) -> list[Way]:
    """The ways where the tracks are; all without tracks."""
    if not paths or not ways:
        return ways
    every, ends = np.concatenate(paths), np.array([(way.start, way.start + way.vector) for way in ways])
    low, high = every.min(axis=0) - _NEAR_M, every.max(axis=0) + _NEAR_M
    near = np.all((ends.max(axis=1) > low) & (ends.min(axis=1) < high), axis=1)
    if not near.any():
        expected = "tracks in metres in the frame of the map, near {:.0f}, {:.0f} (for degrees see --origin)"
        found = "tracks near {:.0f}, {:.0f}".format(*np.median(every, axis=0))
        raise FormatError(str(path), 0, expected.format(*np.median(ends, axis=(0, 1))), found)
    return [way for way, kept in zip(ways, near) if kept]


def _positions(
    path: str | os.PathLike[str], nodes: dict[int, Any], origin: tuple[float, float] | None
) -> dict[int, Points]:
    if all("local_x" in tags and "local_y" in tags for _, tags in nodes.values()):
        names = "local_x", "local_y"
        return {i: np.array([_metres(path, tags, name) for name in names]) for i, (_, tags) in nodes.items()}
    if any(at is None for at, _ in nodes.values()):
        raise FormatError(str(path), 0, "nodes with lat and lon, or local_x and local_y", "a node without")
    mean = np.mean([at for at, _ in nodes.values()], axis=0)
    if origin is None and np.abs(mean).max() > 0.1:
        where = "--origin LAT LON, the latitude and longitude of the point (0, 0) of the tracks"
        raise FormatError(str(path), 0, where, "none, and a map in degrees around {:.5f} {:.5f}".format(*mean))
    origin = origin or (0.0, 0.0)
    phi = np.radians(origin[0])  # metres of a degree of latitude and longitude, WGS 84
    scale = 111132.95 - 559.82 * np.cos(2 * phi), 111412.84 * np.cos(phi) - 93.5 * np.cos(3 * phi)
    return {i: ((at - origin) * scale)[::-1] for i, (at, _) in nodes.items()}


def _metres(path: str | os.PathLike[str], tags: dict[str, str], name: str) -> float:
    try:
        number = float(tags[name])
    except ValueError:
        number = np.nan
    if not np.isfinite(number):
        raise FormatError(str(path), 0, f"numbers in {name} of the nodes", repr(tags[name]))
    return number


def _kind(tags: dict[str, str]) -> str | None:
    if tags.get("type") in ("curbstone", "road_border") or tags.get("barrier") == "kerb":
        return "curb"
    if tags.get("type") in ("zebra", "zebra_marking", "pedestrian_marking"):
        return "edge"
    if "crossing" in (tags.get("footway"), tags.get("highway")):
        return "crossing"
    return "walk" if tags.get("highway") in ("footway", "pedestrian") or tags.get("footway") == "sidewalk" else None


def _between(left: Points, right: Points) -> tuple[Any, float]:
    """The centre line of a strip between two straight edges, and its width."""
    left, right = left[[0, -1]], right[[0, -1]]
    if (left[1] - left[0]) @ (right[1] - right[0]) < 0:
        right = right[::-1]
    centre = (left + right) / 2
    width_m = abs(_cross(_unit(centre[1] - centre[0]), centre[0] - left[0])) * 2
    return _engine("shapely").LineString(centre), float(width_m)


def _paired(edges: list[Points]) -> list[tuple[Any, float]]:
    """Strips between each edge of a crosswalk and the one nearest to it."""
    strips = []
    while len(edges) > 1:
        edge = edges.pop()
        edges.sort(key=lambda other: float(np.hypot(*(other.mean(0) - edge.mean(0)))), reverse=True)
        strip = _between(edge, edges[-1])
        if strip[1] < _WIDEST_M:
            strips.append(strip)
            edges.pop()
    return strips


def _cross(a: Any, b: Any) -> Any:
    return a[0] * b[1] - a[1] * b[0]


def _unit(vector: Points) -> list[float]:
    return [float(entry) for entry in (vector / np.hypot(*vector)).round(6)]


def _corner(a: Way, b: Way, paths: list[Points]) -> dict[str, Any] | None:
    """Where two ways would meet, if they do."""
    sine = abs(_cross(_unit(a.vector), _unit(b.vector)))
    if sine <= _SMALLEST_SINE:
        return None
    shares = np.linalg.solve(np.c_[a.vector, -b.vector], b.start - a.start)  # 0 and 1 at the ends
    origin = a.start + shares[0] * a.vector
    if any(np.hypot(*way.vector) * max(-s, s - 1.0) > _REACH_M for way, s in zip((a, b), shares)):
        return None
    axes = [(way.centre - origin) * (-1.0 if way.kind == "crossing" else 1.0) for way in (a, b)]  # it leaves the block
    first, second = axes if _cross(*axes) > 0 else axes[::-1]
    return {
        "origin": origin.round(3).tolist(),
        "axis_1": _unit(first),
        "axis_2": _unit(second),
        "sidewalk_width_m": round((a.width_m + b.width_m) / 2, 2),
        "origin_uncertainty_m": round(float(np.hypot(a.error_m(shares[0]), b.error_m(shares[1])) / sine), 2),
        "axis_uncertainty_deg": round(float(np.degrees(max(a.heading_error_rad, b.heading_error_rad))), 2),
        "tracks": sum(bool(np.hypot(*(path - origin).T).min() < _PASS_M) for path in paths),
    }


def _strip(way: Way, paths: list[Points]) -> dict[str, Any]:
    """A way to walk on. A track that walks half of it within it, or 5 m, passes it."""
    length_m = float(np.hypot(*way.vector))
    passing = 0
    for path in paths:
        along = (path - way.centre) @ way.vector / length_m
        across = _cross(way.vector, (path - way.centre).T) / length_m
        within = along[(np.abs(along) < length_m / 2) & (np.abs(across) < way.width_m / 2)]
        passing += bool(within.size and np.ptp(within) > min(length_m / 2, 5.0))
    return _entry(way.centre, way.vector, way.width_m, (way.error_m(0.5), way.heading_error_rad), passing)


def _crossed(curbs: list[Any], paths: list[Points]) -> list[dict[str, Any]]:
    """The crosswalks of a map without: the median of the parts of tracks between two curbs."""
    shapely = _engine("shapely")
    sides = [curb for curb in curbs if not curb.is_ring]  # islands are rings
    parts = defaultdict(list)
    for path in paths if len(sides) > 1 else []:
        distances = shapely.distance(shapely.points(path), np.array(sides)[:, None])
        nearest = np.where(distances.min(axis=0) < _CURB_M, distances.argmin(axis=0), -1)
        for i, j in pairwise(np.flatnonzero(nearest >= 0)):
            if nearest[i] != nearest[j]:
                first, second = sorted((i, j), key=lambda at: int(nearest[at]))
                parts[nearest[first], nearest[second]].append(path[[first, second]])
    found = []
    for several in (np.array(part) for part in parts.values() if len(part) >= _CROSSINGS):
        (a, b), vectors = np.median(several, axis=0), several[:, 1] - several[:, 0]
        headings = _cross(b - a, vectors.T) / np.hypot(*(b - a)) / np.hypot(*vectors.T)
        # Standard errors of medians, 1.25 times those of means.
        errors = 1.25 / np.sqrt(len(several)) * np.array([np.hypot(*several.mean(axis=1).std(axis=0)), headings.std()])
        found.append(_entry((a + b) / 2, b - a, _WIDTH_M, (errors[0], errors[1]), len(several)))
    return found


def _entry(centre: Points, vector: Points, width_m: float, errors: tuple[float, float], tracks: int) -> dict[str, Any]:
    return {
        "centre": centre.round(3).tolist(),
        "direction": _unit(vector),
        "width_m": round(width_m, 2),
        "centre_uncertainty_m": round(float(errors[0]), 2),
        "direction_uncertainty_deg": round(float(np.degrees(errors[1])), 2),
        "tracks": tracks,
    }
