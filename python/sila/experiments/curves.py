"""Learning curves of experiments: by numbers of tracks, and after each episode."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from .experiment import Experiment, Settings
from .markdown import decimals_of, marked_texts, table_text
from .tables import BY_NAME, MEAN, compare

#: Of learning curves.
CURVES = {"ratio": "wMHD / CV", "ade_ratio": "ADE / CV", "nll": "NLL a step"}
#: The sums that their differences are of.
MEASURES = {"ratio": "mhd_m", "ade_ratio": "ade_m", "nll": "nll"}


#: The sums of a person that the intervals of a learning curve need.
PERSON_SUMS = ("windows", *(name for measure in MEASURES.values() for name in (measure, "constant_" + measure)))


def point_of(site: Mapping[str, Any]) -> dict[str, Any]:
    """What a learning curve keeps of the scores at a place."""
    people = {person: {name: sums[name] for name in PERSON_SUMS} for person, sums in site["people"].items()}
    return {"groups": site["groups"], "people": people}


def curves_of(settings: Settings, results: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    return learning_curves(results) if settings.tracks else curves(results)


def _row_of(result: Mapping[str, Any], point: Mapping[str, Any]) -> dict[str, Any]:
    row = {key: result[key] for key in ("scene", "method", "split", "trial", "order")}
    return row | {key: point[key] for key in ("episode", "tracks", "size", "seconds")}


def learning_curves(results: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """A row a place and number of tracks, from which a method has learnt anew; `episode` is the number of the column."""
    rows = []
    for result in results:
        for point in result["learning_curve"]:
            row = _row_of(result, point)
            for place, site in point["places"].items():
                names = ("windows", "weighted_mhd_m", "constant_mhd_m", *CURVES)
                rows.append({**row, "place": place, **{name: BY_NAME[name].of(site["groups"]) for name in names}})
    return pd.DataFrame(rows)


def curves(results: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """A row a checkpoint and place that was scored."""
    rows = []
    for result in results:
        for checkpoint in result["checkpoints"]:
            row = _row_of(result, checkpoint)
            if "places" not in checkpoint:
                rows.append({**row, "place": None})
            for place, groups in checkpoint.get("places", {}).items():
                moving = groups.get("moving")
                if moving is None:
                    continue
                model, constant = moving["model"], moving["constant_velocity"]
                rows.append({**row, "place": place, "windows": moving["windows"]})
                for name in ("weighted_mhd_m", "mean_path_mhd_m", "best_mhd_m", "mean_path_ade_m", "nll"):
                    rows[-1][name] = model[name]
                rows[-1]["constant_mhd_m"] = constant["weighted_mhd_m"]
                rows[-1]["constant_ade_m"] = constant["mean_path_ade_m"]
    first = ["scene", "place", "method", "split", "trial", "order", "episode", "tracks", "size", "seconds"]
    table = pd.DataFrame(rows)
    return table[[*first, *[name for name in table.columns if name not in first]]]


def learning_curve_tables(experiment: Experiment, results: Sequence[Mapping[str, Any]]) -> str:
    """A table a split and measure: methods at each place by numbers of tracks."""
    counts, found = experiment.settings.tracks, []
    rows = learning_curves(results)
    for split, own in rows.groupby("split", sort=False):
        whole = own[own["episode"] > len(counts)].groupby("place", sort=False)["tracks"].mean()
        for name, title in CURVES.items():
            means = own.groupby(["place", "method", "episode"], sort=False)[name].mean().unstack()
            lines = [line for place in whole.index for line in _curve_lines(experiment, place, means.loc[place], name)]
            if experiment.settings.kind == "one_place" and len(whole) > 1:
                mean = means.groupby("method", sort=False).agg(lambda column: column.mean(skipna=False))
                lines += _curve_lines(experiment, "mean", mean, name)
            titles = ["method", *map(str, counts), "all"]
            found.append(f"## {title}, split by {split}\n\n{table_text('place', titles, lines)}")
            if experiment.settings.kind == "one_place" and len(whole) > 1:
                found.append(f"Means: {_DIFFERENCES}\n\n{_differences(experiment, results, split, name, titles)}")
        found.append("All: " + ", ".join(f"{place} {count:.0f}" for place, count in whole.items()) + " tracks.\n")
    about = "Each method learns the first tracks of the training part from the beginning, and is scored on the same windows."
    return f"# Learning curves\n\n{about} Bold: better than {experiment.reference} from as many.\n\n" + "\n".join(found)


_DIFFERENCES = "differences over the same people in the same trials, and their 95 % intervals by resampling people."


def _differences(
    experiment: Experiment, results: Sequence[Mapping[str, Any]], split: Any, name: str, titles: Sequence[str]
) -> str:
    """A table: how much larger the mean error of each method is than that of another, by numbers of tracks."""
    settings, cells = experiment.settings, dict[tuple[str, str], dict[int, str]]()
    for point in range(1, len(settings.tracks) + 2):
        own = [
            {**result, "places": at["places"]}
            for result in results
            for at in result["learning_curve"]
            if result["split"] == split and at["episode"] == point
        ]
        for c in compare(own, experiment.reference, settings.bootstraps, settings.seed, MEASURES[name]):
            if c.place == MEAN:
                text = f"{c.difference:.3f} ({c.low:.3f} to {c.high:.3f})"
                cells.setdefault((c.method, c.against), {})[point] = text
    lines = [
        (method, [against, *(texts.get(point, "–") for point in range(1, len(settings.tracks) + 2))])
        for (method, against), texts in cells.items()
    ]
    return table_text("method", ["against", *titles[1:]], lines)


def _curve_lines(experiment: Experiment, place: str, means: pd.DataFrame, name: str) -> list[tuple[str, list[str]]]:
    means = means.reindex(columns=range(1, len(experiment.settings.tracks) + 2))
    reference = list(means.index).index(experiment.reference) if experiment.reference in means.index else 0
    columns = [list(means[point]) for point in means]
    cells = [marked_texts(column, decimals_of(name), reference) for column in columns]
    return [(place, [method, *row]) for method, row in zip(means.index, zip(*cells))]


def growth_table(results: Sequence[Mapping[str, Any]]) -> str:
    """The paper's measures: size after shares of the episodes and for each trajectory, time to learn an episode."""
    rows = [
        {"scene": r["scene"], "method": r["method"], "share": c["episode"] / len(r["checkpoints"]), **c}
        for r in results
        for c in r["checkpoints"]
        if len(r["checkpoints"]) > 1
    ]
    lines = []
    for (scene, method), table in pd.DataFrame(rows).groupby(["scene", "method"], sort=False):
        sizes = [
            # The nearest episode, or the mean of the two nearest, of which rounding must not remove one.
            table[(table["share"] - share).abs() <= 0.5 / table["episode"].max() + 1e-9]["size"].mean()
            for share in (0.25, 0.5, 1)
        ]
        last = table[table["share"] == 1]
        halves = [1000 * table[half]["seconds"].mean() for half in (table["share"] <= 0.5, table["share"] > 0.5)]
        growth = sizes[-1] / last["tracks"].mean()
        cells = [*(f"{size:.0f}" for size in sizes), f"{growth:.2f}", *(f"{ms:.0f}" for ms in halves)]
        lines.append((str(scene), [str(method), *cells]))
    titles = ["method", "size after 25 %", "50 %", "100 %", "per trajectory", "ms an episode, 1st half", "2nd half"]
    return f"# Growth\n\nMeans over trials, splits and orders.\n\n{table_text('scene', titles, lines)}"
