"""The pages to look things up, from the code: docs/verbs.md, docs/files.md, docs/states.md.

python scripts/reference_pages.py            which pages are not what the code says (exit 1)
python scripts/reference_pages.py --write    writes them
"""

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]

OF_THE_MACHINE = ("EPA_BUS_INTERFACE", "EPA_BUS_LOCK_STEP")  # defaults that no page may have


def pages() -> dict[str, Callable[[], str]]:
    """Page under docs/: what writes it."""
    for name in OF_THE_MACHINE:
        os.environ.pop(name, None)
    import reference_files
    import reference_states
    import reference_verbs

    return {
        "verbs.md": reference_verbs.page,
        "files.md": reference_files.page,
        "states.md": reference_states.page,
    }


def main() -> int:
    asked = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    asked.add_argument("--write", action="store_true", help="write the pages")
    is_writing = asked.parse_args().write
    code = 0
    for name, page in pages().items():
        path, text = ROOT / "docs" / name, page()
        if path.exists() and path.read_text(encoding="utf-8") == text:
            continue
        if is_writing:
            path.write_text(text, encoding="utf-8")
        else:
            code = 1
        print(f"docs/{name}: {'written' if is_writing else 'not what the code says'}")
    return code


if __name__ == "__main__":
    sys.exit(main())
