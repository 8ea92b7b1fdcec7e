# SPDX-License-Identifier: BSD-3-Clause
"""The optimiser that a run asks: what it returns is checked, what it raises is explained."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from swarmevo import plugins, returned
from swarmevo.config import Config
from swarmevo.errors import PluginError
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.state import encode_state
from swarmevo.plugins.calls import blamed, message, one_line
from swarmevo.plugins.checked import plugin_title
from swarmevo.protocols import (
    AnsweringOptimiser,
    BehaviourMap,
    FloatArray,
    GenomeSpace,
    MappingOptimiser,
    Optimiser,
    Problem,
    StartableOptimiser,
    takes_descriptors,
)

OPTIMISER_STREAM: Final = 0x0B7
"""Sets the optimiser's random numbers apart from the episodes'."""


class CheckedOptimiser:
    """The configured optimiser of a trial; what it returns is checked, what it raises is explained.

    It gets copies and gives copies: nothing that it does later changes what was evaluated or stored.
    """

    def __init__(self, config: Config, evaluator: Evaluator, trial: int) -> None:
        ((self._name, options),) = config.optimiser.items()
        self._title = plugin_title("optimiser", self._name)
        self._trial = trial
        self._space: GenomeSpace = evaluator.space
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([evaluator.seed, trial, OPTIMISER_STREAM])))
        self._problem = Problem(tuple(evaluator.objectives), tuple(evaluator.descriptors))
        self._made: Optimiser = plugins.create(
            "optimiser",
            self._name,
            options,
            evaluator.space,
            config.evolution.population,
            len(evaluator.objectives),
            rng,
            problem=self._problem,
        )
        self._takes_descriptors = takes_descriptors(self._made)

    def restore(self, state: Mapping[str, Any] | None, generation: int) -> None:
        """Continue from a stored state; None: begin."""
        if state is not None:
            self._call("restore", generation, state)

    def start_from(self, genomes: FloatArray) -> None:
        """Begin from genomes ``(k, size)``, before the first :meth:`ask`.

        Raises:
            PluginError: The optimiser cannot begin from given genomes, or not from these.
        """
        if not isinstance(self._made, StartableOptimiser):
            raise PluginError(
                f"{self._title}: expected the method start_from, to begin from given genomes, got none; "
                "choose another optimiser or give no genomes"
            )

        def refused(error: BaseException) -> PluginError:
            reason = message(error) if isinstance(error, ValueError) else f"raised {one_line(error)}"
            return PluginError(f"{self._title}: start_from: {reason}")

        with blamed(refused, f"{self._title}: start_from"):
            returned.check_bounds(genomes, self._space)
            self._made.start_from(_given(genomes))

    def ask(self, generation: int) -> FloatArray:
        """Return the genomes to evaluate, ``(n, size)``."""
        return self._genomes("ask", generation, least=1)

    def answer(self, generation: int) -> FloatArray:
        """Return the genomes ``(k, size)`` that it would answer with now; none if it has no answer of its own."""
        if not isinstance(self._made, AnsweringOptimiser):
            return np.empty((0, self._space.size))
        return self._genomes("answer", generation, least=0)

    def _genomes(self, method: str, generation: int, least: int) -> FloatArray:
        """Return a copy of the genomes ``(n, size)`` that a method returns, n at least ``least``."""
        genomes = self._call(method, generation)
        wrong = self._wrong_with(genomes, least)
        if wrong:
            raise self._error(method, generation, wrong)
        return np.array(genomes, order="C")

    def _wrong_with(self, genomes: object, least: int) -> str:
        size = self._space.size
        if type(genomes) is not np.ndarray:  # nor a masked array, whose gaps would become numbers
            return f"expected a NumPy array, got {type(genomes).__name__}"
        if genomes.dtype != np.float64:
            return f"expected dtype float64, got {genomes.dtype}"
        if genomes.ndim != 2 or genomes.shape[0] < least or genomes.shape[1] != size:
            return f"expected the shape (n, {size}) with n >= {least}, got {genomes.shape}"
        if not (finite := np.isfinite(genomes)).all():
            row, column = np.argwhere(~finite)[0]
            return f"expected finite numbers, got {genomes[row, column]} in genome {row}, gene {column}"
        try:
            returned.check_bounds(genomes, self._space)
        except ValueError as error:
            return str(error)
        return ""

    def behaviour_map(self) -> BehaviourMap | None:
        """Return its map of behaviours; None: it keeps none."""
        if not isinstance(self._made, MappingOptimiser):
            return None

        def refused(error: BaseException) -> PluginError:
            reason = message(error) if isinstance(error, ValueError) else f"raised {one_line(error)}"
            return PluginError(f"{self._title}: behaviour_map, trial {self._trial}: {reason}; repair the plugin")

        with blamed(refused, f"{self._title}: behaviour_map"):
            return returned.behaviour_map(self._made.behaviour_map(), self._space, self._problem)

    def tell(self, generation: int, genomes: FloatArray, costs: FloatArray, descriptors: FloatArray) -> None:
        """Tell the costs ``(n, m)`` of the genomes just asked for, and their descriptors ``(n, d)`` if it takes any."""
        more = [_given(descriptors)] if self._takes_descriptors else []
        self._call("tell", generation, _given(genomes), _given(costs), *more)

    def state(self, generation: int) -> str:
        """Return the optimiser's state as it is stored."""
        state = self._call("state", generation)

        def refused(error: BaseException) -> PluginError:
            is_ours = isinstance(error, TypeError)
            return self._error("state", generation, message(error) if is_ours else f"raised {one_line(error)}")

        with blamed(refused, f"{self._title}: state"):  # a mapping of the plugin's own kind is its code, too
            return encode_state(state)

    def _call(self, method: str, generation: int, *arguments: object) -> Any:
        def raised(error: BaseException) -> PluginError:
            return self._error(method, generation, f"raised {one_line(error)}")

        with blamed(raised, f"{self._title}: {method}"):
            return getattr(self._made, method)(*arguments)

    def _error(self, method: str, generation: int, reason: str) -> PluginError:
        return PluginError(
            f"{self._title}: {method}, trial {self._trial}, generation {generation}: {reason}; repair the plugin, then "
            "resume with --accept-changed-plugin: all generations before are stored"
        )


def _given(array: FloatArray) -> FloatArray:
    """Return a copy that nobody can write to."""
    copy = array.copy()
    copy.flags.writeable = False
    return copy
