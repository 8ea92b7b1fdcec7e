# SPDX-License-Identifier: BSD-3-Clause
"""What runs found: fronts, tests, behaviours."""
