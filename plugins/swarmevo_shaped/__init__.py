# SPDX-License-Identifier: BSD-3-Clause
"""Shaped objectives (:mod:`.objectives`), and several of them in one number (:mod:`.weighted`), as plugins."""
