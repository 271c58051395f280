"""Methods that draw paths in the field's protocol: eight positions seen, twelve drawn, 0.4 s apart."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from .._sila import FramedTracks, WindowSet
from .method import Array, Forecast, Method, kernel_forecast

STEP_S = 0.4
SEEN, DRAWN = 8, 12
SAMPLES = 20


class Sampler(Method):
    """A subclass defines `sample`. Windows of other intervals are resampled, and what lies beyond 4.8 s goes on at the
    velocity of the last step."""

    at_once: ClassVar[bool] = True
    published: ClassVar[bool] = True

    @classmethod
    def not_for(cls, config: Mapping[str, Any]) -> str:
        observed_s = config["predict"]["observe_s"] - config["sampling"]["interval_s"]  # between its first and last position
        needed_s = (SEEN - 1) * STEP_S
        return f"needs {needed_s:g} s of past, has {observed_s:g}" if observed_s < needed_s - 1e-9 else ""

    def fit(self, tracks: FramedTracks) -> None:
        """Nothing to learn."""

    def sample(self, past_m: Array, samples: int = SAMPLES) -> Array:
        """(n, 8, 2) of people who are there at the same time -> (samples, n, 12, 2)."""
        raise NotImplementedError

    def predict(self, windows: WindowSet) -> Forecast:
        """Each window by itself, as windows name no companions."""
        held = STEP_S / windows.interval_s
        past = np.asarray(windows.past_m)
        at = past.shape[1] - 1 - held * np.arange(SEEN)[::-1]
        low = np.floor(at + 1e-9).astype(int)
        share = (at - low)[:, None]
        seen = past[:, low] * (1 - share) + past[:, np.minimum(low + 1, past.shape[1] - 1)] * share
        drawn = np.stack([self.sample(one[None])[:, 0] for one in seen])  # (n, k, 12, 2)
        paths = between_steps(np.broadcast_to(seen[:, None, -1:], (*drawn.shape[:2], 1, 2)), drawn, windows)
        return kernel_forecast(np.ones(paths.shape[:2]), paths, windows.interval_s)


def between_steps(last: Array, drawn: Array, windows: WindowSet) -> Array:
    """Paths (n, k, 12, 2) at the steps of windows."""
    points = np.concatenate([last, drawn], 2)
    at = windows.interval_s / STEP_S * np.arange(1, windows.steps + 1)
    low = np.minimum(np.floor(at + 1e-9).astype(int), points.shape[2] - 2)
    return np.asarray(points[:, :, low] + (at - low)[:, None] * (points[:, :, low + 1] - points[:, :, low]))


def together(tracks: FramedTracks, track_ids: Sequence[str], frames: Array) -> Iterator[Array]:
    """Indices of windows of the same moment in the same recording, in the order of time; `frames`: t0 in steps."""
    of_track = dict(zip(tracks.ids, tracks.recordings))
    recordings = [of_track[track] for track in track_ids]
    for _, group in pd.Series(range(len(recordings))).groupby([recordings, frames]):
        yield group.to_numpy()


def peers_folder() -> Path:
    return Path(os.environ.get("PEERS") or "build/peers")


def code_of(name: str, file: str) -> Path:
    """The folder with this file in the code of others, which lies in PEERS/name.

    Raises ModuleNotFoundError where it is not there.
    """
    folder = peers_folder() / name
    found = sorted(folder.rglob(file)) if folder.is_dir() else []
    if not found:
        raise ModuleNotFoundError(f"no {file} in {folder}: make peers PEERS=DIR, the folder of {name}", name=name)
    return found[0].parent
