"""A diagnosis as JSON text: the fields of ``Diagnosis``, nothing else; what is no number is
null.
"""

import json
import math
from typing import Any

from epa_rt.gap.diagnosis import Diagnosis


def json_text(diagnosis: Diagnosis) -> str:
    """The text, indented. Raises TypeError where a field holds what JSON has no type for."""
    return (
        json.dumps(finite(diagnosis.as_json()), indent=2, ensure_ascii=False, allow_nan=False)
        + "\n"
    )


def finite(value: Any) -> Any:
    """Plain JSON data: NaN and infinity as None, numpy numbers as Python's, tuples as lists."""
    if isinstance(value, dict):
        return {str(key): finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [finite(inner) for inner in value]
    if hasattr(value, "tolist"):
        return finite(value.tolist())
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


def schema() -> dict:
    """JSON schema of a diagnosis, drawn from the types."""
    from pydantic import TypeAdapter

    return TypeAdapter(Diagnosis).json_schema(mode="serialization")
