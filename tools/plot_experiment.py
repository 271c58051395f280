#!/usr/bin/env python3
"""Draws the results of `sila experiment` from DIR/curves.csv and DIR/results.csv.

    python3 tools/plot_experiment.py DIR [--png]

    DIR/curves_PLACE.svg    error, size and seconds after every episode (mean and deviation over trials and orders)
    DIR/errors.svg          error of each method at each place, relative to constant velocity, trial by trial

--png writes PNG beside the SVG. A developer's tool; it needs matplotlib (Debian: python3-matplotlib) and nothing else does.
"""
import argparse
import collections
import csv
import pathlib
import re
import statistics

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

# Colours that people with a colour vision deficiency tell apart (Okabe and Ito), then greys.
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#7F7F7F", "#B8A100", "#5B3A8C"]
MARKERS = "osD^vPX*<>"

plt.rcParams.update({
    "font.size": 10, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": "#e6e6e6",
    "axes.axisbelow": True, "legend.frameon": False, "svg.hashsalt": "sila", "figure.dpi": 110,
})


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def first_seen(rows, key):
    return list(dict.fromkeys(row[key] for row in rows if row[key]))


def style_of(methods):
    return {method: (COLOURS[i % len(COLOURS)], MARKERS[i % len(MARKERS)]) for i, method in enumerate(methods)}


def series(rows, value):
    """Tracks learnt -> mean and deviation of a value; rows without the value are left out."""
    at = collections.defaultdict(list)
    for row in rows:
        number = value(row)
        if number is not None:
            at[int(row["tracks"])].append(number)
    most = max((len(numbers) for numbers in at.values()), default=0)
    points = [(tracks, numbers) for tracks, numbers in sorted(at.items()) if 2 * len(numbers) >= most]
    return ([t for t, _ in points], [statistics.fmean(n) for _, n in points],
            [statistics.stdev(n) if len(n) > 1 else 0.0 for _, n in points])


def error(row):
    return float(row["weighted_mhd_m"]) / float(row["constant_mhd_m"]) if row["weighted_mhd_m"] else None


PANELS = [("error", "weighted MHD / constant velocity", error), ("size", "primitives and transitions", lambda r: float(r["size"])),
          ("seconds", "seconds an episode", lambda r: float(r["seconds"]))]


def draw_curves(rows, place, styles):
    rows = [row for row in rows if row["place"] == place or (not row["place"] and row["scene"] in (place, "all"))]
    methods = [method for method in styles if any(row["method"] == method for row in rows)]
    if not any(len({row["tracks"] for row in rows if row["method"] == method}) > 1 for method in methods):
        return None
    figure, axes = plt.subplots(1, 3, figsize=(12.5, 4.3), constrained_layout=True)
    for axis, (name, label, value) in zip(axes, PANELS):
        for method in methods:
            colour, marker = styles[method]
            x, mean, spread = series([row for row in rows if row["method"] == method], value)
            if len(x) == 1:  # learnt at once
                axis.plot(x, mean, marker, color=colour, label=method)
            elif x:
                axis.plot(x, mean, color=colour, lw=1.8, label=method, marker=marker, ms=4,
                          markevery=max(1, len(x) // 6))
                axis.fill_between(x, [m - s for m, s in zip(mean, spread)], [m + s for m, s in zip(mean, spread)],
                                  color=colour, alpha=0.12, lw=0)
        axis.set_xlabel("tracks learnt")
        axis.set_title(label, loc="left", fontsize=10)
        axis.set_xlim(left=0)
        if name != "error":
            axis.set_ylim(bottom=0)
    largest = [max((v for m in methods for v in series([r for r in rows if r["method"] == m], PANELS[2][2])[1][-1:]), default=0),
               min((v for m in methods for v in series([r for r in rows if r["method"] == m], PANELS[2][2])[1][-1:]), default=0)]
    if largest[1] > 0 and largest[0] > 20 * largest[1]:  # who relearns everything would hide the others
        axes[2].set_ylim(bottom=largest[1] / 3)
        axes[2].set_yscale("log")
        axes[2].set_title("seconds an episode (log)", loc="left", fontsize=10)
    if axes[0].get_ylim()[1] > 1.0:
        axes[0].axhline(1.0, color="#999999", lw=1, ls="--", zorder=0)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncol=min(6, len(labels)))
    figure.suptitle(place, x=0.01, ha="left", fontweight="bold")
    return figure


def draw_errors(rows, styles):
    places = [place for place in first_seen(rows, "place") if any(row["ratio"] for row in rows if row["place"] == place)]
    figure, axis = plt.subplots(figsize=(9.5, 1.2 + 0.24 * len(places) * (len(styles) + 1)), constrained_layout=True)
    for p, place in enumerate(places):
        for m, (method, (colour, marker)) in enumerate(styles.items()):
            values = [float(row["ratio"]) for row in rows if row["place"] == place and row["method"] == method and row["ratio"]]
            if not values:
                continue
            y = p * (len(styles) + 1) + m
            mean = statistics.fmean(values)
            spread = statistics.stdev(values) if len(values) > 1 else 0.0
            axis.plot(values, [y] * len(values), "|", color=colour, ms=6, alpha=0.45)
            axis.plot([mean - spread, mean + spread], [y, y], color=colour, lw=1.6)
            axis.plot([mean], [y], marker, color=colour, ms=6, label=method if p == 0 else None)
    centre = (len(styles) - 1) / 2
    axis.set_yticks([p * (len(styles) + 1) + centre for p in range(len(places))], places)
    axis.tick_params(axis="y", length=0)
    axis.grid(axis="y", visible=False)
    for p in range(1, len(places)):
        axis.axhline(p * (len(styles) + 1) - 1, color="#e6e6e6", lw=1)
    axis.set_ylim(len(places) * (len(styles) + 1) - 1, -1)
    axis.axvline(1.0, color="#999999", lw=1, ls="--", zorder=0)
    axis.set_xlabel("weighted MHD / constant velocity, moving windows; each trial, mean and deviation")
    axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncol=min(5, len(styles)))
    return figure


def save(figure, path, png):
    figure.savefig(path, metadata={"Date": None}, bbox_inches="tight")
    if png:
        figure.savefig(path.with_suffix(".png"), bbox_inches="tight")
    plt.close(figure)
    print(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path, metavar="DIR")
    parser.add_argument("--png", action="store_true", help="write PNG beside the SVG")
    options = parser.parse_args()
    curves, results = read(options.folder / "curves.csv"), read(options.folder / "results.csv")
    styles = style_of(first_seen(results, "method"))
    for place in first_seen(curves, "place"):
        figure = draw_curves(curves, place, styles)
        if figure:
            save(figure, options.folder / f"curves_{re.sub('[^A-Za-z0-9.-]+', '_', place)}.svg", options.png)
    save(draw_errors(results, styles), options.folder / "errors.svg", options.png)


if __name__ == "__main__":
    main()
