"""What an experiment leaves in its folder: results.json, results.csv, curves.csv, table.md."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .. import _sila
from .changes import changes_table
from .curves import curves_of, growth_table, learning_curve_tables
from .experiment import Experiment
from .markdown import (
    bold_text,
    build_hash,
    decimals_of,
    made_with,
    marked_texts,
    number_text,
    provenance,
    table_text,
    write_text,
)
from .tables import ALL, BY_NAME, COLUMNS, POOLED, WITH_SPREAD, Column, Comparison, compare, rows_of, summarise

SPLITS = {"time": "by blocks of time with an embargo", "track": "by track (companions are learnt from)"}
MEASURES = {
    "mhd_m": "weighted MHD, of constant velocity's",
    "ade_m": "ADE of the mean path, of constant velocity's",
    "nll": "NLL, nats a step",
    "energy_score_m": "energy score, of constant velocity's ADE",
}
#: Of the summary over places: value -> title.
BRIEF = {
    "ratio": "wMHD / CV",
    "ade_ratio": "ADE / CV",
    "fde_ratio": "FDE / CV",
    "turning_ratio": "turning / CV",
    "min_ade_6_ratio": "min ADE of 6 / CV",
    "nll": "NLL",
    "energy_score_m": "energy score [m]",
    "reliability_average": "reliability",
    "reliability_least": "least",
    "training_s": "training [s of CPU]",
    "training_j": "training [J]",
    "bytes": "bytes",
    "us_per_prediction": "µs a prediction",
}
#: By place, in tables of their own.
BY_PLACE = {
    "ratio": "wMHD / CV",
    "ade_ratio": "ADE / CV",
    "nll": "NLL a step",
    "energy_score_m": "energy score [m]",
    "equal_area_68_m2": "area of the regions that hold 68 % [m²]",
    "equal_area_95_m2": "area of the regions that hold 95 % [m²]",
}
LARGER_IS_BETTER = ("reliability_average", "reliability_least")
GEOMETRIC = ("size", "training_s", "training_j", "bytes", "us_per_prediction")  # places differ by orders of magnitude
#: Means over places leave out places with fewer such windows in all trials.
LEAST_WINDOWS = 50


def write_results(
    folder: Path, experiment: Experiment, results: Sequence[Mapping[str, Any]], trials: int
) -> dict[str, Any]:
    """Writes everything about the results of the first `trials` trials; gives what results.json holds."""
    settings = experiment.settings
    rows = rows_of(results)
    summary = summarise(rows, results)
    used = experiment.used_for_choices
    comparisons = {
        measure: compare(results, experiment.reference, settings.bootstraps, settings.seed, measure, used)
        for measure in MEASURES
    }
    orders = _sila.orders_of(len(experiment.scenes), settings.orders, settings.seed)
    names = [scene.name for scene in experiment.scenes]
    written: dict[str, Any] = {
        "version": _sila.version,
        "build": build_hash(),
        "made_with": made_with(method.cls for method in experiment.methods),
        "command": f"sila experiment {experiment.file} --trials {settings.trials} --split {settings.split} --seed {settings.seed}",
        "seed": settings.seed,
        "experiment": experiment.resolved(),
        **({"orders": [[names[i] for i in order] for order in orders]} if settings.kind == "places" else {}),
        "not_run_here": {method.name: method.missing for method in experiment.methods if method.cls is None},
        "summary": _summary_json(summary),
        "comparisons": [_labelled(c, settings.split) for c in comparisons["mhd_m"]],
        "ade_comparisons": [_labelled(c, settings.split) for c in comparisons["ade_m"]],
        "curves": [_curve_json(result, settings.split) for result in results],
    }
    write_text(folder / "results.json", json.dumps(written, indent=1, allow_nan=False) + "\n")
    write_text(folder / "results.csv", rows.to_csv(index=False, lineterminator="\n"))
    write_text(folder / "curves.csv", curves_of(settings, results).to_csv(index=False, lineterminator="\n"))
    write_text(folder / "table.md", markdown(experiment, results, summary, comparisons, trials, written["made_with"]))
    return written


def _label(place: str, split: str, of: str) -> str:
    """Places of two splits have two curves."""
    return f"{place} (by track)" if of == "both" and split == "track" else place


def _labelled(comparison: Comparison, of: str) -> dict[str, Any]:
    return comparison._asdict() | {"place": _label(comparison.place, comparison.split, of)}


def _curve_json(result: Mapping[str, Any], of: str) -> dict[str, Any]:
    def labelled(checkpoint: Mapping[str, Any]) -> dict[str, Any]:
        if "places" not in checkpoint:
            return dict(checkpoint)
        places = {_label(place, result["split"], of): groups for place, groups in checkpoint["places"].items()}
        return {**checkpoint, "places": places}

    curve = {key: result[key] for key in ("method", "split", "trial", "order")}
    scene = _label(result["scene"], result["split"], of)
    return {"scene": scene, **curve, "checkpoints": [labelled(c) for c in result["checkpoints"]]}


def _summary_json(summary: pd.DataFrame) -> list[dict[str, Any]]:
    found = []
    for (split, place, method), row in summary.iterrows():
        item: dict[str, Any] = {"place": place, "method": method, "split": split}
        for name in BY_NAME:
            if row[name, "count"] > 0:
                deviation = row[name, "std"] if row[name, "count"] > 1 else 0.0
                item[name] = {"trials": int(row[name, "count"]), "mean": row[name, "mean"], "deviation": deviation}
        item |= {name: row[name, "mean"] for name, _ in POOLED if not np.isnan(row[name, "mean"])}
        found.append(item)
    return found


def markdown(
    experiment: Experiment,
    results: Sequence[Mapping[str, Any]],
    summary: pd.DataFrame,
    comparisons: Mapping[str, Sequence[Comparison]],
    trials: int,
    made: Mapping[str, Any],
) -> str:
    settings = experiment.settings
    finished = f"{trials}" + (f" of {settings.trials}" if trials < settings.trials else "")
    text = [
        f"# {Path(experiment.file).stem}\n",
        provenance(made, f"{finished} trials, seed {settings.seed}; ") + "\n",
        "Moving windows, mean over trials ± deviation. CV: constant velocity on the same windows.\n",
    ]
    places = summary.index.get_level_values("place").unique()
    text.append(f"# Mean over the places\n\n{_brief(experiment, summary)}")
    used = experiment.used_for_choices
    if 0 < len(used) < len(experiment.scenes):
        unused = summary[~summary.index.get_level_values("place").isin(used)]
        heading = f"# Mean over the places not used for choices\n\nWithout {', '.join(sorted(used))}. "
        text.append(heading + _brief(experiment, unused))
    if len(places) > 1 and len(experiment.methods) > 1:
        text.append(_by_place(experiment, summary))
    if settings.tracks:
        text.append(learning_curve_tables(experiment, results))
    if any(len(result["checkpoints"]) > 1 for result in results):
        text.append(growth_table(results))
    for split in settings.splits:
        if split not in summary.index.get_level_values("split"):
            continue
        text.append(f"# Split {SPLITS[split]}\n")
        for place in places:
            text.append(
                _table(
                    f"## {place}", "method", [(m, r) for (s, p, m), r in summary.iterrows() if (s, p) == (split, place)]
                )
            )
        if len(places) > 1:
            text.append(_means(summary.loc[split]))
        text.append(changes_table(results, split, settings.bootstraps, settings.seed))
        for measure, rows in comparisons.items():
            paired = [c for c in rows if c.split == split and experiment.reference in (c.method, c.against)]
            text.append(_comparison_table(MEASURES[measure], paired))
    return "\n".join(text)


def _cell(column: Column, mean: float, deviation: float) -> str:
    with_spread = column.name in WITH_SPREAD and not np.isnan(deviation)
    spread = f" ± {number_text(deviation, column.decimals)}" if with_spread else ""
    return number_text(mean, column.decimals) + spread


def _table(heading: str, first: str, rows: Sequence[tuple[str, Any]]) -> str:
    shown = [column for column in COLUMNS if column.title and any(row[column.name, "count"] > 0 for _, row in rows)]
    titles = [column.title for column in shown] + [title for _, title in POOLED]
    cells = [
        (name, [_cell(c, *row[c.name][["mean", "std"]]) for c in shown] + [number_text(row[p, "mean"], 3) for p, _ in POOLED])
        for name, row in rows
    ]
    return f"{heading}\n\n{table_text(first, titles, cells)}"


def _over_places(rows: pd.DataFrame, name: str) -> tuple[float, float]:
    """Mean and deviation over places of the mean over trials; of sizes and times the geometric mean."""
    means = rows[name, "mean"]
    group = name.partition("_")[0]
    if group in ("turning", "standing") and not name.endswith("windows"):
        means = means[rows[f"{group}_windows", "mean"] * rows[f"{group}_windows", "count"] >= LEAST_WINDOWS]
    means = means.dropna()
    if len(means) == 0:
        return np.nan, np.nan
    if name in GEOMETRIC:
        return float(np.exp(np.log(means.clip(lower=1 if name == "size" else 1e-9)).mean())), np.nan
    return float(means.mean()), float(means.std()) if len(means) > 1 else np.nan


def _means(summary: pd.DataFrame) -> str:
    own = summary[summary.index.get_level_values("place") != ALL]
    shown = [column for column in COLUMNS if column.title and own[column.name, "mean"].notna().any()]
    lines = []
    for method in own.index.get_level_values("method").unique():
        rows = own.xs(method, level="method")
        cells = [_cell(column, *_over_places(rows, column.name)) for column in shown]
        lines.append((method, cells + [number_text(rows[p, "mean"].mean(), 3) for p, _ in POOLED]))
    titles = [column.title for column in shown] + [title for _, title in POOLED]
    return (
        "## Mean over the places\n\n± is the deviation between places; size: geometric mean; turning and standing: places "
        f"with at least {LEAST_WINDOWS} such windows in all trials.\n\n{table_text('method', titles, lines)}"
    )


def _brief(experiment: Experiment, summary: pd.DataFrame) -> str:
    """Mean over places, both splits side by side."""
    splits = [split for split in experiment.settings.splits if split in summary.index.get_level_values("split")]
    own = summary[summary.index.get_level_values("place") != ALL]
    methods = list(own.index.get_level_values("method").unique())
    reference = methods.index(experiment.reference) if experiment.reference in methods else 0
    places = own.index.get_level_values("place").unique()
    cells: list[list[str]] = [[] for _ in methods]
    titles = []
    for name, title in BRIEF.items():
        if own[name, "mean"].isna().all():
            continue
        for split in splits:
            rows = own.loc[split]
            values = [_over_places(rows.xs(method, level="method"), name)[0] for method in methods]
            for row, text in zip(cells, marked_texts(values, decimals_of(name), reference, name in LARGER_IS_BETTER)):
                row.append(text)
            titles.append(f"{title}, {split}" if len(splits) > 1 else title)
    here = {method: own.xs(method, level="method").index.get_level_values("place").nunique() for method in methods}
    named = [m if here[m] == len(places) else f"{m} ({here[m]} of {len(places)} places)" for m in methods]
    lines = list(zip(named, cells))
    lines += [(f"{m.name} (not run here)", ["–"] * len(titles)) for m in experiment.methods if m.cls is None]
    better = f"Bold: better than {methods[reference]}. " if len(methods) > 1 else ""
    return (
        f"{better}Sizes and times are geometric means; a prediction is one of all that are made "
        f"together.\n\n{table_text('method', titles, lines)}"
    )


def _by_place(experiment: Experiment, summary: pd.DataFrame) -> str:
    """A table a split and measure: methods by places."""
    found = []
    for split in summary.index.get_level_values("split").unique():
        own = summary.loc[split]
        places = [p for p in own.index.get_level_values("place").unique() if p != ALL]
        methods = list(own.index.get_level_values("method").unique())
        reference = methods.index(experiment.reference) if experiment.reference in methods else 0
        for name, title in BY_PLACE.items():
            columns = []
            for place in places:
                rows = own.loc[place]
                values = [rows.loc[m][name, "mean"] if m in rows.index else np.nan for m in methods]
                columns.append(marked_texts(values, decimals_of(name), reference))
            lines = list(zip(methods, (list(row) for row in zip(*columns))))
            found.append(f"## {title}, split by {split}\n\n{table_text('method', places, lines)}")
    return "# By place\n\nBold: better than the method that the others are compared with.\n\n" + "\n".join(found)


def _comparison_table(measure: str, comparisons: Sequence[Comparison]) -> str:
    rows = [
        (
            c.place,
            [c.method, c.against, str(c.people), bold_text(f"{c.difference:.3f}", c.high < 0), f"{c.low:.3f} to {c.high:.3f}"],
        )
        for c in comparisons
    ]
    return (
        f"## Paired comparisons: {measure}\n\nDifference over the moving windows of the same people in the same trials; "
        "below 0 the method is better, bold where the whole interval is. 95 % interval by resampling people.\n\n"
        + table_text("place", ["method", "against", "people", "difference", "95 %"], rows)
    )
