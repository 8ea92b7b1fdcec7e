# SPDX-License-Identifier: BSD-3-Clause
"""Checksums of what a run stores: they find what a disk, a copy or a hand has changed since.

A checksum is a SHA-256. That of rows is of their cells as JSON: numbers with all their bits, bytes in hexadecimal
digits. A generation's is of its own row and of the checksums of its individuals and its episodes, so that a reader can
go through each table once.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from typing import Any

from swarmevo.protocols import FloatArray

Rows = Sequence[Sequence[Any]]
"""Of numbers, texts, bytes and None."""


def sha256(content: bytes) -> str:
    """Return the SHA-256 in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def of_genes(genome: FloatArray) -> bytes:
    """Return what tells one genome from another."""
    return hashlib.sha256(genome.astype("<f8").tobytes()).digest()


def of_rows(rows: Rows) -> bytes:
    """Return the checksum of rows."""
    return hashlib.sha256(json.dumps(rows, default=bytes.hex).encode()).digest()


def of_run(run: Sequence[Any], objectives: Rows, successes: Rows, descriptors: Rows) -> bytes:
    """Return the checksum of the row of ``run`` and the rows of ``objective``, ``success`` and ``descriptor``."""
    return of_rows([run, *objectives, *successes, *descriptors])


def of_generation(row: Sequence[Any], individuals: bytes, episodes: bytes) -> bytes:
    """Return the checksum of the row of ``generation``, and of its individuals and episodes by their checksums."""
    return of_rows([row, [individuals, episodes]])
