"""Kalman filter of constant velocity with white-noise acceleration; the ratio of the two noises has the least ADE on the
training windows, their common scale the greatest likelihood."""

import numpy as np
from sila.experiments import Forecast, Method
from sila.experiments.gaussian_path import training_windows

RATIOS = 10.0 ** np.arange(-3, 6.1, 0.5)  # acceleration [m²/s³] over measurement [m²]


class Kalman(Method):
    at_once = True

    def fit(self, tracks):
        past, future, _ = training_windows(self, tracks)
        filters = [filtered(past.shape[1], future.shape[1], self.interval_s, ratio) for ratio in RATIOS]
        errors = [np.linalg.norm(np.einsum("to,noc->ntc", w, past) - future, axis=2).mean() for w, _ in filters]
        self.weights, variances = filters[int(np.argmin(errors))]
        squared = ((np.einsum("to,noc->ntc", self.weights, past) - future) ** 2).sum(2)
        self.variances = variances * (squared / variances).mean() / 2

    def predict(self, windows):
        paths = np.einsum("to,noc->ntc", self.weights, windows.past_m)[:, None]
        covariances = np.tile(self.variances[:, None, None] * np.eye(2), (len(paths), 1, 1, 1, 1))
        return Forecast(np.ones((len(paths), 1)), paths, covariances)


def filtered(observed, steps, dt, ratio):
    """The predicted positions as weights of the observed ones (steps, observed), and their variances."""
    move = np.array([[1, dt], [0, 1]])
    noise = ratio * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    covariance = np.diag([1.0, 4 * max(ratio, 1.0)])
    state = np.zeros((2, observed))
    state[0, 0] = 1
    for k in range(1, observed):
        state, covariance = move @ state, move @ covariance @ move.T + noise
        gain = covariance[:, 0] / (covariance[0, 0] + 1)
        innovation = -state[0]
        innovation[k] += 1
        state, covariance = state + np.outer(gain, innovation), covariance - np.outer(gain, covariance[0])
    weights, variances = np.zeros((steps, observed)), np.zeros(steps)
    for t in range(steps):
        state, covariance = move @ state, move @ covariance @ move.T + noise
        weights[t], variances[t] = state[0], covariance[0, 0]
    return weights, variances
