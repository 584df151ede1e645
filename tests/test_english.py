"""No patterns of translated syntax in the pages, the README and the comments of configurations."""

import re

import pytest
from support import ROOT

PAGES = [ROOT / "README.md", *ROOT.glob("docs/*.md"), *ROOT.glob("docs/[!_]*/*.md"), *ROOT.glob("configs/*.yaml")]

# What not to write: what to write instead.
BETTER = {
    r"\b(tells|told|(they|that|which|margins) tell)\b(?! (us|you|them|apart)\b)": "gives, shows, reports",
    r"\bbeside (?=what|that|this|which|its|our|other|the (motion|paper|prediction|formula))": "besides, compared with",
    r"\bone's own\b": "your own, user-defined",
    r"\b(are|of|is) such(?=[,.;:])|\bSuch (are|is) (?!an?\b)": "the noun again",
    r"\bfrom (which|[\d.]+( \S+)?) on(?=[,.;:)])": "above which, for ... or more",
    r"(?<![Tt]here )\b(is|are) none(?=[,.;:])|\bno longer one that\b": "a positive statement",
    r"\b(Told|Refused|Shown|Missing|Given) (is|are)\b": "subject, verb, object",
    r"\bOf (both|nearly|a (?!total))\b": "subject, verb, object",
    r", also (if|where|when|without)\b": "even if, even without",
    r"(?<![Tt]here )\bis no (axis|word|part|name|parameter|field)\b": "is not a, has no",
    r"\bknows? no\b": "does not support, has no",
    r"\botherwise than\b": "differently from",
    r", which is said[.;,]": "with a note",
    r"\bAll else that\b|\bWhat is not given\b": "all other ..., missing ...",
    r"\b(center|color|behavior|neighbor|gray)(s|ed|ing)?\b": "the British spelling",
}
_NOT_PROSE = re.compile(r"^ *```.*?^ *```$|<!--.*?-->|`[^`]*`|\$\$?[^$]+\$\$?|\]\([^)]*\)", re.MULTILINE | re.DOTALL)


def faults(text: str, name: str = "text") -> list[str]:
    """List the old patterns of a page with lines and better words; code, formulas and targets of links are free."""
    flat = _NOT_PROSE.sub(lambda match: " " * len(match[0]), text).replace("\n", " ")
    found = [(match, better) for old, better in BETTER.items() for match in re.finditer(old, flat)]
    lines = [text.count("\n", 0, match.start()) + 1 for match, _ in found]
    return [f"{name}:{n}: {match[0]!r}: write {better}" for n, (match, better) in zip(lines, found, strict=True)]


def test_pages_read_as_plain_english() -> None:
    assert not [fault for page in PAGES for fault in faults(page.read_text(encoding="utf-8"), page.name)]


OLD = (
    "`spin_error` tells it|they tell what follows|spin beside its\nslow change|a model of one's own"
    "|if all are such, skip|from 2 rad/s on.|A mean is none.|Refused is a run|Of both papers|runs, also if it settled"
    "|c is no axis|EPS knows no colours|otherwise than 2.4|dropped, which is said.|All else that it has"
    "|the center of mass"
)


@pytest.mark.parametrize("old", OLD.split("|"))
def test_an_old_pattern_is_found(old: str) -> None:
    (fault,) = faults(f"A line.\n{old}")
    assert fault.startswith("text:2: ")


def test_right_english_and_code_are_no_faults() -> None:
    right = "It tells you. `color` beside the map. There are none. This is also where it ends. Of a total of 9, 3 fail."
    assert faults(right) == []
