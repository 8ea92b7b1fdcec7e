# SPDX-License-Identifier: BSD-3-Clause
"""How commands tell what they are for, and refuse what they were not made for: in one style, one line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

from swarmevo.printable import printable

USAGE = 2
"""Exit code."""

UsageError: Any = typer.BadParameter.__mro__[1]
"""Its home differs between versions of typer."""


def examples(*commands: str) -> str:
    """Return command lines as the end of a help text, each on a line of its own whatever the width."""
    return "\n".join(["\b", "Examples:", *(f"  {command}" for command in commands)])


class Program(TyperGroup):
    """The command ``swarmevo``, whose usage errors look like all its other errors."""

    def make_context(self, *arguments: Any, **extra: Any) -> Any:
        """Read the arguments up to the verb."""
        with _refusing():
            return super().make_context(*arguments, **extra)

    def invoke(self, ctx: Any) -> Any:
        """Read the verb's arguments and run it."""
        with _refusing():
            return super().invoke(ctx)


class Verb(TyperCommand):
    """A command each of whose options is given once, but for ``--set`` and what only switches something on."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments."""
        _, _, given = self.make_parser(ctx).parse_args(list(args))
        for option in given:
            if given.count(option) > 1 and isinstance(option, TyperOption) and not (option.multiple or option.is_flag):
                _exit(f"{option.opts[0]}: expected one value, got two; give it once")
        return super().parse_args(ctx, args)


@contextmanager
def _refusing() -> Iterator[None]:
    try:
        yield
    except UsageError as error:
        if type(error).__name__ == "NoArgsIsHelpError":
            raise  # no error: it shows the help
        message = error.format_message().rstrip(".")
        command = error.ctx.command_path if error.ctx else "swarmevo"
        _exit(f"{message[:1].lower()}{message[1:]}; see: {command} --help")


def _exit(error: str) -> NoReturn:
    typer.echo(printable(f"error: {error}"), err=True)
    raise SystemExit(USAGE)
