# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import ctypes
import gc
import re
import resource
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from forks import in_a_fork
from swarmevo.config import Config
from swarmevo.errors import ConfigError, InvalidArgument, SimulatorError
from swarmevo.protocols import CHANNELS, Compiled, FeedForward, FloatArray
from swarmevo.simulation import EpisodeKey, Lockstep, Scene, simulate, simulate_lockstep
from swarmevo.simulation import lockstep as module

ROBOTS, STEPS = 5, 20


def config() -> Config:
    """Return the default world with episodes of two seconds."""
    default = Config()
    horizon = STEPS * default.episode.control_period
    return default.model_copy(update={"episode": default.episode.model_copy(update={"horizon": horizon})})


SCENE = Scene(config())


def networks(n: int) -> FeedForward:
    rng = np.random.default_rng(0)
    return FeedForward(rng.normal(size=(n, 15, 14)), rng.normal(size=(n, 2, 16)), rng.random((n, 15)) < 0.5)


def random_commands(worlds: int, steps: int = STEPS, seed: int = 0) -> FloatArray:
    """Return ``(steps, worlds, robots, 2)``."""
    return np.random.default_rng(seed).uniform(-1, 1, size=(steps, worlds, ROBOTS, 2))


def hashes_after(world: Lockstep, commands: FloatArray) -> list[int]:
    for each in commands:
        world.advance(each)
    return [int(value) for value in world.state().hash]


# ---- the same bits as simulate ---------------------------------------------------------------------------------------


def test_the_same_commands_give_the_same_bits_as_simulate() -> None:
    with Lockstep(SCENE, worlds=6, seed=3, threads=2) as world:
        native = simulate(SCENE, networks(6), world.keys, channels=CHANNELS)
        for step in range(STEPS):
            state = world.state()
            for name in set(CHANNELS) - {"command"}:
                assert np.array_equal(state.channels[name], native.telemetry.channels[name][:, step]), name
            world.advance(native.telemetry.command[:, step])
            assert np.array_equal(world.state().command, native.telemetry.command[:, step])
        ends = world.episodes()
    assert np.array_equal(ends.hash, native.hash)
    assert np.array_equal(ends.box_pose, native.box_pose)
    assert np.array_equal(ends.telemetry.homing_time, native.telemetry.homing_time, equal_nan=True)
    assert np.array_equal(ends.telemetry.push_time, native.telemetry.push_time, equal_nan=True)


@ctypes.CFUNCTYPE(None, *[ctypes.POINTER(ctypes.c_double)] * 4)
def native_reflex(parameters: Any, observation: Any, memory: Any, command: Any) -> None:
    """Drive away from what is near: the same arithmetic as ``reflex``."""
    command[0] = parameters[0] - observation[0] + 0.5 * observation[12]
    command[1] = parameters[0] - observation[7]


def reflex(observations: FloatArray) -> FloatArray:
    left = 0.75 - observations[..., 0] + 0.5 * observations[..., 12]
    return np.stack([left, 0.75 - observations[..., 7]], axis=-1)


def test_a_controller_in_python_gives_the_same_bits_as_the_same_in_the_library() -> None:
    address = ctypes.cast(native_reflex, ctypes.c_void_p).value
    assert address is not None
    with Lockstep(SCENE, worlds=4, seed=2) as world:
        native = simulate(SCENE, Compiled(address, np.full((4, 1), 0.75)), world.keys)
        while not world.done.all():
            world.advance(reflex(world.observe()))
        assert np.array_equal(world.state().hash, native.hash)


class Reflex:
    """The same once more, as a plugin."""

    def space(self, scene: Any) -> Any:
        raise AssertionError("not asked for here")

    def complexity(self, genomes: FloatArray) -> FloatArray:
        raise AssertionError("not asked for here")

    def start(self, genomes: FloatArray) -> None:
        pass

    def act(self, observations: FloatArray) -> FloatArray:
        return reflex(observations)


def test_episodes_in_lockstep_are_those_of_a_lockstep() -> None:
    with Lockstep(SCENE, worlds=3, seed=2) as world:
        done = simulate_lockstep(SCENE, Reflex(), np.zeros((3, ROBOTS, 1)), world.keys, ["rf"])
        while not world.done.all():
            world.advance(reflex(world.observe()))
        assert np.array_equal(world.state().hash, done.hash)
        assert done.telemetry.rf.shape == (3, STEPS, ROBOTS)
    none = simulate_lockstep(SCENE, Reflex(), np.zeros((0, ROBOTS, 1)), [], ["rf"])
    assert len(none) == 0


def test_a_world_depends_neither_on_the_others_nor_on_threads() -> None:
    commands = random_commands(8)
    with Lockstep(SCENE, worlds=8, threads=1) as world:
        expected = hashes_after(world, commands)
    with Lockstep(SCENE, worlds=8, threads=0) as world:
        assert hashes_after(world, commands) == expected
    with Lockstep(SCENE, worlds=1) as world:
        assert hashes_after(world, commands[:, :1]) == expected[:1]
    assert len(set(expected)) == 8


def test_only_the_channels_that_are_needed_are_told() -> None:
    with Lockstep(SCENE, worlds=2) as world:
        world.advance(random_commands(2)[0])
        everything, some, none = world.state(), world.state(["rf", "pose"]), world.state([])
        assert list(some.channels) == ["rf", "pose"]
        assert np.array_equal(some.pose, everything.pose)
        assert np.array_equal(some.rf, everything.rf)
        assert np.array_equal(none.hash, everything.hash)
        with pytest.raises(AttributeError, match="box was not recorded"):
            _ = some.box
        with pytest.raises(InvalidArgument, match=r"channels: expected some of pose, .*; got odour"):
            world.state(["odour"])


# ---- reset -----------------------------------------------------------------------------------------------------------


def test_a_worlds_key_depends_on_the_seed_its_number_and_how_often_it_was_reset() -> None:
    with Lockstep(SCENE, worlds=3, seed=7) as world:
        assert world.keys == [EpisodeKey(7, 0, 0, 0), EpisodeKey(7, 0, 0, 1), EpisodeKey(7, 0, 0, 2)]
        world.reset([2, 0])
        world.reset(np.array([2]))
        world.reset(np.array([False, True, True]))
        world.reset([])
        assert world.keys == [EpisodeKey(7, 0, 1, 0), EpisodeKey(7, 0, 1, 1), EpisodeKey(7, 0, 3, 2)]
        world.reset()
        assert [key.generation for key in world.keys] == [2, 2, 4]


def test_worlds_that_are_reset_begin_anew_and_the_others_go_on() -> None:
    commands = random_commands(3)
    with Lockstep(SCENE, worlds=3) as world:
        expected = hashes_after(world, commands)
        world.reset()
        later = hashes_after(world, commands)
    assert not set(expected) & set(later)
    with Lockstep(SCENE, worlds=3) as world:
        for each in commands[:5]:
            world.advance(each)
        world.reset([1])
        assert world.state().step.tolist() == [5, 0, 5]
        for step in range(STEPS):
            mixed = commands[(np.array([5, 0, 5]) + step) % STEPS, np.arange(3)]
            world.advance(mixed)
        state = world.state()
        assert state.hash.tolist() == [expected[0], later[1], expected[2]]
        assert state.done.all()


def test_a_world_at_its_horizon_stands_still_until_it_is_reset() -> None:
    commands = random_commands(2)
    with Lockstep(SCENE, worlds=2) as world:
        world.advance(commands[0])
        world.reset([1])
        for each in commands[1:]:
            world.advance(each)
        before = world.state()
        assert world.done.tolist() == [True, False]
        assert before.time == pytest.approx([2.0, 1.9])
        world.advance(commands[0])
        after = world.state()
        assert after.hash[0] == before.hash[0]
        assert np.array_equal(after.pose[0], before.pose[0])
        assert after.hash[1] != before.hash[1]
        assert np.array_equal(world.observe()[0, :, :8], after.infrared[0])  # the last moment is seen, too
        with pytest.raises(InvalidArgument, match="expected a world that can go on, but each is at its horizon"):
            world.advance(commands[0])
        world.reset(world.done)
        world.advance(commands[0])
        assert world.state().step.tolist() == [1, 1]


# ---- the state -------------------------------------------------------------------------------------------------------


def test_the_state_has_every_channel_and_what_became_of_the_worlds() -> None:
    with Lockstep(SCENE, worlds=2) as world:
        state = world.state()
        assert set(state.channels) == set(CHANNELS)
        for name, channel in CHANNELS.items():
            assert state.channels[name].shape == (2, *channel.sizes(world.info))
        assert np.isnan(state.command).all()
        assert state.step.tolist() == [0, 0]
        assert state.homing_time.shape == (2, ROBOTS)
        assert np.isnan(state.push_time).all()
        assert not (state.done | state.failed).any()
        assert repr(state) == "<State: 2 worlds at steps 0 to 0>"
        world.advance(np.full((2, ROBOTS, 2), 7.0))
        assert (world.state().command == 1.0).all()  # clipped
        assert np.array_equal(state.pose[..., 1].round(1), np.full((2, ROBOTS), -0.4))  # of its own moment still


def test_arrays_are_fresh() -> None:
    with Lockstep(SCENE) as world:
        kept = [world.observe(), world.state().pose, world.state().homing_time, world.episodes().hash, world.done]
        copies = [array.copy() for array in kept]
        for array in (world.observe(), world.state().pose, world.state().homing_time):
            array.fill(99)
        for each in random_commands(1):
            world.advance(each)
        world.observe()
        world.state()
        world.episodes()
        for array, copy in zip(kept, copies, strict=True):
            assert np.array_equal(array, copy, equal_nan=True)


def test_looking_changes_nothing() -> None:
    commands = random_commands(1)
    with Lockstep(SCENE) as world:
        expected = hashes_after(world, commands)
    with Lockstep(SCENE) as world:
        for each in commands:
            assert np.array_equal(world.observe(), world.observe())
            world.state()
            world.episodes()
            world.advance(each)
        assert world.state().hash.tolist() == expected


# ---- what is refused -------------------------------------------------------------------------------------------------

GOOD = np.zeros((2, ROBOTS, 2))


@pytest.mark.parametrize(
    ("commands", "message"),
    [
        (GOOD[0], r"commands: expected shape (2, 5, 2), got (5, 2)"),
        (GOOD[:, :4], r"commands: expected shape (2, 5, 2), got (2, 4, 2)"),
        (0.0, r"commands: expected shape (2, 5, 2), got ()"),
        ([[[0.0, 0.0]], [[0.0]]], "commands: expected shape (2, 5, 2), got rows of several lengths"),
        (GOOD.astype(complex), "commands: expected real numbers, got dtype complex128"),
        (GOOD.astype(object), "commands: expected real numbers, got dtype object"),
        (GOOD.astype(str), "commands: expected real numbers, got dtype <U"),
        (GOOD == 0, "commands: expected real numbers, got dtype bool"),
        (np.full_like(GOOD, np.nan), "commands: expected finite numbers, got nan for robot 0 of world 0"),
    ],
)
def test_wrong_commands_are_one_clear_error_and_move_nothing(commands: Any, message: str) -> None:
    with Lockstep(SCENE, worlds=2) as world:
        before = world.state()
        with pytest.raises(InvalidArgument) as error:
            world.advance(commands)
        assert message in str(error.value)
        assert "\n" not in str(error.value)
        after = world.state()
        assert np.array_equal(after.hash, before.hash)
        assert np.array_equal(after.step, before.step)
        world.advance(GOOD)


def test_a_number_that_is_not_finite_is_named() -> None:
    commands = GOOD.copy()
    commands[1, 3, 1] = -np.inf
    with (
        Lockstep(SCENE, worlds=2) as world,
        pytest.raises(InvalidArgument, match="expected finite numbers, got -inf for robot 3 of world 1"),
    ):
        world.advance(commands)


def test_commands_may_be_any_real_numbers_in_any_order() -> None:
    commands = np.round(random_commands(2)) + 0.0  # no -0.0, which a whole number cannot be
    with Lockstep(SCENE, worlds=2) as world:
        expected = hashes_after(world, commands)
    for same in (
        commands.astype(np.float32),
        commands.astype(np.int8),
        np.asfortranarray(commands),
        np.repeat(commands, 2, axis=-1)[..., ::2],
    ):
        with Lockstep(SCENE, worlds=2) as world:
            assert hashes_after(world, same) == expected
    with Lockstep(SCENE, worlds=2) as world:
        world.advance(commands[0].tolist())


@pytest.mark.parametrize(
    ("worlds", "message"),
    [
        ([3], "worlds: expected numbers from 0 to 2, got 3"),
        ([0, -1], "worlds: expected numbers from 0 to 2, got -1"),
        ([2**40], "worlds: expected numbers from 0 to 2, got 1099511627776"),
        ([1, 0, 1], "worlds: expected each once, got 1 twice"),
        ([0.5], "worlds: expected a list of whole numbers, or 3 booleans, got dtype float64 of shape (1,)"),
        ([True, False], "worlds: expected a list of whole numbers, or 3 booleans, got dtype bool of shape (2,)"),
        (1, "worlds: expected a list of whole numbers, or 3 booleans, got dtype int64 of shape ()"),
        ([[0], [1]], "got dtype int64 of shape (2, 1)"),
        ("all", "worlds: expected a list of whole numbers"),
    ],
)
def test_wrong_worlds_are_one_clear_error_and_none_is_reset(worlds: Any, message: str) -> None:
    with Lockstep(SCENE, worlds=3) as world:
        world.advance(np.zeros((3, ROBOTS, 2)))
        with pytest.raises(InvalidArgument) as error:
            world.reset(worlds)
        assert message in str(error.value)
        assert world.state().step.tolist() == [1, 1, 1]
        assert [key.generation for key in world.keys] == [0, 0, 0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"worlds": 0}, "worlds: expected 1 to 65536, got 0"),
        ({"worlds": 65537}, "worlds: expected 1 to 65536, got 65537"),
        ({"worlds": 2.0}, "worlds: expected a whole number, got 2.0"),
        ({"worlds": "3"}, "worlds: expected a whole number, got '3'"),
        ({"seed": -1}, "seed: expected 0 to 18446744073709551615, got -1"),
        ({"seed": None}, "seed: expected a whole number, got None"),
        ({"threads": -1}, "threads: expected 0 to 1024, got -1"),
    ],
)
def test_wrong_numbers_are_one_clear_error(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidArgument, match=f"^{re.escape(message)}$"):
        Lockstep(SCENE, **arguments)


def test_worlds_come_from_a_configuration_its_name_its_file_or_a_scene(tmp_path: Path) -> None:
    (tmp_path / "my.yaml").write_text("team:\n  robots: 2\n")
    for source, robots in ((config(), 5), ("paper", 5), (tmp_path / "my.yaml", 2), (SCENE, 5)):
        with Lockstep(source) as world:
            assert world.observe().shape == (1, robots, 13)
            assert repr(world) == f"<Lockstep: 1 worlds of {robots} robots, seed 1>"
    with pytest.raises(ConfigError):
        Lockstep("nowhere")
    with pytest.raises(InvalidArgument, match="config: expected a Config, a name or path of one, or a Scene, got 3"):
        Lockstep(3)  # type: ignore[arg-type]


# ---- failures --------------------------------------------------------------------------------------------------------


@pytest.fixture
def not_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is not finite gets through: a world fails as it would where its physics fails."""
    advance = module._Worlds.advance
    monkeypatch.setattr(module._Worlds, "advance", lambda self, commands, finite: advance(self, commands))


@pytest.mark.usefixtures("not_checked")
def test_a_world_that_fails_is_named_and_the_others_have_moved() -> None:
    commands = random_commands(3, steps=2)
    with Lockstep(SCENE, worlds=3) as world:
        expected = hashes_after(world, commands)
    broken = commands.copy()
    broken[0, 1, 4] = np.nan
    with Lockstep(SCENE, worlds=3) as world:
        with pytest.raises(SimulatorError, match=r"^world 1 failed: .* robot 4 .* at control step 0; reset it$"):
            world.advance(broken[0])
        assert world.failed.tolist() == world.done.tolist() == [False, True, False]
        world.advance(commands[1])  # told once
        state = world.state()
        assert (state.hash[0], state.hash[2]) == (expected[0], expected[2])
        assert np.isnan(state.pose[1]).all()
        assert not world.observe()[1].any()
        assert not np.isnan(state.pose[[0, 2]]).any()
        with pytest.raises(SimulatorError, match="world 0 failed"):
            world.advance(np.where(np.arange(3)[:, None, None] == 0, np.nan, commands[1]))
        world.reset(world.failed)
        assert [key.generation for key in world.keys] == [1, 1, 0]
        assert not world.failed.any()
        with pytest.raises(SimulatorError, match=r"world 0 failed \(and 2 more\)"):
            world.advance(np.full((3, ROBOTS, 2), np.nan))
        with pytest.raises(InvalidArgument, match="expected a world that can go on"):
            world.advance(commands[0])


# ---- what is left behind ---------------------------------------------------------------------------------------------


def test_a_closed_lockstep_is_one_clear_error() -> None:
    with Lockstep(SCENE, worlds=2) as world:
        pass
    world.close()
    for call in (
        world.observe,
        world.state,
        world.reset,
        world.episodes,
        lambda: world.advance(GOOD),
        lambda: world.done,
        lambda: world.failed,
    ):
        with pytest.raises(InvalidArgument, match="expected one that is open, got one that was closed"):
            call()
    assert len(world) == 2
    assert repr(world)


def resident() -> int:
    """Return the memory of this process [bytes]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def test_abandoned_worlds_leave_nothing_behind() -> None:
    scene = Scene(config())

    def abandon(n: int) -> None:
        for i in range(n):
            world = Lockstep(scene, worlds=4, threads=1 + i % 2)
            world.advance(np.zeros((4, ROBOTS, 2)))
            world.state()
            world.reset([i % 4])

    abandon(200)
    gc.collect()
    before = resident()
    abandon(2000)
    gc.collect()
    assert resident() - before < 4 * 2**20


def test_resets_leave_nothing_behind() -> None:
    with Lockstep(SCENE, worlds=4) as world:
        for _ in range(100):
            world.reset()
        before = resident()
        for _ in range(2000):
            world.reset()
        assert resident() - before < 4 * 2**20


def test_worlds_on_threads_are_of_one_process() -> None:
    """Case 74: a fork, which has none of the threads, gets one line and can drop its copy."""

    def use(world: Lockstep) -> None:
        with world:
            world.observe()

    with Lockstep(SCENE, worlds=4, threads=3) as world:
        said = in_a_fork(lambda: use(world))
        assert said.startswith("InvalidArgument: batch: expected the process that made it, got a fork of it")
        world.observe()
