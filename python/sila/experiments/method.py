"""What an experiment compares: anything that learns tracks and predicts windows."""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .._sila import FramedTracks, Prediction, WindowSet

Array = NDArray[np.float64]

#: Deviation of a mode that samples agree on entirely [m], and how it grows [m/s].
LEAST_DEVIATION_M, LEAST_GROWTH_MPS = 0.1, 0.1
#: Constant velocity over the last seconds of what was observed, and how its deviation grows [m/s].
CONSTANT_VELOCITY_S, FALLBACK_GROWTH_MPS = 0.8, 0.3

FARTHEST_M = 1e6  #: from the last position, of a path


@dataclass
class Forecast:
    """Predictions of n windows as k Gaussian modes over t steps. A mode of weight 0 is left out."""

    weights: Array  #: (n, k) with the sum 1, or (n, k, t) of a mixture whose weights change from step to step
    paths_m: Array  #: (n, k, t, 2)
    covariances_m2: Array  #: (n, k, t, 2, 2)
    fallback: bool = False  #: nothing was learnt yet


class Method:
    """A method of an experiment. A subclass names its parameters with their defaults and defines `partial_fit` and
    `predict`; one that can only learn everything at once defines `fit` instead and sets `at_once`.
    """

    parameters: ClassVar[dict[str, Any]] = {}
    at_once: ClassVar[bool] = False
    social: ClassVar[bool] = False  #: `predict(windows, neighbours)` also gets the people who are present at each t0
    #: Repository and commit of the code of others that it runs, and its folder in PEERS.
    upstream: ClassVar[tuple[str, str, str] | None] = None
    elsewhere: ClassVar[bool] = False  #: it first gets the tracks of the other places, by `begin_with(places)`
    published: ClassVar[bool] = False  #: it is used as others have published it, and learns nothing here

    if TYPE_CHECKING:  # parameters are attributes

        def __getattr__(self, name: str) -> Any: ...

    def __init__(
        self, config: str = "{}", *, batch: int = 20, seed: int = 0, scene: str = "", **parameters: Any
    ) -> None:
        unknown = sorted(set(parameters) - set(self.parameters))
        if unknown:
            known = ", ".join(self.parameters) or "none"
            raise ValueError(f"{type(self).__name__}: parameters: expected {known}, found {unknown[0]}")
        self.config, self.batch, self.seed, self.scene = config, batch, seed, scene
        for name, value in {**self.parameters, **parameters}.items():
            setattr(self, name, value)

    @property
    def size(self) -> int:
        """The reported size of the model."""
        return 0

    @property
    def bytes(self) -> int:
        """Of what it has to keep to predict."""
        return stored_bytes(vars(self))

    @classmethod
    def require(cls, parameters: Mapping[str, Any]) -> None:
        """Raises ImportError where a method with these parameters needs what is not installed."""

    @classmethod
    def not_for(cls, config: Mapping[str, Any]) -> str:
        """Why it cannot predict windows of this configuration; empty if it can."""
        return ""

    def begin_with(self, places: Sequence[FramedTracks]) -> None:
        """Learns from the training tracks of the other places, each of one place."""
        raise NotImplementedError

    def fit(self, tracks: FramedTracks) -> None:
        """Learns all tracks, in batches."""
        for batch in batches_of([tracks], self.batch):
            self.partial_fit(batch)

    def partial_fit(self, tracks: FramedTracks) -> None:
        """Learns one more batch."""
        raise NotImplementedError

    def predict(self, windows: WindowSet) -> Forecast | Sequence[Prediction]:
        """Predicts every window; the futures are hidden."""
        raise NotImplementedError

    def windows(self, tracks: FramedTracks, stride_s: float) -> WindowSet:
        """Windows of tracks with their whole future, as they are scored."""
        return tracks.windows(self.config, stride_s)


def batches_of(training: Sequence[FramedTracks], batch: int) -> Iterator[FramedTracks]:
    """Batches that are of one scene each."""
    for tracks in training:
        for first in range(0, len(tracks), batch):
            yield tracks.take(range(first, min(first + batch, len(tracks))))


def stored_bytes(value: Any) -> int:
    """Bytes of the numbers in a value: arrays and tensors as they are, what functions have captured, else pickled."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, Mapping):
        return sum(stored_bytes(v) for v in value.values())
    if isinstance(value, (list, tuple)):
        return sum(stored_bytes(v) for v in value)
    if isinstance(value, (int, float)):
        return 8
    if isinstance(value, (str, type(None), Method)):  # its settings; a bound method's object is counted as itself
        return 0
    if callable(value) and hasattr(value, "__closure__"):
        return sum(stored_bytes(cell.cell_contents) for cell in value.__closure__ or ())
    if hasattr(value, "state_dict"):  # a module of torch
        return sum(v.numel() * v.element_size() for v in value.state_dict().values() if hasattr(v, "numel"))
    try:
        return len(pickle.dumps(value))
    except (TypeError, AttributeError, pickle.PicklingError):
        return 0


def checked(found: Any, windows: WindowSet, method: Method) -> Forecast | Sequence[Prediction]:
    """What a method has predicted, if it fits the windows.

    Raises TypeError for what is neither a Forecast nor the library's predictions; ValueError for wrong shapes, weights
    that are negative or do not sum to 1, and paths that are not finite or covariances that are not symmetric and positive
    definite in modes with a weight.
    """
    name = f"{type(method).__name__}.predict"
    if not isinstance(found, Forecast):
        if not (isinstance(found, Sequence) and all(isinstance(prediction, Prediction) for prediction in found)):
            raise TypeError(f"{name}: expected a Forecast, found {type(found).__name__}")
        if len(found) != len(windows):
            raise ValueError(f"{name}: expected {len(windows)} predictions, one a window, found {len(found)}")
        return found
    if not isinstance(found.fallback, (bool, np.bool_)):
        raise TypeError(f"{name}: fallback: expected True or False, found {found.fallback!r:.80}")
    parts = {}
    for part in ("weights", "paths_m", "covariances_m2"):
        try:
            parts[part] = np.asarray(getattr(found, part))
        except ValueError as error:  # ragged
            raise ValueError(f"{name}: {part}: expected an array of numbers; {error}") from None
    weights, paths, covariances = parts.values()
    n, t, k = len(windows), windows.steps, weights.shape[1] if weights.ndim > 1 else 1
    shapes = ((n, k, t) if weights.ndim == 3 else (n, k), (n, k, t, 2), (n, k, t, 2, 2))
    for (part, array), shape in zip(parts.items(), shapes):
        if array.shape != shape or array.dtype.kind not in "fiu":
            raise ValueError(f"{name}: {part}: expected numbers of shape {shape}, found {array.dtype} of {array.shape}")

    def require(fits: Any, values: Array, expected: str) -> None:
        for window, *at in np.argwhere(~fits)[:1]:
            of = f"window {window} (track {windows.track_ids[window]}, t0 = {windows.t0_s[window]:g} s)"
            raise ValueError(f"{name}: {expected}, found {values[(window, *at)].tolist()} in {of}")

    used = np.asarray(weights.any(2) if weights.ndim == 3 else weights != 0)[..., None]
    (a, b), (c, d) = np.moveaxis(covariances, (3, 4), (0, 1))
    definite = np.isfinite(covariances).all((3, 4)) & (a > 0) & (a * d > np.maximum(b * b, c * c))
    sums = weights.sum(1, keepdims=True)
    require(weights >= 0, weights, "weights: expected at least 0")
    require(np.abs(sums - 1) <= 1e-5, sums, "weights: expected the sum 1")
    near = np.abs(paths - np.asarray(windows.past_m)[:, None, -1:]) < FARTHEST_M
    require(near.all(3) | ~used, paths, f"paths_m: expected finite numbers within {FARTHEST_M:g} m of the person")
    require(definite | ~used, covariances, "covariances_m2: expected positive definite")
    require((np.abs(b - c) <= 1e-5 * np.sqrt(np.abs(a * d))) | ~used, covariances, "covariances_m2: expected symmetric")
    return Forecast(weights, paths, covariances, bool(found.fallback))


def modes_sorted(forecast: Forecast) -> Forecast:
    """Heaviest mode first, weights of sum 1."""
    order = np.argsort(-forecast.weights, axis=1, kind="stable")
    weights = np.take_along_axis(forecast.weights, order, 1)
    return Forecast(
        weights / weights.sum(1, keepdims=True),
        np.take_along_axis(forecast.paths_m, order[..., None, None], 1),
        np.take_along_axis(forecast.covariances_m2, order[..., None, None, None], 1),
        forecast.fallback,
    )


def kernel_forecast(weights: Array, paths_m: Array, interval_s: float) -> Forecast:
    """Weighted sample paths as modes, each with the covariance of a kernel density estimate (Scott's rule on the
    effective number of samples), as samples alone have no density."""
    weights = weights / weights.sum(1, keepdims=True)
    scale = (weights**2).sum(1) ** (1 / 3)  # n^(-1 / (d + 4)), squared, of d = 2
    off = paths_m - np.einsum("nk,nktc->ntc", weights, paths_m)[:, None]
    spread = np.einsum("nk,nkta,nktb->ntab", weights, off, off)
    least = LEAST_DEVIATION_M + LEAST_GROWTH_MPS * interval_s * np.arange(1, paths_m.shape[2] + 1)
    kernel = scale[:, None, None, None] * spread + least[:, None, None] ** 2 * np.eye(2)
    covariances = np.repeat(kernel[:, None], weights.shape[1], axis=1)
    return modes_sorted(Forecast(weights, paths_m, covariances))


def constant_velocity(past_m: Array, steps: int, interval_s: float) -> Array:
    """(n, p, 2) observed, (n, steps, 2) predicted: on at the mean velocity of the last 0.8 s."""
    back = min(max(1, round(CONSTANT_VELOCITY_S / interval_s)), past_m.shape[1] - 1)
    velocity = (past_m[:, -1] - past_m[:, -1 - back]) / (back * interval_s)
    ahead_s = interval_s * np.arange(1, steps + 1)
    return np.asarray(past_m[:, -1:] + ahead_s[:, None] * velocity[:, None])


def constant_fallback(windows: WindowSet) -> Forecast:
    """The answer of a method that knows nothing yet."""
    past_m = np.asarray(windows.past_m)
    paths = constant_velocity(past_m, windows.steps, windows.interval_s)[:, None]
    deviation = LEAST_DEVIATION_M + FALLBACK_GROWTH_MPS * windows.interval_s * np.arange(1, windows.steps + 1)
    covariances = np.broadcast_to(deviation[:, None, None] ** 2 * np.eye(2), (len(paths), 1, windows.steps, 2, 2))
    return Forecast(np.ones((len(paths), 1)), paths, np.ascontiguousarray(covariances), fallback=True)
