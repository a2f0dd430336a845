"""Reads a MAT file in a process of its own: scipy's reader can crash on a damaged one, which must
not take the verb along.
"""

import os
import pickle
import resource
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

_LONGEST_S = 120.0
_OWN_BYTES = 256 << 20  # for the reader itself, beside three copies of what is in the file


class MatError(Exception):
    """Why the file cannot be read, in words."""


def load_apart(path: Path, unpacked_bytes: int) -> dict[str, Any]:
    """The variables by name, structures as dicts. ``unpacked_bytes``: what the file holds once it
    is unpacked; its reader gets memory in proportion. Raises MatError.
    """
    root = str(Path(__file__).parents[3])
    paths = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))
    try:
        done = subprocess.run(
            [sys.executable, "-m", "epa_rt.logs.importers.mat_child", str(path.absolute())]
            + [str(unpacked_bytes)],
            capture_output=True,
            timeout=_LONGEST_S,
            env=os.environ | {"PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"},
        )
    except subprocess.TimeoutExpired:
        raise MatError("reading it takes over two minutes") from None
    except OSError as error:
        raise MatError(f"no process can be started to read it: {error.strerror}") from None
    if done.returncode:
        raise MatError("its reader crashes on it")
    word, content = pickle.loads(done.stdout)  # from our own child
    if word:
        raise MatError(word)
    return content


def _limit_memory(unpacked_bytes: int) -> None:
    """A file that makes the reader ask for more is damaged, and raises MemoryError."""
    with open("/proc/self/statm", encoding="ascii") as file:
        mapped = int(file.read().split()[0]) * resource.getpagesize()
    limit = mapped + _OWN_BYTES + 3 * unpacked_bytes
    resource.setrlimit(resource.RLIMIT_AS, (limit, resource.getrlimit(resource.RLIMIT_AS)[1]))


def main() -> None:
    from scipy.io import loadmat

    word, content = "", None
    _limit_memory(int(sys.argv[2]))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            content = loadmat(sys.argv[1], simplify_cells=True)
        encoded = pickle.dumps(("", content))
    except NotImplementedError:
        word = "a version that cannot be read"
    except Exception as error:  # a damaged file makes the library raise nearly anything
        word = f"{type(error).__name__}: {' '.join(str(error).split())[:120]}"
    sys.stdout.buffer.write(pickle.dumps((word, None)) if word else encoded)


if __name__ == "__main__":
    main()
