# SPDX-License-Identifier: BSD-3-Clause
"""What is swept: values as they are written, their combinations, the names of folders, and what is refused."""

from __future__ import annotations

import pytest

from swarmevo.errors import ConfigError
from swarmevo.plugins.team import load_config
from swarmevo.sweeps import grid as grids
from swarmevo.sweeps import planning


def names(*texts: str, overrides: tuple[str, ...] = ()) -> list[str]:
    return [one.name for one in planning.settings("quick", overrides, grids.parse(texts), [1])]


def test_all_combinations_of_all_values() -> None:
    texts = ["evolution.population=6,8", "optimiser.pde.mutation_rate=1e-2,0.1"]
    found = planning.settings("quick", ["team.robots=3"], grids.parse(texts), [1])
    assert [(one.config.evolution.population, one.config.optimiser["pde"]) for one in found] == [
        (6, {"mutation_rate": 0.01}),
        (6, {"mutation_rate": 0.1}),
        (8, {"mutation_rate": 0.01}),
        (8, {"mutation_rate": 0.1}),
    ]
    assert {one.config.team.robots for one in found} == {3}
    assert found[0].name == "population=6,mutation_rate=1e-2"


def test_a_run_has_the_configuration_of_evolve_with_these_settings() -> None:
    (setting,) = planning.settings("paper", ["evolution.trials=2"], grids.parse(["robot.preset=khepera_iv"]), [7])
    overrides = ["evolution.seed=7", "robot.preset=khepera_iv", "evolution.trials=2"]
    assert setting.seeded(7) == load_config("paper", overrides)


def test_values_are_yaml() -> None:
    grid = grids.parse(["box.size=[0.1, 0.2],[0.2, 0.2]", "evolution.episodes=null,1_000", 'controller=linear,"elman"'])
    assert [[value.label for value in values] for values in grid.values()] == [
        ["[0.1, 0.2]", "[0.2, 0.2]"],
        ["null", "1_000"],
        ["linear", "elman"],
    ]
    assert grids.of_values({"box.size": [[0.1, 0.2], [0.2, 0.2]]})["box.size"] == grid["box.size"]


def test_names_are_harmless_and_nobody_elses() -> None:
    assert names("controller=linear,{elman: {hidden: 2}}") == ["controller=linear", "controller=elman_hidden_2"]
    assert names("evolution.start=a/b,a:b,A_b") == ["start=a_b", "start=a_b-2", "start=A_b-3"]
    assert names() == ["quick"]
    long = names(f"evolution.start={'x' * 300},{'x' * 301}")
    assert [len(name) for name in long] == [80, 82]


def test_keys_that_end_alike_are_written_out() -> None:
    keys = ["box.mass", "scene.movables.0.mass", "team.robots"]
    assert list(grids.short_names(keys).values()) == ["box.mass", "scene.movables.0.mass", "robots"]


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["box.mass"], "--grid box.mass: expected KEY=VALUE,VALUE,..., the values in YAML"),
        (["box.mass="], "--grid box.mass=: expected KEY=VALUE,VALUE,..., the values in YAML"),
        (["=1"], "--grid =1: expected KEY=VALUE,VALUE,..., the values in YAML"),
        (["noise=1,,2"], "--grid noise=1,,2: expected KEY=VALUE,VALUE,..., the values in YAML; line 1, column 4: "),
        (["noise=1]"], "--grid noise=1]: expected KEY=VALUE,VALUE,..., the values in YAML; line 1, column 4: "),
        (["evolution.seed=1,2"], "--grid evolution.seed=1,2: expected seeds in --seeds, as 1-10"),
        (["box.mass=1,2,1"], "--grid box.mass=1,2,1: 1 is given twice; leave one out"),
        (["box.mass=1", "box.mass=2"], "--grid box.mass=2: box.mass is given twice; give all its values at once"),
        (["box.mass=0.2,0.20"], "--grid: mass=0.20 and mass=0.2 are the same configuration; leave one out"),
        (["box.mas=1,2"], "box.mas: unknown key; did you mean box.mass?"),
        (["box.mass=0.2,-1,-2"], "mass=-1: box.mass: "),
        (["noise.wheels=0.1,2", "team.robots=2,3"], "wheels=2, robots=2 and 1 more: noise.wheels: "),
        ([f"box.mass={','.join(map(str, range(101)))}"] * 1 + [f"team.robots={','.join(map(str, range(100)))}"],
         "--grid: expected at most 10000 runs, got 10100 settings times 2 seeds"),
    ],
)  # fmt: skip
def test_a_bad_grid_is_refused(texts: list[str], message: str) -> None:
    with pytest.raises(ConfigError) as refused:
        planning.settings("quick", [], grids.parse(texts), [1, 2])
    assert refused.value.errors[0].startswith(message)


def test_a_key_that_is_set_too_is_refused() -> None:
    with pytest.raises(
        ConfigError, match=r"box\.mass: set twice, by box\.mass=0\.3 and by box\.mass=0\.2; give it once"
    ):
        names("box.mass=0.2", overrides=("box.mass=0.3",))
    with pytest.raises(ConfigError, match=r"--set evolution\.seed: expected seeds in --seeds, as 1-10"):
        names("box.mass=0.2", overrides=("evolution.seed=3",))


@pytest.mark.parametrize(
    ("text", "seeds"), [("1-3", [1, 2, 3]), ("4", [4]), ("9, 2-3,0", [9, 2, 3, 0]), (f"{2**63 - 1}", [2**63 - 1])]
)
def test_seeds(text: str, seeds: list[int]) -> None:
    assert grids.parse_seeds(text) == seeds


@pytest.mark.parametrize("text", ["", "1-", "-1", "3-1", "x", "1.5", "1,,2", f"{2**63}", "1 2"])
def test_what_is_no_seed_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="expected seeds as in 1-10 or 1,4,9"):
        grids.parse_seeds(text)


def test_seeds_that_are_too_many_or_the_same_are_refused() -> None:
    with pytest.raises(ConfigError, match="expected at most 10000 seeds, got more"):
        grids.parse_seeds("1-999999999999")
    with pytest.raises(ConfigError, match="--seeds: 2 is given twice; leave one out"):
        grids.parse_seeds("1-3,2")


def test_values_of_a_program_are_those_of_the_command_line() -> None:
    assert grids.of_values({"box.mass": (0.2, 0.3), "optimiser": ["pde"]}) == grids.parse(
        ["box.mass=0.2,0.3", "optimiser=pde"]
    )
    with pytest.raises(ConfigError, match=r"box\.mass: expected a list of values, got 0\.2"):
        grids.of_values({"box.mass": 0.2})  # type: ignore[dict-item]
