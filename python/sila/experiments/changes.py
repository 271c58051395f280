"""Stated probabilities that standing people start and walking people stop, against what they did; of all trials together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from .._sila import person_of
from .markdown import number_text, table_text
from .measures import ECE_BINS
from .method import Array

LONGEST_S = 2.4  #: the last horizon that is not above it
LEAST_PEOPLE = 10  #: people who changed, and who did not, below which a place has no figures
TITLES = {"start": "standing people start", "stop": "walking people stop"}

Forecasts = dict[str, dict[str, list[tuple[float, bool]]]]  #: start or stop -> person -> probability, happened


def forecasts_of(windows: Sequence[Mapping[str, Any]], horizons_s: Sequence[float]) -> Forecasts:
    """Those of each person; none of methods that state no probability."""
    last = max((i for i, s in enumerate(horizons_s) if s <= LONGEST_S + 1e-9), default=0)
    found: Forecasts = {name: {} for name in TITLES}
    for window in windows:
        if window["changes"]:
            of_people = found["start" if window["standing"] else "stop"]
            of_people.setdefault(person_of(window["track"]), []).append(tuple(window["changes"][last]))
    return found


class Skill(NamedTuple):
    """How much lower the Brier score is than that of the base rate of the same windows; 95 % interval over people."""

    windows: int
    people: int
    rate: float
    skill: float
    low: float
    high: float
    calibration_error: float


def skill_of(people: Sequence[Sequence[tuple[float, bool]]], bootstraps: int, seed: int) -> Skill | None:
    """None with too few people."""

    def skill(windows: Array, squares: Array, changed: Array, *, axis: int = -1) -> Array:
        n, rate = windows.sum(axis), changed.sum(axis) / np.maximum(windows.sum(axis), 1)
        return np.asarray(1 - squares.sum(axis) / np.maximum(n * rate * (1 - rate), 1e-9))

    stated, happened = np.array([forecast for person in people for forecast in person], dtype=float).reshape(-1, 2).T
    if min(sum(any(did == kind for _, did in person) for person in people) for kind in (True, False)) < LEAST_PEOPLE:
        return None
    columns = [
        np.array([f(np.array(person, dtype=float)) for person in people])
        for f in (len, lambda rows: ((rows[:, 0] - rows[:, 1]) ** 2).sum(), lambda rows: rows[:, 1].sum())
    ]
    found = stats.bootstrap(
        columns, skill, paired=True, n_resamples=bootstraps, method="percentile", rng=np.random.default_rng(seed)
    )
    bins = np.minimum((ECE_BINS * stated).astype(int), ECE_BINS - 1)
    error = abs(np.bincount(bins, stated - happened)).sum() / len(stated)
    low, high = found.confidence_interval
    return Skill(len(stated), len(people), happened.mean(), float(skill(*columns)), float(low), float(high), error)


def changes_table(results: Sequence[Mapping[str, Any]], split: str, bootstraps: int, seed: int) -> str:
    """Empty if no method states such probabilities."""
    together: dict[tuple[str, str, str], dict[str, list[Any]]] = {}
    for result in results:
        for place, site in result["places"].items() if result["split"] == split else ():
            for name, people in site["changes"].items():
                key = together.setdefault((name, place, result["method"]), {})
                for person, forecasts in people.items():
                    key.setdefault(person, []).extend(forecasts)
    lines = []
    for name in TITLES:
        for (of, place, method), people in together.items():
            found = skill_of(list(people.values()), bootstraps, seed) if of == name and people else None
            if found is not None:
                cells = [TITLES[name], method, str(found.windows), str(found.people), number_text(found.rate, 3)]
                interval = f"{found.low:.3f} to {found.high:.3f}"
                cells += [number_text(found.skill, 3), interval, number_text(found.calibration_error, 3)]
                lines.append((place, cells))
    if not lines:
        return ""
    titles = ["", "method", "windows", "people", "share that did", "skill", "95 % interval", "ECE"]
    return (
        f"## Starting and stopping\n\nWithin {LONGEST_S} s, or the last full second before. Skill: 1 - B / B0, with the Brier "
        "score B of the probability and B0 of the share that did. All trials together; places where fewer than "
        f"{LEAST_PEOPLE} people did, or did not, are left out.\n\n{table_text('place', titles, lines)}"
    )
