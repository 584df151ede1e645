"""The command `sweep`, or `python -m sweep`."""

from __future__ import annotations

from sweep import interrupt


def main() -> None:
    interrupt.end_at_once()
    from sweep.cli import main as command

    command(prog_name="sweep")


if __name__ == "__main__":
    main()
