"""Imported by the fork server of `nursery`: leaves a process that has done all that a first run has to do once."""

import tempfile
from pathlib import Path

from support import nursery  # noqa: F401
from sweep.cli import main

TEXT = "body: {b: [2, 3]}\nfriction: {mu: [50, 60]}\nintegrator: {t_end: 5}\n"

with tempfile.TemporaryDirectory() as folder:
    (Path(folder) / "warm.yaml").write_text(TEXT, encoding="utf-8")
    main(["run", f"{folder}/warm.yaml", "--output", folder, "--quiet"], standalone_mode=False)
