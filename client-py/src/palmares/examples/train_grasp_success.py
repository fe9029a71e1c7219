"""Learn to predict which grasps are kept, from the tries of `palmares grasps`; test it on unseen objects.

    pip install 'palmares[grasps]' torch
    palmares grasps softhand --all --out grasps.h5
    python -m palmares.examples.train_grasp_success grasps.h5 --policy success.pt

The network of Qi et al. (2017), PointNet, in small: points of the object's surface, in the frame of the hand,
each through the same layers, then the largest value of every feature. One object of five is for the test. The
area under the curve (AUC) is the probability that a kept grasp gets a larger number than another one: 0.5 is
chance.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palmares.outputs import output_file

SEEN, BATCH, LEARNING_RATE = 128, 256, 1e-3
"""Points of the surface in an input, inputs of a step, rate of Adam"""


def network() -> Any:
    """Return the network: points in the hand's frame (n, points, 9) to one number each (n,)."""
    import torch
    from torch import nn

    class Success(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.point = nn.Sequential(
                nn.Linear(9, 64), nn.ReLU(), nn.Linear(64, 128), nn.ReLU(), nn.Linear(128, 256)
            )
            self.whole = nn.Sequential(nn.Linear(256, 128), nn.ReLU(), nn.Dropout(0.2), nn.Linear(128, 1))

        def forward(self, points: torch.Tensor) -> torch.Tensor:
            return self.whole(self.point(points).amax(dim=1)).squeeze(1)

    return Success()


def inputs(clouds: Any, hand: Any, up: Any, generator: Any) -> Any:
    """Return points, normals and the vertical in the frames of the hands, (n, SEEN, 9), in units of 0.1 m."""
    import torch

    chosen = torch.randint(clouds.shape[1], (len(clouds), SEEN), generator=generator)
    rows = torch.arange(len(clouds))[:, None]
    first, second = hand[:, 3:6], hand[:, 6:9]
    rotation = torch.stack([first, second, torch.linalg.cross(first, second)], dim=2)
    picked = clouds[rows, chosen]
    points = (picked[..., :3] - hand[:, None, :3]) @ rotation / 0.1
    upward = (up[:, None] @ rotation).expand(-1, SEEN, -1)
    return torch.cat([points, picked[..., 3:] @ rotation, upward], dim=2)


def auc(score: NDArray[Any], kept: NDArray[Any]) -> float:
    """Return the probability that a kept grasp has a larger score than another one; NaN without both."""
    order = np.argsort(score, kind="stable")
    ranks = np.empty(len(score))
    ranks[order] = np.arange(1, len(score) + 1)
    good = int(kept.sum())
    bad = len(kept) - good
    return (
        float((ranks[kept > 0].sum() - good * (good + 1) / 2) / (good * bad))
        if good and bad
        else float("nan")
    )


def train(args: argparse.Namespace) -> dict[str, float]:
    """Train and test; return the AUC on the objects of the training and on the others.

    Raises:
        ValueError: There are fewer than two objects, or the files are of several hands.

    """
    import torch

    from palmares.grasps import examples

    torch.manual_seed(args.seed)
    torch.set_num_threads(args.threads)
    generator = torch.Generator().manual_seed(args.seed)
    data = examples(args.files)
    if len(data.objects) < 2:
        raise ValueError(f"files: found one object, {data.objects[0]}; wanted at least two, one for the test")
    names = np.random.default_rng(args.seed).permutation(len(data.objects))
    unseen = np.isin(data.object_row, names[: max(1, len(names) // 5)])
    # A try near a success is drawn because of it: only those that were drawn freely are for the test.
    test, known = unseen & data.drawn_freely, ~unseen & data.drawn_freely
    clouds, row = torch.from_numpy(data.points), torch.from_numpy(data.object_row)
    hand, up, kept = (torch.from_numpy(it) for it in (data.hand, data.up, data.kept))
    net = network()
    optimiser = torch.optim.Adam(net.parameters(), LEARNING_RATE)
    rows = torch.from_numpy(np.flatnonzero(~unseen))
    weight = torch.tensor(float((1 - kept[rows]).sum() / kept[rows].sum().clamp(min=1.0)))
    print(
        f"{len(data)} tries of {len(data.objects)} objects, {float(kept.mean()):.1%} kept; "
        f"test: {test.sum()} of {max(1, len(names) // 5)} unseen objects"
    )

    def score(marks: NDArray[np.bool_]) -> NDArray[Any]:
        net.eval()
        with torch.no_grad():
            chosen = torch.from_numpy(np.flatnonzero(marks)).split(1024)
            parts = [net(inputs(clouds[row[it]], hand[it], up[it], generator)) for it in chosen]
        return torch.cat(parts).numpy() if parts else np.zeros(0)

    found = {}
    begun = time.process_time()
    for epoch in range(args.epochs):
        net.train()
        losses = []
        for it in rows[torch.randperm(len(rows), generator=generator)].split(BATCH):
            out = net(inputs(clouds[row[it]], hand[it], up[it], generator))
            loss = torch.nn.functional.binary_cross_entropy_with_logits(out, kept[it], pos_weight=weight)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            losses.append(float(loss.detach()))
        found = {"known": auc(score(known), data.kept[known]), "unseen": auc(score(test), data.kept[test])}
        print(
            f"epoch {epoch + 1}: loss {np.mean(losses):.3f}, AUC {found['known']:.3f} on objects of the "
            f"training, {found['unseen']:.3f} on unseen ones, {time.process_time() - begun:.0f} s of CPU",
            flush=True,
        )
    if args.policy:
        torch.save(net.state_dict(), args.policy)
    return found


def parsed(words: list[str]) -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="+", metavar="FILE", help="files of `palmares grasps`, of one hand")
    parser.add_argument("--epochs", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1, help="also chooses the unseen objects")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--policy", type=output_file, metavar="FILE", help="where the network is saved")
    return parser.parse_args(words)


if __name__ == "__main__":
    train(parsed(sys.argv[1:]))
