"""Methods that predict one path with a Gaussian around each of its steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from .._sila import FramedTracks, WindowSet, person_of
from .method import Array, Forecast, Method, constant_fallback, constant_velocity

STRIDE_S = 0.4  #: between the training windows of a track
MOVING_M = 0.5  #: training windows are those who move, as those are scored
FOLDS = 5


class GaussianPath(Method):
    """Learns the deviation of the future from constant velocity, in the heading frame. A subclass says how, in `learn`;
    the Gaussian has the covariance of the errors on people who were left out."""

    at_once = True
    covariance: Array | None = None  #: none: no window was learnt

    def learn(self, past_m: Array, deviation_m: Array, person: Array) -> tuple[Callable[[Array], Array], Array]:
        """past_m (n, p, 2) in the world; deviation_m (n, t, 2) in the heading frame; person (n,). Gives what predicts
        deviations from pasts, and the deviations predicted for people who were left out."""
        raise NotImplementedError

    def fit(self, tracks: FramedTracks) -> None:
        past, future, person = training_windows(self, tracks)
        if len(past) == 0:
            return
        straight = constant_velocity(past, future.shape[1], self.interval_s)
        deviation = np.einsum("nab,ntb->nta", to_heading(past), future - straight)
        self.deviation_of, left_out = self.learn(past, deviation, person)
        self.covariance = covariance_of(deviation - left_out)

    def predict(self, windows: WindowSet) -> Forecast:
        if self.covariance is None:
            return constant_fallback(windows)
        past = np.asarray(windows.past_m)
        straight = constant_velocity(past, windows.steps, windows.interval_s)
        path = straight + np.einsum("nba,ntb->nta", to_heading(past), self.deviation_of(past))
        return gaussian_forecast(past, path, self.covariance)


def covariance_of(error_m: Array) -> Array:
    """(t, 2, 2) of errors (n, t, 2) in the heading frame, around zero."""
    return np.asarray(np.einsum("nta,ntb->tab", error_m, error_m) / len(error_m) + 1e-6 * np.eye(2))


def gaussian_forecast(past_m: Array, path_m: Array, covariance_m2: Array) -> Forecast:
    """One path (n, t, 2) in the world with the covariance (t, 2, 2) of the heading frame."""
    turn = to_heading(past_m)
    covariances = np.einsum("nba,tbc,ncd->ntad", turn, covariance_m2, turn)
    return Forecast(np.ones((len(past_m), 1)), path_m[:, None], np.ascontiguousarray(covariances[:, None]))


def training_windows(method: Method, tracks: FramedTracks) -> tuple[Array, Array, Array]:
    """Pasts, futures and persons (as numbers) of those who move; sets the method's `interval_s`."""
    windows = method.windows(tracks, STRIDE_S)
    setattr(method, "interval_s", windows.interval_s)  # noqa: B010
    past = np.asarray(windows.past_m)
    moving = moves(past)
    person = np.unique([person_of(track) for track in windows.track_ids], return_inverse=True)[1]
    return past[moving], np.asarray(windows.future_m)[moving], person[moving]


def moves(past_m: Array) -> Array:
    """(n,): whether a person moved while observed."""
    return np.asarray(np.linalg.norm(past_m[:, -1] - past_m[:, 0], axis=1) >= MOVING_M)


def to_heading(past_m: Array) -> Array:
    """(n, 2, 2): rotations of the world into the frame whose first axis points from the first to the last position."""
    along = past_m[:, -1] - past_m[:, 0]
    angle = np.arctan2(along[:, 1], along[:, 0])
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([cos, sin], -1), np.stack([-sin, cos], -1)], -2)


def heading_features(past_m: Array) -> Array:
    """(n, 2 p - 1): a one, and the earlier positions as seen from the last one in the heading frame."""
    seen = np.einsum("nab,ntb->nta", to_heading(past_m), past_m - past_m[:, -1:])[:, :-1]
    return np.column_stack([np.ones(len(past_m)), seen.reshape(len(past_m), -1)])


def between_knots(values: Array, knots: Array, steps: int) -> Array:
    """(n, knots, 2) at the steps `knots` to (n, steps, 2), linear between them."""
    at = np.arange(1, steps + 1)
    right = np.clip(np.searchsorted(knots, at), 1, len(knots) - 1)
    low, high = knots[right - 1], knots[right]
    share = ((at - low) / (high - low))[:, None]
    return np.asarray(values[:, right - 1] * (1 - share) + values[:, right] * share)


def folds(person: Array, count: int = FOLDS, seed: int = 0) -> Iterator[tuple[Array, Array]]:
    """(learnt, left out) as masks; a person is on one side."""
    fold = np.random.default_rng(seed).permutation(person.max() + 1)[person] % count
    for k in range(count):
        yield fold != k, fold == k


def ridge(features: Array, targets: Array, person: Array, penalties: Array) -> tuple[Array, Array]:
    """Weights of the ridge regression of the best penalty, and its predictions for people who were left out."""
    flat = targets.reshape(len(targets), -1)
    best = np.inf
    result: tuple[Array, Array] = np.empty(0), np.empty(0)
    for penalty in penalties:
        left_out = np.zeros_like(flat)
        for learnt, other in folds(person):
            left_out[other] = features[other] @ _solved(features[learnt], flat[learnt], penalty)
        error = np.linalg.norm((left_out - flat).reshape(targets.shape), axis=2).mean()
        if error < best:
            best, result = error, (_solved(features, flat, penalty), left_out.reshape(targets.shape))
    return result


def _solved(features: Array, targets: Array, penalty: float) -> Array:
    gram = features.T @ features + penalty * np.eye(features.shape[1])
    return np.asarray(np.linalg.solve(gram, features.T @ targets), dtype=np.float64)
