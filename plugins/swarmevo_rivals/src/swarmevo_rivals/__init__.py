# SPDX-License-Identifier: BSD-3-Clause
"""Optimisers that rival the paper's: CMA-ES (:mod:`.cma`)."""
