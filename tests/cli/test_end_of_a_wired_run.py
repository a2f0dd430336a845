"""The count where a wired drive's run ended is kept only where the run knew that it was right."""

import errno
from dataclasses import replace

import pytest

from epa_rt.cli.exits import FAILED, VerbError
from epa_rt.cli.zero import blind_words, keep_end, load_rig_source, need_known_count, raw_count
from epa_rt.config.zero_file import ZeroFile, read_zero, write_zero, zero_path
from epa_rt.logs.recorder import LogSummary
from epa_rt.loop.referenced import Referenced, position_scaling
from epa_rt.signals.image import image_of
from tests.loop.rigging import ROOT, Quiet, run_in_memory, tiny_inputs

SUMMARY = LogSummary("x", "", "", 0, 0, 0, 0, 0, None)  # of a run that was not recorded
LOST_COUNTS, AT_CYCLE = 20000, 4000
ELSEWHERE = 40000  # counts, 32 mm from where the simulated motor stands


def wired_rig(folder, end):
    """The wired bench whose last run ended at a count, and its file."""
    path = folder / "bench_analog.yaml"
    text = (ROOT / "config/rigs/bench_analog.yaml").read_text()
    path.write_text(text.replace("../plants", str(ROOT / "config/plants")))
    zero = ZeroFile(
        rig="bench_analog", method="here", at="0 mm", when="2026-01-31T12:00:00Z", end=end
    )
    write_zero(zero_path(path), zero)
    rig = load_rig_source(path, True)[1]
    return rig, path


def ended(folder, end, hurt=None, requests=None):
    """A run whose last one ended at a count; the count that its own end leaves, and the one read
    last.
    """
    rig, path = wired_rig(folder, end)
    inputs = replace(tiny_inputs(folder, "bench_analog"), rig=rig)
    made = run_in_memory(inputs, hurt, requests)
    decoder = made.assembly.decoder
    keep_end(rig, path, decoder, SUMMARY, made.result, made.assembly.supervisor.found_zero)
    return made.result, read_zero(zero_path(path), "bench_analog").end, raw_count(rig, decoder)


def _jumped(exchange, at):
    raw = bytearray(exchange.inputs_raw)
    count = int.from_bytes(raw[at : at + 4], "little", signed=True) + LOST_COUNTS
    raw[at : at + 4] = count.to_bytes(4, "little", signed=True)
    return exchange._replace(inputs_raw=bytes(raw))


def test_a_sound_run_keeps_where_it_ended(tmp_path):
    result, end, last = ended(tmp_path, 0)
    assert result.outcome == "completed" and end == last != 0


def test_an_end_that_cannot_be_written_is_said_after_how_the_run_ended(
    tmp_path, capsys, monkeypatch
):
    def full(_path, _zero):
        raise OSError(errno.ENOSPC, "No space left on device")

    rig, path = wired_rig(tmp_path, 0)
    made = run_in_memory(replace(tiny_inputs(tmp_path, "bench_analog"), rig=rig))
    monkeypatch.setattr("epa_rt.config.zero_file.write_zero", full)
    found_zero = made.assembly.supervisor.found_zero
    with pytest.raises(VerbError, match="zero.* cannot be written") as refused:
        keep_end(rig, path, made.assembly.decoder, SUMMARY, made.result, found_zero)
    assert refused.value.code == FAILED
    assert capsys.readouterr().out.startswith("completed")


def test_a_run_that_never_looked_leaves_the_last_end(tmp_path):
    """Else one Ctrl-C in bring-up would make a lost count look right in the next run."""
    result, end, _ = ended(tmp_path, ELSEWHERE, requests=Quiet(20))
    assert result.outcome == "stopped" and end == ELSEWHERE


def test_a_run_that_found_no_zero_keeps_no_end(tmp_path):
    result, end, _ = ended(tmp_path, ELSEWHERE)
    assert result.trip.cause == "unreferenced" and end is None


@pytest.mark.parametrize("requests", [None, Quiet(AT_CYCLE + 1)])
def test_a_run_that_lost_its_count_keeps_no_end(tmp_path, requests):
    """An encoder's terminal that starts anew: what it counts from then on is no travel."""
    rig = load_rig_source(ROOT / "config/rigs/bench_analog.yaml", False)[1]
    at = image_of(rig, outputs=False).places["drive.position"].byte

    def hurt(exchange, _model):
        return _jumped(exchange, at) if exchange.cycle >= AT_CYCLE else exchange

    result, end, _ = ended(tmp_path, 0, hurt, requests)
    assert result.trip.cause == "position jump" and end is None


@pytest.mark.parametrize("lost_after", [5, 1 << 60])
def test_a_count_lost_after_another_trip_keeps_no_end_either(tmp_path, lost_after):
    """The first trip is the load cell's; the count is lost while the motor comes to rest."""
    rig = load_rig_source(ROOT / "config/rigs/bench_analog.yaml", False)[1]
    places = image_of(rig, outputs=False).places
    force, at = places[rig.row("muscle_force_n").entry].byte, places["drive.position"].byte

    def hurt(exchange, model):
        if exchange.cycle < AT_CYCLE:
            return exchange
        raw = bytearray(exchange.inputs_raw)
        raw[force : force + 2] = (0x7FFF).to_bytes(2, "little")
        broken = exchange._replace(inputs_raw=bytes(raw))
        return _jumped(broken, at) if exchange.cycle >= AT_CYCLE + lost_after else broken

    result, end, last = ended(tmp_path, 0, hurt)
    assert result.trip.signal == "muscle_force_n" and result.position_lost is (lost_after == 5)
    assert end == (None if lost_after == 5 else last)


@pytest.mark.parametrize(("end", "is_blind"), [(-11, True), (0, True), (ELSEWHERE, False)])
def test_an_end_at_which_a_drive_begins_to_count_needs_the_operators_word(tmp_path, end, is_blind):
    """There a drive whose supply was off is taken for one that never lost its count."""
    rig, path = wired_rig(tmp_path, end)
    begins = {rig.motor.position: position_scaling(rig).to_si(0)}
    assert (Referenced(rig).refusal(begins) is None) == is_blind == bool(blind_words(rig))
    need_known_count(rig, path, stayed_on=True)
    if is_blind:
        with pytest.raises(VerbError, match="near 0.*epa home --rig .*--supply-stayed-on"):
            need_known_count(rig, path, stayed_on=False)
    else:
        need_known_count(rig, path, stayed_on=False)
