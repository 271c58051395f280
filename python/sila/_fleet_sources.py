"""The sources of a fleet, examined before any work: files with their scenes, and models."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Union

from . import _sila
from ._config import merged
from ._rows import file_named
from ._sila import Model, Scene
from ._tracks import SceneLike, as_scene
from .errors import FormatError

PathLike = Union[str, "os.PathLike[str]"]
#: One path, several, or a scene (None: the one beside it) for each path.
Sources = PathLike | Iterable[PathLike] | Mapping[PathLike, SceneLike | None]

#: Tracks, partitions or contents of a source, and the warnings of its file.
Read = tuple[list[Any], list[str]]

MODEL_SUFFIX = ".sila"
IN_SCENE = (
    "; sila fleet takes them from the scene file: `files[i].frames_per_second`, `files[i].metres_per_unit`, `camera`"
)


@dataclass(frozen=True)
class Source:
    path: str
    scene: Scene
    model: Model | None = None


def sources_in(
    sources: Sources, scene: SceneLike | None, start: Model, settings: str, batch: int
) -> tuple[list[Source], dict[str, str]]:
    """Files with their scenes, models read; and what is not there or cannot be read, with the reason."""
    scenes: dict[str, Scene] = {}
    with_scene: list[tuple[Path, SceneLike | None]] = []
    unread: dict[str, str] = {}
    models: list[tuple[Path, Model]] = []
    for path, own in _wanted(sources, None if scene is None else as_scene(scene)):
        if not path.exists():
            unread[str(path)] = "no such file or folder"
            continue
        files = _files_in(path)
        if not files:
            unread[str(path)] = "a folder without files"
        for file in files:
            if file.suffix == MODEL_SUFFIX:
                models += [(file, loaded) for loaded in _model_in(file, unread, start)]
                continue
            with_scene.append((file, _scene_beside(file) if own is None else own))
    if all(own is None for _, own in with_scene):
        common = _scene_of_tracks(sorted(file for file, _ in with_scene), unread, start, settings, batch)
        with_scene = [(file, common) for file, _ in with_scene if str(file) not in unread]
    found: list[Source] = []
    for file, own in with_scene:
        if own is None:
            unread[str(file)] = _reason_of_no_tracks(file)
        else:
            found.append(Source(str(file), _scene_for(own, scenes, start, settings)))
    usual = next((source.scene for source in found), None)
    for file, loaded in models:
        found.append(Source(str(file), usual or _any_scene(loaded), loaded))
    return found, unread


def _wanted(sources: Sources, scene: Scene | None) -> list[tuple[Path, SceneLike | None]]:
    """The sources as paths, with the scene that is given for each."""
    several: Any = sources
    if isinstance(sources, (str, bytes, os.PathLike)) or not isinstance(sources, Iterable):
        several = [sources]
    scenes: Mapping[Any, SceneLike | None] = sources if isinstance(sources, Mapping) else {}
    wanted: list[tuple[Path, SceneLike | None]] = []
    for source in several:
        path = file_named("learn: sources", source)
        if not os.fspath(source):
            raise ValueError("learn: sources: expected a path, found ''")
        own = scenes.get(source)
        wanted.append((path, scene if own is None else own))
    if not wanted:
        raise ValueError("learn: sources: expected at least one path, found 0")
    return wanted


def _model_in(file: Path, unread: dict[str, str], start: Model) -> list[Model]:
    """The model of a file; none, and the reason in `unread`, if it is damaged. Another schema is rejected, and a model
    without episodes, unless it is the prior that the run continues."""
    try:
        model = Model.load(file)
    except (FormatError, OSError) as error:
        if isinstance(error, FormatError) and error.found.startswith("schema "):
            raise
        unread[str(file)] = str(error)
        return []
    if model.episodes > 0:
        return [model]
    if model.prior_windows > 0 and model == start:
        return []
    found = "a prior" if model.prior_windows > 0 else "an empty model"
    raise FormatError(str(file), 0, "a model with episodes", f"{found}; give it as --model (in Python model=)")


def _files_in(path: Path) -> list[Path]:
    if path.is_file():
        return [path]
    files = sorted(file for file in path.rglob("*") if file.is_file() and not file.name.endswith("scene.json"))
    return [file for file in files if not any(part.startswith(".") for part in file.relative_to(path).parts)]


def _names_beside(file: Path) -> list[str]:
    return [file.stem + ".scene.json", "scene.json"]


def _scene_beside(file: Path) -> Path | None:
    beside = (file.with_name(name) for name in _names_beside(file))
    return next((path for path in beside if path.exists()), None)


def tracks_in(path: str, scene: Scene | None, settings: str, unit: float | None = None) -> Read | str:
    """The tracks of a file and its warnings, which are not shown; or why it cannot be read. `unit`: metres a unit of
    length, and frames a second."""
    try:
        tracks, report = _sila.read_files([Path(path)], scene, None, unit, unit, None, [], settings)
    except (FormatError, OSError) as error:
        return _in_fleet(str(error))
    return tracks, [_in_fleet(text) for text in json.loads(report)["warnings"]]


def _in_fleet(text: str) -> str:
    """A message of the reader, with the place of the values for which a fleet has no options."""
    return text + IN_SCENE if "--fps" in text or "--camera" in text else text


def _scene_of_tracks(
    files: list[Path], unread: dict[str, str], start: Model, settings: str, batch: int
) -> Scene | None:
    """That of the model to go on with, else one made from the first tracks of the first file that can be read."""
    for file in files:
        read = tracks_in(str(file), None, settings)
        if not isinstance(read, str):
            return _sila.scene_for(None, start, read[0], batch, settings)
        unread[str(file)] = read
    return None


def _reason_of_no_tracks(file: Path) -> str:
    """Why a file without a scene has no tracks. A file that has some, in any unit, is rejected."""
    read = tracks_in(str(file), None, merged("{}", None), unit=1.0)
    if isinstance(read, str):
        return read
    names = " or ".join(_names_beside(file))
    raise FormatError(str(file), 0, f"a scene, given or beside it ({names}), as others have one", "none")


def _scene_for(own: SceneLike, scenes: dict[str, Scene], start: Model, settings: str) -> Scene:
    if not isinstance(own, (str, os.PathLike)):
        return _sila.scene_for(as_scene(own), start, [], 1, settings)
    key = os.fspath(own)
    if key not in scenes:
        scenes[key] = _sila.scene_for(as_scene(own), start, [], 1, settings)
    return scenes[key]


def _any_scene(model: Model) -> Scene:
    """For a fleet of models alone, whose sites are their own: only the width is looked at."""
    return Scene(origin=[0, 0], axis_1=[1, 0], axis_2=[0, 1], sidewalk_width_m=model.reference_width_m)


def agreed_settings(settings: str, start: Model, found: list[Source]) -> str:
    """The settings with one reference width for all sites, if curb coordinates are scaled by width."""
    config = json.loads(settings)
    if start.episodes > 0:
        _sila.require_settings(start, found[0].scene if found else _any_scene(start), settings)
    if config["scaling"] == "metres":
        return settings
    if start.episodes > 0:
        width = start.reference_width_m
    elif config["reference_width_m"] > 0.0:
        return settings
    else:
        models = [source.model.reference_width_m for source in found if source.model is not None]
        widths = models or [source.scene.frame().sidewalk_width_m for source in found]
        if not widths:
            return settings
        width = _sila.agreed_width_m(widths)
    return merged(settings, {"reference_width_m": width})


def require_fitting_models(found: list[Source], settings: str) -> None:
    for source in found:
        if source.model is not None:
            try:
                _sila.require_settings(source.model, source.scene, settings)
            except ValueError as error:
                raise FormatError(source.path, 0, "a model that fits the run", str(error)) from error
