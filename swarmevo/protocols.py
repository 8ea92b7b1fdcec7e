# SPDX-License-Identifier: BSD-3-Clause
"""What a plugin sees: the genome, the telemetry, and the three protocols it may implement.

A plugin needs nothing of swarmevo at run time but this module and NumPy. It registers a *factory* under one of the
entry-point groups ``swarmevo.controllers``, ``swarmevo.fitness`` and ``swarmevo.optimisers``; the factory's further
keyword parameters are the plugin's options in the YAML config.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from inspect import Parameter
from types import MappingProxyType
from typing import Any, Final, Literal, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.intp]
BoolArray: TypeAlias = NDArray[np.bool_]
World: TypeAlias = Mapping[str, Mapping[str, Any]]
"""The configuration's sections that describe the world (``docs/configuration.md``), each a mapping of its keys to plain
values."""

PAPER_OBSERVATIONS: Final = (*(f"infrared_{i}" for i in range(8)), *(f"touch_{i}" for i in range(4)), "rf")
"""What a robot of the paper observes, in the order of a controller's input: infrared, touch, RF strength."""
WHEELS: Final = ("left", "right")
"""What a robot is told, in the order of a controller's output: speeds in [-1, 1] of the top speed."""


# ---- genomes ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Block:
    """One named array inside a genome.

    Args:
        name: Unique in its space.
        shape: Of the array.
        kind: ``"real"``, or ``"switch"``: on where the entry is >= 0.5.
        unit_axis: The axis that counts the units (say, the hidden neurons) which variation treats as wholes.
        units: Blocks with the same label share their units: entry ``h`` of one belongs to unit ``h`` of all.
        linked: Among the blocks of a family of units, those with the same label are crossed over together.
        bounds: Smallest and largest value of a real gene, which the controller takes no other of; None: any.
    """

    name: str
    shape: tuple[int, ...]
    kind: Literal["real", "switch"] = "real"
    unit_axis: int = 0
    units: str = ""
    linked: str = ""
    bounds: tuple[float, float] | None = None

    @property
    def size(self) -> int:
        """Number of entries."""
        return int(math.prod(self.shape))

    def _index_along_unit_axis(self) -> IntArray:
        along: IntArray = np.indices(self.shape)[self.unit_axis].ravel().astype(np.intp)
        return along


@dataclass(frozen=True)
class GenomeSpace:
    """The layout of a genome: blocks, one after the other, in one flat float64 vector.

    Every gene belongs to one unit, one link and one part, each a number counted from 0, so that an optimiser can treat
    genomes as vectors and still respect their structure:

    - ``unit_of``: genes that mutate together (a hidden neuron's weights and its switch);
    - ``link_of``: genes that share one crossover decision (a neuron's inputs and its switch);
    - ``part_of``: genes that share one crossover factor (a neuron's inputs).
    """

    blocks: tuple[Block, ...]

    @property
    def size(self) -> int:
        """Length of a genome."""
        return sum(block.size for block in self.blocks)

    def split(self, genomes: FloatArray) -> dict[str, FloatArray]:
        """Return views of ``genomes`` ``(..., size)``: for each block's name ``(..., *shape)``.

        Raises:
            ValueError: The last axis is not ``size`` long.
        """
        if genomes.shape[-1] != self.size:
            raise ValueError(f"genomes: expected {self.size} entries along the last axis, got {genomes.shape[-1]}")
        views, start = {}, 0
        for block in self.blocks:
            views[block.name] = genomes[..., start : start + block.size].reshape(*genomes.shape[:-1], *block.shape)
            start += block.size
        return views

    def tile(self, copies: int) -> GenomeSpace:
        """Return the space of ``copies`` independent genomes laid end to end, for a team of individuals."""
        return GenomeSpace(
            tuple(
                replace(block, name=f"{block.name}[{i}]", units=f"{block.units or block.name}[{i}]")
                for i in range(copies)
                for block in self.blocks
            )
        )

    @cached_property
    def is_switch(self) -> BoolArray:
        """``(size,)``: True where a gene is a switch."""
        return np.repeat([b.kind == "switch" for b in self.blocks], [b.size for b in self.blocks])

    @cached_property
    def bounds(self) -> FloatArray:
        """``(2, size)``: smallest and largest value of each gene, infinite where it has none."""
        ends = [block.bounds or (-math.inf, math.inf) for block in self.blocks]
        return np.repeat(
            np.array(ends, dtype=np.float64).reshape(-1, 2).T, [block.size for block in self.blocks], axis=1
        )

    @cached_property
    def unit_of(self) -> IntArray:
        """``(size,)``: number of each gene's unit."""
        return self._number(lambda block: (block.units or block.name,))

    @cached_property
    def link_of(self) -> IntArray:
        """``(size,)``: number of each gene's link."""
        return self._number(lambda block: (block.units or block.name, block.linked or block.name))

    @cached_property
    def part_of(self) -> IntArray:
        """``(size,)``: number of each gene's part."""
        return self._number(lambda block: (block.name,))

    def _number(self, key: Any) -> IntArray:
        """Number the distinct (key, index along the unit axis) in order of first appearance."""
        numbers: dict[tuple[object, ...], int] = {}
        return np.array(
            [
                numbers.setdefault((*key(block), int(i)), len(numbers))
                for block in self.blocks
                for i in block._index_along_unit_axis()
            ],
            dtype=np.intp,
        )


# ---- what an episode leaves ------------------------------------------------------------------------------------------


Axis: TypeAlias = Literal["robots", "commands", "message", "observations", "infrared", "touch", "movables"]


@dataclass(frozen=True)
class Channel:
    """Something that is recorded at each control step, before the step's command acts.

    Args:
        shape: Behind the axes (episodes, control steps); a text is a number of the :class:`SceneInfo`.
        unit: Of the values, or of each along the last axis.
        meaning: Of the values. World frame: counter-clockwise, origin at the arena's centre.
        low: Smallest value in the paper's world, or one for each place along the last axis.
        high: Largest, likewise.
        is_flag: Whether the values are 0 or 1, nothing between.
    """

    shape: tuple[Axis | int, ...]
    unit: str
    meaning: str
    low: float | tuple[float, ...] = 0.0
    high: float | tuple[float, ...] = 1.0
    is_flag: bool = False

    def sizes(self, scene: SceneInfo) -> tuple[int, ...]:
        """Return the shape in a scene."""
        return tuple(getattr(scene, axis) if isinstance(axis, str) else axis for axis in self.shape)


_CORNER = (0.5, 0.5, math.pi)
"""Of the paper's arena [m], and half a turn [rad]."""
_OPPOSITE = (-0.5, -0.5, -math.pi)

CHANNELS: Final[Mapping[str, Channel]] = {
    "pose": Channel(("robots", 3), "m, m, rad", "x, y, heading in [-pi, pi] of a robot", _OPPOSITE, _CORNER),
    "command": Channel(
        ("robots", "commands"),
        "top speed",
        "left and right wheel in [-1, 1], then message bits, as the controller gave them, clipped",
        -1.0,
    ),
    "message": Channel(
        ("robots", "message"), "1", "bits that a robot sends, which others have in their next observation", is_flag=True
    ),
    "observation": Channel(
        ("robots", "observations"), "1", "what the controller was given, in the order of `robot.sensors`"
    ),
    "infrared": Channel(("robots", "infrared"), "1", "readings in [0, 1]; 0: nothing in range"),
    "touch": Channel(("robots", "touch"), "1", "readings in [0, 1], from left to right; 0: the box is not in range"),
    "rf": Channel(
        ("robots",), "1", "signal strength S of the first channel of emitters, in the paper from 1 to 50", 1.0, 50.0
    ),
    "movables": Channel(
        ("movables", 3), "m, m, rad", "x, y, heading in [-pi, pi] of what robots can push", _OPPOSITE, _CORNER
    ),
    "at_goal": Channel(("movables",), "1", "1: it touches a goal's wall, or lies in its region; 0: not", is_flag=True),
    "box": Channel((3,), "m, m, rad", "`movables` of the first; NaN without one", _OPPOSITE, _CORNER),
    "box_contact": Channel((), "1", "`at_goal` of the first; 0 without one", is_flag=True),
}
"""Every channel of telemetry: the only table in Python; ``native/src/channels.cpp`` has the library's."""
CENSUS_CHANNELS: Final = ("pose", "command", "touch", "movables")
"""What a census of behaviours looks at."""


class Recorded:
    """Arrays by the channel that they are of: each an attribute, and an entry of ``channels``.

    A channel that was not recorded is an ``AttributeError`` which says what to do.
    """

    channels: Mapping[str, FloatArray]

    def __getattr__(self, name: str) -> FloatArray:
        channels: Mapping[str, FloatArray] = self.__dict__.get("channels", {})  # none yet while it is unpickled
        if name in channels:
            return channels[name]
        if name in CHANNELS:
            raise AttributeError(f'{name} was not recorded: add "{name}" to the channels of the fitness or the call')
        raise AttributeError(f"{type(self).__name__} has no {name!r}; the channels are {', '.join(CHANNELS)}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.channels]


class _InWorld:
    """Something with a ``world``, which is read-only here and wherever it travels to."""

    def __getstate__(self) -> dict[str, Any]:
        world: World = vars(self)["world"]
        return {**vars(self), "world": {name: dict(section) for name, section in world.items()}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, world=_read_only(state["world"]))


def _read_only(world: World) -> World:
    if all(isinstance(one, MappingProxyType) for one in (world, *world.values())):
        return world  # it was made here
    return MappingProxyType({name: MappingProxyType(dict(section)) for name, section in world.items()})


@dataclass(frozen=True, init=False, repr=False, eq=False)
class Telemetry(_InWorld, Recorded):
    """What happened in a number of episodes: ``Telemetry(0.1, homing_time, push_time, pose=pose)``.

    The outcome is always there; a channel only if somebody asked for it (``Fitness.channels``), as an attribute
    ``(episodes, steps, *shape)`` with the shape of ``CHANNELS``: ``telemetry.pose``. Channels hold one row per control
    step, recorded before the step's command acts.

    Raises:
        TypeError: A channel does not exist.
    """

    control_period: float
    """[s]"""
    homing_time: FloatArray
    """``(episodes, robots)``: first time within range of an emitter of the first channel [s]; NaN: never."""
    push_time: FloatArray
    """``(episodes,)``: when all movables have been at a goal, the box at the target wall [s]; NaN: never."""
    channels: Mapping[str, FloatArray]
    """By name: what was recorded."""
    world: World
    """That of the episodes: ``telemetry.world["box"]["size"]``. Read-only; empty where nobody gave it."""

    def __init__(
        self,
        control_period: float,
        homing_time: FloatArray,
        push_time: FloatArray,
        *,
        channels: Any = None,  # a mapping; not typed so, that arrays can be given as **channels
        world: Any = None,  # likewise
        **more_channels: FloatArray,
    ) -> None:
        recorded = {**(channels or {}), **more_channels}  # either way, and both in dataclasses.replace
        unknown = [name for name in recorded if name not in CHANNELS]
        if unknown:
            raise TypeError(f"Telemetry: expected channels among {', '.join(CHANNELS)}; got {', '.join(unknown)}")
        vars(self).update(
            control_period=control_period,
            homing_time=homing_time,
            push_time=push_time,
            channels=recorded,
            world=_read_only(world or {}),
        )

    def __repr__(self) -> str:
        episodes, robots = self.homing_time.shape
        return f"<Telemetry: {episodes} episodes of {robots} robots; {', '.join(self.channels) or 'no channels'}>"


@dataclass(frozen=True)
class Step:
    """One control step of worlds side by side, for a fitness that is told of each (:class:`StepwiseFitness`)."""

    telemetry: Telemetry
    """What telemetry has of this step: channels ``(worlds, 1, *shape)``, and the times that have come by its end."""
    number: IntArray
    """``(worlds,)``: which step of its episode, from 0. At 0 an episode begins, whatever came before."""
    is_last: BoolArray
    """``(worlds,)``: whether the episode ends with this step."""
    horizon: int
    """Control steps of an episode that does not end early."""

    @property
    def is_first(self) -> BoolArray:
        """``(worlds,)``: whether the episode begins with this step."""
        return np.asarray(self.number == 0)


Follower: TypeAlias = Callable[[Step], FloatArray]
"""Is told of every control step of worlds side by side, and returns what their objectives have come to, ``(worlds,
objectives)``."""


# ---- policies that run natively --------------------------------------------------------------------------------------


Activation: TypeAlias = Literal["tanh", "logistic"]


@dataclass(frozen=True)
class FeedForward:
    """Networks with one hidden layer, run by the library. ``n`` networks of up to ``h`` hidden units.

    ``bias`` is 1 if hidden and output units have a constant input, else 0.
    """

    input_hidden: FloatArray
    """``(n, h, observations + bias)``"""
    hidden_output: FloatArray
    """``(n, commands, h + bias)``"""
    hidden_switch: BoolArray
    """``(n, h)``: booleans"""
    bias: bool = True
    activation: Activation = "tanh"

    def __len__(self) -> int:
        return len(self.input_hidden)


@dataclass(frozen=True)
class Linear:
    """Networks without hidden units, run by the library: each entry of a command is a weighted sum of an observation.

    ``bias`` is 1 if there is a constant input, else 0.
    """

    input_output: FloatArray
    """``(n, commands, observations + bias)``"""
    bias: bool = True
    activation: Literal["identity", "tanh", "logistic"] = "identity"
    """Of the sums; whatever it is, the library clips commands to [-1, 1]."""

    def __len__(self) -> int:
        return len(self.input_output)


Recurrence: TypeAlias = Literal["elman", "jordan", "ctrnn"]
Integration: TypeAlias = Literal["exponential", "euler"]


@dataclass(frozen=True)
class Recurrent:
    """Networks with one hidden layer and a memory, run by the library. ``n`` networks of up to ``h`` hidden units.

    Hidden units hear the observation and the context, which is zero when an episode starts: the hidden units a control
    step ago (``elman``), the outputs a control step ago (``jordan``), or the hidden units of now, which are leaky
    integrators (``ctrnn``). ``bias`` is 1 if hidden and output units have a constant input, else 0.
    """

    recurrence: Recurrence
    input_hidden: FloatArray
    """``(n, h, observations + bias)``"""
    context_hidden: FloatArray
    """``(n, h, context)``; a context of ``h``, of ``jordan`` of the size of a command"""
    hidden_output: FloatArray
    """``(n, commands, h + bias)``"""
    hidden_switch: BoolArray
    """``(n, h)``: booleans"""
    time_constants: FloatArray | None = None
    """``(n, h)``: of ``ctrnn`` [s]; of the others None"""
    integration: Integration = "exponential"
    """Of ``ctrnn``, by one step in each control period. With ``euler`` no time constant may be shorter than that."""
    bias: bool = True
    activation: Activation = "tanh"

    def __len__(self) -> int:
        return len(self.input_hidden)


@dataclass(frozen=True)
class Compiled:
    """A plugin's own compiled function: ``swe_policy_function`` of ``swarmevo.h``.

    The function is called by several threads at once and must not write to its parameters.
    """

    function: int
    """Its address, as ``ctypes`` or ``cffi`` gives it."""
    parameters: FloatArray
    """``(n, size)``: policy ``i`` is called with a pointer to row ``i``."""
    memory: int = 0
    """Doubles of memory for each robot, zero when an episode starts."""
    observations: int = 0
    """Of the scenes that it is for, others are refused; 0: whatever a scene has."""
    commands: int = 0
    """Likewise."""
    keep_alive: object = field(default=None, repr=False)
    """Whatever must not be freed while the policies live, such as the loaded library."""

    def __len__(self) -> int:
        return len(self.parameters)


NativePolicies: TypeAlias = FeedForward | Linear | Recurrent | Compiled


# ---- the three protocols ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SceneInfo(_InWorld):
    """What a controller or a fitness may know about the scene of an episode."""

    robots: int
    """In the team."""
    control_steps: int
    """To the horizon; an episode that ends at its success has fewer (``world["episode"]["until"]``)."""
    control_period: float
    """[s]"""
    observation_names: tuple[str, ...] = PAPER_OBSERVATIONS
    """In the order of an observation, such as ``infrared_0``."""
    command_names: tuple[str, ...] = WHEELS
    """In the order of a command."""
    infrared: int = 8
    """Infrared rays of a robot, whether or not it observes them."""
    touch: int = 4
    """Touch sensors, likewise."""
    movables: int = 1
    """What there is to be pushed."""
    arena: tuple[float, float, float, float] = (-0.5, 0.5, -0.5, 0.5)
    """X from, x to, y from, y to of what its walls enclose [m]."""
    world: World = field(default_factory=dict, hash=False)
    """As in :class:`Telemetry`: ``scene.world["arena"]["size"]``."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "world", _read_only(self.world))

    @property
    def observations(self) -> int:
        """Length of an observation."""
        return len(self.observation_names)

    @property
    def commands(self) -> int:
        """Length of a command."""
        return len(self.command_names)

    @property
    def message(self) -> int:
        """Bits of a robot's message, which are the commands behind the wheels'."""
        return self.commands - len(WHEELS)

    @property
    def horizon(self) -> float:
        """Of an episode [s]."""
        return self.control_steps * self.control_period


@dataclass(frozen=True)
class Objective:
    """One number that evolution makes better.

    Args:
        name: Unique in a run, printable; a column of the results, so no name of another column.
        direction: What better means.
        range: Smallest and largest value it can take, within 1e50; the worse end is the hypervolume's reference. A
            value outside of it is an error.
        of: Whether it is measured in an ``episode``, or follows from the ``genome`` alone, whatever the world.
        success: Value from which on an episode counts as a success, in the rates of ``swarmevo show`` and
            ``swarmevo test``; None: it says nothing of success. Evolution does not read it.
    """

    name: str
    direction: Literal["maximise", "minimise"]
    range: tuple[float, float]
    of: Literal["episode", "genome"] = field(default="episode", kw_only=True, compare=False)
    success: float | None = field(default=None, kw_only=True, compare=False)

    @property
    def worst(self) -> float:
        """The worse end of the range."""
        return self.range[0] if self.is_maximised else self.range[1]

    @property
    def is_maximised(self) -> bool:
        """Whether more is better."""
        return self.direction == "maximise"

    def is_success(self, values: FloatArray) -> BoolArray:
        """Return which ``values`` are as good as ``success`` or better; none, if it is None."""
        if self.success is None:
            return np.zeros(values.shape, dtype=np.bool_)
        return np.asarray(values >= self.success if self.is_maximised else values <= self.success)


@dataclass(frozen=True)
class Descriptor:
    """One number that tells what a behaviour is like, be it good or bad: an axis of a map of behaviours.

    Args:
        name: As an objective's; unique in a run among both.
        range: Smallest and largest value it can take, within 1e50. A value outside of it is an error.
    """

    name: str
    range: tuple[float, float]


@dataclass(frozen=True)
class Problem:
    """What an optimiser is to solve, for a factory with a parameter ``problem``."""

    objectives: tuple[Objective, ...]
    """m: of the columns of the costs, which are to be minimised whatever the objectives' directions."""
    descriptors: tuple[Descriptor, ...] = ()
    """d: of the columns of the descriptors; mostly none."""


@runtime_checkable
class Controller(Protocol):
    """Turns genomes into behaviour. Factory: ``factory(**options)``.

    Besides these methods it has one of the two in :class:`NativeController` and :class:`PythonController`.
    """

    def space(self, scene: SceneInfo) -> GenomeSpace:
        """Return the layout of one robot's genome."""
        ...

    def complexity(self, genomes: FloatArray) -> FloatArray:
        """Return ``(n,)``: how many hidden neurons each of ``genomes`` ``(n, size)`` uses."""
        ...


@runtime_checkable
class NativeController(Controller, Protocol):
    """A controller that the library runs inside its worker threads."""

    def policies(self, genomes: FloatArray) -> NativePolicies:
        """Return one policy for each of ``genomes`` ``(n, size)``."""
        ...


class Actor(Protocol):
    """Commands all robots of all worlds that are stepped together."""

    def start(self, genomes: FloatArray) -> None:
        """Take the genomes ``(worlds, robots, size)`` of the episodes that begin; forget all memory."""
        ...

    def act(self, observations: FloatArray) -> FloatArray:
        """Return commands in [-1, 1], ``(worlds, robots, commands)``.

        Args:
            observations: ``(worlds, robots, observations)``. The :class:`SceneInfo` has their names.
        """
        ...


@runtime_checkable
class PythonController(Controller, Actor, Protocol):
    """A controller written with NumPy, run for all episodes in lockstep."""


@runtime_checkable
class Fitness(Protocol):
    """Judges episodes. Factory: ``factory(**options)``.

    A factory with a parameter ``scene`` gets a :class:`SceneInfo` there: it is called for each world that episodes are
    in. All must measure the same; a range of an objective in a run is the widest that it has in any of the worlds.
    """

    @property
    def objectives(self) -> Sequence[Objective]:
        """What it measures, in the order of the columns of :meth:`evaluate`."""
        ...

    @property
    def channels(self) -> Sequence[str]:
        """The telemetry channels it reads: keys of ``CHANNELS``."""
        ...

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        """Return ``(episodes, objectives)``.

        Args:
            telemetry: The outcome and the channels that were asked for.
            genomes: ``(episodes, size)``: the individual that each episode tried.
            controller: To ask for ``complexity``.
        """
        ...


@runtime_checkable
class ExplainedFitness(Fitness, Protocol):
    """A fitness that can show how an objective comes about, for the plot beside a replay."""

    def terms(self, telemetry: Telemetry) -> Mapping[str, FloatArray]:
        """Return for each of an objective's parts its name and its size ``(episodes, steps)``, mean over the robots."""
        ...


@runtime_checkable
class StepwiseFitness(Fitness, Protocol):
    """A fitness that tells its objectives while an episode goes on: rewards for learners (``swarmevo.env``)."""

    def stepwise(self, worlds: int) -> Follower:
        """Return what follows so many worlds, each from one episode to the next.

        It is told of every step of each episode. After the last one an objective is what :meth:`evaluate` says of the
        episode, but for rounding; before, what it would be if nothing more were gained: what a step adds to it is the
        step's reward. A world's values do not depend on the worlds beside it.
        """
        ...


@runtime_checkable
class DescribingFitness(Fitness, Protocol):
    """A fitness that tells what a behaviour is like. It may have no objectives."""

    @property
    def descriptors(self) -> Sequence[Descriptor]:
        """What it describes, in the order of the columns of :meth:`describe`."""
        ...

    def describe(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        """Return ``(episodes, descriptors)``; the arguments are those of :meth:`evaluate`."""
        ...


@runtime_checkable
class WatchingFitness(Fitness, Protocol):
    """A fitness that knows its task's behaviours by name, which ``swarmevo test`` counts beside those of the paper."""

    def behaviours(self, telemetry: Telemetry) -> Mapping[str, BoolArray]:
        """Return for each behaviour's name, always the same ones in a world, which robots showed it.

        Args:
            telemetry: With its channels, and with ``pose``, ``command``, ``touch`` and ``movables``.

        Returns:
            ``(episodes, robots)`` of booleans each.
        """
        ...


@runtime_checkable
class Optimiser(Protocol):
    """Proposes genomes, learns their costs.

    Factory: ``factory(space, population, objectives, rng, **options)`` with a :class:`GenomeSpace`, two ints and a
    ``numpy.random.Generator``, which is its only source of randomness. One with a parameter ``problem`` gets a
    :class:`Problem` there. Call order, shapes and finiteness are checked by the host.
    """

    def ask(self) -> FloatArray:
        """Return the genomes ``(n, size)`` to evaluate next; ``n`` may vary, but is at least 1."""
        ...

    def tell(self, genomes: FloatArray, costs: FloatArray) -> None:
        """Take the costs ``(n, objectives)`` of the genomes just asked for; less is better in every column.

        A ``tell`` with a third parameter, without a default or called ``descriptors``, gets their descriptors
        ``(n, descriptors)`` there: means over the episodes
        that did not fail, NaN where all did.
        """
        ...

    def state(self) -> Mapping[str, Any]:
        """Return all that :meth:`restore` needs, the RNG's state included.

        Numbers, strings, None, arrays, and dicts and lists of these.
        """
        ...

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from ``state`` as if nothing had happened. Called on a fresh object."""
        ...


def takes_descriptors(optimiser: Optimiser) -> bool:
    """Return whether an optimiser's ``tell`` has a third parameter, without a default or called ``descriptors``."""
    try:
        parameters = list(inspect.signature(optimiser.tell).parameters.values())
    except (TypeError, ValueError):  # Python does not know
        return False
    if len(parameters) < 3 or parameters[2].kind not in (Parameter.POSITIONAL_ONLY, Parameter.POSITIONAL_OR_KEYWORD):
        return False
    return parameters[2].default is Parameter.empty or parameters[2].name == "descriptors"


@runtime_checkable
class AnsweringOptimiser(Optimiser, Protocol):
    """An optimiser whose answer need not be among the genomes that it asked for, such as a distribution's mean."""

    def answer(self) -> FloatArray:
        """Return the genomes ``(k, size)`` that it would answer with now; ``k`` may be 0.

        It may be asked before any ``ask``, as often as one likes, and changes nothing.
        """
        ...


@runtime_checkable
class StartableOptimiser(Optimiser, Protocol):
    """An optimiser that can begin from given genomes."""

    def start_from(self, genomes: FloatArray) -> None:
        """Begin from ``genomes`` ``(k, size)``, ``k`` at least 1. Called at most once, before the first ``ask``.

        Raises:
            ValueError: It cannot begin from these; the message says why.
        """
        ...


@dataclass(frozen=True)
class BehaviourMap:
    """Elites: the best genome that an optimiser knows of each kind of behaviour, ``k`` of them.

    The map is a grid over the ranges of all descriptors of the :class:`Problem`, in their order.
    """

    cells: tuple[int, ...]
    """Along each descriptor."""
    objective: str
    """Name of that which elites are the best in."""
    places: IntArray
    """``(k, descriptors)``: each elite's cell, counted from 0 at the lower end of each range; no two are equal."""
    genomes: FloatArray
    """``(k, size)``: each as it was asked for."""


@runtime_checkable
class MappingOptimiser(Optimiser, Protocol):
    """An optimiser that keeps a map of behaviours, which figures, reports and the Python interface show."""

    def behaviour_map(self) -> BehaviourMap:
        """Return the map of now. It may be asked at any time, as often as one likes, and changes nothing."""
        ...


@dataclass(frozen=True)
class TrackedRun:
    """A run that a :class:`Tracker` shows."""

    name: str
    """As its folder."""
    folder: str
    """Of the run; a tracker may write into a folder of its own name there."""
    seed: int
    config: Mapping[str, Any]
    """The resolved configuration, as plain data."""


@runtime_checkable
class Tracker(Protocol):
    """Shows how a run goes on, in another program: it is told numbers, and decides nothing.

    Factory: ``factory(run)`` with a :class:`TrackedRun`. It writes nothing before the first :meth:`log`, raises
    ``ImportError`` with what to install if it lacks a library, and is made several times for one run: for each session,
    and on trial, for a run that is not there. An error of a later call is told, and the run goes on without the
    tracker.
    """

    def logged(self, trial: int) -> int:
        """Return how many generations of a trial, from the first, have been logged in this and earlier sessions."""
        ...

    def log(self, trial: int, generation: int, scalars: Mapping[str, float]) -> None:
        """Take the numbers of a stored generation, by name; finite. Trials and generations count from 0.

        Each generation of a trial comes once, in order: that of the number that :meth:`logged` returned is the first.
        What is not kept when this returns may be lost: the process may be killed.
        """
        ...

    def close(self) -> None:
        """Free what it holds. Nothing is called afterwards."""
        ...
