#!/usr/bin/env python3
"""Draws the results of `sila experiment` from DIR/curves.csv, DIR/results.csv and DIR/parts.

    python3 tools/plot_experiment.py DIR [--png] [--method NAME]

    DIR/curves_PLACE.svg    error, size and seconds after every episode (mean and deviation over trials and orders)
    DIR/curves.md           the same as a table: after shares of the episodes
    DIR/tradeoff.svg        accuracy against size, each method at each place: (1 / MHD) over the largest, as in the paper
    DIR/errors.svg          error of each method at each place, relative to constant velocity, trial by trial
    DIR/reliability.svg     how many truths the nominal regions of one method (the first, if none is named) held, by horizon
    DIR/reliability.csv     the same in numbers, over the moving windows of all trials, and the deviation between trials

--png writes PNG beside the SVG. A developer's tool; it needs matplotlib (Debian: python3-matplotlib) and nothing else does.
"""
import argparse
import collections
import csv
import json
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
    if largest[1] > 0 and largest[0] > 20 * largest[1]:  # who retrains everything would hide the others
        axes[2].set_ylim(bottom=largest[1] / 3)
        axes[2].set_yscale("log")
        axes[2].set_title("seconds an episode (log)", loc="left", fontsize=10)
    if axes[0].get_ylim()[1] > 1.0:
        axes[0].axhline(1.0, color="#999999", lw=1, ls="--", zorder=0)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncol=min(6, len(labels)))
    figure.suptitle(place, x=0.01, ha="left", fontweight="bold")
    return figure


def curves_table(curves, places, styles):
    """Markdown: error and size after shares of the episodes, growth per trajectory, milliseconds an episode."""
    shares = (0.1, 0.25, 0.5, 0.75, 1.0)
    lines = ["| place (episodes) | method | " + " | ".join(f"error after {share:.0%}" for share in shares) +
             " | size after 25% | 50% | 100% | per trajectory | ms an episode, 1st half | 2nd half |",
             "|" + "---|" * (len(shares) + 8)]
    for place in places:
        for method in styles:
            rows = [row for row in curves if row["place"] == place and row["method"] == method]
            episodes = max((int(row["episode"]) for row in rows), default=0)
            if len({row["episode"] for row in rows}) < max(2, episodes):  # not judged after every episode
                continue

            def at(share, value):
                when = max(1, round(share * episodes))
                return statistics.fmean(value(row) for row in rows if int(row["episode"]) == when)

            def milliseconds(wanted):
                return 1000 * statistics.fmean(float(row["seconds"]) for row in rows if wanted(int(row["episode"])))

            size = [at(share, PANELS[1][2]) for share in (0.25, 0.5, 1.0)]
            cells = ([f"{at(share, error):.3f}" for share in shares] + [f"{number:.0f}" for number in size] +
                     [f"{size[-1] / at(1.0, lambda row: float(row['tracks'])):.2f}"] +
                     [f"{milliseconds(wanted):.0f}" for wanted in (lambda n: 2 * n <= episodes, lambda n: 2 * n > episodes)])
            lines.append(f"| {place} ({episodes}) | {method} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n" if len(lines) > 2 else ""


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


def draw_tradeoff(rows, styles):
    """Mean over trials and orders; the largest 1 / MHD of a place is 1. None where no method has a size of its own."""
    rows = [row for row in rows if row["weighted_mhd_m"] and float(row["size"]) > 0]
    places = first_seen(rows, "place")
    if not places or len({row["size"] for row in rows}) < 2:
        return None
    columns = min(3, len(places))
    lines = -(-len(places) // columns)
    figure, axes = plt.subplots(lines, columns, figsize=(4.2 * columns, 3.6 * lines), constrained_layout=True, squeeze=False)
    for axis in axes.flat[len(places):]:
        axis.set_visible(False)
    for axis, place in zip(axes.flat, places):
        points = {}
        for method in styles:
            here = [row for row in rows if row["place"] == place and row["method"] == method]
            if here:
                points[method] = (statistics.fmean(float(row["size"]) for row in here),
                                  1.0 / statistics.fmean(float(row["weighted_mhd_m"]) for row in here))
        best = max(accuracy for _, accuracy in points.values())
        for method, (size, accuracy) in points.items():
            axis.plot([size], [accuracy / best], styles[method][1], color=styles[method][0], ms=7, label=method)
        axis.set_title(place, loc="left", fontsize=10)
        axis.set_xlim(left=0)
        axis.set_xlabel("primitives and transitions")
        axis.set_ylabel("(1 / MHD) / largest")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncol=min(6, len(labels)))
    return figure


def reliability(folder, method):
    """(place, horizon [s], nominal share) -> share held and windows of each trial and order; moving windows."""
    held = collections.defaultdict(list)
    for path in sorted((folder / "parts").glob("*.json")):
        part = json.loads(path.read_text())
        if part["method"] != method:
            continue
        for place, judged in part["places"].items():
            group = judged["evaluation"]["groups"].get("moving")
            for horizon in group["horizons"] if group else []:
                for level in horizon["model"]["coverage"]:
                    held[place, horizon["horizon_s"], level["nominal"]].append((level["observed"], group["windows"]))
    return held


def together(trials):
    """The share held of the windows of all trials together, and their number."""
    windows = sum(number for _, number in trials)
    return sum(share * number for share, number in trials) / windows, windows


def write_reliability(held, path):
    with open(path, "w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["place", "horizon_s", "nominal", "held", "deviation", "windows"])
        for (place, horizon_s, nominal), trials in held.items():
            share, windows = together(trials)
            spread = statistics.stdev(each for each, _ in trials) if len(trials) > 1 else 0.0
            rows.writerow([place, horizon_s, nominal, round(share, 4), round(spread, 4), windows])


TOLERANCE = {0.5: 0.05, 0.9: 0.03}  # what sila asks of itself


def draw_reliability(held, method):
    places, horizons = first_of(held, 0), sorted(set(key[1] for key in held))
    columns = min(4, len(places))
    rows = -(-len(places) // columns)
    figure, grid = plt.subplots(rows, columns, figsize=(3.1 * columns, 3.1 * rows), squeeze=False, sharex=True, sharey=True,
                                constrained_layout=True)
    shades = plt.get_cmap("viridis")
    for axis, place in zip(grid.flat, places):
        axis.plot([0, 1], [0, 1], color="#999999", lw=1, ls="--", zorder=0)
        for nominal, width in TOLERANCE.items():
            axis.plot([nominal, nominal], [nominal - width, nominal + width], color="#999999", lw=6, alpha=0.35, zorder=0)
        for h, horizon_s in enumerate(horizons):
            points = [(nominal, together(trials)[0]) for (where, when, nominal), trials in held.items()
                      if where == place and when == horizon_s]
            if points:
                axis.plot(*zip(*points), "o-", ms=3, lw=1.2, color=shades(0.9 * h / max(1, len(horizons) - 1)), label=f"{horizon_s:g} s")
        axis.set_title(place, loc="left", fontsize=10)
        axis.set_aspect("equal")
    for axis in list(grid.flat)[len(places):]:
        axis.set_visible(False)
    figure.supxlabel("nominal share of a region", fontsize=10)
    figure.supylabel("share of truths that it held", fontsize=10)
    handles = {label: handle for axis in grid.flat for handle, label in zip(*axis.get_legend_handles_labels())}
    figure.legend(handles.values(), handles.keys(), loc="upper center", bbox_to_anchor=(0.5, 0.0), ncol=len(horizons),
                  title=f"{method}, after")
    return figure


def first_of(keys, index):
    return list(dict.fromkeys(key[index] for key in keys))


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
    parser.add_argument("--method", metavar="NAME", help="whose nominal regions are drawn")
    options = parser.parse_args()
    curves, results = read(options.folder / "curves.csv"), read(options.folder / "results.csv")
    styles = style_of(first_seen(results, "method"))
    for place in first_seen(curves, "place"):
        figure = draw_curves(curves, place, styles)
        if figure:
            save(figure, options.folder / f"curves_{re.sub('[^A-Za-z0-9.-]+', '_', place)}.svg", options.png)
    table = curves_table(curves, first_seen(curves, "place"), styles)
    if table:
        (options.folder / "curves.md").write_text(table)
    save(draw_errors(results, styles), options.folder / "errors.svg", options.png)
    figure = draw_tradeoff(results, styles)
    if figure:
        save(figure, options.folder / "tradeoff.svg", options.png)
    method = options.method or next(iter(styles))
    if method not in styles:
        parser.error(f"--method: expected one of {', '.join(styles)}, found {method}")
    held = reliability(options.folder, method)
    write_reliability(held, options.folder / "reliability.csv")
    save(draw_reliability(held, method), options.folder / "reliability.svg", options.png)


if __name__ == "__main__":
    main()
