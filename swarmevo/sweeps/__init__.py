# SPDX-License-Identifier: BSD-3-Clause
"""Sweeps: a run for each setting of a grid and each seed, in one folder that can be gone on with as a whole."""
