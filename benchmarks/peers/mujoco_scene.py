#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""MuJoCo peer: 5 E-puck-like robots + 240 g box + 4 walls, 8 rangefinders each.

Prints one JSON line.  Rate = simulated seconds per CPU second (time.process_time,
all threads of the process); with nsim > 1 it is worlds * simulated seconds.
Needs MuJoCo >= 4.0 for --mode batch (mujoco.batch); the rest runs on 3.x too.

  --mode step     physics + rays only, mj_step(m, d, nstep), random wheel speeds
  --mode loop     + a 13-15-2 net per robot (numpy), one world, one mj_step call per control step
  --mode batch    + a different net per world, mujoco.batch.Batch, --nsim worlds, --nthread threads
  --mode rollout  physics + rays, open loop, mujoco.rollout on native threads
  --config plain  cylinder wheels on hinges (2 contacts each), velocity actuators, skid balls, default solver
  --config tuned  one-contact ellipsoid wheels, frictionless skids, <= 4 solver iterations, rays skip floor/wheels
  --config planar no wheels or floor: 3 planar joints per body, drive force; for a user who wants speed above all
  --sensor-every 0.1  cast the rays once per control period instead of at every physics step
"""

import argparse
import json
import math
import statistics
import time

import mujoco
import numpy as np

IR_DEG = (-17, -49, -90, -150, 150, 90, 49, 17)  # the E-puck's ps0..ps7
R, WHEEL_R, HALF_AXLE = 0.035, 0.0205, 0.0265
VMAX = 6.28  # rad/s at the wheel
START = ((-0.35, -0.35), (-0.35, 0.0), (-0.35, 0.35), (0.0, -0.38), (0.0, 0.38))
PUSH = tuple(
    (0.15 - 0.09 - 0.035 - 0.002, 0.055 * (i - 2) * 1.3) for i in range(5)
)  # side by side at the box, heading +x


def mjcf(dt, config, rays=True, sensor_every=0.0, cone="pyramidal", solver="Newton", push=False, mjx=False):
    """Return the scene; with ``mjx`` spheres for cylinders, which touch boxes and one another alike, and planes for walls."""
    tuned = config == "tuned"
    wheel = 'type="ellipsoid" size=".0205 .0205 .002"' if tuned else 'type="cylinder" size=".0205 .001"'
    few = 8 if mjx else 4 if tuned else 0  # with 4 of MJX robots fall over
    opt = f'iterations="{few}" ls_iterations="8"' if few else ""
    body = f'type="sphere" size="{R}"' if mjx else f'type="cylinder" size="{R} .0175"'
    assets = '<asset><material name="none"/></asset>' if mjx else ""  # MJX's rays fail where there is none
    hide = ' rgba=".2 .2 .2 0"' if tuned else ""  # alpha 0: rays skip the geom
    slide = 'condim="1"' if tuned else 'friction=".01 .005 .0001"'
    robots, acts, sens = [], [], []
    every = f' nsample="1" interval="{sensor_every}"' if sensor_every else ""
    planar = config == "planar"  # no wheels, no floor: 3 planar joints per body, drive force along site x
    free = '<joint type="slide" axis="1 0 0"{0}/><joint type="slide" axis="0 1 0"{0}/><joint axis="0 0 1"{1}/>'
    for i, (x, y) in enumerate(PUSH if push else START):
        turn = 0 if push else 137 * i % 360
        sites = (
            "".join(
                f'<site name="ir{i}_{k}" pos="{R * math.cos(math.radians(a)):.6f} {R * math.sin(math.radians(a)):.6f} .018"'
                f' zaxis="{math.cos(math.radians(a)):.6f} {math.sin(math.radians(a)):.6f} 0" size=".001"/>'
                for k, a in enumerate(IR_DEG)
            )
            if rays
            else ""
        )
        if planar:  # stall .6 N, top speed .129 m/s; the real robot's no-side-slip rule is not enforced
            robots.append(f'''
  <body name="r{i}" pos="{x} {y} 0" euler="0 0 {turn}">{free.format(' damping="4.65"', ' damping=".0033"')}
    <geom {body} pos="0 0 .0245" mass=".08" contype="2" conaffinity="2" friction=".3"/>
    <site name="c{i}" pos="0 0 .0245"/>{sites}</body>''')
            acts.append(
                f'<motor site="c{i}" gear=".04777 0 0 0 0 -.001263"/><motor site="c{i}" gear=".04777 0 0 0 0 .001263"/>'
            )
            if rays:
                sens += [f'<rangefinder site="ir{i}_{k}"{every}/>' for k in range(8)]
            continue
        robots.append(f'''
  <body name="r{i}" pos="{x} {y} 0" euler="0 0 {turn}"><freejoint/>
    <geom {body} pos="0 0 .0245" mass=".066" contype="2" conaffinity="2" friction=".3"/>
    <geom type="sphere" size=".005" pos="-.026 0 .005" mass=".004" contype="1" conaffinity="0" priority="1" {slide}{hide}/>
    <geom type="sphere" size=".004" pos=".026 0 .005" mass=".000" contype="1" conaffinity="0" priority="1" {slide}{hide}/>
    {sites}
    <body pos="0 {HALF_AXLE} {WHEEL_R}"><joint name="l{i}" axis="0 1 0" armature="1e-6"/>
      <geom {wheel} euler="90 0 0" mass=".005" contype="1" conaffinity="0" friction="1"{hide}/></body>
    <body pos="0 -{HALF_AXLE} {WHEEL_R}"><joint name="w{i}" axis="0 1 0" armature="1e-6"/>
      <geom {wheel} euler="90 0 0" mass=".005" contype="1" conaffinity="0" friction="1"{hide}/></body>
  </body>''')
        acts.append(
            f'<velocity joint="l{i}" kv=".01" forcerange="-.01 .01"/><velocity joint="w{i}" kv=".01" forcerange="-.01 .01"/>'
        )
        if rays:
            sens += [f'<rangefinder site="ir{i}_{k}"{every}/>' for k in range(8)]
    east = 9.5 if push else 0.5
    walls = "".join(
        f'<geom type="plane" size="1 1 .1" pos="{px} {py} 0" zaxis="{-px} {-py} 0" contype="2" conaffinity="2" friction=".3"/>'
        if mjx
        else f'<geom type="box" size="{sx} {sy} .015" pos="{px + cx} {py + cy} .015" contype="2" conaffinity="2" friction=".3"/>'
        for sx, sy, px, py, cx, cy in (
            (0.01, 0.52, east, 0, 0.01, 0),
            (0.01, 0.52, -0.5, 0, -0.01, 0),
            (0.52, 0.01, 0, 0.5, 0, 0.01),
            (0.52, 0.01, 0, -0.5, 0, -0.01),
        )
    )
    return f'''<mujoco><option timestep="{dt}" integrator="implicitfast" cone="{cone}" solver="{solver}" {opt}/>{assets}
<worldbody>
  {"" if planar else f'<geom type="plane" size="1 1 .1" contype="1" conaffinity="1" friction=".5"{hide}/>'}{walls}
  <body name="box" pos=".15 0 .015">{free.format(' frictionloss="1.18"', ' frictionloss=".1"') if planar else "<freejoint/>"}
    <geom type="box" size=".09 .1375 .015" mass=".24" contype="3" conaffinity="2" friction=".5"/></body>
{"".join(robots)}
</worldbody><actuator>{"".join(acts)}</actuator><sensor>{"".join(sens)}</sensor></mujoco>'''


class Net:
    """13-15-2 sigmoid net, one per world, shared by its 5 robots."""

    def __init__(self, nsim, seed):
        g = np.random.default_rng(seed)
        self.w1 = g.normal(0, 1, (nsim, 13, 15))
        self.w2 = g.normal(0, 1, (nsim, 15, 2))
        self.x = np.zeros((nsim, 5, 13))

    def __call__(self, dist, xy):
        x = self.x
        d = dist.reshape(-1, 5, 8)
        x[..., :8] = np.where((d < 0) | (d > 0.1), 0, 1 - d * 10)  # IR reach 10 cm
        rf = np.hypot(xy[..., 0] - 0.5, xy[..., 1])
        x[..., 12] = np.where(rf < 0.3, 1 - rf / 0.3, 0)
        h = np.tanh(x @ self.w1)
        return (np.tanh(h @ self.w2 + 0.5) * VMAX).reshape(-1, 10)


def run(a, seed):
    m = mujoco.MjModel.from_xml_string(mjcf(a.dt, a.config, not a.no_rays, a.sensor_every, a.cone, a.solver, a.push))
    if a.sleep:
        m.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    sub = max(1, round(a.control / a.dt))
    nctl = round(a.seconds / (sub * a.dt))
    rid = [mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, f"r{i}") for i in range(5)]
    box = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, "box")
    info = {}
    if a.mode in ("step", "loop"):
        d = mujoco.MjData(m)
        if a.mode == "step":  # new random wheel speeds each simulated 2 s
            g = np.random.default_rng(seed)
            n = round(2 / a.dt)
            c0 = time.process_time()
            for _ in range(round(a.seconds / 2)):
                d.ctrl[:] = 0.9 * VMAX if a.push else g.uniform(-0.3, 1, m.nu) * VMAX
                mujoco.mj_step(m, d, n)
            cpu = time.process_time() - c0
        else:
            net = Net(1, seed)
            c0 = time.process_time()
            for _ in range(nctl):
                d.ctrl[:] = net(d.sensordata, d.xpos[None, rid])[0]
                mujoco.mj_step(m, d, sub)
            cpu = time.process_time() - c0
        info = dict(
            ncon=int(d.ncon),
            nefc=int(d.nefc),
            box_xy=[round(float(v), 3) for v in d.xpos[box][:2]],
            z_up=round(float(min(d.xmat[r].reshape(3, 3)[2, 2] for r in rid)), 3),
        )
        worlds = 1
    elif a.mode == "batch":
        from mujoco import batch

        b = batch.Batch(m, nsim=a.nsim, nthread=a.nthread)
        s, ctrl, xpos = b.bind("sensordata"), b.bind("ctrl"), b.bind("xpos")
        net = Net(a.nsim, seed)
        c0 = time.process_time()
        for _ in range(nctl):
            ctrl[:] = net(s, xpos[:, rid])
            b.step(nstep=sub)
        cpu = time.process_time() - c0
        worlds = a.nsim
        info = dict(box_moved=round(float(np.hypot(xpos[:, box, 0] - 0.15, xpos[:, box, 1]).mean()), 3))
    else:  # open-loop rollout, C threads
        from mujoco import rollout

        g = np.random.default_rng(seed)
        n = round(a.seconds / a.dt)
        data = [mujoco.MjData(m) for _ in range(max(1, a.nthread))]
        x0 = np.zeros((a.nsim, mujoco.mj_stateSize(m, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
        mujoco.mj_getState(m, data[0], x0[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
        x0[:] = x0[0]
        u = np.repeat(g.uniform(-0.3, 1, (a.nsim, -(-n // round(2 / a.dt)), m.nu)) * VMAX, round(2 / a.dt), 1)[:, :n]
        with rollout.Rollout(nthread=a.nthread if a.nthread > 1 else 0) as r:
            c0 = time.process_time()
            r.rollout(m, data, x0, u)
            cpu = time.process_time() - c0
        worlds = a.nsim
    return worlds * a.seconds / cpu, info


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--mode", choices=("step", "loop", "batch", "rollout"), default="step")
    p.add_argument("--config", choices=("plain", "tuned", "planar"), default="plain")
    p.add_argument("--dt", type=float, default=0.01)
    p.add_argument("--control", type=float, default=0.1, help="control period, s")
    p.add_argument("--seconds", type=float, default=180)
    p.add_argument("--nsim", type=int, default=1)
    p.add_argument("--nthread", type=int, default=1)
    p.add_argument("--repeat", type=int, default=5)
    p.add_argument("--no-rays", action="store_true")
    p.add_argument("--sensor-every", type=float, default=0, help="rangefinder interval, s (0: each step)")
    p.add_argument("--cone", default="pyramidal")
    p.add_argument("--solver", default="Newton")
    p.add_argument("--sleep", action="store_true")
    p.add_argument("--push", action="store_true", help="five robots side by side push the box; with --mode step")
    a = p.parse_args()
    rates, info = [], {}
    for s in range(a.repeat):
        r, info = run(a, s)
        rates.append(r)
    print(
        json.dumps(
            dict(
                peer="mujoco",
                version=mujoco.__version__,
                dt=a.dt,
                realtime_factor_per_cpu_s=round(statistics.median(rates), 1),
                range=[round(min(rates), 1), round(max(rates), 1)],
                note=dict(
                    mode=a.mode,
                    config=a.config,
                    nsim=a.nsim,
                    nthread=a.nthread,
                    control=a.control,
                    seconds=a.seconds,
                    rays=not a.no_rays,
                    sensor_every=a.sensor_every,
                    sleep=a.sleep,
                    cone=a.cone,
                    solver=a.solver,
                    repeats=a.repeat,
                    **info,
                ),
            )
        )
    )


if __name__ == "__main__":
    main()
