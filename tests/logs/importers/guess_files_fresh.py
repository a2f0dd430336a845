"""Twelve more recordings, by other conventions and motions than those of guess_files.py."""

import json
from pathlib import Path

import numpy as np
from guess_score import Case


class Steps:
    """Random steps through a second-order lag: position, exact speed, what asked for it."""

    def __init__(self, rows: int, period_s: float, seed: int, size: float):
        self.rng = np.random.default_rng(1000 + seed)
        self.rows = rows
        self.t_s = np.arange(rows) * period_s
        each = max(rows // 12, 1)
        self.asked = np.repeat(self.rng.uniform(-size, size, rows // each + 1), each)[:rows]
        self.x, self.v = np.zeros(rows), np.zeros(rows)
        turn = 2 * np.pi * min(3.0, 0.04 / period_s)
        for k in range(1, rows):
            a = turn**2 * (self.asked[k - 1] - self.x[k - 1]) - 1.4 * turn * self.v[k - 1]
            self.v[k] = self.v[k - 1] + period_s * a
            self.x[k] = self.x[k - 1] + period_s * 0.5 * (self.v[k] + self.v[k - 1])
        self.effort = 30 * (self.asked - self.x) + self.rng.normal(0, 0.2, rows)

    def noise(self, values: np.ndarray, size: float) -> np.ndarray:
        return values + self.rng.normal(0, size, self.rows)


def _case(folder: Path, name: str, path: Path, form: str, clock: str, body: str) -> Case:
    truth = folder / f"{name}.truth.yaml"
    truth.write_text(f"mapping: m\nrig: lab\nformat: {form}\nclock: {clock}\n{body}")
    return Case(name, (path,), truth)


def _text(path: Path, head: str, columns: list[np.ndarray], form: str, sign: str) -> Path:
    lines = [
        sign.join(form % cell if isinstance(cell, float) else str(cell) for cell in row)
        for row in zip(*(c.tolist() for c in columns), strict=True)
    ]
    path.write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def made(folder: Path) -> list[Case]:
    """Those of text, of tables and of messages."""
    return [*_texts(folder), *_tables(folder), *_arrays(folder), *_lines(folder), _bag(folder)]


def _texts(folder: Path) -> list[Case]:
    s = Steps(2000, 0.01, 1, 60.0)
    path = _text(
        folder / "epoch.csv",
        ",timestamp,motor_position,motor_velocity,motor_current,pwm\n",
        [np.arange(2000), 1.75e9 + s.t_s, s.x, s.v, np.abs(s.effort) / 10, np.rint(s.effort)],
        "%.4f", ",",
    )  # fmt: skip
    one = _case(
        folder, "epoch", path, "{kind: csv}", "{column: timestamp, unit: s, period: 10 ms}",
        "measured:\n  m_rad: {column: motor_position, unit: deg}\n"
        "  m_rad_s: {column: motor_velocity, unit: deg/s}\n"
        "  m_a: {column: motor_current, unit: A}\n",
    )  # fmt: skip
    s = Steps(1500, 0.005, 2, 12.0)
    path = _text(
        folder / "lab.csv",
        "Operator: A. B.\nDate: 2024-03-02\n\n"
        "Elapsed Time (sec);Stroke (mm);Load Cell (kN);P1 (psi)\n",
        [s.t_s, s.x + 20, s.effort / 100, 30 + np.abs(s.x)],
        "%.5f", ";",
    )  # fmt: skip
    path.write_text(path.read_text().replace(".", ",").replace("A, B,", "A. B."))
    two = _case(
        folder, "lab", path,
        "{kind: csv, delimiter: ';', decimal: ',', skip_lines: 2}",
        "{column: Elapsed Time (sec), unit: s, period: 5 ms}",
        "measured:\n  s_m: {column: Stroke (mm), unit: mm}\n"
        "  l_n: {column: Load Cell (kN), unit: kN}\n  p_pa: {column: P1 (psi), unit: psi gauge}\n",
    )  # fmt: skip
    s = Steps(1200, 0.002, 3, 1.0)
    path = _text(
        folder / "comment.txt", "# t q dq tau\n",
        [s.t_s, s.x, s.noise(s.v, 0.02), s.effort], "%.6e", " ",
    )  # fmt: skip
    three = _case(
        folder, "comment", path, "{kind: csv, delimiter: ' ', header: false, skip_lines: 1}",
        "{column: 1, unit: s, period: 2 ms}",
        "measured:\n  q_rad: {column: 2, unit: rad}\n  q_rad_s: {column: 3, unit: rad/s}\n"
        "  q_nm: {column: 4, unit: Nm}\n",
    )  # fmt: skip
    return [one, two, three]


def _tables(folder: Path) -> list[Case]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    s = Steps(1800, 0.001, 4, 25.0)
    path = folder / "knee.parquet"
    pq.write_table(
        pa.table(
            {
                "t_us": np.rint(1e6 * s.t_s).astype(np.int64),
                "left_knee_angle": s.x,
                "left_knee_velocity": s.noise(s.v, 0.1),
                "left_knee_angle_cmd": s.asked,
                "trial_id": np.repeat([1, 2, 3], 600),
            }
        ),
        path,
    )
    one = _case(
        folder, "knee", path, "{kind: parquet}", "{column: t_us, unit: us, period: 1 ms}",
        "measured:\n  k_rad: {column: left_knee_angle, unit: deg}\n"
        "  k_rad_s: {column: left_knee_velocity, unit: deg/s}\n"
        "commands:\n  cmd_k_rad: {column: left_knee_angle_cmd, unit: deg}\n"
        "trials: {column: trial_id}\n",
    )  # fmt: skip
    s = Steps(700, 0.02, 5, 0.6)
    path = folder / "lists.parquet"
    pq.write_table(
        pa.table(
            {
                "elapsed": pa.array(np.rint(1e9 * s.t_s).astype(np.int64), pa.duration("ns")),
                "joint_pos": pa.array(np.stack([s.x, 0.5 * s.x], 1).tolist()),
                "joint_vel": pa.array(np.stack([s.v, 0.5 * s.v], 1).tolist()),
                "goal_deg": np.degrees(s.asked),
                "temp_C": pa.array([None if k % 50 == 3 else 31.5 + 0.01 * k for k in range(700)]),
                "label": ["x"] * 700,
            }
        ),
        path,
    )
    two = _case(
        folder, "lists", path, '{kind: parquet, missing: ["null"]}',
        "{column: elapsed, unit: ns, period: 20 ms}",
        "measured:\n  a_rad: {column: 'joint_pos[0]', unit: rad}\n"
        "  b_rad: {column: 'joint_pos[1]', unit: rad}\n"
        "  a_rad_s: {column: 'joint_vel[0]', unit: rad/s}\n"
        "  b_rad_s: {column: 'joint_vel[1]', unit: rad/s}\n"
        "  t_k: {column: temp_C, unit: K, offset: 273.15 K}\n"
        "commands:\n  cmd_a_rad: {column: goal_deg, unit: deg}\n",
    )  # fmt: skip
    s = Steps(2500, 0.004, 6, 1.5)
    path = folder / "air.parquet"
    pq.write_table(
        pa.table(
            {
                "time_ms": 4.0 * np.arange(2500),
                "p_chamber_bar_a": 3 + s.x,
                "p_supply_barg": 7 + 0.01 * s.x,
                "p_des_bar_a": 3 + s.asked,
                "valve_in": (s.asked > s.x).astype(np.int8),
                "T1": 22 + 0.1 * s.x,
            }
        ),
        path,
    )
    three = _case(
        folder, "air", path, "{kind: parquet}", "{column: time_ms, unit: ms, period: 4 ms}",
        "measured:\n  c_pa: {column: p_chamber_bar_a, unit: bar abs}\n"
        "  s_pa: {column: p_supply_barg, unit: bar gauge}\n"
        "  t_k: {column: T1, unit: K, offset: 273.15 K}\n"
        "commands:\n  cmd_valve_open: {column: valve_in, unit: '1'}\n"
        "references:\n  ref_c_pa: {column: p_des_bar_a, unit: bar abs}\n",
    )  # fmt: skip
    return [one, two, three]


def _arrays(folder: Path) -> list[Case]:
    from scipy.io import savemat

    s = Steps(2000, 0.0025, 7, 0.02)
    log = np.zeros(2000, [("time", "f8"), ("x", "f8"), ("v", "f8"), ("F", "f8")])
    log["time"], log["x"], log["v"], log["F"] = s.t_s + 17.5, s.x, 1e3 * s.v, s.effort
    np.savez(folder / "record.npz", log=log)
    one = _case(
        folder, "record", folder / "record.npz", "{kind: npz}",
        "{column: log.time, unit: s, period: 2.5 ms}",
        "measured:\n  x_m: {column: log.x, unit: m}\n  v_m_s: {column: log.v, unit: mm/s}\n"
        "  f_n: {column: log.F, unit: N}\n",
    )  # fmt: skip
    s = Steps(600, 0.05, 8, 0.8)
    np.savez(
        folder / "policy.npz",
        timestamps=np.rint(1e9 * s.t_s).astype(np.int64) + 1_700_000_000_000_000_000,
        qpos=np.stack([s.x, -s.x], 1), qvel=np.stack([s.v, -s.v], 1),
        action=np.stack([s.asked, -s.asked], 1), success=np.array(True),
    )  # fmt: skip
    two = _case(
        folder, "policy", folder / "policy.npz", "{kind: npz}",
        "{column: timestamps, unit: ns, period: 50 ms}",
        "measured:\n  a_rad: {column: 'qpos[0]', unit: rad}\n"
        "  b_rad: {column: 'qpos[1]', unit: rad}\n"
        "  a_rad_s: {column: 'qvel[0]', unit: rad/s}\n  b_rad_s: {column: 'qvel[1]', unit: rad/s}\n"
        "commands:\n  cmd_a_rad: {column: 'action[0]', unit: rad}\n"
        "  cmd_b_rad: {column: 'action[1]', unit: rad}\n",
    )  # fmt: skip
    s = Steps(3000, 0.001, 9, 15.0)
    savemat(
        folder / "machine.mat",
        {
            "Fs": 1000.0,
            "Disp_mm": s.x,
            "Force_lbf": s.effort,
            "Ref_mm": s.asked,
            "Run": np.ones(3000),
        },
    )
    three = _case(
        folder, "machine", folder / "machine.mat", "{kind: mat}", "{rate: 1 kHz}",
        "measured:\n  d_m: {column: Disp_mm, unit: mm}\n  f_n: {column: Force_lbf, unit: lbf}\n"
        "references:\n  ref_d_m: {column: Ref_mm, unit: mm}\n",
    )  # fmt: skip
    return [one, two, three]


def _lines(folder: Path) -> list[Case]:
    s = Steps(800, 0.01, 10, 90.0)
    t_s = s.t_s + s.rng.uniform(-0.003, 0.003, 800)
    with (folder / "motor.jsonl").open("w") as file:
        for k in range(800):
            motor = {"angle": s.x[k], "rpm": s.v[k] / 6}
            file.write(
                json.dumps({"t": t_s[k] + 5, "motor": motor, "loadcell_N": s.effort[k]}) + "\n"
            )
    one = _case(
        folder, "motor", folder / "motor.jsonl", "{kind: jsonl}",
        "{column: t, unit: s, period: 10 ms, resample: linear}",
        "measured:\n  m_rad: {column: motor.angle, unit: deg}\n"
        "  m_rad_s: {column: motor.rpm, unit: rpm}\n  l_n: {column: loadcell_N, unit: N}\n",
    )  # fmt: skip
    s = Steps(900, 0.02, 11, 80.0)
    with (folder / "valve.jsonl").open("w") as file:
        for k in range(900):
            row = {
                "seq": k, "epoch": 1.72e9 + s.t_s[k], "setpoint_kpa": 150 + s.asked[k],
                "measured_kpa": 150 + s.x[k], "enable": int(k > 50), "status": "run",
            }  # fmt: skip
            file.write(json.dumps(row) + "\n")
    two = _case(
        folder, "valve", folder / "valve.jsonl", "{kind: jsonl}",
        "{column: epoch, unit: s, period: 20 ms}",
        "measured:\n  m_pa: {column: measured_kpa, unit: kPa gauge}\n"
        "commands:\n  cmd_on_enable: {column: enable, unit: '1'}\n"
        "references:\n  ref_m_pa: {column: setpoint_kpa, unit: kPa gauge}\n",
    )  # fmt: skip
    return [one, two]


def _bag(folder: Path) -> Case:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_FOXY)
    kinds = store.types
    stamp, header = kinds["builtin_interfaces/msg/Time"], kinds["std_msgs/msg/Header"]
    state, imu = kinds["sensor_msgs/msg/JointState"], kinds["sensor_msgs/msg/Imu"]
    vector, turned = kinds["geometry_msgs/msg/Vector3"], kinds["geometry_msgs/msg/Quaternion"]
    many, layout = kinds["std_msgs/msg/Float64MultiArray"], kinds["std_msgs/msg/MultiArrayLayout"]
    s = Steps(400, 0.01, 12, 0.2)
    none = np.zeros(9)
    with Writer(folder / "walk", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        joints = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
        gyros = writer.add_connection("/imu/data", imu.__msgtype__, typestore=store)
        efforts = writer.add_connection(
            "/effort_controller/commands", many.__msgtype__, typestore=store
        )
        for k in range(400):
            at_ns = 1_780_000_000_000_000_000 + 10_000_000 * k
            head = header(stamp(at_ns // 10**9, at_ns % 10**9), "base")
            lists = [
                np.array([a, b])
                for a, b in ((s.x[k], s.x[k]), (s.v[k], s.v[k]), (s.effort[k], 0.0))
            ]
            message = state(head, ["slider", "right_elbow"], *lists)
            writer.write(joints, at_ns + 100_000, store.serialize_cdr(message, message.__msgtype__))
            spin, push = vector(0.0, 0.0, float(s.v[k])), vector(0.0, 0.0, 9.81)
            message = imu(head, turned(0.0, 0.0, 0.0, 1.0), none, spin, none, push, none)
            writer.write(gyros, at_ns + 200_000, store.serialize_cdr(message, message.__msgtype__))
            message = many(layout([], 0), np.array([s.effort[k], 0.5 * s.effort[k]]))
            writer.write(
                efforts, at_ns + 300_000, store.serialize_cdr(message, message.__msgtype__)
            )
    return _case(
        folder, "walk", folder / "walk", "{kind: rosbag}",
        "{column: header.stamp, unit: ns, period: 10 ms}",
        "measured:\n  s_m: {column: '/joint_states.position[slider]', unit: m}\n"
        "  s_m_s: {column: '/joint_states.velocity[slider]', unit: m/s}\n"
        "  s_n: {column: '/joint_states.effort[slider]', unit: N}\n"
        "  e_rad: {column: '/joint_states.position[right_elbow]', unit: rad}\n"
        "  e_rad_s: {column: '/joint_states.velocity[right_elbow]', unit: rad/s}\n"
        "  i_rad_s: {column: '/imu/data.angular_velocity.z', unit: rad/s}\n"
        "commands:\n"
        "  cmd_a_nm: {column: '/effort_controller/commands.data[0]', unit: Nm, stamp: log_time}\n"
        "  cmd_b_nm: {column: '/effort_controller/commands.data[1]', unit: Nm, stamp: log_time}\n",
    )  # fmt: skip
