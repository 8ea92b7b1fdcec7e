#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""VMAS peer (2D, holonomic/diff-drive spheres, PyTorch, batched worlds on the CPU or a GPU).

Prints one JSON line.  Rate = worlds * simulated seconds per CPU second; with --device cuda per second on the clock.
  --scene transport : VMAS's own scenario, 5 agents, no range sensors, random actions
  --scene epuck     : 5 diff-drive discs + 240 g box + 4 walls, 8-ray Lidar each,
                      13-15-2 net per world (torch.bmm)
"""

import argparse
import json
import math
import statistics
import time

import torch
import vmas
from vmas import make_env
from vmas.simulator.core import Agent, Box, Landmark, Line, Sphere, World
from vmas.simulator.dynamics.diff_drive import DiffDrive
from vmas.simulator.scenario import BaseScenario
from vmas.simulator.sensors import Lidar

R, REACH, VMAX, AXLE = 0.035, 0.1, 0.129, 0.053
START = ((-0.35, -0.35), (-0.35, 0.0), (-0.35, 0.35), (0.0, -0.38), (0.0, 0.38))


class Epuck(BaseScenario):
    def make_world(self, batch_dim, device, substeps=1, dt=0.1, rays=True, **kw):
        w = World(
            batch_dim, device, dt=dt, substeps=substeps, x_semidim=0.5, y_semidim=0.5, linear_friction=0, drag=0.25
        )
        for i in range(5):
            w.add_agent(
                Agent(
                    f"r{i}",
                    shape=Sphere(R),
                    mass=0.08,
                    u_range=[VMAX, 2 * VMAX / AXLE],
                    max_speed=VMAX,
                    sensors=[Lidar(w, n_rays=8, max_range=R + REACH, render=False)] if rays else [],
                    dynamics=DiffDrive(w, integration="euler"),
                    render_action=False,
                )
            )
        self.box = Landmark(
            "box",
            collide=True,
            movable=True,
            rotatable=True,
            mass=0.24,
            shape=Box(length=0.18, width=0.275),
            linear_friction=0.5,
            angular_friction=0.05,
        )
        w.add_landmark(self.box)
        self.walls = [Landmark(f"wall{k}", collide=True, movable=False, shape=Line(length=1.0)) for k in range(4)]
        for k in self.walls:
            w.add_landmark(k)
        self.rays = rays
        return w

    def reset_world_at(self, env_index=None):
        for i, (a, (x, y)) in enumerate(zip(self.world.agents, START)):
            a.set_pos(torch.tensor([x, y]), batch_index=env_index)
            a.set_rot(torch.tensor([math.radians(137 * i % 360)]), batch_index=env_index)
        self.box.set_pos(torch.tensor([0.15, 0.0]), batch_index=env_index)
        for wl, (x, y, r) in zip(
            self.walls, ((0.5, 0, math.pi / 2), (-0.5, 0, math.pi / 2), (0, 0.5, 0), (0, -0.5, 0))
        ):
            wl.set_pos(torch.tensor([x, float(y)]), batch_index=env_index)
            wl.set_rot(torch.tensor([float(r)]), batch_index=env_index)

    def reward(self, agent):
        return torch.zeros(self.world.batch_dim)

    def observation(self, agent):
        x = torch.zeros(self.world.batch_dim, 13)
        if self.rays:
            x[:, :8] = 1 - (agent.sensors[0].measure() - R) / REACH
        d = torch.linalg.vector_norm(agent.state.pos - torch.tensor([0.5, 0.0]), dim=1)
        x[:, 12] = torch.clamp(1 - d / 0.3, min=0)
        return x


def clock(device):
    """Return seconds of this process, or those on the clock once the GPU has done all that it was told."""
    if device == "cpu":
        return time.process_time()
    torch.cuda.synchronize()
    return time.perf_counter()


def run(a, seed):
    torch.set_default_device(a.device)
    g = torch.Generator(a.device).manual_seed(seed)
    n = round(a.seconds / a.dt)
    if a.scene == "transport":
        env = make_env("transport", num_envs=a.nsim, device=a.device, continuous_actions=True, seed=seed, n_agents=5)
        acts = [[torch.rand(a.nsim, 2, generator=g) * 2 - 1 for _ in range(5)] for _ in range(8)]
        n = round(a.seconds / env.world.dt)
        env.reset()
        c0 = clock(a.device)
        for k in range(n):
            env.step(acts[k % 8])
        seconds = clock(a.device) - c0
        return a.nsim * n * env.world.dt / seconds, {}
    env = make_env(
        Epuck(),
        num_envs=a.nsim,
        device=a.device,
        continuous_actions=True,
        seed=seed,
        substeps=a.substeps,
        dt=a.dt,
        rays=not a.no_rays,
    )
    w1 = torch.randn(a.nsim, 13, 15, generator=g)
    w2 = torch.randn(a.nsim, 15, 2, generator=g)
    obs = env.reset()
    if a.random:  # as benchmarks/learning.py has them: smooth, forwards as a rule
        wheels = torch.zeros(a.nsim, 5, 2)
        acts = []
        for _ in range(n):
            wheels = 0.95 * wheels + math.sqrt(1 - 0.95**2) * torch.randn(a.nsim, 5, 2, generator=g)
            u = (0.6 + 0.4 * wheels).clamp(-1, 1) * VMAX
            act = torch.stack(((u[..., 0] + u[..., 1]) / 2, (u[..., 1] - u[..., 0]) / AXLE), -1)
            acts.append(list(act.unbind(1)))
    with torch.no_grad():
        env.step([torch.zeros(a.nsim, 2)] * 5)  # what is made once is not timed
        c0 = clock(a.device)
        for k in range(n):
            if a.random:
                env.step(acts[k])
                continue
            u = torch.tanh(torch.bmm(torch.tanh(torch.bmm(torch.stack(obs, 1), w1)), w2) + 0.5) * VMAX
            act = torch.stack(((u[..., 0] + u[..., 1]) / 2, (u[..., 1] - u[..., 0]) / AXLE), -1)
            obs, _, _, _ = env.step(list(act.unbind(1)))
        seconds = clock(a.device) - c0
    b = env.scenario.box.state.pos
    return a.nsim * a.seconds / seconds, dict(
        box_moved=round(float(torch.hypot(b[:, 0] - 0.15, b[:, 1]).mean()), 4), finite=bool(torch.isfinite(b).all())
    )


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--scene", choices=("transport", "epuck"), default="epuck")
    p.add_argument("--nsim", type=int, default=512)
    p.add_argument("--dt", type=float, default=0.1, help="control period")
    p.add_argument("--substeps", type=int, default=1)
    p.add_argument("--seconds", type=float, default=180)
    p.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    p.add_argument("--threads", type=int, default=1)
    p.add_argument("--repeat", type=int, default=5)
    p.add_argument("--no-rays", action="store_true")
    p.add_argument("--random", action="store_true", help="actions made beforehand instead of a network (epuck)")
    a = p.parse_args()
    torch.set_num_threads(a.threads)
    rates, info = [], {}
    for s in range(a.repeat):
        r, info = run(a, s)
        rates.append(r)
    from importlib.metadata import version

    print(
        json.dumps(
            dict(
                peer="vmas",
                version=version("vmas"),
                dt=a.dt / a.substeps,
                **{
                    "realtime_factor_per_cpu_s" if a.device == "cpu" else "realtime_factor": round(
                        statistics.median(rates), 1
                    )
                },
                range=[round(min(rates), 1), round(max(rates), 1)],
                note=dict(
                    scene=a.scene,
                    nsim=a.nsim,
                    control=a.dt,
                    substeps=a.substeps,
                    threads=a.threads,
                    seconds=a.seconds,
                    rays=not a.no_rays and a.scene == "epuck",
                    repeats=a.repeat,
                    torch=torch.__version__,
                    **info,
                ),
            )
        )
    )


if __name__ == "__main__":
    main()
