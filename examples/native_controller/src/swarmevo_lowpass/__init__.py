# SPDX-License-Identifier: BSD-3-Clause
"""A controller whose step is compiled C: ``lowpass.c``, in a library that the wheel has beside this file."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np

from swarmevo.protocols import Block, Compiled, FloatArray, GenomeSpace, SceneInfo

_LIBRARY = ctypes.CDLL(str(Path(__file__).with_name("liblowpass.so")))
_ADDRESS = ctypes.cast(_LIBRARY.lowpass_act, ctypes.c_void_p).value or 0


class LowPass:
    """A weighted sum of all observations for each command, each observation smoothed as fast as its gene says."""

    def space(self, scene: SceneInfo) -> GenomeSpace:
        """Return the layout of a genome in ``scene``."""
        self._sizes = scene.observations, scene.commands
        return GenomeSpace(
            (
                Block("speeds", (scene.observations,)),
                Block("weights", (scene.commands, scene.observations + 1)),
            )
        )

    def policies(self, genomes: FloatArray) -> Compiled:
        """Return the function, with the sizes and the genes of each of ``genomes`` ``(n, size)`` as parameters."""
        sizes = np.tile(np.array(self._sizes, dtype=np.float64), (len(genomes), 1))
        return Compiled(
            function=_ADDRESS,
            parameters=np.hstack([sizes, genomes]),
            memory=self._sizes[0],
            observations=self._sizes[0],
            commands=self._sizes[1],
            keep_alive=_LIBRARY,
        )

    def complexity(self, genomes: FloatArray) -> FloatArray:
        """Return ``(n,)``: zeros, for there are no hidden neurons."""
        return np.zeros(len(genomes))
