# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo ARGUMENTS`` in a folder of its own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from swarmevo import cli

SMALL = "episode: {horizon: 1}\nevolution: {population: 4, generations: 2, trials: 2, repeats: 1}\n"


class Outcome(NamedTuple):
    code: int
    out: str
    err: str

    @property
    def errors(self) -> list[str]:
        return [line.removeprefix("error: ") for line in self.err.splitlines() if line.startswith("error: ")]


Swarmevo = Callable[..., Outcome]


@pytest.fixture
def swarmevo_(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Swarmevo:
    """Run ``swarmevo ARGUMENTS`` in a folder that holds nothing but ``small.yaml``."""
    monkeypatch.chdir(tmp_path)
    Path("small.yaml").write_text(SMALL)

    def run(*arguments: object) -> Outcome:
        with pytest.raises(SystemExit) as exit:
            cli.main([str(argument) for argument in arguments])
        code = exit.value.code
        assert code is None or isinstance(code, int)
        return Outcome(code or 0, *capsys.readouterr())

    return run


def files() -> set[str]:
    return {str(path) for path in Path().rglob("*")}
