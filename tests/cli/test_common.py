# SPDX-License-Identifier: BSD-3-Clause
"""The program as a whole: help, version, wrong usage, arguments that several verbs have."""

from __future__ import annotations

import pkgutil
import re
import subprocess
import sys
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.main import get_command

import swarmevo
from cli.conftest import Swarmevo, files
from swarmevo import cli

Install = Callable[..., Path]


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\nfrom swarmevo.cli import main\n"
        "try: main(['--help'])\n"
        "finally: print(*(set('numpy pydantic moocore cffi yaml matplotlib rich'.split()) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "evolve" in done.stdout
    assert done.stdout.splitlines()[-1] == ""


def test_every_module_is_a_verb_but_what_they_share() -> None:
    modules = {module.name for module in pkgutil.iter_modules(cli.__path__)}
    assert modules - {"common", "process", "streams", "usage"} == set(cli.VERBS)


def test_version(swarmevo_: Swarmevo) -> None:
    assert swarmevo_("--version").out == f"swarmevo {swarmevo.__version__}\n"
    assert swarmevo.__version__ == metadata.version("swarmevo")


@pytest.mark.parametrize(
    "arguments",
    [
        ["evolv"],
        ["evolve", "--sed", "1"],
        ["evolve", "--seed", "x"],
        ["show"],
        ["show", "nowhere"],
        ["resume", "nowhere"],
    ],
)
def test_wrong_usage(swarmevo_: Swarmevo, arguments: list[str]) -> None:
    done = swarmevo_(*arguments)
    assert done.code == 2
    assert done.out == ""
    assert done.err


def test_module_and_script_are_the_same() -> None:
    done = subprocess.run([sys.executable, "-m", "swarmevo", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"swarmevo {swarmevo.__version__}\n"


@pytest.mark.parametrize("workers", ["0", "-1", "many", "1.5", "10000"])
def test_wrong_workers(swarmevo_: Swarmevo, workers: str) -> None:
    done = swarmevo_("evolve", "small.yaml", f"--workers={workers}")
    assert done.code == 2
    assert done.errors == [f"--workers: expected auto or a whole number from 1 to 9999, got {workers!r}"]


# ---- settings and options --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", [["--set", "team.robots=2"], ["--set=team.robots=2"]])
def test_several_settings_follow_one_set(swarmevo_: Swarmevo, distribution: Install, form: list[str]) -> None:
    """Case 65: a key without a section, and a plugin with a dash in its name."""
    distribution("dashes", "1", {"swarmevo.optimisers": {"my-pde": "swarmevo_paper.pde:PDE"}})
    settings = [*form, "optimiser=my-pde", "optimiser.my-pde.crossover_rate=0.5", "evolution.trials=1"]
    done = swarmevo_("evolve", *settings, "small.yaml", "--seed", 1, "--out", "run")
    assert (done.code, done.errors) == (0, [])
    stored = yaml.safe_load(Path("run/config.yaml").read_text())
    assert stored["optimiser"] == {"my-pde": {"crossover_rate": 0.5}}
    assert (stored["team"]["robots"], stored["evolution"]["trials"]) == (2, 1)


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        (["--set", "evolution.seed=2", "--seed", "1"], "evolution.seed"),
        (["--trials", "2", "--set", "evolution.trials=3"], "evolution.trials"),
        (["--plugin", "pde", "--set", "optimiser=pde"], "optimiser"),
        (["--set", "team.robots=2", "team.robots=3"], "team.robots"),
        (["--set", "team.robots=2", "--set", "team.robots=3"], "team.robots"),
    ],
)
def test_a_key_is_set_once(swarmevo_: Swarmevo, arguments: list[str], key: str) -> None:
    """Case 75."""
    done = swarmevo_("evolve", "small.yaml", *arguments)
    assert (done.code, done.out) == (2, "")
    (line,) = done.errors
    assert line.startswith(f"{key}: set twice, by ")
    assert files() == {"small.yaml"}


@pytest.mark.parametrize(
    "arguments",
    [
        ["evolve", "--seed", "1", "--seed=2"],
        ["replay", "run", "--port", "1", "--port", "1"],
        ["export", "--as", "x"] * 2,
    ],
)
def test_an_option_is_given_once(swarmevo_: Swarmevo, arguments: list[str]) -> None:
    """Case 75: not the last one wins."""
    done = swarmevo_(*arguments)
    assert done.code == 2
    assert done.errors[0].endswith(": expected one value, got two; give it once")
    assert len(done.errors) == 1


WITHOUT_EFFECT = {
    "evolve --dry-run --scheduler tcp://nowhere:1": "--dry-run: has no effect with --scheduler",
    "evolve --scheduler tcp://nowhere:1 --workers 2": "--workers: has no effect with --scheduler",
    "resume . --scheduler tcp://nowhere:1 --workers 2": "--workers: has no effect with --scheduler",
    "export . --csv --as epuck": "--as: has no effect without --controller",
    "export . --json --robot 1": "--robot: has no effect without --controller",
    "export . --controller 1 --robot 1": "--robot: has no effect without --as epuck or webots",
    "replay . --live --html x.html": "--html: has no effect with --live",
    "replay . --live --video x.webp": "--video: has no effect with --live",
    "replay . --live --serve": "--serve: has no effect with --live",
    "replay . --live --generation 1": "--generation: has no effect with --live",
    "replay . --live --repeat 0": "--repeat: has no effect with --live",
    "replay . --live --robots 1-5": "--robots: has no effect with --live",
    "replay . --live --force": "--force: has no effect with --live",
    "replay . --live --speed 2": "--speed: has no effect without --video",
    "replay . --serve --seconds 1-2": "--seconds: has no effect without --video",
    "replay . --html x.html --port 80": "--port: has no effect without --serve or --live",
}


@pytest.mark.parametrize("arguments", WITHOUT_EFFECT)
def test_an_option_without_effect_is_refused(swarmevo_: Swarmevo, arguments: str) -> None:
    """Case 33."""
    done = swarmevo_(*arguments.split())
    assert (done.code, done.out) == (2, "")
    assert done.errors == [f"{WITHOUT_EFFECT[arguments]}; leave it out"]
    assert files() == {"small.yaml"}


# ---- help and usage errors -------------------------------------------------------------------------------------------


def verbs() -> dict[str, Any]:
    return dict(get_command(cli.app).commands)


@pytest.mark.parametrize("verb", cli.VERBS)
def test_a_help_text_tells_whole_sentences_and_has_examples(verb: str) -> None:
    command = verbs()[verb]
    assert command.get_short_help_str(62).endswith(".")
    assert not command.get_short_help_str(62).endswith("...")
    helps = [one.help for one in command.params if one.help]
    assert [text for text in helps if not text.endswith(".") or not text[0].isupper()] == []
    assert f"  swarmevo {verb}" in command.epilog


def every_command() -> dict[str, Any]:
    """Return the program and each command, by what is typed for it."""
    families = {"": get_command(cli.app), "plugins": verbs()["plugins"]}
    own = {name: command for family in families.values() for name, command in family.commands.items()}
    return {**families, **{"plugins check" if name == "check" else name: one for name, one in own.items()}}


def shown(command: str, columns: int, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> str:
    """Return a command's help on a terminal so wide."""
    monkeypatch.setenv("COLUMNS", str(columns))
    with pytest.raises(SystemExit):
        cli.main([*command.split(), "--help"])
    return str(capsys.readouterr().out)


@pytest.mark.parametrize("columns", [40, 80])
@pytest.mark.parametrize("command", every_command())
def test_help_fits_the_terminal(command: str, columns: int, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    help_text = shown(command, columns, monkeypatch, capsys)
    assert [line for line in help_text.splitlines() if len(line) > columns] == []
    typed = re.sub(r" \\\n +", " ", help_text.partition("Examples:\n")[2])
    examples = [re.split(" {2,}", line.strip())[0] for line in every_command()[command].epilog.splitlines()[1:]]
    assert all(re.search(rf"^    {re.escape(one)}( {{2}}|$)", typed, re.MULTILINE) for one in examples)


def test_help_says_of_what_is_written_that_its_folder_is_made(monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    for command, option in (("report", "html"), ("report", "figures"), ("compare", "html"), ("replay", "html")):
        told = " ".join(shown(command, 80, monkeypatch, capsys).split())
        assert re.search(rf" --{option} (FILE|DIR) [^-]* (whose folder|which) is made", told)


def test_help_has_no_types_of_python(monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    helps = {command: shown(command, 80, monkeypatch, capsys) for command in every_command()}
    assert [command for command, help_text in helps.items() if re.search("<(?!=)|Path|[{}]", help_text)] == []
    assert helps["report"].startswith("Usage: swarmevo report [OPTIONS] RUN...\n")
    assert helps["evolve"].startswith("Usage: swarmevo evolve [OPTIONS] [CONFIG]\n")


def test_the_list_of_commands_has_a_sentence_of_each(monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    listed = " ".join(shown("", 40, monkeypatch, capsys).split())
    for name, command in verbs().items():
        assert re.search(rf" {name} {re.escape(command.get_short_help_str(1000))} ", listed)


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (["nosuch"], "no such command 'nosuch'; see: swarmevo --help"),
        (["show"], "missing argument 'RUN'; see: swarmevo show --help"),
        (
            ["evolve", "--sed", "1"],
            "no such option: --sed (Possible options: --scheduler, --seed, --set); see: swarmevo evolve --help",
        ),
        (["plugins", "nosuch"], "no such command 'nosuch'; see: swarmevo plugins --help"),
        (["evolv"], "no such command 'evolv'; did you mean 'evolve'?"),
        (["evolve", "--seed"], "--seed: expected a value, got none; see: swarmevo evolve --help"),
        (["evolve", "--seed", "abc"], "--seed: expected a whole number, got 'abc'"),
        (["evolve", "--seed", "1.5"], "--seed: expected a whole number, got '1.5'"),
        (["verify", ".", "--sample", "0"], "--sample: expected a whole number of 1 or more, got '0'"),
        (["compare", ".", "--repeats", "x"], "--repeats: expected a whole number from 1 to 65535, got 'x'"),
        (["compare", ".", "--repeats", "65536"], "--repeats: expected a whole number from 1 to 65535, got '65536'"),
        (["replay", "--best", "--speed", "0"], "--speed: expected a number from 0.1 to 100, got '0'"),
        (["replay", "--best", "--speed", "fast"], "--speed: expected a number from 0.1 to 100, got 'fast'"),
        (["test", ".", "--until", "soon"], "--until: expected a number, got 'soon'"),
        (["show", "nosuch"], "nosuch: expected a folder, but it does not exist"),
        (["report", ".", "nosuch"], "nosuch: expected a folder, but it does not exist"),
        (["compare", ".", __file__], f"{__file__}: expected a folder, got a file"),
        (["replay", "--best", "--video", "x.gif"], "--video x.gif: expected a name that ends in .webp or .mp4"),
    ],
)
def test_usage_errors_look_like_all_others(arguments: list[str], error: str, capsys: Any) -> None:
    with pytest.raises(SystemExit) as exit:
        cli.main(arguments)
    assert exit.value.code == 2
    assert capsys.readouterr().err == f"error: {error}\n"
