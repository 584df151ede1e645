"""The command `sweep`, or `python -m sweep`."""

from __future__ import annotations

import os

from sweep import interrupt


def main() -> None:
    interrupt.end_at_once()
    os.environ["MPLBACKEND"] = "agg"  # no command opens a window, and that of a notebook may not be installed
    from sweep.cli import main as command

    command(prog_name="sweep")


if __name__ == "__main__":
    main()
