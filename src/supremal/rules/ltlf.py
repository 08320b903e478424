r"""Linear temporal logic on finite words: what is so at every moment, sooner or later, until something.

A word w of n events satisfies a formula iff the formula holds at its first moment, i = 0.  Exactly one event
happens at each moment i < n.  The empty word, n = 0, is a word like any other: no event happens in it.

================  ======================================================================================
``a``             i < n and w[i] = a; a name that is not of letters, digits and _ stands in quotes
``[a b]``         one of these events
``true  false``   always, never
``!φ``            φ does not hold: in the empty word ``!a`` does
``X φ``           next: i+1 < n, and φ holds at i+1
``N φ``           weak next, also ``WX``: i+1 >= n, or φ holds at i+1
``F φ``           sooner or later: φ holds at some j, i <= j < n
``G φ``           from now on: φ holds at all of these j
``φ U ψ``         until: ψ holds at some j, i <= j < n, and φ at i, ..., j-1
``φ W ψ``         weak until: φ U ψ or G φ
``φ R ψ``         release: ψ holds up to and including the first moment of φ, or for ever: !(!φ U !ψ)
``φ M ψ``         strong release: ψ U (φ & ψ)
``Y φ``           yesterday: 0 < i < n, and φ holds at i-1
``Z φ``           weak yesterday: !Y !φ
``O φ  H φ``      once, historically: φ holds at some j, at all j, 0 <= j <= i < n
``φ S ψ``         since: ψ holds at some j, 0 <= j <= i < n, and φ at j+1, ..., i
``φ B ψ``         weak since ("back to"): φ S ψ or H φ
``φ T ψ``         triggered, the dual of S: !(!φ S !ψ)
``F[<=k] φ``      the same with j <= i+k, or j >= i-k where it looks back; so for F G U W R M, O H S B T
================  ======================================================================================

How tightly they bind, loosest first: ``<->``, ``->``, ``|``, ``&``, then U W R M S B T, then ``!`` and the
others with one part.  So ``G a -> F b & c U d`` is ``(G a) -> ((F b) & (c U d))``; ``|`` and ``&`` take any
number of parts, and the others in the middle group to the right.  Words and signs may be mixed: ``not ~ ¬``,
``and && ∧``, ``or || ∨``, ``=> →``, ``<=> ↔``.  An event that is named like an operator has to be quoted,
``G !"F"``, except in ``[F U]``.  What looks back may not contain what looks ahead.  ``N false`` holds at the
last moment, ``Z false`` at the first.

The automaton comes from progression, which is the derivative of formulas: see
`supremal.rules._ltlf_progression`.  A bound k costs k states, and no nested X.

Source: De Giacomo, Vardi, "Linear temporal logic and linear dynamic logic on finite traces", IJCAI 2013;
Lichtenstein, Pnueli, Zuck, "The glory of the past", Logics of Programs 1985, for what looks back; Koymans,
"Specifying real-time properties with metric temporal logic", Real-Time Systems 2 (1990), for bounds.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.rules._arguments import check_alphabet
from supremal.rules._derive import MAX_STATES, Budget, event_classes
from supremal.rules._ltlf_automaton import Unfolding
from supremal.rules._ltlf_formulas import Formulas
from supremal.rules._ltlf_parser import parse
from supremal.rules._ltlf_sentence import MAX_SIZE, sentence

_STEPS_A_STATE: Final = 80
"""How many steps of unfolding each state may cost on average: a second in all, for the default bound."""

_FEW_STATES: Final = 1_000
"""For how many states there are steps in any case."""


def rule_from_ltlf(
    text: str, alphabet: Alphabet, *, name: str = "", max_states: int = MAX_STATES
) -> Automaton:
    r"""Return the minimal partial automaton of the words that satisfy a formula.

    Parameters
    ----------
    text
        The formula; the module gives its grammar and its meaning.
    alphabet
        All events of the rule, also those that the text does not name.
    name
        What to call the rule.
    max_states
        The most states that the text may unfold to, before they are minimised.

    Returns
    -------
    Automaton
        Over the whole ``alphabet``, with the fewest states.  It breaks where no continuation satisfies the
        formula, and is marked where what has happened satisfies it.

    Raises
    ------
    FormatError
        If the text does not parse, names an unknown event, or looks ahead inside what looks back; gives line
        and column.
    RuleError
        If it unfolds to more states, or takes more than 80 steps for each of ``max_states``, which is about
        a second for the default; or if ``alphabet`` is none.

    Notes
    -----
    In general the states are doubly exponential in what is nested, and multiply over the parts of a
    conjunction.  What has to happen within k costs k states, however often it is asked for; X nested k deep
    under G costs 2ᵏ.  Each state is derived by each class of events that the text tells apart, so the size of
    the alphabet does not matter.

    Examples
    --------
    A picked item is delivered within 5 events, and nothing is delivered that was not picked:

    >>> from supremal import Alphabet
    >>> sigma = Alphabet(("pick", "deliver", "move"))
    >>> rule = rule_from_ltlf("G (pick -> F[<=5] deliver) & G (deliver -> O pick)", sigma)
    >>> rule.accepts(["pick", "move", "deliver"]), rule.run(["move", "deliver"])
    (True, -1)
    >>> rule.run(["pick", *["move"] * 5])
    -1
    """
    check_alphabet(alphabet)
    core = Formulas()
    formula = core.of_tree(parse(text, alphabet, path=name or "formula"))
    classes, events = event_classes(alphabet, [node.events for node in core.nodes if node.op == "event"])
    budget = Budget(max(max_states, _FEW_STATES) * _STEPS_A_STATE, name)
    unfolding = Unfolding(core, events, budget, max_states)
    least = unfolding.automaton(formula)
    return replace(least, alphabet=alphabet, delta=least.delta[:, classes], name=name)


def sentence_of_ltlf(text: str) -> str:
    """Return what a formula says, in plain English.

    A long one is quoted instead: in words it would be harder to read.

    Raises
    ------
    FormatError
        If the text does not parse.

    Examples
    --------
    >>> sentence_of_ltlf("G (p1 -> F[<=5] d1)")
    'At every moment: if p1 happens, then d1 happens within the next 5 events.'
    """
    tree = parse(text)
    return (
        sentence(tree) if len(tree.walk()) <= MAX_SIZE else f"Every run satisfies `{' '.join(text.split())}`."
    )
