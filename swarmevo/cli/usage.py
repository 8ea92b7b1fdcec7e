# SPDX-License-Identifier: BSD-3-Clause
"""How commands tell what they are for, and refuse what they were not made for: in one style, whatever the width.

Help is laid out here, for typer has no less than 50 columns, cuts the list of commands, and shows types of Python.
"""

from __future__ import annotations

import os
import re
import shutil
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn, get_args, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

from swarmevo.printable import printable

USAGE = 2
"""Exit code."""

UsageError: Any = typer.BadParameter.__mro__[1]
"""Its home differs between versions of typer."""

_WIDEST, _NARROWEST = 80, 30  # columns
_Formatter: Any = typer.Context.formatter_class


# ---- help ------------------------------------------------------------------------------------------------------------


def examples(*commands: str) -> str:
    """Return command lines as the end of a help text; what two spaces or more part from one is what it does."""
    return "\n".join(["Examples:", *(f"  {command}" for command in commands)])


def columns() -> int:
    """Return how long lines may be: as the terminal is wide, or 80 letters."""
    return max(_NARROWEST, min(shutil.get_terminal_size().columns, _WIDEST))


def listing(rows: Sequence[tuple[str, str]], indent: int = 2) -> list[str]:
    """Return commands and what each does as lines: side by side where all of them fit, else below each other.

    A command that is too long goes on in the next line, behind a backslash, as a shell reads it.
    """
    width, margin = columns(), " " * indent
    longest = max(len(command) for command, _ in rows)
    lines = [f"{margin}{command:<{longest}}  {what}".rstrip() for command, what in rows]
    if all(len(line) <= width for line in lines):
        return lines
    lines = []
    for command, what in rows:
        parts = _broken(command, width - len(" \\"), margin)
        lines += [f"{part} \\" for part in parts[:-1]] + parts[-1:]
        lines += textwrap.wrap(what, width, initial_indent=f"{margin}    ", subsequent_indent=f"{margin}    ")
    return lines


def _broken(command: str, width: int, margin: str) -> list[str]:
    """Return a command's lines; an option and its value stay together, and so does what is quoted."""
    first, *others = re.findall(r"""(?:--\S+ (?!-))?(?:'[^']*'|"[^"]*"|\S)+""", command)
    lines = [margin + first]
    for words in others:
        if len(lines[-1]) + 1 + len(words) <= width:
            lines[-1] += f" {words}"
        else:
            lines.append(f"{margin}    {words}")
    return lines


class _Page(_Formatter):  # type: ignore[misc]  # Any
    """A help text as wide as the terminal, whose left columns leave the right ones room."""

    def __init__(self) -> None:
        super().__init__(width=columns() - 2)

    def write_dl(self, rows: Any, col_max: int = 30, col_spacing: int = 2) -> None:
        """Write two columns."""
        super().write_dl(rows, min(col_max, self.width // 2 - 9), col_spacing)


class _Helpful:
    """A command whose help is a :class:`_Page`."""

    epilog: str | None
    options_metavar: str | None
    get_params: Any
    format_help: Any

    def get_help(self, ctx: Any) -> str:
        """Return the help text."""
        page = _Page()
        self.format_help(ctx, page)
        return str(page.getvalue()).rstrip("\n")

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the examples."""
        head, *commands = (self.epilog or examples()).splitlines()
        parted = [re.split(" {2,}", command.strip()) for command in commands]
        lines = listing([(command, "".join(what)) for command, *what in parted], indent=4)
        formatter.write("\n".join(["", f"  {head}", *lines, ""]))


class Family(_Helpful, TyperGroup):
    """A command that has commands."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write what each of them does."""
        commands: Any = self.commands
        with formatter.section("Commands"):
            formatter.write_dl([(name, _sentence(command.help)) for name, command in commands.items()])


class Program(Family):
    """The command ``swarmevo``, whose usage errors look like all its other errors."""

    def make_context(self, *arguments: Any, **extra: Any) -> Any:
        """Read the arguments up to the verb."""
        with _refusing():
            return super().make_context(*arguments, **extra)

    def invoke(self, ctx: Any) -> Any:
        """Read the verb's arguments and run it."""
        with _refusing():
            return super().invoke(ctx)


class Verb(_Helpful, TyperCommand):
    """A command each of whose options is given once, but for ``--set`` and what only switches something on."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments."""
        values: dict[str, Any] = {}
        try:
            values, _, given = self.make_parser(ctx).parse_args(list(args))
            for option in given:
                is_single = isinstance(option, TyperOption) and not (option.multiple or option.is_flag)
                if is_single and given.count(option) > 1:
                    _exit(f"{option.opts[0]}: expected one value, got two; give it once")
            return super().parse_args(ctx, args)
        except UsageError as error:
            error.ctx = error.ctx or ctx
            parameter = getattr(error, "param", None)
            value = values.get(parameter.name) if parameter else None
            if value is not None:
                self._refuse(parameter, value)
            raise

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the words of the usage line."""
        places = [one.metavar if one.required else f"[{one.metavar}]" for one in self._arguments(ctx)]
        return [self.options_metavar or "", *places]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the arguments and the options."""
        if arguments := [(one.metavar, one.help or "") for one in self._arguments(ctx)]:
            with formatter.section("Arguments"):
                formatter.write_dl(arguments)
        records = [one.get_help_record(ctx) for one in self.get_params(ctx) if one.param_type_name == "option"]
        with formatter.section("Options"):
            formatter.write_dl([record for record in records if record])

    def _refuse(self, parameter: Any, value: Any) -> None:
        """Exit with what was expected of a parameter, if its type tells."""
        annotated, told = get_args(get_type_hints(self.callback, include_extras=True)[parameter.name])
        kinds = (annotated, *get_args(annotated))
        if Path in kinds:
            _refuse_folder([value] if isinstance(value, str) else value)
        for kind, what in ((int, "a whole number"), (float, "a number")):
            if kind in kinds:
                _exit(f"{parameter.opts[0]}: expected {what}{_span(told.min, told.max)}, got {value!r}")

    def _arguments(self, ctx: Any) -> list[Any]:
        return [one for one in self.get_params(ctx) if one.param_type_name == "argument"]


def _sentence(help_text: str) -> str:
    """Return the first sentence."""
    return re.split(r"(?<=\.)\s", " ".join(help_text.split()), maxsplit=1)[0]


# ---- errors ----------------------------------------------------------------------------------------------------------


def _refuse_folder(paths: Sequence[str]) -> None:
    """Exit with the first path that is no folder."""
    for path in paths:
        if not os.path.isdir(path):
            _exit(f"{path}: expected a folder, {'got a file' if os.path.lexists(path) else 'but it does not exist'}")


def _span(least: float | None, most: float | None) -> str:
    if least is None:
        return ""
    return f" from {least} to {most}" if most is not None else f" of {least} or more"


@contextmanager
def _refusing() -> Iterator[None]:
    try:
        yield
    except UsageError as error:
        if type(error).__name__ == "NoArgsIsHelpError":
            raise  # no error: it shows the help
        message = error.format_message().rstrip(".").replace(". Did you mean", "; did you mean")
        if lacking := re.fullmatch("Option '(.*)' requires an argument", message):
            message = f"{lacking[1]}: expected a value, got none"
        command = error.ctx.command_path if error.ctx else "swarmevo"
        see = "" if message.endswith("?") else f"; see: {command} --help"
        _exit(f"{message[:1].lower()}{message[1:]}{see}")


def _exit(error: str) -> NoReturn:
    typer.echo(printable(f"error: {error}"), err=True)
    raise SystemExit(USAGE)
