# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import contextlib
import copy
import ctypes
import itertools
import math
import os
import pickle
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin

import annotated_types
import numpy as np
import pytest
from numpy.typing import NDArray

from forks import in_a_fork
from swarmevo import simulation
from swarmevo.config import Config, Team
from swarmevo.config.models import Device
from swarmevo.errors import InvalidArgument
from swarmevo.protocols import CHANNELS, Compiled, FeedForward, FloatArray, SceneInfo
from swarmevo.simulation import EpisodeKey, Scene, simulate, simulate_lockstep
from swarmevo.simulation._ffi import load

WORLD = ("arena", "box", "emitter", "robot", "sensors", "noise", "physics", "episode")
FIXTURE = Path(__file__).parents[2] / "native" / "tests" / "fixture.hpp"


def changed(section: str, **values: Any) -> Config:
    """Return the default config with some keys of one section changed, pydantic's ranges left aside."""
    config = Config()
    part = getattr(config, section).model_copy(update=values)
    return config.model_copy(update={section: part})


def short(horizon: float = 5.0) -> Config:
    return changed("episode", horizon=horizon)


def networks(n: int, seed: int = 0) -> FeedForward:
    rng = np.random.default_rng(seed)
    return FeedForward(rng.normal(size=(n, 15, 14)), rng.normal(size=(n, 2, 16)), rng.random((n, 15)) < 0.5)


def keys(n: int) -> list[EpisodeKey]:
    return [EpisodeKey(seed=3, trial=0, generation=0, repeat=i) for i in range(n)]


def cloned(n: int, robots: int = 5) -> NDArray[np.uint32]:
    return np.repeat(np.arange(n, dtype=np.uint32)[:, None], robots, axis=1)


# ---- the config and the library say the same -------------------------------------------------------------------------


class Number(NamedTuple):
    """A number of the config, in a section or in a list there: ``box.size[0]``."""

    section: str
    name: str
    indices: tuple[int, ...]
    kind: type
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.section}.{self.name}" + "".join(f"[{i}]" for i in self.indices)

    def set(self, value: float) -> Config:
        """Return the default config with another value here."""

        def replaced(entries: Any, indices: tuple[int, ...]) -> Any:
            if not indices:
                return value
            i, *deeper = indices
            return (*entries[:i], replaced(entries[i], tuple(deeper)), *entries[i + 1 :])

        default = getattr(getattr(Config(), self.section), self.name)
        return changed(self.section, **{self.name: replaced(default, self.indices)})


def numbers_in(annotation: Any, metadata: Sequence[Any], value: Any, indices: tuple[int, ...] = ()) -> Iterator[Any]:
    """Yield indices, type and range of each number of ``value``, which is of the type ``annotation``."""
    if get_origin(annotation) is Annotated:
        annotation, *fields = get_args(annotation)
        metadata = [entry for field in fields for entry in field.metadata]
    if annotation in (float, int):
        (low,) = [entry.ge for entry in metadata if isinstance(entry, annotated_types.Ge)]
        (high,) = [entry.le for entry in metadata if isinstance(entry, annotated_types.Le)]
        yield indices, annotation, float(low), float(high)
    elif get_origin(annotation) is tuple:
        kinds = get_args(annotation)
        kinds = kinds[:1] * len(value) if Ellipsis in kinds else kinds
        for i, (kind, entry) in enumerate(zip(kinds, value, strict=True)):
            yield from numbers_in(kind, [], entry, (*indices, i))


# Rows become poses before the library sees them, regions must be within the arena; test_scene.py has the sides.
# The library takes no bits below 0: their type is unsigned.
NOT_COMPARED = [
    "team.row_y",
    "team.row_spacing",
    "team.start_region",
    "box.start_region",
    "arena.sides",
    "sensors.range_and_bearing_message",
]

NUMBERS = [
    Number(section, name, *found)
    for section in (*WORLD, "team")
    for name, field in type(getattr(Config(), section)).model_fields.items()
    if f"{section}.{name}" not in NOT_COMPARED
    for found in numbers_in(field.annotation, field.metadata, getattr(getattr(Config(), section), name))
]


def test_every_number_of_the_world_has_its_range_compared() -> None:
    def count(value: Any) -> int:
        if isinstance(value, tuple):
            return sum(map(count, value))
        return isinstance(value, float | int)

    sections = [getattr(Config(), section) for section in (*WORLD, "team")]
    there = sum(count(value) for section in sections for _, value in section)
    assert len(NUMBERS) == there - 13  # those of NOT_COMPARED


@pytest.mark.parametrize("number", NUMBERS, ids=str)
def test_ranges_of_config_and_library_are_the_same(number: Number) -> None:
    def refused(value: float) -> bool:
        return any(line.startswith(f"{number}: expected {span}") for line in simulation.scene_errors(number.set(value)))

    span = f"{number.low:.10g} to {number.high:.10g}"
    if number.kind is int:
        below, above = number.low - 1, number.high + 1
    else:
        below, above = math.nextafter(number.low, -math.inf), math.nextafter(number.high, math.inf)
    assert refused(number.kind(below))
    assert refused(number.kind(above))
    assert not refused(number.kind(number.low))
    assert not refused(number.kind(number.high))
    assert number.kind is int or refused(math.nan)


CHOICES = [
    (section, name, choice)
    for section in (*WORLD, "team")
    for name, field in type(getattr(Config(), section)).model_fields.items()
    if get_origin(field.annotation) is Literal and (section, name) != ("team", "genomes")  # evaluation's business
    for choice in get_args(field.annotation)
]


@pytest.mark.parametrize(("section", "name", "choice"), CHOICES)
def test_the_library_knows_every_choice(section: str, name: str, choice: str) -> None:
    complaints = simulation.scene_errors(changed(section, **{name: choice}))
    assert not [line for line in complaints if line.startswith(f"{section}.{name}: not set")]


def test_native_fixture_has_the_defaults() -> None:
    config, text = Config(), FIXTURE.read_text()

    def numbers(pattern: str) -> list[float]:
        match = re.search(pattern, text)
        assert match is not None, pattern
        return [float(number) for number in re.findall(r"-?\d*\.?\d+(?:e-?\d+)?", match.group(1))]

    def values(section: Any) -> list[float]:
        return [value for value in section.model_dump().values() if isinstance(value, float)]

    assert numbers(r"config\.arena\.size\[1\] = (.*);") == [config.arena.size]
    assert numbers(r"config\.arena\.wall_height = (.*);") == [config.arena.wall_height]
    assert numbers(r"SWE_SHAPE_BOX,((?:.|\n)*?)SWE_START_POSES") == [
        *config.box.size,
        config.box.mass,
        config.physics.box_friction,
        config.box.feet,
        *config.box.pose,
        *config.box.velocity,
    ]
    assert numbers(r"config\.emitters\[0\] = {0, SWE_NOTHING, (.*), SWE") == [
        *config.emitter.position,
        config.emitter.range,
        *config.emitter.strength,
    ]
    assert numbers(r"config\.robot = {((?:.|\n)*?), SWE") == values(config.robot)
    assert numbers(r"yaws\[\] = {(.*)};") == list(config.sensors.infrared_yaw_deg)
    assert numbers(r"curve\[\]\[2\] = {((?:.|\n)*?)};") == [x for point in config.sensors.infrared_curve for x in point]
    assert numbers(r"touch\[\] = {(.*)};") == list(config.sensors.touch_yaw_deg)
    assert numbers(r"config\.noise = {(.*)};") == values(config.noise)
    rest = config.physics.model_copy(update={"box_friction": None})  # the box has it
    assert numbers(r"config\.physics = {(.*)};") == values(rest)
    assert numbers(r"config\.episode = {(.*)};") == values(config.episode)


# ---- scenes ----------------------------------------------------------------------------------------------------------


def test_scene_tells_robots_and_steps() -> None:
    info = Scene(Config()).info
    assert (info.robots, info.control_steps, info.control_period) == (5, 1800, 0.1)


def test_a_scene_tells_what_the_library_has() -> None:
    """Also where the horizon is no exact number of control periods in binary."""
    lib = load()[1]
    for horizon, period, robots in ((180.0, 0.1, 5), (0.3, 0.1, 1), (1000.1, 0.1, 3), (0.15, 0.05, 2)):
        settings = changed("episode", horizon=horizon, control_period=period)
        scene = Scene(settings.model_copy(update={"team": Team(robots=robots)}))
        assert scene.info.control_steps == lib.swe_scene_control_steps(scene._handle)
        assert scene.info.robots == lib.swe_scene_robots(scene._handle)


def test_every_error_of_a_world_is_listed() -> None:
    config = changed(
        "team", start="poses", start_poses=((0.0, -0.4, 0.0), (0.01, -0.4, 0.0), (0.6, 0.0, 0.0)), robots=3
    )
    lines = simulation.scene_errors(config)
    assert any("start_poses[1]" in line and "robot 0" in line for line in lines)
    assert any("start_poses[2]" in line and "inside the arena" in line for line in lines)
    assert simulation.scene_errors(Config()) == []


@pytest.mark.parametrize(
    ("section", "values", "expected"),
    [
        ("box", {"size": (0.01, 0.2, 0.02)}, "box.size: expected one that slides before it tips"),
        ("box", {"size": (1.2, 0.2, 0.02)}, "box.pose: expected it inside the arena"),
        ("robot", {"wheel_radius": 0.026}, "robot.wheel_radius: expected at most half of robot.height"),
        ("robot", {"axle_length": 0.06}, "robot.axle_length: expected wheels within the body"),
        ("robot", {"caster_clearance": 0.004}, "robot.caster_clearance: expected at most a tenth"),
        ("robot", {"centre_of_mass": 0.03}, "robot.centre_of_mass: expected at most 0.0265 m"),
        ("physics", {"wheel_friction": 4.0}, "robot.centre_of_mass: expected at most 0.006625 m"),
        ("team", {"start": "random", "start_region": (-0.1, 0.1, 0.3, 0.4)}, "team.start_region: expected a place"),
    ],
)
def test_sizes_that_do_not_fit_together_are_one_line(section: str, values: dict[str, Any], expected: str) -> None:
    (line,) = simulation.scene_errors(changed(section, **values))
    assert line.startswith(expected)
    assert re.search(r", got .*\d", line)


def test_number_of_poses_must_fit() -> None:
    assert "one pose for each of 5 robots, got 0" in simulation.scene_errors(changed("team", start="poses"))[0]


@pytest.mark.parametrize(
    ("robots", "size", "rows"),
    [
        (1, 1.0, [1]),
        (2, 1.0, [2]),
        (5, 1.0, [5]),
        (7, 1.0, [7]),
        (8, 1.0, [7, 1]),
        (20, 1.0, [7, 7, 6]),
        (64, 3.0, [24, 24, 16]),
    ],
)
def test_robots_start_in_centred_rows(robots: int, size: float, rows: list[int]) -> None:
    team = Config().team.model_copy(update={"robots": robots})
    poses = simulation.start_poses(team, width=size)
    assert poses.shape == (robots, 3)
    assert np.all(poses[:, 2] == -np.pi / 2)
    for row, members in zip(np.split(poses, np.cumsum(rows)[:-1]), rows, strict=True):
        assert len(row) == members
        np.testing.assert_allclose(row[:, 0].mean(), 0, atol=1e-12)
        np.testing.assert_allclose(np.diff(row[:, 0]), team.row_spacing)
    fronts = poses[np.cumsum([0, *rows[:-1]]), 1]
    np.testing.assert_allclose(fronts, team.row_y + team.row_spacing * np.arange(len(rows)))
    np.testing.assert_allclose(poses[:, 1], np.repeat(fronts, rows))


# ---- episodes --------------------------------------------------------------------------------------------------------


def test_same_bits_on_any_number_of_threads_in_any_order_and_division() -> None:
    scene, policies = Scene(short()), networks(12)
    reference = simulate(scene, policies, keys(12), cloned(12), CHANNELS)
    for threads in (0, 2, 8):
        assert np.array_equal(simulate(scene, policies, keys(12), cloned(12), (), threads).hash, reference.hash)
    backwards = simulate(scene, policies, keys(12)[::-1], cloned(12)[::-1], CHANNELS, 2)
    assert np.array_equal(backwards.hash[::-1], reference.hash)
    for name in CHANNELS:
        assert np.array_equal(getattr(backwards.telemetry, name)[::-1], getattr(reference.telemetry, name))
    pieces = [simulate(scene, policies, keys(12)[i : i + 5], cloned(12)[i : i + 5]).hash for i in (0, 5, 10)]
    assert np.array_equal(np.concatenate(pieces), reference.hash)


def test_telemetry_has_its_shapes_and_only_what_was_asked_for() -> None:
    scene = Scene(short(1.0))
    telemetry = simulate(scene, networks(2), keys(2), cloned(2), ["pose", "rf"]).telemetry
    assert telemetry.pose.shape == (2, 10, 5, 3)
    assert telemetry.rf.shape == (2, 10, 5)
    assert set(telemetry.channels) == {"pose", "rf"}
    assert telemetry.homing_time.shape == (2, 5)
    with pytest.raises(InvalidArgument, match="got smell"):
        simulate(scene, networks(2), keys(2), cloned(2), ["smell"])


def test_by_default_policy_i_drives_the_team_of_episode_i() -> None:
    scene = Scene(short(1.0))
    by_hand = simulate(scene, networks(3), keys(3), cloned(3))
    assert np.array_equal(simulate(scene, networks(3), keys(3)).hash, by_hand.hash)


def test_mixed_team_uses_every_robots_own_policy() -> None:
    scene = Scene(short(1.0))
    still, moving = np.zeros((15, 14)), np.zeros((15, 14))
    output = np.zeros((2, 2, 16))
    output[1, :, 15] = 3.0  # bias alone: full speed
    policies = FeedForward(np.stack([still, moving]), output, np.zeros((2, 15), dtype=bool))
    drivers = np.array([[0, 1, 0, 1, 0]], dtype=np.uint32)
    commands = simulate(scene, policies, keys(1), drivers, ["command"]).telemetry.command
    assert np.all(commands[0, :, [0, 2, 4]] == 0)
    assert np.all(commands[0, :, [1, 3]] > 0.99)


class NumpyNetwork:
    """The same networks as FeedForward, for the lockstep."""

    def __init__(self, policies: FeedForward) -> None:
        self.policies = policies

    def space(self, scene: Any) -> Any:
        raise AssertionError("not asked for here")

    def complexity(self, genomes: FloatArray) -> FloatArray:
        raise AssertionError("not asked for here")

    def start(self, genomes: FloatArray) -> None:
        self.which = genomes[..., 0].astype(int)

    def act(self, observations: FloatArray) -> FloatArray:
        p = self.policies
        x = np.concatenate([observations, np.ones((*observations.shape[:2], 1))], axis=-1)
        hidden = np.tanh(np.einsum("wrhi,wri->wrh", p.input_hidden[self.which], x)) * p.hidden_switch[self.which]
        hidden = np.concatenate([hidden, np.ones((*hidden.shape[:2], 1))], axis=-1)
        out: FloatArray = np.tanh(np.einsum("wroh,wrh->wro", p.hidden_output[self.which], hidden))
        return out


def test_lockstep_with_a_numpy_network_follows_the_native_one() -> None:
    scene, policies = Scene(short(2.0)), networks(4)
    native = simulate(scene, policies, keys(4), cloned(4), ["pose"])
    genomes = cloned(4)[..., None].astype(float)
    python = simulate_lockstep(scene, NumpyNetwork(policies), genomes, keys(4), ["pose"], 2)
    assert np.allclose(native.telemetry.pose, python.telemetry.pose, atol=1e-9)


def test_a_controllers_wrong_commands_are_one_clear_error() -> None:
    scene = Scene(short(1.0))

    class Wrong(NumpyNetwork):
        def act(self, observations: FloatArray) -> FloatArray:
            return np.zeros((1, 2))

    class Broken(NumpyNetwork):
        def act(self, observations: FloatArray) -> FloatArray:
            return np.full((*observations.shape[:2], 2), np.nan)

    genomes = cloned(1)[..., None].astype(float)
    with pytest.raises(InvalidArgument, match=r"commands: expected shape \(1, 5, 2\), got \(1, 2\)"):
        simulate_lockstep(scene, Wrong(networks(1)), genomes, keys(1))
    failed = simulate_lockstep(scene, Broken(networks(1)), genomes, keys(1))
    assert failed.status[0] != 0
    assert "not finite at control step 0" in failed.messages[0]


def test_a_compiled_function_takes_the_networks_place() -> None:
    @ctypes.CFUNCTYPE(
        None,
        ctypes.POINTER(ctypes.c_double),
        ctypes.POINTER(ctypes.c_double),
        ctypes.POINTER(ctypes.c_double),
        ctypes.POINTER(ctypes.c_double),
    )
    def drive(parameters: Any, observation: Any, memory: Any, command: Any) -> None:
        memory[0] += 1
        command[0] = parameters[0]
        command[1] = parameters[1] * (memory[0] <= 5)

    address = ctypes.cast(drive, ctypes.c_void_p).value
    assert address is not None
    policies = Compiled(address, np.array([[0.5, 0.25], [-1.0, 1.0]]), memory=1, keep_alive=drive)
    commands = simulate(Scene(short(1.0)), policies, keys(2), cloned(2), ["command"]).telemetry.command
    assert np.all(commands[0, :, :, 0] == 0.5)
    assert np.all(commands[0, :5, :, 1] == 0.25)
    assert np.all(commands[0, 5:, :, 1] == 0)
    assert np.all(commands[1, :5, :, 1] == 1)


def exiting(folder: Path, threads: int) -> list[str]:
    """Return a command that simulates a policy which calls exit() in so many threads at once."""
    (folder / "exits.c").write_text(f"""#include <stdlib.h>
static int inside;
void drive(void) {{
    __atomic_fetch_add(&inside, 1, __ATOMIC_SEQ_CST);
    while (__atomic_load_n(&inside, __ATOMIC_SEQ_CST) < {threads}) {{}}
    exit(0);
}}
""")
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("needs a C compiler")
    subprocess.run([compiler, "-shared", "-fPIC", "exits.c", "-o", "exits.so"], cwd=folder, check=True)
    program = f"""
import ctypes, numpy as np
from swarmevo.config import Config
from swarmevo.protocols import Compiled
from swarmevo.simulation import EpisodeKey, Scene, simulate
drive = ctypes.cast(ctypes.CDLL({str(folder / "exits.so")!r}).drive, ctypes.c_void_p).value
keys, policies = [EpisodeKey(7, 1, 2, repeat) for repeat in (3, 4)], Compiled(drive, np.zeros((1, 1)))
simulate(Scene(Config()), policies, keys, np.zeros((2, 5), dtype=np.uint32), threads={threads})
"""
    return [sys.executable, "-c", program]


EXITED = re.compile(r"error: trial 1, generation 2, repeat [34]: a compiled policy ended the process\n")


@pytest.mark.parametrize("threads", [1, 2])
def test_a_compiled_function_that_exits_is_told(tmp_path: Path, threads: int) -> None:
    """Case 1: the process ended with rc 0 and without a word."""
    done = subprocess.run(exiting(tmp_path, threads), capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert EXITED.fullmatch(done.stderr)


def test_a_thread_that_exits_waits_for_another_that_tells_it(tmp_path: Path) -> None:
    """Who tells it is held up by a pipe that is full; it was ended meanwhile by the other one, with rc 0."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(writing, b"-" * 4096)
    os.set_blocking(writing, True)
    with subprocess.Popen(exiting(tmp_path, 2), stderr=writing) as process:
        os.close(writing)
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(timeout=4)
        with open(reading) as told:
            assert EXITED.search(told.read())
    assert process.returncode == 1


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda p: {"input_hidden": p.input_hidden * np.nan}, "input_hidden: expected finite numbers, got nan"),
        (lambda p: {"input_hidden": p.input_hidden[:, :, :13]}, "input_hidden: expected an array of shape"),
        (lambda p: {"hidden_output": p.hidden_output[:, :1]}, "hidden_output: expected an array of shape"),
    ],
)
def test_bad_weights_are_one_clear_error(spoil: Any, message: str) -> None:
    good = networks(2)
    bad = FeedForward(**{**good.__dict__, **spoil(good)})
    with pytest.raises(InvalidArgument, match=message):
        simulate(Scene(short(1.0)), bad, keys(2), cloned(2))


def test_bad_calls_are_one_clear_error() -> None:
    scene = Scene(short(1.0))
    with pytest.raises(InvalidArgument, match="robot_policies: expected shape"):
        simulate(scene, networks(2), keys(2), cloned(2, robots=4))
    with pytest.raises(InvalidArgument, match=r"robot_policies\[0\]: expected an index below 2"):
        simulate(scene, networks(2), keys(2), cloned(2) + 2)
    with pytest.raises(InvalidArgument, match="robot_policies: expected whole numbers, got dtype float64"):
        simulate(scene, networks(2), keys(2), cloned(2) * 0.9)
    with pytest.raises(InvalidArgument, match=r"robot_policies: expected 0 <= index < 2\*\*32, got -1"):
        simulate(scene, networks(2), keys(2), cloned(2).astype(int) - 1)
    with pytest.raises(InvalidArgument, match=r"robot_policies: expected 0 <= index < 2\*\*32, got 4294967296"):
        simulate(scene, networks(2), keys(2), cloned(2) + np.int64(2**32))
    with pytest.raises(InvalidArgument, match="threads: expected 0 to 1024, got -1"):
        simulate(scene, networks(2), keys(2), cloned(2), threads=-1)
    with pytest.raises(InvalidArgument, match="0 <= seed"):
        simulate(scene, networks(1), [EpisodeKey(-1, 0, 0, 0)], cloned(1))
    with pytest.raises(InvalidArgument, match="below 65536"):
        simulate(scene, networks(1), [EpisodeKey(0, 70000, 0, 0)], cloned(1))
    assert len(simulate(scene, networks(1), [], cloned(0))) == 0


def test_random_teams_leave_the_world_whole() -> None:
    """From anywhere, half of them driven forwards into walls, box and each other; the long way is `make validation`."""
    n = 600
    team = Config().team.model_copy(update={"start": "random"})
    scene = Scene(short(20.0).model_copy(update={"team": team}))
    policies = networks(n)
    policies.hidden_output[: n // 2, :, -1] += 4.0
    episodes = simulate(scene, policies, keys(n), cloned(n), threads=2)
    assert np.all(episodes.status == 0)
    assert np.ptp(episodes.box_pose[:, 1]) > 0.01  # somebody pushed
    assert episodes.max_penetration.max() < 0.001  # walls, floor, box and robots [m]
    assert episodes.max_lift.max() < 1e-9  # nothing flies [m]
    assert episodes.min_upright.min() > 1 - 1e-9  # nothing falls over
    assert episodes.unsolved_steps.sum() == 0
    assert episodes.ode_messages.sum() == 0
    half = 0.5 - 0.09 + 1e-3
    assert np.all(np.abs(episodes.box_pose[:, :2]) < half)


# ---- the library -----------------------------------------------------------------------------------------------------


def test_too_much_telemetry_is_one_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, policies, empty = Scene(short(1.0)), networks(1), np.empty

    def refuse_channels(shape: Any, *args: Any, **kwargs: Any) -> Any:
        if np.size(shape) == 4:
            raise MemoryError
        return empty(shape, *args, **kwargs)

    monkeypatch.setattr(np, "empty", refuse_channels)
    with pytest.raises(simulation.SimulatorError, match=r"telemetry pose: expected .* GiB"):
        simulate(scene, policies, keys(1), cloned(1), ["pose"])


def test_library_tells_what_it_is_and_survives_an_assertion_of_ode() -> None:
    info = simulation.library_info()
    assert "ODE" in info["build"]
    simulation.selftest()


def test_the_library_counts_as_the_names_do() -> None:
    _, lib = load()
    default = Scene(Config())
    assert default.info.observation_names == SceneInfo(5, 1800, 0.1).observation_names  # what plugins see by default
    for devices in itertools.permutations(get_args(Device), 2):
        scene = Scene(sensing(*devices, infrared_yaw_deg=(0.0, 90.0, 180.0), touch_yaw_deg=(0.0,)))
        assert (
            lib.swe_scene_observations(scene._handle)
            == scene.info.observations
            == len(set(scene.info.observation_names))
        )
        assert lib.swe_scene_commands(scene._handle) == scene.info.commands


# ---- lists of sensors ------------------------------------------------------------------------------------------------


def sensing(*devices: str, **sensors: Any) -> Config:
    """Return a short world whose robots have these sensors."""
    config = changed("robot", sensors=devices)
    return config.model_copy(
        update={"sensors": config.sensors.model_copy(update=sensors), "episode": short(1.0).episode}
    )


def recorded(config: Config, *channels: str) -> Mapping[str, FloatArray]:
    """Return channels of one episode of robots that drive on."""
    info = Scene(config).info
    outputs = np.zeros((1, info.commands, 1))
    outputs[0, :, 0] = 0.7, 0.6
    driving = FeedForward(np.zeros((1, 0, info.observations + 1)), outputs, np.zeros((1, 0), dtype=bool))
    return simulate(Scene(config), driving, keys(1), channels=channels).telemetry.channels


def test_an_observation_has_the_readings_of_the_list_in_its_order() -> None:
    channels = recorded(sensing("rf", "touch", "infrared"), "observation", "infrared", "touch", "rf")
    s, touch, infrared = np.split(channels["observation"], [1, 5], axis=-1)
    assert np.array_equal(s[..., 0], channels["rf"] / 50)
    assert np.array_equal(touch, channels["touch"])
    assert np.array_equal(infrared, channels["infrared"])
    assert infrared.max() > 0


def test_channels_are_there_whether_or_not_a_robot_observes_them() -> None:
    """So that a fitness may know more than a controller."""
    every = recorded(sensing("infrared", "touch", "rf"), "pose", "infrared", "touch", "rf")
    blind = recorded(sensing(), "pose", "infrared", "touch", "rf", "observation")
    for name, values in every.items():
        assert np.array_equal(values, blind[name])
    assert blind["observation"].shape == (1, 10, 5, 0)


def test_more_rays_do_not_change_those_that_were_there() -> None:
    yaws = Config().sensors.infrared_yaw_deg
    eight = recorded(sensing("infrared"), "infrared")["infrared"]
    many = recorded(sensing("infrared", infrared_yaw_deg=(*yaws, *np.linspace(-180, 174, 56))), "infrared")["infrared"]
    assert many.shape[-1] == 64
    assert np.array_equal(many[..., :8], eight)


def test_a_controller_for_other_observations_is_refused() -> None:
    with pytest.raises(InvalidArgument, match=re.escape("input_hidden: expected an array of shape (1, 15, 10)")):
        simulate(Scene(sensing("infrared", "rf")), networks(1), keys(1))
    function = ctypes.cast(ctypes.CDLL(None).abs, ctypes.c_void_p).value or 0
    with pytest.raises(
        InvalidArgument, match="a controller for the 9 observations of the scene's robots, got one for 13"
    ):
        simulate(Scene(sensing("infrared", "rf")), Compiled(function, np.zeros((1, 1)), observations=13), keys(1))


# ---- other processes -------------------------------------------------------------------------------------------------


def test_a_scene_pickles_by_its_config() -> None:
    """Case 74: the same episodes there."""
    scene = Scene(short(1.0))
    for copied in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene)):
        assert copied.info == scene.info
        hashes = [simulate(world, networks(2), keys(2)).hash.tolist() for world in (scene, copied)]
        assert hashes[0] == hashes[1]


def test_a_fork_simulates() -> None:
    """Case 74: with threads of its own."""
    scene = Scene(short(1.0))
    here = simulate(scene, networks(4), keys(4), threads=3).hash.tolist()
    assert in_a_fork(lambda: simulate(scene, networks(4), keys(4), threads=3).hash.tolist()) == repr(here)
