# SPDX-License-Identifier: BSD-3-Clause
"""What each assumption that the physics rests on is worth: instructions without it, counted by callgrind.

    python -m benchmarks.assumptions

Each is undone by a change at one place of a copy of ``native/``; whole episodes are counted (``benchmarks/native``).
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
CASES = ("roaming", "pushing", "pressed", "random")
"""Of ``benchmarks/native/episodes.cpp``."""


@dataclass(frozen=True)
class Assumption:
    """Something that is taken for granted, and checked after the step where it may turn out wrong."""

    name: str
    file: str
    """In ``native/src``."""
    code: str
    """What it rests on, which is there once."""
    without: str

    def undo(self, sources: Path) -> None:
        """Take it out of a copy of ``native/src``.

        Raises:
            ValueError: The code is not there, or more than once.
        """
        file = sources / self.file
        text = file.read_text()
        if text.count(self.code) != 1:
            raise ValueError(f"{self.file}: expected {self.code!r} once, found it {text.count(self.code)} times")
        file.write_text(text.replace(self.code, self.without))


ASSUMPTIONS = (
    Assumption(
        "a robot that nothing is near and whose wheels hold coasts, in closed form",
        "world/world.cpp",
        "robot.coasts = robot.is_free && robot.drive->can_coast(time_step);",
        "robot.coasts = false;",
    ),
    Assumption(
        "what would take a shove to meet does not meet",
        "world/world.cpp",
        "average.begin(time_step, !is_level || cautious);",
        "average.begin(time_step, true);",
    ),
    Assumption(
        "what is at rest stays there under the same forces",
        "world/world.cpp",
        "if (!is_level || scene.sensors.touch_mode == SWE_TOUCH_MODE_FORCE) return rest;",
        "if (is_level || scene.sensors.touch_mode == SWE_TOUCH_MODE_FORCE) return rest;",
    ),
    Assumption(
        "a box that stands is a wall",
        "world/box.cpp",
        "stands_ = is_level_ && is_still && corner_limit_ > 0;",
        "stands_ = is_level_ && is_still && corner_limit_ > 1e9;",
    ),
    Assumption(
        "a robot whose wheels stick goes where they take it: where Newton's method begins",
        "world/compliant.cpp",
        "if (!drive || !drive->sticks()) return;",
        "if (true) return;",
    ),
)


def instructions(undone: Assumption | None = None) -> dict[str, int] | str:
    """Count the instructions of each case, without an assumption; or return why they can't be counted."""
    if not shutil.which("valgrind"):
        return "valgrind is not installed"
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "source")
        for name in ("native", "benchmarks/native"):
            shutil.copytree(ROOT / name, copy / name)
        for name in ("CMakeLists.txt", "pyproject.toml"):
            shutil.copy(ROOT / name, copy / name)
        if undone:
            undone.undo(copy / "native" / "src")
        build = Path(folder, "build")
        counts = {}
        for command in (
            ["cmake", "-S", str(copy), "-B", str(build), "-DSWARMEVO_BENCHMARKS=ON"],
            ["cmake", "--build", str(build), "--target", "episodes"],
        ):
            if subprocess.run(command, capture_output=True).returncode:
                return f"{command[0]} failed"
        for case in CASES:
            out = Path(folder, case)
            command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", str(build / "episodes"), case]
            if subprocess.run(command, capture_output=True).returncode:
                return f"{case} failed"
            counts[case] = int(re.findall(r"^(?:summary|totals): (\d+)", out.read_text(), re.MULTILINE)[-1])
        return counts


def rows(assumptions: Sequence[Assumption] = ASSUMPTIONS) -> list[list[str]]:
    """Return for each assumption how many times as many instructions each case takes without it."""
    usual = instructions()
    return [[each.name, *_ratios(usual, instructions(each))] for each in assumptions]


def _ratios(usual: Mapping[str, int] | str, without: Mapping[str, int] | str) -> list[str]:
    if isinstance(usual, str) or isinstance(without, str):
        reason = usual if isinstance(usual, str) else str(without)
        return [f"not counted: {reason}"] + [""] * (len(CASES) - 1)
    return [f"{without[case] / usual[case]:.2f}" for case in CASES]


if __name__ == "__main__":
    for row in rows():
        print(" | ".join(row))
