# SPDX-License-Identifier: BSD-3-Clause
"""What each assumption that the physics rests on is worth: instructions without it, counted by callgrind.

    python -m benchmarks.assumptions

Each is taken out of a copy of ``native/``, most by deleting their line in the list; whole episodes are counted
(``benchmarks/native``).
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
    """Something that a step takes for granted, and checks where it may turn out wrong (``world/assumption.hpp``)."""

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


LIST = "world/assume/list.cpp"
"""Of the assumptions that a step checks: without its line one is gone."""


def _listed(name: str, function: str) -> Assumption:
    return Assumption(name, LIST, f"all.push_back({function}(state));", "")


ASSUMPTIONS = (
    # Without one of these, a step is as true and takes more.
    _listed("a robot that nothing is near and whose wheels hold coasts, in closed form", "assume_coasting"),
    _listed("what would take a push by others to meet does not meet", "assume_clearance"),
    _listed("what is at rest stays there under the same forces", "assume_resting"),
    _listed("a movable that stands is a wall", "assume_standing_movables"),
    _listed("what moved smoothly goes on so: steps of second order", "assume_smooth_motion"),
    Assumption(
        "a robot whose wheels stick goes where they take it: where Newton's method begins",
        "world/compliant.cpp",
        "if (!drive || !drive->sticks()) return;",
        "if (true) return;",
    ),
    # Without one of these, a step is not checked, and takes less.
    _listed("speeds change little in a step: not checked", "assume_steady_speeds"),
    _listed("no bumpers meet in a step: not checked", "assume_no_impacts"),
    _listed("nothing is faster than wheels make it: not checked", "assume_driven_speeds"),
    _listed("friction by ODE is Coulomb's: not checked", "assume_coulomb_friction"),
    _listed("ODE's solver does not stall: not checked", "assume_solvable"),
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
