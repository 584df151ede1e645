"""What `import sweep` offers: from Python, all that `python -m sweep` does from the shell."""

from __future__ import annotations

from sweep.config import Config, ConfigError, load_config
from sweep.engine.run import predict, run
from sweep.results.store import StoreError
from sweep.studies.critical import critical
from sweep.studies.trajectory import trajectory

__all__ = ["Config", "ConfigError", "StoreError", "critical", "load_config", "predict", "run", "trajectory"]
