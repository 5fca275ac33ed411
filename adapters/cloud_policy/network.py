"""A diffusion policy on a cloud or a picture: what is seen and the arm's state make a condition, under which chunks of actions are denoised.
After Ze et al. 2024 (DP3: perceptron over points and a maximum over them), Chi et al. 2023 (chunks of actions by diffusion),
Ho et al. 2020 (training), Song et al. 2021 (ten deterministic steps), Nichol and Dhariwal 2021 (the cosine schedule)."""
import math

import torch
from torch import nn

NOISES = 100  # levels of noise in training
STEPS = 10  # taken when it acts
FEATURE = 64


class Points(nn.Module):
    """[batch, points, 3] to [batch, FEATURE]: the same perceptron at each point, then the largest of each number."""

    def __init__(self, widths=(64, 64, 128)):
        super().__init__()
        layers, before = [], 3
        for width in widths:
            layers += [nn.Linear(before, width), nn.LayerNorm(width), nn.ReLU()]
            before = width
        self.each = nn.Sequential(*layers)
        self.out = nn.Sequential(nn.Linear(before, FEATURE), nn.LayerNorm(FEATURE))

    def forward(self, points):
        return self.out(self.each(points).amax(dim=1))


class Picture(nn.Module):
    """[batch, 3, 96, 96] from 0 to 1, to [batch, FEATURE]; the last layer keeps where things are: mean places of its channels."""

    def __init__(self):
        super().__init__()
        layers, before = [], 3
        for width, stride in ((32, 2), (64, 2), (64, 2), (64, 1)):
            layers += [nn.Conv2d(before, width, 3, stride, 1), nn.GroupNorm(8, width), nn.ReLU()]
            before = width
        self.layers = nn.Sequential(*layers)
        self.out = nn.Sequential(nn.Linear(2 * before, FEATURE), nn.LayerNorm(FEATURE))

    def forward(self, pictures):
        maps = self.layers(pictures - 0.5)
        weights = maps.flatten(2).softmax(dim=2).unflatten(2, maps.shape[2:])
        places = [torch.linspace(-1.0, 1.0, size) for size in maps.shape[2:]]
        down, across = weights.sum(dim=3) @ places[0], weights.sum(dim=2) @ places[1]
        return self.out(torch.cat([down, across], dim=1))


class Block(nn.Module):
    """A perceptron beside a straight way; the condition scales and shifts what goes through it."""

    def __init__(self, width, condition):
        super().__init__()
        self.norm, self.into, self.out = nn.LayerNorm(width), nn.Linear(width, width), nn.Linear(width, width)
        self.by = nn.Linear(condition, 2 * width)

    def forward(self, x, condition):
        scale, shift = self.by(condition).chunk(2, dim=-1)
        return x + self.out(nn.functional.mish(self.into(self.norm(x) * (1 + scale) + shift)))


class Policy(nn.Module):
    """Chunks of `horizon` actions of `numbers` each, on the scale of the state, all from -1 to 1."""

    def __init__(self, see, numbers, horizon, width=256, blocks=3):
        super().__init__()
        self.horizon, self.numbers = horizon, numbers
        self.eye = Points() if see == "cloud" else Picture()
        self.state = nn.Sequential(nn.Linear(numbers, FEATURE), nn.ReLU(), nn.Linear(FEATURE, FEATURE))
        condition = 3 * FEATURE
        self.into = nn.Linear(horizon * numbers, width)
        self.blocks = nn.ModuleList(Block(width, condition) for _ in range(blocks))
        self.out = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, horizon * numbers))
        # Share of the actions, not of the noise, in the variance at each level.
        level = (torch.arange(NOISES) + 1) / NOISES
        wave = torch.cos((level + 0.008) / 1.008 * math.pi / 2) ** 2 / math.cos(0.008 / 1.008 * math.pi / 2) ** 2
        self.register_buffer("share", wave.clamp(1e-4, 0.9999), persistent=False)

    def condition(self, seen, state):
        return torch.cat([self.eye(seen), self.state(state)], dim=1)

    def denoised(self, noisy, level, condition, state):
        """What the actions are, by the network, out of noisy ones [batch, horizon, numbers] at levels [batch]: how far from the state."""
        waves = level[:, None] * torch.exp(torch.arange(FEATURE // 2) * (-math.log(1e4) / (FEATURE // 2 - 1)))
        condition = torch.cat([condition, waves.sin(), waves.cos()], dim=1)
        x = self.into(noisy.flatten(1))
        for block in self.blocks:
            x = block(x, condition)
        return state[:, None] + self.out(x).unflatten(1, (self.horizon, self.numbers))

    def loss(self, seen, state, actions, draws, generator):
        """Mean square of what is left of the noise; each frame is seen once and made noisy `draws` times."""
        condition, state, actions = (part.repeat_interleave(draws, dim=0) for part in (self.condition(seen, state), state, actions))
        level = torch.randint(NOISES, (len(actions),), generator=generator)
        share = self.share[level][:, None, None]
        noise = torch.randn(actions.shape, generator=generator)
        noisy = share.sqrt() * actions + (1 - share).sqrt() * noise
        return (self.denoised(noisy, level.float(), condition, state) - actions).square().mean()

    @torch.no_grad()
    def act(self, seen, state, generator):
        """Chunks [batch, horizon, numbers], out of noise in STEPS steps."""
        condition = self.condition(seen, state)
        actions = torch.randn((len(state), self.horizon, self.numbers), generator=generator)
        levels = torch.linspace(NOISES - 1, 0, STEPS).round().long().tolist()
        for level, after in zip(levels, levels[1:] + [None]):
            clean = self.denoised(actions, torch.full((len(state),), float(level)), condition, state).clamp(-1.0, 1.0)
            if after is None:
                return clean
            noise = (actions - self.share[level].sqrt() * clean) / (1 - self.share[level]).sqrt()
            actions = self.share[after].sqrt() * clean + (1 - self.share[after]).sqrt() * noise
