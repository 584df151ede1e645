"""Every number and figure of Takano (2011) beside ours: rows with a verdict, and figures drawn again."""

from sweep.reproduce.report import reproduce

__all__ = ["reproduce"]
