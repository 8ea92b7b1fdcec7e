# SPDX-License-Identifier: BSD-3-Clause
"""Shaped objectives (:mod:`.objectives`), several in one (:mod:`.weighted`), and :mod:`.descriptors`, as plugins."""
