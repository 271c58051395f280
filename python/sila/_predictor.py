"""An estimator in the style of scikit-learn; it does not need scikit-learn."""

from __future__ import annotations

from typing import Any

from . import _verbs
from ._config import config as default_config
from ._evaluation import Evaluation
from ._predictions import Predictions
from ._sila import Model
from ._tracks import SceneLike, TracksLike, as_tracks


class Predictor:
    """Learns tracks and predicts them, as an estimator of scikit-learn.

    `scene`: a Scene or the path of a scene file; without one the model makes its frame from its first batch.
    `batch`: tracks per episode in `fit`. Further keywords are configuration fields, groups joined by two underscores
    (`predict__horizon_s=3.0`) or as dictionaries (`predict={"horizon_s": 3.0}`). X: tracks in any form that
    `sila.learn` takes; use `Tracks` or lists of Track in `sklearn.model_selection`. There is no y. Raises FormatError
    for an unknown field or a value out of range; methods that need a model raise ValueError before `fit`.
    """

    model_: Model

    def __init__(self, scene: SceneLike | None = None, *, batch: int = 20, threads: int = 0, **config: Any) -> None:
        self.scene = scene
        self.batch = batch
        self.threads = threads
        self._defaults = _flat(default_config())
        self._given: dict[str, Any] = {}
        self.set_params(**config)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """scene, batch, threads, and configuration fields as group__field: all of them, or without `deep` those that
        were given, so that another `profile` changes the rest of a clone."""
        own = {"scene": self.scene, "batch": self.batch, "threads": self.threads}
        return {**own, **(_flat(default_config(self._settings())) if deep else {}), **self._given}

    def set_params(self, **params: Any) -> Predictor:
        """Raises FormatError for an unknown field or a value out of range."""
        given = dict(self._given)
        own = {name: params.pop(name) for name in ("scene", "batch", "threads") if name in params}
        for name, value in params.items():
            given.update(_flat({name: value}))
        dotted = next((name for name in given if "." in name), None)
        if dotted is not None:
            raise ValueError(f"Predictor: expected {dotted.replace('.', '__')} (two underscores), found {dotted}")
        default_config(_nested(given))
        for name, value in own.items():
            setattr(self, name, value)
        self._given = given
        return self

    def fit(self, X: TracksLike, y: None = None) -> Predictor:
        """Learns X from the beginning, `batch` tracks per episode."""
        self.model_ = _verbs.learn(
            X, scene=self.scene, batch=self.batch, config=self._settings(), threads=self.threads, progress=False
        )
        return self

    def partial_fit(self, X: TracksLike, y: None = None) -> Predictor:
        """Learns X as one more episode."""
        tracks = as_tracks(X, scene=self.scene, config=self._settings())
        if len(tracks) == 0:
            return self
        self.model_ = _verbs.learn(
            tracks,
            scene=self.scene,
            model=getattr(self, "model_", None),
            batch=len(tracks),
            config=self._settings(),
            threads=self.threads,
            progress=False,
        )
        return self

    def predict(self, X: TracksLike) -> Predictions:
        """One prediction per track, from its last sample; none for a track shorter than predict.min_observe_s."""
        return _verbs.predict(
            self._fitted(),
            X,
            scene=self.scene,
            at_end=True,
            config=self._settings(),
            threads=self.threads,
            progress=False,
        )

    def evaluate(self, X: TracksLike) -> Evaluation:
        """As sila.evaluate."""
        return _verbs.evaluate(self._fitted(), X, scene=self.scene, config=self._settings(), threads=self.threads)

    def score(self, X: TracksLike, y: None = None) -> float:
        """Minus the mean weighted MHD [m] at the whole horizon over all windows of X; higher is better.

        Raises ValueError if no track of X is long enough for a window.
        """
        return -self.evaluate(X).metric("weighted_mhd_m", group="all")

    def __repr__(self) -> str:
        changed = {name: value for name, value in self._given.items() if self._defaults.get(name) != value}
        given = "".join(f", {name}={value!r}" for name, value in changed.items())
        fitted = f" of {self.model_!r}" if hasattr(self, "model_") else ", not fitted"
        return f"<Predictor(batch={self.batch}{given}){fitted}>"

    def __sklearn_tags__(self) -> Any:
        from sklearn.utils import InputTags, Tags, TargetTags

        return Tags(
            estimator_type=None,
            target_tags=TargetTags(required=False),
            input_tags=InputTags(two_d_array=False),
        )

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "model_")

    def _settings(self) -> dict[str, Any]:
        return _nested(self._given)

    def _fitted(self) -> Model:
        if not hasattr(self, "model_"):
            raise ValueError("Predictor: it is not fitted; call fit or partial_fit first")
        return self.model_


def _flat(nested: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in nested.items():
        path = prefix + name
        flat.update(_flat(value, path + "__") if isinstance(value, dict) else {path: value})
    return flat


def _nested(flat: dict[str, Any]) -> dict[str, Any]:
    nested: dict[str, Any] = {}
    for path, value in flat.items():
        *groups, name = path.split("__")
        place = nested
        for group in groups:
            place = place.setdefault(group, {})
        place[name] = value
    return nested
