"""Defines what the numbers of a run depend on, and so which runs may resume each other's files."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from sweep.faults import either, printable
from sweep.results.store import StoreError

_UNSEEN = {"cases": "the table of cases", "misfit": "the film"}
"""Inputs that a configuration names but does not contain, by key."""


@dataclass(frozen=True)
class Identity:
    """Everything that the numbers of a run depend on. A run resumes only files with its own identity."""

    config: str
    """The resolved configuration, as YAML."""
    config_hash: str
    source_hash: str
    """Hash of the source code that decides the numbers."""
    versions: str
    """Versions of this program and of the libraries that compile it."""

    def again(self, rerun: str | None) -> Identity:
        """Return the identity of a run that repeats only the cells `rerun`."""
        return replace(self, config_hash=f"{self.config_hash}+{rerun}") if rerun else self

    @property
    def of_one_run(self) -> bool:
        """Return whether no cells were repeated with other settings, so that more cells may be added."""
        return "+" not in self.config_hash

    def difference(self, other: Identity) -> str:
        """Say why a run of `other` cannot resume files with this identity; return "" if it can."""
        if not self.config_hash:
            return "another program, or has been edited since"
        if self.config_hash != other.config_hash:
            old, new = (c.config.splitlines() for c in (self, other))
            changed = [f"- {printable(line.strip())}" for line in old if line not in new]
            changed += [f"+ {printable(line.strip())}" for line in new if line not in old]
            changed += [] if self.of_one_run else ["some cells were repeated (--rerun)"]
            unseen = [name for key, name in _UNSEEN.items() if re.search(rf"\b{key}: ", other.config)]
            changed = changed or [f"{either(unseen or ['the order of the axes'])} differs"]
            return "another configuration:\n  " + "\n  ".join(changed)
        if self.versions != other.versions:
            return f"other versions: {self.versions or 'unknown'}, now {other.versions}"
        return "other sources of the model or kernel" if self.source_hash != other.source_hash else ""


def require_same(path: Path, found: Identity, wanted: Identity) -> None:
    """Raise a `StoreError` if the file at `path`, with the identity `found`, does not belong to the run `wanted`."""
    if reason := found.difference(wanted):
        raise not_resumed(path, reason)


def not_resumed(path: Path, reason: str) -> StoreError:
    """Return the error for a file that cannot be resumed, because it comes from `reason`."""
    return StoreError(
        f"{path}: not resumed, it comes from {reason}\n"
        "  continue it with the same configuration or a larger one, choose another --output, or discard it with --fresh"
    )
