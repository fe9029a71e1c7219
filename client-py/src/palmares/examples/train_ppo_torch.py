"""Learn with PPO, written out in PyTorch, on many worlds of `gymnasium.make_vec`.

    pip install 'palmares[learn]'
    python train_ppo_torch.py --task grasp --updates 100 --policy policy.pt

The loop is that of CleanRL's single file ``ppo_continuous_action.py``: copy it and change what you study. The
critic sees the truth, the policy too, or with ``--blind`` only what sensors read (``observations="groups"``).
An update has one episode of each world. The reward is the change of the score and of the potential Φ of
docs/training.md: ``discount=1.0``. With the learner's own discount a critic that knows Φ cancels the shaped
part, so that nothing is learned before the first points; without it every approach is worth something, at the
price of the guarantee that optimal policies stay optimal.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

from palmares.outputs import output_file

DISCOUNT, LAMBDA, CLIP, EPOCHS, BATCHES, LEARNING_RATE = 0.99, 0.95, 0.2, 8, 8, 5e-4
# A point is 10: the potential changes by hundredths in a step, and networks begin with larger numbers.
POINT = 10.0


def train(args: argparse.Namespace) -> list[float]:
    """Train a policy; return the mean return of the episodes that ended in each update."""
    import gymnasium
    import torch
    from torch import nn
    from torch.distributions import Normal

    import palmares.gym  # noqa: F401 - registers the ids

    class Scaled(nn.Module):
        """A network behind inputs that are scaled by their mean and spread."""

        def __init__(self, inputs: int, outputs: int, last: float) -> None:
            super().__init__()
            self.register_buffer("mean", torch.zeros(inputs))
            self.register_buffer("square", torch.ones(inputs))
            self.register_buffer("count", torch.tensor(1e-4))
            layers = [nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs)]
            for layer, gain in zip(layers[::2], (2.0**0.5, 2.0**0.5, last), strict=True):
                nn.init.orthogonal_(layer.weight, gain)
                nn.init.zeros_(layer.bias)
            self.body = nn.Sequential(*layers)

        def learn_scale(self, x: torch.Tensor) -> None:
            self.count += len(x)
            self.mean += (x - self.mean).sum(0) / self.count
            self.square += (x**2 - self.square).sum(0) / self.count

        def forward(self, x: torch.Tensor) -> torch.Tensor:
            spread = (self.square - self.mean**2).clamp(min=1e-4).sqrt()
            return self.body(((x - self.mean) / spread).clamp(-10.0, 10.0))

    torch.manual_seed(args.seed)
    torch.set_num_threads(1)
    envs = gymnasium.make_vec(
        "palmares/Grasp-SoftHand-v1",
        num_envs=args.envs,
        task=args.task,
        hand=args.hand,
        observations="groups",
        shaping=True,
        discount=1.0,  # Of the shaped part: see above.
        step_ms=args.step_ms,
        max_episode_steps=args.steps,
        threads=args.threads,
        autoreset_mode="SameStep",
    )
    envs = gymnasium.wrappers.vector.RecordEpisodeStatistics(envs)
    group = "policy" if args.blind else "critic"
    sizes = {name: values.shape[1] for name, values in envs.observation_space.sample().items()}
    motions = envs.action_space.sample().shape[1]
    policy, critic = Scaled(sizes[group], motions, 0.01), Scaled(sizes["critic"], 1, 0.01)
    log_spread = nn.Parameter(torch.full((motions,), -0.7))
    parameters = [*policy.parameters(), *critic.parameters(), log_spread]
    optimizer = torch.optim.Adam(parameters, lr=LEARNING_RATE, eps=1e-5)

    steps, returns, began = args.steps, [], time.monotonic()
    kept = {
        "observed": torch.zeros(steps, args.envs, sizes[group]),
        "truth": torch.zeros(steps, args.envs, sizes["critic"]),
        "actions": torch.zeros(steps, args.envs, motions),
        "log_probs": torch.zeros(steps, args.envs),
        "values": torch.zeros(steps, args.envs),
    }
    rewards, ends = torch.zeros(steps, args.envs), torch.zeros(steps, args.envs)
    now, _ = envs.reset(seed=args.seed)
    policy.learn_scale(torch.as_tensor(now[group]))
    critic.learn_scale(torch.as_tensor(now["critic"]))
    for update in range(1, args.updates + 1):
        episodes: list[float] = []
        for k in range(steps):
            observed, truth = (torch.as_tensor(now[name]) for name in (group, "critic"))
            with torch.no_grad():
                choice = Normal(policy(observed), log_spread.exp())
                actions = choice.sample()
                row = observed, truth, actions, choice.log_prob(actions).sum(1), critic(truth)[:, 0]
            for store, values in zip(kept.values(), row, strict=True):
                store[k] = values
            now, reward, terminated, truncated, infos = envs.step(actions.numpy().clip(-1.0, 1.0))
            rewards[k] = POINT * torch.as_tensor(reward)
            ends[k] = torch.as_tensor(terminated | truncated)
            for world in np.flatnonzero(terminated | truncated):
                episodes.append(float(infos["episode"]["r"][world]))
                if truncated[world]:  # The run could go on: its last state has a value.
                    last = torch.as_tensor(infos["final_obs"][world]["critic"])
                    with torch.no_grad():
                        rewards[k, world] += DISCOUNT * critic(last[None])[0, 0]

        with torch.no_grad():
            advantages, ahead = torch.zeros_like(rewards), torch.zeros(args.envs)
            after = critic(torch.as_tensor(now["critic"]))[:, 0]
            for k in reversed(range(steps)):
                left = 1.0 - ends[k]
                ahead = (
                    rewards[k]
                    + DISCOUNT * left * after
                    - kept["values"][k]
                    + DISCOUNT * LAMBDA * left * ahead
                )
                advantages[k], after = ahead, kept["values"][k]
            flat = {name: store.flatten(0, 1) for name, store in kept.items()}
            gained = advantages.flatten()
            targets = gained + flat["values"]
        for _ in range(EPOCHS):
            for some in torch.randperm(len(gained)).chunk(BATCHES):
                choice = Normal(policy(flat["observed"][some]), log_spread.exp())
                ratio = (choice.log_prob(flat["actions"][some]).sum(1) - flat["log_probs"][some]).exp()
                gain = (gained[some] - gained[some].mean()) / (gained[some].std() + 1e-8)
                clipped = torch.min(ratio * gain, ratio.clamp(1.0 - CLIP, 1.0 + CLIP) * gain).mean()
                error = (critic(flat["truth"][some])[:, 0] - targets[some]).square().mean()
                loss = 0.5 * error - clipped
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(parameters, 0.5)
                optimizer.step()
        policy.learn_scale(flat["observed"])
        critic.learn_scale(flat["truth"])
        if episodes:
            returns.append(float(np.mean(episodes)))
            print(f"{time.monotonic() - began:5.0f} s, update {update}, return {returns[-1]:.3f}", flush=True)
    envs.close()
    if args.policy:
        torch.save({"policy": policy.state_dict(), "log_spread": log_spread.detach()}, args.policy)
    return returns


def parsed(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the command line's arguments."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--task", default="grasp", help="task, or its folder (default grasp)")
    parser.add_argument("--hand", default="softhand", help="hand, or its folder (default softhand)")
    parser.add_argument("--blind", action="store_true", help="the policy sees what sensors read alone")
    parser.add_argument("--envs", type=int, default=32, help="environments at once (default 32)")
    parser.add_argument("--steps", type=int, default=50, help="steps of an episode (default 50)")
    parser.add_argument("--step-ms", type=float, help="longest step of the integration (default: the task's)")
    parser.add_argument("--updates", type=int, default=100, help="updates (default 100)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the training (default 1)")
    parser.add_argument("--threads", type=int, help="threads that simulate (default: one for each core)")
    parser.add_argument("--policy", type=output_file, help="file for the policy")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    options = parsed()
    try:
        train(options)
    except ModuleNotFoundError as missing:
        sys.exit(f"this needs {missing.name}: pip install 'palmares[learn]'")
