# SPDX-License-Identifier: BSD-3-Clause
"""Controllers whose genome is as long as the scene's observations and commands want it."""

from __future__ import annotations

from collections.abc import Sequence

from swarmevo.protocols import Block, FloatArray, GenomeSpace, SceneInfo


class SceneLayout:
    """Lays out genomes for the scene that it was last asked about, and cuts them up accordingly."""

    _space: GenomeSpace | None = None

    def space(self, scene: SceneInfo) -> GenomeSpace:
        """Return the layout of a robot's genome in ``scene``. It is to be asked for before genomes are given."""
        self._space = GenomeSpace(tuple(self._blocks(scene)))
        return self._space

    def _blocks(self, scene: SceneInfo) -> Sequence[Block]:
        raise NotImplementedError("_blocks: expected an override that returns the genome's blocks")

    def _split(self, genomes: FloatArray) -> dict[str, FloatArray]:
        """Return for each block's name ``(n, *shape)``.

        Raises:
            ValueError: The genomes are of another size, or ``space`` was never asked for.
        """
        if self._space is None:
            raise ValueError("genomes: expected space(scene) to be asked for first; it tells what they hold")
        return self._space.split(genomes)
