"""Train agents that never break the rules, and know before training whether the rules can be kept.

Data walks up the stair once: text → `Automaton` → `sync` → `synthesize` → mask → product → plan or
learned policy → picture.  The rooms, from the ground up: ``automata`` (what can happen), ``rules`` (how
people say it), ``synthesis`` (what can be enforced), ``decisions`` (what each choice is worth), ``learning``
(how to learn it by trying), and the porch: ``envs``, ``formats``, ``show``, ``task`` and ``cli``.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from supremal import _notebook
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.boolean import difference, language_union, meet
from supremal.automata.build import from_table, from_text, from_transitions, universal
from supremal.automata.compare import (
    find_difference,
    find_not_included,
    is_included,
    is_isomorphic,
    is_same_language,
)
from supremal.automata.compose import sync
from supremal.automata.minimise import minimise
from supremal.automata.project import inverse_project, project, relabel
from supremal.automata.quotients import quotient, reverse_language, right_quotient, shuffle
from supremal.automata.reduce import complement, coreachable, mark_all, prefix_closure, reachable, trim
from supremal.automata.words import count_words, sample_word, shortest_words, words
from supremal.decisions.certificate import certify
from supremal.decisions.evaluation import Evaluation, evaluate
from supremal.decisions.horizon import HorizonPlan, finite_horizon
from supremal.decisions.mdp import Outcome, TabularMDP, from_outcomes
from supremal.decisions.optimum import Optimum, expected_steps, reach_probability, total_reward
from supremal.decisions.planning import Plan, value_iteration
from supremal.decisions.plant import observed_plant, plant_automaton
from supremal.decisions.plant_process import process_of, undisturbed
from supremal.decisions.policy_iteration import policy_iteration
from supremal.decisions.product import product
from supremal.decisions.reachability import prob0, prob1
from supremal.decisions.reward_machine import RewardMachine, reward_machine
from supremal.decisions.safety import find_dead_end, safe_actions
from supremal.decisions.shaping import label_end, label_with_rule, machine_from_rule, potentials, shaped
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
from supremal.learning.checkpoints import LearnerState, load_state, save_state
from supremal.learning.q_learning import QResult, q_learning, q_learning_seeds
from supremal.learning.schedules import Schedule
from supremal.learning.settings import Settings
from supremal.learning.statistics import bootstrap_interval, interquartile_mean, regret
from supremal.learning.tables import TableResult, table_learning
from supremal.rules import patterns
from supremal.rules.about import classify, events_that_matter, example_words
from supremal.rules.lint import lint
from supremal.rules.ltlf import rule_from_ltlf, sentence_of_ltlf
from supremal.rules.patterns import sentence_of
from supremal.rules.regex import rule_from_regex, sentence_of_regex
from supremal.rules.rule import Rule
from supremal.rules.sequences import (
    complete_factors,
    complete_safe,
    complete_unsafe,
    rule_from_safe,
    rule_from_unsafe,
)
from supremal.synthesis.explain import Disabled, explain_disabled
from supremal.synthesis.given_up import GivenUp, Guilty, find_guilty, given_up
from supremal.synthesis.infimal import infimal_controllable
from supremal.synthesis.modular import Modular, find_conflict, is_nonconflicting, synthesize_modular
from supremal.synthesis.normal import synthesize_normal
from supremal.synthesis.observation import (
    Confusion,
    find_abnormal,
    find_unobservable,
    is_normal,
    is_observable,
    observer,
)
from supremal.synthesis.reasons import Reason
from supremal.synthesis.reduction import localise, reduce_supervisor
from supremal.synthesis.supcon import synthesize
from supremal.synthesis.supervisor import Monitor, Supervisor
from supremal.synthesis.timed import synthesize_timed
from supremal.synthesis.verify import (
    Violation,
    find_blocking,
    find_uncontrollable,
    is_controllable,
    is_nonblocking,
)
from supremal.synthesis.witnesses import explain_blocking, explain_violation

if TYPE_CHECKING:
    from supremal.envs.supervised import SupervisedEnv
    from supremal.envs.supervised_vector import SupervisedVectorEnv
    from supremal.task.reading import read_task

__all__ = [
    "Alphabet",
    "AlphabetError",
    "Automaton",
    "AutomatonError",
    "Confusion",
    "ConvergenceError",
    "Disabled",
    "Evaluation",
    "FormatError",
    "GivenUp",
    "Guilty",
    "HorizonPlan",
    "LearnerState",
    "MDPError",
    "MissingDependencyError",
    "ModelError",
    "Modular",
    "Monitor",
    "Optimum",
    "Outcome",
    "Plan",
    "QResult",
    "Reason",
    "RewardMachine",
    "Rule",
    "RuleError",
    "Schedule",
    "Settings",
    "SupervisedEnv",
    "SupervisedVectorEnv",
    "Supervisor",
    "SupremalError",
    "TableResult",
    "TabularMDP",
    "Violation",
    "bootstrap_interval",
    "certify",
    "classify",
    "complement",
    "complete_factors",
    "complete_safe",
    "complete_unsafe",
    "coreachable",
    "count_words",
    "difference",
    "evaluate",
    "events_that_matter",
    "example_words",
    "expected_steps",
    "explain_blocking",
    "explain_disabled",
    "explain_violation",
    "find_abnormal",
    "find_blocking",
    "find_conflict",
    "find_dead_end",
    "find_difference",
    "find_guilty",
    "find_not_included",
    "find_uncontrollable",
    "find_unobservable",
    "finite_horizon",
    "from_outcomes",
    "from_table",
    "from_text",
    "from_transitions",
    "given_up",
    "infimal_controllable",
    "interquartile_mean",
    "inverse_project",
    "is_controllable",
    "is_included",
    "is_isomorphic",
    "is_nonblocking",
    "is_nonconflicting",
    "is_normal",
    "is_observable",
    "is_same_language",
    "label_end",
    "label_with_rule",
    "language_union",
    "lint",
    "load_state",
    "localise",
    "machine_from_rule",
    "mark_all",
    "meet",
    "minimise",
    "observed_plant",
    "observer",
    "patterns",
    "plant_automaton",
    "policy_iteration",
    "potentials",
    "prefix_closure",
    "prob0",
    "prob1",
    "process_of",
    "product",
    "project",
    "q_learning",
    "q_learning_seeds",
    "quotient",
    "reach_probability",
    "reachable",
    "read_task",
    "reduce_supervisor",
    "regret",
    "relabel",
    "reverse_language",
    "reward_machine",
    "right_quotient",
    "rule_from_ltlf",
    "rule_from_regex",
    "rule_from_safe",
    "rule_from_unsafe",
    "safe_actions",
    "sample_word",
    "save_state",
    "sentence_of",
    "sentence_of_ltlf",
    "sentence_of_regex",
    "shaped",
    "shortest_words",
    "shuffle",
    "sync",
    "synthesize",
    "synthesize_modular",
    "synthesize_normal",
    "synthesize_timed",
    "table_learning",
    "total_reward",
    "trim",
    "undisturbed",
    "universal",
    "value_iteration",
    "words",
]
__version__ = "0.1.0"

_LATE: Final = {  # what imports Gymnasium or the porch, and so comes when it is asked for
    "SupervisedEnv": "supremal.envs.supervised",
    "SupervisedVectorEnv": "supremal.envs.supervised_vector",
    "read_task": "supremal.task.reading",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401 - a class or a function
    if name not in _LATE:
        message = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(message)
    return globals().setdefault(name, getattr(import_module(_LATE[name]), name))


_notebook.attach()
