"""A posterior's answer in words: one sentence that a person can act on."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from epa_rt.gap.diagnosis import Who
from epa_rt.gap.subject import CHANGED

Sets = Sequence[Sequence[str]]
SAYS_OF: Mapping[Who, str] = {
    "rig": "missing",
    "plant_file": "in the plant file, and not in the rig",
    "both": "in the plant file, at another strength than in the rig",
}


def plain(name: str) -> str:
    """'braid friction' of 'braid_friction'."""
    return name.replace("_", " ")


def all_of(words: Sequence[str], last: str = "and") -> str:
    """'a, b and c'."""
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def set_words(effects: Sequence[str]) -> str:
    """'gravity and delay'; what an empty set stands for."""
    if not effects:
        return "no effect: the plant file as refitted"
    return all_of([plain(name) for name in effects])


def sure_of(sets: Sets) -> tuple[str, ...]:
    """Names that every one of several sets has."""
    return tuple(name for name in sets[0] if all(name in one for one in sets))


def told_of_sets(sets: Sets, probability: Mapping[str, float], who: Mapping[str, Who]) -> str:
    """What is said of several sets, each of which may be the right one. ``probability``: of the
    names of the first; ``who`` has each.
    """
    sure = sure_of(sets)
    if not sure:
        first = all_of([f"{plain(name)} ({probability[name]:.2f})" for name in sets[0]])
        return f"these logs do not tell which: {first}; or {'; or '.join(map(set_words, sets[1:]))}"
    more = dict.fromkeys(plain(name) for one in sets for name in one if name not in sure)
    told = told_of_names({name: probability[name] for name in sure}, who, more=False)
    return f"{told}; whether {all_of(list(more), 'or')} is a cause besides, these logs do not tell"


def told_of_names(
    probability: Mapping[str, float],
    who: Mapping[str, Who],
    more: bool,
    instead: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> str:
    """What is said of the names, by ``who`` has each, and whether ``more`` is missing. A
    probability is that of the name's family; ``instead``: its laws that are probable as well.
    """
    told = []
    for has, says in SAYS_OF.items():
        names = [name for name in probability if who[name] == has]
        if names:
            laws = {
                name: all_of([plain(law) for law in (name, *instead.get(name, ()))], "or")
                for name in names
            }
            told.append(_told(laws, probability, says))
    return f"{'; '.join(told)}{', and something besides' if more else ''}"


def _told(laws: Mapping[str, str], probability: Mapping[str, float], says: str) -> str:
    """What ``says`` of names in words, but for numbers of the plant, which are never missing."""
    changed = [name for name in laws if name.endswith(CHANGED)]
    told = []
    for names, what in (
        ([name for name in laws if name not in changed], says),
        (changed, "not that of the healthy runs"),
    ):
        if names:
            words = {name: laws[name].removesuffix(plain(CHANGED)) for name in names}
            named = all_of([f"{words[name]} ({probability[name]:.2f})" for name in names])
            told.append(f"{named} {'are' if len(names) > 1 else 'is'} {what}")
    return "; ".join(told)
