"""What an answer says of one of the effects that it names."""

from types import SimpleNamespace

import numpy as np

from epa_rt.gap import named as naming


def test_what_is_named_itself_is_no_rival_of_another_name(monkeypatch):
    """A late encoder beside a late command was said not to be told from it, though both are
    named.
    """
    for name, says in (
        ("numbers", ()),
        ("shares", {"encoder_skew": 0.6}),
        ("who_has", ()),
        ("_came_near", ()),
    ):
        monkeypatch.setattr(naming, name, lambda *_, says=says: says)
    effects = {
        name: SimpleNamespace(name=name, family=name, block="bus")
        for name in ("encoder_skew", "transport_delay", "force_skew")
    }
    role = SimpleNamespace(
        best=SimpleNamespace(effect="encoder_skew"), gains=np.array([[50.0, 25.0]])
    )
    alike = tuple(SimpleNamespace(effect=name) for name in effects)

    def rivals(*named):
        selection = SimpleNamespace(final=SimpleNamespace(effects=named), roles=(role,))
        found = SimpleNamespace(
            problem=SimpleNamespace(effects=effects),
            selection=selection,
            become=[frozenset({"force_skew", "force_lag"})],
            sets=[alike],
        )
        answer = naming.named(found, 0, 1.0)
        assert answer.in_more_numbers == ("force_lag", "force_skew")
        return answer.not_separable_from

    assert rivals("transport_delay", "encoder_skew") == ("force_skew",)
    assert rivals("encoder_skew") == ("transport_delay", "force_skew")
