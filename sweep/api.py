"""The public names: what `import sweep` offers, which is what `python -m sweep` does from the shell."""

from __future__ import annotations

from sweep.config import Config, ConfigError, load_config
from sweep.engine.run import run
from sweep.results.store import StoreError
from sweep.studies.critical import critical
from sweep.studies.predictions import predict
from sweep.studies.trajectory import trajectory

__all__ = ["Config", "ConfigError", "StoreError", "critical", "load_config", "predict", "run", "trajectory"]
