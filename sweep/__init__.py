"""Parameter sweeps for the reversals of a rattleback.  The public names stand in `sweep.api`.

They are imported when they are first used: an import of all would take a second, even where only help is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sweep.api import __all__ as __all__

if TYPE_CHECKING:
    from sweep.api import *  # noqa: F403


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from sweep import api

    return getattr(api, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
