"""Broken rig files: bench.yaml with one edit each (knee.yaml and bench_analog.yaml where they have more to break)."""

from broken_files import table

PRESSURE = "    calibration: {native: [1 V, 5 V], value: [0 kPa, 1000 kPa]}"
INLET = "cmd_muscle_inlet_open, entry: valves.ch1"
EXHAUST = "port: muscle0_exhaust, inverted: true, safe: 1}"

UNITS = table(
    "bench.yaml",
    ("wrong unit", "period: 1 ms", "period: 1 mm", "period:", "'1 mm'", "a quantity in s"),
    ("missing unit", "period: 1 ms", "period: 1", "period:", "'1' without a unit", "a number with a unit like s"),
    ("unknown unit", "transition_timeout: 0.5 s", "transition_timeout: 0.5 sec", "transition_timeout", "unit 'sec'", "a known unit"),
    ("off by a dimension", "slew: 150 mm/s", "slew: 150 mm/s^2", "slew: 150", "'150 mm/s^2'", "m/s"),
    ("psf", "limits: [60 kPa abs, 800 kPa gauge]", "limits: [60 kPa abs, 116 psf gauge]", "psf", "unit 'psf'", "kPa"),
    ("nan", "rated_torque: 170 mNm", "rated_torque: .nan", "rated_torque", "'nan'", "a number with a unit"),
    ("infinity", "late: 0.3 ms", "late: .inf", "overrun", "'inf'", "a number with a unit"),
    ("infinite with a unit", "late: 0.3 ms", "late: 1e999 ms", "overrun", "'1e999 ms'", "a finite number"),
    ("infinite calibration", "[0 V, 10 V], value", "[0 V, 1e999 V], value", "1e999", "'1e999 V'", "a finite number"),
    ("bool for a quantity", "period: 1 ms", "period: true", "period:", "True", "a number with a unit"),
    ("bool for a whole number", "lost_cycles: 3", "lost_cycles: true", "lost_cycles", "True", "a whole number"),
    ("text for a whole number", "lost_cycles: 3", "lost_cycles: '3'", "lost_cycles", "'3'", "a whole number"),
    ("number for a truth", "inverted: true", "inverted: 1", "inverted: 1", "1", "true or false"),
    ("list for a number", "reaction: 20 ms", "reaction: [20 ms]", "reaction", "['20 ms']", "a number with a unit"),
    ("a brackets bomb as unit", "late: 0.3 ms", f"late: 0.3 {'(' * 60}s", "overrun", "unit", "a closing bracket"),
    ("a power that overflows", "late: 0.3 ms", "late: 0.3 ((km^9)^9)^9", "overrun", "unit", "a form such as N*s/m"),
    ("digits of another script", "period: 1 ms", "period: \u0661 ms", "period:", "'\u0661 ms'", "a number with a unit"),
    ("huge whole number", "counts_per_turn: 4096", f"counts_per_turn: 0x{'f' * 5000}", "counts_per_turn", "over 40 digits", "16777216"),
    ("huge number without unit", "period: 1 ms", f"period: 0x{'f' * 5000}", "period:", "over 40 digits", "a number with a unit"),
    ("negative duration", "transition_timeout: 0.5 s", "transition_timeout: -0.5 s", "transition_timeout", "'-0.5 s'", "at least 0 s"),
    ("period too short", "period: 1 ms", "period: 10 us", "period:", "'10 us'", "0.0001 to 1 s"),
    ("period too long", "period: 1 ms", "period: 2 s", "period:", "'2 s'", "0.0001 to 1 s"),
    ("pressure of no reference", "limits: [60 kPa abs, 800 kPa gauge]", "limits: [60 kPa abs, 800 kPa]", "800 kPa]", "'800 kPa'", "gauge"),
    ("atmosphere of ten bar", "101.325 kPa abs", "1013.25 kPa abs", "atmosphere", "'1013.25 kPa abs'", "30000 to 120000 Pa abs"),
    ("a row's limit in another unit", "limits: [-40 N, 350 N]", "limits: [-40 N, 350 kPa]", "350 kPa]", "'350 kPa'", "a quantity in N"),
)

SHAPE = table(
    "bench.yaml",
    ("unknown key at the top", "description:", "descripton:", "descripton", "an unknown key 'descripton'", "only keys that the schema knows"),
    ("unknown key in a row", "stale_after: 20", "stale_aftr: 20", "stale_aftr", "an unknown key 'stale_aftr'", "only keys that the schema knows"),
    ("unknown key in the drive", "transition_timeout: 0.5 s", "transition_time: 0.5 s", "transition_time:", "an unknown key 'transition_time'", "only keys"),
    ("key given twice", "plant: ../plants/bench.yaml", "plant: ../plants/bench.yaml\nperiod: 2 ms", "period: 2 ms", "the key 'period' a second time", "each key once"),
    ("row without entry", "    entry: analog_in.ch1\n", "", "name: muscle_pressure_pa", "nothing", "the key 'entry'"),
    ("drive without status word", "  status_word: drive_status_raw\n", "", "drive:", "nothing", "the key 'status_word'"),
    ("misspelt section", "muscles:", "muscels:", "muscels:", "an unknown key 'muscels'", "only keys that the schema knows"),
    ("no period", "period: 1 ms\n", "", 3, "nothing", "the key 'period'"),
    ("tab as indent", "  interface: cia402", "\tinterface: cia402", "\tinterface", "cannot start any token", "YAML"),
    ("bracket left open", "limits: [-9 A, 9 A]", "limits: [-9 A, 9 A", "entry: drive.status_word", "not YAML", "YAML"),
    ("control character", "description: Serial", "description: \x07Serial", "description", "the character U+0007", "printable text"),
    ("escape out of Unicode", "description: Serial identification bench, drive on the bus", 'description: "\\UFFFFFFFF"', "description", "not YAML", "YAML"),
    ("tag that crashes the parser", "period: 1 ms", "period: !!timestamp 1 ms", "period:", "no timestamp", "a plain value"),
    ("tag that runs code", "plant: ../plants/bench.yaml", "plant: !!python/object/apply:os.system [ls]", "plant:", "a list", "text"),
    ("list as key", "period: 1 ms", "? [period]\n: 1 ms", "? [period]", "a key that is a list", "a word as key"),
    ("nested deep", "reaction: 20 ms", "reaction: " + "[" * 40 + "]" * 40, "reaction", "nested over 30 deep", "less"),
    ("brackets bomb", "reaction: 20 ms", "reaction: " + "[" * 5000, "reaction", "nested too deeply", "a few levels"),
    ("alias of itself", "places: {no_load: 0 mm", "places: &p {no_load: *p", "places", "nested over 30 deep", "less"),
    ("bus as a mapping", "bus:\n", "bus: {}\nunused:\n", "unused", "an unknown key 'unused'", "only keys"),
    ("muscles twice", "safety:\n", "muscles: []\nsafety:\n", "muscles: []", "the key 'muscles' a second time", "each key once"),
    ("a slave that is a word", "{name: coupler, device: EK1100}", "coupler", "- coupler", "'coupler'", "a mapping of keys to values"),
    ("unknown policy", "policy: count", "policy: ignore", "overrun", "'ignore'", "'count', 'stop' or 'trip'"),
    ("unknown interface", "interface: cia402", "interface: ciA402", "interface:", "'ciA402'", "'cia402', 'analog'"),
    ("drive without interface", "  interface: cia402\n", "", "drive:", "nothing", "the key 'interface'"),
    ("limits of one end", "limits: [-9 A, 9 A]", "limits: [9 A]", "[9 A]", "['9 A']", "a pair"),
    ("unicode in a name", "rig: bench", "rig: bänk", "rig:", "'bänk'", "pattern"),
    ("name on two lines", "rig: bench", 'rig: "be\\nnch"', "rig:", "'be", "pattern"),
    ("reads what", "reads: gauge", "reads: guage", "reads:", "'guage'", "'gauge' or 'absolute'"),
)
