"""Where the figures come from: files, code, seed, and what the log lacks."""

import hashlib
import json

from epa_rt.report.markup import Html, facts, folded, join, note, paragraph, table, tag, warning
from epa_rt.report.run import NotShown, Run
from epa_rt.report.sections.section import Section

SHOWN_BYTES = 100_000


def provenance(run: Run) -> Section:
    """Never raises: a log that lacks something says so here."""
    version = _version(run)
    told = run.facts
    pairs = [
        ("Log", f"{run.name} ({run.size_bytes / 1e6:.1f} MB)"),
        ("Package", version.get("package", "not recorded")),
        ("Digest of the sources", tag("code", version.get("sources_sha256", "not recorded"))),
        ("Simulation seed", told.get("seed", "–")),
        ("Experiment seed", _experiment_seed(run)),
    ]
    rows = [
        (name, f"{len(data):,}", tag("code", hashlib.sha256(data).hexdigest()))
        for name, data in run.attachments.items()
    ]
    files = [
        folded(name, tag("pre", data.decode("utf-8", "replace")))
        for name, data in run.attachments.items()
        if name.endswith((".yaml", ".json"))
        and name != "experiment.yaml"
        and len(data) <= SHOWN_BYTES
    ]
    attached = table(("Attached to the log", "Bytes", "SHA-256"), rows, (0, 2))
    return Section(
        "provenance", "Provenance", join([facts(pairs), attached, *files, _missing(run)])
    )


def _version(run: Run) -> dict[str, str]:
    try:
        found = json.loads(run.text("version.json"))
        return (
            {str(key): str(value) for key, value in found.items()}
            if isinstance(found, dict)
            else {}
        )
    except (NotShown, ValueError):
        return {}


def _experiment_seed(run: Run) -> str:
    try:
        return str(run.experiment.seed)
    except NotShown:
        return "–"


def _missing(run: Run) -> Html:
    if not run.missing:
        return note("The log is whole: every checksum was compared, and the recorder lost nothing.")
    return join(
        [paragraph("The log is not whole:"), *(warning(sentence) for sentence in run.missing)]
    )
