"""The public names: what `import sweep` offers, which is what `python -m sweep` does from the shell."""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # as in `sweep`
if TYPE_CHECKING:
    from sweep.config import Config, ConfigError, load_config
    from sweep.engine.run import run
    from sweep.results.store import StoreError
    from sweep.studies.critical import critical
    from sweep.studies.predictions import predict
    from sweep.studies.trajectory import trajectory

__all__ = ["Config", "ConfigError", "StoreError", "critical", "load_config", "predict", "run", "trajectory"]

_HOMES = {
    "Config": "sweep.config",
    "ConfigError": "sweep.config",
    "StoreError": "sweep.results.store",
    "critical": "sweep.studies.critical",
    "load_config": "sweep.config",
    "predict": "sweep.studies.predictions",
    "run": "sweep.engine.run",
    "trajectory": "sweep.studies.trajectory",
}
"""The modules that define these names; each is imported when one of its names is first used."""


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
