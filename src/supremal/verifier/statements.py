"""The ten statements that make a certificate valid, each checked by its definition, in exact fractions.

A certificate holds a decision process, rules, a reward machine, a set of states (s, q₁, …, qₙ, u) of their
product, and for each of them the enabled actions, the action of a policy, a rank and two bounds.  The
functions below yield, each for one statement, where it is false and what would be right.

By induction over time 3, 4 and 5 mean that no rule is ever broken, whatever happens, and 6 that an end or a
marked state stays within reach; 8 bounds the values, since the operators are monotone and contract by γ < 1.
Later statements rely on those before them, so the check ends with the first that is false.

A number means the shortest decimal of its double, 0.1 one tenth.  Decimals cannot always sum to 1: what is
read is weights, a probability is a weight over the sum of its weights, and that has to be 1 within 1e-9.

Source: McConnell, Mehlhorn, Näher, Schweitzer, "Certifying algorithms", Computer Science Review 5 (2011).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, Final

from .certificate import Certificate, Move
from .comparison import find_difference
from .reading import Failure, digest, exact, references
from .texts import NONE, TooLargeError

TOLERANCE: Final = Fraction(1, 10**9)
LOWER, UPPER = 4, 5  # where the bounds stand in the row of a state


# 1. Each automaton accepts exactly what its text says, and breaks where nothing can be accepted.
def _rules(c: Certificate) -> Iterator[Failure]:
    for rule in c.rules:
        try:
            problem = find_difference(rule)
        except TooLargeError as error:
            problem = str(error)
        if problem:
            yield f"rule {rule['name']!r}", problem


# 2. The probabilities of an action are above 0 and sum to 1, as do those of the start.
def _probabilities(c: Certificate) -> Iterator[Failure]:
    rows = [("initial", [weight for _, weight in c.document["initial"]])]
    for s, (*_, choices) in enumerate(c.environment):
        rows += [(f"environment state {s}, action {a}", [o[0] for o in outcomes]) for a, outcomes in choices]
    for where, weights in rows:
        if min(weights, default=0) <= 0 or abs(sum(map(exact, weights), Fraction(0)) - 1) > TOLERANCE:
            yield where, f"{weights}; numbers above 0 that sum to 1 are needed"


# 3. Where the process starts, with rules and machine in their first states, is among the states.
def _start(c: Certificate) -> Iterator[Failure]:
    for at, _ in c.starts:
        if at not in c.number:
            yield "initial", f"{[*at]} is not among the states"


# 4. Enabled actions are feasible, and who is not at an end has one.
def _actions(c: Certificate) -> Iterator[Failure]:
    for i, (at, enabled, *_) in enumerate(c.states):
        if c.ended[i] == bool(enabled):
            right = "none is needed, for the episode has ended" if enabled else "one is needed"
            yield f"state {i}", f"enabled are {enabled}; {right}"
        for a in sorted({*enabled} - {a for a, _ in c.environment[at[0]][3]}):
            yield f"state {i}", f"{c.document['actions'][a]!r} is not feasible there"


# 5. Each outcome of an enabled action keeps every rule and leads to a state; at an end nothing is owed.
def _closed(c: Certificate) -> Iterator[Failure]:
    for i, choices in enumerate(c.moves):
        for name in c.owed[i] if c.nonblocking and c.ended[i] else ():
            yield f"state {i}", f"the episode has ended and rule {name!r} is not satisfied"
        for a, moves in choices.items():
            yield from ((c.action(i, a), move.problem) for move in moves if move.problem)


# 6. A state of rank 0 is an end or marked, any other has an enabled action with an outcome of less.
def _ranks(c: Certificate) -> Iterator[Failure]:
    for i, (at, _, _, rank, *_) in enumerate(c.states if c.nonblocking else ()):
        goal = c.ended[i] or (c.environment[at[0]][1] and not c.owed[i])
        ahead = [c.states[move.target][3] for moves in c.moves[i].values() for move in moves]
        if rank < 0 or (rank == 0 and not goal):
            yield f"state {i}", f"has rank {rank}; 0 is for an end or a marked state, others have more"
        elif rank > 0 and min(ahead, default=rank) >= rank:
            yield f"state {i}", f"has rank {rank}, and no enabled action can lead to a lower one"


# 7. The policy takes an enabled action wherever there is one.
def _policy(c: Certificate) -> Iterator[Failure]:
    for i, (_, enabled, chosen, *_) in enumerate(c.states):
        right = [NONE] if c.ended[i] else enabled
        if chosen not in right:
            yield f"state {i}", f"takes {chosen}; one of {right} is needed"


# 8. lower ≤ E[r + γ lower'] for the policy's action, upper ≥ E[r + γ upper'] for all; 0 at an end.
def _bounds(c: Certificate) -> Iterator[Failure]:
    gamma = exact(c.document["gamma"])
    if not 0 <= gamma < 1:
        yield "gamma", f"is {c.document['gamma']}; a number from 0 up to, not including, 1 is needed"
    lower, upper = ([exact(row[bound]) for row in c.states] for bound in (LOWER, UPPER))
    next_lower, next_upper = ([gamma * value for value in values] for values in (lower, upper))

    def expected(moves: list[Move], discounted: list[Fraction]) -> Fraction:
        return _mean([(move.weight, move.reward + discounted[move.target]) for move in moves])

    for i, (_, _, chosen, *_) in enumerate(c.states):
        if c.ended[i] and (lower[i] or upper[i]):
            yield f"state {i}", "the episode has ended; both bounds have to be 0"
        for a, moves in c.moves[i].items():
            if upper[i] < (most := expected(moves, next_upper)):
                yield c.action(i, a), f"upper is {_near(upper[i])}; at least {_near(most)} is needed"
            if a == chosen and lower[i] > (least := expected(moves, next_lower)):
                yield c.action(i, a), f"lower is {_near(lower[i])}; at most {_near(least)} is needed"


# 9. The numbers that are claimed follow from the bounds at the start, and the words from the numbers.
def _claims(c: Certificate) -> Iterator[Failure]:
    said = c.document["claims"]
    least, most = (
        _mean([(weight, exact(c.states[c.number[at]][bound])) for at, weight in c.starts])
        for bound in (LOWER, UPPER)
    )
    low, high, gap = (exact(said[key]) for key in ("value_at_least", "optimum_at_most", "gap_at_most"))
    if low > least:
        yield "value_at_least", f"is {_near(low)}; at most {_near(least)} follows"
    if high < most:
        yield "optimum_at_most", f"is {_near(high)}; at least {_near(most)} follows"
    if gap < high - low:
        yield "gap_at_most", f"is {_near(gap)}; at least {_near(high - low)} follows"
    if said["words"] != claims_in_words(c.document):
        yield "words", f"they should be {claims_in_words(c.document)}"


# 10. The SHA-256 of the content is the one that is given.
def _hash(c: Certificate) -> Iterator[Failure]:
    found = digest(c.document)
    if found != c.document["sha256"]:
        yield "sha256", f"the content has {found}; it has been changed after it was signed"


def _mean(pairs: Sequence[tuple[Fraction, Fraction]]) -> Fraction:
    """Return the mean of weighted values."""
    if len(pairs) == 1:
        return pairs[0][1]
    worth = sum((weight * value for weight, value in pairs), Fraction(0))
    return worth / sum((weight for weight, _ in pairs), Fraction(0))


def _near(number: Fraction) -> str:
    """Return about ``number``, as messages show it."""
    try:
        return repr(float(number))
    except OverflowError:
        return "a number beyond all doubles"


_ALL: Final = (_rules, _probabilities, _start, _actions, _closed, _ranks, _policy, _bounds, _claims, _hash)
STATEMENTS: Final = {check.__name__.strip("_"): check for check in _ALL}


def find_false(document: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Return the first statement that is false: its name, where, and what is wrong and would be right.

    The document has to be of the right shape.  Before all else its ``references`` are looked up.
    """
    found = [("references", *failure) for failure in references(document)]
    if not found:
        certificate = Certificate(document)
        for name, statement in STATEMENTS.items():
            if found := [(name, *failure) for failure in statement(certificate)]:
                break
    return found


def claims_in_words(document: Mapping[str, Any]) -> list[str]:
    """Return what a certificate claims, as sentences."""
    claims, gamma = document["claims"], document["gamma"]
    names = ", ".join(rule["name"] for rule in document["rules"]) or "there is none"
    words = [
        f"As long as only enabled actions are taken, no rule is ever broken, whatever happens: {names}.",
        "There is always an enabled action until the episode ends.",
        f"From the start the policy is worth at least {claims['value_at_least']}, discounted by {gamma}.",
        f"Nothing that takes enabled actions only is worth more than {claims['optimum_at_most']}.",
        f"So the policy is at most {claims['gap_at_most']} below the best.",
    ]
    if document["nonblocking"]:
        words.insert(
            2, "An end or a marked state stays within reach, and where an episode ends nothing is owed."
        )
    return words
