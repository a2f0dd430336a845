"""A disk that takes no more: the loop hears of it, and the file can be read."""

import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from log_samples import LAYOUT, sample_of

from epa_rt.logs.reader import LogReader
from epa_rt.logs.recorder import Recorder, RecorderError

FILL = """
import sys
sys.path.insert(0, sys.argv[1])
from log_samples import LAYOUT, sample_of
from epa_rt.logs.recorder import Recorder
recorder = Recorder(sys.argv[2] + "/log.mcap", LAYOUT, {}, {}, lossless=True, slots=1024)
recorder.open()
cycle = 0
while recorder.failure is None and cycle < 30_000:
    recorder.sample(**sample_of(cycle))
    cycle += 1
recorder.event(cycle, cycle * 1_000_000, "trip", "recorder")
summary = recorder.close("tripped", "recorder")
assert summary.samples + summary.lost_samples == cycle
import shutil
shutil.copy(sys.argv[2] + "/log.mcap", sys.argv[3])
print(f"{summary.failure} | {summary.samples} | {summary.lost_samples}")
"""


def check_full_log(path: Path, said: str) -> None:
    """Whole chunks, and an end that says as many samples lost as the screen does; nothing else.

    `said`: failure, samples and lost samples of the summary, as the loop's process has them.
    """
    failure, samples, lost = said.rsplit(" | ", 2)
    with LogReader(path) as log:
        cycles = log.columns("/cycle", ["cycle"])["cycle"]
        assert len(cycles) and len(cycles) % 2000 == 0
        assert cycles.tolist() == list(range(len(cycles)))
        assert (len(cycles), log.ending.lost_samples) == (int(samples), int(lost))
        assert (log.outcome, log.ending.cause) == ("tripped", "recorder")
        assert log.missing == [f"{lost} samples and 0 events were lost while recording: {failure}"]
        assert log.missing_at_a_glance == log.missing
        assert [event.kind for event in log.events()] == ["trip", "end"]


def test_a_file_that_may_not_grow_fails_the_recording(tmp_path):
    recorder = Recorder(tmp_path / "log.mcap", LAYOUT, {}, {}, lossless=True, slots=1024)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2_000_000, hard))
    try:
        recorder.open()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    cycle = 0
    while recorder.failure is None and cycle < 30_000:
        recorder.sample(**sample_of(cycle))
        cycle += 1
    assert recorder.failure.startswith("file too large while writing ")
    recorder.event(cycle, cycle * 1_000_000, "trip", "recorder")
    summary = recorder.close("tripped", "recorder")
    assert summary.failure == recorder.failure
    assert summary.samples + summary.lost_samples == cycle
    said = f"{summary.failure} | {summary.samples} | {summary.lost_samples}"
    check_full_log(tmp_path / "log.mcap", said)


def test_a_full_disk_fails_the_recording(tmp_path):
    unshare = shutil.which("unshare")
    mount = tmp_path / "disk"
    mount.mkdir()
    copy = tmp_path / "copy.mcap"
    shell = 'mount -t tmpfs -o size=2m tmpfs "$1" || exit 77; exec "$2" -c "$3" "$4" "$1" "$5"'
    arguments = [str(mount), sys.executable, FILL, str(Path(__file__).parent), str(copy)]
    if unshare is None:
        pytest.skip("no unshare command to mount a small disk with")
    done = subprocess.run(
        [unshare, "-rm", "sh", "-c", shell, "sh", *arguments], capture_output=True, text=True
    )
    if done.returncode == 77 or "unshare" in done.stderr:
        pytest.skip(f"this system lets no ordinary user mount a small disk: {done.stderr.strip()}")
    assert done.stdout.startswith("no space left on device while writing "), done.stderr
    check_full_log(copy, done.stdout.strip())


def test_a_disk_that_is_full_from_the_start_is_said():
    with pytest.raises(RecorderError, match="cannot write /dev/full: no space left on device"):
        Recorder("/dev/full", LAYOUT, {}, {}, True).open()
