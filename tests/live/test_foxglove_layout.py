"""The shipped layout for Foxglove names what the shipped rigs send."""

import json

from epa_rt.cli.inputs import load_inputs
from epa_rt.logs.schema import CYCLE, cycle_topics
from epa_rt.loop.assembly import assemble
from tests.cli.shell import EXPERIMENTS, RIGS, ROOT

LAYOUT = json.loads((ROOT / "config/foxglove_layout.json").read_text())
RIGS_SHOWN = (("identification_short", "bench"), ("knee_chirp_short", "knee"))
STATE_FIELDS = {"state", "phase"}


def _sent() -> set[str]:
    found = {f"/state.{name}" for name in STATE_FIELDS}
    for experiment, rig in RIGS_SHOWN:
        inputs = load_inputs(EXPERIMENTS / f"{experiment}.yaml", RIGS / f"{rig}.yaml", None, False)
        for topic in cycle_topics(assemble(inputs.rig, inputs.experiment).layout):
            found |= {f"{topic.name}.{field.name}" for field in topic.fields}
    return found


def test_each_path_of_the_layout_is_sent_by_a_shipped_rig():
    panels = LAYOUT["configById"]
    paths = {path["value"] for panel in panels.values() for path in panel.get("paths", ())}
    assert len(paths) > 20 and paths <= _sent()
    assert {f"{CYCLE}.lateness_ns", "/measured.knee_angle_rad"} <= paths
    services = [panel["serviceName"] for panel in panels.values() if "serviceName" in panel]
    assert services == ["stop", "mark"]
    for name in services:  # whoever has the layout has no token
        panel = next(p for p in panels.values() if p.get("serviceName") == name)
        assert json.loads(panel["requestPayload"])["token"] == ""


def test_each_panel_has_its_place_once():
    def places(node) -> list[str]:
        if isinstance(node, str):
            return [node]
        return places(node["first"]) + places(node["second"])

    assert sorted(places(LAYOUT["layout"])) == sorted(LAYOUT["configById"])
