#!/usr/bin/env python3
"""Slopes over splats against automatic differentiation of gsplat's own torch reference.

    pip install torch typing_extensions && pip install --no-deps gsplat==1.5.3
    cargo run --release -p splat --example gradients > gradients.json
    python3 tests/peers/splat_gradients.py gradients.json

Projection and spherical harmonics are gsplat's (`gsplat/cuda/_torch_impl.py`, which needs no CUDA); blending is the formula of
Kerbl et al. 2023, over all splats and pixels at once, because gsplat's own needs a graphics card. Double precision.
"""

import importlib.util
import json
import pathlib
import sys

import torch

FAINTEST = 1 / 255
MOST = 0.99
SPENT = 1e-4


def reference():
    """gsplat's torch reference, without the rest of the package."""
    package = importlib.util.find_spec("gsplat")
    if package is None:
        sys.exit("gsplat is not installed: pip install --no-deps gsplat==1.5.3")
    path = pathlib.Path(package.submodule_search_locations[0]) / "cuda" / "_torch_impl.py"
    spec = importlib.util.spec_from_file_location("torch_reference", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def draw(gsplat, given, splats):
    """Channels and light that is left, one row a pixel."""
    width, height = given["size"]
    rotation = torch.tensor(given["rotation"], dtype=torch.float64)
    translation = torch.tensor(given["translation"], dtype=torch.float64)
    view = torch.eye(4, dtype=torch.float64)
    view[:3, :3], view[:3, 3] = rotation, translation
    (fx, fy), (cx, cy) = given["focal"], given["centre"]
    camera = torch.tensor([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], dtype=torch.float64)
    covariance, _ = gsplat._quat_scale_to_covar_preci(
        splats["turn"], splats["log_sigma"].exp(), compute_preci=False
    )
    _, centres, depths, conics, _ = gsplat._fully_fused_projection(
        splats["centre"], covariance, view[None], camera[None], width, height
    )
    eye = -rotation.T @ translation
    color = gsplat._spherical_harmonics(3, splats["centre"] - eye, splats["harmonics"]) + 0.5
    color = color.clamp(min=0)
    order = depths[0].argsort()
    centres, depths, conics = centres[0][order], depths[0][order], conics[0][order]
    opacity = torch.sigmoid(splats["logit"])[order]
    values = torch.cat([color[order], depths[:, None]], 1)
    # Pixel centres at whole numbers.
    rows, columns = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
    pixels = torch.stack([columns.reshape(-1), rows.reshape(-1)], 1).to(torch.float64)
    off = pixels[:, None] - centres[None]
    a, b, c = conics.unbind(1)
    exponent = -0.5 * (a * off[..., 0] ** 2 + c * off[..., 1] ** 2) - b * off[..., 0] * off[..., 1]
    alpha = (opacity * exponent.exp()).clamp(max=MOST)
    alpha = torch.where(alpha >= FAINTEST, alpha, torch.zeros_like(alpha))
    before = torch.cumprod(torch.cat([torch.ones_like(alpha[:, :1]), 1 - alpha], 1), 1)
    spent = before[:, :-1] < SPENT
    weights = torch.where(spent, torch.zeros_like(alpha), alpha * before[:, :-1])
    # Light that is spent is not taken from any more.
    below = torch.where(before < SPENT, before, torch.zeros_like(before)).amax(1)
    left = torch.where((before < SPENT).any(1), below, before[:, -1])
    return weights @ values, left


def main():
    gsplat = reference()
    given = json.loads(pathlib.Path(sys.argv[1]).read_text())
    shapes = {"centre": (-1, 3), "turn": (-1, 4), "log_sigma": (-1, 3), "logit": (-1,), "harmonics": (-1, 16, 3)}
    splats = {
        name: torch.tensor(given["splats"][name], dtype=torch.float64).reshape(shape).requires_grad_()
        for name, shape in shapes.items()
    }
    channels, left = draw(gsplat, given, splats)
    wanted = torch.tensor(given["picture"]["channels"], dtype=torch.float64).T
    print(f"picture: largest difference {(channels - wanted).abs().max().item():.2e}")
    slope = torch.tensor(given["slope"]["channels"], dtype=torch.float64).T
    loss = (channels * slope).sum() + (left * torch.tensor(given["slope"]["left"], dtype=torch.float64)).sum()
    loss.backward()
    worst = 0.0
    for name, values in splats.items():
        own = torch.tensor(given["gradient"][name], dtype=torch.float64).reshape(values.shape)
        off = ((own - values.grad).norm() / values.grad.norm()).item()
        worst = max(worst, off)
        print(f"{name}: relative difference {off:.2e}")
    if worst > 1e-4:
        sys.exit(f"the slopes differ by {worst:.2e}; at most 1e-4 was expected")


if __name__ == "__main__":
    main()
