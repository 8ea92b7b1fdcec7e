# SPDX-License-Identifier: BSD-3-Clause
"""What tests of a run's controllers gave, beside the paper's Table II; and the file that it is stored in.

The file is ``table_ii.json`` in the run folder; a later test replaces it, unless something would be lost. Tests in
another world than that of evolution have no file there.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import pydantic

from swarmevo.errors import StoreError
from swarmevo.protocols import FloatArray
from swarmevo.runs import checksums, files
from swarmevo.runs.store import Store

FILE: Final = "table_ii.json"
FORMAT: Final = 1
"""Of the file; another one is refused."""


class PaperRow(NamedTuple):
    """A row of the paper's Table II; rates in [0, 1], times in seconds, None: "Max"."""

    robots: int
    homing_rate: float
    homing_time: float
    push_rate: float
    push_time: float | None


PAPER: Final = (
    PaperRow(1, 0.1333, 10.36, 0.0, None),
    PaperRow(2, 0.2667, 12.37, 0.0, None),
    PaperRow(3, 0.9767, 13.54, 0.96, 43.44),
    PaperRow(4, 0.9333, 13.78, 0.56, 37.42),
    PaperRow(5, 0.8867, 11.68, 0.30, 30.67),
)
"""The paper's Table II."""


@dataclass(frozen=True)
class Outcome:
    """What a number of tests with teams of one size gave."""

    robots: int
    tests: int
    homing_rate: float
    """Share of robots that came within the emitter's range."""
    any_home_rate: float
    """Share of tests in which at least one robot did."""
    all_home_rate: float
    """Share of tests in which all robots did."""
    homing_time: float | None
    """Mean over the robots that did [s]; None: none did."""
    push_rate: float
    """Share of tests in which the box touched the target wall."""
    push_time: float | None
    """Mean over those tests [s]; None: in none, the paper's "Max"."""


@dataclass(frozen=True)
class Tested:
    """One controller of a trial's front."""

    trial: int
    genome: int
    """Its id in the store."""
    evolved: dict[str, float]
    """Its objectives in the run: means over the episodes it was selected by."""
    tested: dict[str, float]
    """The same in the tests, with as many robots as in evolution."""
    outcomes: list[Outcome]
    """One for each team size."""
    behaviours: dict[str, float]
    """Share of robots with each label of the census, with as many robots as in evolution."""


@dataclass(frozen=True)
class Condition:
    """A change of the world that no controller was evolved in."""

    name: str
    changes: str
    """Of the configuration."""
    outcome: Outcome


@dataclass(frozen=True)
class Assessment:
    """All tests of a run."""

    format: int
    generation: int
    """Of the tests' episode keys."""
    generations: dict[int, int]
    """For each trial: how many generations it had when it was tested."""
    repeats: int
    horizon: float
    """Of a test [s]: a robot that has not succeeded by then never does."""
    rows: list[Outcome]
    """Table II: for each team size the means over all controllers."""
    controllers: list[Tested]
    behaviours: dict[str, float]
    """Over all controllers."""
    robustness: list[Condition]
    """The undisturbed world first; empty if it was not asked for."""
    changes: list[str] = field(default_factory=list)
    """What the tests' world has other than that of evolution, key by key."""

    def is_stale(self, store: Store) -> bool:
        """Whether the run has gone on since."""
        return self.generations != {trial: store.generations(trial) for trial in store.trials()}

    def beyond(self, other: Assessment) -> list[str]:
        """Return what these tests have and others of the same generations lack, in words; of other generations: []."""
        if self.generations != other.generations:
            return []
        sizes = sorted({row.robots for row in self.rows} - {row.robots for row in other.rows})
        more = {
            f"{self.repeats} repeats": self.repeats > other.repeats,
            f"teams of {', '.join(map(str, sizes))}": bool(sizes),
            "robustness": bool(self.robustness) and not other.robustness,
        }
        return [what for what, holds in more.items() if holds]


def outcome(robots: int, homing_time: FloatArray, push_time: FloatArray) -> Outcome:
    """Return the outcome of tests: ``homing_time`` ``(tests, robots)`` and ``push_time`` ``(tests,)``; NaN: never."""
    home = np.isfinite(homing_time)
    return Outcome(
        robots=robots,
        tests=len(push_time),
        homing_rate=float(home.mean()),
        any_home_rate=float(home.any(axis=1).mean()),
        all_home_rate=float(home.all(axis=1).mean()),
        homing_time=_mean(homing_time),
        push_rate=float(np.isfinite(push_time).mean()),
        push_time=_mean(push_time),
    )


def _mean(times: FloatArray) -> float | None:
    finite = times[np.isfinite(times)]
    return float(finite.mean()) if finite.size else None


# ---- the file --------------------------------------------------------------------------------------------------------


_ASSESSMENT: Final = pydantic.TypeAdapter(Assessment)


def as_json(assessment: Assessment) -> str:
    """Return an assessment as JSON, with the paper's table beside it."""
    found = dataclasses.asdict(assessment) | {"paper": [row._asdict() for row in PAPER]}
    return pydantic.TypeAdapter(dict[str, Any]).dump_json(found, indent=2).decode()


def save(assessment: Assessment, folder: Path) -> Path:
    """Write an assessment into its run's folder, in place of an older one; return the file.

    Args:
        assessment: In the run's own world.
        folder: Of the run.

    Raises:
        OutputError: It cannot be written.
        ValueError: It is of another world.
    """
    if assessment.changes:
        raise ValueError(f"assessment: expected one in the run's own world, got {', '.join(assessment.changes)}")
    file = folder / FILE
    files.write(file, json.dumps(sealed(json.loads(as_json(assessment))), indent=2) + "\n")
    return file


def lost_by_saving(assessment: Assessment, folder: Path) -> list[str]:
    """Return what a run's folder holds that would be lost, in words (:meth:`Assessment.beyond`); a damaged file: []."""
    try:
        stored = load(folder)
    except StoreError:
        return []
    return stored.beyond(assessment) if stored else []


def sealed(content: dict[str, Any]) -> dict[str, Any]:
    """Return the content of the file with its checksum, in place of one that it may have."""
    plain = {key: value for key, value in content.items() if key != "sha256"}
    return {**plain, "sha256": checksums.sha256(json.dumps(plain, sort_keys=True).encode())}


def load(folder: Path) -> Assessment | None:
    """Return the assessment in a run's folder; None: the run was not tested.

    Raises:
        StoreError: The file is damaged, was changed, or is of another version.
    """
    file = folder / FILE
    damaged = StoreError(f"{file}: is damaged; make it again with swarmevo test")
    try:
        stored = json.loads(file.read_bytes())
        found = _ASSESSMENT.validate_python(stored)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, RecursionError) as error:
        raise damaged from error
    if found.format != FORMAT:
        raise StoreError(f"{file}: expected format {FORMAT}, got {found.format}; make it again with swarmevo test")
    if sealed(stored) != stored:
        raise damaged
    return found
