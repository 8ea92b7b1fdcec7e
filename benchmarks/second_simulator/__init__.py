# SPDX-License-Identifier: BSD-3-Clause
"""The paper's whole episode on the reference of ``native/reference``: a second simulator.

It was written from what the documentation says of world, robot, sensors, noise and network (docs/paper-map.md,
docs/configuration.md, docs/runs.md), and shares with the library the numbers of a configuration alone: bodies are moved
by springs, dampers and Coulomb's circles in explicit steps of 10 us, and what robots sense, what disturbs them and what
they do about it is NumPy.
"""
