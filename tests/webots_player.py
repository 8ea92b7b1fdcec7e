# SPDX-License-Identifier: BSD-3-Clause
"""Plays a recorded episode to a controller for Webots: headers and mock to compile it with, and what devices return.

Written from Webots' reference manual: strengths and directions are computed from poses.
"""

from __future__ import annotations

import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from swarmevo import simulation
from swarmevo.config import Config
from swarmevo.plugins.team import Team
from swarmevo.protocols import FloatArray
from swarmevo.runs.webots.tables import EPUCK
from swarmevo.simulation import EpisodeKey

HEADERS = {
    "types.h": "typedef unsigned short WbDeviceTag;",
    "device.h": "typedef int WbNodeType; const char *wb_device_get_name(WbDeviceTag tag);\n"
    "WbNodeType wb_device_get_node_type(WbDeviceTag tag);",
    "distance_sensor.h": "void wb_distance_sensor_enable(WbDeviceTag tag, int sampling_period);\n"
    "double wb_distance_sensor_get_value(WbDeviceTag tag);",
    "emitter.h": "int wb_emitter_send(WbDeviceTag tag, const void *data, int size);",
    "motor.h": "void wb_motor_set_position(WbDeviceTag tag, double position);\n"
    "void wb_motor_set_velocity(WbDeviceTag tag, double velocity);",
    "nodes.h": "enum { WB_NODE_EMITTER = 7 };",
    "position_sensor.h": "void wb_position_sensor_enable(WbDeviceTag tag, int sampling_period);\n"
    "double wb_position_sensor_get_value(WbDeviceTag tag);",
    "receiver.h": "void wb_receiver_enable(WbDeviceTag tag, int sampling_period);\n"
    "int wb_receiver_get_queue_length(WbDeviceTag tag); void wb_receiver_next_packet(WbDeviceTag tag);\n"
    "const void *wb_receiver_get_data(WbDeviceTag tag); int wb_receiver_get_data_size(WbDeviceTag tag);\n"
    "double wb_receiver_get_signal_strength(WbDeviceTag tag);\n"
    "const double *wb_receiver_get_emitter_direction(WbDeviceTag tag);",
    "robot.h": "int wb_robot_init(void); int wb_robot_step(int duration); void wb_robot_cleanup(void);\n"
    "WbDeviceTag wb_robot_get_device(const char *name); double wb_robot_get_basic_time_step(void);\n"
    "double wb_robot_get_time(void); int wb_robot_get_number_of_devices(void);\n"
    "WbDeviceTag wb_robot_get_device_by_index(int index);",
    "touch_sensor.h": "void wb_touch_sensor_enable(WbDeviceTag tag, int sampling_period);\n"
    "double wb_touch_sensor_get_value(WbDeviceTag tag);",
}


def build(folder: Path) -> Path:
    """Write Webots' headers to a folder, compile the mock there, and return the folder."""
    (folder / "webots").mkdir()
    for name, declarations in HEADERS.items():
        text = declarations if name == "types.h" else f"#include <webots/types.h>\n{declarations}"
        guard = f"WB_{name.removesuffix('.h').upper()}"
        (folder / "webots" / name).write_text(f"#ifndef {guard}\n#define {guard}\n{text}\n#endif\n")
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("needs a C compiler")
    subprocess.run(
        [compiler, "-O1", "-w", "-I.", "-c", str(Path(__file__).with_name("mock_webots.c")), "-o", "mock.o"],
        cwd=folder,
        check=True,
    )
    return folder


def compiled(program: Path, mock: Path) -> Path:
    flags = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O1", "-ffp-contract=off", f"-I{mock}"]
    command = ["gcc", *flags, str(program), str(mock / "mock.o"), "-o", str(program.with_suffix("")), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return program.with_suffix("")


def recorded(config: Config, genome: FloatArray) -> dict[str, FloatArray]:
    """Return what the simulator's robots observed and commanded in an episode, by channel ``(steps, ...)``."""
    team = Team(config)
    robots = np.arange(config.team.robots)[np.newaxis] if config.team.has_own_genomes else None
    policies = team.policies(genome)
    assert policies is not None
    channels = ("pose", "movables", "observation", "command")
    done = simulation.simulate(team.scene, policies, [EpisodeKey(3, 0, 0, 0)], robots, channels)
    return {name: done.telemetry.channels[name][0] for name in channels}


class Robot:
    """What the devices of one robot return at one control step."""

    def __init__(
        self, config: Config, told: dict[str, FloatArray], robot: int, devices: list[str], infrared: str
    ) -> None:
        self.config, self.told, self.robot, self.devices, self.infrared = config, told, robot, devices, infrared
        self.angles = [0.0, 0.0]
        self.names = simulation.Scene(config).info.observation_names

    def frame(self, step: int) -> str:
        seen = dict(zip(self.names, self.told["observation"][step, self.robot].tolist(), strict=True))
        lines = []
        for name, reading in seen.items():
            device, _, number = name.rpartition("_")
            if device == "infrared":
                lines.append(self._value(f"ps{number}", self._raw(reading)))
            if device == "touch":
                lines.append(self._value(f"ts{number}", reading))
            if device == "ground":
                lines.append(self._value(f"gs{number}", 1000 * reading))
            if device == "odometry":
                wheel, speed = ("left", "right").index(number), reading * self.config.robot.top_speed
                self.angles[wheel] += speed * self.config.episode.control_period
                lines.append(self._value(f"{number} wheel sensor", self.angles[wheel]))
        return "\n".join([*lines, *self._signals(step), *self._messages(step), "."])

    def _value(self, name: str, value: float) -> str:
        return f"v {self.devices.index(name) + 1} {value!r}"

    def _raw(self, reading: float) -> float:
        """Return what a sensor says where ours reads so."""
        curve = np.array(self.config.sensors.infrared_curve)
        if self.infrared == "evolved":
            return float(reading * curve[0, 1])
        distance = np.interp(-reading, -curve[:, 1] / curve[0, 1], curve[:, 0]) if reading else 1.0
        table = np.array(EPUCK[self.infrared])
        return float(np.interp(distance, table[:, 0], table[:, 1]))

    def _heard(
        self, step: int, place: tuple[float, float, float], reach: float, receiver: str, data: list[int]
    ) -> list[str]:
        """Return the packet that a receiver on the robot's roof gets from a place, if it is in range."""
        if receiver not in self.devices:
            return []
        x, y, heading = self.told["pose"][step, self.robot].tolist()
        dx, dy, dz = place[0] - x, place[1] - y, place[2] - self.config.robot.height
        r = math.sqrt(dx * dx + dy * dy + dz * dz)
        if 0 <= reach < r:
            return []
        ahead, left = math.cos(heading) * dx + math.sin(heading) * dy, math.cos(heading) * dy - math.sin(heading) * dx
        values = [1 / r**2, ahead / r, left / r, dz / r]
        packet = " ".join(map(repr, values)) + f" {len(data)} " + " ".join(map(str, data))
        return [f"p {self.devices.index(receiver) + 1} {packet}"]

    def _signals(self, step: int) -> list[str]:
        lines = []
        emitters = self.config.scene.emitters or [self.config.emitter]
        for number, emitter in enumerate(emitters):
            x, y, z = emitter.position
            if emitter.rides_on is not None:
                at_x, at_y, heading = self.told["movables"][step, emitter.rides_on].tolist()
                x, y = (
                    at_x + math.cos(heading) * x - math.sin(heading) * y,
                    at_y + math.sin(heading) * x + math.cos(heading) * y,
                )
            reach = emitter.range if emitter.reach == "range" else -1.0
            receiver = {"rf": "receiver", "light": "light receiver"}.get(emitter.channel, "none")
            lines += self._heard(step, (x, y, z), reach, receiver, [number])
        return lines

    def _messages(self, step: int) -> list[str]:
        lines, height = [], self.config.robot.height
        for other, (x, y, _) in enumerate(self.told["pose"][step].tolist()):
            if other != self.robot:
                bits = (self.told["command"][step - 1, other, 2:] > 0) if step else np.zeros(2, bool)
                data = [other, *map(int, bits)]
                reach = self.config.sensors.range_and_bearing_range
                lines += self._heard(step, (x, y, height), reach, "range and bearing receiver", data)
        return lines
