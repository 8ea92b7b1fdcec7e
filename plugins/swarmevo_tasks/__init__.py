# SPDX-License-Identifier: BSD-3-Clause
"""Objectives of swarm tasks as plugins (``docs/tasks.md``).

They are in :mod:`.aggregation`, :mod:`.coverage`, :mod:`.delivery` and :mod:`.phototaxis`.
"""
