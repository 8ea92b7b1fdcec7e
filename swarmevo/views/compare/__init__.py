# SPDX-License-Identifier: BSD-3-Clause
"""Runs held against each other: the page and its figures."""
