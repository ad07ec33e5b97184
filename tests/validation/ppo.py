"""stable-baselines3's PPO on an environment with a tracker in its loop: that it runs, not that it learns.

It lives in an environment of its own, since PyTorch is large; from the repository's root:

    python -m venv .learning
    .learning/bin/pip install -e . "stable-baselines3>=2.7"
    .learning/bin/python -m tests.validation.ppo [--env Aerial|InCar|MotorcycleLane] [--steps N]
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import gymnasium
import torch._dynamo  # noqa: F401  PyTorch loads it late, which crashes once Mesa has brought its own LLVM
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env

from scenarios.in_the_loop import TrackerInTheLoop

ROLLOUT = 128
"""Steps between two updates of the policy."""
SMALL = ("camera.width=96", "camera.height=64", "seconds=3")


def main(arguments: Sequence[str] | None = None) -> None:
    """Check the environment as stable-baselines3 does, train on it, and let the policy drive one episode."""
    parser = argparse.ArgumentParser(prog="python -m tests.validation.ppo")
    parser.add_argument("--env", default="Aerial", choices=("Aerial", "InCar", "MotorcycleLane"))
    parser.add_argument("--steps", type=int, default=512)
    parser.add_argument("--tracker", default="association@noisy", metavar="NAME")
    chosen = parser.parse_args(arguments)
    made = gymnasium.make(f"sim:testtrack/{chosen.env}-v0", overrides=SMALL)
    env = TrackerInTheLoop(made, chosen.tracker)
    check_env(env)
    model = PPO("CnnPolicy", env, n_steps=ROLLOUT, batch_size=64, n_epochs=2, seed=500, device="cpu")
    model.learn(chosen.steps)
    image, _ = env.reset(seed=500)
    earned, over, steps = 0.0, False, 0
    while not over:
        action, _ = model.predict(image, deterministic=True)
        image, reward, terminated, truncated, _ = env.step(action)
        earned, steps, over = earned + reward, steps + 1, terminated or truncated
    env.close()
    print(f"{model.num_timesteps} steps of training; then {steps} frames, mean reward {earned / steps:.3f}")


if __name__ == "__main__":
    main()
