#!/usr/bin/env python3
"""Draws a track file (CSV with the columns track_id, t, x, y) over its scene file to a PNG picture.

    python3 tools/draw_tracks.py tracks.csv tracks.scene.json picture.png

A developer's tool for the documentation; it needs matplotlib and nothing else does.
"""
import argparse
import collections
import csv
import gzip
import json

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import LineCollection
from matplotlib.patches import Polygon

RADIUS_M = 18.0  # of the drawn area round the origin of the scene


def read_tracks(path):
    opener = gzip.open if path.endswith(".gz") else open
    tracks = collections.OrderedDict()
    with opener(path, "rt", newline="") as file:
        for row in csv.DictReader(file):
            tracks.setdefault(row["track_id"], []).append(tuple(float(row[key]) for key in ("t", "x", "y")))
    return tracks


def coloured_segments(track, longest_gap_s=0.5):
    """Pieces of a path over four intervals between samples, with their speed; gaps stay empty."""
    segments, values = [], []
    for (t0, x0, y0), (t1, x1, y1) in zip(track, track[4:]):
        if t1 - t0 > longest_gap_s:
            continue
        segments.append([(x0, y0), (x1, y1)])
        values.append(((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5 / (t1 - t0))
    return segments, values


def draw_scene(axes, scene):
    layers = (("buildings", "#c9c3b8"), ("sidewalks", "#e9e6df"), ("crosswalks", "#ffffff"))
    for key, colour in layers:
        for points in scene.get(key, []):
            axes.add_patch(Polygon(points, closed=True, facecolor=colour, edgecolor="#8d877b", linewidth=0.6))
    for corner in scene.get("corners", [scene]):
        (x, y), primary = corner["origin"], corner["origin"] == scene["origin"]
        for axis in ("axis_1", "axis_2"):
            dx, dy = corner[axis]
            axes.annotate("", (x + 3 * dx, y + 3 * dy), (x, y),
                          arrowprops={"arrowstyle": "->", "color": "#b03030" if primary else "#888888"})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tracks")
    parser.add_argument("scene")
    parser.add_argument("picture")
    options = parser.parse_args()

    with open(options.scene, encoding="utf-8") as file:
        scene = json.load(file)
    figure, axes = plt.subplots(figsize=(8, 7), dpi=100)
    axes.set_facecolor("#b8babd")
    draw_scene(axes, scene)
    segments, values = [], []
    for track in read_tracks(options.tracks).values():
        more_segments, more_values = coloured_segments(track)
        segments += more_segments
        values += more_values
    lines = LineCollection(segments, array=values, cmap="viridis", linewidths=0.7, alpha=0.8)
    lines.set_clim(0.0, 2.0)
    axes.add_collection(lines)
    figure.colorbar(lines, label="speed [m/s]")
    x, y = scene["origin"]
    axes.set_xlim(x - RADIUS_M, x + RADIUS_M)
    axes.set_ylim(y - RADIUS_M, y + RADIUS_M)
    if scene.get("y_axis") == "down":
        axes.invert_yaxis()
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    figure.tight_layout()
    figure.savefig(options.picture)


if __name__ == "__main__":
    main()
