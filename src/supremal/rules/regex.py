r"""Regular expressions over events: the words that are allowed, from beginning to end.

The grammar, loosest first; blanks separate names and mean nothing else::

    expression  :=  term ("|" term)*               one of them
    term        :=  sequence ("&" sequence)*       all of them at once
    sequence    :=  factor factor*                 one after the other
    factor      :=  "~" factor                     any word over the alphabet that does not match
                 |  atom (repeat)*
    repeat      :=  "*"  |  "+"  |  "?"  |  "{m}"  |  "{m,}"  |  "{m,n}"
    atom        :=  NAME                           this event
                 |  "."                            any event
                 |  "[" NAME NAME* "]"             one of these events
                 |  "[" "^" NAME NAME* "]"         any event but these
                 |  "(" expression ")"
                 |  "(" ")"                        the empty word

So ``a b* | c`` is ``(a (b*)) | c``, and ``~a* b`` is ``(~(a*)) b``.  A name of letters, digits and _ stands
as it is, any other in quotes: ``'a.b'`` is one event, ``a.b`` is three, the second of them any.

The automaton comes from derivatives, which complement, intersection and counts do not disturb: with ν(r) the
empty word where r matches it, and nothing where it does not,

    σ⁻¹(r s) = (σ⁻¹r) s | ν(r) σ⁻¹s        σ⁻¹(r{m,n}) = (σ⁻¹r) r{m-1,n-1}
    σ⁻¹(~r) = ~(σ⁻¹r)                      σ⁻¹(r & s) = σ⁻¹r & σ⁻¹s

Source: Brzozowski, "Derivatives of regular expressions", JACM 11 (1964); Owens, Reppy, Turon, "Regular-
expression derivatives re-examined", JFP 19 (2009).
"""

from __future__ import annotations

from typing import Final

from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.rules._arguments import check_alphabet
from supremal.rules._derive import MAX_STATES, Budget, derived, event_classes
from supremal.rules._regex_algebra import Algebra
from supremal.rules._regex_parser import Complement, Events, Join, Repeat, Step, parse
from supremal.rules._regex_sentence import MAX_STEPS, sentence

_STEPS_A_STATE: Final = 100
"""How many steps of unfolding each state may cost on average: a second in all, for the default bound."""


def rule_from_regex(
    text: str, alphabet: Alphabet, *, name: str = "", max_states: int = MAX_STATES
) -> Automaton:
    r"""Return the minimal partial automaton of the words that an expression matches as a whole.

    Parameters
    ----------
    text
        The expression; the module gives its grammar.
    alphabet
        All events of the rule; those that the text does not name are among ``.``, ``[^...]`` and ``~``.
    name
        What to call the rule.
    max_states
        The most states that the text may unfold to, before they are minimised.

    Returns
    -------
    Automaton
        Over the whole ``alphabet``, with the fewest states.  It breaks where no continuation matches, and is
        marked where what has happened matches.

    Raises
    ------
    FormatError
        If the text does not parse or names an unknown event; gives line and column.
    RuleError
        If it unfolds to more states, or takes more than 100 steps for each of ``max_states``; or if
        ``alphabet`` is none.

    Notes
    -----
    The states are derivatives, up to similarity: n + 1 where the text is a plain sequence of n events, up to
    2ⁿ with ``|`` and ``*``, and more with ``~`` and ``&``.  A count is one term, which is not written out.
    Each state is derived by each class of events that the text tells apart, so the size of the alphabet does
    not matter.

    Examples
    --------
    Each start is followed by a finish before the next, whatever happens in between:

    >>> from supremal import Alphabet
    >>> sigma = Alphabet(("start", "finish", "tick"))
    >>> rule = rule_from_regex("tick* (start tick* finish tick*)*", sigma)
    >>> rule.n_states, rule.accepts(["start", "tick", "finish"]), rule.run(["start", "start"])
    (2, True, -1)

    Not three ticks in a row, and never more than five events:

    >>> rule = rule_from_regex("~(.* tick{3} .*) & .{0,5}", sigma)
    >>> rule.accepts(["tick", "tick", "start"]), rule.run(["tick", "tick", "tick"])
    (True, -1)
    """
    check_alphabet(alphabet)
    program = parse(text, alphabet, path=name or "expression")
    sets = [frozenset(step.names) for step in program if isinstance(step, Events)]
    classes, first = event_classes(alphabet, sets)
    algebra = Algebra(len(first), Budget(max_states * _STEPS_A_STATE, name))
    number = dict(zip(alphabet, classes.tolist(), strict=True))
    return derived(
        _term(program, algebra, number),
        algebra.derivative,
        algebra.accepts_empty,
        alphabet=alphabet,
        classes=classes,
        name=name,
        max_states=max_states,
    )


def sentence_of_regex(text: str, alphabet: Alphabet) -> str:
    """Return what an expression says, in plain English.

    A long one is quoted instead: in words it would be harder to read.

    Raises
    ------
    FormatError
        If the text does not parse or names an unknown event.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> sentence_of_regex("(a b)* .?", Alphabet(("a", "b")))
    'The events are, from beginning to end: any number of times (a, then b), then at most one event.'
    """
    program = parse(text, alphabet, path="expression")
    if len(program) > MAX_STEPS:
        return f"The events match `{' '.join(text.split())}` from beginning to end."
    return f"The events are, from beginning to end: {sentence(program)}."


def _term(program: list[Step], algebra: Algebra, number: dict[str, int]) -> int:
    """Run a program on a stack of terms; ``number`` is the class of each event."""
    stack: list[int] = []
    for step in program:
        match step:
            case Events(names, others):
                stack.append(algebra.events({number[event] for event in names}, others=others))
            case Repeat(least, most):
                stack.append(algebra.repeat(stack.pop(), least, most))
            case Complement():
                stack.append(algebra.complement(stack.pop()))
            case Join(op, parts):
                cut = len(stack) - parts
                stack[cut:] = [algebra.join(op, stack[cut:])]
    return stack.pop()
