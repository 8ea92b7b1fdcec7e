# SPDX-License-Identifier: BSD-3-Clause
"""Every sensor against brute force over recorded poses, which shares no code with the library."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from swarmevo.config import Config, load
from swarmevo.errors import ConfigError
from swarmevo.protocols import FeedForward, FloatArray
from swarmevo.simulation import EpisodeKey, Lockstep, Scene, simulate

QUIET = (
    *(f"noise.{name}=0" for name in ("infrared", "infrared_at_contact", "wheels", "rf")),
    "team.start=random",
    "team.start_region=[-0.44, 0.44, -0.44, 0.2]",
    "team.robots=8",
    "team.start_jitter=[0, 0]",
)
RADIUS, HALF_ARENA, HALF_BOX = 0.035, 0.5, (0.1375, 0.09)


def world(*overrides: str, sensors: str, seconds: float = 0.1) -> Config:
    quiet = [line for line in QUIET if line.split("=")[0] not in {given.split("=")[0] for given in overrides}]
    return load("paper", [*quiet, *overrides, f"robot.sensors={sensors}", f"episode.horizon={seconds}"])


def steered(scene: Scene, steer: Callable[[FloatArray], Any], worlds: int = 4) -> dict[str, FloatArray]:
    """Return the channels ``(worlds, steps, robots, width)`` of robots that get the commands that ``steer`` makes."""
    states: list[Mapping[str, FloatArray]] = []
    with Lockstep(scene, worlds=worlds, seed=5) as lockstep:
        while True:
            observations = lockstep.observe()
            states.append(lockstep.state().channels)
            if lockstep.done.all():
                return {name: np.stack([state[name] for state in states], axis=1) for name in states[0]}
            lockstep.advance(np.broadcast_to(steer(observations), (worlds, 8, scene.info.commands)))


def still(config: Config, episodes: int = 150) -> Mapping[str, FloatArray]:
    """Return the channels of the first moment of episodes, ``(episodes, robots, width)``."""
    scene = Scene(config)
    commands, inputs = scene.info.commands, scene.info.observations
    nothing = FeedForward(
        np.zeros((1, 0, inputs)), np.zeros((1, commands, 0)), np.zeros((1, 0), dtype=bool), bias=False
    )
    keys = [EpisodeKey(11, 0, 0, repeat) for repeat in range(episodes)]
    drivers = np.zeros((episodes, scene.info.robots), dtype=np.uint32)
    found = simulate(scene, nothing, keys, drivers, ["pose", "box", "observation"])
    return {name: values[:, 0] for name, values in found.telemetry.channels.items()}


def in_frame(pose: FloatArray, points: FloatArray) -> FloatArray:
    """Return points ``(..., 2)`` ahead and to the left of a pose."""
    turned = np.exp(-1j * pose[2]) * ((points[..., 0] - pose[0]) + 1j * (points[..., 1] - pose[1]))
    return np.stack([turned.real, turned.imag], axis=-1)


def test_infrared_against_points_along_the_rays() -> None:
    """Any number of rays: the first of many points on each that is in something."""
    yaws = np.round(np.linspace(-180, 171, 37), 1)
    config = world(
        f"sensors.infrared_yaw_deg={yaws.tolist()}",
        "sensors.infrared_target=all",
        "sensors.infrared_curve=[[0, 100], [0.1, 50]]",
        sensors="[infrared]",
    )
    step = 1e-4
    ways = np.arange(0, 0.1, step)
    seen = still(config, episodes=40)
    met = 0
    for poses, box, readings in zip(seen["pose"], seen["box"], seen["observation"], strict=True):
        for i, pose in enumerate(poses):
            bearing = pose[2] + np.radians(yaws)
            towards = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
            points = pose[:2] + (RADIUS + ways)[:, None, None] * towards  # (ways, rays, 2)
            inside = np.abs(points).max(axis=-1) >= HALF_ARENA
            inside |= (np.abs(in_frame(box, points)) <= HALF_BOX).all(axis=-1)
            for other in np.delete(poses, i, axis=0):
                inside |= np.linalg.norm(points - other[:2], axis=-1) <= RADIUS
            expected = np.where(inside.any(axis=0), 1 - ways[inside.argmax(axis=0)] * 5, 0)
            clear = np.abs(expected - readings[i]) > 5 * 2 * step  # a ray that grazes, or just ends
            met += int((expected > 0).sum())
            assert clear.mean() <= 0.03
    assert met > 1000


def test_touch_sectors_of_any_number() -> None:
    config = world(
        "sensors.touch_yaw_deg=[80, 40, 0, -40, -80, 180]",
        "sensors.touch_half_width_deg=20",
        "sensors.touch_range=0.15",
        sensors="[touch]",
    )
    edge = np.linspace(-1, 1, 4001)[:, None] * np.array(HALF_BOX)
    ones = np.ones(len(edge))
    outline = np.concatenate(
        [
            np.stack(side, axis=-1)
            for x, y in [(edge[:, 0], edge[:, 1])]
            for side in (
                (x, HALF_BOX[1] * ones),
                (x, -HALF_BOX[1] * ones),
                (HALF_BOX[0] * ones, y),
                (-HALF_BOX[0] * ones, y),
            )
        ]
    )
    seen = still(config, episodes=100)
    touched = 0
    for poses, box, readings in zip(seen["pose"], seen["box"], seen["observation"], strict=True):
        points = np.exp(1j * box[2]) * (outline[:, 0] + 1j * outline[:, 1])
        points = np.stack([points.real, points.imag], axis=-1) + box[:2]
        for pose, reading in zip(poses, readings, strict=True):
            nearest = in_frame(pose, points)[np.linalg.norm(points - pose[:2], axis=-1).argmin()]
            gap, bearing = np.linalg.norm(nearest) - RADIUS, np.degrees(np.arctan2(nearest[1], nearest[0]))
            off = np.abs((bearing - np.array([80, 40, 0, -40, -80, 180]) + 180) % 360 - 180)
            if abs(gap - 0.15) < 1e-4 or np.abs(off - 20).min() < 0.3:
                continue
            assert np.array_equal(reading > 0, (off < 20) & (gap < 0.15))
            touched += int(reading.max() > 0)
    assert touched > 30


def test_the_bearing_of_the_emitter() -> None:
    seen = still(world("emitter.range=0.5", sensors="[rf_bearing]"))
    source = np.array([0.0, 0.345, 0.03])
    away = source[:2] - seen["pose"][..., :2]
    heard = np.hypot(np.linalg.norm(away, axis=-1), 0.05 - source[2]) <= 0.5
    bearing = np.arctan2(away[..., 1], away[..., 0]) - seen["pose"][..., 2]
    expected = np.where(heard[..., None], np.stack([np.cos(bearing), np.sin(bearing)], axis=-1), 0)
    np.testing.assert_allclose(seen["observation"], expected, atol=1e-12)
    assert 0.2 < heard.mean() < 0.8
    everywhere = still(world("emitter.reach=arena", sensors="[rf_bearing]"))["observation"]
    np.testing.assert_allclose(np.linalg.norm(everywhere, axis=-1), 1)


@pytest.mark.parametrize("sectors", [1, 3, 4, 12])
def test_the_nearest_robot_in_each_sector(sectors: int) -> None:
    seen = still(
        world(
            "sensors.range_and_bearing_range=0.4",
            f"sensors.range_and_bearing_sectors={sectors}",
            sensors="[range_and_bearing]",
        )
    )
    for poses, readings in zip(seen["pose"], seen["observation"], strict=True):
        for i, pose in enumerate(poses):
            others = in_frame(pose, np.delete(poses, i, axis=0)[:, :2])
            distance, degrees = np.linalg.norm(others, axis=-1), np.degrees(np.arctan2(others[:, 1], others[:, 0]))
            for sector in range(sectors):
                off = np.abs((degrees - 360 * sector / sectors + 180) % 360 - 180)
                near = distance[(off < 180 / sectors) & (distance <= 0.4)]
                assert readings[i, sector] == pytest.approx(1 - near.min() / 0.4 if len(near) else 0, abs=1e-12)
    assert (seen["observation"] > 0).mean() > 0.1


def test_messages_are_those_that_the_nearest_robots_sent_a_step_before() -> None:
    scene = Scene(
        world(
            "sensors.range_and_bearing_range=0.5",
            "sensors.range_and_bearing_sectors=6",
            "sensors.range_and_bearing_message=3",
            sensors="[odometry, range_and_bearing]",
            seconds=2.0,
        )
    )
    rng = np.random.default_rng(3)
    assert scene.info.command_names == ("left", "right", "message_0", "message_1", "message_2")
    seen = steered(scene, lambda _: rng.uniform(-1, 1, (4, 8, 5)))
    sent = seen["command"][..., 2:] > 0  # the last command is in the state that follows
    received = seen["observation"][..., 2:].reshape(*seen["observation"].shape[:3], 6, 4)
    assert not received[:, 0, ..., 1:].any()
    heard = 0
    for world_number, step in np.ndindex(4, len(sent[0]) - 1):
        poses = seen["pose"][world_number, step + 1]
        for i, pose in enumerate(poses):
            others = in_frame(pose, poses[:, :2])
            distance, turn = np.linalg.norm(others, axis=-1), np.arctan2(others[:, 1], others[:, 0])
            for sector in range(6):
                off = np.abs((np.degrees(turn) - 60 * sector + 180) % 360 - 180)
                there = [k for k in np.argsort(distance) if k != i and off[k] < 30 and distance[k] <= 0.5]
                expected = sent[world_number, step + 1, there[0]] if there else np.zeros(3)
                assert np.array_equal(received[world_number, step + 1, i, sector, 1:], expected)
                heard += bool(there)
    assert heard > 500
    assert np.array_equal(seen["message"][:, 1:], sent[:, 1:])


def test_a_message_is_recorded_with_the_command_that_sends_it() -> None:
    config = world("sensors.range_and_bearing_message=1", sensors="[range_and_bearing]", seconds=1.0)
    outputs = np.array([[[0.0], [0.0], [0.5]]])
    speaking = FeedForward(np.zeros((1, 0, 9)), outputs, np.zeros((1, 0), dtype=bool))
    telemetry = simulate(
        Scene(config), speaking, [EpisodeKey(1, 0, 0, 0)], channels=["message", "observation"]
    ).telemetry
    assert telemetry.message.shape == (1, 10, 8, 1)
    assert np.all(telemetry.message == 1)
    assert not telemetry.observation[0, 0, :, 1::2].any()
    assert np.array_equal(telemetry.observation[0, 1:, :, 1::2] > 0, telemetry.observation[0, 1:, :, ::2] > 0)


@pytest.mark.parametrize(("drive", "near"), [("driven_contacts", 1e-12), ("articulated", 0.02)])
def test_odometry_is_how_fast_the_wheels_turned(drive: str, near: float) -> None:
    step = 0.004 if drive == "articulated" else 0.05
    scene = Scene(world(f"physics.drive={drive}", f"physics.time_step={step}", sensors="[odometry]", seconds=2.0))
    rng = np.random.default_rng(4)
    commands = np.repeat(rng.uniform(-0.5, 0.5, (4, 8, 2)), 1, axis=0)
    seen = steered(scene, lambda _: commands)
    assert not seen["observation"][:, 0].any()
    np.testing.assert_allclose(seen["observation"][:, 10:], np.repeat(commands[:, None], 11, axis=1), atol=near)


def test_the_motion_of_the_touched_box_is_the_slope_of_its_pose() -> None:
    """Three robots push the box aside, two look on from afar and one from behind."""
    poses = [[x, 0.07 - 0.07, np.pi / 2] for x in (-0.04, 0.04, 0.12)]
    poses += [[-0.4, -0.4, 0.0], [0.4, -0.4, 0.0], [0.0, -0.4, 0.0], [0.2, -0.4, 1.0], [-0.2, -0.4, 1.0]]
    config = world(
        "team.start=poses",
        f"team.start_poses={poses}",
        "box.pose=[0, 0.13, 0]",
        "episode.control_period=0.01",
        "physics.time_step=0.01",
        "emitter.reach=arena",
        sensors="[movable_motion]",
        seconds=2.5,
    )
    seen = steered(Scene(config), lambda _: np.array([0.8] * 2), worlds=1)
    box, pose, readings = seen["box"][0], seen["pose"][0], seen["observation"][0]
    velocity = (box[2:] - box[:-2]) / 0.02
    fastest = 6.28 * 0.0205
    scales = np.array([fastest, fastest, 2 * fastest / 0.053])
    moving = 0
    for step in range(60, len(box) - 1):
        for i in range(8):
            if not readings[step, i].any():
                continue
            ahead = np.exp(-1j * pose[step, i, 2]) * (velocity[step - 1, 0] + 1j * velocity[step - 1, 1])
            expected = np.array([ahead.real, ahead.imag, velocity[step - 1, 2]]) / scales
            np.testing.assert_allclose(readings[step, i], expected, atol=0.02)
            moving += abs(expected[0]) > 0.1
    assert moving > 100
    assert not readings[:, 3:5].any()


def test_the_grey_of_the_patch_on_top() -> None:
    patches = [
        "{shape: box, size: [0.4, 0.2], pose: [-0.2, -0.1, 0.5], grey: 0.25}",
        "{shape: cylinder, size: [0.3, 0.3], pose: [-0.1, -0.1, 0.0], grey: 0.75}",
    ]
    config = world(
        "sensors.ground_position=[[0.03, 0.01], [0.03, -0.01], [-0.02, 0]]",
        f"scene.patches=[{', '.join(patches)}]",
        "scene.grey=0.5",
        sensors="[ground]",
    )
    seen = still(config)
    for pose, readings in zip(seen["pose"].reshape(-1, 3), seen["observation"].reshape(-1, 3), strict=True):
        places = (
            np.array([[0.03, 0.01], [0.03, -0.01], [-0.02, 0]]) @ [1, 1j] * np.exp(1j * pose[2])
            + pose[0]
            + 1j * pose[1]
        )
        turned = (places + 0.2 + 0.1j) * np.exp(-0.5j)
        on_box = (np.abs(turned.real) <= 0.2) & (np.abs(turned.imag) <= 0.1)
        on_disc = np.abs(places + 0.1 + 0.1j) <= 0.15
        assert np.array_equal(readings, np.where(on_disc, 0.75, np.where(on_box, 0.25, 0.5)))
    assert len(np.unique(seen["observation"])) == 3


def test_the_brightest_light_in_each_sector() -> None:
    lights = [
        "{channel: light, position: [0.3, 0, 0.1], range: 0.6, strength: [0, 40]}",
        "{channel: light, position: [-0.3, -0.2, 0.1], range: 0.6, strength: [0, 20]}",
        "{channel: rf, position: [0, 0, 0.1], range: 0.3, strength: [1, 50]}",
    ]
    config = world(f"scene.emitters=[{', '.join(lights)}]", "sensors.light_sectors=6", sensors="[rf, light]")
    seen = still(config)
    places = np.array([[0.3, 0.0], [-0.3, -0.2]])
    for pose, readings in zip(seen["pose"].reshape(-1, 3), seen["observation"].reshape(-1, 7), strict=True):
        own = in_frame(pose, places)
        squared = (own**2).sum(axis=-1) + 0.05**2
        bright = np.where(squared <= 0.36, np.minimum(1 / squared, [40, 20]) / [40, 20], 0)
        degrees = np.degrees(np.arctan2(own[:, 1], own[:, 0]))
        for sector in range(6):
            there = bright[np.abs((degrees - 60 * sector + 180) % 360 - 180) < 30]
            assert readings[1 + sector] == pytest.approx(there.max(initial=0), abs=1e-12)
        from_rf = (pose[:2] ** 2).sum() + 0.05**2  # and a light is no signal
        assert readings[0] == pytest.approx((min(1 / from_rf, 50) if from_rf <= 0.09 else 1) / 50)
    assert (seen["observation"][..., 1:] > 0).mean() > 0.1


def test_each_channel_has_readings_of_its_own() -> None:
    """Of the strongest emitter on it, over what that channel's emitters give at most, and from where."""
    emitters = [
        "{channel: light, position: [0, 0, 0.1], range: 5, strength: [0, 900]}",
        "{channel: home, position: [0.3, 0, 0.1], range: 0.6, strength: [1, 40]}",
        "{channel: prey, position: [-0.3, -0.2, 0.1], range: 0.4, strength: [2, 5000]}",
        "{channel: prey, position: [0.2, 0.3, 0.1], range: 0.4, strength: [2, 60]}",
    ]
    config = world(f"scene.emitters=[{', '.join(emitters)}]", sensors="[rf, rf_bearing]")
    names = ("rf", "rf_prey", *(f"rf_bearing{of}_{part}" for of in ("", "_prey") for part in ("cos", "sin")))
    assert Scene(config).info.observation_names == names
    seen = still(config)
    places = np.array([[0.3, 0.0], [-0.3, -0.2], [0.2, 0.3]])
    least, most, reach = np.array([1, 2, 2]), np.array([40, 5000, 60]), np.array([0.6, 0.4, 0.4])
    for pose, readings in zip(seen["pose"].reshape(-1, 3), seen["observation"].reshape(-1, 6), strict=True):
        own = in_frame(pose, places)
        away = np.sqrt((own**2).sum(axis=-1) + 0.05**2)
        strengths = np.where(away <= reach, np.clip(1 / away**2, least, most), least)
        np.testing.assert_allclose(readings[:2], [strengths[0] / 40, strengths[1:].max() / 5000])
        for bearing, channel in ((readings[2:4], [0]), (readings[4:6], [1, 2])):
            heard = [i for i in channel if away[i] <= reach[i]]
            towards = own[min(heard, key=lambda i: away[i])] if heard else np.zeros(2)
            np.testing.assert_allclose(bearing, towards / max(np.hypot(*towards), 1e-300), atol=1e-12)
    assert (seen["observation"][..., [2, 4]] == 0).any(axis=(0, 1, 2)).all()
    assert (seen["observation"][..., [2, 4]] != 0).any(axis=(0, 1, 2)).all()


def test_no_channel_has_the_name_of_anothers_bearing() -> None:
    with pytest.raises(ConfigError, match=r"^scene\.emitters\[1\]\.channel: expected a name that does not begin with"):
        world("scene.emitters=[{}, {channel: bearing_cos}]", sensors="[rf, rf_bearing]")


def test_the_last_of_the_most_channels_is_no_light() -> None:
    emitters = [f"{{channel: rf{i}, position: [0, 0, 0.1], range: 10, strength: [0, {i + 1}]}}" for i in range(16)]
    seen = still(world(f"scene.emitters=[{', '.join(emitters)}]", sensors="[rf, light]"))["observation"]
    assert (seen[..., :16] > 0).all()
    assert (seen[..., 16:] == 0).all()


@pytest.mark.parametrize(
    ("device", "noise", "size"),
    [
        ("ground", "ground", 0.05),
        ("range_and_bearing", "range_and_bearing", 0.05),
        ("rf_bearing", "rf_bearing", 0.1),
    ],
)
def test_noise_has_its_spread(device: str, noise: str, size: float) -> None:
    settings = ("emitter.reach=arena", "sensors.range_and_bearing_sectors=1", "sensors.range_and_bearing_range=5")
    exact = still(world(*settings, sensors=f"[{device}]"))["observation"]
    noisy = still(world(*settings, f"noise.{noise}={size}", sensors=f"[{device}]"))["observation"]
    if device == "rf_bearing":
        turn = np.angle((noisy[..., 0] + 1j * noisy[..., 1]) / (exact[..., 0] + 1j * exact[..., 1]))
        assert turn.std() == pytest.approx(size, rel=0.1)
    elif device == "range_and_bearing":
        assert ((1 - noisy) / (1 - exact) - 1).std() == pytest.approx(size, rel=0.1)
    else:  # half of it is cut off above white
        assert (noisy < 1).mean() == pytest.approx(0.5, abs=0.06)
        assert np.sqrt(((noisy - 1)[noisy < 1] ** 2).mean()) == pytest.approx(size, rel=0.1)
        assert len(np.unique(noisy)) > 100


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("sensors.range_and_bearing_range=0", "expected a number from 0.01 to 100"),
        ("sensors.range_and_bearing_sectors=33", "expected a whole number from 1 to 32"),
        ("sensors.range_and_bearing_message=17", "expected a whole number from 0 to 16"),
        ("sensors.ground_position=[[0, .nan]]", "sensors.ground_position"),
        ("sensors.ground_position=[]", "expected a list of 1 to 8 lists of 2 numbers from -1 to 1"),
        ("noise.odometry=.nan", "noise.odometry"),
    ],
)
def test_settings_that_cannot_be_are_refused(override: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        load("paper", [override])
