"""Effects of the catalogue in the sensors."""

from epa_rt.models.catalogue_chain import THIRDS
from epa_rt.models.effect import Effect
from epa_rt.models.tables_load import CHANNELS, split

FACTS = "engineering estimate"
SENSORS = "Sensors"

# Typical error of the zero, per channel; of the scale it is half a percent everywhere.
ZERO = {
    "motor_angle_rad": 0.02,
    "motor_speed_rad_s": 1.0,
    "motor_current_a": 0.03,
    "motor_torque_nm": 1e-3,
    "muscle0_gauge_pa": 4e3,
    "muscle1_gauge_pa": 4e3,
    "supply_gauge_pa": 4e3,
    "force_n": 1.0,
    "joint_angle_rad": 8e-3,
    "joint_speed_rad_s": 0.03,
    "load_position_m": 5e-4,
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
        if (
            channel != "motor_torque_nm"
        ):  # what a drive was set up with is a nominal parameter of its own
            found.append(
                Effect(
                    f"{stem}_gain",
                    f"{said(stem)} scale",
                    "sensors",
                    (f"sensors.{stem}_gain_ratio",),
                    ((1.0 + SCALE,), (1.0 - SCALE,)),
                    f"the {said(stem)} reading is scaled",
                    SENSORS,
                    FACTS,
                )
            )
        found.append(
            Effect(
                f"{stem}_offset",
                f"{said(stem)} zero",
                "sensors",
                (f"sensors.{stem}_offset{suffix}",),
                ((zero,), (-zero,)),
                f"the {said(stem)} reading is shifted",
                SENSORS,
                FACTS,
            )
        )
    return tuple(found)


def _curves() -> tuple[Effect, ...]:
    """Warming and bent characteristics of the channels that have them."""
    found: list[Effect] = []
    for stem, drift, warm_up, bow in (
        ("muscle0_gauge", ("_pa", 6e3), "gauge", ("_per_pa", 8e-9)),
        ("muscle1_gauge", ("_pa", 6e3), "gauge", ("_per_pa", 8e-9)),
        ("force", ("_n", 2.0), "force", ("_per_n", 2e-5)),
    ):
        found += [
            Effect(
                f"{stem}_drift",
                f"{said(stem)} zero",
                "sensors",
                (f"sensors.{stem}_drift{drift[0]}", f"sensors.{warm_up}_warm_up_s"),
                tuple(
                    (sign * drift[1], time_s) for time_s in (300.0, 40.0) for sign in (1.0, -1.0)
                ),
                f"the {said(stem)} reading shifts as its sensor warms up",
                SENSORS,
                FACTS,
            ),
            Effect(
                f"{stem}_bow",
                f"{said(stem)} scale",
                "sensors",
                (f"sensors.{stem}_bow{bow[0]}",),
                ((bow[1],), (-bow[1],)),
                f"the {said(stem)} reading is bent",
                SENSORS,
                FACTS,
            ),
        ]
    return tuple(found)


SENSOR_EFFECTS: tuple[Effect, ...] = (
    Effect(
        "encoder_eccentricity",
        "encoder eccentricity",
        "sensors",
        (
            "sensors.encoder_eccentricity_rad",
            "sensors.encoder_phase_rad",
            "sensors.encoder_twice_sine_ratio",
            "sensors.encoder_twice_cosine_ratio",
        ),
        tuple((1.9e-3, phase, 0.0, 0.0) for phase in THIRDS),
        "the motor encoder does not sit in its middle",
        SENSORS,
        FACTS,
    ),
    *_calibration(),
    *_curves(),
    Effect(
        "gauge_skew",
        "pressure timing",
        "sensors",
        ("sensors.gauge_skew_s",),
        ((5e-3,), (1.5e-3,)),
        "pressures are read late",
        SENSORS,
        FACTS,
    ),
    Effect(
        "gauge_lag",
        "pressure timing",
        "sensors",
        ("sensors.gauge_lag_s",),
        ((0.01,), (0.03,)),
        "the pressure readings come through a slow tube or filter",
        SENSORS,
        FACTS,
    ),
    Effect(
        "force_skew",
        "force timing",
        "sensors",
        ("sensors.force_skew_s",),
        ((5e-3,), (1.5e-3,)),
        "the force is read late",
        SENSORS,
        FACTS,
    ),
    Effect(
        "force_lag",
        "force timing",
        "sensors",
        ("sensors.force_lag_s",),
        ((5e-3,), (1.5e-3,)),
        "the load cell follows slowly",
        SENSORS,
        FACTS,
    ),
    Effect(
        "encoder_skew",
        "encoder timing",
        "sensors",
        ("sensors.encoder_skew_s",),
        ((5e-3,), (1.5e-3,)),
        "the motor's angle and speed are read late",
        SENSORS,
        FACTS,
    ),
    Effect(
        "joint_skew",
        "joint sensor timing",
        "sensors",
        ("sensors.joint_skew_s",),
        ((5e-3,), (1.5e-3,)),
        "the joint's angle and speed are read late",
        SENSORS,
        FACTS,
    ),
    Effect(
        "frame_mode",
        "frame",
        "sensors",
        ("sensors.frame_mode_ratio", "sensors.frame_hz", "sensors.frame_damping_ratio"),
        ((1.0, 20.0, 0.05), (1.0, 10.0, 0.05), (1.0, 35.0, 0.05)),
        "the frame swings under the force",
        SENSORS,
        FACTS,
    ),
    Effect(
        "force_crosstalk",
        "force crosstalk",
        "sensors",
        ("sensors.force_crosstalk_n_pa",),
        ((3e-6,), (-3e-6,)),
        "pressure shows in the force reading",
        SENSORS,
        FACTS,
    ),
    Effect(
        "gauge_crosstalk",
        "pressure crosstalk",
        "sensors",
        ("sensors.gauge_crosstalk_pa_n",),
        ((15.0,), (-15.0,)),
        "force shows in the pressure reading",
        SENSORS,
        FACTS,
    ),
)
