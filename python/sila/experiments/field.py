"""The protocol that most papers use on ETH/UCY: eight positions seen, twelve predicted, 0.4 s apart, every run of twenty
samples of one person a window. Experiment files of the kind `field`; docs/experiments.md describes them."""

from __future__ import annotations

import contextlib
import json
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .. import _sila
from .._config import merged
from .._sila import FramedTracks, Scene, person_of
from ..errors import FormatError, UsageError
from .experiment import Overrides, Settings
from .field_measures import collides, mahalanobis_measures, path_measures
from .field_report import LEARNT, MIXTURE_WINDOWS, SAMPLES, markdown
from .gaussian_path import folds
from .markdown import build_hash, hash_of, kept_json, write_text
from .measures import modes_of, samples_of
from .method import Array, Method, checked
from .methods import load_method, source_of
from .neighbours import inputs_of
from .read import _list, _require_different, _require_keys, _require_scored_alike, _settings, _text
from .sampler import DRAWN, SEEN, STEP_S, Sampler, together
from .trajnet import write_trajnet

CHUNK = 1000  # windows at once
CONFIG = {
    "predict": {
        "observe_s": (SEEN - 1) * STEP_S,
        "horizon_s": DRAWN * STEP_S,
        "mode_horizon_s": DRAWN * STEP_S,
    }
}
_KEYS = ["about", "kind", "scenes", "methods", "seed", "bootstraps", "config"]


@dataclass(frozen=True)
class FieldScene:
    """Tracks of the files of a scene, and its windows: who, when, what was seen and what followed."""

    name: str
    tracks: FramedTracks
    track_ids: list[str]  #: of each window
    frames: Array  #: of each window, t0 in steps of 0.4 s
    seen_m: Array  #: (n, 8, 2)
    true_m: Array  #: (n, 12, 2)


def read_scene(name: str, files: Sequence[str], data: Path, config: str) -> FieldScene:
    parts, walks = [], []
    for file in files:
        if not (data / file).is_file():
            raise FormatError(str(data / file), 0, "a file of tracks below --data-dir", "none")
        scene = Scene(origin=(0, 0), axis_1=(1, 0), axis_2=(0, 1), sidewalk_width_m=2.5)
        tracks, _ = _sila.read_files([str(data / file)], scene, None, None, None, None, [], config)
        parts.append((Path(file).stem, FramedTracks(tracks, scene, config)))
        walks += tracks
    whole = FramedTracks.joined(parts) if len(parts) > 1 else parts[0][1]
    walk_of = dict(zip(whole.ids, walks))
    windows = whole.windows(config, STEP_S)
    seen = []
    for track, t0_s in zip(windows.track_ids, windows.t0_s):
        walk, at = walk_of[track], t0_s + STEP_S * np.arange(1 - SEEN, 1)
        seen.append(np.stack([np.interp(at, walk.times_s, walk.positions_m[:, c]) for c in range(2)], -1))
    frames = np.round(np.asarray(windows.t0_s) / STEP_S).astype(int)
    held = round(STEP_S / windows.interval_s)
    true = np.asarray(windows.future_m)[:, held - 1 :: held]
    return FieldScene(name, whole, windows.track_ids, frames, np.stack(seen), true)


Predicted = tuple[Array, Array, Array]  #: windows (indices), mean paths (n, 12, 2), samples (n, s, 12, 2)


def predicted(method: Method, scene: FieldScene, tracks: FramedTracks, chosen: Array, seed: int) -> Iterator[Predicted]:
    """Of the windows `chosen`, which are those of `tracks`; chunk by chunk."""
    if isinstance(method, Sampler):
        for group in together(scene.tracks, scene.track_ids, scene.frames):
            samples = method.sample(scene.seen_m[group], SAMPLES).transpose(1, 0, 2, 3)
            those = np.isin(group, chosen)
            yield group[those], samples[those].mean(1), samples[those]
        return
    windows = tracks.windows(method.config, STEP_S, scene.tracks)
    modes = modes_of(checked(method.predict(*inputs_of(method, windows, scene.tracks)), windows, method))
    held = round(STEP_S / windows.interval_s)
    weights_of, paths, covariances = (part[:, :, held - 1 :: held] for part in modes)
    random = np.random.default_rng(seed)
    for first in range(0, len(chosen), CHUNK):
        chunk = slice(first, first + CHUNK)
        some = weights_of[chunk], paths[chunk], covariances[chunk]
        weights = some[0] / some[0].sum(1, keepdims=True)
        mean = np.einsum("nkt,nktc->ntc", weights, some[1])
        yield chosen[chunk], mean, samples_of(some, SAMPLES, random, as_paths=True)


def taken(tracks: FramedTracks, chosen: Array) -> FramedTracks:
    return tracks.take(np.flatnonzero(chosen).tolist())


def learnt_parts(scenes: Sequence[FieldScene], index: int, learnt: str, seed: int) -> Iterator[tuple[Any, Any, Any]]:
    """(to learn from, held back, windows of the held back) of a scene; in place one a fold. A person is in one fold."""
    scene = scenes[index]
    if learnt != "in_place":
        others = [(other.name, other.tracks) for i, other in enumerate(scenes) if i != index]
        yield FramedTracks.joined(others), scene.tracks, np.arange(len(scene.track_ids))
        return
    person: Any = np.unique([person_of(track) for track in scene.tracks.ids], return_inverse=True)[1]
    for rest, fold in folds(person, seed=seed):
        held_back = taken(scene.tracks, fold)
        yield taken(scene.tracks, rest), held_back, np.flatnonzero(np.isin(scene.track_ids, held_back.ids))


def do_field(scenes: Sequence[FieldScene], index: int, entry: Mapping[str, Any], seed: int, export: Path) -> Any:
    """Measures of a method at a scene: of each window, and of all."""
    scene = scenes[index]
    n = len(scene.track_ids)
    paths, few = np.zeros((n, DRAWN, 2)), np.zeros((n, 3, DRAWN, 2))
    values: dict[str, Array] = {}
    training_s, bytes_ = 0.0, 0
    random = np.random.default_rng(seed)
    mixed = np.sort(random.permutation(n)[:MIXTURE_WINDOWS])
    mixed_samples = np.zeros((len(mixed), SAMPLES, DRAWN, 2))
    for train, test, chosen in learnt_parts(scenes, index, entry["learnt"], seed):
        method = entry["cls"](entry["config"], seed=1, scene=scene.name, **entry["parameters"])
        started = time.process_time()
        if entry["learnt"] != "published":
            method.fit(train)
        training_s += time.process_time() - started
        bytes_ = max(bytes_, method.bytes)
        for at, mean, samples in predicted(method, scene, test, chosen, seed):
            paths[at], few[at] = mean, np.concatenate([mean[:, None], samples[:, :2]], 1)
            for name, value in path_measures(mean, samples, scene.true_m[at]).items():
                values.setdefault(name, np.full(n, np.nan))[at] = value
            here = np.flatnonzero(np.isin(at, mixed))
            mixed_samples[np.searchsorted(mixed, at[here])] = samples[here]
    collisions = np.zeros((n, 2))
    for group in together(scene.tracks, scene.track_ids, scene.frames):
        for kind, others in enumerate((paths, scene.true_m)):
            collisions[group, kind] = collides(paths[group], others[group])
    values |= {"col_1": collisions[:, 0], "col_2": collisions[:, 1]}
    amd = amv = None
    with contextlib.suppress(ImportError):  # needs scikit-learn
        amd, amv = mahalanobis_measures(mixed_samples, scene.true_m[mixed])
    windows = list(zip(scene.track_ids, scene.frames.tolist(), scene.seen_m, scene.true_m))
    write_trajnet(export, scene.name, windows, few)
    table = pd.DataFrame(values).groupby([person_of(track) for track in scene.track_ids])
    sums = table.sum().assign(windows=table.size())
    return {
        "people": sums.to_dict("index"),
        "amd": amd,
        "amv": amv,
        "training_s": None if entry["learnt"] == "published" else training_s,
        "bytes": bytes_,
    }


def read_field(file: str, data_dir: str | None) -> tuple[Settings, list[FieldScene], list[dict[str, Any]]]:
    """Settings, scenes and methods of an experiment file of the kind `field`."""
    whole = json.loads(_sila.config_from_file(file))
    _require_keys(file, whole, "the experiment", _KEYS)
    settings = _settings(file, {key: whole[key] for key in ("seed", "bootstraps") if key in whole}, Overrides())
    if data_dir is None:
        raise UsageError("experiment: this one needs --data-dir, the folder of the recorded tracks")
    config = merged(merged("{}", CONFIG), whole.get("config", {}))
    _require_scored_alike(file, "config", merged("{}", CONFIG), config)
    methods = []
    for n, item in enumerate(_list(file, whole, "the experiment", "methods"), 1):
        _require_keys(file, item, f"method {n}", ["name", "method", "learnt", "parameters"])
        for key in ("name", "method", "learnt"):
            _text(file, item, f"method {n}", key)
        if item["learnt"] not in LEARNT:
            raise FormatError(file, 0, f"learnt to be one of {', '.join(LEARNT)}", item["learnt"])
        entry = {"cls": None, "parameters": {}, "config": config, **item}
        try:
            entry["cls"] = load_method(item["method"], Path(file).parent, entry["parameters"])
        except ImportError as error:
            print(f"{item['name']}: not run here: {error}", file=sys.stderr)
        methods.append(entry)
    _require_different("methods", [f"{m['name']}, {m['learnt']}" for m in methods])
    scenes, listed = [], _list(file, whole, "the experiment", "scenes")
    if len(listed) == 1 and any(method["learnt"] == "elsewhere" for method in methods):
        raise FormatError(file, 0, "a second scene, because a method learns elsewhere", "one scene")
    for n, item in enumerate(listed, 1):
        _require_keys(file, item, f"scene {n}", ["name", "files"])
        name, files = _text(file, item, f"scene {n}", "name"), _list(file, item, f"scene {n}", "files")
        print(f"reading {name}", file=sys.stderr)
        scenes.append(read_scene(name, files, Path(data_dir), config))
    _require_different("scenes", [scene.name for scene in scenes])
    return settings, scenes, methods


def run_field(file: str, out: str, data_dir: str | None) -> None:
    """Does what is not in `out` yet, writes table.md after each scene, and predictions in TrajNet++'s format."""
    settings, scenes, methods = read_field(file, data_dir)
    if all(entry["cls"] is None for entry in methods):
        raise ValueError("experiment: expected a method that can run here, found none")
    folder, seed, build = Path(out), settings.seed, build_hash()
    (folder / "runs").mkdir(parents=True, exist_ok=True)
    results: list[dict[str, Any]] = []
    for i, scene in enumerate(scenes):
        for m, entry in enumerate(methods):
            if entry["cls"] is None:
                continue
            said = {key: entry[key] for key in ("name", "method", "learnt", "parameters", "config")}
            others = [other.tracks.hash for other in scenes if entry["learnt"] == "elsewhere"]
            source = source_of(entry["method"], Path(file).parent)
            key = hash_of(build, said, source, scene.tracks.hash, others, seed)
            path = folder / "runs" / f"{m:02}-{scene.name}.json"
            kept = kept_json(path) if path.exists() else {}
            if kept.get("key") != key or "people" not in kept:
                export = folder / "trajnet" / f"{m:02}"
                kept = do_field(scenes, i, entry, seed, export)
                kept |= {"key": key, "method": entry["name"], "learnt": entry["learnt"], "scene": scene.name}
                write_text(path, json.dumps(kept) + "\n")
                print(f"{entry['name']}, {LEARNT[entry['learnt']]}, {scene.name}", file=sys.stderr)
            results.append(kept)
        write_text(folder / "table.md", markdown(file, settings, methods, results))
