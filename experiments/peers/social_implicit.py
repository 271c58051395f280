"""Social-Implicit (abduallahmohamed/Social-Implicit, MIT, commit 02d6a14) with its published weights: those that were
trained without the scene, by its file of the ETH/UCY scenes; elsewhere those without univ."""

import sys
from pathlib import Path

import numpy as np
from sila.experiments.sampler import Sampler, code_of

FOLDER = code_of("social_implicit", "CFG.py")
import torch

torch.set_num_threads(1)
WEIGHTS = {"eth": "eth", "hotel": "hotel", "zara01": "zara1", "zara02": "zara2", "zara1": "zara1", "zara2": "zara2"}


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
    parameters = {"samples": 20}
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
        self.net.load_state_dict(torch.load(path, map_location="cpu"))
        self.net = self.net.double().eval()
        torch.manual_seed(self.seed)

    @property
    def size(self):
        return sum(parameter.numel() for parameter in self.net.parameters())

    def sample(self, past_m, samples=None):
        moved = np.diff(past_m, axis=1, prepend=past_m[:, :1])  # (n, 8, 2), the first 0, as in theirs
        with torch.no_grad():
            seen = torch.tensor(moved).permute(2, 1, 0)[None].double().contiguous()  # (1, 2, 8, n)
            steps = self.net(seen, None, KSTEPS=samples or self.samples).numpy()  # (k, 2, 12, n)
        return past_m[None, :, -1:] + np.cumsum(steps.transpose(0, 3, 2, 1), axis=2)
