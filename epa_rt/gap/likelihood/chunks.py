"""What is left out together of a recording: a trial, or a stretch of time where it has none."""

from epa_rt.gap.recording import Recording

CHUNK_S = 8.0  # of a stretch where a log has no trials


def chunks_of(recording: Recording, blocks: int, block_s: float) -> list[str]:
    """Name of the trial (or stretch of time) that each block lies in."""
    trials = [span for span in recording.spans if span.trial]
    found = []
    for block in range(blocks):
        middle = (block + 0.5) * block_s / recording.period_s
        inside = (
            next((i for i, span in enumerate(trials) if span.start <= middle < span.stop), None)
            if len(trials) > 1
            else None
        )
        found.append(
            f"trial {inside}" if inside is not None else f"{int(block * block_s / CHUNK_S)}"
        )
    return found
