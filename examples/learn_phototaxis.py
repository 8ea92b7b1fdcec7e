# SPDX-License-Identifier: BSD-3-Clause
"""Learns to drive to a light by a policy gradient, in NumPy alone (docs/learning.md).

    python examples/learn_phototaxis.py

The robots of the task ``phototaxis`` share one linear policy: the mean of each wheel's speed is a weighted sum of what
a robot observes and a constant. It begins with weights of 0, and is trained by REINFORCE with a baseline: what followed
an action, less what followed in the mean of all worlds at that time, says whether the action becomes likelier. Prints
how training goes, then what the policy is worth without its noise, in whole episodes of another seed, and its start.
"""

from __future__ import annotations

import argparse
import time
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swarmevo.env import SwarmVectorEnv

Array = NDArray[np.float64]

TASK: Final = "phototaxis"
TEST_SEED: Final = 1_000_000
SPREAD: Final = 0.5
"""Standard deviation of the actions in training, around their mean."""
DISCOUNT: Final = 0.99
"""Of what follows an action, for each control step later."""


def inputs_of(observations: NDArray[np.float32]) -> Array:
    """Return ``(..., observations + 1)``: observations with a constant behind."""
    return np.concatenate([observations, np.ones((*observations.shape[:-1], 1))], axis=-1)


def play(envs: SwarmVectorEnv, weights: Array, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Play an episode in each world.

    Returns:
        Of each step inputs ``(steps, worlds, robots, inputs)``, how far actions were from their mean ``(steps, worlds,
        robots, 2)``, and rewards ``(steps, worlds)``.
    """
    observations, _ = envs.reset()
    inputs, noises, rewards = [], [], []
    for _ in range(envs.info.control_steps):
        inputs.append(inputs_of(observations))
        noises.append(SPREAD * rng.standard_normal(envs.action_space.shape))
        observations, reward, *_ = envs.step(inputs[-1] @ weights + noises[-1])
        rewards.append(reward)
    return np.array(inputs), np.array(noises), np.array(rewards)


def gradient(inputs: Array, noises: Array, rewards: Array) -> Array:
    """Return the policy gradient ``(inputs, 2)``: mean of an action's advantage times its log-likelihood's gradient."""
    followed, later = np.zeros_like(rewards), np.zeros(rewards.shape[1])
    for step in reversed(range(len(rewards))):
        followed[step] = later = rewards[step] + DISCOUNT * later
    advantage = followed - followed.mean(axis=1, keepdims=True)
    advantage /= advantage.std() + 1e-12
    of_means = noises / SPREAD**2 * advantage[..., np.newaxis, np.newaxis]
    every = inputs.reshape(-1, inputs.shape[-1])
    return every.T @ of_means.reshape(-1, of_means.shape[-1]) / len(every)


class Adam:
    """Steps along a gradient, each weight by its own scale (Kingma and Ba 2015)."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._mean, self._square, self._steps = np.zeros(shape), np.zeros(shape), 0

    def step(self, gradient: Array) -> Array:
        """Return the step, about 1 for each weight."""
        self._steps += 1
        self._mean += 0.1 * (gradient - self._mean)
        self._square += 0.01 * (gradient**2 - self._square)
        mean, square = self._mean / (1 - 0.9**self._steps), self._square / (1 - 0.99**self._steps)
        return mean / (np.sqrt(square) + 1e-8)


def train(updates: int = 120, worlds: int = 32, horizon: float = 30.0, rate: float = 0.05, seed: int = 1) -> Array:
    """Return the weights ``(observations + 1, 2)`` after so many updates, each by an episode in every world."""
    envs = SwarmVectorEnv(TASK, worlds, set={"episode.horizon": horizon}, seed=seed)
    rng, weights = np.random.default_rng(seed), untrained(envs)
    adam, start = Adam(weights.shape), time.process_time()
    for update in range(updates):
        inputs, noises, rewards = play(envs, weights, rng)
        weights += rate * adam.step(gradient(inputs, noises, rewards))
        if update % 20 == 0 or update == updates - 1:
            mean, seconds = rewards.sum(axis=0).mean(), time.process_time() - start
            print(f"update {update + 1:3}: {mean:.3f} in an episode, {seconds:.0f} s of CPU time")
    envs.close()
    return weights


def untrained(envs: SwarmVectorEnv) -> Array:
    """Return weights of 0, of robots that stand still."""
    return np.zeros((envs.info.observations + 1, envs.info.commands))


def evaluate(weights: Array | None, worlds: int = 50) -> dict[str, Array]:
    """Return each objective ``(worlds,)`` of whole episodes without noise of the actions; None: before training."""
    envs = SwarmVectorEnv(TASK, worlds, seed=TEST_SEED)
    chosen = untrained(envs) if weights is None else weights
    observations, _ = envs.reset()
    for _ in range(envs.info.control_steps):
        observations, *_, infos = envs.step(inputs_of(observations) @ chosen)
    envs.close()
    return {name: infos["objectives"][name] for name in ("nearness", "arrived")}


def main() -> None:
    """Train, then test."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--updates", type=int, default=120)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    weights = train(arguments.updates, seed=arguments.seed)
    for what, tested in (("untrained", evaluate(None)), ("trained", evaluate(weights))):
        errors = {name: values.std(ddof=1) / len(values) ** 0.5 for name, values in tested.items()}
        print(f"{what}: " + ", ".join(f"{name} {tested[name].mean():.3f} ± {errors[name]:.3f}" for name in tested))


if __name__ == "__main__":
    main()
