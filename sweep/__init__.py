"""Parameter sweeps for the reversals of a rattleback.

`load_config`, `run` and `predict` do from Python what `python -m sweep` does from the shell.
"""

from sweep.config import Config, ConfigError, load_config
from sweep.run import predict, run
from sweep.store import StoreError
from sweep.trajectory import trajectory

__all__ = ["Config", "ConfigError", "StoreError", "load_config", "predict", "run", "trajectory"]
