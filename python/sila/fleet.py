"""Distributed learning on dask.distributed: partitions of the tracks are learnt separately, and fused in a tree.

The C++ library plans the tasks (`plan_fleet`), Dask schedules them. The model is the same to the last bit for any
number of workers, any order in which they finish, and if workers are killed.
"""

from __future__ import annotations

import contextlib
import importlib
import logging
import os
import signal
import time
import uuid
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any

from . import _sila
from ._config import ConfigLike
from ._fleet_sources import Read, Source, Sources, agreed_settings, require_fitting_models, sources_in, tracks_in
from ._progress import bar
from ._rows import counted, warn, whole
from ._sila import Model
from ._tracks import SceneLike
from ._verbs import _flag, _settings
from .errors import FormatError

if TYPE_CHECKING:
    from distributed import Client

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
    """Learns sources in parallel, `partition` tracks per task and `batch` per episode, and fuses the models.

    `sources`: track files, model files (*.sila) that were learnt elsewhere, and folders of them, or a dictionary from
    path to scene. `scene`: that of all sources; without it the scene beside a track file (tracks.scene.json for
    tracks.csv, else scene.json). Without any scene all track files are of one place with one origin; its frame is that
    of `model`, or made from the first tracks of the first readable file by path. A given `model` is continued.
    Episodes that it has, or that are in two sources, are learnt once. `client`: a dask.distributed.Client; without one
    a cluster of this machine's processors, for the time of the call.

    A source that cannot be read is left out and named in `unread`; with `strict` it raises FormatError. Scenes that
    cannot be read, models of another schema and models that cannot be fused raise before anything is learnt.
    """
    start = Model() if model is None else model
    asked = _settings("model", start, config)
    batch, partition = whole("learn: batch", batch, 1), whole("learn: partition", partition, 1)
    strict = _flag("learn: strict", strict)
    if client is not None and not hasattr(client, "submit"):
        raise TypeError(f"learn: client: expected a dask.distributed.Client, found {client!r}")
    began = time.monotonic()
    found, unread = sources_in(sources, scene, start, asked, batch)
    settings = agreed_settings(asked, start, found)
    require_fitting_models(found, settings)
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

    def learn(self, found: list[Source], unread: dict[str, str], start: Model, strict: bool, began: float) -> Outcome:
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
        self, found: list[Source], unread: dict[str, str]
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
            for text in content[1]:
                warn([text])
            for j, (ids, site) in enumerate(content[0]):
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
        uses = Counter(i for _, _, inputs in plan for i in inputs)
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


def _part(read: Read, index: int) -> Any:
    return read[0][index]


def _read(source: Source, partition: int, common: tuple[str, int]) -> Read | str:
    """The partitions of a source and the warnings of its file, or why it cannot be read."""
    if source.model is not None:
        return [(source.model, source.scene)], []
    read = tracks_in(source.path, source.scene, common[0])
    if isinstance(read, str):
        return read
    tracks, warnings = read
    return [(tracks[i : i + partition], source.scene) for i in range(0, len(tracks), partition)], warnings


def _episodes_in(read: Read | str, common: tuple[str, int]) -> Read | str:
    """The episodes and the site of each partition, and the warnings; or why the source cannot be read."""
    if isinstance(read, str):
        return read
    settings, batch = common
    found = []
    for content, scene in read[0]:
        if isinstance(content, Model):
            found.append(_sila.content_of_model(content))
        else:
            found.append(_sila.content_of_tracks(content, scene, batch, settings))
    return found, read[1]


def _task(step: str, partition: Any, left_out: list[str], common: tuple[str, int], *inputs: Any) -> Any:
    settings, batch = common
    if partition is None or isinstance(partition[0], Model):
        return _sila.run_task_on_model(step, partition and partition[0], list(inputs), settings, 1)
    tracks, scene = partition
    return _sila.run_task(step, tracks, scene, batch, left_out, list(inputs), settings, 1)


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
