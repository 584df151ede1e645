"""Speed against error of every method and model, and the cases that are hard to get right."""

from sweep.bench.report import bench

__all__ = ["bench"]
