# SPDX-License-Identifier: BSD-3-Clause
"""Linear algebra whose bits do not depend on the number of threads; its matrices are too small for more than one."""

from __future__ import annotations

from typing import Any

from threadpoolctl import ThreadpoolController


class OneThread:
    """Makes ``with self():`` run linear algebra on one thread, for the libraries that are loaded when it is made."""

    def __init__(self) -> None:
        self._controller = ThreadpoolController()

    def __call__(self) -> Any:
        """Return the context."""
        return self._controller.limit(limits=1, user_api="blas")
