"""Speed against error for every method and model, and hard cases."""

from sweep.bench.report import bench

__all__ = ["bench"]
