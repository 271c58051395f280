"""Distributed learning on dask.distributed: partitions of the tracks are learnt apart, and models are fused in a tree.

The C++ library plans the tasks (`plan_fleet`), Dask schedules them. The model is the same to the last bit whatever the
number of workers, the order in which they finish, and workers that are killed.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import logging
import os
import signal
import time
import uuid
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

from . import _sila
from ._config import ConfigLike, merged
from ._progress import bar
from ._rows import counted, whole
from ._sila import Model, Scene
from ._tracks import SceneLike, as_scene, read_tracks
from ._verbs import _settings
from .errors import FormatError

if TYPE_CHECKING:
    from distributed import Client

PathLike = Union[str, "os.PathLike[str]"]
#: One path, several, or a scene (None: the one beside it) for each path.
Sources = PathLike | Iterable[PathLike] | Mapping[PathLike, SceneLike | None]

MODEL_SUFFIX = ".sila"
#: Tracks a task.
PARTITION = 200


@dataclass(frozen=True)
class Outcome:
    """The model that a fleet learnt, and the sources that it could not read."""

    model: Model
    #: Reasons by source.
    unread: dict[str, str] = field(default_factory=dict)
    sources: int = 0
    partitions: int = 0
    #: Episodes that were in the model before, or in two sources.
    known_episodes: int = 0
    tracks: int = 0
    seconds: float = 0.0

    def __repr__(self) -> str:
        return (
            f"Outcome({self.model!r}; {counted(self.partitions, 'partition')} of {counted(self.sources, 'source')}, "
            f"{counted(self.known_episodes, 'episode')} known before, {counted(len(self.unread), 'source')} unread, "
            f"{self.seconds:.1f} s)"
        )


@dataclass(frozen=True)
class _Source:
    path: str
    scene: Scene
    model: Model | None = None


def learn(
    sources: Sources,
    *,
    scene: SceneLike | None = None,
    model: Model | None = None,
    client: Client | None = None,
    batch: int = 20,
    partition: int = PARTITION,
    config: ConfigLike = None,
    strict: bool = False,
    progress: bool | None = None,
) -> Outcome:
    """Learns sources in parallel, `partition` tracks a task and `batch` of them an episode, and fuses the models.

    `sources`: track files, model files (*.sila) that were learnt elsewhere, and folders of them, or a dictionary from
    path to scene. `scene`: that of all sources; without it the scene beside a track file (tracks.scene.json for
    tracks.csv, else scene.json). Without any scene all track files are of one place with one origin; its frame is that
    of `model`, or made from the first tracks of the first file. A given `model` is continued. Episodes that it has, or
    that are in two sources, are learnt once. `client`: a dask.distributed.Client; without one a cluster of this
    machine's processors, for the time of the call.

    A source that cannot be read is left out and named in `unread`; with `strict` it raises FormatError. Scenes that
    cannot be read, models of another schema and models that cannot be fused raise before anything is learnt.
    """
    start = Model() if model is None else model
    asked = _settings("model", start, config)
    batch, partition = whole("learn: batch", batch, 1), whole("learn: partition", partition, 1)
    began = time.monotonic()
    found, unread = _found(sources, scene, start, asked, batch)
    settings = _agreed(asked, start, found)
    for source in found:
        if source.model is not None:
            try:
                _sila.require_settings(source.model, source.scene, settings)
            except ValueError as error:
                raise FormatError(source.path, 0, "a model that can be fused with the others", str(error)) from error
    with local_client() if client is None else contextlib.nullcontext(client) as cluster:
        run = _Run(cluster, settings, batch, max(batch, partition // batch * batch), progress)
        return run.learn(found, unread, start, strict, began)


class _Run:
    """One run on a cluster: futures of what all tasks need, and how far it is."""

    def __init__(self, client: Any, settings: str, batch: int, partition: int, progress: bool | None) -> None:
        self.client = client
        self.settings = settings
        self.batch = batch
        self.partition = partition
        self.progress = progress
        self.name = f"sila-{uuid.uuid4().hex[:8]}"
        self.common = self.submit("settings", _same, (settings, batch))

    def submit(self, name: str, function: Any, *arguments: Any) -> Any:
        """Keys of our own: the scheduler need not look into models to find one."""
        return self.client.submit(function, *arguments, key=f"{self.name}-{name}", pure=False)

    def learn(self, found: list[_Source], unread: dict[str, str], start: Model, strict: bool, began: float) -> Outcome:
        sources = len(found) + len(unread)
        partitions, episodes, sites = self.read(found, unread)
        if unread and (strict or not partitions):
            path, reason = next(iter(unread.items()))
            raise FormatError(path, 0, f"a source that can be read ({len(unread)} of {sources} cannot)", reason)
        chosen = _sila.choose_partitions(episodes, sites, [model for _, model, _ in partitions], start.episode_ids)
        known = sum(map(len, episodes)) - sum(len(episodes[i]) - len(out) for i, out in chosen)
        if any(out for i, out in chosen if partitions[i][1]):
            shared = next(partitions[i][2] for i, out in chosen if out and partitions[i][1])
            raise FormatError(shared, 0, "a model whose episodes are all new or all known", "some of both")
        taken = [(partitions[i][0], out) for i, out in chosen]
        partitions.clear()
        result = self.carry_out(taken, start) if chosen else start
        learnt = result.tracks - start.tracks
        return Outcome(result, unread, sources, len(chosen), known, learnt, time.monotonic() - began)

    def read(
        self, found: list[_Source], unread: dict[str, str]
    ) -> tuple[list[tuple[Any, bool, str]], list[list[str]], list[Any]]:
        """Partitions as futures (with whether they are models, and their source), the episodes and the site of each."""
        reads = [self.submit(f"read-{i}", _read, source, self.partition, self.common) for i, source in enumerate(found)]
        contents = [self.submit(f"content-{i}", _episodes_in, future, self.common) for i, future in enumerate(reads)]
        partitions: list[tuple[Any, bool, str]] = []
        episodes: list[list[str]] = []
        sites: list[Any] = []
        for i, content in enumerate(self.finished(contents, "reading", "source")):
            path = found[i].path
            if isinstance(content, str):
                unread[path] = content
                continue
            for j, (ids, site) in enumerate(content):
                partition = self.submit(f"partition-{i}-{j}", _part, reads[i], j)
                partitions.append((partition, found[i].model is not None, path))
                episodes.append(ids)
                sites.append(site)
        return partitions, episodes, sites

    def carry_out(self, partitions: list[tuple[Any, list[str]]], start: Model) -> Model:
        """Every task of the plan, as soon as what it needs is there."""
        goes_on = start.episodes > 0 or start.prior_windows > 0
        plan = _sila.plan_fleet(len(partitions), goes_on, self.settings)
        values: dict[int, Any] = {_sila.FLEET_NOTHING: None}
        if goes_on:
            values[_sila.FLEET_START] = self.submit("start", _same, start)
        uses: dict[int, int] = {}
        for _, _, inputs in plan:
            for i in inputs:
                uses[i] = uses.get(i, 0) + 1
        with bar(self.progress, len(plan), "learning", "task") as moving:
            for number, (step, partition, inputs) in enumerate(plan):
                of_partition = partitions[partition] if partition >= 0 else (None, [])
                future = self.submit(
                    f"{step}-{number}", _task, step, *of_partition, self.common, *(values[i] for i in inputs)
                )
                future.add_done_callback(lambda _: moving.update())
                values[number] = future
                # Results that no task needs any more are released, so that the cluster frees them at once.
                for i in inputs:
                    uses[i] -= 1
                    if uses[i] == 0 and i >= 0:
                        del values[i]
            partitions.clear()
            result: Model = values[len(plan) - 1].result()
        return result

    def finished(self, futures: list[Any], doing: str, unit: str) -> list[Any]:
        with bar(self.progress, len(futures), doing, unit) as moving:
            for future in futures:
                future.add_done_callback(lambda _: moving.update())
            results: list[Any] = self.client.gather(futures)
        return results


# What runs on the workers. Values come and go by themselves; the library does the rest.


def _same(value: Any) -> Any:
    return value


def _part(parts: list[Any], index: int) -> Any:
    return parts[index]


def _read(source: _Source, partition: int, common: tuple[str, int]) -> list[Any] | str:
    """The partitions of a source, or why it cannot be read."""
    if source.model is not None:
        return [(source.model, source.scene)]
    try:
        tracks = list(read_tracks(source.path, scene=source.scene, config=json.loads(common[0])))
    except (FormatError, OSError) as error:
        return str(error)
    return [(tracks[i : i + partition], source.scene) for i in range(0, len(tracks), partition)]


def _episodes_in(parts: list[Any] | str, common: tuple[str, int]) -> list[tuple[list[str], Any]] | str:
    if isinstance(parts, str):
        return parts
    settings, batch = common
    found = []
    for content, scene in parts:
        if isinstance(content, Model):
            found.append(_sila.content_of_model(content))
        else:
            found.append(_sila.content_of_tracks(content, scene, batch, settings))
    return found


def _task(step: str, partition: Any, left_out: list[str], common: tuple[str, int], *inputs: Any) -> Any:
    settings, batch = common
    if partition is None or isinstance(partition[0], Model):
        return _sila.run_task_on_model(step, partition and partition[0], list(inputs), settings, 1)
    tracks, scene = partition
    return _sila.run_task(step, tracks, scene, batch, left_out, list(inputs), settings, 1)


# Before any work.


def _found(
    sources: Sources, scene: SceneLike | None, start: Model, settings: str, batch: int
) -> tuple[list[_Source], dict[str, str]]:
    """Files with their scenes, models read; and what is not there, with the reason."""
    wanted: list[tuple[Path, SceneLike | None]]
    if isinstance(sources, (str, os.PathLike)):
        wanted = [(Path(sources), scene)]
    elif isinstance(sources, Mapping):
        wanted = [(Path(path), scene if own is None else own) for path, own in sources.items()]
    else:
        wanted = [(Path(path), scene) for path in sources]
    if not wanted:
        raise ValueError("learn: sources: expected at least one path, found 0")
    scenes: dict[str, Scene] = {}
    with_scene: list[tuple[Path, SceneLike | None]] = []
    unread: dict[str, str] = {}
    models: list[tuple[Path, Model]] = []
    for path, own in wanted:
        if not path.exists():
            unread[str(path)] = "no such file or folder"
            continue
        files = _files_in(path)
        if not files:
            unread[str(path)] = "a folder without files"
        for file in files:
            if file.suffix == MODEL_SUFFIX:
                models += [(file, loaded) for loaded in _model_in(file, unread)]
                continue
            with_scene.append((file, _scene_beside(file) if own is None else own))
    if with_scene and all(own is None for _, own in with_scene):
        common = _scene_of_tracks([file for file, _ in with_scene], start, settings, batch)
        with_scene = [(file, common) for file, _ in with_scene]
    found = [_Source(str(file), _scene_for(file, own, scenes, start, settings)) for file, own in with_scene]
    usual = next((source.scene for source in found), None)
    for file, loaded in models:
        found.append(_Source(str(file), usual or _any_scene(loaded), loaded))
    return found, unread


def _model_in(file: Path, unread: dict[str, str]) -> list[Model]:
    """The model of a file; none, and the reason in `unread`, if it is damaged. Another schema is rejected."""
    try:
        return [Model.load(file)]
    except (FormatError, OSError) as error:
        if isinstance(error, FormatError) and error.found.startswith("schema "):
            raise
        unread[str(file)] = str(error)
        return []


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


def _scene_of_tracks(files: list[Path], start: Model, settings: str, batch: int) -> Scene:
    """That of the model to go on with, else one made from the first tracks of the first file that can be read."""
    if start.episodes > 0:
        return _sila.scene_for(None, start, [], batch, settings)
    error: Exception | None = None
    for file in files:
        try:
            tracks = list(read_tracks(file, config=json.loads(settings)))
        except (FormatError, OSError) as unreadable:
            error = error or unreadable
            continue
        return _sila.scene_for(None, start, tracks, batch, settings)
    raise error or FormatError(str(files[0]), 0, "tracks", "none")


def _scene_for(file: Path, own: SceneLike | None, scenes: dict[str, Scene], start: Model, settings: str) -> Scene:
    if isinstance(own, Scene):
        return _sila.scene_for(own, start, [], 1, settings)
    if own is None:
        raise FormatError(
            str(file), 0, f"a scene, given or beside it ({' or '.join(_names_beside(file))}), as others have one", "none"
        )
    key = os.fspath(own)
    if key not in scenes:
        scenes[key] = _sila.scene_for(as_scene(own), start, [], 1, settings)
    return scenes[key]


def _any_scene(model: Model) -> Scene:
    """For a fleet of models alone, whose sites are their own: only the width is looked at."""
    return Scene(origin=[0, 0], axis_1=[1, 0], axis_2=[0, 1], sidewalk_width_m=model.reference_width_m)


def _agreed(settings: str, start: Model, found: list[_Source]) -> str:
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


@contextlib.contextmanager
def local_client(workers: int | None = None) -> Iterator[Client]:
    """A cluster of processes of this machine, one a processor if their number is not said, that lives as long as this.

    Nothing listens outside this machine."""
    dask = engine()
    # Failed tasks raise here; what is logged beside them are connections that end while the cluster closes.
    given = {"n_workers": workers or os.cpu_count(), "threads_per_worker": 1, "silence_logs": logging.CRITICAL}
    with contextlib.ExitStack() as opened:
        resource_tracker.ensure_running()  # its start unblocks interrupts
        # An interrupt waits until the cluster can be closed. Its threads and processes inherit the mask and see none.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        try:
            cluster = opened.enter_context(dask.LocalCluster(**given, dashboard_address="127.0.0.1:0"))
            connected = opened.enter_context(dask.Client(cluster))
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        yield connected


def engine() -> Any:
    """dask.distributed; raises an error with the remedy if it is not installed."""
    try:
        return importlib.import_module("distributed")
    except ImportError as error:
        raise ImportError("sila.fleet needs dask.distributed: pip install 'sila[fleet]'") from error
