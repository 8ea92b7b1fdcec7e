# SPDX-License-Identifier: BSD-3-Clause
"""The paper's optimiser (:mod:`.pde`), controller (:mod:`.network`) and fitness (:mod:`.fitness`), as plugins."""
