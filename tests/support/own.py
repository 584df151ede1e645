"""The files of `docs/how-to/bring-a-model.md`: a user's model, a law of friction, and their configurations."""

import re
from pathlib import Path

from support import ROOT

_PAGE = (ROOT / "docs" / "how-to" / "bring-a-model.md").read_text(encoding="utf-8")

SHOWN: dict[str, str] = dict(re.findall(r"<!-- file: (\S+) -->\n```\w+\n(.*?)```", _PAGE, re.DOTALL))
"""What the page shows, by the name of the file."""

PENDULUM, FADING = SHOWN["pendulum.py"], SHOWN["fading.py"]

ROLLING = Path(__file__).with_name("rolling.py").read_text(encoding="utf-8")
"""A model that offers LINEAR, and fails late at high spins: one text for several tests, for each text is compiled."""


def write(folder: Path) -> Path:
    """Write the files to a folder, and return it."""
    for name, text in SHOWN.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder
