# SPDX-License-Identifier: BSD-3-Clause
"""The loop: ask the optimiser, evaluate, tell it, store; and where episodes run."""
