"""Figures of an experiment's folder: learning curves, accuracy against size and against time, errors of each trial, and
the coverage of the nominal regions. With two splits those by track have `_by_track` in their names."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

# Colours that people with a colour vision deficiency tell apart (Okabe and Ito), then greys, then Paul Tol's muted ones.
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#7F7F7F", "#B8A100", "#5B3A8C"]
COLOURS += ["#882255", "#44AA99", "#DDCC77", "#AA4499", "#117733", "#CC6677", "#332288"]
MARKERS = "osD^vPX*<>"
GREY = "#999999"
STYLE: Any = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "axes.axisbelow": True,
    "legend.frameon": False,
    "svg.hashsalt": "sila",
    "figure.dpi": 110,
}
TOLERANCE = {0.5: 0.05, 0.9: 0.03}  # what sila asks of itself: nominal coverage -> deviation
RATIO = "weighted MHD / constant velocity"
PANELS = {"error": RATIO, "size": "primitives and transitions", "seconds": "seconds an episode"}
ERRORS = {"ade_ratio": "ADE / constant velocity", "nll": "NLL [nats a step]"}
ERROR_PANELS = {"error": RATIO, **ERRORS}

Styles = dict[str, dict[str, Any]]


def draw(folder: Path, *, png: bool = False) -> list[Path]:
    """Draws everything; gives the paths. Nominal regions are those of the first method."""
    curves, rows = pd.read_csv(folder / "curves.csv"), pd.read_csv(folder / "results.csv")
    curves["error"] = curves["weighted_mhd_m"] / curves["constant_mhd_m"]
    methods = list(rows["method"].unique())
    styles = {m: {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[(i + i // 10) % 10]} for i, m in enumerate(methods)}
    by_tracks = bool(json.loads((folder / "results.json").read_text(encoding="utf-8"))["experiment"]["tracks"])
    figures: dict[str, Figure | None] = {}
    with mpl.rc_context(STYLE):
        for split in rows["split"].unique():
            suffix = "" if split == "time" else f"_by_{split}"
            own, scored = rows[rows["split"] == split], curves[curves["split"] == split]
            for place in scored["place"].dropna().unique():
                name = re.sub("[^A-Za-z0-9.-]+", "_", place)
                figures[f"curves_{name}{suffix}"] = _curves(scored, place, styles, by_tracks)
            figures[f"errors{suffix}"] = _errors(own, styles)
            figures[f"tradeoff{suffix}"] = _tradeoff(own, styles)
            figures[f"cost{suffix}"] = _cost(own, styles)
        covered = coverage(folder, methods[0])
        covered.to_csv(folder / "reliability.csv", index=False, lineterminator="\n")
        figures["reliability"] = _coverage(covered, methods[0])
        paths = []
        for name, figure in figures.items():
            for ending in (".svg", ".png") if png else (".svg",):
                if figure is not None:
                    paths.append(folder / (name + ending))
                    metadata = {"Date": None} if ending == ".svg" else None
                    figure.savefig(paths[-1], metadata=metadata, bbox_inches="tight")
    return paths


def _figure(width: float, height: float, rows: int = 1, columns: int = 1) -> tuple[Figure, Any]:
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False)


def _legend(figure: Figure, axes: Any, **settings: Any) -> None:
    handles = {label: handle for axis in axes.flat for handle, label in zip(*axis.get_legend_handles_labels())}
    figure.legend(handles.values(), handles.keys(), loc="upper center", bbox_to_anchor=(0.5, 0.0), **settings)


def _curves(curves: pd.DataFrame, place: str, styles: Styles, by_tracks: bool) -> Figure | None:
    """Error, size and seconds after every episode, or errors by numbers of tracks: mean and deviation over trials and
    orders."""
    rows = curves[(curves["place"] == place) | (curves["place"].isna() & curves["scene"].isin([place, "all"]))]
    if rows.groupby("method")["tracks"].nunique().max() < 2:
        return None
    figure, axes = _figure(12.5, 4.3, 1, 3)
    last_seconds = []
    # Trials have different numbers of tracks in all.
    x = rows.groupby(["method", "episode"])["tracks"].transform("mean") if by_tracks else rows["tracks"]
    for axis, (value, label) in zip(axes.flat, (ERROR_PANELS if by_tracks else PANELS).items()):
        for method, style in styles.items():
            own = rows[rows["method"] == method].dropna(subset=value)
            points = own.groupby(x)[value].agg(["mean", "std", "count"])
            points = points[2 * points["count"] >= points["count"].max()]
            if len(points) == 0:
                continue
            _with_spread(axis, points, method, style, joined=own.duplicated(["trial", "order"]).any())
            if value == "seconds":
                last_seconds.append(points["mean"].iloc[-1])
        axis.set_xlabel("tracks learnt")
        axis.set_title(label, loc="left", fontsize=10)
        if by_tracks:
            axis.set_xscale("log")
            axis.set_xticks(sorted(set(x)), [f"{tick:.0f}" for tick in sorted(set(x))])
            axis.minorticks_off()
            continue
        axis.set_xlim(left=0)
        if value != "error":
            axis.set_ylim(bottom=0)
    if last_seconds and max(last_seconds) > 20 * min(last_seconds) > 0:  # retraining would hide the others
        axes[0, 2].set_ylim(bottom=min(last_seconds) / 3)
        axes[0, 2].set_yscale("log")
    if axes[0, 0].get_ylim()[1] > 1:
        axes[0, 0].axhline(1, color=GREY, lw=1, ls="--", zorder=0)
    _legend(figure, axes, ncol=min(6, len(styles)))
    figure.suptitle(place, x=0.01, ha="left", fontweight="bold")
    return figure


def _with_spread(axis: Any, points: pd.DataFrame, method: str, style: dict[str, Any], joined: bool) -> None:
    line = "-" if joined else ""  # each trial has one point
    axis.plot(points.index, points["mean"], ls=line, label=method, ms=4, markevery=max(1, len(points) // 6), **style)
    spread = points["std"].fillna(0)
    low, high = points["mean"] - spread, points["mean"] + spread
    axis.fill_between(points.index, low, high, color=style["color"], alpha=0.12, lw=0)


def _errors(rows: pd.DataFrame, styles: Styles) -> Figure:
    """Error of each method at each place, trial by trial."""
    places = list(rows.dropna(subset="ratio")["place"].unique())
    height = len(styles) + 1
    figure, axes = _figure(9.5, 1.2 + 0.24 * max(1, len(places)) * height)
    axis = axes[0, 0]
    for p, place in enumerate(places):
        for m, (method, style) in enumerate(styles.items()):
            values = rows[(rows["place"] == place) & (rows["method"] == method)]["ratio"].dropna()
            if len(values) == 0:
                continue
            axis.plot(values, [p * height + m] * len(values), "|", color=style["color"], ms=6, alpha=0.45)
            spread = values.std() if len(values) > 1 else None
            axis.errorbar(values.mean(), p * height + m, xerr=spread, ls="", label=None if p else method, **style)
    axis.set_yticks([p * height + (height - 2) / 2 for p in range(len(places))], places)
    axis.tick_params(axis="y", length=0)
    axis.grid(axis="y", visible=False)
    axis.set_ylim(len(places) * height - 1, -1)
    axis.axvline(1, color=GREY, lw=1, ls="--", zorder=0)
    axis.set_xlabel(f"{RATIO}, moving windows; each trial, mean and deviation")
    _legend(figure, axes, ncol=min(5, len(styles)))
    return figure


def _tradeoff(rows: pd.DataFrame, styles: Styles) -> Figure | None:
    """As in the paper: the largest 1 / MHD of a place is 1. None where no method has a size of its own."""
    means = rows[rows["size"] > 0].groupby(["place", "method"], sort=False)[["size", "weighted_mhd_m"]].mean().dropna()
    places = list(dict.fromkeys(means.index.get_level_values("place")))
    if not places or means["size"].nunique() < 2:
        return None
    columns = min(3, len(places))
    figure, axes = _figure(4.2 * columns, 3.6 * -(-len(places) // columns), -(-len(places) // columns), columns)
    for axis, place in zip(axes.flat, places):
        least = means.loc[place]["weighted_mhd_m"].min()
        for method, row in means.loc[place].iterrows():
            axis.plot(row["size"], least / row["weighted_mhd_m"], ls="", ms=7, label=method, **styles[str(method)])
        axis.set(title=place, xlabel="primitives and transitions", ylabel="(1 / MHD) / largest")
        axis.set_xlim(left=0)
    for axis in axes.flat[len(places) :]:
        axis.set_visible(False)
    _legend(figure, axes, ncol=min(6, len(styles)))
    return figure


COSTS = {"training_s": "training [s of CPU]", "bytes": "bytes", "us_per_prediction": "µs of CPU a prediction"}
MOST_SHOWN = 2.0  # the other methods would be one point


def _cost(rows: pd.DataFrame, styles: Styles) -> Figure | None:
    """Error against each cost; over the places where every method ran errors are means, costs geometric means."""
    own = rows[rows["place"] != "all"]
    means = own.groupby(["place", "method"], sort=False)[[*ERRORS, *COSTS]].mean()
    table = means[list(ERRORS)].unstack()
    everywhere = table["ade_ratio"].dropna().index
    means = means[means.index.get_level_values("place").isin(everywhere)]
    if len(means) == 0:
        return None
    errors = means[list(ERRORS)].groupby("method", sort=False).mean()
    far = errors.index[errors["ade_ratio"] > MOST_SHOWN].tolist()
    errors = errors.drop(far)
    costs = np.exp(np.log(means[list(COSTS)].clip(lower=1e-6)).groupby("method", sort=False).mean())
    figure, axes = _figure(4.0 * len(COSTS), 3.4 * len(ERRORS), len(ERRORS), len(COSTS))
    for row, (error, error_title) in zip(axes, ERRORS.items()):
        for axis, (cost, title) in zip(row, COSTS.items()):
            for method in errors.index:
                axis.plot(costs.loc[method, cost], errors.loc[method, error], ls="", ms=8, label=method, **styles[method])
            axis.set(xscale="log", xlabel=title)
        row[0].set_ylabel(error_title)
    _legend(figure, axes, ncol=min(5, len(errors)))
    without = f"; without {', '.join(far)}: more than {MOST_SHOWN:g} times the ADE of CV" if far else ""
    figure.suptitle(f"mean of {', '.join(everywhere)}{without}", x=0.01, ha="left", fontsize=9)
    return figure


def coverage(folder: Path, method: str) -> pd.DataFrame:
    """Share of the truths in the nominal regions of a method, by place, split, horizon and nominal probability: of the
    moving windows of all trials together, with the deviation between trials."""
    rows = []
    for path in sorted((folder / "runs").glob("*.json")):
        result = json.loads(path.read_text(encoding="utf-8"))
        for place, scores in result["places"].items() if result["method"] == method else ():
            group = scores["evaluation"]["groups"]["moving"]
            for horizon in group["horizons"]:
                for level in horizon["model"]["coverage"]:
                    key = {"place": place, "split": result["split"], "horizon_s": horizon["horizon_s"]}
                    rows.append({**key, **level, "windows": group["windows"]})
    table = pd.DataFrame(rows, columns=["place", "split", "horizon_s", "nominal", "observed", "windows"])
    table["held"] = table["observed"] * table["windows"]
    grouped = table.groupby(["place", "split", "horizon_s", "nominal"], sort=False)
    found = grouped.agg(held=("held", "sum"), windows=("windows", "sum"), deviation=("observed", "std")).reset_index()
    found["covered"] = (found.pop("held") / found["windows"]).round(4)
    return found


def _coverage(covered: pd.DataFrame, method: str) -> Figure:
    panels = list(covered.groupby(["place", "split"], sort=False))
    columns = max(1, min(4, len(panels)))
    lines = max(1, -(-len(panels) // columns))
    figure, axes = _figure(3.1 * columns, 3.1 * lines, lines, columns)
    shades, horizons = mpl.colormaps["viridis"], sorted(covered["horizon_s"].unique())
    for axis, ((place, split), rows) in zip(axes.flat, panels):
        axis.plot([0, 1], [0, 1], color=GREY, lw=1, ls="--", zorder=0)
        for nominal, width in TOLERANCE.items():
            axis.plot([nominal] * 2, [nominal - width, nominal + width], color=GREY, lw=6, alpha=0.35, zorder=0)
        for shade, horizon_s in zip(np.linspace(0, 0.9, len(horizons)), horizons):
            points = rows[rows["horizon_s"] == horizon_s]
            axis.plot(
                points["nominal"], points["covered"], "o-", ms=3, lw=1.2, color=shades(shade), label=f"{horizon_s:g} s"
            )
        axis.set_title(place if split == "time" else f"{place}, by {split}", loc="left", fontsize=10)
        axis.set_aspect("equal")
    for axis in axes.flat[len(panels) :]:
        axis.set_visible(False)
    figure.supxlabel("nominal coverage of a region", fontsize=10)
    figure.supylabel("share of truths in it", fontsize=10)
    _legend(figure, axes, ncol=max(1, len(horizons)), title=f"{method}, after")
    return figure
