"""Units as people write them into names and headers of columns."""

import re
from typing import NamedTuple


class Unit(NamedTuple):
    """A unit of the mapping's language, and the quantity that it measures.

    ``scale``, ``offset``: where a unit has no word there (kgf, degrees Celsius); ``against``: of a
    pressure, where the unit says it.
    """

    text: str
    quantity: str
    scale: str = ""
    offset: str = ""
    against: str = ""


SUFFIXES = {
    "length": "_m",
    "angle": "_rad",
    "speed": "_m_s",
    "turning": "_rad_s",
    "force": "_n",
    "torque": "_nm",
    "pressure": "_pa",
    "current": "_a",
    "voltage": "_v",
    "temperature": "_k",
    "frequency": "_hz",
    "mass": "_kg",
    "time": "_s",
    "ratio": "_ratio",
    "raw": "_raw",
    "switch": "_enable",
    "valve": "_open",
}
"""What a signal's name ends in, by quantity."""

_TABLE = (
    ("length", "m:m meter meters metre metres;mm:mm millimeter millimeters;cm:cm"),
    ("length", "um:um micron microns \N{MICRO SIGN}m;inch:in inch inches;ft:ft feet"),
    ("angle", "rad:rad rads radian radians;mrad:mrad;deg:deg degs degree degrees \N{DEGREE SIGN}"),
    ("angle", "rev:rev revs turn turns revolutions"),
    ("speed", "m/s:m/s mps m.s-1;mm/s:mm/s mmps;cm/s:cm/s;inch/s:in/s ips"),
    ("turning", "rad/s:rad/s rads/s radps;deg/s:deg/s dps degps \N{DEGREE SIGN}/s"),
    ("turning", "rpm:rpm rev/min 1/min;rev/s:rev/s rps;mrad/s:mrad/s"),
    ("force", "N:n newton newtons;kN:kn;mN:mn;lbf:lbf lb lbs"),
    ("torque", "Nm:nm n*m n.m newtonmeter newtonmeters;mNm:mnm;N*cm:ncm n*cm"),
    ("torque", "lbf*inch:lbin in-lb lbf*in;kNm:knm"),
    ("pressure", "Pa:pa pascal pascals;kPa:kpa;MPa:mpa;bar:bar bars;mbar:mbar;psi:psi"),
    ("current", "A:a amp amps ampere amperes;mA:ma milliamp"),
    ("voltage", "V:v volt volts;mV:mv millivolt"),
    ("time", "s:s sec secs second seconds;ms:ms msec millis millisec milliseconds millisecond"),
    ("time", "us:us usec micros microsec microseconds \N{MICRO SIGN}s;ns:ns nsec nanos nanosec"),
    ("time", "ns:nanoseconds;min:min minutes;h:h hours"),
    ("temperature", "K:k kelvin"),
    ("frequency", "Hz:hz hertz;kHz:khz"),
    ("mass", "kg:kg;g:g gram grams"),
    ("ratio", "%:% percent pct;1:1 - ratio"),
    ("raw", "1:count counts cnt ticks tick lsb raw adc digits bool bit bits"),
)
_KNOWN = {
    word: Unit(text, quantity)
    for quantity, entries in _TABLE
    for entry in entries.split(";")
    for text, _, words in [entry.partition(":")]
    for word in words.split(" ")
} | {
    "kgf": Unit("N", "force", scale="9.80665"),
    "gf": Unit("mN", "force", scale="9.80665"),
    "c": Unit("K", "temperature", offset="273.15 K"),
    "degc": Unit("K", "temperature", offset="273.15 K"),
    "celsius": Unit("K", "temperature", offset="273.15 K"),
    "\N{DEGREE SIGN}c": Unit("K", "temperature", offset="273.15 K"),
    "kgfcm": Unit("N*cm", "torque", scale="9.80665"),
    "kg*cm": Unit("N*cm", "torque", scale="9.80665"),
    "hpa": Unit("mbar", "pressure"),
    "psig": Unit("psi", "pressure", against="gauge"),
    "psia": Unit("psi", "pressure", against="abs"),
    "barg": Unit("bar", "pressure", against="gauge"),
    "bara": Unit("bar", "pressure", against="abs"),
    "kpag": Unit("kPa", "pressure", against="gauge"),
    "kpaa": Unit("kPa", "pressure", against="abs"),
}
_AGAINST = {
    "gauge": "gauge",
    "g": "gauge",
    "rel": "gauge",
    "relative": "gauge",
    "abs": "abs",
    "absolute": "abs",
    "a": "abs",
    "diff": "difference",
    "difference": "difference",
}


def unit_of(text: str) -> Unit | None:
    """The unit that a text is as a whole ('kPa gauge', 'rad_s', 'deg/s'); None where it is none."""
    plain = text.strip().strip("[](){}<>").strip()
    if not plain or len(plain) > 24:
        return None
    words = plain.replace("_", " ").split()
    if len(words) == 2 and words[1].lower() in _AGAINST:
        found = _single(words[0])
        if found is not None and found.quantity == "pressure":
            return found._replace(against=_AGAINST[words[1].lower()])
        return None
    return _single(plain.replace(" ", ""))


def _single(text: str) -> Unit | None:
    low = text.lower().replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")
    low = low.replace("\N{MIDDLE DOT}", "*").replace("^-1", "-1").replace("/sec", "/s")
    if low in _KNOWN:
        return _KNOWN[low]
    slashed = re.sub(r"[_ ]?per[_ ]?|_(?=s$|min$)", "/", low)
    return _KNOWN.get(slashed)


def against_of(words: list[str]) -> str:
    """What a pressure's name says that it is against: 'gauge', 'abs', 'difference', or nothing."""
    long_words = [word for word in words if len(word) > 1]
    return next((_AGAINST[word] for word in long_words if word in _AGAINST), "")
