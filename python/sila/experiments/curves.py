"""Learning curves of experiments: by numbers of tracks, and after each episode."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from .experiment import Experiment, Settings
from .markdown import decimals_of, marked_texts, number_text, table_text
from .tables import BY_NAME

#: Of learning curves.
CURVES = {"ratio": "wMHD / CV", "ade_ratio": "ADE / CV", "nll": "NLL a step"}


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
            for place, groups in point["places"].items():
                names = ("windows", "weighted_mhd_m", "constant_mhd_m", *CURVES)
                rows.append({**row, "place": place, **{name: BY_NAME[name].of(groups) for name in names}})
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
        found.append("All: " + ", ".join(f"{place} {count:.0f}" for place, count in whole.items()) + " tracks.\n")
    about = "Each method learns the first tracks of the training part from the beginning, and is scored on the same windows."
    return f"# Learning curves\n\n{about} Bold: better than {experiment.reference} from as many.\n\n" + "\n".join(found)


def _curve_lines(experiment: Experiment, place: str, means: pd.DataFrame, name: str) -> list[tuple[str, list[str]]]:
    means = means.reindex(columns=range(1, len(experiment.settings.tracks) + 2))
    reference = list(means.index).index(experiment.reference) if experiment.reference in means.index else 0
    columns = [list(means[point]) for point in means]
    cells = [marked_texts([number_text(v, decimals_of(name)) for v in column], column, reference) for column in columns]
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
            table[(table["share"] - share).abs() <= 0.5 / table["episode"].max()]["size"].mean()
            for share in (0.25, 0.5, 1)
        ]
        last = table[table["share"] == 1]
        halves = [1000 * table[half]["seconds"].mean() for half in (table["share"] <= 0.5, table["share"] > 0.5)]
        growth = sizes[-1] / last["tracks"].mean()
        cells = [*(f"{size:.0f}" for size in sizes), f"{growth:.2f}", *(f"{ms:.0f}" for ms in halves)]
        lines.append((str(scene), [str(method), *cells]))
    titles = ["method", "size after 25 %", "50 %", "100 %", "per trajectory", "ms an episode, 1st half", "2nd half"]
    return f"# Growth\n\nMeans over trials, splits and orders.\n\n{table_text('scene', titles, lines)}"
