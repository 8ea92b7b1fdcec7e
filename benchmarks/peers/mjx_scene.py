#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""MJX peer: the scene of mujoco_scene.py in many worlds at once, by JAX, on a GPU.

Prints one JSON line.  Rate = worlds * simulated seconds per second on the clock, once compiled.  Each world has a
13-15-2 net of its own.

What is changed for MJX makes it faster: spheres of the same radius at the same height for the robots' bodies (MJX
knows no cylinder against a box, and these touch boxes, planes and one another in the same points), planes for walls,
rays once in each control period instead of in each step.

  --config tuned  one-contact ellipsoid wheels, frictionless skids, 3-D
  --config planar no wheels or floor: 3 planar joints per body, drive force
"""

import argparse
import functools
import json
import math
import statistics
import time

import jax
import jax.numpy as jnp
import mujoco
from mujoco import mjx
from mujoco_scene import VMAX, mjcf


def runner(a):
    """Return what simulates all worlds, and the bodies of the box and the robots."""
    m = mujoco.MjModel.from_xml_string(mjcf(a.dt, a.config, push=a.push, mjx=True))
    rid = jnp.array([mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, f"r{i}") for i in range(5)])
    m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    model = mjx.put_model(m)
    m.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    sensing = mjx.put_model(m)
    substeps = max(1, round(a.control / a.dt))
    periods = round(a.seconds / (substeps * a.dt))
    bias = math.atanh(0.9) if a.push else 0.5

    def control(d, w1, w2):
        distance = mjx.sensor_pos(sensing, d).sensordata.reshape(5, 8)
        infrared = jnp.where((distance < 0) | (distance > 0.1), 0.0, 1 - distance * 10)
        rf = jnp.hypot(d.xpos[rid, 0] - 0.5, d.xpos[rid, 1])
        x = jnp.concatenate([infrared, jnp.zeros((5, 4)), jnp.where(rf < 0.3, 1 - rf / 0.3, 0.0)[:, None]], axis=1)
        return (jnp.tanh(jnp.tanh(x @ w1) @ w2 + bias) * VMAX).reshape(10)

    def period(d, _, w1, w2):
        d = d.replace(ctrl=control(d, w1, w2))
        return jax.lax.fori_loop(0, substeps, lambda _, d: mjx.step(model, d), d), None

    @jax.jit
    @jax.vmap
    def simulate(w1, w2):
        d = mjx.forward(model, mjx.make_data(m))
        return jax.lax.scan(functools.partial(period, w1=w1, w2=w2), d, length=periods)[0]

    return simulate, mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, "box"), rid


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--config", choices=("tuned", "planar"), default="tuned")
    p.add_argument("--dt", type=float, default=0.01)
    p.add_argument("--control", type=float, default=0.1, help="control period, s")
    p.add_argument("--seconds", type=float, default=20)
    p.add_argument("--nsim", type=int, default=1024)
    p.add_argument("--repeat", type=int, default=3)
    p.add_argument("--push", action="store_true", help="five robots side by side push the box")
    a = p.parse_args()
    simulate, box, rid = runner(a)
    rates = []
    for s in range(-1, a.repeat):  # the first one compiles
        one, two = jax.random.split(jax.random.key(s + 1))
        w1, w2 = jax.random.normal(one, (a.nsim, 13, 15)), jax.random.normal(two, (a.nsim, 15, 2))
        if a.push:  # by their biases alone
            w1, w2 = 0 * w1, 0 * w2
        jax.block_until_ready((w1, w2))
        begun = time.perf_counter()
        d = jax.block_until_ready(simulate(w1, w2))
        if s >= 0:
            rates.append(a.nsim * a.seconds / (time.perf_counter() - begun))
    moved = jnp.hypot(d.xpos[:, box, 0] - 0.15, d.xpos[:, box, 1])
    print(
        json.dumps(
            dict(
                peer="mjx",
                version=mujoco.__version__,
                device=jax.devices()[0].device_kind,
                dt=a.dt,
                realtime_factor=round(statistics.median(rates), 1),
                range=[round(min(rates), 1), round(max(rates), 1)],
                note=dict(
                    config=a.config,
                    nsim=a.nsim,
                    control=a.control,
                    seconds=a.seconds,
                    push=a.push,
                    box_moved=round(float(moved.mean()), 4),
                    finite=bool(jnp.isfinite(d.qpos).all()),
                    z_up=round(float(d.xmat[:, rid].reshape(-1, 9)[:, 8].min()), 3),
                    repeats=a.repeat,
                ),
            )
        )
    )


if __name__ == "__main__":
    main()
