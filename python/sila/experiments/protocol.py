"""What each method learns in which order, and where it is scored."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from .. import _sila
from .._sila import FramedTracks, TrainingSupport
from .experiment import Experiment, ExperimentScene, Settings
from .method import batches_of


@dataclass(frozen=True)
class Run:
    """One method in one trial, the smallest piece of work that is kept when an experiment is interrupted."""

    trial: int  #: from 1
    order: int  #: of the scenes, from 1; 0 where there is none
    split: str
    scene: str  #: "all" for `places`
    method: str  #: its name; with " here" where a transfer is compared with learning at the scene itself
    scene_index: int
    method_index: int
    here: bool = True  #: learns at the scene where it is scored

    @property
    def file(self) -> str:
        order = f"-{self.order:03}" if self.order else ""
        split = "" if self.split == "time" else f"-{self.split}"
        return re.sub(r"[^A-Za-z0-9.-]", "_", f"{self.trial:03}{order}-{self.scene}-{self.method}{split}") + ".json"


@dataclass
class TestSite:
    """Tracks held back at one scene, and what its own training tracks tell about their windows."""

    name: str
    test: FramedTracks
    support: TrainingSupport
    present: FramedTracks  #: all of the scene, whose positions until t0 methods with interactions get


@dataclass
class Protocol:
    """Training tracks of one scene after another, and the scenes where the method is scored."""

    training: list[FramedTracks] = field(default_factory=list)
    test_sites: list[TestSite] = field(default_factory=list)
    elsewhere: list[FramedTracks] = field(default_factory=list)  #: of each other scene, for methods that ask for it


def split_scene(
    scene: ExperimentScene, settings: Settings, trial: int, split: str
) -> tuple[FramedTracks, FramedTracks]:
    """(to learn from, held back) in one trial; where counts are asked for, the first tracks to learn from are taken.

    Raises ValueError for a split larger than the data.
    """
    tracks, seed = scene.tracks, settings.seed + trial - 1
    tracks = tracks.take([i for i, seconds in enumerate(tracks.durations_s) if seconds >= settings.min_track_s])
    long_enough = " that are long enough" if settings.min_track_s > 0 else ""
    of_scene = f"experiment: scene '{scene.name}' has {len(tracks)} tracks{long_enough}"
    if len(tracks) < 2:
        raise ValueError(f"{of_scene}, needs at least 2")
    test, train = settings.test_tracks, settings.train_tracks
    if 0 < test and test + train > len(tracks):
        if not settings.take_fewer:
            raise ValueError(
                f"{of_scene}, fewer than test_tracks = {test} and train_tracks = {train} together; "
                "ask for fewer, or set take_fewer"
            )
        test = int(test / (test + train) * len(tracks) + 0.5)
        train = len(tracks) - test
    try:
        if settings.test_tracks == 0:
            sides = tracks.split(settings.test_share, seed, split)
        else:
            learnt, held_back = tracks.split_people(test, seed, split)
            wanted = len(learnt) if settings.train_tracks == 0 else min(train, len(learnt))
            sides = learnt.take(range(wanted)), held_back
    except ValueError as error:
        raise ValueError(f"{of_scene}, {error}") from None
    least = 1 if settings.take_fewer else max(1, settings.train_tracks)
    if trial == 1 and (len(sides[1]) == 0 or len(sides[0]) < least):
        embargo = "; the embargo leaves out those who were there with held-back people" if split == "time" else ""
        raise ValueError(
            f"{of_scene}, of which {len(sides[1])} would be held back and {len(sides[0])} learnt from, must be at "
            f"least 1 and {least}{embargo}"
        )
    return sides


def runs_of(experiment: Experiment) -> list[Run]:
    """All runs, trial by trial, in the order in which they should be done. A method that cannot run here has none."""
    settings = experiment.settings
    methods = [(m, method) for m, method in enumerate(experiment.methods) if method.cls is not None]
    runs = []
    for trial in range(1, settings.trials + 1):
        for split in settings.splits:
            if settings.kind == "places":
                orders = _sila.orders_of(len(experiment.scenes), settings.orders, settings.seed)
                for order in range(1, len(orders) + 1):
                    runs += [Run(trial, order, split, "all", method.name, 0, m) for m, method in methods]
                continue
            for s, scene in enumerate(experiment.scenes):
                for m, method in methods:
                    if method.cls is not None and method.cls.not_for(json.loads(method.configs[s])):
                        continue
                    transfer = settings.kind == "transfer"
                    runs.append(Run(trial, 0, split, scene.name, method.name, s, m, here=not transfer))
                    if transfer:
                        runs.append(Run(trial, 0, split, scene.name, f"{method.name} here", s, m))
    return runs


def protocol_of(experiment: Experiment, run: Run) -> Protocol:
    settings, scenes = experiment.settings, experiment.scenes
    method = experiment.methods[run.method_index]
    config = method.configs[run.scene_index]

    def sides(scene: ExperimentScene) -> tuple[FramedTracks, FramedTracks]:
        train, test = split_scene(scene, settings, run.trial, run.split)
        if method.scene:
            return train.rescaled(config), test.rescaled(config)
        first_batch = next(batches_of([train], settings.batch))
        return train.without_scene(first_batch, config), test.without_scene(first_batch, config)

    def test_site(scene: ExperimentScene, train: FramedTracks, test: FramedTracks) -> TestSite:
        test, present = test.played(scene.test_speed), scene.tracks.played(scene.test_speed)
        return TestSite(scene.name, test, TrainingSupport(train, config), present)

    protocol = Protocol()
    if settings.kind == "places":
        for s in _sila.orders_of(len(scenes), settings.orders, settings.seed)[run.order - 1]:
            train, test = sides(scenes[s])
            protocol.training.append(train)
            protocol.test_sites.append(test_site(scenes[s], train, test))
        return protocol
    scene = scenes[run.scene_index]
    train, test = sides(scene)
    others = [other for s, other in enumerate(scenes) if s != run.scene_index]
    protocol.training = [train] if run.here else [sides(other)[0] for other in others]
    if method.cls is not None and method.cls.elsewhere:
        protocol.elsewhere = [sides(other)[0] for other in others]
    protocol.test_sites = [test_site(scene, train, test)]
    return protocol


def first_tracks(training: Sequence[FramedTracks], count: int) -> list[FramedTracks]:
    """The first `count` tracks, scene after scene."""
    first = []
    for tracks in training:
        first.append(tracks.take(range(min(count, len(tracks)))))
        count -= len(first[-1])
    return [tracks for tracks in first if len(tracks)] or first[:1]
