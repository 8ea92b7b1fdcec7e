#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""PyBullet peer: 5 E-puck-like robots + 240 g box + 4 walls, 8 rays each.

Prints one JSON line.  Rate = simulated seconds per CPU second (time.process_time).
Each control step: read poses, one rayTestBatch of 40 rays, 13-15-2 net per robot
(numpy), set 10 wheel speeds, then control/dt physics steps, either one
stepSimulation call each (--substeps off) or one call with numSubSteps.
"""

import argparse
import json
import math
import os
import statistics
import sys
import time

import numpy as np

fd = os.dup(1)
os.dup2(2, 1)  # pybullet prints its build time on stdout
import pybullet as p

sys.stdout.flush()
os.dup2(fd, 1)

IR = np.radians((-17, -49, -90, -150, 150, 90, 49, 17))
R, WHEEL_R, HALF_AXLE, VMAX, REACH = 0.035, 0.0205, 0.0265, 6.28, 0.1
START = ((-0.35, -0.35), (-0.35, 0.0), (-0.35, 0.35), (0.0, -0.38), (0.0, 0.38))
FLOOR, BODY, ROLL = 1, 2, 4


def mask(body, link, group, m):
    p.setCollisionFilterGroupMask(body, link, group, m)


def build(a):
    p.resetSimulation()
    p.setGravity(0, 0, -9.81)
    if a.substeps:
        p.setPhysicsEngineParameter(fixedTimeStep=a.control, numSubSteps=max(1, round(a.control / a.dt)))
    else:
        p.setTimeStep(a.dt)
    if a.iterations:
        p.setPhysicsEngineParameter(numSolverIterations=a.iterations)
    f = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE), useMaximalCoordinates=1)
    mask(f, -1, FLOOR, ROLL | BODY)
    p.changeDynamics(f, -1, lateralFriction=1)
    for sx, sy, px, py in ((0.01, 0.5, 0.51, 0), (0.01, 0.5, -0.51, 0), (0.48, 0.01, 0, 0.51), (0.48, 0.01, 0, -0.51)):
        w = p.createMultiBody(
            0,
            p.createCollisionShape(p.GEOM_BOX, halfExtents=[sx, sy, 0.04]),
            basePosition=[px, py, 0.045],
            useMaximalCoordinates=1,
        )  # clear of floor and of each other: no static-static contacts
        mask(w, -1, BODY, BODY)
        p.changeDynamics(w, -1, lateralFriction=0.3)
    box = p.createMultiBody(
        0.24,
        p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.09, 0.1375, 0.015]),
        basePosition=[0.15, 0, 0.015],
        useMaximalCoordinates=1,
    )
    mask(box, -1, BODY, BODY | FLOOR)
    p.changeDynamics(box, -1, lateralFriction=0.5)
    chassis = p.createCollisionShape(p.GEOM_CYLINDER, radius=R, height=0.035)
    wheel = (
        p.createCollisionShape(p.GEOM_SPHERE, radius=WHEEL_R)
        if a.config == "tuned"
        else p.createCollisionShape(p.GEOM_CYLINDER, radius=WHEEL_R, height=0.002)
    )
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.005)
    q = p.getQuaternionFromEuler([math.pi / 2, 0, 0])
    robots = []
    zc = 0.0245
    for i, (x, y) in enumerate(START):
        yaw = math.radians(137 * i % 360)
        r = p.createMultiBody(
            0.066,
            chassis,
            basePosition=[x, y, zc],
            baseOrientation=p.getQuaternionFromEuler([0, 0, yaw]),
            linkMasses=[0.005, 0.005, 0.002, 0.002],
            linkCollisionShapeIndices=[wheel, wheel, ball, ball],
            linkVisualShapeIndices=[-1] * 4,
            linkPositions=[
                [0, HALF_AXLE, WHEEL_R - zc],
                [0, -HALF_AXLE, WHEEL_R - zc],
                [-0.026, 0, 0.005 - zc],
                [0.026, 0, 0.0055 - zc],
            ],
            linkOrientations=[q, q, [0, 0, 0, 1], [0, 0, 0, 1]],
            linkInertialFramePositions=[[0, 0, 0]] * 4,
            linkInertialFrameOrientations=[[0, 0, 0, 1]] * 4,
            linkParentIndices=[0] * 4,
            linkJointTypes=[p.JOINT_REVOLUTE] * 2 + [p.JOINT_FIXED] * 2,
            linkJointAxis=[[0, 0, -1]] * 2 + [[0, 0, 1]] * 2,
        )
        mask(r, -1, BODY, BODY)
        p.changeDynamics(r, -1, lateralFriction=0.3, linearDamping=0, angularDamping=0)
        for k in range(4):
            mask(r, k, ROLL, FLOOR)
            p.changeDynamics(
                r,
                k,
                lateralFriction=1 if k < 2 else 0.01,
                rollingFriction=0,
                spinningFriction=0,
                jointLowerLimit=1,
                jointUpperLimit=-1,
            )
        robots.append(r)
    return robots, box


def run(a, seed):
    robots, box = build(a)
    g = np.random.default_rng(seed)
    w1, w2, x = g.normal(0, 1, (13, 15)), g.normal(0, 1, (15, 2)), np.zeros((5, 13))
    sub = max(1, round(a.control / a.dt))
    n = round(a.seconds / a.control)
    pose = np.zeros((5, 3))
    forces = [0.01, 0.01]
    step, setm, getp = p.stepSimulation, p.setJointMotorControlArray, p.getBasePositionAndOrientation
    c0 = time.process_time()
    for _ in range(n):
        for i, r in enumerate(robots):
            (px, py, _z), (qx, qy, qz, qw) = getp(r)
            pose[i] = px, py, math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
        if not a.no_rays:
            ang = pose[:, 2:] + IR
            c, s = np.cos(ang), np.sin(ang)
            o = np.empty((40, 3))
            e = np.empty((40, 3))
            o[:, 2] = e[:, 2] = 0.018
            r0 = R + 1e-4
            o[:, 0] = (pose[:, :1] + r0 * c).ravel()
            o[:, 1] = (pose[:, 1:2] + r0 * s).ravel()
            e[:, 0] = (pose[:, :1] + (r0 + REACH) * c).ravel()
            e[:, 1] = (pose[:, 1:2] + (r0 + REACH) * s).ravel()
            hits = p.rayTestBatch(o.tolist(), e.tolist(), numThreads=1)
            x[:, :8] = 1 - np.array([h[2] for h in hits]).reshape(5, 8)
        rf = np.hypot(pose[:, 0] - 0.5, pose[:, 1])
        x[:, 12] = np.where(rf < 0.3, 1 - rf / 0.3, 0)
        u = np.tanh(np.tanh(x @ w1) @ w2 + 0.5) * VMAX
        for i, r in enumerate(robots):
            setm(r, (0, 1), p.VELOCITY_CONTROL, targetVelocities=u[i].tolist(), forces=forces)
        if a.substeps:
            step()
        else:
            for _ in range(sub):
                step()
    cpu = time.process_time() - c0
    b = p.getBasePositionAndOrientation(box)[0]
    up = min(p.getMatrixFromQuaternion(getp(r)[1])[8] for r in robots)
    return a.seconds / cpu, dict(
        box_xy=[round(v, 3) for v in b[:2]], z_up=round(up, 3), contacts=len(p.getContactPoints())
    )


def main():
    q = argparse.ArgumentParser()
    q.add_argument("--config", choices=("plain", "tuned"), default="plain")
    q.add_argument("--dt", type=float, default=0.01)
    q.add_argument("--control", type=float, default=0.1)
    q.add_argument("--seconds", type=float, default=180)
    q.add_argument("--repeat", type=int, default=5)
    q.add_argument("--substeps", action="store_true", help="one stepSimulation call with numSubSteps")
    q.add_argument("--iterations", type=int, default=0, help="solver iterations (0: PyBullet's default, 50)")
    q.add_argument("--no-rays", action="store_true")
    a = q.parse_args()
    p.connect(p.DIRECT)
    rates, info = [], {}
    for s in range(a.repeat):
        r, info = run(a, s)
        rates.append(r)
    from importlib.metadata import version

    print(
        json.dumps(
            dict(
                peer="pybullet",
                version=version("pybullet"),
                dt=a.dt,
                realtime_factor_per_cpu_s=round(statistics.median(rates), 1),
                range=[round(min(rates), 1), round(max(rates), 1)],
                note=dict(
                    config=a.config,
                    control=a.control,
                    seconds=a.seconds,
                    substeps=a.substeps,
                    rays=not a.no_rays,
                    iterations=a.iterations or 50,
                    repeats=a.repeat,
                    **info,
                ),
            )
        )
    )


if __name__ == "__main__":
    main()
