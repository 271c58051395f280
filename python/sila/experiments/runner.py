"""Does the runs of an experiment, side by side if asked, and keeps their results."""

from __future__ import annotations

import json
import os
import sys
import time
import traceback
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from .. import _sila
from .._rows import number
from .._sila import FramedTracks, Prediction, WindowSet, person_of
from .changes import forecasts_of
from .curves import point_of
from .experiment import Experiment, ExperimentMethod, Overrides
from .markdown import build_hash, hash_of, kept_json, write_text
from .measures import measures_of, modes_measures, modes_of, stepwise_measures
from .method import Forecast, Method, batches_of, checked
from .methods import source_of
from .neighbours import inputs_of
from .protocol import Protocol, Run, TestSite, first_tracks, protocol_of, runs_of
from .read import read_experiment
from .report import write_results
from .scores import sums_of

Json = dict[str, Any]
#: Of what `do_run` gives.
RESULT_KEYS = {"trial", "order", "split", "scene", "method", "published", "checkpoints", "places", "learning_curve"}
#: The kernel's energy counters (Linux; many machines let only root read them).
ENERGY_COUNTERS = Path("/sys/class/powercap")


def do_run(experiment: Experiment, run: Run) -> Json:
    """The result of a run: a checkpoint an episode, the scores after the last, and the learning curve if asked for."""
    counts, protocol = experiment.settings.tracks, protocol_of(experiment, run)
    entry = experiment.methods[run.method_index]
    result: Json = {key: value for key, value in asdict(run).items() if key in ("trial", "order", "split", "scene")}
    result |= {"method": run.method, "published": entry.cls is not None and entry.cls.published}
    curve = []
    for point, count in enumerate([*counts, None], 1):
        training = protocol.training if count is None else first_tracks(protocol.training, count)
        if count is not None and sum(map(len, training)) == sum(map(len, protocol.training)):
            continue
        checkpoints, places = learn(experiment, run, replace(protocol, training=training))
        last = {key: checkpoints[-1][key] for key in ("tracks", "size")}
        last |= {"episode": point, "seconds": sum(checkpoint["seconds"] for checkpoint in checkpoints)}
        curve.append(last | {"places": {name: point_of(site) for name, site in places.items()}})
    return result | {"checkpoints": checkpoints, "places": places, "learning_curve": curve if counts else []}


def method_and_batches(experiment: Experiment, run: Run, protocol: Protocol) -> tuple[Method, list[FramedTracks]]:
    """A method that begins with nothing, and what it learns one after another."""
    entry, batch = experiment.methods[run.method_index], experiment.settings.batch
    assert entry.cls is not None
    config = entry.configs[run.scene_index]
    method = entry.cls(config, batch=batch, seed=run.trial, scene=run.scene, **entry.parameters)
    if method.elsewhere:
        method.begin_with(protocol.elsewhere)
    if not method.at_once:
        return method, list(batches_of(protocol.training, batch))
    if len(protocol.training) == 1:
        return method, protocol.training
    return method, [FramedTracks.joined([(str(n), tracks) for n, tracks in enumerate(protocol.training, 1)])]


def energy_counters() -> list[tuple[int, int]]:
    """Of each processor package: its counter [µJ], and the value after which it begins again. None if not readable."""
    zones = sorted(ENERGY_COUNTERS.glob("intel-rapl:?"))
    try:
        return [(int((z / "energy_uj").read_text()), int((z / "max_energy_range_uj").read_text())) for z in zones]
    except OSError:
        return []


def joules_since(before: Sequence[tuple[int, int]]) -> float:
    """What the processor packages used since then, for this and all other programs."""
    return sum((now - then) % (most + 1) for (then, most), (now, _) in zip(before, energy_counters())) / 1e6


def learn(experiment: Experiment, run: Run, protocol: Protocol) -> tuple[list[Json], Json]:
    """The checkpoints of a method that begins with nothing, and its scores after the last of them."""
    settings, config = experiment.settings, experiment.methods[run.method_index].configs[run.scene_index]
    method, batches = method_and_batches(experiment, run, protocol)
    checkpoints: list[Json] = []
    places: Json = {}
    tracks = 0
    batches = batches or protocol.training  # of no tracks: what the method says before it learns
    for episode, batch in enumerate(batches, 1):
        tracks += len(batch)
        started, counters = time.process_time(), energy_counters()
        method.fit(batch) if method.at_once else method.partial_fit(batch)
        seconds = time.process_time() - started
        checkpoint: Json = {"episode": episode, "tracks": tracks, "size": number_of(method, "size"), "seconds": seconds}
        if counters:
            checkpoint["joules"] = joules_since(counters)
        last = episode == len(batches)
        for site in protocol.test_sites if last or settings.every_episode else ():
            scores, brief = score(method, site, config, with_measures=last)
            checkpoint.setdefault("places", {})[site.name] = brief
            if last:
                places[site.name] = scores
        checkpoint["size"] = number_of(method, "size")
        if last:
            checkpoint["bytes"] = number_of(method, "bytes")
        checkpoints.append(checkpoint)
    return checkpoints, places


def number_of(method: Method, name: str) -> int | float:
    """The size or the bytes of a method, also of numbers of NumPy, which JSON does not take."""
    found = number(f"{type(method).__name__}.{name}", getattr(method, name))
    if not np.isfinite(found):
        raise ValueError(f"{type(method).__name__}.{name}: expected a finite number, found {found}")
    return int(found) if found.is_integer() else found


def score(method: Method, site: TestSite, config: str, *, with_measures: bool) -> tuple[Json, Json]:
    """The scores of a method at a scene, and what a checkpoint keeps of them."""
    stride_s = json.loads(config)["evaluate"]["stride_s"]
    windows = site.test.windows(config, stride_s, site.present)
    inputs = inputs_of(method, windows, site.present)
    started = time.process_time()
    found = method.predict(*inputs)
    seconds = time.process_time() - started
    found = checked(found, windows, method)
    predictions = predictions_of(windows, found) if isinstance(found, Forecast) else found
    evaluation_json, windows_json = _sila.scores_of(predictions, site.test, site.support, config)
    evaluation, scored = json.loads(evaluation_json), json.loads(windows_json)
    brief = {
        name: {"windows": group["windows"], **{k: group["horizons"][-1][k] for k in ("model", "constant_velocity")}}
        for name, group in evaluation["groups"].items()
        if group["windows"] > 0
    }
    if not with_measures:
        return {}, brief
    truth_m = np.asarray(windows.future_m).reshape(len(windows), windows.steps, 2)
    means = modes_of(predictions)
    modes = modes_of(found) if stepwise(found) else means
    moving, people = [w["moving"] for w in scored], [person_of(w["track"]) for w in scored]
    more, reliability = measures_of(modes, truth_m, moving, people)
    more |= modes_measures(means, [prediction.nearest_probabilities for prediction in predictions], truth_m)
    if stepwise(found):
        more |= stepwise_measures(modes, truth_m)
    scores = sums_of(scored, more)
    horizons_s = [row["horizon_s"] for row in evaluation["groups"]["all"]["horizons"]]
    scores |= {"changes": forecasts_of(scored, horizons_s), "reliability": reliability, "evaluation": evaluation}
    scores["seconds_per_prediction"] = seconds / max(1, len(windows))
    return scores, brief


def predictions_of(windows: WindowSet, forecast: Forecast) -> list[Prediction]:
    """A forecast as the library's predictions; of weights that change from step to step the means."""
    weights = forecast.weights.mean(2) if stepwise(forecast) else forecast.weights
    return _sila.predictions_of(windows, weights, forecast.paths_m, forecast.covariances_m2, forecast.fallback)


def stepwise(found: Forecast | Sequence[Prediction]) -> bool:
    return isinstance(found, Forecast) and found.weights.ndim == 3


def key_of(experiment: Experiment, run: Run, build: str) -> Json:
    """What the result of a run depends on. Trials that are added later leave the earlier ones as they are."""
    settings = {k: v for k, v in asdict(experiment.settings).items() if k not in ("trials", "bootstraps", "split")}
    method: ExperimentMethod = experiment.methods[run.method_index]
    one = experiment.settings.kind == "one_place" and not (method.cls is not None and method.cls.elsewhere)
    scenes = [experiment.scenes[run.scene_index]] if one else experiment.scenes
    source = "" if method.cls is None else source_of(method.kind, Path(experiment.file).parent)
    return {
        "version": _sila.version,
        "build": build,
        "experiment": hash_of(settings, run.split),
        "tracks": hash_of([[scene.name, scene.tracks_hash] for scene in scenes]),
        "method": hash_of(method.kind, dict(method.parameters), method.configs[run.scene_index], method.scene, source),
    }


_NAMES = {
    "version": "version of sila",
    "experiment": "setting of the experiment",
    "tracks": "set of tracks",
    "method": "configuration of the method",
    "build": "build of sila",
}


def kept_result(path: Path, key: Json, redo: bool) -> Json | None:
    """The result of an earlier run, if there is one. Raises ValueError if it is damaged or was made otherwise, unless
    `redo`."""
    if not path.exists():
        return None
    result = kept_json(path)
    found = result.get("key")
    kept: Json = found if isinstance(found, dict) else {}
    whole = kept != {} and (kept != key or result.keys() >= RESULT_KEYS)
    if whole and kept == key:
        return result
    if redo:
        return None
    if not whole:
        raise ValueError(f"experiment: the run file {path} is damaged; delete it or give --redo")
    other = next((text for name, text in _NAMES.items() if kept.get(name) != key[name]), "something else")
    raise ValueError(
        f"experiment: {path} was made with another {other}; name another --out, or say --redo to make such results anew"
    )


def run_experiment(
    experiment: Experiment, out: str | os.PathLike[str], *, redo: bool = False, workers: int = 1
) -> Json:
    """Does all runs that are not in `out` yet, and writes the tables after each trial; gives what results.json holds.

    `workers` processes do runs side by side; each reads the experiment again.
    """
    folder, build, runs = Path(out), build_hash(), runs_of(experiment)
    if not runs:
        reasons = [f"{m.name}: {m.missing or _not_for(m)}" for m in experiment.methods]
        raise ValueError(f"experiment: expected a method that can run here, found none ({'; '.join(reasons)})")
    (folder / "runs").mkdir(parents=True, exist_ok=True)
    results: list[Json | None] = []
    for run in runs:
        results.append(kept_result(folder / "runs" / run.file, key_of(experiment, run, build), redo))
    missing = [i for i, result in enumerate(results) if result is None]
    if len(missing) < len(runs):
        print(f"{len(runs) - len(missing)} of {len(runs)} runs are there from before", file=sys.stderr)
    trial = 0
    for done, (i, result) in enumerate(_done(experiment, [runs[i] for i in missing], missing, workers), 1):
        result["key"] = key_of(experiment, runs[i], build)
        write_text(folder / "runs" / runs[i].file, json.dumps(result) + "\n")
        results[i] = result
        print(f"{done}/{len(missing)}: {_described(result)}", file=sys.stderr)
        finished = _finished_trials(runs, results)
        if finished > trial and done < len(missing):
            trial = finished
            write_results(folder, experiment, [r for r in results if r is not None and r["trial"] <= trial], trial)
    return write_results(folder, experiment, [r for r in results if r is not None], experiment.settings.trials)


def _not_for(method: ExperimentMethod) -> str:
    reasons = (method.cls.not_for(json.loads(config)) for config in method.configs if method.cls is not None)
    return next(filter(None, reasons), "no run")


def _finished_trials(runs: Sequence[Run], results: Sequence[Json | None]) -> int:
    open_trials = [run.trial for run, result in zip(runs, results) if result is None]
    return min(open_trials) - 1 if open_trials else runs[-1].trial


_worker_experiment: Experiment | None = None


def _start_worker(file: str, overrides: Overrides, threads: int) -> None:
    global _worker_experiment
    _sila.limit_threads(threads)
    _worker_experiment = read_experiment(file, overrides)


def _work(run: Run) -> Json:
    assert _worker_experiment is not None
    return _named(_worker_experiment, run)


def _named(experiment: Experiment, run: Run) -> Json:
    try:
        return do_run(experiment, run)
    except Exception as error:
        file = experiment.methods[run.method_index].kind.partition(":")[0]
        if any(Path(frame.filename).name == Path(file).name for frame in traceback.extract_tb(error.__traceback__)):
            traceback.print_exception(error)  # a mistake in a method of one's own
        where = f"trial {run.trial}, {run.scene}, {run.method}"
        raise RuntimeError(f"experiment: {where}: {str(error) or type(error).__name__}; what was finished is kept") from error


def _done(
    experiment: Experiment, runs: Sequence[Run], indices: Sequence[int], workers: int
) -> Iterator[tuple[int, Json]]:
    if workers <= 1:
        for i, run in zip(indices, runs):
            yield i, _named(experiment, run)
        return
    threads = max(1, (os.cpu_count() or 1) // workers)
    context = get_context("spawn")  # the threads of the library do not survive a fork
    starting = (experiment.file, experiment.overrides, threads)
    with ProcessPoolExecutor(workers, context, _start_worker, starting) as pool:
        yield from zip(indices, pool.map(_work, runs))


def _described(result: Json) -> str:
    last = result["checkpoints"][-1]
    seconds = sum(c["seconds"] for c in result["checkpoints"]) / len(result["checkpoints"])
    sums = [site["groups"]["moving"] for site in result["places"].values()]
    constant = sum(s["constant_mhd_m"] for s in sums)
    ratio = f"{sum(s['mhd_m'] for s in sums) / constant:.3f}" if constant > 0 else "–"
    order = f", order {result['order']}" if result["order"] else ""
    return (
        f"trial {result['trial']}{order}, split by {result['split']}, {result['scene']}, {result['method']}: "
        f"wMHD / CV {ratio}, size {last['size']}, {seconds:.3f} s per episode"
    )
