"""The end of a run for machines: what epa run --json prints."""

import json
import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig
    from epa_rt.logs.recorder import LogSummary
    from epa_rt.loop.run import RunResult

SCHEMA = "epa_rt.run/1"


def end_facts(
    summary: "LogSummary", result: "RunResult", rig: "Rig", exit_code: int
) -> dict[str, Any]:
    """How a run ended, as docs/runs.md has it; times in s, ``worst_lateness_ns`` in ns."""
    end = result.end
    return {
        "schema": SCHEMA,
        "log": summary.path,
        "size_bytes": summary.size_bytes,
        "rig": rig.name,
        "outcome": result.outcome,
        "cause": result.cause,
        "stop_category": result.category,
        "exit_code": exit_code,
        "cycles": result.cycles,
        "duration_s": result.cycles * rig.period_s,
        "overruns": result.overruns,
        "worst_lateness_ns": result.worst_lateness_ns,
        "bad_cycles": result.bad_cycles,
        "samples": summary.samples,
        "events": summary.events,
        "lost_samples": result.cycles - summary.samples,
        "recorder_failure": summary.failure,
        "clamped": dict(result.clamped),
        "slewed": dict(result.slewed),
        "controller_clamped": {n: dict(loops) for n, loops in result.controller_clamped.items()},
        "controller_slewed": {n: dict(loops) for n, loops in result.controller_slewed.items()},
        "saturated": result.saturated,
        "hints": list(result.hints),
        "end": end.facts() if end else None,
    }


def json_text(facts: Any) -> str:
    """JSON proper: what is no number becomes null, what JSON has no form for its text."""
    return json.dumps(_proper(facts), indent=2, ensure_ascii=False, allow_nan=False)


def _proper(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _proper(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_proper(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return _proper(value.tolist()) if hasattr(value, "tolist") else str(value)
