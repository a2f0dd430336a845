"""epa --version: the package, and the state of the checkout that it runs from."""

import argparse
import subprocess
from pathlib import Path
from typing import Any

_ROOT = Path(__file__).resolve().parents[2]


def version_text() -> str:
    """'epa 0.1.0 (git 8f4e7fd, 2 files changed), Python 3.11.2'; no git where there is none."""
    import platform
    from importlib.metadata import PackageNotFoundError, version

    try:
        package = version("epa-rt")
    except PackageNotFoundError:
        package = "not installed"
    git = git_state()
    return f"epa {package}{f' ({git})' if git else ''}, Python {platform.python_version()}"


def git_state() -> str:
    """'git 8f4e7fd' of the checkout around this package, with how many tracked files differ; ''
    where it is installed, or git cannot tell.
    """
    if not (_ROOT / ".git").exists():
        return ""
    commit = _git("rev-parse", "--short", "HEAD")
    if not commit:
        return ""
    changed = len(_git("status", "--porcelain", "--untracked-files=no").splitlines())
    words = f", {changed} file{'s' * (changed != 1)} changed" if changed else ""
    return f"git {commit}{words}"


class ShowVersion(argparse.Action):
    """Prints the version and ends; asks git only then."""

    def __init__(self, option_strings: list[str], dest: str, **options: Any) -> None:
        super().__init__(option_strings, argparse.SUPPRESS, nargs=0, **options)

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        print(version_text())
        parser.exit(0)


def _git(*words: str) -> str:
    try:
        found = subprocess.run(
            ["git", "-C", str(_ROOT), *words], capture_output=True, text=True, timeout=10
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return found.stdout.strip() if found.returncode == 0 else ""
