# SPDX-License-Identifier: BSD-3-Clause
"""The configuration of a run: every key, its unit, its range and its default.

This is the one home of defaults. The sections that describe the world have the names of the structs in ``swarmevo.h``
and are copied into them key by key (``simulator.py``); the ranges there are the same, and a test compares them.
Readings of the paper behind the defaults: ``docs/paper-map.md``.
"""

from __future__ import annotations

import copy
import difflib
import importlib.resources
import math
import re
import reprlib
import secrets
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

import yaml
from annotated_types import Ge, Le, MaxLen, MinLen
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

FromList = Field(strict=False)  # YAML has lists, no tuples
Number = Annotated[float, Field(ge=-100, le=100)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Bearing = Annotated[float, Field(ge=-360, le=360)]
Extent = Annotated[float, Field(ge=0.01, le=10)]
Strength = Annotated[float, Field(ge=0, le=1e6)]
Speed = Annotated[float, Field(ge=-10, le=10)]
Jitter = Annotated[float, Field(ge=0, le=3.15)]
Vector = Annotated[tuple[Number, Number, Number], FromList]
CurvePoint = Annotated[tuple[Annotated[float, Field(ge=0, le=10)], Annotated[float, Field(ge=0, le=1e6)]], FromList]


class Section(BaseModel):
    """A part of the configuration: frozen, without unknown keys, NaN or converted types."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


# ---- the world -------------------------------------------------------------------------------------------------------


class Arena(Section):
    """The square, walled floor."""

    size: float = Field(default=1.0, ge=0.2, le=100)
    """Inner side of the square [m] (paper IV: 1 m^2)."""
    wall_height: float = Field(default=0.03, ge=0.005, le=1)
    """[m] (paper IV)."""
    target_wall: Literal["north", "south", "east", "west"] = "north"
    """The wall that the box is to be pushed to; north is y = +size/2."""


class Box(Section):
    """What is to be pushed."""

    size: Annotated[tuple[Extent, Extent, Extent], FromList] = (0.275, 0.18, 0.03)
    """Extent along its x, y, z [m] (paper IV)."""
    mass: float = Field(default=0.24, ge=0.001, le=1000)
    """[kg] (paper IV)."""
    pose: Vector = (0.0, 0.345, 0.0)
    """x [m], y [m], heading [rad] of its centre at the start."""
    velocity: Annotated[tuple[Speed, Speed, Speed], FromList] = (0.0, 0.0, 0.0)
    """x [m/s], y [m/s], about the vertical [rad/s] at the start."""


class Emitter(Section):
    """The RF source that the robots home in on."""

    position: Vector = (0.0, 0.345, 0.03)
    """[m], fixed in the world: above the box's start (paper IV)."""
    range: float = Field(default=0.3, ge=0.01, le=1000)
    """[m] (paper IV)."""
    strength: Annotated[tuple[Strength, Strength], FromList] = (1.0, 50.0)
    """Smallest and largest signal strength S (paper eq. 1)."""
    reach: Literal["range", "arena"] = "range"
    """Whether S is heard within `range` only, or in the whole arena."""


class Robot(Section):
    """The E-puck's body and drive."""

    radius: float = Field(default=0.035, ge=0.005, le=1)
    """Of the body [m] (ARGoS, the real E-puck)."""
    height: float = Field(default=0.05, ge=0.005, le=2)
    """Top of the body, where the RF receiver is [m]."""
    mass: float = Field(default=0.08, ge=0.001, le=100)
    """[kg] (paper IV: a third of the box; a real E-puck weighs 150 g)."""
    centre_of_mass: float = Field(default=0.015, ge=0.001, le=1)
    """Height above the floor [m] (Webots)."""
    wheel_radius: float = Field(default=0.0205, ge=0.001, le=1)
    """[m] (Webots, e-puck.org)."""
    axle_length: float = Field(default=0.053, ge=0.005, le=2)
    """Between the wheels [m] (e-puck.org)."""
    top_speed: float = Field(default=6.28, ge=0.01, le=1000)
    """Of a wheel [rad/s]: 0.129 m/s on the floor (Webots)."""
    motor_torque: float = Field(default=0.02, ge=1e-6, le=100)
    """Largest of a wheel's motor [N m]; with `drive: articulated`. Twice what makes a wheel slip."""
    caster_offset: float = Field(default=0.03, ge=0.001, le=1)
    """Front and rear caster, ahead of and behind the axle [m]."""
    caster_clearance: float = Field(default=0.0005, ge=0, le=0.01)
    """Between casters and floor when the robot stands upright [m]."""


class Team(Section):
    """How many robots there are, and where they start."""

    robots: int = Field(default=5, ge=1, le=64)
    """Number of robots (paper IV)."""
    genomes: Literal["shared", "individual"] = "shared"
    """One genome cloned to the team, or one for each robot."""
    start: Literal["row", "poses", "random"] = "row"
    """In rows from `row_y` on, heading south, away from the emitter (paper IV); at `start_poses`; or anywhere."""
    row_y: float = Field(default=-0.4, ge=-100, le=100)
    """y of the first row's centres [m]."""
    row_spacing: float = Field(default=0.12, ge=0.001, le=100)
    """Between neighbours and between rows [m]."""
    start_poses: Annotated[tuple[Vector, ...], FromList] = ()
    """For each robot x [m], y [m], heading [rad]; with `start: poses`."""
    start_region: Annotated[tuple[Number, Number, Number, Number], FromList] = (-0.45, 0.45, -0.45, 0.15)
    """x from, x to, y from, y to [m]; with `start: random`."""
    start_jitter: Annotated[tuple[Jitter, Jitter], FromList] = (0.01, 0.1)
    """Largest deviation of position [m] and heading [rad] from the start pose, drawn anew for each episode."""


class Sensors(Section):
    """Infrared and box sensors of each robot."""

    infrared_yaw_deg: Annotated[tuple[Bearing, ...], FromList, Field(min_length=8, max_length=8)] = (
        -17.2,
        -45.9,
        -90.0,
        -151.5,
        151.2,
        90.0,
        45.8,
        17.1,
    )
    """Bearings of the infrared sensors ps0..ps7, left positive [deg] (Webots)."""
    infrared_curve: Annotated[tuple[CurvePoint, ...], FromList, Field(min_length=2, max_length=16)] = (
        (0.0, 4095.0),
        (0.005, 3474.0),
        (0.01, 2211.0),
        (0.02, 676.0),
        (0.03, 306.0),
        (0.04, 164.0),
        (0.05, 90.0),
        (0.06, 56.0),
        (0.07, 34.0),
    )
    """Distance [m], raw value [1]; linear in between, 0 beyond (Webots <= 8.5). Readings are over the first value."""
    infrared_target: Literal["walls_and_robots", "all"] = "walls_and_robots"
    """What the infrared sensors see: at the top front, above the box, or the box too (paper IV)."""
    touch_yaw_deg: Annotated[tuple[Bearing, Bearing, Bearing, Bearing], FromList] = (45.0, 15.0, -15.0, -45.0)
    """Bearings of the four box sensors at the bottom front (paper IV), left positive [deg]."""
    touch_half_width_deg: float = Field(default=15.0, ge=0.1, le=180)
    """Half the sector that each box sensor covers [deg]."""
    touch_range: float = Field(default=0.002, ge=0.0001, le=10)
    """Distance between body and box up to which a box sensor answers [m]."""
    touch_mode: Literal["binary", "graded", "force"] = "binary"
    """0 or 1; 1 - distance / touch_range; or the normal force over the robot's traction limit."""


class Noise(Section):
    """Random disturbances, drawn anew in each control step."""

    infrared: Fraction = 0.05
    """Relative standard deviation of a reading (Webots 5 %)."""
    infrared_at_contact: Fraction = 0.005
    """The same at distance 0 (Webots 0.5 %)."""
    wheels: Fraction = 0.05
    """Largest relative error of a wheel's speed, uniform (Enki 5 %)."""
    rf: Fraction = 0.0
    """Relative standard deviation of S."""


class Physics(Section):
    """Of ODE, which moves the bodies."""

    time_step: float = Field(default=0.05, ge=0.0005, le=0.05)
    """[s]; the default is the largest whose errors docs/validation.md finds below 1 % of the way."""
    gravity: float = Field(default=9.81, ge=0.1, le=100)
    """[m/s^2]."""
    wheel_friction: float = Field(default=1.0, ge=0, le=10)
    """Coulomb coefficient between wheel and floor."""
    box_friction: float = Field(default=0.58, ge=0, le=10)
    """Coulomb coefficient between box and floor: with 0.58 three robots move the box and two do not."""
    side_friction: float = Field(default=0.3, ge=0, le=10)
    """Coulomb coefficient between robots, box and walls."""
    contact_erp: float = Field(default=0.2, ge=0.01, le=1)
    """ODE's error reduction parameter of contacts."""
    contact_cfm: float = Field(default=1e-5, ge=1e-9, le=0.1)
    """ODE's constraint force mixing of contacts [s/kg]."""
    drive: Literal["driven_contacts", "articulated"] = "driven_contacts"
    """A robot is one body whose wheels are moving contact surfaces; or, as the reference, a chassis and two wheel
    bodies on hinges with motors."""


class Episode(Section):
    """How long a team is tried."""

    horizon: float = Field(default=180.0, ge=0.001, le=1e5)
    """[s], a whole number of control periods (paper Table I)."""
    control_period: float = Field(default=0.1, ge=0.0005, le=10)
    """[s], a whole number of time steps."""


# ---- the evolution ---------------------------------------------------------------------------------------------------


def _named(value: Any) -> Any:
    """Read ``name`` as ``{name: {}}`` and a list of names likewise, a name without options as one with none."""
    if isinstance(value, str):
        return {value: {}}
    if isinstance(value, list) and all(isinstance(name, str) for name in value):
        return {name: {} for name in value}
    if isinstance(value, Mapping):
        return {name: {} if options is None else options for name, options in value.items()}
    return value


def _plain(options: dict[str, Any]) -> dict[str, Any]:
    """Refuse what YAML or JSON cannot give back: options travel as text to the run folder and to workers."""
    for name, value in options.items():
        if not _is_plain(value):
            raise ValueError(f"{name}: expected a finite number, text, true, false, null or a list, got {value}")
    return options


def _is_plain(value: Any) -> bool:
    if isinstance(value, Mapping):
        return all(isinstance(key, str) and _is_plain(entry) for key, entry in value.items())
    if isinstance(value, list):
        return all(map(_is_plain, value))
    if isinstance(value, float):
        return math.isfinite(value)  # JSON knows no other
    return value is None or isinstance(value, bool | int | str)


Options = Annotated[dict[str, Any], AfterValidator(_plain)]
Plugin = Annotated[dict[str, Options], BeforeValidator(_named), Field(min_length=1, max_length=1)]
Plugins = Annotated[dict[str, Options], BeforeValidator(_named), Field(min_length=1)]


class Evolution(Section):
    """The budget."""

    generations: int = Field(default=100, ge=1, le=1_000_000)
    """Number of generations (paper Table I)."""
    population: int = Field(default=30, ge=1, le=1_000_000)
    """Size of the population (paper Table I)."""
    trials: int = Field(default=1, ge=1, le=65535)
    """Independent evolutions (paper Table I: 10)."""
    repeats: int = Field(default=3, ge=1, le=65535)
    """Episodes per evaluation; objectives are their mean."""
    seed: int | None = Field(default=None, ge=0, le=2**63 - 1)
    """Of everything random in the run; drawn, printed and stored if not given."""
    on_fault: Literal["fail", "worst"] = "fail"
    """When an episode fails: end the run, or give it the worst objectives, record why, and go on."""
    episode_timeout: float | None = Field(default=None, ge=0.01, le=1e6)
    """[s] of computing that an episode may take before it counts as failed; needs a process for each worker."""


class Config(Section):
    """Everything that decides a run's result."""

    arena: Arena = Arena()
    box: Box = Box()
    emitter: Emitter = Emitter()
    robot: Robot = Robot()
    team: Team = Team()
    sensors: Sensors = Sensors()
    noise: Noise = Noise()
    physics: Physics = Physics()
    episode: Episode = Episode()
    controller: Plugin = Field(default={"feedforward": {}}, validate_default=True)
    """The controller plugin and its options."""
    fitness: Plugins = Field(default={"box_pushing": {}, "hidden_neurons": {}}, validate_default=True)
    """The fitness plugins and their options; their objectives are put side by side."""
    optimiser: Plugin = Field(default={"pde": {}}, validate_default=True)
    """The optimiser plugin and its options."""
    evolution: Evolution = Evolution()


# ---- reading ---------------------------------------------------------------------------------------------------------


class ConfigError(Exception):
    """A configuration cannot be used. ``errors`` holds one line for each thing that is wrong."""

    def __init__(self, errors: Sequence[str]) -> None:
        super().__init__("; ".join(errors))
        self.errors = list(errors)


def load(
    source: str | Path | None,
    overrides: Sequence[str] = (),
    check: Callable[[Config], list[str]] | None = None,
) -> Config:
    """Read a configuration.

    Args:
        source: A YAML file, or the bare name of a packaged configuration, such as ``paper``; None is ``quick``.
        overrides: ``section.key=value``, the value in YAML; they win over the file, later ones over earlier ones. A
            plugin's bare name (``optimiser=pde``) keeps the options that the file gives it.
        check: Further errors of a configuration whose keys are all right one by one, one line each.

    Raises:
        ConfigError: With everything that is wrong, ``check`` included.
    """
    errors: list[str] = []
    raw = _parse(*_text(source or "quick"), errors)
    for override in overrides:
        _override(raw, override, errors)
    config, missing = _build(raw, errors)
    if check is not None:
        errors += [line for line in check(config) if not _stems_from(line, missing)]
    if errors:
        raise ConfigError(list(dict.fromkeys(errors)))
    return config


def dump(config: Config) -> str:
    """Return the configuration as YAML, every key spelled out; :func:`load` reads an equal one from it."""
    return yaml.dump(config.model_dump(), Dumper=_Dumper, sort_keys=False, width=120)


def seeded(config: Config) -> Config:
    """Return the configuration with a seed, drawn if it has none."""
    if config.evolution.seed is not None:
        return config
    evolution = config.evolution.model_copy(update={"seed": secrets.randbelow(2**31)})
    return config.model_copy(update={"evolution": evolution})


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return the end of an error line: the nearest of the known words, or nothing if none is near."""
    return "".join(f"; did you mean {match}?" for match in _close(word, known))


# ---- from a file to plain data ---------------------------------------------------------------------------------------

_LARGEST_FILE = 1_000_000  # [bytes]: what is larger is no configuration


def _packaged() -> dict[str, Traversable]:
    """Return the configurations that come with swarmevo, by name."""
    folder = importlib.resources.files("swarmevo") / "configs"
    if not folder.is_dir():  # in a checkout
        folder = Path(__file__).parents[1] / "configs"
    return {entry.name.removesuffix(".yaml"): entry for entry in folder.iterdir() if entry.name.endswith(".yaml")}


def _text(source: str | Path) -> tuple[str, str]:
    """Return what to call a source in messages, and its text."""
    packaged = _packaged()
    file = packaged.get(str(source)) or Path(source)
    try:
        with file.open("rb") as stream:
            data = stream.read(_LARGEST_FILE + 1)
        if len(data) > _LARGEST_FILE:
            raise ConfigError([f"{source}: expected a configuration of at most {_LARGEST_FILE} bytes"])
        return str(source), data.decode("utf-8-sig")
    except FileNotFoundError:
        names = ", ".join(sorted(packaged))
        hint = did_you_mean(str(source), packaged) or f"; packaged configurations: {names}"
        raise ConfigError([f"{source}: no such file{hint}"]) from None
    except IsADirectoryError:
        raise ConfigError([f"{source}: expected a YAML file, got a directory"]) from None
    except UnicodeDecodeError:
        raise ConfigError([f"{source}: expected YAML text in UTF-8, got binary data"]) from None
    except (OSError, ValueError) as error:
        raise ConfigError([f"{source!s:.200}: cannot be read: {error}".replace("\0", "\\0")]) from None


class _Loader(yaml.SafeLoader):
    """YAML as JSON knows it: 1e-5 is a number, 010 is ten, dates are text; keys are text, each given once."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012 (PyYAML's own shape)

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.errors: list[str] = []

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = True) -> dict[Any, Any]:
        mapping: dict[str, Any] = {}
        lines: dict[str, int] = {}
        for key_node, value_node in node.value:
            key, line = str(key_node.value), key_node.start_mark.line + 1
            if not isinstance(key_node, yaml.ScalarNode):
                self.errors.append(f"line {line}: expected a name before the colon, got a list or a mapping")
            elif key in mapping:
                self.errors.append(f"line {line}: {key} is given twice, first in line {lines[key]}")
            else:
                mapping[key], lines[key] = self.construct_object(value_node, deep=True), line
        return mapping

    def construct_integer(self, node: yaml.ScalarNode) -> int:
        return int(node.value.replace("_", ""))


_TAG = "tag:yaml.org,2002:"
for _tag, _pattern, _first in (
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"(?i:yes|no|true|false|on|off)", list("yYnNtTfFoO")),
    ("int", r"[-+]?[0-9][0-9_]*", list("-+0123456789")),
    ("float", r"[-+]?([0-9][0-9_]*\.?[0-9_]*|\.[0-9][0-9_]*)([eE][-+]?[0-9]+)?", list("-+.0123456789")),
    ("float", r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)", list("-+.")),
):
    _Loader.add_implicit_resolver(_TAG + _tag, re.compile(rf"(?:{_pattern})\Z"), _first)
_Loader.yaml_constructors = {
    _TAG + "null": _Loader.construct_yaml_null,
    _TAG + "bool": _Loader.construct_yaml_bool,
    _TAG + "int": _Loader.construct_integer,
    _TAG + "float": _Loader.construct_yaml_float,
    _TAG + "str": _Loader.construct_yaml_str,
    _TAG + "seq": _Loader.construct_yaml_seq,
    _TAG + "map": _Loader.construct_mapping,
    None: _Loader.construct_undefined,
}


class _Dumper(yaml.SafeDumper):
    """Writes what :class:`_Loader` reads back."""

    yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers

    def ignore_aliases(self, data: Any) -> bool:
        return True

    def represent_in_one_line(self, data: Sequence[Any]) -> yaml.Node:
        return self.represent_sequence(_TAG + "seq", data, flow_style=True)


_Dumper.add_representer(list, _Dumper.represent_in_one_line)
_Dumper.add_representer(tuple, _Dumper.represent_in_one_line)


def _yaml(text: str) -> tuple[Any, list[str]]:
    """Return the data in a YAML text, and its errors, one line each."""
    try:
        loader = _Loader(text)
        return loader.get_single_data(), loader.errors
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        return None, [where + ", ".join(filter(None, (error.context, error.problem)))]
    except RecursionError:
        return None, ["nested too deeply"]
    except (yaml.YAMLError, ValueError) as error:
        return None, [str(error).split("\n")[0]]


def _parse(name: str, text: str, errors: list[str]) -> dict[str, Any]:
    raw, found = _yaml(text)
    lines = [f"{name}: {line}" for line in found]
    if isinstance(raw, dict):
        errors += lines
        return raw
    if not lines:
        got = "an empty file" if raw is None else _show(raw)
        lines = [f"{name}: expected sections ({', '.join(Config.model_fields)}), got {got}"]
    raise ConfigError(lines)


def _override(raw: dict[str, Any], override: str, errors: list[str]) -> None:
    """Set one key of ``raw`` as ``section.key=value`` says."""
    path, equals, text = override.partition("=")
    *sections, key = path.strip().split(".")
    if not equals or not all([*sections, key]):
        errors.append(f"--set {override}: expected section.key=value")
        return
    value, found = _yaml(text)
    if found:
        errors += [f"--set {override}: {line}" for line in found]
        return

    # A plugin's options are set beside those it has; its bare name keeps them.
    top = (sections or [key])[0]
    if top in _PLUGINS:
        raw[top] = _named(raw.get(top, copy.deepcopy(Config.model_fields[top].default)))
        if not sections and isinstance(value, str) and isinstance(raw[top], Mapping):
            value = {value: raw[top].get(value, {})}

    section = raw
    for name in sections:
        section = section.setdefault(name, {})
        if not isinstance(section, dict):
            errors.append(f"--set {override}: {name} is not a section, but {_show(section)}")
            return
    section[key] = value


# ---- from plain data to a Config -------------------------------------------------------------------------------------

_PLUGINS = ("controller", "fitness", "optimiser")

_CAUSES = {
    "box": ("arena.size", "box.size", "box.pose"),
    "emitter": ("emitter",),
    "team": ("arena.size", "box.size", "box.pose", "robot.radius", "team"),
    "robot": ("robot",),
    "sensors": ("sensors",),
    "episode": ("physics.time_step", "episode"),
}
"""For an error of ``check`` that begins with a section: the keys it may come from."""


def _build(raw: dict[str, Any], errors: list[str]) -> tuple[Config, set[str]]:
    """Return the configuration and the paths of the keys whose default stands in, because they are wrong."""
    sound = copy.deepcopy(raw)
    missing: set[str] = set()
    while True:  # what is wrong about a whole shows only when its parts are sound
        try:
            return Config.model_validate(sound), missing
        except ValidationError as error:
            problems = [problem for problem in error.errors() if not _follows(problem)] or error.errors()
        errors += map(_line, problems)
        missing |= {_drop(sound, problem["loc"]) for problem in problems}


def _follows(problem: ErrorDetails) -> bool:
    """Whether it says that a list is too short only because pydantic does not count the wrong entries."""
    return problem["type"] == "too_short" and len(problem["input"]) >= problem["ctx"]["min_length"]


def _drop(raw: dict[str, Any], path: tuple[int | str, ...]) -> str:
    """Take the wrong entry out of ``raw``; return the path of the key that is missed."""
    section, *rest = map(str, path)
    if not rest:
        raw.pop(section, None)
        return section
    key = rest[0]
    raw[section].pop(key, None)
    if section in _PLUGINS:
        raw[section][key] = {}
    return ".".join((section, *_close(key, _keys(section))[:1])) or key


def _stems_from(line: str, missing: Iterable[str]) -> bool:
    """Whether an error of ``check`` may be there only because a default stands in for a wrong key."""
    section = re.split(r"\W", line)[0]
    return any(
        f"{cause}.".startswith(f"{path}.") or path.startswith(f"{cause}.")
        for cause in _CAUSES.get(section, ())
        for path in missing
    )


# ---- what to say about a wrong entry ---------------------------------------------------------------------------------


def _line(problem: ErrorDetails) -> str:
    """Return one line for one of pydantic's errors: where, what was expected, what came, what to do."""
    kind, path, value = problem["type"], problem["loc"], problem["input"]
    if kind == "extra_forbidden":
        return _unknown(*map(str, path))
    if kind == "value_error":
        return f"{_dotted(path)}.{problem['msg'].removeprefix('Value error, ')}"
    if kind == "missing":  # no key is required: it is a list that is too short
        path = path[:-1]
    expected, unit = _expected(path), _unit(path)
    return f"{_dotted(path)}: expected {expected}{unit and f' [{unit}]'}, got {_show(value)}{_hint(value, unit)}"


def _unknown(*path: str) -> str:
    """Return the line about a key that is none."""
    *section, key = path
    known = _keys(*section)
    elsewhere = [f"{name}.{key}" for name in Config.model_fields if key in _keys(name)]
    close = elsewhere or [".".join((*section, name)) for name in _close(key, known)]
    if close:
        return f"{_dotted(path)}: unknown key; did you mean {close[0]}?"
    return f"{_dotted(path)}: unknown key; {' '.join(section) or 'the configuration'} has {', '.join(known)}"


def _keys(section: str = "") -> list[str]:
    """Return the keys of a section, or the sections; a plugin's options are not known here."""
    model = Config.model_fields[section].annotation if section else Config
    return list(model.model_fields) if isinstance(model, type) and issubclass(model, Section) else []


def _close(word: str, known: Iterable[str]) -> list[str]:
    return difflib.get_close_matches(word, known, n=1)


def _field(path: tuple[int | str, ...]) -> FieldInfo:
    section, *keys = map(str, path)
    field = Config.model_fields[section]
    model = field.annotation
    if keys and isinstance(model, type) and issubclass(model, Section):
        return model.model_fields[keys[0]]
    return field


def _type(path: tuple[int | str, ...]) -> tuple[Any, list[Any]]:
    """Return type and bounds of what belongs at ``path``, which may lead into lists."""
    field = _field(path)
    annotation, bounds = field.annotation, field.metadata
    for index in path[2:]:
        entries = _entries(annotation)
        annotation, bounds = entries[int(index) if len(entries) > 1 else 0]
    return annotation, bounds


def _expected(path: tuple[int | str, ...]) -> str:
    """Describe what belongs at ``path``."""
    if path[0] not in _PLUGINS:
        return _describe(*_type(path))
    if len(path) > 1:
        return "options, {option: value}"
    one = any(isinstance(bound, MaxLen) for bound in _field(path).metadata)
    return f"{'one plugin' if one else 'plugins'} by name, {{name: {{option: value}}}}"


def _entries(annotation: Any) -> list[tuple[Any, list[Any]]]:
    """Return type and bounds of each entry of an annotated tuple."""
    entries = []
    for entry in get_args(annotation):
        if entry is not ...:
            inner, *infos = get_args(entry)
            entries.append((inner, [bound for info in infos for bound in info.metadata]))
    return entries


def _describe(annotation: Any, bounds: Iterable[Any], plural: bool = False) -> str:
    if get_origin(annotation) is Literal:
        return "one of " + ", ".join(get_args(annotation))
    if get_origin(annotation) is tuple:
        entries = _entries(annotation)
        kind, limits = entries[0]
        same = all(entry == entries[0] for entry in entries)
        many = "lists of " if plural else "a list of "
        return many + _count(annotation, bounds) + _describe(kind, limits if same else (), plural=True)
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return f"a section ({', '.join(annotation.model_fields)})"
    number = "number" if annotation is float else "whole number"
    low = [f" from {_bound(bound.ge)}" for bound in bounds if isinstance(bound, Ge)]
    high = [f" to {_bound(bound.le)}" for bound in bounds if isinstance(bound, Le)]
    return "".join([f"{number}s" if plural else f"a {number}", *low, *high])


def _count(annotation: Any, bounds: Iterable[Any]) -> str:
    """Return how many entries a tuple has, in words that end in a space."""
    if get_args(annotation)[-1] is not ...:
        return f"{len(get_args(annotation))} "
    least = next((bound.min_length for bound in bounds if isinstance(bound, MinLen)), None)
    most = next((bound.max_length for bound in bounds if isinstance(bound, MaxLen)), None)
    if least is None:
        return ""
    return f"{least} " if least == most else f"{least} to {most} "


def _bound(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _unit(path: tuple[int | str, ...]) -> str:
    """Return the unit of what belongs at ``path``, as the field's docstring has it in brackets; "" if none."""
    units = re.findall(r"\[([^]]+)\]", _field(path).description or "") if len(path) > 1 else []
    if len(units) > 1 and get_origin(_type(path)[0]) is not tuple:
        units = [units[int(path[-1])]]
    return "" if units == ["1"] else ", ".join(units)


def _dotted(path: Iterable[int | str]) -> str:
    names = [f"[{part}]" if isinstance(part, int) else f".{part}" for part in path]
    return ascii("".join(names).removeprefix("."))[1:-1]


def _show(value: Any) -> str:
    """Return a value as one short line, in YAML's words."""
    words = {None: "nothing", True: "true", False: "false"}
    if value is None or isinstance(value, bool):
        return words[value]
    if isinstance(value, dict):
        return f"the keys {reprlib.repr(list(value))[1:-1]}" if value else "no keys"
    return reprlib.repr(value)


def _hint(value: Any, unit: str) -> str:
    """Say what to do about text in the place of a number."""
    if not isinstance(value, str):
        return ""
    if type(_yaml(value)[0]) in (int, float):
        return "; write it without quotes"
    if re.match(r"[-+]?[0-9.]+ *[^0-9. ]+$", value):
        return f"; write the number alone, in {unit}" if unit else "; write the number alone"
    return ""
