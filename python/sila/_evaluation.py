"""The result of `evaluate`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Evaluation:
    """Mean errors of a model and of constant velocity on the same windows, by group and horizon."""

    #: The JSON of `sila evaluate`: groups, each with windows, fallback_rate, modes and horizons; skipped tracks.
    groups: dict[str, Any]
    skipped: dict[str, int]
    #: By "start" and "stop" a row a horizon: windows, rate, brier, base_brier and calibration_error.
    changes: dict[str, Any]
    #: By "standing" and "walking" a row a horizon: windows, mean stated probabilities, rates and their errors.
    outcomes: dict[str, Any]
    #: One a window: track, t0_s, its groups, and the metrics of model, constant_velocity and stays at the whole horizon.
    windows: list[dict[str, Any]]
    text: str

    @property
    def horizons_s(self) -> list[float]:
        """Whole seconds, then the whole horizon."""
        return [row["horizon_s"] for row in next(iter(self.groups.values()))["horizons"]]

    def metric(self, name: str = "weighted_mhd_m", *, group: str = "moving", of: str = "model") -> float:
        """One mean error at the whole horizon; `of`: model or constant_velocity. Raises ValueError for an unknown name
        or group, and for a group without windows."""
        if group not in self.groups:
            raise ValueError(f"metric: group: expected one of {', '.join(self.groups)}, found {group}")
        if self.groups[group]["windows"] == 0:
            raise ValueError(f"metric: group {group} has no window")
        last = self.groups[group]["horizons"][-1]
        if of not in ("model", "constant_velocity"):
            raise ValueError(f"metric: of: expected model or constant_velocity, found {of}")
        means = _means(last[of])
        if name not in means:
            raise ValueError(f"metric: name: expected one of {', '.join(means)}, found {name}")
        return float(means[name])

    def to_frame(self) -> pandas.DataFrame:
        """One row for each group, horizon and predictor, one column for each metric: NaN for a group without windows.
        coverage_90 is the observed coverage of nominal 90 % regions."""
        import pandas

        rows = [
            {"group": name, "windows": group["windows"], "horizon_s": row["horizon_s"], "predictor": of}
            | (_means(row[of]) if group["windows"] else dict.fromkeys(_means(row[of]), math.nan))
            for name, group in self.groups.items()
            for row in group["horizons"]
            for of in ("model", "constant_velocity")
        ]
        return pandas.DataFrame(rows)

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        windows = ", ".join(f"{name} {group['windows']}" for name, group in self.groups.items())
        return f"Evaluation(windows: {windows}; horizons {self.horizons_s} s)"


def _means(row: Mapping[str, Any]) -> dict[str, Any]:
    """The metrics of a row, coverage by nominal per cent."""
    means = {name: value for name, value in row.items() if name != "coverage"}
    return means | {f"coverage_{100 * entry['nominal']:.0f}": entry["observed"] for entry in row["coverage"]}
