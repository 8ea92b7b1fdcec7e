# SPDX-License-Identifier: BSD-3-Clause
"""Trackers: how a run goes on, shown by the programs that people watch experiments with."""
