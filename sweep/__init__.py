"""Parameter sweeps for the reversals of a rattleback.  The public names stand in `sweep.api`.

They are imported when they are first used: an import of all would take a second, even where only help is asked for.
"""

from __future__ import annotations

import sys
from importlib import import_module

if sys.platform == "win32":
    raise ImportError("sweep runs on Linux and macOS; on Windows, install it in WSL, the Windows Subsystem for Linux")

from sweep.api import HOMES, AfterXarray, register
from sweep.api import __all__ as __all__

TYPE_CHECKING = False  # True for type checkers; `typing` is not imported before Ctrl-C is taken care of
if TYPE_CHECKING:
    from sweep.api import *  # noqa: F403

    __version__: str
else:

    def __getattr__(name: str) -> object:
        if name == "__version__":
            from importlib.metadata import version

            return version("rattleback-sweep")
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(HOMES.get(name, "sweep.api")), name)


sys.meta_path.insert(0, AfterXarray())
if "xarray" in sys.modules:
    register()


def __dir__() -> list[str]:
    return __all__
