# SPDX-License-Identifier: BSD-3-Clause
"""How runs are shown: console, figures, replays, reports."""
