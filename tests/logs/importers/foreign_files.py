"""Small foreign recordings and the mapping files that fit them."""

import io
import json
from pathlib import Path

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.writer import Writer
from scipy.io import savemat

ROWS = 200
T = np.arange(ROWS) * 0.01
POSITION = 0.1 * np.sin(2 * np.pi * T)
FORCE = 5.0 * np.cos(2 * np.pi * T)

SIGNALS = """
measured:
  cart_position_m: {column: pos%(dot)s, unit: mm%(extra)s}
  cart_force_n: {column: force, unit: N%(extra)s}
commands:
  cmd_cart_force_n: {column: asked, unit: kN, scale: 2%(extra)s}
"""
CSV = (
    """mapping: cart
rig: cart
format: {kind: csv, delimiter: ";"}
clock: {column: time, unit: ms, period: 10 ms}
trials: [{name: first, begin: 0.5 s, end: 1 s}]
"""
    + SIGNALS % {"dot": "", "extra": ""}
)
MAT = CSV.replace('{kind: csv, delimiter: ";"}', "{kind: mat}")
MCAP = (
    """mapping: cart
rig: cart
format: {kind: mcap}
clock: {column: log_time, unit: ns, period: 10 ms}
"""
    + SIGNALS % {"dot": "'[1]'", "extra": ", topic: /cart"}
)
MCAP = MCAP.replace("pos'[1]'", "'pos[1]'")


def csv_text(t=T, position=POSITION, force=FORCE) -> str:
    rows = [
        f"{1e3 * a:.3f};{1e3 * b:.6f};{c:.6f};{c / 2000:.9f}"
        for a, b, c in zip(t, position, force, strict=True)
    ]
    return "\n".join(["time;pos;force;asked", *rows]) + "\n"


def mat_bytes(**changes: object) -> bytes:
    content = {
        "time": 1e3 * T,
        "pos": 1e3 * POSITION,
        "force": FORCE,
        "asked": FORCE / 2000.0,
    } | changes
    into = io.BytesIO()
    savemat(into, {name: value for name, value in content.items() if value is not None})
    return into.getvalue()


def mcap_json(path: Path, change=lambda k, message: message) -> None:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("cart", "jsonschema", b"{}")
        channel = writer.register_channel("/cart", "json", schema)
        for k in range(ROWS):
            message = change(
                k, {"pos": [0.0, 1e3 * POSITION[k]], "force": FORCE[k], "asked": FORCE[k] / 2000.0}
            )
            data = message if isinstance(message, bytes) else json.dumps(message).encode()
            writer.add_message(channel, log_time=10_000_000 * k + 5, data=data, publish_time=0)
        writer.finish()


def mcap_protobuf(path: Path) -> None:
    kinds = descriptor_pb2.FieldDescriptorProto
    file = descriptor_pb2.FileDescriptorProto(name="cart.proto", package="lab", syntax="proto3")
    message = file.message_type.add(name="Cart")
    message.field.add(name="pos", number=1, type=kinds.TYPE_DOUBLE, label=kinds.LABEL_REPEATED)
    message.field.add(name="force", number=2, type=kinds.TYPE_DOUBLE, label=kinds.LABEL_OPTIONAL)
    message.field.add(name="asked", number=3, type=kinds.TYPE_FLOAT, label=kinds.LABEL_OPTIONAL)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    cart = message_factory.GetMessageClass(pool.FindMessageTypeByName("lab.Cart"))
    with path.open("wb") as into:
        writer = Writer(into)
        writer.start()
        schema = writer.register_schema(
            "lab.Cart",
            "protobuf",
            descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString(),
        )
        channel = writer.register_channel("/cart", "protobuf", schema)
        for k in range(ROWS):
            data = cart(
                pos=[0.0, 1e3 * POSITION[k]], force=FORCE[k], asked=FORCE[k] / 2000.0
            ).SerializeToString()
            writer.add_message(channel, log_time=10_000_000 * k + 5, data=data, publish_time=0)
        writer.finish()


def write_all(folder: Path) -> dict[str, tuple[Path, Path]]:
    """Every kind: mapping and file."""
    found = {}
    for kind, mapping in (("csv", CSV), ("mat", MAT), ("mcap", MCAP), ("protobuf", MCAP)):
        map_file, file = (
            folder / f"{kind}.yaml",
            folder / f"cart_{kind}.{kind.replace('protobuf', 'mcap')}",
        )
        map_file.write_text(mapping)
        found[kind] = (map_file, file)
    found["csv"][1].write_text(csv_text())
    found["mat"][1].write_bytes(mat_bytes())
    mcap_json(found["mcap"][1])
    mcap_protobuf(found["protobuf"][1])
    return found
