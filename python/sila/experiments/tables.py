"""Results as tables: a row a place, method, split, trial and order; means over trials; paired comparisons."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import reduce
from operator import add
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from .measures import Reliability, calibration_error, reliability_of
from .method import Array
from .scores import Sums

CONSTANT_VELOCITY, MEAN, ALL = "constant velocity", "mean", "all"
MEAN_UNUSED = "mean of places not used for choices"
KEYS = ["place", "method", "split", "trial", "order"]

Groups = Mapping[str, Sums]


def ratio(group: str, name: str, to: str = "constant_mhd_m") -> Callable[[Groups], float]:
    """A sum over a group, relative to another sum over it; NaN where the group has no window."""

    def of(groups: Groups) -> float:
        sums = groups[group]
        return sums[name] / sums[to] if sums["windows"] > 0 and sums[to] > 0 else np.nan

    return of


def per_window(name: str) -> Callable[[Groups], float]:
    return ratio("moving", name, "windows")


def windows(group: str) -> Callable[[Groups], float]:
    return lambda groups: groups[group]["windows"]


def standing(name: str) -> Callable[[Groups], float]:
    """Of standing windows: relative to the better of constant velocity and "stays"."""
    constant, stays = (ratio("standing", name, f"{of}_{name}") for of in ("constant", "stays"))
    return lambda groups: np.fmax(constant(groups), stays(groups))


class Column(NamedTuple):
    name: str
    title: str  #: empty: in no table, in results.csv alone
    decimals: int
    of: Callable[[Groups], Any] = None  # type: ignore[assignment]  #: none: `rows_of` has it from elsewhere


COLUMNS = [
    Column("windows", "moving windows", 0, windows("moving")),
    Column("weighted_mhd_m", "wMHD [m]", 3, per_window("mhd_m")),
    Column("constant_mhd_m", "CV wMHD [m]", 3, per_window("constant_mhd_m")),
    Column("ratio", "wMHD / CV", 3, ratio("moving", "mhd_m")),
    Column("ade_m", "ADE [m]", 3, per_window("ade_m")),
    Column("constant_ade_m", "CV ADE [m]", 3, per_window("constant_ade_m")),
    Column("ade_ratio", "ADE / CV", 3, ratio("moving", "ade_m", "constant_ade_m")),
    Column("fde_m", "FDE [m]", 3, per_window("fde_m")),
    Column("constant_fde_m", "CV FDE [m]", 3, per_window("constant_fde_m")),
    Column("fde_ratio", "FDE / CV", 3, ratio("moving", "fde_m", "constant_fde_m")),
    Column("linear_ratio", "linear: wMHD / CV", 3, ratio("moving", "linear_mhd_m")),
    Column("linear_ade_ratio", "", 3, ratio("moving", "linear_ade_m", "constant_ade_m")),
    Column("damped_ratio", "damped: wMHD / CV", 3, ratio("moving", "damped_mhd_m")),
    Column("all_ratio", "all / CV", 3, ratio("all", "mhd_m")),
    Column("turning_windows", "", 0, windows("turning")),
    Column("turning_ratio", "turning / CV", 3, ratio("turning", "mhd_m")),
    Column("standing_windows", "", 0, windows("standing")),
    Column("standing_ratio", "standing / better of CV and stays", 3, standing("mhd_m")),
    Column("standing_ade_ratio", "standing: ADE / better", 3, standing("ade_m")),
    Column("fork_windows", "windows at forks", 0, windows("forks")),
    Column("fork_log_probability", "forks: log p of the way taken", 3, ratio("forks", "way_log_probability", "windows")),
    Column("fork_ade_ratio", "forks: ADE / CV", 3, ratio("forks", "ade_m", "constant_ade_m")),
    Column("inside_ratio", "", 3, ratio("inside", "mhd_m")),
    Column("outside_windows", "", 0, windows("outside")),
    Column("mean_path_ratio", "", 3, ratio("moving", "mean_path_mhd_m")),
    Column("best_ratio", "", 3, ratio("moving", "best_mhd_m")),
    Column("best_ade_ratio", "best ADE / CV", 3, ratio("moving", "best_ade_m", "constant_ade_m")),
    Column("min_ade_6_ratio", "min ADE of 6 / CV", 3, ratio("moving", "min_ade_6_m", "constant_ade_m")),
    Column("nll", "NLL", 2, per_window("nll")),
    Column("linear_nll", "NLL of linear", 2, per_window("linear_nll")),
    Column("constant_nll", "NLL of CV", 2, per_window("constant_nll")),
    Column("energy_score_m", "energy score [m]", 3, per_window("energy_score_m")),
    Column("area_68_m2", "68 % area [m²]", 2, per_window("area_68_m2")),
    Column("area_95_m2", "95 % area [m²]", 2, per_window("area_95_m2")),
    Column("equal_area_68_m2", "68 % area, equal coverage [m²]", 2, per_window("equal_area_68_m2")),
    Column("equal_area_95_m2", "95 % area, equal coverage [m²]", 2, per_window("equal_area_95_m2")),
    Column("mode_ece", "ECE of modes", 3, lambda groups: calibration_error(dict(groups["moving"]))),
    Column("inside_50", "in 50 %", 2, per_window("inside_50")),
    Column("inside_90", "in 90 %", 2, per_window("inside_90")),
    Column("fallback", "", 3, per_window("fallbacks")),
    Column("size", "size", 0),
    Column("seconds_per_episode", "s per episode", 3),
    Column("training_s", "training [s of CPU]", 2),
    Column("training_j", "training [J]", 1),
    Column("bytes", "bytes", 0),
    Column("us_per_prediction", "µs per prediction", 1),
    Column("people", "", 0),
]
#: Of all trials together, in the summary alone.
POOLED = [
    ("reliability_average", "reliability, average"),
    ("reliability_least", "least"),
    ("reliability_best_average", "without error: average"),
    ("reliability_best_least", "least"),
]
#: What differences of a measure are divided by: constant velocity's error, or the number of windows.
UNITS = {"mhd_m": "constant_mhd_m", "ade_m": "constant_ade_m", "nll": "windows", "energy_score_m": "constant_ade_m"}
WITH_CONSTANT = ("mhd_m", "ade_m", "nll")
#: Values whose spread over trials tells something.
WITH_SPREAD = ("ratio", "ade_ratio", "nll", "inside_50", "inside_90", "size")
BY_NAME = {column.name: column for column in COLUMNS}


def rows_of(results: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """One row a place of each result, and their sum as "all" if there are several."""
    rows = []
    for result in results:
        places = {name: (site["groups"], site) for name, site in result["places"].items()}
        seconds = np.mean([checkpoint["seconds"] for checkpoint in result["checkpoints"]])
        if len(places) > 1:
            total = reduce(add, (pd.DataFrame(groups) for groups, _ in places.values())).to_dict()
            people = {f"{name}/{p}": s for name, (_, site) in places.items() for p, s in site["people"].items()}
            places[ALL] = (total, {"people": people})
        for place, (groups, site) in places.items():
            row = {"place": place, **{key: result[key] for key in KEYS[1:]}}
            row |= {column.name: column.of(groups) for column in COLUMNS if column.of is not None}
            row |= {"size": result["checkpoints"][-1]["size"], "seconds_per_episode": seconds}
            row |= {
                "training_s": np.nan if result["published"] else sum(c["seconds"] for c in result["checkpoints"]),
                "training_j": np.nan if result["published"] else sum(c.get("joules", np.nan) for c in result["checkpoints"]),
                "bytes": result["checkpoints"][-1].get("bytes", np.nan),
                "us_per_prediction": 1e6 * site.get("seconds_per_prediction", np.nan),
                "people": len(site["people"]),
            }
            rows.append(row)
    return pd.DataFrame(rows)[[*KEYS, *BY_NAME]].astype({name: float for name in BY_NAME})


def summarise(rows: pd.DataFrame, results: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Mean, deviation and number over trials and orders, in the order in which splits, places and methods first come;
    columns (value, mean | std | count)."""
    grouped = rows.groupby(["split", "place", "method"], sort=False)[list(BY_NAME)]
    summary = grouped.agg(["mean", "std", "count"])
    pooled = {key: _reliability(results, *key) for key in summary.index}
    for i, (name, _) in enumerate(POOLED):
        summary[(name, "mean")] = [pooled[key][i] for key in summary.index]
    return summary


def _reliability(results: Sequence[Mapping[str, Any]], split: str, place: str, method: str) -> Reliability:
    """Of all trials together."""
    people: dict[str, list[Any]] = {}
    for result in results:
        if (result["split"], result["method"]) == (split, method) and place in result["places"]:
            for person, counts in result["places"][place]["reliability"]["people"].items():
                people.setdefault(person, []).append(counts)
    if not people:
        return Reliability(np.nan, np.nan, np.nan, np.nan)
    windows = np.array([sum(n for n, _ in counts) for counts in people.values()])
    return reliability_of(np.array([np.sum([h for _, h in counts], 0) for counts in people.values()]), windows)


class Comparison(NamedTuple):
    """How much larger the error of a method is than that of another: sum of the differences over the sum of constant
    velocity's errors, both over the moving windows of the same people in the same trials; 95 % interval over people."""

    split: str
    place: str
    method: str
    against: str
    people: int
    difference: float
    low: float
    high: float


def compare(
    results: Sequence[Mapping[str, Any]],
    reference: str,
    bootstraps: int,
    seed: int,
    measure: str = "mhd_m",
    used: Collection[str] = (),
) -> list[Comparison]:
    """Each method against constant velocity, where that has the measure, and against `reference`; "mean" is the mean over places, each of which is
    resampled by itself; a second mean leaves out the places that were `used` for choices. The same seed gives the same
    intervals."""
    comparisons = []
    people = _by_person(results)
    names = list(dict.fromkeys((r["split"], r["method"]) for r in results))
    others = (reference,) if measure not in WITH_CONSTANT else (None, reference)
    for split, method in names:
        own = people[split, method]
        for against in others:
            if method == against or (against is not None and (split, against) not in people):
                continue
            other = None if against is None else people[split, against]
            of_place: dict[str, tuple[int, float, Array]] = {}  # people, difference, its spread
            for place in own:
                pairs = _pairs(own[place], None if other is None else other.get(place, {}), measure)
                if len(pairs) == 0:
                    continue
                difference, spread = bootstrap_pairs(pairs, bootstraps, seed + len(of_place))
                comparisons.append(_comparison(split, place, method, against, len(pairs), difference, spread))
                if place != ALL:  # is the sum of the others already
                    of_place[place] = len(pairs), difference, spread
            unused = [found for place, found in of_place.items() if place not in used]
            if len(of_place) > 1:
                comparisons.append(_mean_of(MEAN, split, method, against, list(of_place.values())))
            if 1 < len(unused) < len(of_place):
                comparisons.append(_mean_of(MEAN_UNUSED, split, method, against, unused))
    return comparisons


#: (split, method) -> place -> person -> (trial, order) -> sums
People = dict[tuple[str, str], dict[str, dict[str, dict[tuple[int, int], Sums]]]]


def _by_person(results: Sequence[Mapping[str, Any]]) -> People:
    found: People = {}
    for result in results:
        places = found.setdefault((result["split"], result["method"]), {})
        when = result["trial"], result["order"]
        for name, site in result["places"].items():
            for person, sums in site["people"].items():
                places.setdefault(name, {}).setdefault(f"{name}/{person}", {})[when] = sums
                if len(result["places"]) > 1:
                    places.setdefault(ALL, {}).setdefault(f"{name}/{person}", {})[when] = sums
        if len(result["places"]) > 1:
            places[ALL] = places.pop(ALL)  # last
    return found


def _pairs(own: Mapping[str, Any], other: Mapping[str, Any] | None, measure: str) -> Array:
    """(people, 3): sums of the method's errors, the other's and constant velocity's, over the trials that both have."""
    constant, unit = "constant_" + measure, UNITS[measure]
    pairs = []
    for person in sorted(own):
        trials = own[person]
        if other is not None:
            trials = {when: sums for when, sums in trials.items() if when in other.get(person, {})}
        if trials:
            others = [s[constant] if other is None else other[person][when][measure] for when, s in trials.items()]
            errors = [s[measure] for s in trials.values()], others, [s[unit] for s in trials.values()]
            pairs.append([sum(error) for error in errors])
    return np.array(pairs).reshape(-1, 3)


def bootstrap_pairs(pairs: Array, bootstraps: int, seed: int) -> tuple[float, Array]:
    """The difference on the people themselves, then on resampled people."""

    def difference(method: Array, other: Array, constant: Array, axis: int = -1) -> Array:
        return np.asarray((method.sum(axis) - other.sum(axis)) / np.maximum(constant.sum(axis), 1e-12))

    columns = tuple(pairs.T)
    if len(pairs) < 2:
        return float(difference(*columns)), np.full(bootstraps, difference(*columns))
    batch = max(1, min(bootstraps, 2_000_000 // len(pairs)))
    found = stats.bootstrap(
        columns,
        difference,
        paired=True,
        vectorized=True,
        n_resamples=bootstraps,
        batch=batch,
        method="percentile",
        rng=np.random.default_rng(seed),
    )
    return float(difference(*columns)), found.bootstrap_distribution


def _mean_of(
    mean: str, split: str, method: str, against: str | None, places: Sequence[tuple[int, float, Array]]
) -> Comparison:
    people, differences, spreads = zip(*places)
    return _comparison(
        split, mean, method, against, sum(people), float(np.mean(differences)), np.mean(spreads, axis=0)
    )


def _comparison(
    split: str, place: str, method: str, against: str | None, people: int, difference: float, spread: Array
) -> Comparison:
    low, high = np.quantile(spread, [0.025, 0.975])
    named = against or CONSTANT_VELOCITY
    return Comparison(split, place, method, named, people, difference, float(low), float(high))
