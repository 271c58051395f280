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


def read_gp(folder):
    names = ("inputs", "outputs", "pseudo_inputs")
    return [np.loadtxt(f"{folder}/gp_{name}.csv", delimiter=",", ndmin=2) for name in names]


def gpy_until(case, goal, times):
    """Seconds of a fit that stops at the first number of iterations that reaches `goal`, and the value there."""
    for iterations in (*range(2, ITERATIONS, 2), ITERATIONS):
        seconds = []
        for _ in range(times):
            model = gp_model(*case, START["variance"], [START["lengthscale"]] * 2, START["noise"])
            start = time.process_time()
            model.optimize("lbfgsb", max_iters=iterations, messages=False)
            seconds.append(time.process_time() - start)
        value = -float(model.log_likelihood())
        if value <= goal:
            break
    return seconds, value


def judged_by_gpy(case, found):
    z = np.array(found["pseudo_inputs"]).reshape(-1, 2)
    there = gp_model(*case[:2], z, found["signal_variance"], found["length_scales"], found["noise_variance"])
    return -float(there.log_likelihood())


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
        case = read_gp(folder)
        sila_value = judged_by_gpy(case, ours["gp"])
        gpy_seconds, gpy_value = gpy_until(case, sila_value, options.times)
        whole_seconds, whole_value = gpy_until(case, -np.inf, options.times)
        dictionaries = [ours["dictionary of 29"], ours["dictionary"]]
        peers = [fit_sklearn(folder, words["primitives"], options.times) for words in dictionaries]

    lines = [
        f"GPy {GPy.__version__}, scikit-learn {sklearn.__version__}, numpy {np.__version__}, scipy {scipy.__version__}, "
        f"Python {platform.python_version()}; one thread each; median (range) of {options.times} runs [ms of the processor].",
        "",
        "| what | sila | peer | ratio | sila reached | peer reached |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    gp = ours["gp"]["seconds"]
    for how, seconds, value in (
        ("until it reaches sila's value", gpy_seconds, gpy_value),
        (f"all {ITERATIONS} iterations", whole_seconds, whole_value),
    ):
        lines.append(
            f"| sparse GP, 300 points, 20 pseudo-inputs, theta and pseudo-inputs by gradient, against GPy's FITC {how}; "
            f"reached: negative log evidence as GPy computes it | {spread(gp)} | {spread(seconds)} | "
            f"{median(seconds) / median(gp):.1f} | {sila_value:.2f} | {value:.2f} |"
        )
    for words, (seconds, error) in zip(dictionaries, peers):
        lines.append(
            f"| dictionary of {words['vectors']} tracks on {words['cells']} cells, {words['primitives']} primitives, against "
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
