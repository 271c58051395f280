"""`sila scene make` with `--map`: the scene file on stdout, a summary on stderr; exit 0: done, 1: bad input, 2: wrong usage."""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from typing import Any

from . import _sila
from ._config import assignments
from ._rows import counted, print_warning
from ._sila import Scene
from ._tracks import Tracks, read_tracks
from .errors import FormatError, UsageError, failed
from .maps import scene_json


def run(arguments: list[str]) -> int:
    parser = _parser()
    given, others = parser.parse_known_args(arguments)
    if others:
        parser.error(f"with --map expected only the options above, found {' '.join(others)}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", UserWarning)
            warnings.showwarning = print_warning
            scene = _scene(given) | _kept(given)
    except (ValueError, TypeError, ImportError, OSError, KeyboardInterrupt) as error:
        return failed(error, "nothing was written")
    print(json.dumps(scene, indent=2))
    if not given.json:
        print(_summary(scene), file=sys.stderr)
    return 0


def _scene(given: argparse.Namespace) -> dict[str, Any]:
    try:
        return scene_json(given.map, _tracks(given), given.origin)
    except FormatError:
        raise
    except ValueError as error:  # of an argument: what is wrong with a file is a FormatError
        raise UsageError(str(error)) from None


def _tracks(given: argparse.Namespace) -> Tracks:
    scene = None if given.scene is None else Scene.load(given.scene, data_dir=given.data_dir)
    if not given.tracks and not (scene and scene.files):
        raise UsageError("tracks: expected track files, or --scene with a file that names some; found neither")
    return read_tracks(
        given.tracks or None,
        scene=scene,
        format=given.format,
        frames_per_second=given.fps,
        metres_per_unit=given.metres_per_unit,
        camera=given.camera,
        person_classes=given.person,
        config=assignments(given.config, given.set),
    )


def _kept(given: argparse.Namespace) -> dict[str, Any]:
    """The camera, and what the given scene file says about its recordings, as `scene make` without a map keeps them."""
    kept: dict[str, Any] = {}
    if given.scene is not None:
        scene = json.loads(_sila.config_from_file(given.scene))
        kept = {name: scene[name] for name in ("camera", "files") if name in scene}
    if given.camera is not None:
        camera = json.loads(_sila.config_from_file(given.camera))
        kept["camera"] = camera.get("camera", camera)
    return kept


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="sila scene make",
        description="Propose a scene file from a map (OpenStreetMap or Lanelet2) and tracks.",
        epilog="example: sila scene make tracks.csv --map place.osm > corner.json",
        allow_abbrev=False,
    )
    add = parser.add_argument
    files = "track files or folders, in the frame of the map [those that the scene names]"
    add("tracks", nargs="*", metavar="TRACKS", help=files)
    add("--map", required=True, metavar="FILE", help="the map: .osm, .osm.gz or .osm.pbf")
    add("--origin", nargs=2, type=float, metavar=("LAT", "LON"), help="the point (0, 0) of the tracks [0 0]")
    add("--scene", metavar="FILE", help="scene file: its camera, units and files; its corners are replaced")
    add("--data-dir", default="", metavar="DIR", help="also look here for the files that the scene names")
    scale = parser.add_mutually_exclusive_group()
    camera = "file with the camera by which pixels become metres [that of the scene]"
    scale.add_argument("--camera", metavar="FILE", help=camera)
    add("--person", action="append", default=[], metavar="CLASS", help="class that is a pedestrian; may be repeated")
    add("--format", help="format of the tracks [recognised by content]")
    add("--fps", type=float, help="frames per second, for files with frame numbers")
    scale.add_argument("--metres-per-unit", type=float, help="scale of the positions, e.g. metres per pixel [1]")
    add("--config", metavar="FILE", help="JSON file with configuration")
    add("--set", action="append", default=[], metavar="PATH=VALUE", help="one configuration field; see `sila config`")
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
