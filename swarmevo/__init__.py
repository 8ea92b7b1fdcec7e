# SPDX-License-Identifier: BSD-3-Clause
"""Evolves controllers for swarms of simulated robots, with several objectives at once."""

__version__ = "0.1.0"
