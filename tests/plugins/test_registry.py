# SPDX-License-Identifier: BSD-3-Clause
"""Finding, checking and making plugins, sound and broken ones."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarmevo import plugins
from swarmevo.config import Config
from swarmevo.errors import PluginError
from swarmevo.protocols import Block, GenomeSpace

Install = Callable[..., Path]
SPACE = GenomeSpace((Block("weights", (3,)),))

CLIMBER = """
class Climber:
    def __init__(self, space, population, objectives, rng, *, spread: float = 0.1, steps: int = 3):
        if not 0 < spread:
            raise ValueError(f"spread: expected a number above 0, got {spread}")
        self.given = (space, population, objectives, rng)
        self.spread = spread
    def ask(self): ...
    def tell(self, genomes, costs): ...
    def state(self): ...
    def restore(self, state): ...
"""


@pytest.fixture(autouse=True)
def _forget_modules() -> Iterator[None]:
    """A module of one test must not be found by the next."""
    before = set(sys.modules)
    yield
    for name in set(sys.modules) - before:
        del sys.modules[name]
    importlib.invalidate_caches()


def optimiser(install: Install, name: str, target: str, source: str, distribution: str = "hills") -> None:
    """Install a distribution with one optimiser."""
    install(distribution, "1.2", {"swarmevo.optimisers": {name: target}}, **{target.split(":")[0]: source})


def make(name: str, **options: Any) -> Any:
    return plugins.create("optimiser", name, options, SPACE, 4, 2, np.random.default_rng(0))


# ---- finding ---------------------------------------------------------------------------------------------------------


def test_the_built_ins_are_plugins_like_any_other() -> None:
    found = {(entry.kind, entry.name) for entry in plugins.discover()}
    defaults = {(kind, name) for kind in plugins.GROUPS for name in getattr(Config(), kind)}
    assert defaults <= found


def test_discovery_imports_nothing(distribution: Install) -> None:
    optimiser(distribution, "bomb", "bomb_module:Bomb", "raise SystemExit('imported')")
    (entry,) = [entry for entry in plugins.discover() if entry.name == "bomb"]
    assert (entry.kind, entry.target, entry.origin) == ("optimiser", "bomb_module:Bomb", "hills 1.2")
    assert "bomb_module" not in sys.modules


def test_an_unknown_name() -> None:
    with pytest.raises(PluginError, match=r"^optimiser\.pdee: no such plugin; did you mean pde\?$"):
        make("pdee")
    with pytest.raises(PluginError, match=r"^optimiser\.xyz: no such plugin; installed: .*pde"):
        make("xyz")


def test_two_distributions_with_one_name_clash_only_when_chosen(distribution: Install) -> None:
    optimiser(distribution, "climber", "climber_a:Climber", CLIMBER, "hills")
    optimiser(distribution, "climber", "climber_b:Climber", CLIMBER, "dales")
    assert [entry.clash for entry in plugins.discover() if entry.name == "climber"] == [True, True]
    assert not any(entry.clash for entry in plugins.discover() if entry.name != "climber")
    assert plugins.option_errors(Config()) == []
    with pytest.raises(PluginError, match=r"got dales 1\.2 and hills 1\.2; uninstall one"):
        make("climber")


def test_one_name_may_stand_for_two_kinds(distribution: Install) -> None:
    groups = {"swarmevo.optimisers": {"both": "both:A"}, "swarmevo.fitness": {"both": "both:B"}}
    distribution("hills", "1.2", groups, both="")
    assert not any(entry.clash for entry in plugins.discover())


# ---- making ----------------------------------------------------------------------------------------------------------


def test_the_factory_gets_what_the_host_gives_and_the_options(distribution: Install) -> None:
    optimiser(distribution, "climber", "climber:Climber", CLIMBER)
    rng = np.random.default_rng(0)
    made = plugins.create("optimiser", "climber", {"spread": 0.5}, SPACE, 4, 2, rng)
    assert made.given == (SPACE, 4, 2, rng)
    assert made.spread == 0.5


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("import nowhere_to_be_found", "ModuleNotFoundError: No module named 'nowhere_to_be_found'"),
        ("Climber = ", "SyntaxError: invalid syntax"),
        ("", "AttributeError: module 'broken' has no attribute 'Climber'"),
        ("raise SystemExit(0)", "SystemExit: 0"),
        ("raise RuntimeError('two\\nlines')", "RuntimeError: two lines"),
    ],
)
def test_a_plugin_that_cannot_be_loaded(distribution: Install, source: str, reason: str) -> None:
    optimiser(distribution, "climber", "broken:Climber", source)
    with pytest.raises(PluginError) as caught:
        make("climber")
    message = str(caught.value)
    assert message.startswith(f"optimiser.climber (hills 1.2, broken:Climber): cannot be loaded: {reason}")
    assert message.endswith("; repair or uninstall it")
    assert "\n" not in message


def test_a_plugin_that_is_no_factory(distribution: Install) -> None:
    optimiser(distribution, "climber", "climber:Climber", "Climber = 3")
    with pytest.raises(PluginError, match="expected a factory that can be called, got int"):
        make("climber")


def test_a_plugin_without_the_methods(distribution: Install) -> None:
    source = "class Climber:\n    def __init__(self, *host): ...\n    def ask(self): ..."
    optimiser(distribution, "climber", "climber:Climber", source)
    with pytest.raises(PluginError, match="got none called restore, state, tell"):
        make("climber")


def test_a_controller_has_policies_or_acts(distribution: Install) -> None:
    source = """
    class Half:
        def space(self, scene): ...
        def complexity(self, genomes): ...
    class Native(Half):
        def policies(self, genomes): ...
    class Python(Half):
        def start(self, genomes): ...
        def act(self, observations): ...
    """
    names = {name.lower(): f"brains:{name}" for name in ("Half", "Native", "Python")}
    distribution("hills", "1.2", {"swarmevo.controllers": names}, brains=source)
    plugins.create("controller", "native", {})
    plugins.create("controller", "python", {})
    with pytest.raises(PluginError, match="got none called policies or act, start"):
        plugins.create("controller", "half", {})


# ---- options ---------------------------------------------------------------------------------------------------------


def test_unknown_options_are_all_named(distribution: Install) -> None:
    optimiser(distribution, "climber", "climber:Climber", CLIMBER)
    with pytest.raises(PluginError) as caught:
        make("climber", spred=1, colour="red", population=3)
    assert caught.value.errors == (
        "optimiser.climber.spred: unknown option of hills 1.2; did you mean spread?",
        "optimiser.climber.colour: unknown option of hills 1.2; climber has spread, steps",
        "optimiser.climber.population: unknown option of hills 1.2; climber has spread, steps",
    )


def test_a_missing_option(distribution: Install) -> None:
    optimiser(distribution, "climber", "climber:Climber", CLIMBER.replace("spread: float = 0.1", "spread"))
    with pytest.raises(
        PluginError, match=r"^optimiser\.climber\.spread: expected a value, got none; hills 1\.2 has no"
    ):
        make("climber")


def test_a_value_that_the_factory_refuses(distribution: Install) -> None:
    optimiser(distribution, "climber", "climber:Climber", CLIMBER)
    message = r"^optimiser\.climber\.spread: expected a number above 0, got -1 \(refused by hills 1\.2\)$"
    with pytest.raises(PluginError, match=message):
        make("climber", spread=-1)
    with pytest.raises(PluginError, match=r"^optimiser\.climber: TypeError: '<' not supported .* \(refused by hills"):
        make("climber", spread="wide")


def test_a_factory_that_takes_any_option(distribution: Install) -> None:
    source = CLIMBER.replace("steps: int = 3", "**more")
    optimiser(distribution, "climber", "climber:Climber", source)
    make("climber", anything=3)


def test_a_factory_that_does_not_take_what_the_host_gives(distribution: Install) -> None:
    optimiser(distribution, "climber", "climber:Climber", CLIMBER.replace("objectives, rng, *,", "*,"))
    with pytest.raises(PluginError, match=r"^optimiser\.climber: TypeError: .*positional arguments"):
        make("climber")


# ---- a configuration's plugins ---------------------------------------------------------------------------------------


def test_the_default_plugins_are_sound() -> None:
    assert plugins.option_errors(Config()) == []
    individual = Config.model_validate({"team": {"genomes": "individual"}})
    assert plugins.option_errors(individual) == []


def test_everything_wrong_with_the_plugins_comes_at_once() -> None:
    config = Config.model_validate(
        {
            "controller": {"feedforward": {"hidden": 0}},
            "fitness": {"box_pushing": {"sum_cover": "motion"}, "hiden_neurons": {}},
            "optimiser": {"pde": {"crossover_rate": 70}},
            "evolution": {"population": 30},
        }
    )
    found = plugins.option_errors(config)
    assert [line.split(":")[0] for line in found] == [
        "controller.feedforward.hidden",
        "fitness.box_pushing.sum_cover",
        "fitness.hiden_neurons",
        "optimiser.pde.crossover_rate",
    ]


def test_a_population_that_the_optimiser_refuses() -> None:
    (line,) = plugins.option_errors(Config.model_validate({"evolution": {"population": 2}}))
    assert line.startswith("optimiser.pde: population: ")


def test_a_controller_whose_space_fails(distribution: Install) -> None:
    source = """
    class Brain:
        def space(self, scene): raise RuntimeError("no room")
        def complexity(self, genomes): ...
        def policies(self, genomes): ...
    """
    distribution("hills", "1.2", {"swarmevo.controllers": {"brain": "brain:Brain"}}, brain=source)
    (line,) = plugins.option_errors(Config(controller={"brain": {}}))
    assert line == "controller.brain: RuntimeError: no room"


# ---- reports ---------------------------------------------------------------------------------------------------------


def test_a_report_on_a_sound_plugin(distribution: Install) -> None:
    optimiser(distribution, "climber", "climber:Climber", CLIMBER)
    (report,) = plugins.check("climber")
    assert report.options == ("spread: float = 0.1", "steps: int = 3")
    assert report.error is None


def test_a_report_on_a_broken_plugin(distribution: Install) -> None:
    optimiser(distribution, "climber", "climber:Climber", "import nowhere_to_be_found")
    (report,) = plugins.check("climber")
    assert report.error is not None
    assert "No module named 'nowhere_to_be_found'" in report.error


def test_a_report_on_a_name_taken_twice(distribution: Install) -> None:
    optimiser(distribution, "climber", "climber_a:Climber", CLIMBER, "hills")
    optimiser(distribution, "climber", "climber_b:Climber", CLIMBER, "dales")
    assert all("uninstall one" in str(report.error) for report in plugins.check("climber"))


def test_a_report_on_nothing() -> None:
    with pytest.raises(PluginError, match=r"^pdee: no such plugin; did you mean pde\?$"):
        plugins.check("pdee")
