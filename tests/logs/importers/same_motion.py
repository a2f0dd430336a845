"""One motion of a knee written in every format that a robot lab keeps, and the mappings for it."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

ROWS = 200
STAMP_NS = 1_790_000_000_123_456_789 + np.arange(ROWS) * 2_000_000
T_S = np.arange(ROWS) * 0.002
POSITION = 0.3 * np.sin(2 * np.pi * 2 * T_S)
SPEED = 0.3 * 4 * np.pi * np.cos(2 * np.pi * 2 * T_S)
TORQUE = 2.0 * POSITION + 0.1 * SPEED
PRESSURE = 3e5 + 1e4 * POSITION
COLUMNS = {"stamp": STAMP_NS, "q": POSITION, "v": SPEED, "tau": TORQUE, "p": PRESSURE}

_MAPPING = """mapping: knee
rig: knee
format: {kind: %s}
clock: {column: %s, unit: ns, period: 2 ms}
measured:
  knee_position_rad: {column: '%s', unit: rad}
  knee_speed_rad_s: {column: '%s', unit: rad/s}
  knee_torque_nm: {column: '%s', unit: Nm}
  chamber_pressure_pa: {column: '%s', unit: Pa abs}
"""
BAG = _MAPPING % (
    "rosbag",
    "header.stamp",
    "/joint_states.position[knee]",
    "/joint_states.velocity[knee]",
    "/joint_states.effort[knee]",
    "/pressure.fluid_pressure",
)


def mapping_of(kind: str) -> str:
    """The mapping of a table with the names of COLUMNS."""
    return _MAPPING % (kind, "stamp", "q", "v", "tau", "p")


def write_bag(
    folder: Path,
    kind: str,
    late_ns: Sequence[int] = (300_000, 301_000, 307_000),
    packed: bool = False,
) -> Path:
    """A ROS 2 bag, 'mcap' or 'db3', whose joints change places from one message to the next."""
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    state, header, stamp, air = (
        store.types[name]
        for name in (
            "sensor_msgs/msg/JointState",
            "std_msgs/msg/Header",
            "builtin_interfaces/msg/Time",
            "sensor_msgs/msg/FluidPressure",
        )
    )
    plugin = {"mcap": StoragePlugin.MCAP, "db3": StoragePlugin.SQLITE3}[kind]
    writer = Writer(folder, version=9, storage_plugin=plugin)
    if packed:
        writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    with writer:
        joints = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
        pressure = writer.add_connection("/pressure", air.__msgtype__, typestore=store)
        for k in range(ROWS):
            at_ns = int(STAMP_NS[k])
            head = header(stamp(at_ns // 10**9, at_ns % 10**9), "")
            names = ["knee", "hip"][:: 1 if k % 2 else -1]
            lists = [
                np.array([value[k] if name == "knee" else -1.0 for name in names])
                for value in (POSITION, SPEED, TORQUE)
            ]
            received = at_ns + int(late_ns[k % len(late_ns)])
            message = state(head, names, *lists)
            writer.write(joints, received, store.serialize_cdr(message, message.__msgtype__))
            message = air(head, float(PRESSURE[k]), 0.0)
            writer.write(pressure, received, store.serialize_cdr(message, message.__msgtype__))
    return folder


def write_parquet(path: Path, **changes: np.ndarray) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = COLUMNS | changes
    columns = {
        n: pa.array(v, pa.timestamp("ns")) if n == "stamp" else v for n, v in columns.items()
    }
    pq.write_table(pa.table(columns), path)
    return path


def write_npz(path: Path, **changes: np.ndarray) -> Path:
    np.savez(path, **(COLUMNS | changes))
    return path


def write_jsonl(path: Path) -> Path:
    rows = zip(*(values.tolist() for values in COLUMNS.values()), strict=True)
    lines = [json.dumps(dict(zip(COLUMNS, row, strict=True))) for row in rows]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_all(folder: Path) -> dict[str, tuple[str, Path]]:
    """Every format: its mapping, and the recording."""
    return {
        "mcap": (BAG, write_bag(folder / "bag_mcap", "mcap")),
        "db3": (BAG, write_bag(folder / "bag_db3", "db3")),
        "packed": (BAG, write_bag(folder / "bag_packed", "db3", packed=True)),
        "parquet": (mapping_of("parquet"), write_parquet(folder / "m.parquet")),
        "npz": (mapping_of("npz"), write_npz(folder / "m.npz")),
        "jsonl": (mapping_of("jsonl"), write_jsonl(folder / "m.jsonl")),
    }
