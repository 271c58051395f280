"""Experiment files: JSON to an `Experiment`, the tracks of its scenes read or simulated."""

from __future__ import annotations

import difflib
import json
import os
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import _sila
from .._config import merged
from .._sila import FramedTracks, Scene, Track
from ..errors import FormatError
from .experiment import Experiment, ExperimentMethod, ExperimentScene, Overrides, Settings
from .methods import METHODS, load_method
from .protocol import runs_of, split_scene
from .tables import ALL

KINDS = ("one_place", "places", "transfer")
SPLITS = ("time", "track", "both")
#: The parts of a configuration that decide which windows are scored and how: one for all methods of a scene.
SCORED_ALIKE = (
    "clean",
    "corners",
    "sampling.interval_s",
    "evaluate",
    "predict.observe_s",
    "predict.horizon_s",
)
RANGES = {
    "trials": (1, 10000),
    "test_share": (1e-9, 0.9),
    "test_tracks": (0, 1e9),
    "train_tracks": (0, 1e9),
    "min_track_s": (0, 1e6),
    "batch": (1, 1e6),
    "seed": (0, 9e15),
    "orders": (0, 100000),
    "bootstraps": (100, 1e6),
}


def read_experiment(path: str | os.PathLike[str], overrides: Overrides = Overrides()) -> Experiment:
    """Reads and checks an experiment file, and the tracks of its scenes.

    Raises FormatError for what is no experiment, naming the nearest known key; ValueError for splits larger than the
    data and other contradictions.
    """
    file = os.fspath(path)
    whole = json.loads(_sila.config_from_file(file))
    settings_known = list(Settings.__dataclass_fields__)
    _require_keys(file, whole, "the experiment", ["about", "config", "scenes", "methods", "reference", *settings_known])
    settings = _settings(file, {key: whole[key] for key in settings_known if key in whole}, overrides)
    base = _merged(file, "config", "{}", _part(file, whole, "the experiment", "config"))
    # Mistakes are found before scenes are read, which takes long.
    items = _list(file, whole, "the experiment", "scenes")
    _require_different("scenes", [_scene_name(file, item, f"scene {n}") for n, item in enumerate(items, 1)])
    configs = [_scene_config(file, item, f"scene {n}", base) for n, item in enumerate(items, 1)]
    entries = [
        _entry(file, item, f"method {n}", configs[0])
        for n, item in enumerate(_list(file, whole, "the experiment", "methods"), 1)
    ]
    names = [entry.name(threshold) for entry in entries for threshold in entry.thresholds]
    _require_different("methods", names)
    reference = whole.get("reference", "sila" if "sila" in names else names[0])
    if reference not in names:
        nearest = _nearest(reference, names)
        raise FormatError(file, 0, f"reference to be a method (the nearest is {nearest})", json.dumps(reference))
    scenes = [
        _scene(file, item, f"scene {n}", config, overrides) for n, (item, config) in enumerate(zip(items, configs), 1)
    ]
    methods = [method for entry in entries for method in _methods(file, entry, scenes)]
    experiment = Experiment(settings, scenes, methods, reference, file, overrides)
    _check(experiment)
    return experiment


def _settings(file: str, given: dict[str, Any], overrides: Overrides) -> Settings:
    for name in ("trials", "split", "seed"):
        if getattr(overrides, name) is not None:
            given[name] = getattr(overrides, name)
    if "tracks" in given:
        given["tracks"] = _counts(file, given["tracks"])
    for name, value in given.items():
        default = getattr(Settings, name)
        fits = isinstance(value, (int, float)) if isinstance(default, float) else type(value) is type(default)
        if not fits:
            raise FormatError(file, 0, f"{name} of type {type(default).__name__}", json.dumps(value))
        low, high = RANGES.get(name, (None, None))
        if low is not None and high is not None and not low <= value <= high:
            raise FormatError(file, 0, f"{name} from {low:g} to {high:g}", json.dumps(value))
    for name, known, others in (("kind", KINDS, ["field"]), ("split", SPLITS, [])):
        if given.get(name, known[0]) not in known:
            names = [*known, *others]
            nearest = _nearest(given[name], names)
            raise FormatError(
                file, 0, f"{name} to be one of {', '.join(names)} (the nearest is {nearest})", given[name]
            )
    return replace(Settings(), **given)


def _counts(file: str, value: Any) -> tuple[int, ...]:
    counts = value if isinstance(value, list) else []
    if any(type(n) is not int or n < 0 for n in counts) or sorted(set(counts)) != counts or not counts:
        raise FormatError(file, 0, "tracks as a list of growing numbers from 0", json.dumps(value))
    return tuple(counts)


def _merged(file: str, where: str, base: str, changes: Mapping[str, Any]) -> str:
    """A configuration with changes, whose mistakes name the file and the place in it."""
    try:
        return merged(base, changes)
    except FormatError as error:
        raise FormatError(file, 0, f"{where}: {error.expected}", error.found) from None


def _require_different(what: str, names: Sequence[str]) -> None:
    twice = next((name for name, count in Counter(names).items() if count > 1), None)
    if twice is not None:
        raise ValueError(f"experiment: {what} has '{twice}' twice, names must differ")


def _scene_name(file: str, item: Any, where: str) -> str:
    keys = ["name", "scene", "scenes", "simulate", "noise_m", "test_speed", "config", "used_for_choices"]
    _require_keys(file, item, where, keys)
    name = _text(file, item, where, "name")
    if name == ALL:
        raise FormatError(file, 0, f"{where} with another name, as that of all scenes together is", json.dumps(name))
    return name


def _scene_config(file: str, item: dict[str, Any], where: str, base: str) -> str:
    config = _merged(file, f"{where}, config", base, _part(file, item, where, "config"))
    return _merged(file, where, config, {"simulate": _part(file, item, where, "simulate")})


def _scene(file: str, item: dict[str, Any], where: str, config: str, overrides: Overrides) -> ExperimentScene:
    sources = [key for key in ("scene", "scenes", "simulate") if key in item]
    if len(sources) != 1:
        raise FormatError(file, 0, f"{where} with one of scene, scenes and simulate", str(len(sources)))
    noise_m = item.get("noise_m", 0.0)
    if type(noise_m) not in (int, float) or not 0 <= noise_m <= 10 or (noise_m > 0 and "scene" not in item):
        raise FormatError(file, 0, f"{where} with noise_m as a number from 0 to 10 beside scene", json.dumps(noise_m))
    test_speed = item.get("test_speed", 1.0)
    if type(test_speed) not in (int, float) or not 1 <= test_speed <= 10:
        raise FormatError(file, 0, f"{where} with test_speed as a number from 1 to 10", json.dumps(test_speed))
    if type(used := item.get("used_for_choices", False)) is not bool:
        raise FormatError(file, 0, f"{where} with used_for_choices as true or false", json.dumps(used))
    config, name = merged(config, overrides.config), item["name"]
    print(f"reading {name}", file=sys.stderr)
    if "simulate" in item:
        tracks = FramedTracks.simulated(_along_curbs(config))
    elif "scene" in item:
        tracks = _recorded(file, _text(file, item, where, "scene"), config, overrides, noise_m)
    else:
        files = _list(file, item, where, "scenes")
        tracks = FramedTracks.joined([(Path(s).stem, _recorded(file, s, config, overrides)) for s in files])
    return ExperimentScene(name, tracks, config, tracks.played(test_speed).hash, used, test_speed)


def _along_curbs(config: str) -> str:
    """With frames that have the directions of the curbs, until a method rescales them by its configuration."""
    return json.dumps(json.loads(config) | {"scaling": "mean_width"})


def _recorded(file: str, name: str, config: str, overrides: Overrides, noise_m: float = 0.0) -> FramedTracks:
    folders = [Path(file).parent] + ([Path(overrides.data_dir)] if overrides.data_dir else [])
    for folder in folders:
        if (folder / name).exists():
            scene = Scene.load(folder / name, data_dir=overrides.data_dir or "")
            tracks, _ = _sila.read_files([], scene, None, None, None, None, [], config)
            return FramedTracks(_disturbed(tracks, noise_m) if noise_m > 0 else tracks, scene, _along_curbs(config))
    looked = f" or in {overrides.data_dir}" if overrides.data_dir else " (or in --data-dir, which is not given)"
    raise FormatError(file, 0, f"the scene file beside the experiment file{looked}", json.dumps(name))


def _disturbed(tracks: Sequence[Track], noise_m: float) -> list[Track]:
    """With independent Gaussian noise of each coordinate, the same each time; as of one recording."""
    random = np.random.default_rng(0)
    return [
        Track(track.id, track.times_s, track.positions_m + noise_m * random.standard_normal(track.positions_m.shape))
        for track in tracks
    ]


@dataclass(frozen=True)
class _Entry:
    """An entry of the list of methods: one method, or one a similarity threshold."""

    where: str
    changes: Mapping[str, Any]  #: of the configuration
    thresholds: Sequence[Any]
    method: ExperimentMethod  #: without configurations

    def name(self, threshold: Any) -> str:
        return self.method.name if threshold is None else f"{self.method.name} {json.dumps(threshold)}"


def _entry(file: str, item: Any, where: str, of_scene: str) -> _Entry:
    if isinstance(item, str):
        item = {"method": item}
    _require_keys(file, item, where, ["name", "method", "thresholds", "config", "parameters", "scene"])
    kind = _text(file, item, where, "method") if "method" in item else _text(file, item, where, "name")
    if kind not in METHODS and ".py:" not in kind:
        nearest = _nearest(kind, list(METHODS))
        raise FormatError(file, 0, f"a known method in {where} (the nearest is {nearest})", json.dumps(kind))
    parameters = _part(file, item, where, "parameters")
    cls, missing = None, ""
    try:
        cls = load_method(kind, Path(file).parent, parameters)
    except ImportError as error:
        missing = str(error)
    changes = _part(file, item, where, "config")
    if cls is not None:
        _require_keys(file, parameters, f"{where}, parameters", list(cls.parameters))
    if type(item.get("scene", True)) is not bool:
        raise FormatError(file, 0, f"{where} with scene as true or false", json.dumps(item["scene"]))
    thresholds = _list(file, item, where, "thresholds") if "thresholds" in item else [None]
    _merged(file, f"{where}, config", of_scene, changes)
    for threshold in thresholds if "thresholds" in item else []:
        _merged(file, f"{where}, thresholds", of_scene, {"fuse": {"similarity_threshold": threshold}})
    name = _text(file, item, where, "name") if "name" in item else kind
    method = ExperimentMethod(name, kind, parameters, [], cls, missing, item.get("scene", True))
    return _Entry(where, changes, thresholds, method)


def _methods(file: str, entry: _Entry, scenes: Sequence[ExperimentScene]) -> list[ExperimentMethod]:
    made = []
    for threshold in entry.thresholds:
        configs = []
        for scene in scenes:
            config = _merged(file, f"{entry.where}, config", scene.config, entry.changes)
            _require_scored_alike(file, entry.where, scene.config, config)
            if threshold is not None:
                config = merged(config, {"fuse": {"similarity_threshold": threshold}})
            configs.append(config)
        made.append(replace(entry.method, name=entry.name(threshold), configs=configs))
    return made


def _require_scored_alike(file: str, where: str, of_scene: str, of_method: str) -> None:
    def scored(config: str) -> list[Any]:
        values = []
        for path in SCORED_ALIKE:
            value = json.loads(config)
            for key in path.split("."):
                value = value[key]
            values.append(value)
        return values

    if scored(of_scene) != scored(of_method):
        expected = f"{where} to leave {', '.join(SCORED_ALIKE)} unchanged, so that all are scored alike"
        raise FormatError(file, 0, expected, "a change of one of them")


def _check(experiment: Experiment) -> None:
    settings, scenes, methods = experiment.settings, experiment.scenes, experiment.methods
    if settings.train_tracks > 0 and settings.test_tracks == 0:
        raise ValueError("experiment: train_tracks needs test_tracks beside it")
    if settings.tracks and (settings.every_episode or settings.kind == "transfer"):
        raise ValueError("experiment: tracks goes neither with every_episode nor with the kind transfer")
    if settings.kind != "one_place" and not all(method.scene for method in methods):
        raise ValueError("experiment: a method without a scene knows one place, so it needs the kind one_place")
    if settings.kind != "one_place" and len(scenes) < 2:
        raise ValueError("experiment: scenes = one, this kind needs at least two")
    _require_different("the folder runs", [run.file for run in runs_of(experiment)])
    for scene in scenes:
        for split in settings.splits:
            split_scene(scene, settings, 1, split)
    if settings.kind == "one_place":
        return
    for method in methods:  # a model goes from one scene to the next
        for scene, config in zip(scenes, method.configs):
            if _learnt_by(config) != _learnt_by(method.configs[0]):
                expected = (
                    "scenes of one configuration, as a model goes from one to the next "
                    '(put it in the "config" of the experiment)'
                )
                raise FormatError(experiment.file, 0, expected, f"another for {scene.name}")


def _learnt_by(config: str) -> dict[str, Any]:
    """A configuration without how its scene was simulated."""
    return {name: value for name, value in json.loads(config).items() if name != "simulate"}


def _nearest(name: Any, known: list[str]) -> str:
    return difflib.get_close_matches(str(name), known, 1, 0.0)[0]


def _require_keys(file: str, item: Any, where: str, known: list[str]) -> None:
    if not isinstance(item, dict):
        raise FormatError(file, 0, f"{where} to be an object", json.dumps(item))
    for key in item:
        if key not in known:
            nearest = f" (the nearest is {_nearest(key, known)})" if known else ""
            raise FormatError(file, 0, f"a known key in {where}{nearest}", json.dumps(key))


def _part(file: str, item: dict[str, Any], where: str, key: str) -> dict[str, Any]:
    part = item.get(key, {})
    if not isinstance(part, dict):
        raise FormatError(file, 0, f"{where}, {key} to be an object", json.dumps(part))
    return part


def _text(file: str, item: dict[str, Any], where: str, key: str) -> str:
    if not isinstance(item.get(key), str):
        raise FormatError(
            file, 0, f'{where} with a text "{key}"', json.dumps(item[key]) if key in item else "no such key"
        )
    return str(item[key])


def _list(file: str, item: dict[str, Any], where: str, key: str) -> list[Any]:
    if not isinstance(item.get(key), list) or not item[key]:
        found = json.dumps(item[key]) if key in item else "no such key"
        raise FormatError(file, 0, f'{where} with a list "{key}" that is not empty', found)
    return list(item[key])
