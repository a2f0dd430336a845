"""Reads a MAT file in a process of its own: scipy's reader can crash on a damaged one, which must
not take the verb along.
"""

import os
import pickle
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

_LONGEST_S = 120.0


class MatError(Exception):
    """Why the file cannot be read, in words."""


def load_apart(path: Path) -> dict[str, Any]:
    """The variables by name, structures as dicts. Raises MatError."""
    root = str(Path(__file__).parents[3])
    paths = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))
    try:
        done = subprocess.run(
            [sys.executable, "-m", "epa_rt.logs.importers.mat_child", str(path.absolute())],
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


def main() -> None:
    from scipy.io import loadmat

    word, content = "", None
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
