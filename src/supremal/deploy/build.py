"""From plants and rules to a controller: one table, or one for each rule where that would be too large.

One table is the supremal supervisor, and enforces all that is asked.  One table a rule is what
`synthesize_modular` makes of plants and rules: it keeps every rule, and never forbids what nobody controls.
Whether all tables together are nonblocking has to be looked up in their product; where that is too large,
nobody knows, and the controller says so.  Where it is proved they are the supremal supervisor again.  That a
choice is always left is proved for one table only.

Source: de Queiroz, Cury, "Modular supervisory control of large scale discrete event systems", WODES 2000.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from itertools import islice
from typing import Final

import numpy as np

from supremal._arrays import NONE
from supremal.automata.alphabet import union
from supremal.automata.automaton import Automaton
from supremal.automata.compose import sync
from supremal.deploy.controller import Component, Controller, Why
from supremal.deploy.vectors import make_vectors
from supremal.errors import AlphabetError, AutomatonError, ModelError
from supremal.formats import documents
from supremal.formats._names import unique
from supremal.formats.model import Model
from supremal.synthesis.causes import find_causes, named, supervisor_of
from supremal.synthesis.explain import disabled_in
from supremal.synthesis.modular import synthesize_modular
from supremal.synthesis.reasons import Reason
from supremal.synthesis.supervisor import Supervisor
from supremal.synthesis.verify import find_blocking

MAX_STATES: Final = 100_000
"""The most states of a product, if nothing else is said."""
EXPLAINED: Final = 20_000
"""The most disabled events of a table that are explained, those after the shortest words."""


def make_controller(
    plants: Sequence[Automaton],
    rules: Sequence[Automaton],
    *,
    name: str = "supervisor",
    nonblocking: bool = True,
    must_act: bool = False,
    modular: bool = False,
    max_states: int = MAX_STATES,
) -> Controller:
    r"""Return the supervisor of ``rules`` for ``plants`` as a controller, with reasons and tests.

    Parameters
    ----------
    plants
        What can happen.
    rules
        What may happen; all have to hold.
    name
        What the controller is called.
    nonblocking, must_act
        As `synthesize` takes them.
    modular
        Whether there is one table a rule; it is so in any case where one table would be too large.
    max_states
        The most states of a product; one of more is not built.

    Raises
    ------
    AlphabetError
        If an event is controllable in one part and not in another, or one cannot be observed.
    AutomatonError
        If the product of a single rule and its plants is too large as well.
    ModelError
        If there are no events.

    Notes
    -----
    A synthesis, or two for each rule; then a reason for each disabled event, up to 20,000 a table.

    Examples
    --------
    >>> from supremal import from_text
    >>> machine = "marked idle \n uncontrollable end{0} \n idle -start{0}-> busy \n busy -end{0}-> idle"
    >>> buffer = "name buffer \n uncontrollable end1 \n empty -end1-> full \n full -start2-> empty"
    >>> found = make_controller([from_text(machine.format(k)) for k in (1, 2)], [from_text(buffer)])
    >>> found.n_states, found.nonblocking, found.reasons[1].rules, found.reasons[1].through
    (6, True, ('buffer',), ('end1',))
    """
    plants, rules = named(plants, "plant"), named(rules, "rule")
    sigma = union(*(part.alphabet for part in (*plants, *rules)))
    if not sigma.names:
        message = f"controller {name!r}: there are no events; give plants or rules that have some"
        raise ModelError(message)
    for event in sorted(sigma.unobservable):
        message = f"event {event!r} cannot be observed, and a controller follows every event; leave it out"
        raise AlphabetError(message)
    draft = Controller(
        name=name,
        alphabet=sigma,
        components=(),
        reasons=(),
        model=hash_model(plants, rules, nonblocking=nonblocking, must_act=must_act),
        asked=(nonblocking, must_act),
        nonblocking=None,
        acts=None,
    )
    found = None if modular else _in_one(draft, plants, rules, max_states)
    made = _in_several(draft, plants, rules, max_states) if found is None else found
    if made.is_empty:
        return made
    judged = _judged(made, max_states)
    return replace(judged, vectors=make_vectors(judged))


def hash_model(
    plants: Sequence[Automaton], rules: Sequence[Automaton], *, nonblocking: bool, must_act: bool
) -> str:
    """Return the SHA-256 of a model as supremal's own JSON writes it, and a line with the options."""
    options = json.dumps({"must_act": must_act, "nonblocking": nonblocking})
    text = documents.write(Model(tuple(plants), tuple(rules))) + options + "\n"
    return sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def _in_one(
    draft: Controller, plants: Sequence[Automaton], rules: Sequence[Automaton], max_states: int
) -> Controller | None:
    """Return the controller of one table, None where it is too large."""
    try:
        component, reasons = _component(draft, draft.name, plants, rules, {}, max_states)
    except AutomatonError:
        return None
    acts = True if draft.asked[1] else None
    return replace(draft, components=(component,), reasons=tuple(reasons), acts=acts)


def _in_several(
    draft: Controller, plants: Sequence[Automaton], rules: Sequence[Automaton], max_states: int
) -> Controller:
    """Return the controller of one table a rule, and one for each plant that no rule looks at."""
    groups = synthesize_modular(plants, rules, nonblocking=False, max_states=max_states).groups
    local = replace(
        draft, asked=(draft.asked[0], False)
    )  # a rule that sees some plants knows not all choices
    reasons: dict[Why, int] = {}
    components = []
    for rule, group in zip(rules, groups, strict=True):
        seen = [plants[k] for k in group]
        component, reasons = _component(local, rule.name, seen, [rule], reasons, max_states)
        components.append(component)
    looked_at = {k for group in groups for k in group}
    components += [_free(plant) for k, plant in enumerate(plants) if k not in looked_at]
    return replace(draft, components=tuple(components), reasons=tuple(reasons))


def _judged(made: Controller, max_states: int) -> Controller:
    """Say whether the components together are nonblocking, as far as their product fits."""
    try:
        together = sync(*(c.supervisor.automaton for c in made.components), max_states=max_states)
    except AutomatonError:
        return made
    word = find_blocking(together)
    return replace(made, nonblocking=word is None, blocked_after=word)


def _component(
    draft: Controller,
    name: str,
    plants: Sequence[Automaton],
    rules: Sequence[Automaton],
    reasons: dict[Why, int],
    max_states: int,
) -> tuple[Component, dict[Why, int]]:
    """Return the supremal supervisor as a table, and the reasons with those that it adds, in order."""
    nonblocking, must_act = draft.asked
    causes = find_causes(plants, rules, nonblocking=nonblocking, must_act=must_act, max_states=max_states)
    supervisor, state = supervisor_of(causes)
    disabled = disabled_in(causes, supervisor, state)
    known = dict(reasons)
    numbers = [known.setdefault(_why(reason, draft), len(known)) for reason in islice(disabled, EXPLAINED)]
    numbers += [NONE] * (len(disabled) - len(numbers))
    rows = np.column_stack([disabled.pairs, np.array(numbers, np.int64)])
    return Component(name, _with_names(supervisor, [*plants, *rules]), rows), known


def _why(reason: Reason, draft: Controller) -> Why:
    """Return what of a reason does not depend on the way to the state."""
    free = draft.alphabet.uncontrollable
    through = [step.event for step in reason.steps if step.how == "uncontrollable"]
    through += [b.event for b in reason.breaks if b.event in free and b.event != reason.event]
    return Why(
        reason.kind,
        tuple(dict.fromkeys(b.rule for b in reason.breaks)),
        tuple(dict.fromkeys(through)),
        str(replace(reason, word=())),
    )


def _with_names(supervisor: Supervisor, parts: Sequence[Automaton]) -> Supervisor:
    """Return ``supervisor`` with states named by those of the parts."""
    names = unique(
        ", ".join(part.state_name(q) for part, q in zip(parts, row, strict=True))
        for row in supervisor.automaton.origin.tolist()
    )
    return replace(supervisor, automaton=replace(supervisor.automaton, state_names=tuple(names)))


def _free(plant: Automaton) -> Component:
    """Return a plant as a table that forbids nothing, and knows what is possible."""
    everything = np.ones(plant.delta.shape, np.bool_)
    own = replace(plant, origin=np.empty((0, 0), np.int32))
    supervisor = Supervisor(own, own.origin, everything)
    return Component(plant.name, _with_names(supervisor, [own]), np.empty((0, 3), np.int64))
