#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""MuJoCo Warp peer: the scene of mjx_scene.py in many worlds at once, by Warp, on a GPU.

Prints one JSON line.  Rate = worlds * simulated seconds per second on the clock, once compiled.  Each world has a
13-15-2 net of its own.  On a GPU one control period (rays, nets, steps) is one CUDA graph.

  --config tuned  one-contact ellipsoid wheels, frictionless skids, 3-D
  --config planar no wheels or floor: 3 planar joints per body, drive force
"""

import argparse
import json
import math
import statistics
import time

import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp
from mujoco_scene import VMAX, mjcf

CONTACTS, ROWS = 48, 192  # that a world has room for; what the last step needed is printed


@wp.kernel
def drive(
    rays: wp.array2d[float],
    places: wp.array2d[wp.vec3],
    bodies: wp.array[int],
    first: wp.array3d[float],
    second: wp.array3d[float],
    bias: float,
    fastest: float,
    commands: wp.array2d[float],
):
    """Each robot's net: infrared and radio in, two wheel speeds out."""
    world, robot = wp.tid()
    rf = wp.length(wp.vec2(places[world, bodies[robot]][0] - 0.5, places[world, bodies[robot]][1]))
    strength = wp.where(rf < 0.3, 1.0 - rf / 0.3, 0.0)
    left, right = float(bias), float(bias)
    for hidden in range(15):
        total = strength * first[world, 12, hidden]
        for k in range(8):
            distance = rays[world, 8 * robot + k]
            if distance >= 0.0 and distance <= 0.1:
                total += (1.0 - distance * 10.0) * first[world, k, hidden]
        total = wp.tanh(total)
        left += total * second[world, hidden, 0]
        right += total * second[world, hidden, 1]
    commands[world, 2 * robot] = wp.tanh(left) * fastest
    commands[world, 2 * robot + 1] = wp.tanh(right) * fastest


class Worlds:
    """All worlds: their models, data, and one control period of them."""

    def __init__(self, a):
        m = mujoco.MjModel.from_xml_string(mjcf(a.dt, a.config, push=a.push, mjx=True))
        if a.iterations:
            m.opt.iterations = a.iterations
        if a.dense:
            m.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        data = mujoco.MjData(m)
        mujoco.mj_forward(m, data)
        self.box = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, "box")
        self.robots = [mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, f"r{i}") for i in range(5)]
        self.substeps = max(1, round(a.control / a.dt))
        self.bias = math.atanh(0.9) if a.push else 0.5
        self.sensing = mjw.put_model(m)
        m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        self.model = mjw.put_model(m)
        self.bodies = wp.array(self.robots, dtype=int)
        self.first = wp.zeros((a.nsim, 13, 15), dtype=float)
        self.second = wp.zeros((a.nsim, 15, 2), dtype=float)
        self.d = mjw.put_data(m, data, nworld=a.nsim, nconmax=CONTACTS, njmax=ROWS)
        self.start = [(array, wp.clone(array)) for array in (self.d.qpos, self.d.qvel, self.d.qacc_warmstart)]
        self.graph = None

    def restart(self):
        """Put all bodies back to where they started."""
        for array, value in self.start:
            wp.copy(array, value)
        mjw.forward(self.model, self.d)

    def period(self):
        """Sense, let the nets decide, and step to the next control period."""
        d = self.d
        mjw.sensor_pos(self.sensing, d)
        arrays = [d.sensordata, d.xpos, self.bodies, self.first, self.second, self.bias, VMAX, d.ctrl]
        wp.launch(drive, dim=(d.nworld, 5), inputs=arrays)
        for _ in range(self.substeps):
            mjw.step(self.model, d)

    def simulate(self, periods):
        """Simulate on; a GPU's first period is recorded."""
        if wp.get_device().is_cuda and self.graph is None:
            self.period()  # compiles, and allocates
            with wp.ScopedCapture() as capture:
                self.period()
            self.graph = capture.graph
        for _ in range(periods):
            if self.graph is None:
                self.period()
            else:
                wp.capture_launch(self.graph)
        wp.synchronize()


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--config", choices=("tuned", "planar"), default="tuned")
    p.add_argument("--dt", type=float, default=0.01)
    p.add_argument("--control", type=float, default=0.1, help="control period, s")
    p.add_argument("--seconds", type=float, default=20)
    p.add_argument("--nsim", type=int, default=1024)
    p.add_argument("--repeat", type=int, default=3)
    p.add_argument("--iterations", type=int, default=0, help="of the solver (0: the scene's, 8)")
    p.add_argument("--dense", action="store_true", help="dense Jacobians instead of what MuJoCo chooses")
    p.add_argument("--push", action="store_true", help="five robots side by side push the box")
    a = p.parse_args()
    wp.config.quiet = True
    worlds = Worlds(a)
    periods = round(a.seconds / a.control)
    worlds.simulate(1)  # compiles
    rates = []
    for s in range(a.repeat):
        g = np.random.default_rng(s)
        for array, shape in ((worlds.first, (a.nsim, 13, 15)), (worlds.second, (a.nsim, 15, 2))):
            array.assign(np.zeros(shape, np.float32) if a.push else g.normal(0, 1, shape).astype(np.float32))
        worlds.restart()
        wp.synchronize()
        begun = time.perf_counter()
        worlds.simulate(periods)
        rates.append(a.nsim * a.seconds / (time.perf_counter() - begun))
    d = worlds.d
    place = d.xpos.numpy()[:, worlds.box]
    print(
        json.dumps(
            dict(
                peer="mujoco_warp",
                version=mjw.__version__,
                device=wp.get_device().name,
                dt=a.dt,
                realtime_factor=round(statistics.median(rates), 1),
                range=[round(min(rates), 1), round(max(rates), 1)],
                note=dict(
                    config=a.config,
                    nsim=a.nsim,
                    control=a.control,
                    seconds=a.seconds,
                    push=a.push,
                    box_moved=round(float(np.hypot(place[:, 0] - 0.15, place[:, 1]).mean()), 4),
                    finite=bool(np.isfinite(d.qpos.numpy()).all()),
                    z_up=round(float(d.xmat.numpy()[:, worlds.robots].reshape(-1, 9)[:, 8].min()), 3),
                    contacts=int(d.nacon.numpy()[0]),
                    rows=int(d.nefc.numpy().max()),
                    repeats=a.repeat,
                ),
            )
        )
    )


if __name__ == "__main__":
    main()
