"""No patterns of translated syntax in pages, comments of configurations, help, messages, docstrings and comments."""

import io
import re
import tokenize
from pathlib import Path

import pytest
from support import ROOT

PAGES = [ROOT / "README.md", *ROOT.glob("docs/*.md"), *ROOT.glob("docs/[!_]*/*.md"), *ROOT.glob("configs/*.yaml")]
SOURCES = sorted((ROOT / "sweep").rglob("*.py"))

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
    r"(?<![Tt]here )\bis no (axis|word|part|name|parameter|field|noise|number|result|text)\b": "is not a, has no",
    r"\bknows? no\b": "does not support, has no",
    r"\botherwise than\b": "differently from",
    r", which is said[.;,]": "with a note",
    r"\bAll else that\b|\bWhat is not given\b": "all other ..., missing ...",
    r"\bTell (whether|where|which|if|how|what)\b": "return, find, check",
    r"\bof (a|the) user\b(?![-'])": "user-defined, a user's",
    r"\b[Ss]o many (?!(as|that|of)\b)": "this many, the number of",
    r"(?<!lower )(?<!right )\b(center|color|behavior|neighbor|gray)(s|ed|ing)?\b": "the British spelling",
}
_NOT_PROSE = re.compile(r"^ *```.*?^ *```$|<!--.*?-->|`[^`]*`|\$\$?[^$]+\$\$?|\]\([^)]*\)", re.MULTILINE | re.DOTALL)


def prose(path: Path) -> str:
    """Return a file with spaces in place of all that is not English: of Python, strings and comments stay.

    A string of one word is a name, such as a colour's.
    """
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return text
    lines = [[" "] * len(line) for line in text.splitlines()]
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in (tokenize.STRING, tokenize.COMMENT, getattr(tokenize, "FSTRING_MIDDLE", -1)):
            (top, left), (bottom, right) = token.start, token.end
            if token.type == tokenize.STRING and " " not in token.string:
                continue
            for k in range(top - 1, bottom):
                first, last = left if k == top - 1 else 0, right if k == bottom - 1 else len(lines[k])
                lines[k][first:last] = text.splitlines()[k][first:last]
    return re.sub(r"\{[^{}]*\}|[\"#]", lambda match: " " * len(match[0]), "\n".join(map("".join, lines)))


def faults(text: str, name: str = "text") -> list[str]:
    """List the old patterns of a text with lines and better words; code, formulas and targets of links are free."""
    blank = _NOT_PROSE.sub(lambda match: re.sub(r"\S", " ", match[0]), text)
    words = [*re.finditer(r"\S+", blank)]
    flat = " ".join(word[0] for word in words)
    found = [(match, better) for old, better in BETTER.items() for match in re.finditer(old, flat)]
    places = [words[flat.count(" ", 0, match.start())].start() for match, _ in found]
    lines = [text.count("\n", 0, place) + 1 for place in places]
    return [f"{name}:{n}: {match[0]!r}: write {better}" for n, (match, better) in zip(lines, found, strict=True)]


@pytest.mark.parametrize("files", [PAGES, SOURCES], ids=["pages", "sources"])
def test_they_read_as_plain_english(files: list[Path]) -> None:
    assert not [fault for file in files for fault in faults(prose(file), str(file.relative_to(ROOT)))]


OWN = r"\b(companions?|leap(s|ed)?|lift(s|ed)|(a|the|its|each|every) rooms?|decided)\b"
"""Words of the program's authors, which have gone: second run, skip, rescale, package, certain."""


def test_pages_use_the_words_of_the_field() -> None:
    pages = [page for page in PAGES if page.suffix == ".md"]
    assert not [
        f"{page.name}: {found[0]}" for page in pages for found in re.finditer(OWN, _NOT_PROSE.sub("", prose(page)))
    ]


OLD = (
    "`spin_error` tells it|they tell what follows|spin beside its\nslow change|a model of one's own"
    "|if all are such, skip|from 2 rad/s on.|A mean is none.|Refused is a run|Of both papers|runs, also if it settled"
    "|c is no axis|EPS knows no colours|otherwise than 2.4|dropped, which is said.|All else that it has"
    "|the center of mass|Tell whether it runs|the code of a user|draw so many samples|what is no noise"
)


@pytest.mark.parametrize("old", OLD.split("|"))
def test_an_old_pattern_is_found(old: str) -> None:
    (fault,) = faults(f"A line.\n{old}")
    assert fault.startswith("text:2: ")


def test_right_english_and_code_are_no_faults() -> None:
    right = "It tells you. `color` beside the map. There are none. This is also where it ends. Of a total of 9, 3 fail."
    assert faults(right) == []


PYTHON = '''
def counted(told: int) -> str:
    """Return what `told` says."""
    beside = f"{told} tells" + "of one's own"  # all that is told
    return beside
'''


def test_strings_docstrings_and_comments_of_python_are_read_and_names_are_not(tmp_path: Path) -> None:
    (tmp_path / "names.py").write_text(PYTHON, encoding="utf-8")
    lines = [fault.split(" write")[0] for fault in faults(prose(tmp_path / "names.py"))]
    assert lines == ["text:4: 'tells':", "text:4: 'told':", 'text:4: "one\'s own":']
