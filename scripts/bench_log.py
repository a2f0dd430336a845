"""Recorder throughput beside a bare `mcap` writer and the foxglove-sdk writer; prints JSON.

All three write the same messages: a knee rig's sample of 35 float64 signals and 60 raw bytes, as
five protobuf messages. Ours starts from dicts and ends with a closed file: ring, recorder process,
encoding, compression. The two others are handed messages that are encoded already, in their own
process. Each repeat runs all of them one after the other; given are medians over the repeats. CPU
time counts all processes and, unlike the rest, hardly depends on what else the machine does.
foxglove-sdk is left out where it is not installed.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from mcap.writer import Writer

from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.mcap_file import ZSTD_LEVEL, McapFile
from epa_rt.logs.recorder import Recorder
from epa_rt.logs.recording import Recording
from epa_rt.logs.ring import KIND_SAMPLE, sample_format, slot_dtype
from epa_rt.logs.rows import RowBlock
from epa_rt.logs.schema import cycle_topics, descriptor_set

PERIOD_NS = 1_000_000
PATTERN = 4096  # different samples, repeated; longer than any writer's chunk
NEEDED_SAMPLES_S = 150_000
LAYOUT = SampleLayout(
    40,
    20,
    tuple(f"place{k}_pressure_pa" for k in range(15)),
    tuple(f"ref_place{k}_rad" for k in range(8)),
    tuple(f"cmd_place{k}_nm" for k in range(8)),
    tuple(f"est_place{k}_n" for k in range(4)),
    ("running",),
    ("trial",),
)


class Load:
    """The samples: as `Recorder.sample` takes them, as ring slots, and as encoded messages by
    topic.
    """

    def __init__(self) -> None:
        random_numbers = np.random.default_rng(1)
        walk = np.cumsum(random_numbers.normal(size=(PATTERN, len(LAYOUT.values))), axis=0)
        self.values = np.round(walk, 3)  # measured values have few digits
        self.values[:, 15:23] = walk[:, 15:23]  # references and estimates have all
        self.images = [random_numbers.bytes(60) for _ in range(PATTERN)]
        self.arguments = [self._arguments(number) for number in range(PATTERN)]
        self.slots = self._slots()
        self.messages = self._messages()

    def _arguments(self, number: int) -> tuple:
        image, values = self.images[number], iter(self.values[number].tolist())
        groups = [{name: next(values) for name in names} for names in LAYOUT.groups().values()]
        return (1, 0, 0, 1500, 20_000 + number, 0, 0, image[:40], image[40:], *groups)

    def _slots(self) -> np.ndarray:
        slots = np.zeros(PATTERN, slot_dtype(LAYOUT))
        slots["kind"], slots["values"] = KIND_SAMPLE, self.values
        slots["cycle"] = np.arange(PATTERN)
        slots["t_ns"] = slots["cycle"] * np.uint64(PERIOD_NS)
        image = np.frombuffer(b"".join(self.images), np.uint8).reshape(PATTERN, 60)
        slots["inputs_raw"], slots["outputs_raw"] = image[:, :40], image[:, 40:]
        slots["busy_ns"] = 20_000 + np.arange(PATTERN)
        return slots

    def _messages(self) -> dict[str, list[bytes]]:
        block = RowBlock(LAYOUT, PATTERN)
        block.take(self.slots)
        block.messages()
        return {
            topic.name: [one.tobytes() for one in block.rows[topic.name]["body"]]
            for topic in cycle_topics(LAYOUT)
        }


def ours(load: Load, path: Path, samples: int) -> None:
    """Dicts to closed file, through the ring and the recorder process."""
    recorder = Recorder(path, LAYOUT, {}, {}, lossless=True)
    recorder.open()
    sample, arguments = recorder.sample, load.arguments
    for cycle in range(samples):
        sample(cycle, cycle * PERIOD_NS, *arguments[cycle % PATTERN])
    if recorder.close("finished", "").samples != samples:
        raise SystemExit("bench_log: samples were lost")


def ours_one_core(load: Load, path: Path, samples: int) -> None:
    """What the recorder process does, alone: ring slots to closed file."""
    file = McapFile(str(path), sync=False)
    recording = Recording(file, LAYOUT)
    Recording.begin(file, LAYOUT, {}, {})
    slots = load.slots.copy()
    for _ in range(samples // PATTERN):
        recording.feed(slots)
        slots["cycle"] += PATTERN
        slots["t_ns"] += np.uint64(PATTERN * PERIOD_NS)
    recording.finish()
    file.close()


def bare_mcap(load: Load, path: Path, samples: int) -> None:
    """The `mcap` package's writer with its defaults."""
    writer = Writer(str(path))
    writer.start()
    channels = []
    for topic in cycle_topics(LAYOUT):
        schema_id = writer.register_schema(topic.message_name, "protobuf", descriptor_set(topic))
        channels.append(
            (writer.register_channel(topic.name, "protobuf", schema_id), load.messages[topic.name])
        )
    for cycle in range(samples):
        t_ns = cycle * PERIOD_NS
        for channel_id, messages in channels:
            writer.add_message(channel_id, t_ns, messages[cycle % PATTERN], t_ns, cycle)
    writer.finish()


def foxglove_sdk(load: Load, path: Path, samples: int) -> None:
    """The foxglove-sdk writer: Rust below, compressing on this thread and at our level."""
    import foxglove
    from foxglove.mcap import MCAPWriteOptions

    context = foxglove.Context()
    options = MCAPWriteOptions(compression_level=ZSTD_LEVEL, compression_threads=0)
    channels = []
    with foxglove.open_mcap(path, allow_overwrite=True, context=context, writer_options=options):
        for topic in cycle_topics(LAYOUT):
            schema = foxglove.Schema(
                name=topic.message_name, encoding="protobuf", data=descriptor_set(topic)
            )
            channel = foxglove.Channel(
                topic.name, schema=schema, message_encoding="protobuf", context=context
            )
            channels.append((channel, load.messages[topic.name]))
        for cycle in range(samples):
            for channel, messages in channels:
                channel.log(messages[cycle % PATTERN], log_time=cycle * PERIOD_NS)


def producer_cost_us(load: Load, path: Path, samples: int) -> dict[str, float]:
    """What one `sample` and one look at `failure` cost the loop, timer included, while the recorder
    is at work.
    """
    recorder = Recorder(path, LAYOUT, {}, {}, lossless=False, slots=65536)
    recorder.open()
    costs_ns = np.zeros(min(samples, 60_000), np.int64)
    clock = time.perf_counter_ns
    for cycle in range(len(costs_ns)):
        arguments = load.arguments[cycle % PATTERN]
        begin_ns = clock()
        recorder.sample(cycle, cycle * PERIOD_NS, *arguments)
        failure = recorder.failure
        costs_ns[cycle] = clock() - begin_ns
        if failure:
            raise SystemExit(f"bench_log: {failure}")
    recorder.close("finished", "")
    quantiles = np.quantile(costs_ns, [0.5, 0.999, 1.0]) / 1000
    return {
        name: round(float(value), 2)
        for name, value in zip(("median", "p999", "max"), quantiles, strict=True)
    }


def cpu_s() -> float:
    """CPU seconds of this process and of those that it has started and seen end."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def writers() -> dict[str, Callable[[Load, Path, int], None]]:
    found = {"ours": ours, "ours_one_core": ours_one_core, "mcap": bare_mcap}
    try:
        import foxglove  # noqa: F401

        found["foxglove_sdk"] = foxglove_sdk
    except ImportError:
        pass
    return found


def measure(load: Load, folder: Path, samples: int, repeats: int) -> dict[str, object]:
    times_s: dict[str, list[float]] = {}
    cpu_times_s: dict[str, list[float]] = {}
    sizes: dict[str, int] = {}
    costs: list[dict[str, float]] = []
    for _ in range(repeats):
        for name, write in writers().items():
            path = folder / f"{name}.mcap"
            path.unlink(missing_ok=True)  # of the repeat before: no log is written over
            begin_s, begin_cpu_s = time.perf_counter(), cpu_s()
            write(load, path, samples)
            times_s.setdefault(name, []).append(time.perf_counter() - begin_s)
            cpu_times_s.setdefault(name, []).append(cpu_s() - begin_cpu_s)
            sizes[name] = path.stat().st_size
        costs.append(producer_cost_us(load, folder / f"producer_{len(costs)}.mcap", samples))
    medians_s = {name: statistics.median(values) for name, values in times_s.items()}
    message_bytes = sum(len(messages[0]) for messages in load.messages.values())
    result: dict[str, object] = {
        name: {
            "samples_per_s": round(samples / seconds),
            "payload_mb_per_s": round(samples * message_bytes / seconds / 1e6, 1),
            "cpu_us_per_sample": round(statistics.median(cpu_times_s[name]) / samples * 1e6, 2),
            "file_bytes_per_sample": round(sizes[name] / samples, 1),
        }
        for name, seconds in medians_s.items()
    }
    result["times_faster"] = {
        f"ours_than_{name}": round(medians_s[name] / medians_s["ours"], 2)
        for name in medians_s
        if not name.startswith("ours")
    }
    result["producer_us"] = {
        key: statistics.median(cost[key] for cost in costs) for key in costs[0]
    }
    alone_samples_per_cpu_s = round(1e6 / result["ours_one_core"]["cpu_us_per_sample"])
    result["recorder_alone"] = {
        "samples_per_cpu_s": alone_samples_per_cpu_s,
        "fast_enough": alone_samples_per_cpu_s >= NEEDED_SAMPLES_S,
    }
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--samples", type=int, default=100 * PATTERN, help="samples per run (default %(default)s)"
    )
    parser.add_argument(
        "--repeats", type=int, default=3, help="repeats to take medians over (default %(default)s)"
    )
    arguments = parser.parse_args()
    samples = max(arguments.samples // PATTERN, 1) * PATTERN
    with tempfile.TemporaryDirectory() as folder:
        result = measure(Load(), Path(folder), samples, arguments.repeats)
    setting = {
        "samples": samples,
        "repeats": arguments.repeats,
        "signals": len(LAYOUT.values),
        "cores": os.cpu_count(),
    }
    print(
        json.dumps(
            {"setting": setting | {"slot_format": sample_format(LAYOUT)}, **result}, indent=2
        )
    )


if __name__ == "__main__":
    main()
