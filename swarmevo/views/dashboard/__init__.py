# SPDX-License-Identifier: BSD-3-Clause
"""A live page of runs."""
