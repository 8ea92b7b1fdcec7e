# SPDX-License-Identifier: BSD-3-Clause
"""A package, so that a file here may have the name of one elsewhere."""
