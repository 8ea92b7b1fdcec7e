# SPDX-License-Identifier: BSD-3-Clause
"""A sweep: the page and its figures."""
