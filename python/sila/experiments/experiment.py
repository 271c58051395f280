"""What an experiment is: settings, scenes with their tracks, and methods."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from .._sila import FramedTracks
from .method import Method


@dataclass(frozen=True)
class Settings:
    """What an experiment does with its scenes and methods; docs/experiments.md has the meanings."""

    kind: str = "one_place"
    trials: int = 12
    split: str = "time"
    test_share: float = 0.15
    test_tracks: int = 0
    train_tracks: int = 0
    take_fewer: bool = False
    min_track_s: float = 0.0
    batch: int = 20
    seed: int = 100
    every_episode: bool = False
    tracks: tuple[int, ...] = ()
    orders: int = 1
    bootstraps: int = 2000

    @property
    def splits(self) -> tuple[str, ...]:
        return ("time", "track") if self.split == "both" else (self.split,)


@dataclass(frozen=True)
class ExperimentScene:
    name: str
    tracks: FramedTracks
    config: str  #: JSON
    tracks_hash: str
    used_for_choices: bool = False  #: between methods or settings: reported means are also given without it
    test_speed: float = 1.0  #: the people held back are this many times as fast as recorded


@dataclass(frozen=True)
class ExperimentMethod:
    """A method under one name, with its configuration at each scene."""

    name: str
    kind: str  #: a known method, or "file.py:Class"
    parameters: Mapping[str, Any]
    configs: Sequence[str]
    cls: type[Method] | None  #: none: it cannot run here,
    missing: str = ""  #: and why
    scene: bool = True  #: false: the frame is made of the first batch, as without a scene file


@dataclass(frozen=True)
class Overrides:
    """What a caller says instead of the file."""

    trials: int | None = None
    split: str | None = None
    seed: int | None = None
    data_dir: str | None = None
    config: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Experiment:
    settings: Settings
    scenes: Sequence[ExperimentScene]
    methods: Sequence[ExperimentMethod]
    reference: str  #: the method that the others are compared with
    file: str = ""
    overrides: Overrides = Overrides()

    @property
    def used_for_choices(self) -> list[str]:
        return [scene.name for scene in self.scenes if scene.used_for_choices]

    def resolved(self) -> dict[str, Any]:
        """Every value in force, defaults included."""
        scenes = {
            scene.name: {
                "tracks": len(scene.tracks),
                "tracks_hash": scene.tracks_hash,
                "test_speed": scene.test_speed,
                "config": json.loads(scene.config),
            }
            for scene in self.scenes
        }
        methods = {
            method.name: {
                "method": method.kind,
                "parameters": dict(method.parameters),
                "scene": method.scene,
                "config": {scene.name: json.loads(config) for scene, config in zip(self.scenes, method.configs)},
            }
            for method in self.methods
        }
        return {**asdict(self.settings), "reference": self.reference, "scenes": scenes, "methods": methods}
