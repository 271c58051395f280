"""Gradient boosting (scikit-learn) on the observed positions, place and heading: a model for each coordinate at knots of
the horizon, between which the deviation from constant velocity is linear."""

import numpy as np
from sila.experiments.gaussian_path import GaussianPath, between_knots, folds, heading_features, to_heading
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

        def between(at_knots):  # linear from nothing at the start
            from_start = np.pad(at_knots.reshape(len(at_knots), -1, 2), ((0, 0), (1, 0), (0, 0)))
            return between_knots(from_start, np.r_[0, knots], steps)

        return lambda past: between(self.predicted(models, self.features(past))), between(left_out)

    def fitted(self, inputs, targets):
        settings = {"max_iter": self.rounds, "learning_rate": self.learning_rate, "max_leaf_nodes": self.leaves}
        with threadpool_limits(1):  # of so few samples threads wait for each other
            return [HistGradientBoostingRegressor(**settings).fit(inputs, target) for target in targets.T]

    def predicted(self, models, inputs):
        return np.column_stack([model.predict(inputs) for model in models])

    def features(self, past_m):
        return np.column_stack([heading_features(past_m)[:, 1:], past_m[:, -1], to_heading(past_m)[:, 0]])
