"""One case diagnosed in a process of its own: ``python -m epa_rt.benchmark.worker CASE OUT
MODULE:FUNCTION``.
"""

import importlib
import json
import math
import os
import sys
import time
import traceback
from pathlib import Path


def main(case: Path, out: Path, diagnoser: str) -> None:
    """Calls the diagnoser with what case.json says and writes its answer, or the error that it
    ended with, into ``out``.
    """
    told = json.loads((case / "case.json").read_text(encoding="utf-8"))
    module, _, name = diagnoser.partition(":")
    began_s = time.perf_counter()
    try:
        function = getattr(importlib.import_module(module), name)
        said = function(
            case / told["rig"],
            case / told["plant"],
            [case / log for log in told["logs"]],
            [case / log for log in told["holdout"]],
            told["leave_out"],
        )
        answer = said if isinstance(said, dict) else said.as_json()
    except Exception as error:
        answer = {"error": f"{type(error).__name__}: {error}", "traceback": traceback.format_exc()}
    answer["wall_seconds"] = time.perf_counter() - began_s
    part = out.with_suffix(".part")
    part.write_text(json.dumps(_plain(answer)), encoding="utf-8")
    os.replace(part, out)


def _plain(value: object) -> object:
    """Plain JSON data; numbers that are none as None."""
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
