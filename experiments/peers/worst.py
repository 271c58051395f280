"""Draws the windows of a place in which sila loses most to another method, in nats a step, and prints for both methods
how long their paths are:

python experiments/peers/worst.py FILE SCENE METHOD OUT.png [--data-dir DIR] [--split time]
"""

import argparse
import json

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from sila.experiments.experiment import Overrides
from sila.experiments.measures import mixture_density, modes_of, stepwise_measures
from sila.experiments.neighbours import inputs_of
from sila.experiments.plots import COLOURS
from sila.experiments.protocol import Run, protocol_of
from sila.experiments.read import read_experiment
from sila.experiments.runner import method_and_batches

COUNT, LEVELS = 10, (0.9, 0.5)


def windows_and_modes(experiment, run):
    """The windows held back, and what the method of the run predicts for them."""
    protocol = protocol_of(experiment, run)
    method, batches = method_and_batches(experiment, run, protocol)
    for tracks in batches:
        method.fit(tracks) if method.at_once else method.partial_fit(tracks)
    site = protocol.test_sites[0]
    windows = site.test.windows(method.config, json.loads(method.config)["evaluate"]["stride_s"], site.present)
    return windows, modes_of(method.predict(*inputs_of(method, windows, site.present)))


def length_ratio(modes, truth_m):
    """Length of the paths, weighted, over that of the true ones."""
    weights, paths, _ = modes
    lengths_m = [np.linalg.norm(np.diff(points, axis=-2), axis=-1).sum(-1) for points in (paths, truth_m)]
    return (weights.mean(2) * lengths_m[0]).sum() / lengths_m[1].sum()


def draw(axis, past_m, truth_m, of_methods):
    """Paths of one window, and where the density at the last step is highest. of_methods: {name: modes of the window}."""
    axis.plot(*past_m.T, color="0.6", label="observed")
    axis.plot(*truth_m.T, color="black", label="true")
    for (name, (weights, paths, covariances)), colour in zip(of_methods.items(), COLOURS):
        mean = np.einsum("kt,ktc->tc", weights / weights.sum(0), paths)
        axis.plot(*mean.T, color=colour, label=name)
        reach = 4 * np.sqrt(np.quantile(covariances[weights[:, -1] > 0.05, -1], 0.9))
        x, y = (np.linspace(middle - reach, middle + reach, 121) for middle in mean[-1])
        grid = np.stack(np.meshgrid(x, y), -1).reshape(1, -1, 1, 2)
        density = mixture_density((weights[None, :, -1:], paths[None, :, -1:], covariances[None, :, -1:]), grid)[0, :, 0]
        falling = np.sort(density)[::-1]
        mass = np.cumsum(falling) * (x[1] - x[0]) * (y[1] - y[0])
        edges = {falling[min(np.searchsorted(mass, level), len(mass) - 1)] for level in LEVELS}
        axis.contour(x, y, density.reshape(121, 121), sorted(edges), colors=colour, linewidths=0.8)
    axis.set_aspect("equal", adjustable="datalim")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("file", "scene", "method", "out"):
        parser.add_argument(name)
    parser.add_argument("--data-dir")
    parser.add_argument("--split", choices=("time", "track"), default="time")
    given = parser.parse_args()
    experiment = read_experiment(given.file, Overrides(data_dir=given.data_dir))
    scene = [scene.name for scene in experiment.scenes].index(given.scene)
    names = [method.name for method in experiment.methods]
    predicted = {}
    for name in (experiment.reference, given.method):
        run = Run(1, 0, given.split, given.scene, name, scene, names.index(name))
        windows, predicted[name] = windows_and_modes(experiment, run)
    past_m, truth_m = np.asarray(windows.past_m), np.asarray(windows.future_m)
    for name, modes in predicted.items():
        print(f"{name}: paths {length_ratio(modes, truth_m):.2f} times as long as the true ones")
    losses = {name: stepwise_measures(modes, truth_m)["nll"] for name, modes in predicted.items()}
    more = losses[experiment.reference] - losses[given.method]
    figure, axes = plt.subplots(2, COUNT // 2, figsize=(18, 8))
    for n, axis in zip(np.argsort(-more), axes.flat):
        draw(axis, past_m[n], truth_m[n], {name: [part[n] for part in modes] for name, modes in predicted.items()})
        axis.set_title(
            f"{windows.track_ids[n]}, {windows.t0_s[n]:.1f} s: " + " / ".join(f"{of[n]:.2f}" for of in losses.values()),
            fontsize=9,
        )
    axes.flat[0].legend(fontsize=8)
    figure.suptitle(f"{given.scene}: nats a step, {' / '.join(losses)}; outlines: 50 and 90 % at the last step")
    figure.tight_layout()
    figure.savefig(given.out, dpi=80)


main()
