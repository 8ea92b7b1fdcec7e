# SPDX-License-Identifier: BSD-3-Clause
"""Reading configurations: what is accepted, what is refused, and what is said about it."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from swarmevo import config
from swarmevo.config import Config, paths
from swarmevo.config import messages as config_messages
from swarmevo.config.worlds import Worlds
from swarmevo.errors import ConfigError
from swarmevo.plugins.team import Team, load_config

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def load(tmp_path: Path) -> Any:
    """Load a text, or bytes, as a file."""

    def load_text(text: str | bytes, *overrides: str, check: Any = None) -> Config:
        file = tmp_path / "my.yaml"
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return config.load(file, overrides, check)

    return load_text


@pytest.fixture
def errors(load: Any) -> Any:
    """Return the errors of a text."""

    def errors_of(text: str | bytes, *overrides: str, check: Any = None) -> list[str]:
        with pytest.raises(ConfigError) as caught:
            load(text, *overrides, check=check)
        assert all("\n" not in line for line in caught.value.errors)
        return list(caught.value.errors)

    return errors_of


# ---- what is accepted ------------------------------------------------------------------------------------------------


def test_what_a_file_does_not_name_has_its_default(load: Any) -> None:
    found = load("evolution: {population: 12}")
    assert found.evolution.population == 12
    assert found.arena == Config().arena


def test_nothing_means_quick() -> None:
    assert config.load(None) == config.load("quick") == config.load(CONFIGS / "quick.yaml")


def test_an_empty_mapping_is_all_defaults(load: Any) -> None:
    assert load("{}") == Config()


@pytest.mark.parametrize("text", ["1e-5", "1E-5", "1.0e-5", ".1e-4", "0.00001", "+1e-05"])
def test_floats_with_and_without_a_dot(load: Any, text: str) -> None:
    assert load(f"physics: {{contact_cfm: {text}}}").physics.contact_cfm == 1e-5


def test_whole_numbers_are_numbers_too(load: Any) -> None:
    size = load("arena: {size: 2}").arena.size
    assert (size, type(size)) == (2.0, float)


def test_leading_zeros_do_not_mean_octal(load: Any) -> None:
    assert load("evolution: {seed: 010}").evolution.seed == 10


@pytest.mark.parametrize("text", ["optimiser: pde", "optimiser: {pde: }", "optimiser: {pde: {}}", "optimiser: [pde]"])
def test_a_plugin_without_options(load: Any, text: str) -> None:
    assert load(text).optimiser == {"pde": {}}


def test_a_byte_order_mark_is_no_harm(load: Any) -> None:
    assert load(b"\xef\xbb\xbf{}") == Config()


# ---- overrides -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("override", "section", "key", "value"),
    [
        ("evolution.population=60", "evolution", "population", 60),
        ("physics.contact_cfm=1e-6", "physics", "contact_cfm", 1e-6),
        ("box.size=[0.1, 0.2, 0.03]", "box", "size", (0.1, 0.2, 0.03)),
        ("arena.target_wall=east", "arena", "target_wall", "east"),
        ("evolution.seed=", "evolution", "seed", None),
    ],
)
def test_an_override_wins_over_the_file(load: Any, override: str, section: str, key: str, value: object) -> None:
    found = load("evolution: {population: 5, seed: 3}\nphysics: {contact_cfm: 1e-4}", override)
    assert getattr(getattr(found, section), key) == value


@pytest.mark.parametrize(
    ("overrides", "key"),
    [
        (["team.robots=3", "team.robots=4"], "team.robots"),
        (["team.robots=3", "team.robots=3"], "team.robots"),
        (["arena={size: 2}", "arena.size=3"], "arena"),
        (["arena.wall_height=0.1", "arena={size: 2}"], "arena.wall_height"),
        (["optimiser=pde", "optimiser=other"], "optimiser"),
        (["optimiser.pde.crossover_rate=1", "optimiser=other"], "optimiser.pde.crossover_rate"),
        (["fitness.box_pushing.strength=9", "fitness=[box_pushing]"], "fitness.box_pushing.strength"),
        (["arena.size=.nan", "arena.size=.nan"], "arena.size"),
    ],
)
def test_a_key_is_set_once(errors: Any, overrides: list[str], key: str) -> None:
    """Case 75: an override that undoes another one is refused, whichever comes first."""
    found = errors("{}", *overrides)
    assert f"{key}: set twice, by {overrides[0]} and by {overrides[1]}; give it once" in found
    assert sum("set twice" in line for line in found) == 1


@pytest.mark.parametrize(
    "overrides",
    [
        ["arena={size: 2}", "arena.wall_height=0.1"],
        ["optimiser=pde", "optimiser.pde.crossover_rate=0.5"],
        ["optimiser.pde.crossover_rate=0.5", "optimiser=pde"],
        ["fitness=[box_pushing]", "fitness.box_pushing.strength=9"],
        ["fitness=[box_pushing, hidden_neurons]", "team.robots=3"],
    ],
)
def test_overrides_may_add_to_each_other(load: Any, overrides: list[str]) -> None:
    load("optimiser: {pde: {crossover_rate: 0.1}}", *overrides)


PUCKS = "scene.movables=[{mass: 0.1}, {mass: 0.2}]"


@pytest.mark.parametrize(
    ("overrides", "key", "value"),
    [
        ([PUCKS, "scene.movables.1.size.2=0.05"], "scene.movables.1.size", (0.275, 0.18, 0.05)),
        ([PUCKS, "scene.movables.0.shape=cylinder"], "scene.movables.0.shape", "cylinder"),
        (["box.pose.2=1.5"], "box.pose", (0.0, 0.345, 1.5)),
        (["robot.preset=thymio_ii", "sensors.infrared_yaw_deg.6=149"], "sensors.infrared_yaw_deg.6", 149),
        (["sensors.infrared_curve.0.1=4000"], "sensors.infrared_curve.0", (0, 4000)),
    ],
)
def test_an_entry_of_a_list_is_set(load: Any, overrides: list[str], key: str, value: Any) -> None:
    assert paths.value_at(load("{}", *overrides), key) == value


def test_an_alias_is_not_set_with_what_it_stands_for(load: Any) -> None:
    text = "scene:\n  movables:\n    - &puck {mass: 0.1, size: [0.1, 0.1, 0.03]}\n    - *puck"
    made = load(text, "scene.movables.0.mass=0.3", "scene.movables.1.size.2=0.05")
    assert [(one.mass, one.size[2]) for one in made.scene.movables] == [(0.3, 0.03), (0.1, 0.05)]


def test_worlds_are_set_one_by_one(load: Any) -> None:
    assert load("worlds: [{}, {}]", "worlds.1.box.mass=0.3").worlds == ({}, {"box.mass": 0.3})


def test_an_option_is_set_beside_the_others(load: Any) -> None:
    found = load("optimiser: {pde: {mutation_rate: 0.1}}", "optimiser.pde.crossover_rate=0.9")
    assert found.optimiser == {"pde": {"mutation_rate": 0.1, "crossover_rate": 0.9}}


def test_an_option_of_a_default_plugin_keeps_the_other_plugins(load: Any) -> None:
    found = load("{}", "fitness.box_pushing.sum_covers=motion")
    assert found.fitness == {"box_pushing": {"sum_covers": "motion"}, "hidden_neurons": {}}


def test_overrides_leave_the_defaults_alone(load: Any) -> None:
    load("{}", "optimiser.pde.crossover_rate=0.9")
    assert load("{}").optimiser == {"pde": {}}


def test_naming_the_plugin_keeps_its_options(load: Any) -> None:
    text = "optimiser: {pde: {mutation_rate: 0.1}}"
    assert load(text, "optimiser=pde").optimiser == {"pde": {"mutation_rate": 0.1}}
    assert load(text, "optimiser={pde: {}}").optimiser == {"pde": {}}
    assert load(text, "optimiser=other", "optimiser.other.eta=3").optimiser == {"other": {"eta": 3}}


@pytest.mark.parametrize(
    ("override", "error"),
    [
        ("population", "--set population: expected section.key=value"),
        ("=3", "--set =3: expected section.key=value"),
        ("evolution..population=3", "--set evolution..population=3: expected section.key=value"),
        ("arena.size=[", "--set arena.size=[: line 1, column 2: while parsing a flow node, expected the node content"),
        ("box.pose.3=1", "--set box.pose.3=1: expected an entry of box.pose, 0 to 2, got 3"),
        ("box.pose[2]=1", "--set box.pose[2]=1: expected section.key=value; write an entry of a list as box.pose.2"),
        ("scene.movables.0.mass=1", "--set scene.movables.0.mass=1: expected an entry of scene.movables, which"),
        ("arena.size.x=3", "--set arena.size.x=3: size is not a section, but 2"),
        ("arena.sice=3", "arena.sice: unknown key; did you mean arena.size?"),
    ],
)
def test_a_wrong_override(errors: Any, override: str, error: str) -> None:
    (line,) = errors("arena: {size: 2}", override)
    assert line.startswith(error)


# ---- files that are none ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "error"),
    [
        ("", "expected sections (arena, box, "),
        ("# only a comment\n", "got an empty file"),
        ("[arena, box]", "got ['arena', 'box']"),
        ("arena", "got 'arena'"),
        ("arena: [1, 2", "line 1, column 13: while parsing a flow sequence, expected ',' or ']'"),
        ("arena:\n\tsize: 1", "line 2, column 1: while scanning for the next token"),
        ("a: 1\n---\nb: 2", "expected a single document"),
        ("!!python/object/apply:os.system [ls]", "could not determine a constructor for the tag"),
        ("box: !!set {a, b}", "could not determine a constructor for the tag"),
        ("arena: &a {size: *a}", "found unconstructable recursive node"),
        ("? [1, 2]\n: 3", "line 1: expected a name before the colon, got a list or a mapping"),
        ("[" * 5000, "line 1, column 51: nested too deeply, expected at most 50 levels"),
        ("a: [" + "1," * 20_000 + "]", "expected at most 20000 values, aliases written out, got more"),
        (b"\x89PNG\r\n\x1a\n", "expected YAML text in UTF-8, got binary data"),
        (b"arena: \0", "special characters are not allowed"),
        (b" " * 1_000_001, "expected a configuration of at most 1000000 bytes"),
        ("evolution: {seed: " + "1" * 5000 + "}", "Exceeds the limit (4300 digits)"),
    ],
)
def test_a_file_that_is_no_configuration(errors: Any, content: str | bytes, error: str) -> None:
    (line,) = errors(content)
    assert "my.yaml: " in line
    assert error in line


BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in itertools.pairwise("abcdefgh")
)


@pytest.mark.parametrize("place", ["{}", "optimiser:\n  pde:\n{}", "box:\n{}", "fitness:\n  any:\n    deep:\n{}"])
def test_an_alias_bomb_is_refused_at_once(errors: Any, place: str) -> None:
    """Case 27: wherever it is, 43 million values in 300 bytes."""
    indent = " " * 2 * place.count("\n")
    (line,) = errors(place.format("".join(indent + entry for entry in BOMB.splitlines(keepends=True))))
    assert "expected at most 20000 values, aliases written out, got more" in line


def test_an_alias_bomb_in_an_override(errors: Any) -> None:
    """Case 27."""
    (line,) = errors("{}", f"optimiser.pde={{{', '.join(BOMB.splitlines())}}}")
    assert line.startswith("--set optimiser.pde=")
    assert "expected at most 20000 values" in line


def test_an_alias_is_what_it_stands_for(load: Any) -> None:
    found = load("arena: {size: &wide 2.5}\noptimiser: {any: &it {a: *wide, b: [*wide, x]}}\nfitness: {any: *it}")
    assert found.optimiser == found.fitness == {"any": {"a": 2.5, "b": [2.5, "x"]}}


@pytest.mark.parametrize("value", ["1e999", "1" + "0" * 400, ".nan", "[.inf]", '"\\ud800"'])
def test_an_option_that_cannot_be_stored_is_refused(errors: Any, value: str) -> None:
    """Case 27: a huge number, and text that is none."""
    (line,) = errors(f"optimiser: {{any: {{option: {value}}}}}")
    assert line.startswith("optimiser.any.option: expected a finite number, text, true, false, null or a list, got ")
    assert len(line) < 200


@pytest.mark.parametrize("section", list(Config.model_fields))
@pytest.mark.parametrize("nothing", ["", " ~", "\n  # size: 2", " null"])
def test_a_section_without_keys_has_its_defaults(load: Any, section: str, nothing: str) -> None:
    """Case 70: all its keys are commented out."""
    assert load(f"{section}:{nothing}\n") == Config()


def test_an_override_in_a_section_without_keys(load: Any) -> None:
    """Case 70."""
    found = load("arena:\noptimiser:\n", "arena.size=2", "optimiser.pde.crossover_rate=0.5")
    assert (found.arena.size, found.optimiser) == (2.0, {"pde": {"crossover_rate": 0.5}})


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(
        ConfigError, match=r"nowhere\.yaml: no such file; packaged configurations: aggregation, best, .* shaped"
    ):
        config.load(tmp_path / "nowhere.yaml")
    with pytest.raises(ConfigError, match=r"^quik: no such file; did you mean quick\?$"):
        config.load("quik")


def test_a_folder(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"expected a YAML file, got a directory"):
        config.load(tmp_path)


def test_duplicate_keys_are_named_with_their_lines(errors: Any) -> None:
    found = errors("box:\n  mass: 1\n  mass: 2\nbox: {}\n")
    assert [line.split(": ", 1)[1] for line in found] == [
        "line 3: mass is given twice, first in line 2",
        "line 4: box is given twice, first in line 1",
    ]


# ---- wrong entries ---------------------------------------------------------------------------------------------------

WRONG = {
    "arena: {siz: 1}": "arena.siz: unknown key; did you mean arena.size?",
    "arena: {colour: 1}": "arena.colour: unknown key; arena has shape, size, sides, corners, wall_height, target_wall",
    "optimizer: pde": "optimizer: unknown key; did you mean optimiser?",
    "population: 30": "population: unknown key; did you mean evolution.population?",
    "7: 8": "7: unknown key; the configuration has arena, box, emitter, scene, robot, team, sensors, noise, physics, "
    "episode, worlds, vary, controller, fitness, optimiser, evolution",
    "box: {mass: 240 g}": "box.mass: expected a number from 0.001 to 1000 [kg], got '240 g'; "
    "write the number alone, in kg",
    'box: {mass: "0.24"}': "box.mass: expected a number from 0.001 to 1000 [kg], got '0.24'; write it without quotes",
    "box: {mass: heavy}": "box.mass: expected a number from 0.001 to 1000 [kg], got 'heavy'",
    "box: {mass: -0.24}": "box.mass: expected a number from 0.001 to 1000 [kg], got -0.24",
    "box: {mass: .nan}": "box.mass: expected a number from 0.001 to 1000 [kg], got nan",
    "box: {mass: .inf}": "box.mass: expected a number from 0.001 to 1000 [kg], got inf",
    "box: {mass: true}": "box.mass: expected a number from 0.001 to 1000 [kg], got true",
    "box: {mass: }": "box.mass: expected a number from 0.001 to 1000 [kg], got nothing",
    "box: {mass: [1]}": "box.mass: expected a number from 0.001 to 1000 [kg], got [1]",
    "box: {mass: {kg: 1}}": "box.mass: expected a number from 0.001 to 1000 [kg], got the keys 'kg'",
    "box: {size: [1, 2]}": "box.size: expected a list of 3 numbers from 0.01 to 10 [m], got [1, 2]",
    "box: {size: [1, 2, 3, 4]}": "box.size: expected a list of 3 numbers from 0.01 to 10 [m], got [1, 2, 3, 4]",
    'box: {size: [1, "2", 3]}': "box.size[1]: expected a number from 0.01 to 10 [m], got '2'; write it without quotes",
    "box: {pose: [0, 0, 1000]}": "box.pose[2]: expected a number from -100 to 100 [rad], got 1000",
    "box: [0.2, 0.3]": "box: expected a section (shape, size, mass, friction, feet, pose, velocity, start, "
    "start_region), got [0.2, 0.3]",
    "noise: []": "noise: expected a section (infrared, infrared_at_contact, wheels, rf, "
    "rf_bearing, range_and_bearing, ground, odometry, light), got []",
    "noise: off": "noise: expected a section (infrared, infrared_at_contact, wheels, rf, "
    "rf_bearing, range_and_bearing, ground, odometry, light), got false",
    "team: {robots: 0}": "team.robots: expected a whole number from 1 to 64, got 0",
    "team: {robots: 1000000000}": "team.robots: expected a whole number from 1 to 64, got 1000000000",
    "team: {robots: 5.0}": "team.robots: expected a whole number from 1 to 64, got 5.0",
    "team: {start: rows}": "team.start: expected one of row, poses, random, got 'rows'",
    "team: {start_poses: [[0, 0]]}": "team.start_poses[0]: expected a list of 3 numbers from -100 to 100 "
    "[m, m, rad], got [0, 0]",
    "team: {start_poses: [[0, 0, x]]}": "team.start_poses[0][2]: expected a number from -100 to 100 [rad], got 'x'",
    "sensors: {infrared_curve: [[0, 1]]}": "sensors.infrared_curve: expected a list of 2 to 16 lists of 2 numbers "
    "[m, 1], got [[0, 1]]",
    "sensors: {infrared_curve: [[0, 1], [20, 1]]}": "sensors.infrared_curve[1][0]: expected a number from 0 to 10 "
    "[m], got 20",
    "sensors: {infrared_curve: [[0, 1], [1, -1]]}": "sensors.infrared_curve[1][1]: expected a number from 0 to 1e+06, "
    "got -1",
    "sensors: {infrared_yaw_deg: []}": "sensors.infrared_yaw_deg: expected a list of 1 to 64 numbers from -360 to "
    "360 [deg], got []",
    "robot: {sensors: [infrared, smell]}": "robot.sensors[1]: expected one of infrared, touch, rf, rf_bearing, "
    "range_and_bearing, ground, odometry, movable_motion, light, got 'smell'",
    "robot: {sensors: [rf, infrared, rf]}": "robot.sensors: expected each device once, got rf twice",
    "robot: {sensors: rf}": "robot.sensors: expected a list of one of infrared, touch, rf, rf_bearing, "
    "range_and_bearing, ground, odometry, movable_motion, light, got 'rf'",
    "evolution: {seed: -1}": "evolution.seed: expected a whole number from 0 to 9223372036854775807, got -1",
    "evolution: {seed: 1.5}": "evolution.seed: expected a whole number from 0 to 9223372036854775807, got 1.5",
    "optimiser: {pde: {}, nsga2: {}}": "optimiser: expected one plugin by name, {name: {option: value}}, "
    "got the keys 'pde', 'nsga2'",
    "optimiser: {}": "optimiser: expected one plugin by name, {name: {option: value}}, got no keys",
    "optimiser: {pde: 3}": "optimiser.pde: expected options, {option: value}, got 3",
    "fitness: [[a]]": "fitness: expected plugins by name, {name: {option: value}}, got [['a']]",
    "optimiser: {pde: {mutation_rate: .nan}}": "optimiser.pde.mutation_rate: expected a finite number, text, true, "
    "false, null or a list, got nan",
}


@pytest.mark.parametrize(("text", "error"), WRONG.items())
def test_a_wrong_entry(errors: Any, text: str, error: str) -> None:
    assert errors(text) == [error]


def test_all_errors_come_at_once(errors: Any) -> None:
    found = errors(
        "arena: {size: 1 m, colour: red}\nbox: {mass: -1, pose: [.nan, .inf, 0]}\nteam: {robots: 0}\nteam: {}\n",
        "evolution.trials=none",
        "nonsense",
    )
    places = [line.partition(": ")[0].rpartition("/")[2] for line in found]
    assert set(places) == {
        "my.yaml",
        "--set nonsense",
        "arena.size",
        "arena.colour",
        "box.mass",
        "box.pose[0]",
        "box.pose[1]",
        "team.robots",
        "evolution.trials",
    }


def test_every_key_has_a_docstring_and_a_description_of_what_belongs_there() -> None:
    sections = {name: section for name, section in Config() if isinstance(section, config.Section)}
    assert set(Config.model_fields) - set(sections) == {"worlds", "vary", "controller", "fitness", "optimiser"}
    for name, section in sections.items():
        for key, field in type(section).model_fields.items():
            assert field.description, f"{name}.{key}"
            expected = config_messages.expected_at((name, key))
            assert re.search(" from .* to |one of|list|text", expected), f"{name}.{key}"


def test_every_number_has_a_range() -> None:
    def numbers(schema: Any) -> Iterator[dict[str, Any]]:
        if isinstance(schema, dict) and schema.get("type") in ("number", "integer"):
            yield schema
        elif isinstance(schema, dict | list):
            for part in schema.values() if isinstance(schema, dict) else schema:
                yield from numbers(part)

    found = list(numbers(Config.model_json_schema()))
    assert len(found) > 60
    for number in found:
        assert number["minimum"] <= number["maximum"]


# ---- further checks --------------------------------------------------------------------------------------------------


def complain(*lines: str) -> Any:
    return lambda _: list(lines)


def test_errors_of_the_check_come_with_the_others(errors: Any) -> None:
    found = errors("team: {colour: 1}", check=complain("optimiser.pde.x: unknown option", "box.pose: outside"))
    assert found[1:] == ["optimiser.pde.x: unknown option", "box.pose: outside"]


def test_the_check_sees_defaults_for_wrong_entries(errors: Any) -> None:
    seen: list[Config] = []

    def check(found: Config) -> Sequence[str]:
        seen.append(found)
        return []

    errors("box: {mass: -1, size: [1, 1, 1]}\noptimiser: {pde: {rate: .nan}}\nfitness: {a: 3, b: {c: 1}}", check=check)
    (repaired,) = seen
    assert repaired.box.mass == Config().box.mass
    assert repaired.box.size == (1, 1, 1)
    assert repaired.optimiser == {"pde": {}}
    assert repaired.fitness == {"a": {}, "b": {"c": 1}}


@pytest.mark.parametrize("text", ["arena: {size: 4 m}", "arena: {siez: 4}", "arena: 4", "team: {start_poses: 3}"])
def test_no_error_that_a_default_may_have_caused(errors: Any, text: str) -> None:
    assert len(errors(text, check=complain("team.start_poses[0]: outside the arena"))) == 1


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("physics: {box_friction: -1}", "box.size: tips"),
        ("physics: {wheel_friction: much}", "robot.centre_of_mass: falls over"),
        ("physics: {drive: wheels}", "robot.centre_of_mass: falls over"),
        ("robot: {caster_offset: 0}", "robot.caster_clearance: too large"),
        ("arena: {size: 0}", "robot.radius: too large"),
    ],
)
def test_no_error_about_one_section_that_a_default_in_another_may_have_caused(
    errors: Any, text: str, line: str
) -> None:
    assert len(errors(text, check=complain(line))) == 1


@pytest.mark.parametrize("text", ["noise: {rf: 2}", "box: {mass: 0}", "evolution: {trials: 0}"])
def test_but_errors_with_another_cause(errors: Any, text: str) -> None:
    assert len(errors(text, check=complain("team.start_poses[0]: outside the arena"))) == 2


def test_the_check_alone_can_refuse(errors: Any) -> None:
    assert errors("{}", check=complain("box.pose: outside", "box.pose: outside")) == ["box.pose: outside"]


# ---- writing ---------------------------------------------------------------------------------------------------------

text = st.text(st.sampled_from("ab019.eE-+:,#~'\"\n\t {}[]é"), max_size=8)
plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | text,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(text, inner, max_size=3),
    max_leaves=8,
)


@given(
    options=st.dictionaries(text, plain, max_size=4),
    mass=st.floats(0.001, 1000),
    seed=st.none() | st.integers(0, 2**63 - 1),
)
def test_what_is_dumped_loads_back_equal(
    tmp_path_factory: pytest.TempPathFactory, options: dict[str, Any], mass: float, seed: int | None
) -> None:
    written = Config.model_validate({"box": {"mass": mass}, "optimiser": {"any": options}, "evolution": {"seed": seed}})
    file = tmp_path_factory.mktemp("dump") / "config.yaml"
    file.write_text(config.dump(written), encoding="utf-8")
    assert config.load(file) == written


@pytest.mark.parametrize(
    "text", ["1e5", "010", "1_0", "null", "~", "", "yes", "2020-01-01", ".nan", "1:30", "#", "a: b"]
)
def test_text_that_looks_like_something_else_stays_text(load: Any, text: str) -> None:
    written = Config(optimiser={"any": {"option": text}})
    assert load(config.dump(written)) == written


def test_every_key_is_spelled_out() -> None:
    written = yaml.safe_load(config.dump(Config()))
    assert set(written) == set(Config.model_fields)
    assert set(written["physics"]) == set(config.Physics.model_fields)


def test_a_seed_is_drawn_only_where_there_is_none(load: Any) -> None:
    assert config.seeded(load("evolution: {seed: 5}")).evolution.seed == 5
    drawn = {config.seeded(Config()).evolution.seed for _ in range(5)}
    assert len(drawn) > 1
    assert None not in drawn


# ---- the packaged configurations -------------------------------------------------------------------------------------


def test_paper_is_table_one() -> None:
    paper = config.load("paper")
    assert paper.evolution.generations == 100
    assert paper.evolution.population == 30
    assert paper.episode.horizon == 180
    assert paper.optimiser["pde"]["crossover_rate"] == 0.7
    assert paper.optimiser["pde"]["mutation_rate"] == 0.01
    assert paper.controller == {"feedforward": {"hidden": 15}}
    assert paper.evolution.trials == 10
    assert min(paper.noise.infrared, paper.noise.wheels) > 0


def test_shaped_has_three_objectives_and_no_short_cut() -> None:
    shaped = load_config("shaped")
    assert len(Team(shaped).objectives) == 3
    assert shaped.team.start == "random"
    assert shaped.episode.until == "push"


def test_best_is_tried_by_three_four_and_five_robots_with_the_papers_noise() -> None:
    best, paper = config.load("best"), config.load("paper")
    assert {world.config.team.robots for world in Worlds(best)} == {3, 4, 5}
    assert {world.config.episode.until for world in Worlds(best)} == {"push"}
    assert best.noise == paper.noise
    assert best.controller == {"feedforward": {"hidden": 1}}


def test_robust_is_best_with_rigid_bumpers_and_heavier_boxes() -> None:
    best, robust = config.load("best"), config.load("robust")
    worlds = [world.config for world in Worlds(robust)]
    for robots in (3, 4, 5):
        assert "rigid" in {world.robot.bumper for world in worlds if world.team.robots == robots}
        heaviest = max(world.box.mass for world in worlds if world.team.robots == robots)
        assert heaviest == (best.box.mass if robots == 3 else pytest.approx(1.15 * best.box.mass))
    assert (robust.noise, robust.controller, robust.fitness) == (best.noise, best.controller, best.fitness)


def test_quick_is_the_papers_world() -> None:
    quick, paper = config.load("quick"), config.load("paper")
    world = ("arena", "box", "emitter", "robot", "team", "sensors", "noise", "physics", "episode")
    assert all(getattr(quick, section) == getattr(paper, section) for section in world)
    assert math.prod([quick.evolution.generations, quick.evolution.population, quick.evolution.repeats]) <= 2500
