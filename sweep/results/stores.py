"""The stores by name.  A run takes "checkpoint" if it has an output folder, and "memory" otherwise."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sweep.results.checkpoint import Checkpoint
from sweep.results.identity import Identity
from sweep.results.memory import Memory
from sweep.results.store import Store

STORES: dict[str, Callable[[Path, Identity, Callable[[str], None]], Store]] = {
    "checkpoint": Checkpoint,
    "memory": lambda folder, identity, note: Memory(),  # noqa: ARG005
}
"""Each is made from the folder of its files, the identity of the run, and what takes a line for each damaged file."""
