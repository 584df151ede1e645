"""The origin of a user's model.

A model of this package has no origin: it is part of the package's sources.
"""

from __future__ import annotations

import hashlib
import importlib.util
from dataclasses import dataclass
from pathlib import Path

from sweep.sources import hashed


@dataclass(frozen=True)
class Origin:
    """A file, or an entry point of a package.  Plain data, so that other processes can load the very same code."""

    name: str
    """Its name in the configuration."""
    place: str
    """Path of the file, for messages; "package.module:MODEL" for an entry point."""
    text: str
    """Text of the file, which runs wherever the model is loaded; "" for an entry point."""
    digest: str
    """SHA-256 of the file, or of all Python files of the entry point's package."""

    @classmethod
    def of_file(cls, name: str, place: str, text: str) -> Origin:
        return cls(name, place, text, hashlib.sha256(text.encode()).hexdigest())

    @classmethod
    def of_package(cls, name: str, place: str) -> Origin:
        """The origin of an entry point; nothing is imported."""
        return cls(name, place, "", hashed(map(Path, _sources(place))))

    @property
    def is_file(self) -> bool:
        return self.place.endswith(".py")

    @property
    def files(self) -> list[str]:
        """The file, or all Python files of the package."""
        return [self.place] if self.is_file else _sources(self.place)


def _sources(place: str) -> list[str]:
    spec = importlib.util.find_spec(place.partition(":")[0].partition(".")[0])
    if spec is None:
        return []
    found = [path for folder in spec.submodule_search_locations or () for path in Path(folder).rglob("*.py")]
    return sorted(map(str, found)) or [str(spec.origin)]
