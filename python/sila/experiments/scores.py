"""The scores of windows, summed by group and by person; sums, so that scenes and trials can be added."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from .._sila import person_of
from .method import Array

Sums = dict[str, float]

#: Sum -> predictor and metric of the library (docs/evaluate.md); ADE and FDE are those of the mean path.
_METRICS = {
    "mhd_m": ("model", "weighted_mhd_m"),
    "mean_path_mhd_m": ("model", "mean_path_mhd_m"),
    "best_mhd_m": ("model", "best_mhd_m"),
    "ade_m": ("model", "mean_path_ade_m"),
    "fde_m": ("model", "mean_path_fde_m"),
    "best_ade_m": ("model", "best_ade_m"),
    "nll": ("model", "nll"),
    "constant_mhd_m": ("constant_velocity", "weighted_mhd_m"),
    "constant_ade_m": ("constant_velocity", "mean_path_ade_m"),
    "constant_fde_m": ("constant_velocity", "mean_path_fde_m"),
    "constant_nll": ("constant_velocity", "nll"),
    "stays_mhd_m": ("stays", "weighted_mhd_m"),
    "stays_ade_m": ("stays", "mean_path_ade_m"),
    "damped_mhd_m": ("damped_velocity", "weighted_mhd_m"),
    "damped_ade_m": ("damped_velocity", "mean_path_ade_m"),
    "linear_mhd_m": ("linear", "weighted_mhd_m"),
    "linear_ade_m": ("linear", "mean_path_ade_m"),
    "linear_nll": ("linear", "nll"),
}
_GROUPS: dict[str, Callable[[Mapping[str, Any]], bool]] = {
    "all": lambda w: True,
    "moving": lambda w: w["moving"],
    "standing": lambda w: not w["moving"],
    "turning": lambda w: w["turning"],
    "forks": lambda w: w["moving"] and w["fork"],
    "inside": lambda w: w["moving"] and w["inside"],
    "outside": lambda w: w["moving"] and not w["inside"],
}


def sums_of(windows: Sequence[Mapping[str, Any]], more: Mapping[str, Array]) -> dict[str, Any]:
    """groups: sums over each group of windows. people: over the moving windows of each person. `more` has further values
    of each window, or others instead of the library's."""
    columns = ["windows", *_METRICS, "fallbacks", "inside_50", "inside_90", "way_log_probability"]
    rows = np.array([_row(window) for window in windows]).reshape(len(windows), len(columns))
    values = {**dict(zip(columns, rows.T)), **more}
    columns, table = list(values), np.column_stack(list(values.values()))
    people: dict[str, list[int]] = {}
    for i, window in enumerate(windows):
        if window["moving"]:
            people.setdefault(person_of(window["track"]), []).append(i)

    def summed(rows: Sequence[int]) -> Sums:
        return dict(zip(columns, np.add.reduce(table[list(rows)], axis=0).tolist()))

    groups = {name: summed([i for i, w in enumerate(windows) if has(w)]) for name, has in _GROUPS.items()}
    return {"groups": groups, "people": {name: summed(rows) for name, rows in people.items()}}


def _row(window: Mapping[str, Any]) -> list[float]:
    held = {level["nominal"]: level["observed"] for level in window["model"]["coverage"]}
    metrics = [float(window[predictor][metric]) for predictor, metric in _METRICS.values()]
    return [1.0, *metrics, float(window["fallback"]), held[0.5], held[0.9], window["way_log_probability"]]
