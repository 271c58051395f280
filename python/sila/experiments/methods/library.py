"""SILA and what it is compared with inside the library, in one and the same loop of episodes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, ClassVar

from ..._sila import FramedTracks, ModelLearner, Prediction, WindowSet
from ..._sila import simulated_prior as _simulated_prior
from ..method import Method

simulated_prior = lru_cache(maxsize=8)(_simulated_prior)  # of a configuration


class Sila(Method):
    """Learns each batch and fuses it into the model."""

    kind: ClassVar[str] = "sila"

    def __init__(self, config: str = "{}", **parameters: Any) -> None:
        super().__init__(config, **parameters)
        self.learner = ModelLearner(self.kind, config)

    @property
    def size(self) -> int:
        return self.learner.size

    @property
    def bytes(self) -> int:
        """Of the model's file."""
        return self.learner.bytes

    def partial_fit(self, tracks: FramedTracks) -> None:
        self.learner.learn(tracks)

    def predict(self, windows: WindowSet) -> Sequence[Prediction]:
        return self.learner.predict(windows)


class SilaAlone(Sila):
    """Gets each person alone, as most methods of others: it neither learns from companions nor predicts with them."""

    def partial_fit(self, tracks: FramedTracks) -> None:
        self.learner.learn(tracks.without_companions())

    def predict(self, windows: WindowSet) -> Sequence[Prediction]:
        return self.learner.predict(windows.without_companions())


@lru_cache(maxsize=1)
def learnt(config: str, batch: int, places: tuple[FramedTracks, ...]) -> list[ModelLearner]:
    """A model of each place."""
    models = []
    for tracks in places:
        model = Sila(config, batch=batch)
        model.fit(tracks)
        models.append(model.learner)
    return models


class SilaWithPrior(Sila):
    """Begins with the error statistics of the other places of the experiment."""

    elsewhere: ClassVar[bool] = True

    def begin_with(self, places: Sequence[FramedTracks]) -> None:
        self.learner.begin_with(learnt(self.config, self.batch, tuple(places)))


class SilaWithSimulatedPrior(Sila):
    """Begins with the error statistics of simulated pedestrians, as `sila prior make` without models."""

    def __init__(self, config: str = "{}", **parameters: Any) -> None:
        super().__init__(config, **parameters)
        self.learner.begin_with(simulated_prior(config))


class Accumulate(Sila):
    """Learns each batch and adds it without fusing."""

    kind = "accumulate"


class Retrain(Sila):
    """Learns anew from all tracks so far, batch by batch."""

    kind = "retrain"


class Linear(Sila):
    """Past velocities stacked by past errors: the kinematic model alone, without a map."""

    kind = "linear"


class Batch(Sila):
    """Learns all tracks at once."""

    kind, at_once = "batch", True

    def fit(self, tracks: FramedTracks) -> None:
        self.learner.learn(tracks)


class Tree(Sila):
    """Learns as a fleet does: leaves by themselves, fused in a tree."""

    kind, at_once = "tree", True
    parameters: ClassVar[dict[str, Any]] = {"leaf_episodes": 1}
    leaf_episodes: int

    def fit(self, tracks: FramedTracks) -> None:
        self.learner.learn_tree(tracks, self.batch, self.batch * self.leaf_episodes)
