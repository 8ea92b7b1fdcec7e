# SPDX-License-Identifier: BSD-3-Clause
"""Programs that measure swarmevo and write pages of the documentation; run them from the repository's root."""
