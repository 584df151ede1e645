"""Says what the numbers of a run depend on, and so which runs may resume each other's files."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from sweep.faults import either, printable
from sweep.results.store import StoreError

_UNSEEN = {"cases": "the table of cases", "misfit": "the film"}
"""What a configuration names and does not contain, by its key."""


@dataclass(frozen=True)
class Identity:
    """What the numbers of a run depend on.  A run resumes only files of its own identity."""

    config: str
    """The resolved configuration, as YAML."""
    config_hash: str
    source_hash: str
    """Hash of the source code that decides the numbers."""
    versions: str
    """Versions of this program and of the libraries that compile it."""

    def again(self, rerun: str | None) -> Identity:
        """The identity of a run that computes only the cells `rerun` again."""
        return replace(self, config_hash=f"{self.config_hash}+{rerun}") if rerun else self

    @property
    def of_one_run(self) -> bool:
        """Tell whether no cells were computed again with other settings, so that others may be added to them."""
        return "+" not in self.config_hash

    def difference(self, other: Identity) -> str:
        """Why a run of `other` cannot resume files of this identity; "" if it can."""
        if not self.config_hash:
            return "another program, or has been edited since"
        if self.config_hash != other.config_hash:
            old, new = (c.config.splitlines() for c in (self, other))
            changed = [f"- {printable(line.strip())}" for line in old if line not in new]
            changed += [f"+ {printable(line.strip())}" for line in new if line not in old]
            changed += [] if self.of_one_run else ["some cells were computed again (--rerun)"]
            unseen = [words for key, words in _UNSEEN.items() if re.search(rf"\b{key}: ", other.config)]
            changed = changed or [f"{either(unseen or ['the order of the axes'])} differs"]
            return "another configuration:\n  " + "\n  ".join(changed)
        if self.versions != other.versions:
            return f"other versions: {self.versions or 'unknown'}, now {other.versions}"
        return "other sources of the model or kernel" if self.source_hash != other.source_hash else ""


def require_same(path: Path, found: Identity, wanted: Identity) -> None:
    """Raise `StoreError` if the file at `path`, whose identity is `found`, is not of the run `wanted`."""
    if reason := found.difference(wanted):
        raise not_resumed(path, reason)


def not_resumed(path: Path, reason: str) -> StoreError:
    """The error of a file that a run cannot go on from, because it comes from `reason`."""
    return StoreError(
        f"{path}: not resumed, it comes from {reason}\n"
        "  continue it with the same configuration or a larger one, choose another --output, or discard it with --fresh"
    )
