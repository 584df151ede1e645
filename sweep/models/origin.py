"""The origin of a user's model.

A model of this package has no origin: it is part of the package's sources.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass


@dataclass(frozen=True)
class Origin:
    """A Python file.  Plain data, so that other processes can load the very same code."""

    name: str
    """Its name in the configuration."""
    place: str
    """Path of the file, for messages."""
    text: str
    """Text of the file, which runs wherever the model is loaded."""
    digest: str
    """SHA-256 of the file."""

    @classmethod
    def of_file(cls, name: str, place: str, text: str) -> Origin:
        return cls(name, place, text, hashlib.sha256(text.encode()).hexdigest())
