"""Every number and figure of Takano (2011) compared with ours: rows with a verdict, and redrawn figures."""

from sweep.reproduce.report import reproduce

__all__ = ["reproduce"]
