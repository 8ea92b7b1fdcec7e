# SPDX-License-Identifier: BSD-3-Clause
"""What infrared sensors return in the Webots world: as the robots evolved with, or as Webots' E-puck has them.

Sources: https://github.com/cyberbotics/webots, projects/robots/gctronic/e-puck/protos/E-puckDistanceSensor.proto, of
2022 (header R2022a) and, for 2013, of the years of Webots 7 and 8.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Literal

from swarmevo.config import Config

Infrared = Literal["evolved", "2013", "2022"]
Table = tuple[tuple[float, float, float], ...]
"""Distance [m], value, standard deviation of its noise over the value; increasing and decreasing."""

_BEYOND: Final = 1e-5
"""[m] behind the last point of an evolved curve, where nothing is seen: Webots returns the last value from there on."""

EPUCK: Final[Mapping[str, Table]] = {
    "2013": (
        (0.0, 4095.0, 0.005),
        (0.005, 3474.0, 0.05),
        (0.01, 2211.0, 0.05),
        (0.02, 676.0, 0.05),
        (0.03, 306.0, 0.05),
        (0.04, 164.0, 0.05),
        (0.05, 90.0, 0.05),
        (0.06, 56.0, 0.05),
        (0.07, 34.0, 0.05),
    ),
    "2022": (
        (0.0, 4095.0, 0.002),
        (0.005, 2133.33, 0.003),
        (0.01, 1465.73, 0.007),
        (0.015, 601.46, 0.0406),
        (0.02, 383.84, 0.01472),
        (0.03, 234.93, 0.0241),
        (0.04, 158.03, 0.0287),
        (0.05, 120.0, 0.04225),
        (0.06, 104.09, 0.03065),
        (0.07, 67.19, 0.04897),
    ),
}


def table(config: Config, infrared: Infrared) -> Table:
    """Return the lookup table of the world's infrared sensors."""
    if infrared != "evolved":
        return EPUCK[infrared]
    curve, noise = config.sensors.infrared_curve, config.noise
    seen = [(x, value, noise.infrared if x > curve[0][0] else noise.infrared_at_contact) for x, value in curve]
    if seen[0][0] > 0:
        seen.insert(0, (0.0, *seen[0][1:]))
    if seen[-1][1] > 0:
        seen.append((seen[-1][0] + _BEYOND, 0.0, 0.0))
    return tuple(seen)
