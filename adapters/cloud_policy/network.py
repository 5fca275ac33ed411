"""A diffusion policy on a cloud or a picture: what is seen and the arm's state make a condition, under which chunks of actions are denoised.
After Ze et al. 2024 (DP3: perceptron over points and a maximum over them), Chi et al. 2023 (chunks of actions by diffusion),
Ho et al. 2020 (training), Song et al. 2021 (ten deterministic steps), Nichol and Dhariwal 2021 (the cosine schedule), Tancik et al. 2020
(waves of a place)."""
import math

import torch
from torch import nn

NOISES = 100  # levels of noise in training
STEPS = 10  # taken when it acts
FEATURE = 64
WAVES = 5  # of a point's place, from 1 m on each half as long as the one before


class Points(nn.Module):
    """[batch, points, 3] to [batch, FEATURE]: the same perceptron at each point, then the largest of each number. It is given waves of the
    place, too, the shortest 6 cm long, since a perceptron learns what changes within centimetres slowly from metres."""

    def __init__(self, widths=(64, 64, 128)):
        super().__init__()
        self.register_buffer("waves", 2 * math.pi * 2.0 ** torch.arange(WAVES), persistent=False)
        layers, before = [], 3 + 6 * WAVES
        for width in widths:
            layers += [nn.Linear(before, width), nn.LayerNorm(width), nn.ReLU()]
            before = width
        self.each = nn.Sequential(*layers)
        self.out = nn.Sequential(nn.Linear(before, FEATURE), nn.LayerNorm(FEATURE))

    def forward(self, points):
        angles = (points[..., None] * self.waves).flatten(2)
        return self.out(self.each(torch.cat([points, angles.sin(), angles.cos()], dim=2)).max(dim=1).values)


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
    """Chunks of `horizon` actions of `numbers` each, from -1 to 1 as the state is. What is denoised are `parts` numbers: how far a chunk leads
    away from the state along the principal directions of those that were learned from, each divided by its spread. So a chunk is as smooth as
    a demonstration, and its joints lead where its poses are; with noise in each number of a chunk they did not, by centimetres."""

    def __init__(self, see, numbers, horizon, parts, width=256, blocks=3):
        super().__init__()
        self.horizon, self.numbers, self.parts = horizon, numbers, parts
        self.eye = Points() if see == "cloud" else Picture()
        self.state = nn.Sequential(nn.Linear(numbers, FEATURE), nn.ReLU(), nn.Linear(FEATURE, FEATURE))
        condition = 3 * FEATURE
        self.into = nn.Linear(parts, width)
        self.blocks = nn.ModuleList(Block(width, condition) for _ in range(blocks))
        self.out = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, parts))
        self.register_buffer("directions", torch.zeros(parts, horizon * numbers))
        self.register_buffer("spread", torch.ones(parts))
        self.register_buffer("farthest", torch.ones(parts))
        # Share of the actions, not of the noise, in the variance at each level.
        level = (torch.arange(NOISES) + 1) / NOISES
        wave = torch.cos((level + 0.008) / 1.008 * math.pi / 2) ** 2 / math.cos(0.008 / 1.008 * math.pi / 2) ** 2
        self.register_buffer("share", wave.clamp(1e-4, 0.9999), persistent=False)

    @torch.no_grad()
    def find_directions(self, state, actions):
        """Finds the directions of chunks [n, horizon, numbers] from states [n, numbers], by the eigenvectors of their second moments."""
        away = (actions - state[:, None]).flatten(1).double()
        values, vectors = torch.linalg.eigh(away.T @ away / len(away))
        self.directions.copy_(vectors.T.flip(0)[:self.parts])
        self.spread.copy_(values.flip(0)[:self.parts].clamp(min=1e-8).sqrt())
        self.farthest.copy_(self.along(state, actions).abs().amax(dim=0))

    def along(self, state, actions):
        """[batch, parts] of chunks."""
        return (actions - state[:, None]).flatten(1) @ self.directions.T / self.spread

    def chunk(self, state, parts):
        """[batch, horizon, numbers] of parts."""
        return state[:, None] + (parts * self.spread @ self.directions).unflatten(1, (self.horizon, self.numbers))

    def condition(self, seen, state):
        return torch.cat([self.eye(seen), self.state(state)], dim=1)

    def denoised(self, noisy, level, condition):
        """What the parts [batch, parts] are, by the network, out of noisy ones at levels [batch]."""
        waves = level[:, None] * torch.exp(torch.arange(FEATURE // 2) * (-math.log(1e4) / (FEATURE // 2 - 1)))
        condition = torch.cat([condition, waves.sin(), waves.cos()], dim=1)
        x = self.into(noisy)
        for block in self.blocks:
            x = block(x, condition)
        return self.out(x)

    def loss(self, seen, state, actions, draws, generator):
        """Mean square of what is left of the noise, each part weighted by its spread; each frame is seen once and made noisy `draws` times."""
        condition = self.condition(seen, state).repeat_interleave(draws, dim=0)
        parts = self.along(state, actions).repeat_interleave(draws, dim=0)
        level = torch.randint(NOISES, (len(parts),), generator=generator)
        share = self.share[level][:, None]
        noisy = share.sqrt() * parts + (1 - share).sqrt() * torch.randn(parts.shape, generator=generator)
        left = (self.denoised(noisy, level.float(), condition) - parts).square()
        return (left @ self.spread).mean() / self.spread.sum()

    @torch.no_grad()
    def act(self, seen, state, generator):
        """Chunks [batch, horizon, numbers], out of noise in STEPS steps."""
        condition = self.condition(seen, state)
        parts = torch.randn((len(state), self.parts), generator=generator)
        levels = torch.linspace(NOISES - 1, 0, STEPS).round().long().tolist()
        for level, after in zip(levels, levels[1:] + [None]):
            clean = self.denoised(parts, torch.full((len(state),), float(level)), condition).clamp(-self.farthest, self.farthest)
            if after is None:
                return self.chunk(state, clean).clamp(-1.0, 1.0)
            noise = (parts - self.share[level].sqrt() * clean) / (1 - self.share[level]).sqrt()
            parts = self.share[after].sqrt() * clean + (1 - self.share[after]).sqrt() * noise
