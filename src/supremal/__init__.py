"""Train agents that never break the rules, and know before training whether the rules can be kept.

Data walks up the stair once: text → `Automaton` → `sync` → `synthesize` → mask → product → plan or
learned policy → picture.  The rooms, from the ground up: ``automata`` (what can happen), ``rules`` (how
people say it), ``synthesis`` (what can be enforced), ``decisions`` (what each choice is worth), ``learning``
(how to learn it by trying), and the porch: ``envs``, ``formats``, ``show``, ``task`` and ``cli``.
"""

from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.build import from_table, from_text, from_transitions, universal
from supremal.automata.compare import find_difference, find_not_included, is_included, is_same_language
from supremal.automata.compose import sync
from supremal.automata.reduce import complement, coreachable, mark_all, prefix_closure, reachable, trim
from supremal.decisions.evaluation import Evaluation, evaluate
from supremal.decisions.mdp import Outcome, TabularMDP, from_outcomes
from supremal.decisions.planning import Plan, value_iteration
from supremal.decisions.plant import plant_automaton
from supremal.decisions.product import product
from supremal.decisions.reward_machine import RewardMachine, reward_machine
from supremal.decisions.safety import find_dead_end, safe_actions
from supremal.errors import (
    AlphabetError,
    AutomatonError,
    ConvergenceError,
    FormatError,
    MDPError,
    MissingDependencyError,
    ModelError,
    RuleError,
    SupremalError,
)
from supremal.learning.q_learning import QResult, Settings, q_learning, q_learning_seeds
from supremal.rules.sequences import (
    complete_factors,
    complete_safe,
    complete_unsafe,
    rule_from_safe,
    rule_from_unsafe,
)
from supremal.synthesis.supcon import synthesize
from supremal.synthesis.supervisor import Monitor, Supervisor
from supremal.synthesis.verify import (
    Violation,
    find_blocking,
    find_uncontrollable,
    is_controllable,
    is_nonblocking,
)

__all__ = [
    "Alphabet",
    "AlphabetError",
    "Automaton",
    "AutomatonError",
    "ConvergenceError",
    "Evaluation",
    "FormatError",
    "MDPError",
    "MissingDependencyError",
    "ModelError",
    "Monitor",
    "Outcome",
    "Plan",
    "QResult",
    "RewardMachine",
    "RuleError",
    "Settings",
    "Supervisor",
    "SupremalError",
    "TabularMDP",
    "Violation",
    "complement",
    "complete_factors",
    "complete_safe",
    "complete_unsafe",
    "coreachable",
    "evaluate",
    "find_blocking",
    "find_dead_end",
    "find_difference",
    "find_not_included",
    "find_uncontrollable",
    "from_outcomes",
    "from_table",
    "from_text",
    "from_transitions",
    "is_controllable",
    "is_included",
    "is_nonblocking",
    "is_same_language",
    "mark_all",
    "plant_automaton",
    "prefix_closure",
    "product",
    "q_learning",
    "q_learning_seeds",
    "reachable",
    "reward_machine",
    "rule_from_safe",
    "rule_from_unsafe",
    "safe_actions",
    "sync",
    "synthesize",
    "trim",
    "universal",
    "value_iteration",
]
__version__ = "0.1.0"
