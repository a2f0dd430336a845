"""Pages of README.md and docs/: links resolve, commands parse and name files that are there,
sentences and cells stay short, every page stands in the index.
"""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from epa_rt.cli.main import parser
from scripts import prose

ROOT = Path(__file__).parents[1]
PAGES = prose.pages()
HELD = [page for page in PAGES if page.name not in prose.WITH_THE_DIAGNOSIS]
PRIVATE = re.compile(r"(?<![\w.])/(?:work|root|home|Users|mnt)/")
BY_READER = ("epa_rt/config/terminals/el3104.py",)  # the file that terminals.md has one write
# what a command writes, and what one after it may therefore read
WRITES = (*("-o", "--out", "--json", "--html", "--write", "--store"), *("--pictures", "--control"))


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def prose_of(page: Path) -> str:
    """Its text without code, whose brackets are no links."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    return re.sub(r"`[^`\n]*`", "", re.sub(r"^    .*$", "", text, flags=re.M))


def anchors(page: Path) -> set[str]:
    """What GitHub calls its headings."""
    found: list[str] = []
    for title in re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.M):
        slug = re.sub(r"[^\w\- ]", "", prose.shown(title).lower()).replace(" ", "-")
        found.append(f"{slug}-{found.count(slug)}" if slug in found else slug)
    return set(found)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_resolve(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", prose_of(page)):
        if target.startswith(("http://", "https://")):
            continue
        path, _, anchor = target.partition("#")
        there = (page.parent / path) if path else page
        assert there.exists(), f"found no {target}"
        if anchor:
            assert anchor in anchors(there), f"found no heading for {target}"


@pytest.mark.parametrize("page", HELD, ids=name_of)
def test_sentences_and_cells_are_short(page):
    found = prose.page(page)
    assert found.median <= prose.MEDIAN_WORDS
    assert found.too_long == []


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_no_path_is_private(page):
    assert PRIVATE.findall(page.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_code_that_is_named_is_there(page):
    named = re.findall(
        r"(?<![\w/.])(?:scripts|tests|epa_rt|sim_backend|drivers)/[\w/-]+\.(?:py|sh|yaml)\b",
        page.read_text(encoding="utf-8"),
    )
    assert [path for path in named if not (ROOT / path).exists() and path not in BY_READER] == []


def test_every_page_stands_in_the_index():
    index = ROOT / "docs/README.md"
    linked = {
        (index.parent / target.partition("#")[0]).resolve()
        for target in re.findall(r"\]\(([^)\s]+)\)", prose_of(index))
    }
    pages = [p for p in PAGES if p.parent.name != "decisions" and p.parent != ROOT and p != index]
    assert [name_of(p) for p in pages if p.resolve() not in linked] == []


def test_what_is_left_for_the_diagnosis_is_there():
    assert set(prose.WITH_THE_DIAGNOSIS) <= {page.name for page in PAGES}


def commands(page: Path) -> Iterator[list[str]]:
    """Words of every `epa` command in the page's blocks of code, in order, without the program."""
    fenced, kept = False, []
    for line in page.read_text(encoding="utf-8").splitlines():
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif fenced or line.startswith("    "):
            kept.append(line.strip())
    for line in re.sub(r" *\\\n *", " ", "\n".join(kept)).splitlines():
        if re.match(r"epa |cd |eval |timeout ", line) and "[-h]" not in line:  # no summary
            yield from split(line)


def split(line: str) -> Iterator[list[str]]:
    """The commands of one line: behind `&&`, inside `$(...)`, behind the ` -- ` of epa bus run."""
    inner = re.search(r"\$\((.*?)\)", line)
    words = shlex.split(inner.group(1) if inner else line, comments=True)
    while words:
        ends = [k for k, word in enumerate(words) if word in ("&&", "|", ";", "--")]
        one, words = (words[: ends[0]], words[ends[0] + 1 :]) if ends else (words, [])
        if one and one[0] == "timeout":  # the shell's, before a verb that it ends
            one = one[one.index("epa") :]
        if one and one[0] == "epa":
            yield one[1:]


@pytest.mark.parametrize("page", [page for page in PAGES if any(commands(page))], ids=name_of)
def test_commands_parse_and_name_files_that_are_there(page, capsys):
    text = page.read_text(encoding="utf-8")
    made = re.findall(r"`([\w.-]+)`", text)  # files of the reader, by the name that the page gives
    for script in re.findall(r"scripts/\w+\.sh", text):
        made += re.findall(r"out/\w+", (ROOT / script).read_text(encoding="utf-8"))
    for words in commands(page):
        try:
            parser().parse_args(words)
        except SystemExit as end:
            said = capsys.readouterr().err.strip()
            assert end.code == 0, f"epa {shlex.join(words)}: {said}"
        assert capsys.readouterr().err == "", f"epa {shlex.join(words)}: an old name"
        made += [words[k + 1] for k, word in enumerate(words[:-1]) if word in WRITES]
        for word in words:
            # examples of the verbs are run, one after the other, by tests/cli/test_examples.py
            assert page.name == "verbs.md" or there(word, made), (
                f"found no {word} of: epa {shlex.join(words)}"
            )


def there(word: str, made: list[str]) -> bool:
    """Whether a word is no file, one of the repository, or one that the page makes before."""
    if word.split(".")[0].isupper():  # a name that the reader puts in
        return True
    if not re.search(r"\w\.(yaml|mcap|csv|json|html|txt|npz|parquet|db3|jsonl)$", word):
        return True
    if any(ROOT.glob(word)):
        return True
    return any(word == one or word.startswith(one.rstrip("/") + "/") for one in made)
