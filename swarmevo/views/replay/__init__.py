# SPDX-License-Identifier: BSD-3-Clause
"""An episode played in 3-D."""
