"""Interacting multiple models (filterpy): constant velocity, constant acceleration, and a velocity that decays. Noises
and the scale of the covariances have the greatest likelihood on some training windows."""

from itertools import product

import numpy as np
from filterpy.kalman import IMMEstimator, KalmanFilter
from sila.experiments import Forecast, Method
from sila.experiments.gaussian_path import training_windows
from sila.experiments.measures import modes_of, stepwise_measures

CHOSEN_ON = 100  # windows
MEASUREMENT_M, ACCELERATION = (0.01, 0.05, 0.15), (0.1, 0.5)
SCALES = 2.0 ** np.arange(-2, 5)
STAYS = 0.95  # probability that a model stays in force for a step
DECAY_S = 1.5


class Imm(Method):
    at_once = True

    def fit(self, tracks):
        past, future, _ = training_windows(self, tracks)
        some = np.random.default_rng(0).permutation(len(past))[:CHOSEN_ON]
        best = np.inf
        for noises in product(MEASUREMENT_M, ACCELERATION):
            weights, paths, covariances = self.filtered(past[some], future.shape[1], *noises)
            for scale in SCALES:
                modes = modes_of(Forecast(weights, paths, scale * covariances))
                nll = stepwise_measures(modes, future[some])["nll"].mean()
                if nll < best:
                    best, self.noises, self.scale = nll, noises, scale

    def predict(self, windows):
        weights, paths, covariances = self.filtered(np.asarray(windows.past_m), windows.steps, *self.noises)
        return Forecast(weights, paths, self.scale * covariances)

    def filtered(self, past, steps, measurement_m, acceleration):
        moves = [axes(move) for move in motions(self.interval_s)]
        noise = [axes(q) for q in noises(self.interval_s, acceleration)]
        weights, states, spreads = [], [], []
        for track in past:
            bank = estimator(track, moves, noise, measurement_m, self.interval_s)
            for position in track[1:]:
                bank.predict()
                bank.update(position)
            weights.append(bank.mu)
            states.append([f.x.ravel() for f in bank.filters])
            spreads.append([f.P for f in bank.filters])
        states, spreads = np.array(states), np.array(spreads)
        paths, covariances = [], []
        for _ in range(steps):
            states = np.einsum("kab,nkb->nka", moves, states)
            spreads = np.einsum("kab,nkbc,kdc->nkad", moves, spreads, moves) + np.array(noise)
            paths.append(states[..., :2])
            covariances.append(spreads[..., :2, :2] + 1e-6 * np.eye(2))
        return np.array(weights), np.stack(paths, 2), np.ascontiguousarray(np.stack(covariances, 2))


def motions(dt):
    """Position, velocity, acceleration of one axis."""
    kept = np.exp(-dt / DECAY_S)
    return (
        np.array([[1, dt, 0], [0, 1, 0], [0, 0, 0]]),
        np.array([[1, dt, dt * dt / 2], [0, 1, dt], [0, 0, 1]]),
        np.array([[1, DECAY_S * (1 - kept), 0], [0, kept, 0], [0, 0, 0]]),
    )


def noises(dt, acceleration):
    move = np.array([dt * dt / 2, dt, 0.0])
    white = acceleration**2 * np.outer(move, move) + 1e-9 * np.eye(3)
    return white, white + np.diag([0, 0, acceleration**2 * dt]), white


def axes(of_one):
    return np.kron(of_one, np.eye(2))


def estimator(track, moves, noise, measurement_m, dt):
    filters = []
    for move, q in zip(moves, noise):
        one = KalmanFilter(dim_x=6, dim_z=2)
        one.x = np.concatenate([track[0], (track[1] - track[0]) / dt, [0, 0]])[:, None]
        one.F, one.Q, one.H = move, q, np.eye(2, 6)
        one.R, one.P = measurement_m**2 * np.eye(2), axes(np.diag([measurement_m**2, 1.0, 0.5]))
        filters.append(one)
    stays = STAYS * np.eye(3) + (1 - STAYS) / 2 * (1 - np.eye(3))
    return IMMEstimator(filters, np.full(3, 1 / 3), stays)
