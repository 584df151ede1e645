"""Speed against error for every method and model, and cases that are hard to get right."""

from sweep.bench.report import bench

__all__ = ["bench"]
