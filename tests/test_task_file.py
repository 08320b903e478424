"""Task files: what they can say, what is assumed where they say nothing, and what is told of wrong ones."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from random import Random

import pytest
from click.testing import CliRunner

import book
from supremal import Alphabet, FormatError, is_same_language
from supremal.cli import main
from supremal.learning.schedules import Schedule
from supremal.learning.settings import Settings
from supremal.rules.patterns import PATTERNS
from supremal.task._automata import DRAWN
from supremal.task._environment import _BY_ID, _OF_PLANTS
from supremal.task._machine import _WAYS as _MACHINES
from supremal.task._rules import _ALWAYS, _WAYS
from supremal.task.experiment import supervise
from supremal.task.findings import study
from supremal.task.reading import _KEYS, read_task
from supremal.task.task import Options, Reported, Task

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "task-file.md"
EXAMPLES = sorted((ROOT / "examples").glob("*.toml"))
STARTER = ROOT / "src" / "supremal" / "task" / "starter.toml"
EVENTS = {"start": {"controllable": True}, "finish": {"controllable": False}}


def automaton(name: str, *rows: tuple[str, str, str]) -> dict[str, object]:
    return {
        "name": name,
        "events": ["start", "finish"],
        "states": ["0", "1"],
        "initial": "0",
        "marked": ["0"],
        "transitions": [list(row) for row in rows],
    }


PLANT = automaton("M", ("0", "start", "1"), ("1", "finish", "0"))
SPECS = [automaton("one", ("0", "start", "1")), automaton("none", ("0", "finish", "0"))]
MACHINE = {
    "name": "to the goal",
    "propositions": ["goal"],
    "initial": "u",
    "edges": [["u", "goal", "v", 1.0]],
}


def write_files(folder: Path) -> None:
    """Write the files that task files here speak of."""
    for name, document in {
        "both.json": {"events": EVENTS, "plants": [PLANT], "specs": SPECS},
        "specs.json": {"events": EVENTS, "plants": [], "specs": SPECS},
        "one.json": PLANT | {"events": EVENTS},
        "machine.json": MACHINE,
    }.items():
        (folder / name).write_text(json.dumps(document), encoding="utf-8")
    (folder / "broken.json").write_text('{"events":\n  {]}', encoding="utf-8")
    (folder / "machine.txt").write_text("0\n[1]\n(0,1,'goal',ConstantRewardFunction(1))\n", encoding="utf-8")
    (folder / "broken.txt").write_text("0\n[1]\n(0,1,'goal',Constant(1))\n", encoding="utf-8")


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Task]:
    """Read a task file of this text, beside the files that it may speak of."""
    write_files(tmp_path)

    def read_text(*parts: str) -> Task:
        path = tmp_path / "task.toml"
        path.write_text("\n".join(parts), encoding="utf-8")
        return read_task(path)

    return read_text


AB = '[events]\ncontrollable = ["a", "b"]\nuncontrollable = ["u"]'
FACTORY = '[events]\ncontrollable = ["start"]\nuncontrollable = ["finish"]'
LAKE = '[environment]\nid = "FrozenLake-v1"\nlabels = { goal = { tile = "G" }, hole = { tile = "H" } }'
LAMP = """
[[plant]]
name = "lamp"
transitions = '''
uncontrollable burn
marked off
off -on-> lit
lit -burn-> out
'''
"""


# --- what is told -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", book.named(book.table("bad_tasks")))
def test_what_is_told_of_wrong_files(
    case: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    Path("task.toml").write_text(case["text"], encoding="utf-8")
    with pytest.raises(FormatError) as caught:
        read_task("task.toml")
    assert str(caught.value) == case["says"]


@pytest.mark.parametrize(("path", "says"), [("no.toml", "No such file"), (".", "Is a directory")])
def test_files_that_cannot_be_read(path: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=f"cannot read it: {says}.*; give the path of a task file"):
        read_task(tmp_path / path)


# --- what is assumed --------------------------------------------------------------------------------------


def test_what_is_assumed(read: Callable[..., Task]) -> None:
    task = read(AB)
    assert task.name == "task"
    assert task.alphabet == Alphabet(("a", "b", "u"), frozenset("u"))
    assert (task.model, task.plants, task.environment, task.rules) == ("anything", (), None, ())
    assert (task.options, task.settings) == (Options(), Settings())
    assert (task.seed, task.seeds, task.interval, task.out) == (0, 1, 10_000, None)
    assert (task.title, task.source, task.reported, task.reward_machine) == ("", "", (), None)
    assert task.path.endswith("task.toml")


def test_all_that_is_said_of_learning(read: Callable[..., Task], tmp_path: Path) -> None:
    task = read(
        'name = "n"\ntitle = "t"\nsource = "s"',
        AB,
        '[learner]\nalgorithm = "q_learning"\nepisodes = 1_000\nepisode_steps = 10\nalpha = 1\ngamma = 0.5',
        "epsilon = 0.1\nepsilon_decay = 1.0\ndecay_every = 7",
        '[run]\nseed = 5\nseeds = 2\ninterval = 100\nout = "runs/here"',
        "[check]\nnonblocking = false\nmust_act = true\nmax_states = 1000",
        '[[reported]]\nwhat = "x"\nsaid = 3\nkey = "greedy.value"\nstyle = "count"',
        '[[reported]]\nwhat = "y"\nsaid = "all"\ncurve = "score"\nepisodes = 200',
    )
    assert (task.name, task.title, task.source) == ("n", "t", "s")
    assert task.settings == Settings(1_000, 10, 1.0, 0.5, 0.1, 1.0, 7)
    assert (task.seed, task.seeds, task.interval, task.out) == (5, 2, 100, tmp_path / "runs/here")
    assert task.options == Options(nonblocking=False, must_act=True, max_states=1000)
    assert task.reported == (
        Reported("x", 3.0, key="greedy.value", style="count"),
        Reported("y", "all", curve="score", episodes=200),
    )


def test_an_agent_has_to_act(read: Callable[..., Task]) -> None:
    assert read(LAKE).options.must_act
    assert not read(LAKE, "[check]\nmust_act = false").options.must_act


# --- plants and environments ------------------------------------------------------------------------------


def test_three_ways_to_write_a_plant(read: Callable[..., Task]) -> None:
    task = read(
        FACTORY,
        '[[plant]]\nname = "M"\ntransitions = [["0", "start", "1"], ["1", "finish", "0"]]\nmarked = ["0"]',
        '[[plant]]\ntransitions = """\nname N\nmarked 0\n0 -start-> 1\n1 -finish-> 0\n"""',
        '[[plant]]\nname = "O"\nfile = "one.json"',
        '[[plant]]\nname = "P"\nfile = "both.json"',
    )
    assert [plant.name for plant in task.plants] == ["M", "N", "O", "P"]
    assert task.model == "plants"
    for plant in task.plants:
        assert is_same_language(plant, task.plants[0])
        assert plant.marked.tolist() == [True, False]
        assert plant.alphabet.uncontrollable == {"finish"}


def test_names_and_events_of_plants_that_say_nothing(read: Callable[..., Task]) -> None:
    task = read(
        '[[plant]]\ntransitions = [["on", "a", "off"]]\ninitial = "off"',
        '[[plant]]\ntransitions = """\nuncontrollable u\nevents b\n0 -u-> 0\n"""',
    )
    assert [plant.name for plant in task.plants] == ["plant 1", "plant 2"]
    assert task.plants[0].state_names == ("off", "on")
    assert task.plants[0].marked.all()
    assert task.alphabet == Alphabet(("a", "b", "u"), frozenset("u"))
    assert task.plants[1].run(["b"]) == -1


def test_an_environment_of_plants(read: Callable[..., Task]) -> None:
    task = read(
        LAMP, "[environment]\nchances = { burn = 0.25 }", 'labels = { dark = { lamp = ["off", "out"] } }'
    )
    environment = task.environment
    assert environment is not None
    assert environment.propositions == ("dark",)
    assert environment.label.tolist() == [1, 0, 1]
    assert environment.marked.tolist() == [True, False, False]
    assert (task.model, task.alphabet.names) == ("plants", ("on", "burn"))


def test_an_environment_by_its_id(read: Callable[..., Task]) -> None:
    task = read(
        LAKE,
        'options = { is_slippery = false }\nevents = { splash = { tile = "H" } }',
        'actions = ["w", "s", "e", "n"]\nmarked = [15]',
    )
    environment = task.environment
    assert environment is not None
    assert task.model == "environment"
    assert task.alphabet == Alphabet(("w", "s", "e", "n", "splash"), frozenset({"splash"}))
    assert environment.propositions == ("goal", "hole")
    assert environment.prob.tolist() == [1.0] * len(environment.prob)


def test_an_environment_of_our_own(read: Callable[..., Task]) -> None:
    task = read(
        '[environment]\nid = "supremal/PickupDelivery-v0"\noptions = { preset = "published" }',
        '[[rule]]\npattern = "never_sequence"\nsequence = ["l", "l"]',
    )
    assert task.environment is not None
    assert "d_u" in task.alphabet.uncontrollable
    assert task.rules[0].automaton.alphabet == task.alphabet


def test_a_reward_machine_does_without_the_rewards_of_the_environment(read: Callable[..., Task]) -> None:
    grid = '[environment]\nid = "supremal/PickupDelivery-v0"\noptions = { preset = "published" }'
    own, other = read(grid), read(grid, '[reward_machine]\nedges = [["u", "S", "v", 1]]')
    assert own.environment is not None
    assert other.environment is not None
    assert own.environment.reward.any()
    assert not other.environment.reward.any()


def test_events_may_be_wider_than_the_environment(read: Callable[..., Task]) -> None:
    events = '[events]\ncontrollable = ["up", "down", "left", "right", "jump"]'
    assert read(events, LAKE).alphabet.names[-1] == "jump"


# --- rules ------------------------------------------------------------------------------------------------


def test_five_ways_to_write_a_rule(read: Callable[..., Task]) -> None:
    rows = [["0", "a", "1"], ["1", "b", "0"], ["0", "b", "0"], ["0", "u", "0"], ["1", "u", "1"]]
    task = read(
        AB,
        '[[rule]]\nname = "P"\npattern = "alternate_response"\ntrigger = "a"\nreaction = ["b"]',
        '[[rule]]\nname = "R"\nregex = "(b | u | a u* b)*"',
        '[[rule]]\nname = "L"\nltlf = "G (a -> X (!a U b))"',
        f'[[rule]]\nname = "A"\nmarked = ["0"]\ntransitions = {rows}',
        '[[rule]]\nsentence = "By turns."',
        'transitions = """\nmarked 0\n0 -a-> 1\n1 -b-> 0\n0 -b, u-> 0\n1 -u-> 1\n"""',
    )
    assert [rule.name for rule in task.rules] == ["P", "R", "L", "A", "rule 5"]
    assert [rule.form for rule in task.rules] == ["pattern", "regex", "ltlf", "automaton", "automaton"]
    for rule in task.rules:
        assert is_same_language(rule.automaton, task.rules[0].automaton)
        assert rule.automaton.name == rule.name
        assert rule.automaton.alphabet.uncontrollable == {"u"}
        assert rule.drawn is None
    assert task.rules[0].text == "alternate_response(trigger='a', reaction=['b'])"
    assert task.rules[2].text == "G (a -> X (!a U b))"
    assert all(rule.sentence for rule in task.rules[:3])
    assert (task.rules[3].sentence, task.rules[4].sentence) == ("", "By turns.")


def test_the_forms_of_the_paper(read: Callable[..., Task]) -> None:
    unsafe = 'form = "unsafe"\ntransitions = [["0", "a", "1"], ["1", "a", "2"]]\nmarked = ["2"]'
    task = read(
        AB,
        '[[rule]]\nname = "S"\nform = "safe"\ntransitions = [["0", "a", "1"], ["1", "b", "0"]]\nmarked = []',
        f'[[rule]]\nname = "U"\n{unsafe}',
        f'[[rule]]\nname = "V"\n{unsafe}\nover = ["b", "a"]',
    )
    safe, own, over = (rule.automaton for rule in task.rules)
    assert safe.marked.all()
    assert (safe.run(["a", "b", "a"]) >= 0, safe.run(["a", "a"])) == (True, -1)
    assert (own.alphabet.names, over.alphabet.names) == (("a",), ("a", "b"))
    assert (over.run(["a", "b", "a"]) >= 0, over.run(["b", "a", "a"])) == (True, -1)
    assert [rule.form for rule in task.rules] == ["safe", "unsafe", "unsafe"]
    drawn = [rule.drawn for rule in task.rules if rule.drawn is not None]
    assert [(one.name, one.n_states) for one in drawn] == [("S", 3), ("U", 3), ("V", 3)]


def test_rules_of_a_file(read: Callable[..., Task]) -> None:
    task = read(FACTORY, '[[rule]]\nfile = "both.json"', '[[rule]]\nname = "plain"\nfile = "one.json"')
    assert [rule.name for rule in task.rules] == ["one", "none", "plain"]


def test_what_a_rule_is_about(read: Callable[..., Task]) -> None:
    rule = '[[rule]]\npattern = "never_sequence"\nsequence = ["a", "a"]'
    every, few = read(AB, rule, f'{rule}\nover = ["b", "a"]').rules
    assert (every.automaton.alphabet.names, few.automaton.alphabet.names) == (("a", "b", "u"), ("a", "b"))


def test_no_argument_of_a_pattern_is_a_key_of_rules() -> None:
    for pattern in PATTERNS.values():
        assert not pattern.parameters.keys() & {*_WAYS, *_ALWAYS, *DRAWN, "form", "max_states"}


# --- reward machines --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "said",
    [
        'edges = [["u", "goal", "v", 1]]',
        'edges = [["u", "goal", "v", 1.0]]\ninitial = "u"\nname = "m"\npropositions = ["goal"]',
        'file = "machine.json"',
        'file = "machine.txt"',
    ],
)
def test_ways_to_write_a_reward_machine(said: str, read: Callable[..., Task]) -> None:
    task = read(LAKE, f"[reward_machine]\n{said}")
    machine = task.reward_machine
    assert machine is not None
    assert machine.propositions == ("goal",)
    after, reward = machine.step(0, {"goal"})
    assert (reward, machine.step(after, {"goal"})[1]) == (1.0, 0.0)


def test_a_rule_that_pays(read: Callable[..., Task]) -> None:
    rule = '[[rule]]\nname = "go up"\npattern = "at_least"\nof = "up"\ntimes = 2'
    task = read(LAKE, rule, '[reward_machine]\nrule = "go up"\nreward = 5')
    assert task.reward_machine is not None
    assert task.environment is not None
    assert task.environment.propositions == ("goal", "hole", "satisfied")
    assert task.reward_machine.step(0, {"satisfied"}) == (1, 5.0)


@pytest.mark.parametrize(("said", "gamma"), [("true", 0.5), ("0.25", 0.25), ("false", None)])
def test_shaping(said: str, gamma: float | None, read: Callable[..., Task]) -> None:
    edges = 'edges = [["u", "goal", "v", 0], ["v", "hole", "w", 8]]'
    task = read(LAKE, f"[reward_machine]\n{edges}\nshaping = {said}", "[learner]\ngamma = 0.5")
    assert task.environment is not None
    assert task.reward_machine is not None
    assert ("over" in task.environment.propositions) == (gamma is not None)
    assert task.reward_machine.step(0, {"goal"})[1] == task.reward_machine.step(0, set())[1] == 0.0
    assert (task.shaped is None) == (gamma is None)
    if task.shaped is not None and gamma is not None:
        first, second = gamma * 8, 8.0  # the machine's own values at that γ; the learner's is 0.5
        assert task.shaped.step(0, {"goal"})[1] == pytest.approx(0.5 * second - first)
        assert task.shaped.step(0, set())[1] == pytest.approx(0.5 * first - first)


# --- what is published ------------------------------------------------------------------------------------


def blocks() -> list[str]:
    pages = (PAGE, PAGE.parent / "rules.md", PAGE.parents[1] / "README.md")
    texts = (page.read_text(encoding="utf-8") for page in pages)
    return [
        block
        for text in texts
        for block in re.findall(r"^```toml\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    ]


@pytest.mark.parametrize("block", blocks(), ids=range(len(blocks())))
def test_published_files_are_read_as_they_stand(block: str, read: Callable[..., Task]) -> None:
    assert read(block).alphabet


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_read(path: Path) -> None:
    assert read_task(path).rules


def test_the_page_has_every_key_of_the_learner_with_what_it_is_left_out() -> None:
    rows = re.findall(r"^\| `(\w+)` \|.*\| `?([^`|]+?)`? \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    said = dict(rows)
    for one in fields(Settings):
        assert tomllib.loads(f"value = {said[one.name]}")["value"] == one.default


def test_the_page_has_every_key() -> None:
    page = PAGE.read_text(encoding="utf-8")
    keys = {*_WAYS, *_ALWAYS, *DRAWN, *_BY_ID, *_OF_PLANTS, *_MACHINES}.union(*_MACHINES.values())
    for key in [
        *keys,
        *(one.name for kind in (Settings, Schedule, Options, Reported) for one in fields(kind)),
    ]:
        assert f"`{key}`" in page, key
    for key in _KEYS:
        assert f"`{key}`" in page or f"## [{key}]" in page or f"## [[{key}]]" in page, key


# --- a file to start from ---------------------------------------------------------------------------------


def test_init_writes_a_file_that_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["init"])
    assert (result.exit_code, result.output.split(".")[0]) == (0, "Wrote task")
    again = CliRunner().invoke(main, ["init"])
    assert again.exit_code == 2
    assert again.output == "Error: task.toml exists already; give another name: supremal init other.toml\n"
    assert CliRunner().invoke(main, ["init", "no/other.toml"]).exit_code == 2
    task = read_task("task.toml")
    assert [rule.form for rule in task.rules] == ["pattern", "regex", "ltlf"]
    findings = study(task.plants, tuple(rule.automaton for rule in task.rules), task.options)
    assert findings.verdict == "enforceable_in_part"


def test_what_the_starter_leaves_to_be_used(read: Callable[..., Task]) -> None:
    text = STARTER.read_text(encoding="utf-8")
    task = read(re.sub(r"^#(?! |$)", "", text, flags=re.MULTILINE))
    assert task.reward_machine is not None
    assert (task.settings.episodes, task.seeds) == (20_000, 3)
    assert task.environment is not None
    model, enabled = supervise(task.environment, task)
    assert enabled[model.initial > 0].any()


def test_slips_of_one_table_are_told_together(read: Callable[..., Task]) -> None:
    with pytest.raises(FormatError) as caught:
        read("""
            [events]
            controllable = ["a"]
            [learner]
            alpah = 3
            gamma = "x"
            episodes = 0
            [[reported]]
            what = "verdict"
            said = 1
            key = "check.verdictt"
        """)
    first, *others = str(caught.value).splitlines()
    assert "5:13: learner.alpah: unknown key 'alpah'; did you mean 'alpha'?" in first
    assert [line.split(": ")[1] for line in others] == ["learner.gamma", "learner.episodes", "reported.1.key"]


def slips(read: Callable[..., Task], *parts: str) -> list[str]:
    """The line and the key of each slip that is told, and how it goes on."""
    with pytest.raises(FormatError) as caught:
        read(*parts)
    return [re.sub(r".*task\.toml:(\d+):\d+: ", r"\1 ", line) for line in str(caught.value).splitlines()]


SLIPPED = """
[[rule]]
pattern = "at_most"
of = "a"
times = "2"
[[rule]]
regex = "(a b"
"""


def test_unknown_keys_are_told_together_with_slips_in_rules(read: Callable[..., Task]) -> None:
    text = 'nam = "x"\ntitel = "y"', AB, SLIPPED, "[option]\nnonblocking = true"
    assert [line.split(":")[0] for line in slips(read, *text)] == [
        "1 nam",
        "2 titel",
        "10 rule.1.times",
        "12 rule.2.regex",
        "14 option",
    ]


def test_all_unknown_keys_of_a_table_are_told(read: Callable[..., Task]) -> None:
    rule = '[[rule]]\npattern = "absence"\nof = "a"\nnote = 1\nsentance = ""'
    found = slips(read, AB, rule, "[run]\nsede = 1\nseeds = 0")
    assert [line.split(":")[0] for line in found] == [
        "7 rule.1.note",
        "8 rule.1.sentance",
        "10 run.sede",
        "11 run.seeds",
    ]


@pytest.mark.parametrize("key", ["learner", "run", "check"])
def test_a_table_is_needed(key: str, read: Callable[..., Task]) -> None:
    assert slips(read, f"{key} = 3", AB) == [f"1 {key}: is 3; a table is needed"]


PLANTS = """
[[plant]]
transitions = [["0", "a"]]
[[plant]]
transitoins = []
"""


@pytest.mark.parametrize(("events", "more"), [(AB, ["16 rule.2.regex"]), ("\n\n", [])])
def test_slips_in_plants_hide_none_in_rules(events: str, more: list[str], read: Callable[..., Task]) -> None:
    """Without [events] the plants would have said which there are, so an expression cannot be read."""
    assert [line.split(":")[0] for line in slips(read, events, PLANTS, SLIPPED)] == [
        "6 plant.1.transitions",
        "8 plant.2.transitoins",
        "14 rule.1.times",
        *more,
    ]


def test_what_could_follow_from_a_slip_is_not_told(read: Callable[..., Task]) -> None:
    assert slips(read, AB.replace("events", "event"), '[[rule]]\npattern = "absence"\nof = "a"') == [
        "1 event: unknown key 'event'; did you mean 'events'?"
    ]


def test_patterns_that_are_called_alike_come_first(read: Callable[..., Task]) -> None:
    (said,) = slips(read, AB, '[[rule]]\npattern = "never"')
    assert said.startswith("5 rule.1.pattern: is 'never'; known: never_sequence, ")
    assert said.endswith(", ... (docs/rules.md has them all)")


# --- whatever is written ----------------------------------------------------------------------------------


def test_any_slip_is_told(read: Callable[..., Task]) -> None:
    """Task files with something cut out, put in, or exchanged: read or told, and never anything else."""
    random = Random(20)  # noqa: S311 - the same in every run
    texts = [
        *(case["text"] for case in book.table("bad_tasks")),
        *blocks(),
        STARTER.read_text(encoding="utf-8"),
    ]
    seeds = [text for text in texts if "id =" not in text]  # what Gymnasium makes takes its time
    tokens = [token for text in seeds for token in re.findall(r"\w+|\s+|[^\w\s]", text)]
    told = 0
    for _ in range(2_000):
        parts = re.findall(r"\w+|\s+|[^\w\s]", random.choice(seeds))
        for _ in range(random.randrange(1, 4)):
            at = random.randrange(len(parts) + 1)
            parts[at : at + random.randrange(3)] = random.choices(tokens, k=random.randrange(3))
        try:
            read("".join(parts))
        except FormatError as error:
            told += 1
            assert error.line > 0, "".join(parts)  # noqa: PT017
    assert told > 1_000
