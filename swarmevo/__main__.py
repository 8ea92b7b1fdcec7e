# SPDX-License-Identifier: BSD-3-Clause
"""``python -m swarmevo`` is ``swarmevo``."""

from swarmevo.cli import program

program()
