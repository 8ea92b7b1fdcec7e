# SPDX-License-Identifier: BSD-3-Clause
"""Optimisers that rival the paper's.

CMA-ES (:mod:`.cma`), MAP-Elites (:mod:`.map_elites`), searches for a Pareto front (:mod:`.pareto`) and chance
(:mod:`.random_search`).
"""
