"""`sila scene make` with `--map`: the scene file on stdout, a summary on stderr; exit 0: done, 1: bad input, 2: wrong usage."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from ._rows import counted
from ._tracks import read_tracks
from .errors import failed
from .maps import scene_json


def run(arguments: list[str]) -> int:
    given = _parser().parse_args(arguments)
    try:
        tracks = read_tracks(
            given.tracks,
            format=given.format,
            frames_per_second=given.fps,
            metres_per_unit=given.metres_per_unit,
            camera=given.camera,
            person_classes=given.person,
        )
        scene = scene_json(given.map, tracks, given.origin)
    except (ValueError, TypeError, ImportError, OSError) as error:
        return failed(error)
    print(json.dumps(scene, indent=2))
    if not given.json:
        print(_summary(scene), file=sys.stderr)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="sila scene make",
        description="Propose a scene file from a map (OpenStreetMap or Lanelet2) and tracks.",
        epilog="example: sila scene make tracks.csv --map place.osm > corner.json",
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("tracks", nargs="+", metavar="TRACKS", help="track files or folders, in the frame of the map")
    add("--map", required=True, metavar="FILE", help="the map: .osm, .osm.gz or .osm.pbf")
    add("--origin", nargs=2, type=float, metavar=("LAT", "LON"), help="of the point (0, 0) of the tracks [0 0]")
    add("--camera", metavar="FILE", help="file with the camera by which pixels become metres")
    add("--person", action="append", default=[], metavar="CLASS", help="class that is a pedestrian; may be repeated")
    add("--format", help="format of the tracks [recognised by content]")
    add("--fps", type=float, help="frames per second, for files with frame numbers")
    add("--metres-per-unit", type=float, help="scale of the positions, e.g. metres per pixel [1]")
    add("--json", action="store_true", help="no summary")
    return parser


def _summary(scene: dict[str, Any]) -> str:
    x, y = scene["origin"]
    passing = "track passes" if scene["tracks"] == 1 else "tracks pass"
    listed = [counted(len(scene[f"{noun}s"]), noun) for noun in ("corner", "crosswalk", "walkway")]
    return (
        f"corner {scene['primary_corner']} at x = {x:.1f} m, y = {y:.1f} m (uncertainty {scene['origin_uncertainty_m']:.1f} m), "
        f"which {scene['tracks']} {passing}; the scene has {listed[0]}, {listed[1]} and {listed[2]}"
    )
