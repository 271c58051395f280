"""Social-Implicit (abduallahmohamed/Social-Implicit, MIT, commit 02d6a14) with its published weights: those that were
trained without the scene, by its file of the ETH/UCY scenes; elsewhere those without univ. With `gradient_steps`
these weights are trained further on the tracks of the place."""

import json
import sys
from pathlib import Path

import numpy as np
from sila._config import merged
from sila.experiments.sampler import DRAWN, SEEN, STEP_S, Sampler, code_of, together

FOLDER = code_of("social_implicit", "CFG.py")
import torch

torch.set_num_threads(1)
WEIGHTS = {"eth": "eth", "hotel": "hotel", "zara01": "zara1", "zara02": "zara2", "zara1": "zara1", "zara2": "zara2"}
TERM_WEIGHT = 1e-4  # theirs, of all terms of the loss but the first
HELD_BACK = 0.1


def module(name):
    """Names such as `model` are common: theirs are imported and forgotten again."""
    sys.path.insert(0, str(FOLDER))
    sys.dont_write_bytecode = True
    try:
        return __import__(name)
    finally:
        sys.path.remove(str(FOLDER))
        sys.modules.pop(name, None)


class SocialImplicit(Sampler):
    parameters = {"samples": 20, "gradient_steps": 0, "learning_rate": 1e-3}
    upstream = "abduallahmohamed/Social-Implicit", "02d6a14", "social_implicit"

    def __init__(self, config="{}", **settings):
        super().__init__(config, **settings)
        weights = WEIGHTS.get(self.scene, "univ")
        values = module("CFG").CFG
        noise = values["noise_weight_eth" if weights == "eth" else "noise_weight"]
        cuda, torch.Tensor.cuda = torch.Tensor.cuda, lambda tensor: tensor  # theirs asks for one; here is none
        try:
            self.net = module("model").SocialImplicit(bins=values["bins"], noise_weight=noise)
        finally:
            torch.Tensor.cuda = cuda
        path = Path(FOLDER) / "checkpoint" / f"social-implicit-{weights}" / "val_best.pth"
        self.net.load_state_dict(torch.load(path, map_location="cpu", weights_only=True))
        self.net = self.net.double().eval()
        torch.manual_seed(self.seed)

    @property
    def size(self):
        return sum(parameter.numel() for parameter in self.net.parameters())

    def fit(self, tracks):
        """As many whole epochs as have the gradient steps; keeps the weights that are best on the moments held back."""
        moments = self.moments(tracks) if self.gradient_steps > 0 else []
        if len(moments) < 2:
            return
        random = np.random.default_rng(self.seed)
        held, batches = max(1, round(HELD_BACK * len(moments))), max(1, len(moments) // 16)
        epochs = -(-self.gradient_steps // batches)
        moments = [moments[i] for i in np.roll(np.arange(len(moments)), random.integers(len(moments)))]  # a block of time
        optimizer = torch.optim.Adam(self.net.parameters(), lr=self.learning_rate)
        best, kept = np.inf, None
        for epoch in range(epochs + 1):  # scored before each epoch, and after the last one
            with torch.no_grad():
                error = np.mean([float(self.loss(*moment)) for moment in moments[:held]])
            if error < best:
                best, kept = error, {name: value.clone() for name, value in self.net.state_dict().items()}
            if epoch == epochs:
                break
            for batch in np.array_split(random.permutation(np.arange(held, len(moments))), batches):
                optimizer.zero_grad()
                torch.stack([self.loss(*moments[i]) for i in batch]).mean().backward()
                optimizer.step()
        self.net.load_state_dict(kept)

    def moments(self, tracks):
        """(past, future) of all people of one moment, as they are predicted, in the order of time."""
        interval_s = json.loads(self.config)["sampling"]["interval_s"]
        longer = {"predict": {"observe_s": (SEEN - 1) * STEP_S + interval_s}}
        windows = tracks.windows(merged(self.config, longer), STEP_S)
        each = round(STEP_S / windows.interval_s)
        past = np.asarray(windows.past_m)[:, ::-each][:, :SEEN][:, ::-1]
        future = np.asarray(windows.future_m)[:, each - 1 :: each][:, :DRAWN]
        frames = np.round(np.asarray(windows.t0_s) / STEP_S).astype(int)
        return [(past[group], future[group]) for group in together(tracks, windows.track_ids, frames)]

    def loss(self, past_m, future_m):
        """Their loss: the L1 error of the nearest of 20 samples, and terms that keep its distances and angles between
        steps, and the others at a distance."""
        steps = self.steps(past_m, 20).permute(0, 2, 3, 1)  # (k, 12, n, 2)
        true = torch.tensor(np.diff(future_m, axis=1, prepend=past_m[:, -1:]).transpose(1, 0, 2).copy())
        order = (steps - true).abs().sum((1, 2, 3)).argsort()
        nearest, second, farthest = steps[order[0]], steps[order[1]], steps[order[-1]]
        found, wanted = nearest.reshape(-1, 2), true.reshape(-1, 2)
        apart = (nearest - second).abs().mean() - (nearest - farthest).abs().mean()
        distances = (between(found) - between(wanted)).abs().mean()
        angles = (angles_between(found) - angles_between(wanted)).abs().mean()
        return (nearest - true).abs().mean() + TERM_WEIGHT * (apart + distances + angles)

    def steps(self, past_m, samples):
        """(k, 2, 12, n): displacements of n people."""
        moved = np.diff(past_m, axis=1, prepend=past_m[:, :1])  # (n, 8, 2), the first 0, as in theirs
        return self.net(torch.tensor(moved).permute(2, 1, 0)[None].double().contiguous(), None, KSTEPS=samples)

    def sample(self, past_m, samples=None):
        with torch.no_grad():
            steps = self.steps(past_m, samples or self.samples).numpy()
        return past_m[None, :, -1:] + np.cumsum(steps.transpose(0, 3, 2, 1), axis=2)


def between(points):
    return torch.cdist(points[None], points[None])


def angles_between(points):
    unit = points / points.norm(dim=1).clamp(min=1e-8)[:, None]
    return torch.acos((unit @ unit.T).clamp(-1 + 1e-8, 1 - 1e-8))
