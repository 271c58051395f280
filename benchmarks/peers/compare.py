"""sila's sparse GPs against GPy's, and its dictionary learning against scikit-learn's: same data, same run, one thread,
seconds of the processor.

usage: compare.py PEER_CASES [--times N] [--out TABLE.md]
"""

import argparse
import json
import os
import platform
import subprocess
import tempfile
import time

for pool in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[pool] = "1"

import GPy  # noqa: E402  (after the threads were counted)
import numpy as np  # noqa: E402
import scipy  # noqa: E402
import sklearn  # noqa: E402
from sklearn.decomposition import MiniBatchDictionaryLearning  # noqa: E402

ITERATIONS = 50
START = {"variance": 0.64, "lengthscale": 2.0, "noise": 0.09}  # as gp_data.hpp has it


def gp_model(inputs, outputs, pseudo_inputs, variance, lengthscale, noise):
    kernel = GPy.kern.RBF(2, variance=variance, lengthscale=lengthscale, ARD=True)
    model = GPy.core.SparseGP(
        inputs,
        outputs - outputs.mean(axis=0),
        pseudo_inputs.copy(),
        kernel,
        GPy.likelihoods.Gaussian(variance=noise),
        inference_method=GPy.inference.latent_function_inference.FITC(),
    )
    return model


def read_gp(folder, number):
    names = ("inputs", "outputs", "pseudo_inputs")
    return [np.loadtxt(f"{folder}/gp_{name}_{number}.csv", delimiter=",", ndmin=2) for name in names]


def gpy_fits(case, times):
    """Seconds and value of fits with more and more iterations."""
    fits = []
    for iterations in range(2, ITERATIONS + 1, 2):
        seconds = []
        for _ in range(times):
            model = gp_model(*case, START["variance"], [START["lengthscale"]] * 2, START["noise"])
            start = time.process_time()
            model.optimize("lbfgsb", max_iters=iterations, messages=False)
            seconds.append(time.process_time() - start)
        fits.append((median(seconds), -float(model.log_likelihood())))
    return fits


def scored_by_gpy(case, found):
    z = np.array(found["pseudo_inputs"]).reshape(-1, 2)
    there = gp_model(*case[:2], z, found["signal_variance"], found["length_scales"], found["noise_variance"])
    return -float(there.log_likelihood())


def until(fits, goal):
    """Seconds of the shortest fit that reaches the goal."""
    return min(seconds for seconds, value in fits if value <= goal)


def compare_gp(case, found, times):
    """Of one data set: seconds of both to the value that both reach in all iterations, and what each reaches."""
    ours = [(median(fit["seconds"]), scored_by_gpy(case, fit)) for fit in found]
    theirs = gpy_fits(case, times)
    best = [min(value for _, value in fits) for fits in (ours, theirs)]
    return until(ours, max(best)), until(theirs, max(best)), *best


def fit_sklearn(folder, components, times):
    wanted = np.loadtxt(f"{folder}/dictionary.csv", delimiter=",")
    seconds = []
    for k in range(times):
        learner = MiniBatchDictionaryLearning(
            n_components=components, alpha=1.0, batch_size=20, fit_algorithm="cd", transform_algorithm="lasso_cd",
            positive_code=True, random_state=k, n_jobs=1,
        )
        start = time.process_time()
        codes = learner.fit(wanted).transform(wanted)
        seconds.append(time.process_time() - start)
    left = wanted - codes @ learner.components_
    return seconds, float((left**2).sum() / (wanted**2).sum())


def spread(seconds):
    ms = [1e3 * s for s in sorted(seconds)]
    return f"{ms[len(ms) // 2]:.1f} ({ms[0]:.1f} to {ms[-1]:.1f})"


def median(seconds):
    return sorted(seconds)[len(seconds) // 2]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases")
    parser.add_argument("--times", type=int, default=5)
    parser.add_argument("--out")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([options.cases, "write", folder], check=True)
        run = subprocess.run([options.cases, "solve", str(options.times)], check=True, capture_output=True, text=True)
        ours = json.loads(run.stdout)
        gps = [
            compare_gp(read_gp(folder, 1 + k), found, options.times) for k, found in enumerate(ours["gps"])
        ]
        dictionaries = ours["dictionaries"]
        peers = [fit_sklearn(folder, words["primitives"], options.times) for words in dictionaries]

    lines = [
        f"GPy {GPy.__version__}, scikit-learn {sklearn.__version__}, numpy {np.__version__}, scipy {scipy.__version__}, "
        f"Python {platform.python_version()}; one thread each; median (range) of {options.times} runs [ms of the processor].",
        "",
        "| what | sila | peer | ratio | sila reached | peer reached |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    ours_s, theirs_s, our_best, their_best = zip(*gps)
    ratios = sorted(theirs / ours for ours, theirs in zip(ours_s, theirs_s))
    lines.append(
        f"| sparse GP, 300 points, 20 pseudo-inputs, theta and pseudo-inputs by gradient, {len(gps)} data sets, against "
        f"GPy's FITC, until both have the negative log marginal likelihood (as GPy computes it) that both reach in {ITERATIONS} "
        f"iterations | {spread(ours_s)} | {spread(theirs_s)} | {median(ratios):.1f} ({ratios[0]:.1f} to {ratios[-1]:.1f}) | "
        f"{', '.join(f'{value:.1f}' for value in our_best)} | {', '.join(f'{value:.1f}' for value in their_best)} |"
    )
    for words, (seconds, error) in zip(dictionaries, peers):
        lines.append(
            f"| dictionary of {words['vectors']} tracks on {words['cells']} cells, {words['primitives']} {words['name']}, against "
            f"MiniBatchDictionaryLearning with as many; reached: share of the directions left over | "
            f"{spread(words['seconds'])} | {spread(seconds)} | {median(seconds) / median(words['seconds']):.1f} | "
            f"{words['error']:.3f} | {error:.3f} |"
        )
    table = "\n".join(lines) + "\n"
    print(table, end="")
    if options.out:
        with open(options.out, "w", encoding="utf-8") as file:
            file.write(table)


if __name__ == "__main__":
    main()
