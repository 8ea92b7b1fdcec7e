# SPDX-License-Identifier: BSD-3-Clause
"""Controllers beside the paper's: a linear one, and networks with a memory, of any number of observations."""
