# SPDX-License-Identifier: BSD-3-Clause
"""What the documentation says is true: its programs run, and its keys, commands, names and links exist."""

from __future__ import annotations

import importlib
import re
import runpy
import shlex
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from conftest import Distribution
from swarmevo import cli, config, plugins
from swarmevo.config import Config
from swarmevo.plugins.team import load_config
from swarmevo.protocols import SceneInfo

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
README, PLUGINS, CONFIGURATION = ROOT / "README.md", DOCS / "plugins.md", DOCS / "configuration.md"
TUTORIALS = sorted(DOCS.glob("write-a*.md"))
PAGES = [README, ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md", ROOT / "CHANGELOG.md", *sorted(DOCS.rglob("*.md"))]

SHORT = ["episode.horizon=1.0", "evolution.population=4", "evolution.generations=2", "evolution.repeats=1"]

every_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


# ---- reading pages ---------------------------------------------------------------------------------------------------


def blocks(page: Path, language: str) -> list[str]:
    """Return the fenced code blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)


def prose(page: Path) -> str:
    """Return a page without its code blocks."""
    return re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)


def spans(text: str) -> list[str]:
    """Return what stands between backticks."""
    return re.findall(r"`([^`\n]+)`", text)


def commands(page: Path) -> list[str]:
    """Return the command lines of swarmevo in prose and console blocks."""
    lines = "\n".join(blocks(page, "console")).splitlines()
    return [line for line in [*spans(prose(page)), *lines] if line.startswith("swarmevo ")]


def anchors(page: Path) -> set[str]:
    """Return the links' ends that a page's headings make, as on GitHub."""
    headings = re.findall(r"^#+ (.*)$", prose(page), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def write_configuration(page: Path) -> list[str]:
    """Write the YAML of a tutorial where its first `swarmevo evolve` looks for it; return that command's arguments."""
    (chosen,) = blocks(page, "yaml")
    command = next(command for command in commands(page) if command.startswith("swarmevo evolve"))
    config, *more = shlex.split(command)[2:]
    Path(config).write_text(chosen)
    return [config, *more]


# ---- programs --------------------------------------------------------------------------------------------------------


@pytest.fixture
def short_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Programs get every configuration with a small budget."""
    importlib.import_module("swarmevo.runs.folder")  # keeps the load of its first import, which must not be ours
    load = config.load

    def load_short(*arguments: Any) -> Config:
        return config.changed(load(*arguments), SHORT)

    monkeypatch.setattr(config, "load", load_short)


@pytest.mark.usefixtures("short_runs")
@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "python")], ids=lambda page: page.name)
def test_programs_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    if page in TUTORIALS:
        write_configuration(page)
    namespace: dict[str, Any] = {"__name__": page.stem}
    for program in blocks(page, "python"):
        exec(compile(program, page.name, "exec"), namespace)


@pytest.mark.usefixtures("short_runs")
def test_the_readmes_program_prints_what_it_promises(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    program = blocks(README, "python")[0]
    assert len(program.splitlines()) <= 25
    monkeypatch.chdir(tmp_path)
    exec(compile(program, README.name, "exec"), {})
    out = capsys.readouterr().out
    assert re.search(r"^<Individual \d+ of trial 0: box_pushing \S+, hidden_neurons \d+>$", out, re.MULTILINE)
    assert re.search(r"^<300 episodes, 5 robots: robots at the source .*95% interval", out, re.MULTILINE)
    assert re.search(r"^the first robot of the first episode ends at \(\S+, \S+\) m$", out, re.MULTILINE)
    assert (tmp_path / "best.html").stat().st_size > 500_000


@pytest.fixture
def evolve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Run a command line of ``swarmevo evolve`` with a small budget, in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> None:
        settings = [word for setting in SHORT for word in ("--set", setting)]
        seed = () if "--seed" in arguments else ("--seed", "1")
        with pytest.raises(SystemExit) as exit:
            cli.main(["evolve", *arguments, *settings, *seed, "--workers", "1"])
        assert not exit.value.code

    return run


def install_example(page: Path, distribution: Distribution) -> None:
    """Install the page's classes as the distribution that its TOML block announces."""
    (announced,) = blocks(page, "toml")
    groups = tomllib.loads(announced)["project"]["entry-points"]
    (module,) = {target.partition(":")[0] for plugins in groups.values() for target in plugins.values()}
    source = "\n".join(program for program in blocks(page, "python") if re.search("^class (?!Test)", program, re.M))
    distribution(module.replace("_", "-"), "1.0", groups, **{module: source})


def test_the_readmes_plugin_evolves(distribution: Distribution, evolve: Callable[..., None]) -> None:
    install_example(README, distribution)
    (command,) = [command for command in commands(README) if "random_search" in command]
    evolve(*shlex.split(command)[2:])


def test_the_examples_of_plugins_evolve(distribution: Distribution, evolve: Callable[..., None]) -> None:
    install_example(PLUGINS, distribution)
    (chosen,) = blocks(PLUGINS, "yaml")
    Path("chosen.yaml").write_text(chosen)
    evolve("chosen.yaml", "--out", "first")
    evolve("chosen.yaml", "--out", "second", "--set", "controller=reflex")
    assert {entry.name for entry in plugins.discover() if entry.distribution == "swarmevo-example"} == {
        "truncation",
        "reflex",
        "small_network",
        "box_travel",
        "activity",
        "dispersion",
    }


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_what_a_tutorial_writes_evolves(page: Path, distribution: Distribution, evolve: Callable[..., None]) -> None:
    install_example(page, distribution)
    evolve(*write_configuration(page))


@pytest.mark.parametrize("number", [0, 1])
def test_the_examples_of_rivals_evolve(evolve: Callable[..., None], number: int) -> None:
    Path("chosen.yaml").write_text(blocks(DOCS / "rivals.md", "yaml")[number])
    evolve("chosen.yaml")


def test_the_example_of_a_tracker_logs(distribution: Distribution, evolve: Callable[..., None]) -> None:
    install_example(DOCS / "tracking.md", distribution)
    evolve("quick", "--trials", "1", "--out", "run", "--log", "lines")
    assert len(Path("run/generations.jsonl").read_text().splitlines()) == 2


def test_every_film_of_the_gallery_is_followed_by_the_command_that_made_it() -> None:
    _, *shown = re.split(r"\(images/", (DOCS / "gallery.md").read_text())
    assert len(shown) == 8
    for one in shown:
        film, _, text = one.partition(")")
        (command,) = re.findall(r"swarmevo replay .*--video (\S+)", text)
        assert command == film or film == "replay.webp"  # README has its command


# ---- keys ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["configuration", "commands", "channels", "episodes"])
def test_a_generated_page_is_up_to_date(name: str) -> None:
    generated = runpy.run_path(str(DOCS / f"generate_{name}.py"))["text"]()
    assert (DOCS / f"{name}.md").read_text() == generated, "run: make docs"


def listed_keys() -> set[str]:
    return set(re.findall(r"^\| `([\w.\[\]]+)` \|", CONFIGURATION.read_text(), re.MULTILINE))


def test_the_page_of_keys_has_them_all() -> None:
    sections = {name: section for name, section in Config() if isinstance(section, config.Section)}
    assert {f"{name}.{key}" for name, section in sections.items() for key in type(section).model_fields} < listed_keys()


@every_page
def test_keys_exist(page: Path) -> None:
    named = [span for span in spans(prose(page)) if re.fullmatch(r"\w+(\.\w+)+(=.*)?", span)]
    keys = {key.partition("=")[0] for key in named if key.partition(".")[0] in Config.model_fields}
    keys = {re.sub(r"\.[0-9]+(?=\.)", "[]", re.sub(r"(\.[0-9]+)+$", "", key)) for key in keys}  # entries of lists
    told = {f"scene.{name}" for name in dir(SceneInfo(1, 1, 0.1))}  # what a plugin is given is called scene, too
    assert keys <= listed_keys() | told


def settings(page: Path) -> Iterator[tuple[str, str]]:
    """Yield the configuration and the ``section.key=value`` of a page, but for commands that choose another plugin."""
    for span in spans(prose(page)):
        if re.fullmatch(r"\w+(\.\w+)+=.+", span):
            yield "paper", span
    packaged = {path.stem for path in (ROOT / "configs").glob("*.yaml")}
    for command in commands(page):
        words = shlex.split(command)
        named = words[2] if words[1:2] == ["evolve"] and words[2:3] and words[2] in packaged else "paper"
        if "--plugin" not in words:
            yield from ((named, words[i + 1]) for i, word in enumerate(words) if word == "--set")


@every_page
def test_values_are_accepted(page: Path) -> None:
    for name, setting in settings(page):
        config.load(name, [setting], plugins.option_errors)


def test_the_example_of_a_configuration_is_accepted(tmp_path: Path) -> None:
    first, *others = blocks(CONFIGURATION, "yaml")
    file = tmp_path / "my.yaml"
    for example in (first, *others):
        file.write_text(example)
        assert load_config(file) != config.Config()
    file.write_text(first)
    assert load_config(file).team.robots == 3


# ---- commands --------------------------------------------------------------------------------------------------------


Help = Callable[[str], str]


@pytest.fixture
def help_of(capsys: pytest.CaptureFixture[str]) -> Help:
    """Return the help of the command that a command line runs."""

    def run(command: str) -> str:
        verbs = re.match(r"swarmevo((?: (?:plugins check|[a-z]+))?)", command)
        assert verbs is not None
        with pytest.raises(SystemExit) as exit:
            cli.main([*verbs[1].split(), "--help"])
        assert not exit.value.code, f"{command}: no such command"
        return capsys.readouterr().out

    return run


@every_page
def test_commands_exist(page: Path, help_of: Help) -> None:
    for command in commands(page):
        known = help_of(command)
        for option in re.findall(r"(?<= )--[a-z-]+", command):
            assert f"{option} " in known, f"{command}: no option {option}"


@pytest.mark.parametrize("page", [page for page in PAGES if page.name != "commands.md"], ids=lambda page: page.name)
def test_options_exist(page: Path, help_of: Help) -> None:
    """An option belongs to a command in its line, or to ``evolve``; the page made of the help texts has sections."""
    for line in prose(page).splitlines():
        named = [span for span in spans(line) if span.startswith("swarmevo ")] or ["swarmevo evolve"]
        for option in [span for span in spans(line) if re.fullmatch("--[a-z-]+", span)]:
            assert any(f"{option} " in help_of(command) for command in named), f"{page.name}: {option}"


def test_the_readme_has_every_command(help_of: Help) -> None:
    listed = re.findall(r"^  ([a-z]+)  ", help_of("swarmevo").partition("Commands:")[2], re.MULTILINE)
    assert {command.split()[1] for command in commands(README)} == set(listed)


@every_page
def test_make_has_the_targets(page: Path) -> None:
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    lines = [*spans(prose(page)), *"\n".join(blocks(page, "console")).splitlines()]
    named = {line.split()[1] for line in lines if re.match(r"make [a-z]", line)}
    assert named <= set(targets)


def test_the_readme_installs_what_make_needs() -> None:
    makefile = (ROOT / "Makefile").read_text()
    needed = [re.findall(rf"^{kind}_PACKAGES := (.*)$", makefile, re.MULTILINE)[0] for kind in ("BUILD", "TEST")]
    (line,) = [line for line in "\n".join(blocks(README, "console")).splitlines() if "apt-get" in line]
    assert line.split("-y ")[1].split() == ["make", *" ".join(needed).split()]


# ---- links -----------------------------------------------------------------------------------------------------------


def links(page: Path) -> list[tuple[str, str]]:
    return re.findall(r"\[([^]]+)\]\(([^)\s]+)\)", prose(page))


def named_code(page: Path) -> list[tuple[str, str]]:
    return re.findall(r"\[`(\w+)`\]\(([^)\s]+\.(?:py|cpp|hpp))\)", prose(page))


def test_there_is_something_to_check() -> None:
    found = {kind.__name__: sum(len(kind(page)) for page in PAGES) for kind in (links, named_code, commands)}
    assert min(found.values()) >= 10, found


@every_page
def test_links_lead_somewhere(page: Path) -> None:
    for words, link in links(page):
        if link.startswith("https://"):
            continue
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        assert target.exists(), f"[{words}]({link})"
        assert not anchor or anchor in anchors(target), f"[{words}]({link})"


@every_page
def test_named_code_exists(page: Path) -> None:
    """A link whose words are a name of code leads to a file that has it."""
    for name, link in named_code(page):
        assert re.search(rf"\b{name}\b", (page.parent / link).read_text()), f"[`{name}`]({link})"
