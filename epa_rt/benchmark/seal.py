"""The truth of the cases, sealed: written elsewhere, encrypted, with its hash beside the logs.

The key lies beside the sealed text. A process that diagnoses sees an empty folder in its place (a
mount namespace of its own) where the machine allows that, and empty files in the place of what
tells the truth otherwise (kept.py); the parent reads the key after the last diagnosis (matrix:
before, to see whether it is the set that was asked for).
"""

import hashlib
import hmac
import json
import os
import secrets
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

TRUTH, KEY, HASH = "truth.sealed", "truth.key", "truth.sha256"
NOT_HIDDEN = "the truth lay under file mode only: no mount namespace can be made here"


class SealError(Exception):
    """The sealed truth is missing, or is not what was sealed."""


def seal(truth: dict, folder: Path, cases: Path) -> str:
    """Writes the sealed truth into ``folder`` and its hash into ``cases``; returns the hash.

    The text holds a random salt, so that nobody can find it by trying truths until the hash fits.
    """
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"salt": secrets.token_hex(32), **truth}, indent=1).encode()
    key, nonce = secrets.token_bytes(32), secrets.token_bytes(16)
    hidden = _xor(text, key, nonce)
    (folder / TRUTH).write_bytes(nonce + hmac.digest(key, nonce + hidden, "sha256") + hidden)
    (folder / KEY).write_bytes(key)
    for name in (TRUTH, KEY):
        os.chmod(folder / name, 0o600)
    os.chmod(folder, 0o700)
    found = hashlib.sha256(text).hexdigest()
    (cases / HASH).write_text(f"{found}\n", encoding="utf-8")
    return found


def opened(folder: Path, cases: Path) -> dict:
    """The truth. Raises SealError where it is missing or where key, text or hash do not fit."""
    try:
        sealed, key = (folder / TRUTH).read_bytes(), (folder / KEY).read_bytes()
        told = (cases / HASH).read_text(encoding="utf-8").strip()
    except OSError as error:
        raise SealError(
            f"{error.filename}: cannot be read ({error.strerror}), expected the sealed truth of"
            f" {cases}"
        ) from None
    nonce, tag, hidden = sealed[:16], sealed[16:48], sealed[48:]
    if not hmac.compare_digest(tag, hmac.digest(key, nonce + hidden, "sha256")):
        raise SealError(
            f"{folder / TRUTH}: found a text that this key did not seal, expected the truth of"
            f" {cases}"
        )
    text = _xor(hidden, key, nonce)
    if hashlib.sha256(text).hexdigest() != told:
        raise SealError(
            f"{folder / TRUTH}: found a truth with another hash than {cases / HASH}, expected the"
            " one sealed with these logs"
        )
    return json.loads(text)


def _xor(text: bytes, key: bytes, nonce: bytes) -> bytes:
    stream = hashlib.shake_256(key + nonce).digest(len(text))
    return (int.from_bytes(text, "big") ^ int.from_bytes(stream, "big")).to_bytes(len(text), "big")


def can_hide() -> bool:
    """Whether a process can be given a mount namespace of its own here, with an empty folder and an
    empty file in it.
    """
    if shutil.which("unshare") is None:
        return False
    found = subprocess.run(
        [
            "unshare",
            "-rm",
            "sh",
            "-c",
            "mount -t tmpfs tmpfs /tmp && : > /tmp/file && mount --bind /dev/null /tmp/file",
        ],
        capture_output=True,
    )
    return found.returncode == 0


def hidden_command(places: Sequence[Path], command: list[str]) -> list[str]:
    """The command, run where every folder and file of ``places`` (absolute) is empty. It sees
    everything else; a place that is gone by then is passed over.
    """
    script = (
        'while [ "$1" != -- ]; do if [ -d "$1" ]; then mount -t tmpfs tmpfs "$1"; elif [ -e "$1" ];'
        ' then mount --bind /dev/null "$1"; fi || exit 1; shift; done; shift; exec "$@"'
    )
    return ["unshare", "-rm", "sh", "-c", script, "sh", *map(os.fspath, places), "--", *command]


def python_command(module: str, *arguments: str) -> list[str]:
    """The command that runs a module with arguments by this very interpreter."""
    return [sys.executable, "-m", module, *arguments]
