"""The verbs of sila. Every number comes from the C++ library."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _sila
from ._config import ConfigLike, merged
from ._evaluation import Evaluation
from ._predictions import Predictions
from ._progress import bar
from ._rows import counted, number, warn, whole
from ._sila import Model, Scene, Track
from ._tracks import SceneLike, Tracks, TracksLike, as_scene, as_tracks, clean, listed

_CHUNK = 64  # tracks between two moves of the progress bar


def learn(
    tracks: TracksLike,
    *,
    scene: SceneLike | None = None,
    model: Model | None = None,
    batch: int = 20,
    units: str | None = None,
    frames_per_second: float | None = None,
    config: ConfigLike = None,
    threads: int = 0,
    progress: bool | None = None,
) -> Model:
    """Learns tracks, `batch` per episode, as `sila learn` does. Returns a new model, which continues `model` if given.

    `scene` has the corners. Without it a new model makes a frame from its first batch and keeps it. Each batch is
    predicted before it is learnt, and the errors calibrate the model. `config` changes the configuration of `model`.
    `threads`: 0 means all. `progress`: None shows a bar in a terminal or a notebook.

    `units`: "pixels" for files, tables and arrays in pixels without a camera. A new model estimates their scale by the
    walking speed and keeps it as `model.config["metres_per_pixel"]`; later input for it is in pixels, too.
    `frames_per_second`: of files with frame numbers.

    Raises ValueError without tracks, and for another value of a field that the model fixed at its beginning (such as
    sampling.interval_s). A UserWarning says when the tracks lie far from what the model knows, when it has learnt them
    already, when the samples of a `Track` are too far apart for seconds, and when no motion was learnt.
    """
    start = _model("model", model) if model is not None else Model()
    settings = _settings("model", start, config)
    if units not in (None, "metres", "pixels"):
        raise ValueError(f"learn: units: expected metres or pixels, found {units!r}")
    if units == "metres" and json.loads(settings)["metres_per_pixel"] > 0:
        raise ValueError("learn: units: metres, but the model was learnt in pixels")
    tracks = listed(tracks)
    if units == "pixels":
        settings = _in_pixels(tracks, scene, start, settings, frames_per_second)
    batch = whole("learn: batch", batch, 1)
    scene = None if scene is None else as_scene(scene)
    given = _some("learn", tracks, scene, settings, frames_per_second)
    with bar(progress, -(-len(given) // batch), "learning", "episode") as moving:

        def on_episode(done: int, of: int, tracks: int, size: int) -> None:
            moving.set_postfix_str(f"size {size}")
            moving.update()

        place = _place(scene, start, given, settings, batch)
        learnt, found = _sila.learn(start, list(given), place, settings, batch, _threads(threads), on_episode)
    warn(found)
    return _learnt(learnt)


def train_batch(
    tracks: TracksLike, *, scene: SceneLike | None = None, config: ConfigLike = None, threads: int = 0
) -> Model:
    """The batch-learning baseline: all tracks in one episode. Its error statistics come from predicting each quarter by
    a model of the earlier quarters (the first tracks by kinematics alone), so that no error is of a learnt window.
    Raises ValueError without tracks."""
    settings = merged("{}", config)
    scene = None if scene is None else as_scene(scene)
    given = _some("train_batch", tracks, scene, settings)
    place = _place(scene, Model(), given, settings, len(given))
    return _learnt(_sila.train_batch(list(given), place, settings, _threads(threads)))


def _learnt(model: Model) -> Model:
    if not model.size:
        warn(["no motion was learnt: the tracks are too few or too short, or not in metres and seconds"])
    return model


def _in_pixels(tracks: Any, scene: Any, start: Model, settings: str, frames_per_second: float | None) -> str:
    """The settings of a model in pixels: those of a new one get the scale of the first tracks."""
    if isinstance(tracks, (Tracks, Track)) or (isinstance(tracks, list) and any(isinstance(t, Track) for t in tracks)):
        raise ValueError("learn: units: sila.Track is in metres; for pixels give the file, table or arrays")
    if scene is not None:
        raise ValueError("learn: units: a scene is in metres; leave it out for pixels")
    if json.loads(settings)["metres_per_pixel"] > 0:
        return settings
    if start.episodes:
        raise ValueError("learn: units: pixels, but the model was learnt in metres")
    trial = merged(settings, {"metres_per_pixel": _sila.TRIAL_METRES_PER_PIXEL})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # at the scale of the trial units look wrong
        read = as_tracks(tracks, frames_per_second=frames_per_second, config=json.loads(trial))
        scale = _sila.walking_scale(list(read))
    return merged(settings, {"metres_per_pixel": scale})


def _some(
    verb: str, tracks: TracksLike, scene: Scene | None, settings: str, frames_per_second: float | None = None
) -> Tracks:
    given = as_tracks(tracks, scene=scene, frames_per_second=frames_per_second, config=json.loads(settings))
    if len(given) == 0:
        raise ValueError(f"{verb}: tracks: expected at least one, found none")
    apart_s = np.median([(track.times_s[-1] - track.times_s[0]) / max(1, len(track) - 1) for track in given])
    if apart_s > 1.2 * json.loads(settings)["clean"]["max_gap_s"]:  # by `Track`, as others are split at gaps
        doubt = "are the times milliseconds? If they are seconds, set clean.max_gap_s"
        warn([f"{verb}: the samples of a track are {apart_s:.3g} s apart; {doubt}"])
    return given


def fuse(previous: Model, incoming: Model, *, config: ConfigLike = None, threads: int = 0) -> Model:
    """Fuses two models without their tracks, as `sila fuse` does. `config` changes the configuration of `previous`.
    Raises ValueError if the settings of the models differ, or both have learnt one batch. A UserWarning says when a
    model made its frame from tracks and nothing was fused."""
    settings = _settings("previous", previous, config)
    fused: Model = _sila.fuse(previous, _model("incoming", incoming), settings, _threads(threads))
    warn([_sila.warning_of_own_frames(previous, incoming, fused)])
    return fused


def make_prior(models: Iterable[Model] | None = None, *, config: ConfigLike = None) -> Model:
    """The first model of a new place, as by `sila prior make`: how people walk, from models of other places.
    Without models it is learnt from simulated pedestrians with the configuration `config`. Raises ValueError if no
    model has error statistics, or two have learnt one batch."""
    if models is None:
        return _sila.simulated_prior(merged("{}", config))
    if config is not None:
        raise TypeError("make_prior: config: expected only without models, whose configuration the prior has")
    if isinstance(models, Model) or not isinstance(models, Iterable):
        raise TypeError(f"models: expected a list of sila.Model, found {type(models).__name__}")
    given = [_model("models", model) for model in models]
    if not given:
        raise ValueError("models: expected at least one sila.Model, found 0; leave models out for simulated pedestrians")
    return _sila.make_prior(given)


def explain_fusion(previous: Model, incoming: Model, *, config: ConfigLike = None) -> dict[str, Any]:
    """What `fuse` would match, fuse, split and relax, and why: the keys of a fusion case (docs/fuse.md), indices from
    1. Raises ValueError as `fuse`."""
    settings = _settings("previous", previous, config)
    result: dict[str, Any] = json.loads(_sila.explain_fusion(previous, _model("incoming", incoming), settings))
    return result


def predict(
    model: Model,
    tracks: TracksLike,
    *,
    scene: SceneLike | None = None,
    stride_s: float = 1.0,
    at_end: bool = False,
    frames_per_second: float | None = None,
    config: ConfigLike = None,
    threads: int = 0,
    progress: bool | None = None,
) -> Predictions:
    """Predicts each track at the first sample at or after predict.min_observe_s, then every `stride_s` seconds. With
    `at_end`, once per track, from its last sample. A track shorter than predict.min_observe_s has no prediction; a
    UserWarning has the number of such tracks.

    Samples after t0 never influence a prediction. `config` changes the configuration of the model, for instance
    {"predict": {"horizon_s": 3}}. `frames_per_second`: of files with frame numbers. Raises ValueError for units or an
    interval other than those of the model, and for a `stride_s` that is not positive.
    """
    settings, given, place = _looked_at(model, tracks, scene, config, frames_per_second)
    stride_s = number("stride_s", stride_s, "seconds")
    at_end = _flag("at_end", at_end)
    ready = _sila.ReadyPredictor(model, settings, given, place)
    found: list[_sila.Prediction] = []
    with bar(progress, len(given), "predicting", "track") as moving:
        for first in range(0, len(given), _CHUNK):
            count = min(_CHUNK, len(given) - first)
            found += ready.predict(first, count, stride_s, at_end, _threads(threads))
            moving.update(count)
    return Predictions(_observed_enough("predict", found, given, settings, at_end))


def explain(
    model: Model,
    tracks: TracksLike,
    *,
    scene: SceneLike | None = None,
    stride_s: float = 1.0,
    at_end: bool = False,
    frames_per_second: float | None = None,
    config: ConfigLike = None,
    threads: int = 0,
) -> list[dict[str, Any]]:
    """Predicts as `predict` does, with explanations: the lines of `sila predict --explain` as dictionaries, each with
    the primitives, transitions and terms behind its modes. Raises as `predict`."""
    settings, given, place = _looked_at(model, tracks, scene, config, frames_per_second)
    stride_s = number("stride_s", stride_s, "seconds")
    at_end = _flag("at_end", at_end)
    ready = _sila.ReadyPredictor(model, settings, given, place)
    lines = ready.explain(stride_s, at_end, _threads(threads))
    return [json.loads(line) for line in _observed_enough("explain", lines, given, settings, at_end)]


def evaluate(
    model: Model,
    tracks: TracksLike,
    *,
    scene: SceneLike | None = None,
    frames_per_second: float | None = None,
    config: ConfigLike = None,
    threads: int = 0,
) -> Evaluation:
    """Scores predictions beside constant velocity on the same windows, as `sila evaluate` does. Raises as `predict`. A
    UserWarning says when the model has learnt some of the tracks: errors on them are too small."""
    settings, given, place = _looked_at(model, tracks, scene, config, frames_per_second)
    numbers, windows, text, warning = _sila.evaluate(model, given, place, settings, _threads(threads))
    warn([warning])
    found = json.loads(numbers)
    means = found["groups"], found["skipped"], found["changes"], found["outcomes"]
    return Evaluation(*means, json.loads(windows), text)


@dataclass(frozen=True)
class Simulation:
    """Simulated pedestrians: `tracks`, cleaned, to be learnt; `reported`, with gaps, as a tracker writes them into a
    file; `truth`, the true path of each reported track (same ids); and the scene."""

    tracks: Tracks
    reported: Tracks
    truth: Tracks
    scene: Scene

    def __repr__(self) -> str:
        return f"Simulation({self.tracks!r}, {self.scene!r})"


def simulate(*, config: ConfigLike = None, **simulate: Any) -> Simulation:
    """Simulates pedestrians at an intersection, and a tracker. Keywords are the fields of the group `simulate`, for
    instance layout="acute", tracks=200, seed=1; the same ones give the same bits. Raises FormatError for an unknown
    field or a value out of range."""
    settings = merged(merged("{}", config), {"simulate": simulate})
    reported, truth, scene = _sila.simulate(settings)
    cleaned = clean(Tracks(reported), "simulation", settings)
    return Simulation(cleaned, Tracks(reported), Tracks(truth), scene)


def _looked_at(
    model: Model,
    tracks: TracksLike,
    scene: SceneLike | None,
    config: ConfigLike,
    frames_per_second: float | None,
) -> tuple[str, list[Track], Scene]:
    """The configuration, the tracks, and the scene that gives them their frames."""
    settings = _settings("model", model, config)
    place = None if scene is None else as_scene(scene)
    read = as_tracks(tracks, scene=place, frames_per_second=frames_per_second, config=json.loads(settings))
    given = list(read)
    return settings, given, _place(place, model, given, settings)


def _place(scene: SceneLike | None, model: Model, tracks: Any, settings: str, batch: int = 1) -> Scene:
    """The scene of the tracks: given, that of the model, or one made from the first `batch` tracks of a new model."""
    given = None if scene is None else as_scene(scene)
    if given is not None:
        warn([_sila.warning_of_moved_corner(model, given)])
    return _sila.scene_for(given, model, list(tracks), batch, settings)


def _model(argument: str, given: Any) -> Model:
    if not isinstance(given, Model):
        raise TypeError(f"{argument}: expected a sila.Model, found {type(given).__name__}")
    return given


def _settings(argument: str, model: Any, config: ConfigLike) -> str:
    """The configuration of a model with changes, which cannot change the units and the interval that it was learnt in."""
    settings = merged(_model(argument, model).config_json, config)
    _sila.require_same_units(model, settings)
    return settings


def _observed_enough(verb: str, found: list[Any], tracks: list[Track], settings: str, at_end: bool) -> list[Any]:
    """What was found, without the entries of tracks too short to be predicted, which has one a track at the end alone."""
    least_s = json.loads(settings)["predict"]["min_observe_s"]
    enough = [track.times_s[-1] - track.times_s[0] >= least_s - 1e-6 for track in tracks]
    if few := enough.count(False):
        short = f"{few} of {counted(len(tracks), 'track')} shorter than predict.min_observe_s = {least_s:g} s"
        warn([f"{verb}: no prediction of {short}"])
    return [entry for entry, is_enough in zip(found, enough) if is_enough] if at_end else found


def _flag(argument: str, value: Any) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{argument}: expected True or False, found {value!r}")
    return bool(value)


def _threads(threads: Any) -> int:
    return whole("threads (0: all)", threads, 0)
