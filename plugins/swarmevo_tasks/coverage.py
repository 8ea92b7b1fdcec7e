# SPDX-License-Identifier: BSD-3-Clause
"""Coverage: the team visits as much of the arena as it can, around what stands in it."""

from __future__ import annotations

import numpy as np

from swarmevo.protocols import BoolArray, FloatArray, Follower, IntArray, SceneInfo, Step, Telemetry
from swarmevo_shaped.objectives import Explained
from swarmevo_tasks import geometry


class Coverage(Explained):
    """The share of the arena's free cells that any robot has been in.

    The cells are squares, from the arena's south-western end on. One is free if a robot that stands in the middle of it
    is clear of walls and obstacles. A robot is in the cell that its centre is in.

    Args:
        cell: Side of a cell [m].
        enough: Share from which on an episode is a success.

    Raises:
        ValueError: No cell is free, there are more than a million, or ``enough`` is no share.
    """

    name = "coverage"
    channels = ("pose",)

    def __init__(self, scene: SceneInfo, cell: float = 0.1, enough: float = 0.8) -> None:
        if not isinstance(enough, (int, float)) or not 0 < enough <= 1:
            raise ValueError(f"enough: expected a share above 0 and up to 1, got {enough!r}")
        self.success = float(enough)
        corners = geometry.corners_of(scene.world["arena"])
        self._origin, self._cell = corners.min(axis=0), cell
        if not 0 < cell < np.inf or np.prod(np.ptp(corners, axis=0) / cell) > 1e6:
            raise ValueError(f"cell: expected a side of at most a million cells [m], got {cell!r}")
        columns, rows = (max(1, round(side)) for side in np.ceil(np.ptp(corners, axis=0) / cell - 1e-9))
        middles = self._origin + cell * (np.argwhere(np.ones((columns, rows))) + 0.5)
        self._columns, self._rows = columns, rows
        self._is_free = geometry.clearance(scene.world, middles) >= scene.world["robot"]["radius"]
        if not self._is_free.any():
            raise ValueError(f"cell: expected some that a robot can stand in, got none of {cell!r} m")

    def course(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes, steps)``: the share so far."""
        steps, free = telemetry.pose.shape[1], self._is_free.sum()

        def course(cells: IntArray) -> FloatArray:
            first = self._first_visits(cells)[self._is_free]
            return np.asarray(np.bincount(first, minlength=steps + 1)[:steps].cumsum() / free)

        return np.array([course(cells) for cells in self._cells(telemetry)])

    def behaviours(self, telemetry: Telemetry) -> dict[str, BoolArray]:
        """Return which robots were mostly where another one had been before: in most of the free cells they visited."""

        def followed(cells: IntArray) -> list[bool]:
            first = np.array([self._first_visits(one[:, np.newaxis])[self._is_free] for one in cells.T])
            own, others = first < len(cells), (first > first.min(axis=0))
            return [bool(late.sum() > 0.5 * came.sum()) for came, late in zip(own, own & others, strict=True)]

        return {"mostly in others' tracks": np.array([followed(cells) for cells in self._cells(telemetry)])}

    def _cells(self, telemetry: Telemetry) -> IntArray:
        """Return ``(episodes, steps, robots)``: the number of the cell that a robot is in."""
        places = np.floor((telemetry.pose[..., :2] - self._origin) / self._cell).astype(np.intp)
        column, row = (places[..., i].clip(0, n - 1) for i, n in enumerate((self._columns, self._rows)))
        return np.asarray(column * self._rows + row)

    def _first_visits(self, cells: IntArray) -> IntArray:
        """Return for each cell the step in which any robot of ``cells`` ``(steps, robots)`` was first there."""
        steps = len(cells)
        first = np.full(len(self._is_free), steps)  # at the end: never
        np.minimum.at(first, cells, np.arange(steps)[:, np.newaxis])
        return first

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``: the share at the end."""
        return self.course(telemetry)[:, -1]

    def follow(self, worlds: int) -> Follower:
        """Return what tells the share so far."""
        visited = np.zeros((worlds, len(self._is_free)), dtype=np.bool_)
        free, everywhere = self._is_free.sum(), np.arange(worlds)[:, np.newaxis]

        def follow(step: Step) -> FloatArray:
            visited[step.is_first] = False
            visited[everywhere, self._cells(step.telemetry)[:, 0]] = True
            return np.asarray(visited[:, self._is_free].sum(axis=1) / free)

        return follow
