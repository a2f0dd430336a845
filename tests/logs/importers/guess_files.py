"""Twenty recordings of six formats by the conventions of many labs, with their mappings by hand."""

import json
from pathlib import Path

import numpy as np
from guess_score import Case

ROOT = Path(__file__).resolve().parents[3]
CASES, DATA = ROOT.parent / "shared/cases", ROOT.parent / "shared/data"
_HEAD = "mapping: {name}\nrig: lab\nformat: {form}\nclock: {clock}\n"


class Motion:
    """A shaft or carriage that is moved by sines, its speed, force, pressure and current."""

    def __init__(self, rows: int, period_s: float, seed: int, size: float = 0.4):
        rng = np.random.default_rng(seed)
        self.rng, self.rows = rng, rows
        self.t_s = np.arange(rows) * period_s
        self.x = np.zeros(rows)
        self.v = np.zeros(rows)
        for hz in rng.uniform(0.2, 1.5, 3):
            turn, phase = 2 * np.pi * hz, rng.uniform(0, 6)
            self.x += size / 3 * np.sin(turn * self.t_s + phase)
            self.v += size / 3 * turn * np.cos(turn * self.t_s + phase)
        self.load = 12 * self.x + 1.5 * self.v + rng.normal(0, 0.05, rows)
        self.pressure = 2.5e5 + 6e4 * self.x / size + rng.normal(0, 50, rows)
        self.current = 0.2 * self.load
        self.lagged = np.interp(self.t_s - 0.03, self.t_s, self.x)

    def noisy(self, values: np.ndarray, share: float = 1e-3) -> np.ndarray:
        return values + self.rng.normal(0, share * np.ptp(values), self.rows)


def _write(folder: Path, name: str, path: Path, form: str, clock: str, body: str) -> Case:
    truth = folder / f"{name}.truth.yaml"
    truth.write_text(_HEAD.format(name=name, form=form, clock=clock) + body)
    return Case(name, (path,), truth)


def _csv(
    path: Path,
    columns: dict[str, np.ndarray],
    delimiter: str = ",",
    before: str = "",
    decimal: str = ".",
    digits: int = 6,
    units: str = "",
) -> Path:
    lines = [before + delimiter.join(columns)] + ([units] if units else [])
    for row in zip(*columns.values(), strict=True):
        cells = [
            str(v) if isinstance(v, (str, int, np.integer)) else f"{v:.{digits}f}" for v in row
        ]
        lines.append(delimiter.join(cell.replace(".", decimal) for cell in cells))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def made(folder: Path) -> list[Case]:
    """Those that are made here, two or three of each format."""
    return [
        *_made_csv(folder),
        *_made_parquet(folder),
        *_made_npz(folder),
        *_made_jsonl(folder),
        *_made_mat(folder),
        *_made_bags(folder),
    ]


def _made_csv(folder: Path) -> list[Case]:
    m = Motion(1500, 0.002, 1)
    columns = {
        "Time [ms]": 1e3 * m.t_s,
        "Position [deg]": np.degrees(m.x),
        "Velocity [deg/s]": np.degrees(m.noisy(m.v)),
        "Torque [Nm]": m.load,
        "Target position [deg]": np.degrees(m.x),
    }
    one = _write(
        folder, "csv_brackets", _csv(folder / "csv_brackets.csv", columns),
        "{kind: csv}", "{column: 'Time [ms]', unit: ms, period: 2 ms}",
        "measured:\n  p_rad: {column: 'Position [deg]', unit: deg}\n"
        "  v_rad_s: {column: 'Velocity [deg/s]', unit: deg/s}\n"
        "  t_nm: {column: 'Torque [Nm]', unit: Nm}\n"
        "commands:\n  cmd_p_rad: {column: 'Target position [deg]', unit: deg}\n",
    )  # fmt: skip
    m = Motion(1000, 0.01, 2, 0.02)
    columns = {
        "Zeit": m.t_s,
        "Weg": 1e3 * m.x,
        "Kraft": m.load,
        "Druck": m.pressure / 1e5,
        "Versuch": np.repeat([1, 2], 500),
    }
    two = _write(
        folder, "csv_german",
        _csv(folder / "csv_german.csv", columns, ";", "Stand 3\n\n", ",", units="s;mm;N;bar;-"),
        "{kind: csv, delimiter: ';', decimal: ',', skip_lines: 1, skip_below_header: 1}",
        "{column: Zeit, unit: s, period: 10 ms}",
        "measured:\n  w_m: {column: Weg, unit: mm}\n  k_n: {column: Kraft, unit: N}\n"
        "  d_pa: {column: Druck, unit: bar abs}\ntrials: {column: Versuch}\n",
    )  # fmt: skip
    m = Motion(1200, 0.005, 3)
    columns = {
        "timestamp_us": np.rint(1e6 * m.t_s).astype(int) + 81234567,
        "enc": np.rint(m.x / (2 * np.pi / 16384)) * (2 * np.pi / 16384),
        "vel": m.noisy(m.v),
        "cmd": m.x,
        "supply_V": 12 + 0 * m.x,
        "motor_on": (m.t_s > 1).astype(int),
    }
    three = _write(
        folder, "csv_micros", _csv(folder / "csv_micros.csv", columns, "\t", digits=9),
        "{kind: csv, delimiter: \"\\t\"}", "{column: timestamp_us, unit: us, period: 5 ms}",
        "measured:\n  e_rad: {column: enc, unit: rad}\n  v_rad_s: {column: vel, unit: rad/s}\n"
        "  s_v: {column: supply_V, unit: V}\n  m_enable: {column: motor_on, unit: '1'}\n"
        "commands:\n  cmd_e_rad: {column: cmd, unit: rad}\n",
    )  # fmt: skip
    return [one, two, three]


def _made_parquet(folder: Path) -> list[Case]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    m = Motion(2000, 0.001, 4)
    stamps = pa.array(
        1_760_000_000_000_000_000 + np.rint(1e9 * m.t_s).astype(int), pa.timestamp("ns")
    )
    path = folder / "pq_units.parquet"
    pq.write_table(
        pa.table(
            {
                "time": stamps,
                "knee_angle_rad": m.x,
                "knee_speed_rpm": m.v * 60 / (2 * np.pi),
                "spam_pressure_kpa_abs": m.pressure / 1e3,
                "ref_knee_angle_rad": m.x,
            }
        ),
        path,
    )
    one = _write(
        folder, "pq_units", path, "{kind: parquet}", "{column: time, unit: ns, period: 1 ms}",
        "measured:\n  k_rad: {column: knee_angle_rad, unit: rad}\n"
        "  k_rad_s: {column: knee_speed_rpm, unit: rpm}\n"
        "  s_pa: {column: spam_pressure_kpa_abs, unit: kPa abs}\n"
        "references:\n  ref_k_rad: {column: ref_knee_angle_rad, unit: rad}\n",
    )  # fmt: skip
    m = Motion(800, 0.02, 5, 0.05)
    path = folder / "pq_plain.parquet"
    q = m.x.copy()
    q[40:43] = np.nan
    pq.write_table(
        pa.table(
            {"t": m.t_s, "x": q, "xdot": m.v, "f": m.load, "episode": np.repeat([1, 2, 3, 4], 200)}
        ),
        path,
    )
    two = _write(
        folder, "pq_plain", path, "{kind: parquet, missing: [nan]}",
        "{column: t, unit: s, period: 20 ms}",
        "measured:\n  x_m: {column: x, unit: m}\n  v_m_s: {column: xdot, unit: m/s}\n"
        "  f_n: {column: f, unit: N}\ntrials: {column: episode}\n",
    )  # fmt: skip
    return [one, two]


def _made_npz(folder: Path) -> list[Case]:
    m = Motion(3000, 0.002, 6)
    path = folder / "npz_lists.npz"
    np.savez(
        path,
        t=m.t_s,
        q=np.stack([m.x, -m.x], 1),
        dq=np.stack([m.noisy(m.v), m.noisy(-m.v)], 1),
        tau_Nm=m.load,
    )
    one = _write(
        folder, "npz_lists", path, "{kind: npz}", "{column: t, unit: s, period: 2 ms}",
        "measured:\n  a_rad: {column: 'q[0]', unit: rad}\n  b_rad: {column: 'q[1]', unit: rad}\n"
        "  a_rad_s: {column: 'dq[0]', unit: rad/s}\n  b_rad_s: {column: 'dq[1]', unit: rad/s}\n"
        "  t_nm: {column: tau_Nm, unit: Nm}\n",
    )  # fmt: skip
    m = Motion(2500, 0.004, 7, 0.03)
    path = folder / "npz_rate.npz"
    np.savez_compressed(
        path, fs=250.0, pos_mm=1e3 * m.x, vel=1e3 * m.v, force_N=m.load, u=m.current
    )
    two = _write(
        folder, "npz_rate", path, "{kind: npz}", "{rate: 250 Hz}",
        "measured:\n  p_m: {column: pos_mm, unit: mm}\n  v_m_s: {column: vel, unit: mm/s}\n"
        "  f_n: {column: force_N, unit: N}\n"
        "commands:\n  cmd_u_a: {column: u, unit: A}\n",
    )  # fmt: skip
    return [one, two]


def _made_jsonl(folder: Path) -> list[Case]:
    m = Motion(900, 0.01, 8)
    path = folder / "jl_nested.jsonl"
    with path.open("w") as file:
        for k in range(m.rows):
            row = {
                "ts": 1_750_000_000_000 + 10 * k,
                "joint": {"pos_rad": m.x[k], "vel_dps": np.degrees(m.v[k])},
                "air": {"pressure_bar_gauge": (m.pressure[k] - 101325) / 1e5},
                "cmd": {"pos_rad": m.x[k]},
                "note": "ok",
            }
            file.write(json.dumps(row) + "\n")
    one = _write(
        folder, "jl_nested", path, "{kind: jsonl}", "{column: ts, unit: ms, period: 10 ms}",
        "measured:\n  j_rad: {column: joint.pos_rad, unit: rad}\n"
        "  j_rad_s: {column: joint.vel_dps, unit: deg/s}\n"
        "  a_pa: {column: air.pressure_bar_gauge, unit: bar gauge}\n"
        "commands:\n  cmd_j_rad: {column: cmd.pos_rad, unit: rad}\n",
    )  # fmt: skip
    m = Motion(600, 0.02, 9)
    path = folder / "jl_names.jsonl"
    t_s = m.t_s + np.where(m.t_s > 6, 4.0, 0.0)
    with path.open("w") as file:
        for k in range(m.rows):
            row = {
                "time": round(t_s[k], 6),
                "name": ["knee", "hip"],
                "position": [m.x[k], 2 * m.x[k]],
            }
            file.write(json.dumps(row | {"velocity": [m.v[k], 2 * m.v[k]]}) + "\n")
    two = _write(
        folder, "jl_names", path, "{kind: jsonl}", "{column: time, unit: s, period: 20 ms}",
        "measured:\n  k_rad: {column: 'position[knee]', unit: rad}\n"
        "  h_rad: {column: 'position[hip]', unit: rad}\n"
        "  k_rad_s: {column: 'velocity[knee]', unit: rad/s}\n"
        "  h_rad_s: {column: 'velocity[hip]', unit: rad/s}\n"
        "trials: [{name: a, begin: 0 s, end: 6.01 s}, {name: b, begin: 10 s, end: 17 s}]\n",
    )  # fmt: skip
    return [one, two]


def _made_mat(folder: Path) -> list[Case]:
    from scipy.io import savemat

    m = Motion(2000, 0.001, 10)
    path = folder / "mat_struct.mat"
    savemat(
        path,
        {
            "log": {
                "time_s": m.t_s,
                "theta_deg": np.degrees(m.x),
                "omega": m.v,
                "i_mA": 1e3 * m.current,
                "theta_des_deg": np.degrees(m.x),
            }
        },
    )
    one = _write(
        folder, "mat_struct", path, "{kind: mat}", "{column: log.time_s, unit: s, period: 1 ms}",
        "measured:\n  t_rad: {column: log.theta_deg, unit: deg}\n"
        "  o_rad_s: {column: log.omega, unit: rad/s}\n  i_a: {column: log.i_mA, unit: mA}\n"
        "references:\n  ref_t_rad: {column: log.theta_des_deg, unit: deg}\n",
    )  # fmt: skip
    return [one]


def _made_bags(folder: Path) -> list[Case]:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    stamp, header = kinds["builtin_interfaces/msg/Time"], kinds["std_msgs/msg/Header"]
    state, wrench = kinds["sensor_msgs/msg/JointState"], kinds["geometry_msgs/msg/WrenchStamped"]
    inner, vector = kinds["geometry_msgs/msg/Wrench"], kinds["geometry_msgs/msg/Vector3"]
    number = kinds["std_msgs/msg/Float64"]
    found = []
    for name, plugin in (("bag_mcap", StoragePlugin.MCAP), ("bag_db3", StoragePlugin.SQLITE3)):
        m = Motion(500, 0.01, 11)
        with Writer(folder / name, version=9, storage_plugin=plugin) as writer:
            joints = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
            forces = writer.add_connection("/ft_sensor", wrench.__msgtype__, typestore=store)
            asked = writer.add_connection(
                "/knee_position_cmd_rad", number.__msgtype__, typestore=store
            )
            for k in range(m.rows):
                at_ns = 1_770_000_000_000_000_000 + 10_000_000 * k
                head = header(stamp(at_ns // 10**9, at_ns % 10**9), "")
                message = state(head, ["knee"], *(np.array([v[k]]) for v in (m.x, m.v, m.load)))
                writer.write(
                    joints, at_ns + 400_000, store.serialize_cdr(message, message.__msgtype__)
                )
                zero = vector(0.0, 0.0, 0.0)
                message = wrench(head, inner(vector(0.0, 0.0, float(m.load[k])), zero))
                writer.write(
                    forces, at_ns + 500_000, store.serialize_cdr(message, message.__msgtype__)
                )
                message = number(float(m.x[k]))
                writer.write(
                    asked, at_ns + 200_000, store.serialize_cdr(message, message.__msgtype__)
                )
        body = (
            "measured:\n  k_rad: {column: '/joint_states.position[knee]', unit: rad}\n"
            "  k_rad_s: {column: '/joint_states.velocity[knee]', unit: rad/s}\n"
            "  k_nm: {column: '/joint_states.effort[knee]', unit: Nm}\n"
            "  f_n: {column: '/ft_sensor.wrench.force.z', unit: N}\n"
            "commands:\n  cmd_k_rad: {column: '/knee_position_cmd_rad.data', unit: rad,"
            " stamp: log_time}\n"
        )
        clock = "{column: header.stamp, unit: ns, period: 10 ms}"
        found.append(_write(folder, name, folder / name, "{kind: rosbag}", clock, body))
    return found


def real(which: int) -> list[Case]:
    """Recordings of others whose mapping by hand stands beside them; two sets."""
    replays, real, imports = CASES / "replays", CASES / "real", ROOT / "config/imports"
    zillen, sage, emps = (DATA / name for name in ("zillen_pneumatic", "sage_so101", "emps"))
    one = [
        Case("xl330", (real / "xl330/k100_sin_sin.csv",), real / "xl330/map.yaml"),
        Case("mauicv", (real / "mauicv_servo/fit.csv",), real / "mauicv_servo/map.yaml"),
        Case("cog36", (replays / "cog36.csv",), replays / "cog36.map.yaml"),
        Case("pace13", (replays / "pace13_fit.csv",), replays / "pace13.map.yaml"),
        Case("emps", (emps / "DATA_EMPS.mat",), imports / "emps.yaml"),
        Case(
            "zillen_chamber", (zillen / "chambers/Aluminium.csv",), imports / "zillen_chamber.yaml"
        ),
        Case(
            "zillen_friction",
            (zillen / "friction/O-ring_3bar.csv",),
            imports / "zillen_friction.yaml",
        ),
        Case(
            "sage",
            tuple(sage / f"chirp_sweep/{n}.csv" for n in ("control", "state_motor")),
            imports / "sage_so101.yaml",
        ),
    ]
    two = [
        Case("direct_drive", (real / "direct_drive/j2_20.csv",), real / "direct_drive/map.yaml"),
        Case("mauicv_hold", (real / "mauicv_servo/hold.csv",), real / "mauicv_servo/map.yaml"),
        Case("franka249", (replays / "franka249.csv",), replays / "franka249.map.yaml"),
        Case("soarm134", (replays / "soarm134.csv",), replays / "soarm134.map.yaml"),
        Case("emps_pulses", (emps / "DATA_EMPS_PULSES.mat",), imports / "emps_pulses.yaml"),
        Case("zillen_prusa", (zillen / "chambers/Prusa.csv",), imports / "zillen_chamber.yaml"),
        Case(
            "zillen_kidney",
            (zillen / "friction/Kidney_2bar.csv",),
            imports / "zillen_friction.yaml",
        ),
        Case(
            "sage_step",
            tuple(sage / f"step_response/{n}.csv" for n in ("control", "state_motor")),
            imports / "sage_so101.yaml",
        ),
    ]
    return [case for case in (one, two)[which] if all(path.exists() for path in case.files)]
