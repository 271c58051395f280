"""Gaussian processes with inducing points (GPyTorch), learnt in batch on past positions, place and heading: one a
coordinate and knot of the horizon; between knots mean and deviation are linear."""

import gpytorch
import numpy as np
import torch
from sila.experiments import Forecast, Method
from sila.experiments.gaussian_path import between_knots, heading_features, to_heading, training_windows
from sila.experiments.method import constant_velocity

torch.set_num_threads(1)
KNOTS, BATCH = 4, 256


class Gps(gpytorch.models.ApproximateGP):
    def __init__(self, inducing, outputs):
        shape = torch.Size([outputs])
        posterior = gpytorch.variational.CholeskyVariationalDistribution(inducing.shape[-2], batch_shape=shape)
        strategy = gpytorch.variational.VariationalStrategy(self, inducing, posterior)
        super().__init__(gpytorch.variational.IndependentMultitaskVariationalStrategy(strategy, num_tasks=outputs))
        self.mean_module = gpytorch.means.ConstantMean(batch_shape=shape)
        kernel = gpytorch.kernels.RBFKernel(ard_num_dims=inducing.shape[-1], batch_shape=shape)
        self.covar_module = gpytorch.kernels.ScaleKernel(kernel, batch_shape=shape)

    def forward(self, x):
        return gpytorch.distributions.MultivariateNormal(self.mean_module(x), self.covar_module(x))


class GaussianProcess(Method):
    parameters = {"inducing": 80, "gradient_steps": 800, "learning_rate": 0.02}
    at_once = True

    @property
    def size(self):
        return sum(parameter.numel() for parameter in self.model.parameters())

    def fit(self, tracks):
        torch.manual_seed(self.seed)
        past, future, _ = training_windows(self, tracks)
        steps = future.shape[1]
        self.knots = np.unique(np.r_[1, np.round(np.linspace(0, steps, KNOTS + 1))[1:]].astype(int))
        straight = constant_velocity(past, steps, self.interval_s)
        deviation = np.einsum("nab,ntb->nta", to_heading(past), future - straight)[:, self.knots - 1]
        raw = features(past)
        self.middle, self.spread = raw.mean(0), raw.std(0) + 1e-6
        inputs = torch.tensor(self.scaled(past), dtype=torch.float32)
        targets = deviation.reshape(len(past), -1)
        self.unit = targets.std(0) + 1e-6
        targets = torch.tensor(targets / self.unit, dtype=torch.float32)
        first = inputs[torch.randperm(len(inputs))[: self.inducing]]
        self.model = Gps(first.repeat(targets.shape[1], 1, 1), targets.shape[1])
        self.likelihood = gpytorch.likelihoods.MultitaskGaussianLikelihood(num_tasks=targets.shape[1], rank=0)
        self.train(inputs, targets)

    def train(self, inputs, targets):
        self.model.train(), self.likelihood.train()
        optimizer = torch.optim.Adam([*self.model.parameters(), *self.likelihood.parameters()], lr=self.learning_rate)
        bound = gpytorch.mlls.PredictiveLogLikelihood(self.likelihood, self.model, num_data=len(inputs))
        for step in range(self.gradient_steps):
            some = torch.randint(len(inputs), (BATCH,))
            optimizer.param_groups[0]["lr"] = self.learning_rate * max(0.01, 1 - step / self.gradient_steps)
            optimizer.zero_grad()
            (-bound(self.model(inputs[some]), targets[some])).backward()
            optimizer.step()
        self.model.eval(), self.likelihood.eval()

    def predict(self, windows):
        past, steps = np.asarray(windows.past_m), windows.steps
        with torch.no_grad(), gpytorch.settings.fast_pred_var():
            inputs = torch.tensor(self.scaled(past), dtype=torch.float32)
            parts = [self.likelihood(self.model(part)) for part in inputs.split(1024)]
            mean = np.concatenate([part.mean.double().numpy() for part in parts]) * self.unit
            deviation = np.concatenate([part.variance.double().sqrt().numpy() for part in parts]) * self.unit
        mean, deviation = (
            between_knots(values.reshape(len(past), -1, 2), self.knots, steps) for values in (mean, deviation)
        )
        turn = to_heading(past)
        paths = constant_velocity(past, steps, windows.interval_s) + np.einsum("nba,ntb->nta", turn, mean)
        covariances = np.einsum("nba,ntb,nbd->ntad", turn, deviation**2, turn)
        return Forecast(np.ones((len(past), 1)), paths[:, None], np.ascontiguousarray(covariances[:, None]))

    def scaled(self, past):
        return (features(past) - self.middle) / self.spread


def features(past_m):
    """A quarter of the past positions in the heading frame, the place, the heading."""
    seen = heading_features(past_m[:, :: -max(1, past_m.shape[1] // 4)][:, ::-1])[:, 1:]
    return np.column_stack([seen, past_m[:, -1], to_heading(past_m)[:, 0]])
