"""k nearest windows: nothing is generalised, so the model is as large as the data."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from scipy.spatial import cKDTree

from ..._sila import CurbFrame, FramedTracks, WindowSet
from ..method import CONSTANT_VELOCITY_S, Array, Forecast, Method, constant_fallback, kernel_forecast


class Knn(Method):
    """What became of the nearest windows so far, each a mode; the nearer the heavier. Other sites are laid over the
    first one by their curb frames."""

    parameters: ClassVar[dict[str, Any]] = {
        "neighbours": 25,  # windows that a prediction is made of
        "stride_s": 0.4,  # between the kept windows of a track
        "position_m": 2.0,  # differences that count 1: of position,
        "velocity_mps": 0.3,  # velocity of the last 0.8 s,
        "mean_velocity_mps": 0.6,  # and mean velocity
    }
    frame: CurbFrame | None = None
    situations, displacements_m = np.empty((0, 6)), np.empty((0, 0, 2))

    @property
    def size(self) -> int:
        return len(self.situations)

    def partial_fit(self, tracks: FramedTracks) -> None:
        self.frame = self.frame or tracks.frame(0)
        windows = self.windows(tracks, self.stride_s)
        position, _, future = windows.laid_over(self.frame)
        if len(position) == 0:
            return
        more = future - position[:, -1:]
        self.displacements_m = np.concatenate([self.displacements_m.reshape(-1, *more.shape[1:]), more])
        self.situations = np.concatenate([self.situations, self.situation(position, windows.interval_s)])

    def predict(self, windows: WindowSet) -> Forecast:
        if self.frame is None or self.size == 0:
            return constant_fallback(windows)
        position, _, _ = windows.laid_over(self.frame)
        count = min(self.neighbours, self.size)
        situation = self.situation(position, windows.interval_s)
        distance, nearest = cKDTree(self.situations).query(situation, k=list(range(1, count + 1)))
        weights = np.exp(-(distance**2) / np.maximum(1e-6, distance[:, -1:] ** 2))  # as wide as the neighbourhood
        paths = position[:, None, -1:] + self.displacements_m[nearest]
        return kernel_forecast(weights, windows.laid_back(paths, self.frame), windows.interval_s)

    def situation(self, position: Array, interval_s: float) -> Array:
        """Position and velocities in units of their scales."""
        length = position.shape[1] - 1
        back = min(round(CONSTANT_VELOCITY_S / interval_s), length)
        velocity = (position[:, -1] - position[:, -1 - back]) / (back * interval_s)
        mean = (position[:, -1] - position[:, 0]) / (length * interval_s)
        scaled = position[:, -1] / self.position_m, velocity / self.velocity_mps, mean / self.mean_velocity_mps
        return np.concatenate(scaled, axis=1)
