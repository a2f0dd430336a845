"""A rig of this house whose catalogue is its places: what each of them explains says where a gap
lies, whatever its law.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from epa_rt.gap.rig.house.doubt.bench import Doubted, doubted_residual
from epa_rt.gap.rig.house.doubt.places import (
    OFF,
    SIGN,
    also_moved,
    catalogue_of,
    knobs_of,
    shapes_of,
)
from epa_rt.gap.rig.house.evaluate import Bench
from epa_rt.gap.rig.house.prepared import Prepared
from epa_rt.gap.rig.house.residuals import at_rate
from epa_rt.gap.subject import Plain, Values

if TYPE_CHECKING:
    from epa_rt.gap.rig.house.subject import HouseSubject


class DoubtedSubject(Plain):
    """See gap/subject.py for what each method promises. ``prepared``: recording name to what
    ``subject`` has prepared.
    """

    def __init__(self, subject: "HouseSubject", prepared: Mapping[str, Prepared]) -> None:
        self._subject, self.name, self.rate_hz, self.links = (
            subject,
            subject.name,
            subject.rate_hz,
            subject.links,
        )
        self.nominal, self.without_stop = subject.nominal, subject.without_stop
        self.prepare, self.features, self.free_run, self.patched = (
            subject.prepare,
            subject.features,
            subject.free_run,
            subject.patched,
        )
        names = [link.name for link in subject.links]
        self._shapes = {
            name: _kept(shapes_of(Bench(one, subject.plant.params), names))
            for name, one in prepared.items()
        }
        own = knobs_of(
            {name: len(made) for name, made in next(iter(self._shapes.values())).items()}
        )
        self.knobs = dict(subject.knobs) | own
        self.catalogue = catalogue_of(own)
        also = also_moved(subject.plant.params)
        self._moved = {name: {*off.links, *also.get(name, ())} for name, off in OFF.items()}

    def touched(self, key: str) -> tuple[str, ...]:
        if SIGN not in key:
            return self._subject.touched(key)
        return tuple(
            link.name for link in self.links if link.name in self._moved[key.split(SIGN)[0]]
        )

    def residual(self, prepared: Prepared, values: Values, link: str) -> np.ndarray:
        plain = {key: value for key, value in values.items() if SIGN not in key}
        errors = self._errors(prepared.name, values)
        if not errors:
            return self._subject.residual(prepared, plain, link)
        return at_rate(
            doubted_residual(Doubted(prepared, self._subject.params(plain), errors), link),
            prepared.judged[link],
        )

    def _errors(self, recording: str, values: Values) -> dict[str, np.ndarray]:
        found: dict[str, np.ndarray] = {}
        for key, value in values.items():
            if SIGN in key and value != 0.0:
                name, k = key.split(SIGN)
                found[name] = found.get(name, 0.0) + value * self._shapes[recording][name][
                    int(k)
                ].astype(float)
        return found


def _kept(shapes: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """In half the room: a shape is known far worse than to seven digits. What is made of them is
    summed in full.
    """
    return {name: made.astype(np.float32) for name, made in shapes.items()}
