"""No name that ended before 1.0 is left in code, pages, messages or tests; `docs/reference/dataset.md` has today's."""

import re

from support import ROOT

ENDED = (
    r"ConfigError|StoreError|sweep\.open\(|sweep\.changes|sweep\.indices|`(changes|indices)`"
    r"|n_c[12]_(plus|minus)|critical_reason|reversal_time_reason|reversals_foreseen|foreseen_sure|\bforeseen\b"
    r"|noise_limited|window_dependent|\bsensitive\b.: 1|stop_when_settled|\bpatience: [0-9]|raw_reversals"
    r"|\[reversals, first_reversal|`first_reversal`|lyapunov|celtic_stone|regimes\.yaml|regularisation:|model_sha256: "
    r"|--rerun|--refine|--sel\b"
    r"|--stop-when-settled|--scheduler|refine: [0-9]|entry point of a package|{misfit: "
)
"""Names in the forms in which people write them; words that mean something else too stand with what follows them."""

EXEMPT = {
    "tests/test_names.py", "scripts/same_numbers.py", "tests/test_scripts.py", "scripts/LOG.md",
    "scripts/reference_counts_500.py",
}  # fmt: skip
"""What compares with older revisions, what was tried then, and a column of a reference table."""


def test_no_ended_name_is_left() -> None:
    folders = ("sweep", "tests", "docs", "scripts", "configs")
    paths = [path for folder in folders for path in (ROOT / folder).rglob("*") if path.suffix in _TEXT]
    left = [
        f"{name}: {match[0]}"
        for path in (*paths, ROOT / "README.md")
        if (name := str(path.relative_to(ROOT))) not in EXEMPT
        for match in re.finditer(ENDED, path.read_text(encoding="utf-8"), re.IGNORECASE)
    ]
    assert left == []


_TEXT = {".py", ".md", ".yaml", ".js", ".html", ".css"}
