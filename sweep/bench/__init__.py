"""Speed against error for every method and model, and difficult cases."""

from sweep.bench.report import bench

__all__ = ["bench"]
