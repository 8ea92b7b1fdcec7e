# SPDX-License-Identifier: BSD-3-Clause
"""The example of a learner, and the benchmark beside VMAS."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

# Benchmarks and examples are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import learning
from examples import learn_phototaxis


def test_the_example_learns(capsys: pytest.CaptureFixture[str]) -> None:
    """A tenth of its training already beats robots that stand still, in episodes that it has not seen."""
    weights = learn_phototaxis.train(updates=40, worlds=16, horizon=15.0, rate=0.1)
    assert capsys.readouterr().out.splitlines()[0].startswith("update   1: 0.")
    before, after = (learn_phototaxis.evaluate(one, worlds=16) for one in (None, weights))
    assert after["nearness"].mean() > before["nearness"].mean() + 0.05
    assert after["arrived"].mean() > before["arrived"].mean() + 0.25


def test_the_benchmark_has_a_row_for_each_environment_and_ratios_of_neighbouring_runs() -> None:
    """VMAS is not among what tests need: where it is missing it has no row."""
    rates = learning.measured(1, {1: (5, 5), 2: (5, 5)})
    for which in (("SwarmParallelEnv", 1), ("SwarmVectorEnv", 1), ("SwarmVectorEnv", 2)):
        assert rates[which][0] > 0
    beside = {("SwarmVectorEnv", 1): [10.0, 40.0, 30.0], ("VMAS", 1): [5.0, 10.0, 10.0]}
    assert learning.rows(beside) == [
        ["SwarmVectorEnv", "1", "30", "10 to 40", "3.0"],
        ["VMAS", "1", "10", "5 to 10", ""],
    ]
    alone = {("SwarmVectorEnv", 1): [1.0], ("VMAS", 1): []}
    assert learning.rows(alone) == [["SwarmVectorEnv", "1", "1", "1 to 1", ""]]
