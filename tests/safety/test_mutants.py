"""The table of mutants that no test notices is the one of the present code, and a few mutants are
killed anew.

The full run is a command of its own: python scripts/mutate_safety.py
"""

import json
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT, PAGE = ROOT / "scripts" / "mutate_safety.py", ROOT / "docs" / "safety-mutants.md"
ROW = re.compile(r"\| `(epa_rt/\S+)` \| (\d+) \| (\d+) \| (\d+) \|")


@pytest.fixture(scope="module")
def keys() -> list[str]:
    found = subprocess.run(
        [sys.executable, str(SCRIPT), "--list"], capture_output=True, text=True, check=True
    )
    return found.stdout.splitlines()


def of_files(keys) -> Counter[str]:
    return Counter(key.partition(":")[0] for key in keys)


def explained() -> dict[str, str]:
    import yaml

    return yaml.safe_load((ROOT / "scripts/safety_mutants.yaml").read_text(encoding="utf-8"))


def test_every_file_of_safety_and_the_codec_has_mutants_with_keys_of_their_own(keys):
    assert len(set(keys)) == len(keys)
    files = {path.relative_to(ROOT).as_posix() for path in (ROOT / "epa_rt/safety").glob("*.py")}
    files -= {"epa_rt/safety/__init__.py"}
    assert set(of_files(keys)) == files | {"epa_rt/signals/codec.py"}
    assert min(of_files(keys).values()) > 15


def test_what_is_explained_is_there(keys):
    for key, reason in explained().items():
        assert key in keys, f"explained, but no longer there: {key}"
        assert len(reason) > 20


def test_the_page_is_of_the_present_code(keys):
    """Each file's mutants as many as there are, those left as many as are explained."""
    reasons, page = explained(), PAGE.read_text(encoding="utf-8")
    rows = {path: tuple(map(int, row)) for path, *row in ROW.findall(page)}
    counts, left = of_files(keys), of_files(reasons)
    for path, row in rows.items():
        expected = (counts[path], counts[path] - left[path], left[path])
        assert row == expected, f"{path}: run scripts/mutate_safety.py again"
    for key, reason in reasons.items():
        assert key.partition(":")[0] not in rows or (key in page and reason.strip() in page)
    for path in set(counts) - set(rows):
        assert f"`{path}`" in page.split("Not tried since they changed last: ")[1].split("\n")[0]


def test_a_few_mutants_are_killed_or_explained(tmp_path):
    words = ["--only", "thermal.py", "--sample", "6", "--record", str(tmp_path)]
    found = subprocess.run([sys.executable, str(SCRIPT), *words], capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr
    answer = json.loads(found.stdout)
    assert answer["unexplained"] == [] and answer["mutants"] == answer["killed"] == 6
    again = subprocess.run([sys.executable, str(SCRIPT), *words], capture_output=True, text=True)
    assert json.loads(again.stdout) | {"seconds": 0} == answer | {"seconds": 0}
    assert len((tmp_path / "mutants.jsonl").read_text().splitlines()) == 6  # none tried twice
