# SPDX-License-Identifier: BSD-3-Clause
"""The version of this distribution, as in ``pyproject.toml``."""

__version__ = "0.1.0"
