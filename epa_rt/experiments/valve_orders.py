"""What each muscle's valves are told by a phase, checked in the order of the run."""

from collections.abc import Mapping

from epa_rt.config.experiment import PhaseFile
from epa_rt.config.rig import Muscle, Rig
from epa_rt.experiments.experiment import ValveOrder
from epa_rt.experiments.reader import Reader


class OrderBook:
    """Knows which muscles may still be filling, and to which a pressure is set, while the phases
    are walked through.
    """

    def __init__(self, rig: Rig):
        self._muscles = {muscle.name: muscle for muscle in rig.muscles}
        self._atmosphere_pa = rig.atmosphere_pa
        self._unsettled: dict[str, str] = {}  # muscle -> the phase that set or vented it
        self._set: set[str] = set()

    def of(self, reader: Reader, phase: PhaseFile) -> tuple[ValveOrder, ...]:
        """The orders of the next phase; a muscle that it does not name is left as it is. Raises
        ConfigError.
        """
        muscles = self._muscles
        orders = {name: ValveOrder(name, "hold") for name in muscles} if phase.trial else {}
        for key in sorted(
            phase.valves, key=lambda key: key != "all"
        ):  # a muscle's own order goes before that for all
            if key != "all" and key not in muscles:
                raise reader.error(
                    ("valves", key),
                    f"the muscle '{key}'",
                    f"all or one of this rig's: {', '.join(muscles) or 'none'}",
                )
            action = phase.valves[key]
            word = action.word or "set"
            if phase.trial and word != "hold":
                raise reader.error(
                    ("valves", key),
                    f"'{word}' in a trial",
                    "hold: no valve switches during a trial",
                )
            for name in muscles if key == "all" else (key,):
                orders[name] = ValveOrder(
                    name, word, self._target(reader, key, action.set, muscles[name])
                )
        self._follow_setting(reader, phase, orders)
        self._follow_settling(reader, phase, orders)
        return tuple(orders.values())

    def _target(
        self, reader: Reader, key: str, written: str | None, muscle: Muscle
    ) -> float | None:
        if written is None:
            return None
        place, lowest, highest = ("valves", key, "set"), self._atmosphere_pa, muscle.pressure_max
        target_pa = reader.pressure(place, written)
        if not lowest <= target_pa < highest:
            raise reader.error(
                place,
                f"'{reader.text(place, written)}'",
                f"a pressure that the muscle {muscle.name} takes, {lowest / 1e3:g} to below"
                f" {highest / 1e3:g} kPa abs",
            )
        return target_pa

    def _follow_setting(
        self, reader: Reader, phase: PhaseFile, orders: Mapping[str, ValveOrder]
    ) -> None:
        for name, order in orders.items():
            if order.word == "hold_and_trim" and name not in self._set:
                raise reader.error(
                    ("valves", name if name in phase.valves else "all"),
                    f"'hold_and_trim' of the muscle {name}, to which no pressure is set",
                    "a phase before it with {set: PRESSURE}",
                )
            (self._set.add if order.word in ("set", "hold_and_trim") else self._set.discard)(name)

    def _follow_settling(
        self, reader: Reader, phase: PhaseFile, orders: Mapping[str, ValveOrder]
    ) -> None:
        if phase.trial and self._unsettled:
            name, before = next(iter(self._unsettled.items()))
            raise reader.error(
                ("trial",),
                f"a trial while '{before}' may still be setting the muscle {name}",
                "'until: valves_settled' before the trial",
            )
        self._unsettled.update(
            {name: phase.name for name, order in orders.items() if order.word in ("set", "vent")}
        )
        if any(until.valves_settled for until in phase.until):
            self._unsettled.clear()
