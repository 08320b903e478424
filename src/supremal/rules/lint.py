r"""What is worth a second look: rules that contradict each other, never bite, or say nothing new.

All of these are questions about one language and one rule: does every word of L satisfy the rule K (L ⊆ K),
does none (L ∩ K = ∅), and after which words of L has it become impossible?  L is what can happen, or what
other rules allow.  As in the synchronous composition, events outside of an alphabet are free, so that rules
over different events compare: where K₁ and K₂ are over Σ₁ and Σ₂, "K₂ implies K₁" is P₂⁻¹(K₂) ⊆ P₁⁻¹(K₁).
The answers are read off the product of L's parts and the automaton of K, completed.

First each rule is cut down to its essence, the least automaton over the events that matter to it: a product
over 2,000 events then costs no more than one over the few that the rules tell apart from nothing.

What would take a product that is too large is left open, and said to be so: silence is an answer.

Source: Cassandras, Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., sections 2.2.3 and 2.3, for
completion and products; Beer, Ben-David, Eisner, Rodeh, "Efficient detection of vacuity in temporal model
checking", Formal Methods Syst. Des. 18 (2001), for why a rule that never bites deserves a word.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Final, get_args

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal.automata.alphabet import union
from supremal.automata.automaton import Automaton
from supremal.automata.compare import is_isomorphic, shortest_word
from supremal.automata.compose import components
from supremal.automata.reduce import add_trap, coreachable, mark_all, reachable
from supremal.errors import AutomatonError
from supremal.rules.about import classify, essence
from supremal.rules.finding import Finding, Kind, called, finding, listed
from supremal.rules.rule import Rule

MAX_STATES: Final = 200_000
"""The default bound on the states of a product."""

_CELLS: Final = 1 << 26
"""The most entries, states times events, of the table of a product: 256 MiB."""


def lint(
    rules: Sequence[Rule],
    plants: Sequence[Automaton] = (),
    *,
    nonblocking: bool = True,
    max_states: int = MAX_STATES,
) -> list[Finding]:
    r"""Return what is worth a second look about ``rules``: in themselves, together, and beside ``plants``.

    Parameters
    ----------
    rules
        What must not break.
    plants
        What can happen: the `sync` of these; none: anything.
    nonblocking
        Whether what is owed must stay possible; where not, what a rule owes has no force.
    max_states
        The most states of any product; and states times events stay below 2^26.

    Returns
    -------
    list of Finding
        In the order of their kinds:

        - *contradiction*: a rule that accepts no word, or a least set of rules that accept none together, or
          none that can happen;
        - *dead state*: the rule lets a word pass after which it can never be satisfied any more, in itself or
          by what can happen;
        - *no force*: a rule owes something, and nothing has to be completed;
        - *event in no plant*: an event matters to a rule, and no plant can ever do it;
        - *never bites*: nothing that can happen breaks the rule, and nothing complete leaves it unsatisfied;
        - *implied*: other rules say it already; if all that are reported so are left out, the rest says the
          same;
        - *left open*: too many states to say.

    Raises
    ------
    AlphabetError
        If an event is controllable (observable) in one rule or plant and not in another.

    Notes
    -----
    About n² products of two rules, n of all but one, and n of one with the plants.

    Examples
    --------
    >>> from supremal import from_text
    >>> once = Rule("once", from_text("0 -a-> 1"))
    >>> twice = Rule("twice", from_text("0 -a-> 1 \n 1 -a-> 2"))
    >>> for finding in lint([once, twice], [from_text("0 -a, b-> 1 \n 1 -b-> 0")]):
    ...     print(finding)
    rule 'twice' is implied by rule 'once'
    """
    lean = [replace(rule, automaton=essence(rule.automaton)) for rule in rules]
    sound = [rule for rule in lean if rule.automaton.n_states]
    found = [_accepts_nothing(rule) for rule in lean if rule not in sound]
    for rule in rules:
        found += _dead(rule)
    if not nonblocking:
        found += _without_force(sound)
    found += _clash(sound, (), max_states)
    found += _beside_plants(sound, plants, nonblocking=nonblocking, max_states=max_states)
    if plants and not any(each.kind == "contradiction" for each in found):
        found += _clash(sound, [mark_all(plant) for plant in plants], max_states)
    found += _implied([rule for rule in sound if len(rule.automaton.alphabet)], max_states)
    return sorted(found, key=lambda each: get_args(Kind).index(each.kind))


# --- each rule --------------------------------------------------------------------------------------------


def _accepts_nothing(rule: Rule) -> Finding:
    return finding("contradiction", [rule], f"{called([rule])} accepts no word at all")


def _dead(rule: Rule) -> Iterator[Finding]:
    """Find a word after which a rule, as it was given, can never be satisfied.

    That it is the empty word is said by `_accepts_nothing`.
    """
    automaton = rule.automaton
    word = shortest_word(automaton, ~coreachable(automaton))
    if word:
        state = automaton.state_name(automaton.run(word))
        text = (
            f"{called([rule])} lets {' '.join(word)} pass, and can never be satisfied after it: "
            f"from its state {state} no marked one can be reached"
        )
        yield finding("dead state", [rule], text, word)


def _without_force(rules: Iterable[Rule]) -> Iterator[Finding]:
    for rule in rules:
        kind = classify(rule.automaton)
        if kind != "safety":
            what = "it" if kind == "progress" else "that part of it"
            text = f"{called([rule])} owes something, but nothing has to be completed: {what} has no force"
            yield finding("no force", [rule], text)


def _beside_plants(
    rules: Sequence[Rule], plants: Sequence[Automaton], *, nonblocking: bool, max_states: int
) -> Iterator[Finding]:
    """Find what is odd about each rule where ``plants`` say what can happen."""
    product = _product(plants, max_states)
    if plants:
        yield from _unheard_of(rules, plants if product is None else [product[0]])
    if product is None:
        yield from _open("how what can happen bears on", rules)
        return
    for rule in rules:
        yield from _beside_world(rule, product[0], nonblocking=nonblocking, max_states=max_states)


def _unheard_of(rules: Sequence[Rule], plants: Sequence[Automaton]) -> Iterator[Finding]:
    """Find the events that matter to a rule and that no plant knows, or one that knows it can never do."""
    possible = {name for plant in plants for name in plant.alphabet}
    for plant in plants:
        never = ~(plant.delta[reachable(plant)] != NONE).any(axis=0)
        possible.difference_update(plant.alphabet.spell(np.flatnonzero(never).tolist()))
    for rule in rules:
        missing = [repr(name) for name in rule.automaton.alphabet if name not in possible]
        if missing:
            text = f"{called([rule])} speaks of {listed(missing)}, which can never happen"
            yield finding("event in no plant", [rule], text)


def _beside_world(rule: Rule, world: Automaton, *, nonblocking: bool, max_states: int) -> Iterator[Finding]:
    """Find what is odd about a rule where ``world`` is what can happen."""
    seen = _beside([world], rule.automaton, max_states)
    if seen is None:
        yield from _open("how what can happen bears on", [rule])
        return
    product, accepted, possible = seen
    if not accepted.any():
        text = f"{called([rule])} contradicts what can happen: no such word satisfies it"
        yield finding("contradiction", [rule], text)
        return
    bites = ~possible | (product.marked & ~accepted) if nonblocking else ~possible
    if not bites.any() and (nonblocking or classify(rule.automaton) != "progress"):
        or_owed = " or leaves it unsatisfied in the end" if nonblocking else ""
        text = f"{called([rule])} never bites: nothing that can happen breaks it{or_owed}"
        yield finding("never bites", [rule], text)
    lost = possible & ~coreachable(replace(product, marked=accepted))
    word = shortest_word(product, lost)
    if nonblocking and word:
        text = f"after {' '.join(word)}, nothing that can happen satisfies {called([rule])} any more"
        yield finding("dead state", [rule], text, word)


# --- rules together ---------------------------------------------------------------------------------------


def _clash(rules: Sequence[Rule], plants: Sequence[Automaton], max_states: int) -> Iterator[Finding]:
    """Find a least set of rules that accept no word together: none at all, or none of the ``plants``."""

    def clash(some: Sequence[Rule]) -> bool | None:
        parts = [*plants, *(rule.automaton for rule in some)]
        if all(part.marked[:1].any() for part in parts):  # the empty word will do: so of most rules
            return False
        product = _product(parts, max_states)
        return None if product is None else not product[0].marked.any()

    answer = clash(rules)
    if answer is None:
        yield from _open(f"whether any word{' that can happen' if plants else ''} satisfies all of", rules)
    elif answer:
        least = _least(rules, clash)
        what = "what can happen: no such word satisfies" if plants else "each other: no word satisfies"
        text = f"{called(least)} contradict {what} {'both' if len(least) == 2 else 'all of them'}"
        yield finding("contradiction", least, text)


def _implied(rules: Sequence[Rule], max_states: int) -> list[Finding]:
    """Find what others imply, the last rule first; it is left out of what may imply the next."""
    left, found, unsure = list(rules), list[Finding](), list[Rule]()
    for rule in reversed(rules):
        others = [other for other in left if other is not rule]
        implies = partial(_implies, rule.automaton, max_states)
        unknown = bool(unsure)  # after a product that was too large, that of all others is not tried again
        for some in (*([other] for other in others), *([] if unsure else [others])):
            answer = implies(some)
            if answer:
                left = others
                found.append(_said_by(rule, _least(some, implies)))
                break
            unknown |= answer is None
        else:
            if unknown:
                unsure.append(rule)
    return [*found[::-1], *_open("whether others imply", unsure[::-1])]


def _said_by(rule: Rule, others: Sequence[Rule]) -> Finding:
    """Say that the ``others`` imply one rule, or, of one other, that the two are the same."""
    if len(others) == 1 and is_isomorphic(rule.automaton, others[0].automaton):
        text = f"{called([rule])} says the same as {called(others)}"
    else:
        together = " together" if len(others) > 1 else ""
        text = f"{called([rule])} is implied by {called(others)}{together}"
    return finding("implied", [rule, *others], text)


def _implies(outer: Automaton, max_states: int, inner: Sequence[Rule]) -> bool | None:
    """Tell whether all rules ``inner`` together imply one, None where that takes too many states.

    Rules that accept no word together imply nothing here, though in logic they imply anything.
    """
    seen = _beside([rule.automaton for rule in inner], outer, max_states)
    if seen is None:
        return None
    product, accepted, _ = seen
    return bool(product.marked.any() and accepted[product.marked].all())


def _least(rules: Sequence[Rule], holds: Callable[[Sequence[Rule]], bool | None]) -> list[Rule]:
    """Leave out one rule after the other, as long as it still ``holds`` of the rest."""
    kept = list(rules)
    for rule in rules:
        fewer = [other for other in kept if other is not rule]
        if holds(fewer):
            kept = fewer
    return kept


# --- products ---------------------------------------------------------------------------------------------


def _product(parts: Sequence[Automaton], max_states: int) -> tuple[Automaton, Ints] | None:
    """Return what `components` does, None where it is too large."""
    events = len(union(*(part.alphabet for part in parts)))
    try:
        return components(*parts, max_states=min(max_states, _CELLS // max(events, 1)))
    except AutomatonError:
        return None


def _beside(
    parts: Sequence[Automaton], rule: Automaton, max_states: int
) -> tuple[Automaton, Bools, Bools] | None:
    """Return the words of ``parts``, marked as they are, and what ``rule``, their last part, says to them.

    Of each state of the product: whether the rule accepts the words that lead there, and whether it may still
    accept longer ones.  None where the product is too large.
    """
    found = _product([*parts, add_trap(mark_all(rule), marked=True)], max_states)
    if found is None:
        return None
    product, states = found
    return product, np.append(rule.marked, False)[states[:, -1]], states[:, -1] < rule.n_states


def _open(question: str, rules: Sequence[Rule]) -> Iterator[Finding]:
    """Leave a question about ``rules``, if there are any, open."""
    if rules:
        yield finding("left open", rules, f"too many states to say {question} {called(rules)}")
