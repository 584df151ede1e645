"""Python in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path

from support import ROOT


def python(
    *words: str | Path, folder: Path = ROOT, code: int = 0, **environment: str
) -> subprocess.CompletedProcess[str]:
    """What `python WORDS` says in a folder, with further variables of the environment; it has to exit with `code`."""
    done = subprocess.run(
        [sys.executable, *words],
        cwd=folder, env=os.environ | environment, capture_output=True, encoding="utf-8", check=False,
    )  # fmt: skip
    assert done.returncode == code, done.stderr
    return done
