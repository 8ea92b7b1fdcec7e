# SPDX-License-Identifier: BSD-3-Clause
"""Finding, checking and making plugins, sound and broken ones."""

from __future__ import annotations

import importlib
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarmevo import config, plugins
from swarmevo.config import Config
from swarmevo.errors import ConfigError, PluginError
from swarmevo.plugins import registry
from swarmevo.protocols import Block, GenomeSpace

ROOT = Path(__file__).parents[2]
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


def test_the_optimisers_of_swarmevo_rivals_are_known() -> None:
    project = tomllib.loads((ROOT / "plugins/swarmevo_rivals/pyproject.toml").read_text())["project"]
    assert list(project["entry-points"]) == ["swarmevo.optimisers"]
    assert set(project["entry-points"]["swarmevo.optimisers"]) == plugins.RIVALS
    assert project["name"] == "swarmevo-rivals"


def test_what_is_not_installed_says_what_has_it(monkeypatch: pytest.MonkeyPatch) -> None:
    own = [entry for entry in plugins.discover() if entry.distribution != "swarmevo-rivals"]
    monkeypatch.setattr(registry, "discover", lambda: own)
    what = "it is a plugin of swarmevo-rivals, which is not installed; pip install swarmevo_rivals-"
    for name in sorted(plugins.RIVALS):
        with pytest.raises(PluginError, match=rf"^optimiser\.{name}: {what}"):
            make(name)
    with pytest.raises(PluginError, match=rf"^cma: {what}"):
        plugins.check("cma")
    with pytest.raises(PluginError, match=r"^optimiser\.nsga: no such plugin; did you mean nsga[23]\?$"):
        make("nsga")
    with pytest.raises(PluginError, match=r"^controller\.cma: no such plugin; installed: "):
        plugins.create("controller", "cma", {})


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


SCENIC = """
class Scenic:
    channels = ()
    objectives = ()
    def __init__(self, SCENE, size: float = 1.0):
        self.scene, self.size = scene, size
    def evaluate(self, telemetry, genomes, controller): ...
"""


@pytest.mark.parametrize("parameter", ["scene", "*, scene", "scene=None"])
def test_a_fitness_that_takes_the_scene_gets_it(distribution: Install, parameter: str) -> None:
    source = SCENIC.replace("SCENE", parameter)
    source = source.replace(", size: float = 1.0", ", size=1.0") if "*" in parameter else source
    distribution("hills", "1.2", {"swarmevo.fitness": {"scenic": "scenic:Scenic"}}, scenic=source)
    scene = config.scene_info(Config())
    made = plugins.create("fitness", "scenic", {"size": 2.0}, scene=scene)
    assert (made.scene, made.size) == (scene, 2.0)
    assert plugins.takes("fitness", "scenic", "scene")
    assert not plugins.takes("fitness", "hidden_neurons", "scene")
    (report,) = plugins.check("scenic")
    assert report.error is None
    assert not [option for option in report.options if "scene" in option]
    with pytest.raises(PluginError, match=r"^fitness\.scenic\.scene: unknown option of hills 1\.2; scenic has size$"):
        plugins.create("fitness", "scenic", {"scene": 3}, scene=scene)


def test_a_factory_whose_signature_nobody_knows_gets_no_scene(distribution: Install) -> None:
    source = """
    class Any:
        __signature__ = "none"
        channels = objectives = ()
        def __init__(self, **options):
            self.options = options
        def evaluate(self, telemetry, genomes, controller): ...
    """
    distribution("hills", "1.2", {"swarmevo.fitness": {"any": "anything:Any"}}, anything=source)
    assert plugins.create("fitness", "any", {"size": 2.0}, scene=config.scene_info(Config())).options == {"size": 2.0}


def test_a_scene_that_the_factory_refuses_is_told_with_the_configuration(distribution: Install) -> None:
    source = SCENIC.replace("SCENE", "scene").replace(
        "self.scene, self.size = scene, size",
        "raise ValueError(f'scene: expected a horizon up to 100 s, got {scene.horizon:g} s')",
    )
    distribution("hills", "1.2", {"swarmevo.fitness": {"scenic": "scenic:Scenic"}}, scenic=source)
    assert plugins.option_errors(Config.model_validate({"fitness": "scenic"})) == [
        "fitness.scenic: scene: expected a horizon up to 100 s, got 180 s (refused by hills 1.2)"
    ]


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
    message = r"^optimiser\.climber\.spread: expected a number above 0, got -1.0 \(refused by hills 1\.2\)$"
    with pytest.raises(PluginError, match=message):
        make("climber", spread=-1)
    optimiser(distribution, "any_climber", "any_climber:Climber", CLIMBER.replace(": float", ""), "dales")
    with pytest.raises(
        PluginError, match=r"^optimiser\.any_climber: TypeError: '<' not supported .* \(refused by dales"
    ):
        make("any_climber", spread="wide")


def test_a_factory_that_takes_any_option(distribution: Install) -> None:
    source = CLIMBER.replace("steps: int = 3", "**more")
    optimiser(distribution, "climber", "climber:Climber", source)
    make("climber", anything=3)


def test_a_factory_that_does_not_take_what_the_host_gives(distribution: Install) -> None:
    optimiser(distribution, "climber", "climber:Climber", CLIMBER.replace("objectives, rng, *,", "*,"))
    with pytest.raises(PluginError, match=r"^optimiser\.climber: TypeError: .*positional arguments"):
        make("climber")


# ---- annotations -----------------------------------------------------------------------------------------------------

TYPED = """
from __future__ import annotations
from typing import TYPE_CHECKING, Literal, Optional
if TYPE_CHECKING:
    from nowhere import Space
class Typed:
    def __init__(
        self, space: Space, population, objectives, rng, *,
        s: str = "", f: float = 0.0, i: int = 0, b: bool = False, o: Optional[str] = None, u: float | str = 0.0,
        l: list[str] = [], t: tuple[int, str] = (0, ""), d: dict[str, float] = {}, c: Literal["on", "off"] = "on",
        n: int = None, a: Space = None, free=None, **more: str
    ):
        given = dict(locals(), **more)
        self.given = {name: given[name] for name in given if name not in ("self", "more")}
    def ask(self): ...
    def tell(self, genomes, costs): ...
    def state(self): ...
    def restore(self, state): ...
"""


@pytest.fixture
def typed(distribution: Install) -> Callable[[str], dict[str, Any]]:
    """Return a function that gives options in YAML to a plugin with annotations; it returns what arrived."""
    optimiser(distribution, "typed", "typed:Typed", TYPED)

    def arrive(options: str) -> dict[str, Any]:
        loaded = config.load(None, [f"optimiser={{typed: {options}}}"], plugins.option_errors, plugins.settled_options)
        stored = config.load(None, config.as_overrides({"optimiser": loaded.optimiser}))
        assert stored.optimiser == loaded.optimiser
        given: dict[str, Any] = make("typed", **loaded.optimiser["typed"]).given
        return given

    return arrive


@pytest.mark.parametrize(
    ("option", "arrives"),
    [
        *[(f"s: {text}", text) for text in ("1e5", "off", "010", "1_000", ".inf", "YES", "-0", "0x1f")],
        ("f: 1", 1.0),
        ("f: 1e5", 100000.0),
        ("i: 010", 10),
        ("b: off", False),
        ("o: null", None),
        ("o: off", "off"),
        ("u: 1e5", 100000.0),
        ("u: off", "off"),
        ("l: [1e5, off, a]", ["1e5", "off", "a"]),
        ("t: [1, 1e5]", (1, "1e5")),
        ("d: {a: 1, off: 2}", {"a": 1.0, "off": 2.0}),
        ("c: off", "off"),
        ("n: null", None),
        ("a: 1e5", 100000.0),
        ("free: [off, 1e5]", [False, 100000.0]),
        ("other: 1e5", "1e5"),
    ],
)
def test_an_option_is_of_the_annotated_type(typed: Any, option: str, arrives: object) -> None:
    """Case 71: text is text as it is written; else YAML's reading counts."""
    found = typed(f"{{{option}}}")[option.split(":")[0]]
    assert (found, type(found)) == (arrives, type(arrives))


@pytest.mark.parametrize(
    ("option", "problem"),
    [
        ("f: wide", "expected a number, got 'wide'"),
        ("f: true", "expected a number, got true"),
        ("i: 1.0", "expected a whole number, got 1.0"),
        ("b: 1", "expected true or false, got 1"),
        ("s: null", "expected text, got nothing"),
        ("s: [a]", "expected text, got ['a']"),
        ("u: [1]", "expected a number or text, got [1]"),
        ("l: a", "expected a list, got 'a'"),
        ("t: [1]", "expected a value at [1], got [1]"),
        ("t: [1, 2, 3]", "expected at most 2 entries, got [1, 2, 3]"),
        ("l: [a, [b]]", "expected text at [1], got ['a', ['b']]"),
        ("c: maybe", "expected 'on' or 'off', got 'maybe'"),
        ("f: null", "expected a number, got nothing"),
    ],
)
def test_an_option_of_another_type_is_refused(typed: Any, option: str, problem: str) -> None:
    """Case 71."""
    with pytest.raises(ConfigError) as caught:
        typed(f"{{{option}}}")
    assert caught.value.errors == (f"optimiser.typed.{option.split(':')[0]}: {problem} (annotated so in hills 1.2)",)


def test_an_option_is_a_copy(distribution: Install) -> None:
    """Case 59: a factory that changes its list changes nothing in the configuration that is stored."""
    optimiser(distribution, "typed", "typed:Typed", TYPED)
    given = {"l": ["a"], "free": [1]}
    made = make("typed", **given).given
    made["l"].append("b")
    made["free"].append(2)
    assert given == {"l": ["a"], "free": [1]}


@pytest.mark.parametrize("name", ["1e5", "off", "010"])
@pytest.mark.parametrize("form", ["{}", "{{{}: }}", "[{}]", "{{{}: {{spread: 2}}}}"])
def test_a_plugins_name_is_text(distribution: Install, name: str, form: str) -> None:
    """Case 71: whatever YAML makes of it."""
    optimiser(distribution, name, "climber:Climber", CLIMBER)
    found = config.load(None, [f"optimiser={form.format(name)}"], plugins.option_errors)
    assert list(found.optimiser) == [name]
    assert config.load(None, config.as_overrides({"optimiser": found.optimiser})) == found


# ---- a configuration's plugins ---------------------------------------------------------------------------------------


def test_the_default_plugins_are_sound() -> None:
    assert plugins.option_errors(Config()) == []
    individual = Config.model_validate({"team": {"genomes": "individual"}})
    assert plugins.option_errors(individual) == []


def test_everything_wrong_with_the_plugins_comes_at_once() -> None:
    settings = Config.model_validate(
        {
            "controller": {"feedforward": {"hidden": 0}},
            "fitness": {"box_pushing": {"sum_cover": "motion"}, "hiden_neurons": {}},
            "optimiser": {"pde": {"crossover_rate": 70}},
            "evolution": {"population": 30},
        }
    )
    found = plugins.option_errors(settings)
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
