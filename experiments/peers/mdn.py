"""The LSTM mixture density network of kav-institute/mdn_trajectory_forecasting (Apache-2.0), commit d920b92, trained in
place. Nothing of it is part of this repository."""

import sys

import numpy as np
from sila.experiments import Forecast, Method
from sila.experiments.gaussian_path import training_windows
from sila.experiments.sampler import code_of

sys.path.insert(0, str(code_of("base_mdn", "base_lstm.py")))
sys.dont_write_bytecode = True
import torch
from base_lstm import LSTM_Trajectory_Forecast, NLL_MDN_loss
from utils import helper

GAUSSIANS, BATCH, HELD_BACK = 3, 256, 0.1
torch.set_num_threads(1)


class Mdn(Method):
    """`place`: the last position and the heading are inputs as well, so that it can learn the place."""

    parameters = {"hidden": 8, "place": False, "gradient_steps": 4000, "learning_rate": 1e-2}
    at_once = True
    upstream = "kav-institute/mdn_trajectory_forecasting", "d920b92", "base_mdn"

    @property
    def size(self):
        return sum(parameter.numel() for parameter in self.net.parameters())

    def fit(self, tracks):
        torch.manual_seed(self.seed), np.random.seed(self.seed)
        past, future, person = training_windows(self, tracks)
        self.middle, self.spread = past[:, -1].mean(0), past[:, -1].std(0) + 1e-6
        inputs, angle, origin = self.inputs(past)
        targets = helper.bat_mat_vec_mult(future - origin, helper.build_R(angle)).astype(np.float32)
        self.net = LSTM_Trajectory_Forecast(
            {
                "lstm_input_shape": inputs.shape[2],
                "lstm_hidden_size": self.hidden,
                "num_gaussians": GAUSSIANS,
                "output_factor": 6,
                "forecast_horizon": future.shape[1],
                "lstm_num_layers": 1,
            }
        )
        inputs, targets = torch.tensor(inputs), torch.tensor(targets)
        with torch.no_grad():  # the loss below is the peer's own, in closed form
            out = self.net(inputs[:64])
            assert abs(float(loss(out, targets[:64]) - NLL_MDN_loss(out, targets[:64], GAUSSIANS)[0])) < 1e-3
        held = np.random.permutation(person.max() + 1)[: round(HELD_BACK * (person.max() + 1))]
        held = np.isin(person, held)
        self.train(inputs[~held], targets[~held], inputs[held], targets[held])

    def train(self, inputs, targets, held_inputs, held_targets):
        """Adam with a falling rate; keeps the weights that are best on the people held back."""
        optimizer = torch.optim.Adam(self.net.parameters(), lr=self.learning_rate)
        best, kept, step, epoch = np.inf, None, 0, 0
        while step < self.gradient_steps:
            order = np.random.permutation(len(inputs))
            for first in range(0, len(order), BATCH)[: self.gradient_steps - step]:
                optimizer.param_groups[0]["lr"] = self.learning_rate * max(1e-4, 1 - step / self.gradient_steps)
                some = order[first : first + BATCH]
                optimizer.zero_grad()
                loss(self.net(inputs[some]), targets[some]).backward()
                optimizer.step()
                step += 1
            epoch += 1
            if len(held_inputs) and (epoch % 2 == 0 or step == self.gradient_steps):
                with torch.no_grad():
                    error = float(loss(self.net(held_inputs), held_targets))
                if error < best:
                    best, kept = error, {name: value.clone() for name, value in self.net.state_dict().items()}
        if kept:
            self.net.load_state_dict(kept)

    def inputs(self, past_m):
        """Their ego frame, and (n, p, c) in it."""
        state = np.random.get_state()
        np.random.seed(1)
        angle, origin = helper.estimate_ego_transform(past_m)
        np.random.set_state(state)
        seen = helper.world2ego(past_m, angle, origin, 1 / self.interval_s)
        if self.place:
            place = [(origin[:, 0] - self.middle) / self.spread, np.cos(angle)[:, None], np.sin(angle)[:, None]]
            seen = np.concatenate([seen, np.repeat(np.concatenate(place, 1)[:, None], seen.shape[1], 1)], 2)
        return seen.astype(np.float32), angle, origin

    def predict(self, windows):
        inputs, angle, origin = self.inputs(np.asarray(windows.past_m))
        with torch.no_grad():
            parts = np.split(self.net(torch.tensor(inputs)).double().numpy(), 6, -1)
        x, y, sx, sy = parts[0], parts[1], np.exp(parts[2]), np.exp(parts[3])
        r = np.clip(np.tanh(parts[4]), -0.999999, 0.999999)
        weights = np.exp(parts[5] - parts[5].max(-1, keepdims=True))  # over components, as in their loss
        weights = (weights / weights.sum(-1, keepdims=True)).transpose(0, 2, 1)
        back = helper.build_R_inv(angle)
        paths = np.einsum("nab,nktb->nkta", back, np.stack([x, y], -1).transpose(0, 2, 1, 3)) + origin[:, :, None]
        inner = np.stack([np.stack([sx * sx, r * sx * sy], -1), np.stack([r * sx * sy, sy * sy], -1)], -2)
        covariances = np.einsum("nab,nktbc,ndc->nktad", back, inner.transpose(0, 2, 1, 3, 4), back)
        return Forecast(weights, paths, np.ascontiguousarray(covariances))


def loss(out, target):
    """Mean -log density of the mixtures."""
    x, y, log_sx, log_sy, r, weight = out.split(GAUSSIANS, dim=-1)
    r = torch.tanh(r)
    rest = 1 - r * r + 1e-7
    dx, dy = (target[..., :1] - x) * torch.exp(-log_sx), (target[..., 1:] - y) * torch.exp(-log_sy)
    squared = (dx * dx - 2 * r * dx * dy + dy * dy) / rest
    log_density = (
        torch.log_softmax(weight, -1) - squared / 2 - log_sx - log_sy - torch.log(rest) / 2 - np.log(2 * np.pi)
    )
    return -torch.logsumexp(log_density, -1).mean()
