"""Broken plant and experiment files."""

from broken_files import table

PLANT = table(
    "bench.yaml",
    ("plant: wrong unit", "supply: 48 V", "supply: 48 A", "supply: 48", "'48 A'", "a quantity in V"),
    ("plant: missing unit", "supply: 48 V", "supply: 48", "supply: 48", "'48' without a unit", "like V"),
    ("plant: psf", "supply_gauge: 850 kPa", "supply_gauge: 120 psf", "psf", "unit 'psf'", "a known unit"),
    ("plant: not a number", "inertia: 110 g*cm^2", "inertia: .nan", "inertia", "'nan'", "a number with a unit"),
    ("plant: infinite", "inertia: 110 g*cm^2", "inertia: 1e999 g*cm^2", "inertia", "1e999", "a finite number"),
    ("plant: bool for a quantity", "gear_ratio: 19", "gear_ratio: true", "gear_ratio", "True", "a number with a unit"),
    ("plant: list for a quantity", "gear_ratio: 19", "gear_ratio: [19]", "gear_ratio", "[19]", "a number with a unit"),
    ("plant: negative inertia", "inertia: 110 g*cm^2", "inertia: -110 g*cm^2", "inertia", "-110 g*cm^2", "to"),
    ("plant: out of bounds", "gear_ratio: 19", "gear_ratio: 1e9", "gear_ratio", "1e9", "to"),
    ("plant: unknown block", "transmission:", "gearbox:", "gearbox", "'gearbox'", "one of bus, drive"),
    ("plant: unknown parameter", "winding: 1.03 ohm", "windings: 1.03 ohm", "windings", "'windings'", "one of supply"),
    ("plant: parameter twice", "supply: 48 V", "supply: 48 V\n  supply: 24 V", "supply: 24", "the key 'supply' a second time", "each key once"),
    ("plant: block as one word", "load:\n  kind_code: 0                 # held by the load cell\n  start_travel: 0 cm\n  rest0: 12 cm", "load: fixed", "load: fixed", "'fixed'", "a mapping"),
    ("plant: no name", "plant: bench", "plant: 3", "plant: 3", "3", "the plant's name"),
    ("plant: part of a sub-step", "substeps: 2", "substeps: 2.5", "substeps", "2.5", "a whole number from 1 to 1024"),
    ("plant: no sub-steps", "substeps: 2", "substeps: 0", "substeps", "0", "a whole number from 1 to 1024"),
    ("plant: bool for sub-steps", "substeps: 2", "substeps: true", "substeps", "True", "a whole number from 1 to 1024"),
    ("plant: unknown effect", "load:", "effects: {gremlins: {x: 1}}\nload:", "gremlins", "'gremlins'", "one of "),
    ("plant: effects as a list", "load:", "effects: [hysteresis]\nload:", "effects", "['hysteresis']", "a mapping"),
    ("plant: half a load", "kind_code: 0", "kind_code: 0.5", "kind_code", "0.5", "a whole number"),
    ("plant: bracket left open", "plant: bench", "plant: [bench", "substeps", "not YAML", "YAML"),
    ("plant: tab as indent", "  supply: 48 V", "\tsupply: 48 V", "\tsupply", "cannot start any token", "YAML"),
    ("plant: third muscle", "muscle1:\n", "muscle2:\n", "muscle2", "'muscle2'", "one of "),
    ("plant: seed below zero", "seed: 1", "seed: -1", "seed", "-1", "0 to"),
)

EXPERIMENT = table(
    "identification_short.yaml",
    ("experiment: unknown loop", "loop: motor_speed", "loop: motor_sped", "loop:", "'motor_sped'", "'motor_speed'"),
    ("experiment: loop that the rig lacks", "loop: motor_speed", "loop: joint_angle", "loop:", "the loop 'joint_angle'", "one that the rig 'bench' can do"),
    ("experiment: unknown key", "seed: 1", "sead: 1", "sead", "an unknown key 'sead'", "only keys"),
    ("experiment: wrong unit", "for: 5 s", "for: 5 mm", "for: 5", "'5 mm'", "a quantity in s"),
    ("experiment: negative duration", "for: 5 s", "for: -5 s", "for: -5", "'-5 s'", "above zero"),
    ("experiment: shorter than a cycle", "for: 5 s", "for: 1 us", "for: 1 us", "'1 us'", "at least one cycle"),
    ("experiment: pressure of no reference", "[460 kPa gauge, 640 kPa gauge]", "[460 kPa gauge, 640 kPa]", "$p0", "'640 kPa'", "gauge"),
    ("experiment: pressure above the muscle's", "640 kPa gauge", "64000 kPa gauge", "$p0", "64000 kPa gauge", "a pressure that the muscle muscle takes"),
    ("experiment: unknown place", "go_to_no_load, move: {to: no_load", "go_to_no_load, move: {to: noload", "to: noload", "the place 'noload'", "no_load"),
    ("experiment: faster than the rig", "speed: 50 mm/s", "speed: 50 m/s", "speed: 50", "'50 m/s'", "at most the rig's limit"),
    ("experiment: two motions", "    trial: true\n", "    trial: true\n    move: {to: no_load, speed: 20 mm/s}\n", "name: trial", "move and random_speed in one phase", "one motion"),
    ("experiment: bool for a number of times", "seed: 1", "seed: 1\ntimes: true", "times", "True", "a whole number"),
    ("experiment: word for the valves", "{all: hold}", "{all: hodl}", "hodl", "'hodl'", "hold"),
    ("experiment: name that nothing defines", "{set: $p0}}, until: valves_settled, timeout: 60 s}\n  #", "{set: $p1}}, until: valves_settled, timeout: 60 s}\n  #", "$p1", "'$p1', which nothing defines", "$p0"),
)
