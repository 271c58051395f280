"""Gradient boosting (scikit-learn) on the observed positions, place and heading: a model for each coordinate at knots of
the horizon, between which the deviation from constant velocity is linear."""

import numpy as np
from sila.experiments.gaussian_path import GaussianPath, folds, heading_features
from sklearn.ensemble import HistGradientBoostingRegressor
from threadpoolctl import threadpool_limits

KNOTS, FOLDS = 4, 3


class Boosting(GaussianPath):
    parameters = {"rounds": 100, "learning_rate": 0.06, "leaves": 15}

    def learn(self, past_m, deviation_m, person):
        steps = deviation_m.shape[1]
        knots = np.round(np.linspace(0, steps, KNOTS + 1)).astype(int)[1:]
        inputs, targets = self.features(past_m), deviation_m[:, knots - 1].reshape(len(past_m), -1)
        left_out = np.zeros_like(targets)
        for learnt, other in folds(person, FOLDS):
            left_out[other] = self.predicted(self.fitted(inputs[learnt], targets[learnt]), inputs[other])
        models = self.fitted(inputs, targets)
        return lambda past: between(self.predicted(models, self.features(past)), knots, steps), between(
            left_out, knots, steps
        )

    def fitted(self, inputs, targets):
        settings = {"max_iter": self.rounds, "learning_rate": self.learning_rate, "max_leaf_nodes": self.leaves}
        with threadpool_limits(1):  # of so few samples threads wait for each other
            return [HistGradientBoostingRegressor(**settings).fit(inputs, target) for target in targets.T]

    def predicted(self, models, inputs):
        return np.column_stack([model.predict(inputs) for model in models])

    def features(self, past_m):
        along = past_m[:, -1] - past_m[:, 0]
        angle = np.arctan2(along[:, 1], along[:, 0])
        return np.column_stack([heading_features(past_m)[:, 1:], past_m[:, -1], np.cos(angle), np.sin(angle)])


def between(at_knots, knots, steps):
    """(n, 2 knots) to (n, steps, 2), linear from nothing at the start."""
    values = np.concatenate([np.zeros((len(at_knots), 1, 2)), at_knots.reshape(len(at_knots), -1, 2)], 1)
    right = np.searchsorted(knots, np.arange(1, steps + 1)) + 1
    edges = np.r_[0, knots]
    share = (np.arange(1, steps + 1) - edges[right - 1]) / (edges[right] - edges[right - 1])
    return values[:, right - 1] * (1 - share[:, None]) + values[:, right] * share[:, None]
