# SPDX-License-Identifier: BSD-3-Clause
"""Run folders: written, read, verified, exported."""
