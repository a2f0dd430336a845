"""Effects of the catalogue in the sensors."""

from epa_rt.models.catalogue_chain import THIRDS
from epa_rt.models.effect import Effect
from epa_rt.models.tables_load import CHANNELS, split

FACTS = "engineering estimate"
SENSORS = "Sensors"

# Typical error of the zero, per channel; of the scale it is half a percent everywhere.
ZERO = {
    "motor_angle_rad": 0.02, "motor_speed_rad_s": 1.0, "motor_current_a": 0.03, "motor_torque_nm": 1e-3,
    "muscle0_gauge_pa": 4e3, "muscle1_gauge_pa": 4e3, "supply_gauge_pa": 4e3, "force_n": 1.0,
    "joint_angle_rad": 8e-3, "joint_speed_rad_s": 0.01, "load_position_m": 5e-4,
}
SCALE = 0.005


def said(stem: str) -> str:
    """A channel for people: 'muscle0 pressure' of 'muscle0_gauge'."""
    return stem.replace("gauge", "pressure").replace("_", " ")


def _calibration() -> tuple[Effect, ...]:
    """Gain and offset of every channel."""
    found: list[Effect] = []
    for channel, _ in CHANNELS:
        stem, suffix = split(channel)
        zero = ZERO[channel]
        found += [
            Effect(f"{stem}_gain", f"{said(stem)} scale", "sensors", (f"sensors.{stem}_gain_ratio",),
                   ((1.0 + SCALE,), (1.0 - SCALE,)), f"the {said(stem)} reading is scaled", SENSORS, FACTS),
            Effect(f"{stem}_offset", f"{said(stem)} zero", "sensors", (f"sensors.{stem}_offset{suffix}",),
                   ((zero,), (-zero,)), f"the {said(stem)} reading is shifted", SENSORS, FACTS),
        ]
    return tuple(found)


SENSOR_EFFECTS: tuple[Effect, ...] = (
    Effect("encoder_eccentricity", "encoder eccentricity", "sensors",
           ("sensors.encoder_eccentricity_rad", "sensors.encoder_phase_rad"), tuple((1.9e-3, phase) for phase in THIRDS),
           "the motor encoder does not sit in its middle", SENSORS, FACTS),
    *_calibration(),
)
