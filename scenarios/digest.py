"""Digests of arrays and of the dataclasses that hold them."""

from __future__ import annotations

import hashlib
from dataclasses import fields, is_dataclass

import numpy as np


def add(digest: hashlib._Hash, value: object) -> None:
    """Add an array, or a dataclass of arrays and numbers: names, types, shapes and bytes."""
    named = (
        {f.name: getattr(value, f.name) for f in fields(value)} if is_dataclass(value) else {"array": value}
    )
    for name, part in named.items():
        if part is not None:
            array = np.ascontiguousarray(part)
            digest.update(f"{name} {array.dtype.str} {array.shape};".encode())
            digest.update(array.data)
