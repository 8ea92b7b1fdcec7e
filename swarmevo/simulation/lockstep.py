# SPDX-License-Identifier: BSD-3-Clause
"""Worlds side by side, a control step at a time: stepped from Python, or by a controller written in Python."""

from __future__ import annotations

import copy
import operator
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarmevo import config as configuration
from swarmevo.config import Config
from swarmevo.errors import InvalidArgument, SimulatorError
from swarmevo.protocols import (
    CHANNELS,
    Actor,
    BoolArray,
    FloatArray,
    IntArray,
    Recorded,
    SceneInfo,
)
from swarmevo.simulation._ffi import check, load
from swarmevo.simulation.episodes import MOST_THREADS, Buffers, EpisodeKey, Episodes, create_batch, native_episodes
from swarmevo.simulation.scene import Scene

MOST_WORLDS = 65536
"""A world is the repeat of its episodes' keys, which is below this."""


@dataclass(frozen=True, eq=False, repr=False)
class State(Recorded):
    """Worlds at one moment. A channel is an attribute ``(worlds, *shape)``, with the shape of ``CHANNELS``: ``pose``.

    They are what telemetry records at this control step, but for ``command``, which is the last one: NaN before the
    first. Where a world has failed, all but ``failed`` and ``done`` is meaningless, and channels are NaN.
    """

    step: IntArray
    """``(worlds,)``: control steps since the episode began."""
    time: FloatArray
    """``(worlds,)``: the same [s]."""
    done: BoolArray
    """``(worlds,)``: whether the world stands still: at its end, or failed."""
    failed: BoolArray
    """``(worlds,)``: whether its physics failed."""
    homing_time: FloatArray
    """``(worlds, robots)``: first time within the emitter's range [s]; NaN: not yet."""
    push_time: FloatArray
    """``(worlds,)``: first touch of box and target wall [s]; NaN: not yet."""
    hash: NDArray[np.uint64]
    """``(worlds,)``: of every body's state at every control step so far."""
    channels: Mapping[str, FloatArray]
    """By name: every channel that was asked for."""

    def __repr__(self) -> str:
        return f"<State: {len(self.step)} worlds at steps {self.step.min()} to {self.step.max()}>"


class _Worlds:
    """Episodes in the library that are stepped together, and the buffers between it and NumPy, made once.

    Raises:
        InvalidArgument: A key, a channel or the number of threads is wrong.
    """

    def __init__(
        self, scene: Scene, episodes: Sequence[EpisodeKey], channels: Collection[str] = (), threads: int = 1
    ) -> None:
        ffi, lib = load()
        n, robots = len(episodes), scene.info.robots
        self.scene = scene
        self._lib, self._null = lib, ffi.NULL
        self._recorded = Buffers(scene, n, channels, scene.info.control_steps)
        self._now: dict[tuple[str, ...], Buffers] = {}  # by channels, made when they are first asked for
        self._observations = np.empty((n, robots, scene.info.observations))
        self._commands = np.empty((n, robots, scene.info.commands))
        self._native_observations = ffi.from_buffer("double[]", self._observations)
        self._native_commands = ffi.from_buffer("double[]", self._commands)
        self._counts = ffi.new("uint32_t[2]")
        self._movable, self._failed = self._counts, self._counts + 1
        self._batch = create_batch(scene, threads)
        recorded = self._recorded.native_channels
        check(lib.swe_lockstep_begin(self._batch, recorded, len(recorded), native_episodes(episodes), n))
        self._count()

    @property
    def movable(self) -> int:
        """How many can go on."""
        return int(self._movable[0])

    @property
    def failures(self) -> int:
        """How many have failed."""
        return int(self._failed[0])

    def observe(self) -> FloatArray:
        """Return a fresh array ``(worlds, robots, observations)``."""
        observations = self._observations
        status = self._lib.swe_lockstep_observe(self._native_observations, observations.size, self.batch)
        if status:
            check(status)
        return observations.copy()

    def advance(self, commands: ArrayLike, *, finite: bool = False) -> None:
        """Let commands act; refuse what is not finite if so asked, else the world that gets it fails."""
        batch, own = self.batch, self._commands
        _copy_commands(own, commands)
        if finite and not np.isfinite(own).all():
            world, robot, wheel = np.argwhere(~np.isfinite(own))[0]
            value = own[world, robot, wheel]
            raise InvalidArgument(f"commands: expected finite numbers, got {value} for robot {robot} of world {world}")
        status = self._lib.swe_lockstep_advance(batch, self._native_commands, own.size)
        if status:
            check(status)
        self._count()

    def reset(self, worlds: IntArray, episodes: Sequence[EpisodeKey]) -> None:
        """Begin new episodes in some worlds."""
        ffi, lib = load()
        indices = np.ascontiguousarray(worlds, dtype=np.uint32)
        keys = native_episodes(episodes)
        check(lib.swe_lockstep_reset(self.batch, ffi.from_buffer("uint32_t[]", indices), keys, len(keys)))
        self._count()

    def outcomes(self) -> NDArray[Any]:
        """Return the outcomes so far, with the fields of ``swe_outcome``; valid until they are asked for again."""
        recorded = self._recorded
        status = self._lib.swe_lockstep_state(recorded.native_outcomes, self._null, self._null, 0, self.batch)
        if status:
            check(status)
        return recorded.outcomes

    def done(self) -> BoolArray:
        """Return which stand still."""
        return self._done(self.outcomes())

    def failed(self) -> BoolArray:
        """Return which have failed."""
        failed: BoolArray = self.outcomes()["status"] != 0
        return failed

    def _done(self, outcomes: NDArray[Any]) -> BoolArray:
        steps = outcomes["control_steps"]
        done: BoolArray = (steps == self.scene.info.control_steps) | (outcomes["status"] != 0)
        if self.scene.ends_with_push:
            done |= np.isfinite(outcomes["push_time"]) & (steps > 0)
        return done

    def state(self, wanted: Collection[str]) -> State:
        """Return this moment."""
        names = tuple(wanted)
        if names not in self._now:
            self._now[names] = Buffers(self.scene, len(self._observations), names, steps=None)
        now = self._now[names]
        channels = now.native_channels
        check(
            self._lib.swe_lockstep_state(
                now.native_outcomes, now.native_homing_time, channels, len(channels), self.batch
            )
        )
        outcomes = now.outcomes
        return State(
            step=outcomes["control_steps"].astype(np.intp),
            time=np.multiply(outcomes["control_steps"], self.scene.info.control_period, dtype=np.float64),
            done=self._done(outcomes),
            failed=outcomes["status"] != 0,
            homing_time=now.homing_time.copy(),
            push_time=outcomes["push_time"].copy(),
            hash=outcomes["hash"].copy(),
            channels={name: array.copy() for name, array in now.channels.items()},
        )

    def episodes(self) -> Episodes:
        """Return outcomes so far, and what was recorded, not copied."""
        recorded = self._recorded
        check(
            self._lib.swe_lockstep_state(
                recorded.native_outcomes, recorded.native_homing_time, self._null, 0, self.batch
            )
        )
        return recorded.collect(self.batch)

    def message(self, world: int) -> str:
        """Return why a world has failed."""
        ffi, lib = load()
        return str(ffi.string(lib.swe_batch_episode_message(self.batch, world)).decode())

    @property
    def batch(self) -> Any:
        """The ``swe_batch *``."""
        if self._batch is None:
            raise InvalidArgument("lockstep: expected one that is open, got one that was closed; make another")
        return self._batch

    def close(self) -> None:
        """Free the worlds; again is fine."""
        if self._batch is not None:
            load()[0].release(self._batch)
            self._batch = None

    def _count(self) -> None:
        status = self._lib.swe_lockstep_count(self._movable, self._failed, self._batch)
        if status:
            check(status)


def _copy_commands(own: FloatArray, commands: ArrayLike) -> None:
    """Copy commands, checked, into an array of ours."""
    try:
        given = np.asarray(commands)
    except ValueError:  # a list of lists of several lengths
        raise InvalidArgument(f"commands: expected shape {own.shape}, got rows of several lengths") from None
    if given.shape != own.shape:
        raise InvalidArgument(f"commands: expected shape {own.shape}, got {given.shape}")
    if given.dtype.kind not in "fiu":
        raise InvalidArgument(f"commands: expected real numbers, got dtype {given.dtype}")
    np.copyto(own, given, casting="same_kind")


class Lockstep:
    """Worlds side by side that are stepped from Python, for controllers and learners outside swarmevo.

    ::

        with Lockstep("paper", worlds=64, seed=1) as world:
            observations = world.observe()                # (worlds, robots, 13)
            world.advance(my_controller(observations))    # (worlds, robots, 2) in [-1, 1]

    A world's episode depends on nothing but its key, ``EpisodeKey(seed, 0, resets, world)`` with the number of times
    that the world was reset, and on its commands: not on the other worlds, nor on the number of threads. ``simulate``
    gives the same bits for the same keys and commands. A world at its end stands still until it is reset.

    Abandoned objects leave nothing behind; ``close``, or leaving the context, frees the worlds at once. To be used by
    one thread at a time.

    Args:
        config: Of the worlds; or the name of a packaged configuration, the path of a YAML file, or a scene.
        worlds: How many, 1 to 65,536.
        seed: Of everything random.
        threads: Worker threads, up to 1024; 0: one for each processor.

    Raises:
        ConfigError: The configuration cannot be read.
        InvalidArgument: A number is out of its range, or the library refuses the world.
        SimulatorError: An episode cannot begin: its robots find no place.
    """

    def __init__(self, config: Config | Scene | str | Path, worlds: int = 1, seed: int = 1, threads: int = 1) -> None:
        worlds = _whole("worlds", worlds, 1, MOST_WORLDS)
        self._seed = _whole("seed", seed, 0, 2**64 - 1)
        self._resets = np.zeros(worlds, dtype=np.int64)
        self._worlds = _Worlds(_scene_of(config), self.keys, threads=_whole("threads", threads, 0, MOST_THREADS))
        self._told = np.zeros(worlds, dtype=bool)  # failures that were raised
        self._tell_failures()

    @property
    def info(self) -> SceneInfo:
        """Robots, control steps and control period of the worlds, and what robots observe and are told."""
        return self._worlds.scene.info

    @property
    def keys(self) -> list[EpisodeKey]:
        """The key of each world's present episode."""
        return [EpisodeKey(self._seed, 0, int(resets), world) for world, resets in enumerate(self._resets)]

    @property
    def done(self) -> BoolArray:
        """``(worlds,)``: which stand still: at their end, or failed."""
        return self._worlds.done()

    @property
    def failed(self) -> BoolArray:
        """``(worlds,)``: which have failed."""
        return self._worlds.failed()

    def observe(self) -> FloatArray:
        """Return what the robots sense now, a fresh array ``(worlds, robots, observations)``.

        Their names are in ``info``. The same until the next step; zeros where a world has failed.
        """
        return self._worlds.observe()

    def advance(self, commands: ArrayLike) -> None:
        """Let commands act for one control period in each world that is not done.

        Args:
            commands: ``(worlds, robots, commands)``: left and right wheel of the top speed, clipped to [-1, 1].

        Raises:
            InvalidArgument: The shape is wrong, a number is not finite, or every world is done; no world has moved.
            SimulatorError: A world failed, which the line names. It is done; all others have moved and can go on.
        """
        self._worlds.advance(commands, finite=True)
        self._tell_failures()

    def state(self, channels: Collection[str] = tuple(CHANNELS)) -> State:
        """Return what telemetry has, at this moment, in fresh arrays.

        Args:
            channels: Those that are needed: keys of ``CHANNELS``. All of them take longer.

        Raises:
            InvalidArgument: There is no such channel.
        """
        return self._worlds.state(channels)

    def reset(self, worlds: Sequence[int] | IntArray | BoolArray | None = None) -> None:
        """Begin a new episode in some worlds, with each world's next key.

        Args:
            worlds: Their numbers, or a mask such as ``done``; None: all.

        Raises:
            InvalidArgument: A number is wrong or there twice; nothing was reset.
            SimulatorError: An episode cannot begin, which the line names; it has failed.
        """
        chosen = self._chosen(worlds)
        keys = [EpisodeKey(self._seed, 0, int(self._resets[world]) + 1, int(world)) for world in chosen]
        self._worlds.reset(chosen, keys)
        self._resets[chosen] += 1
        self._told[chosen] = False
        self._tell_failures()

    def episodes(self) -> Episodes:
        """Return the outcomes of the worlds' episodes, as if they ended now: hashes, homing and push times and more."""
        return copy.deepcopy(self._worlds.episodes())

    def close(self) -> None:
        """Free the worlds; again is fine."""
        self._worlds.close()

    def __enter__(self) -> Lockstep:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __len__(self) -> int:
        return len(self._resets)

    def __repr__(self) -> str:
        return f"<Lockstep: {len(self)} worlds of {self.info.robots} robots, seed {self._seed}>"

    def _chosen(self, worlds: Sequence[int] | IntArray | BoolArray | None) -> IntArray:
        n = len(self)
        if worlds is None:
            return np.arange(n)
        given = np.asarray(worlds)
        if given.dtype == bool and given.shape == (n,):
            return np.flatnonzero(given)
        if given.shape == (0,):
            return np.empty(0, dtype=np.intp)
        if given.ndim != 1 or given.dtype.kind not in "iu":
            raise InvalidArgument(
                f"worlds: expected a list of whole numbers, or {n} booleans, got dtype {given.dtype} of shape "
                f"{given.shape}"
            )
        wrong = given[(given < 0) | (given >= n)]
        if wrong.size:
            raise InvalidArgument(f"worlds: expected numbers from 0 to {n - 1}, got {wrong[0]}")
        numbers, counts = np.unique(given, return_counts=True)
        if len(numbers) < len(given):
            raise InvalidArgument(f"worlds: expected each once, got {numbers[counts > 1][0]} twice")
        return given.astype(np.intp)

    def _tell_failures(self) -> None:
        """Raise an error if worlds have failed of which there was none yet."""
        if not self._worlds.failures:
            return
        new = np.flatnonzero(self.failed & ~self._told)
        if new.size:
            self._told[new] = True
            more = f" (and {len(new) - 1} more)" if len(new) > 1 else ""
            raise SimulatorError(f"world {new[0]} failed{more}: {self._worlds.message(int(new[0]))}; reset it")


def _whole(name: str, value: int, low: int, high: int) -> int:
    """Return a whole number in its range."""
    try:
        number = operator.index(value)
    except TypeError:
        raise InvalidArgument(f"{name}: expected a whole number, got {value!r}") from None
    if not low <= number <= high:
        raise InvalidArgument(f"{name}: expected {low} to {high}, got {number}")
    return number


def _scene_of(config: Config | Scene | str | Path) -> Scene:
    if isinstance(config, Scene):
        return config
    if isinstance(config, str | Path):
        return Scene(configuration.load(config))
    if isinstance(config, Config):
        return Scene(config)
    raise InvalidArgument(f"config: expected a Config, a name or path of one, or a Scene, got {config!r}")


def simulate_lockstep(
    scene: Scene,
    controller: Actor,
    genomes: FloatArray,
    episodes: Sequence[EpisodeKey],
    channels: Collection[str] = (),
    threads: int = 1,
) -> Episodes:
    """Run episodes side by side, a control step at a time, with a controller written in Python.

    Args:
        scene: The world.
        controller: Sees all robots of all episodes at once.
        genomes: ``(len(episodes), robots, size)``: given to the controller.
        episodes: One key for each episode.
        channels: Telemetry to record: keys of ``CHANNELS``.
        threads: Worker threads, up to 1024; 0: one for each processor.

    Raises:
        InvalidArgument: A size or channel is wrong, or the controller's commands have a wrong shape.
        SimulatorError: The library failed as a whole. An episode that fails alone has its ``status`` set instead.
    """
    n, robots = len(episodes), scene.info.robots
    if genomes.shape[:2] != (n, robots):
        raise InvalidArgument(f"genomes: expected shape ({n}, {robots}, size), got {genomes.shape}")
    worlds = _Worlds(scene, episodes, channels, threads)
    controller.start(genomes)
    while worlds.movable:
        worlds.advance(controller.act(worlds.observe()))
    return worlds.episodes()
