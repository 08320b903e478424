"""Decision processes as files: read back, by ourselves and by umbi, and computed with by Storm."""

import gzip
import io
import json
import lzma
import re
import tarfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from processes import random_process, random_rule, wild_process
from supremal import (
    Alphabet,
    FormatError,
    MDPError,
    evaluate,
    from_outcomes,
    product,
    safe_actions,
    value_iteration,
)
from supremal.cli.export_model import model_command
from supremal.decisions.product import broken_states
from supremal.formats import _umb_reader
from supremal.formats._explicit import lay_out, merged
from supremal.formats.processes import PROCESS_FORMATS, find_process_ending, read_process, write_process

ENDINGS = sorted(PROCESS_FORMATS)
GAMMA = 0.9
COIN = from_outcomes(
    [
        (0, "toss", 0, 0.25, ("tails",), -1.0),
        (0, "toss", 0, 0.25, ("edge", "tails"), -3.0),
        (0, "toss", 1, 0.5, ("heads",), -1.0),
        (0, "turn over", 1, 1.0, ("turn",), -4.0),
    ],
    alphabet=Alphabet(("turn", "heads", "tails", "edge"), frozenset({"heads", "tails", "edge"})),
    terminal=[1],
    labels={0: ["up", "goal"], 1: ["two words"]},
)


def supervised(seed):
    """Return a product with a rule and its supervisor, where there is one."""
    mdp = product(wild_process(seed), [random_rule(seed, owing=0.3)])
    enabled = safe_actions(mdp)
    return mdp, enabled, bool((enabled.any(axis=1) | mdp.terminal)[mdp.initial > 0].all())


def choices_of(mdp):
    """Return the outcomes of every action of states that do not end, as text that can be compared."""
    found = {}
    for s, a in np.argwhere(mdp.feasible & ~mdp.terminal[:, None]).tolist():
        at = mdp.outcomes(s, a)
        columns = (mdp.next_state[at], mdp.prob[at], mdp.reward[at], map(mdp.spell, mdp.word[at]))
        found[s, mdp.actions[a]] = list(zip(*columns, strict=True))
    return found


def labels_of(mdp):
    return {name: np.flatnonzero(mdp.label >> i & 1).tolist() for i, name in enumerate(mdp.propositions)}


# --- by ourselves -----------------------------------------------------------------------------------------


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000))
def test_umb_holds_a_process_whole(tmp_path_factory, seed):
    path = tmp_path_factory.mktemp("umb") / "p.umb"
    mdp = product(random_process(seed, silent=True), [random_rule(seed)])
    write_process(path, mdp)
    back = read_process(path)
    assert choices_of(back) == choices_of(mdp)
    assert labels_of(back) == labels_of(mdp)
    for name in ("terminal", "marked", "initial", "origin"):
        assert np.array_equal(getattr(back, name), getattr(mdp, name)), name
    assert np.array_equal(
        safe_actions(back), safe_actions(mdp)[:, [mdp.actions.index(a) for a in back.actions]]
    )


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), ending=st.sampled_from([".drn", ".tra"]))
def test_text_holds_all_but_words(tmp_path_factory, seed, ending):
    path = tmp_path_factory.mktemp("text") / f"p{ending}"
    mdp = random_process(seed)
    write_process(path, mdp)
    back, model = read_process(path), merged(lay_out(mdp, None, None))
    assert labels_of(back) == labels_of(mdp)
    for name in ("terminal", "marked", "initial"):
        assert np.array_equal(getattr(back, name), getattr(mdp, name)), name
    kept = np.repeat(~mdp.terminal[model.state_of], np.diff(model.branch))
    assert back.next_state.tolist() == model.target[kept].tolist()
    assert back.prob.tolist() == model.prob[kept].tolist()
    if ending == ".tra":
        assert back.reward.tolist() == model.reward[kept].tolist()
    gap = value_iteration(back, gamma=GAMMA).value - value_iteration(mdp, gamma=GAMMA).value
    assert np.abs(gap).max() < 1e-8


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), ending=st.sampled_from(ENDINGS))
def test_supervised_process_is_written_with_its_sinks(tmp_path_factory, seed, ending):
    mdp, enabled, alive = supervised(seed)
    path = tmp_path_factory.mktemp("rules") / f"p{ending}"
    if not alive:
        with pytest.raises(MDPError, match="the mask leaves no action"):
            write_process(path, mdp, enabled=enabled)
        return
    write_process(path, mdp, enabled=enabled)
    back = read_process(path)
    several = int((mdp.initial > 0).sum() > 1)
    assert back.n_states == mdp.n_states + several
    assert np.array_equal(broken_states(back)[: mdp.n_states], broken_states(mdp))
    acting = (back.feasible & ~back.terminal[:, None]).sum(axis=1)[: mdp.n_states]
    assert acting.tolist() == enabled.sum(axis=1).tolist()


@pytest.mark.parametrize("ending", ENDINGS)
def test_names_survive_that_the_format_cannot_take(tmp_path, ending):
    odd = replace(
        COIN, actions=('a "quoted" ä\n[1]', ""), propositions=("init", "{two\twords"), label=np.array([1, 2])
    )
    write_process(tmp_path / f"p{ending}", odd)
    back = read_process(tmp_path / f"p{ending}")
    assert labels_of(back) == {"init_2": [0], "{two\twords": [1]}
    assert back.actions == ('a "quoted" ä\n[1]', "step")


@pytest.mark.parametrize("ending", ENDINGS)
def test_policy_is_written_as_a_chain(tmp_path, ending):
    write_process(tmp_path / f"p{ending}", COIN, policy=np.array([[0.5, 0.5], [0.0, 0.0]]))
    back = read_process(tmp_path / f"p{ending}")
    assert back.actions == ("step",)
    mine = evaluate(COIN, np.array([[0.5, 0.5], [0.0, 0.0]]), gamma=GAMMA)
    assert evaluate(back, np.zeros(2, int), gamma=GAMMA).value == pytest.approx(mine.value, abs=1e-12)


def test_policy_that_breaks_off_is_refused(tmp_path):
    for policy in (np.array([-1, 0]), np.array([[0.5, 0.4], [0.0, 0.0]])):
        with pytest.raises(MDPError, match="at the start the policy does not give"):
            write_process(tmp_path / "p.drn", COIN, policy=policy)
    with pytest.raises(MDPError, match=r"shape \(3,\); int \(2,\) or float \(2, 2\) is needed"):
        write_process(tmp_path / "p.drn", COIN, policy=np.zeros(3, int))
    with pytest.raises(MDPError, match="at the start"):
        write_process(
            tmp_path / "p.drn",
            COIN,
            enabled=np.array([[True, False], [False, False]]),
            policy=np.ones(2, int),
        )
    assert list(tmp_path.iterdir()) == []


def test_files_are_replaced_on_demand_only(tmp_path):
    (tmp_path / "p.lab").write_text("mine")
    with pytest.raises(FormatError, match=r"p\.lab: the file exists already; .* --force"):
        write_process(tmp_path / "p.tra", COIN)
    assert [file.name for file in tmp_path.iterdir()] == ["p.lab"]
    write_process(tmp_path / "p.tra", COIN, force=True)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["p.lab", "p.sta", "p.tra", "p.trew"]


def test_half_a_character_leaves_nothing_behind(tmp_path):
    for ending in ENDINGS:
        with pytest.raises(FormatError, match="half a character"):
            write_process(tmp_path / f"p{ending}", replace(COIN, actions=("\ud800", "b")))
    assert list(tmp_path.iterdir()) == []


def test_lines_may_end_as_windows_has_it(tmp_path):
    for ending in (".drn", ".tra"):
        write_process(tmp_path / f"p{ending}", COIN)
    for file in tmp_path.iterdir():
        file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
    for ending in (".drn", ".tra"):
        found = labels_of(read_process(tmp_path / f"p{ending}"))
        assert found == {"up": [0], "goal_2": [0], "two words": [1]}


def test_ending_may_be_large(tmp_path):
    write_process(tmp_path / "P.UMB", COIN)
    assert choices_of(read_process(tmp_path / "P.UMB")) == choices_of(COIN)


def test_ending_has_to_be_known():
    with pytest.raises(
        FormatError, match=r"p\.prism: '\.prism' is no ending of .*; known: \.umb, \.drn, \.tra"
    ):
        find_process_ending("p.prism")
    with pytest.raises(FormatError, match="the file has no ending"):
        find_process_ending("p")


def test_writing_is_the_same_every_time(tmp_path):
    for name in "ab":
        write_process(tmp_path / f"{name}.umb", COIN)
    assert (tmp_path / "a.umb").read_bytes() == (tmp_path / "b.umb").read_bytes()


# --- what others write ------------------------------------------------------------------------------------

DRN = """// written by hand
@type: MDP
@value_type: rational
@parameters

@reward_models
cost
@nr_states
3
@nr_choices
4
@model
state 0 [1] init "two words"
//[x=1]
\taction __NOLABEL__ [2]
\t\t0 : 1/3
\t\t1 : 2/3
\taction __NOLABEL__ [0.5]
\t\t2 : 1
state 1 [0]
\taction go [0]
\t\t1 : 1
state 2
\taction go
\t\t0 : 0.333333
\t\t1 : 0.666666
"""


def test_drn_of_storm(tmp_path):
    (tmp_path / "p.drn").write_text(DRN)
    back = read_process(tmp_path / "p.drn")
    assert back.actions == ("step", "go", "step_2")
    assert back.terminal.tolist() == back.marked.tolist() == [False, True, False]
    assert back.reward.tolist() == [3.0, 3.0, 1.5, 0.0, 0.0]
    assert back.prob[-2:].sum() == pytest.approx(1, abs=1e-15)
    assert labels_of(back) == {"two words": [0]}


TRA = "3 4 5\n0 1 2 1\n0 0 1 0.5 go\n0 0 0 0.5 go\n1 0 1 1\n2 0 2 1.0\n"


def test_files_of_prism(tmp_path):
    (tmp_path / "p.tra").write_text(TRA)
    (tmp_path / "p.trew").write_text("# rewards\n3 4 1\n0 0 1 2.5\n")
    (tmp_path / "p.srew").write_text("3 1\n2 1.0\n")
    back = read_process(tmp_path / "p.tra")
    assert back.actions == ("go", "step")
    assert back.initial.tolist() == [1, 0, 0]
    assert back.terminal.tolist() == [False, True, False]
    assert back.reward.tolist() == [2.5, 0.0, 0.0, 1.0]


BAD_DRN = [
    ("@type: MDP", "@type: CTMC", r":2:8: the model is of type 'CTMC'; MDP and DTMC are read"),
    ("@type: MDP\n", "", r": the header has no @type"),
    ("@type: MDP", "@type: MDP\n@type: MDP", r":3:1: @type stands twice"),
    ("@parameters\n\n", "@parameters\np q\n", r":5:1: the model has parameters"),
    ("cost", "cost time", r":7:1: the file has several rewards"),
    ("@model", "@modle", r":12:1: '@modle' is no line of the header"),
    ("@nr_states\n3", "@nr_states\nx", r":9:1: the number of states is 'x'"),
    ("@nr_choices\n4", "@nr_choices\n5", r":11:1: @nr_choices is '5', and there are 4 actions"),
    ("state 1 [0]", "state 2 [0]", r":20:1: state 2 stands where state 1 is due"),
    ("state 1 [0]", "state 1 [x]", r":20:10: a reward is 'x'; a finite number like 0.5 or 1/2 is needed"),
    ("0 : 1/3", "0 : 1/0", r":16:7: a probability is '1/0'"),
    ("0 : 1/3", "9 : 1/3", r":16:3: state 9 is none of the 3 states"),
    ("0 : 1/3", "0 : 3/2", r":16:7: a probability is '3/2'; a number above 0, up to 1"),
    ("0 : 1/3", "0 : 1/4", r": the probabilities of action 'step' in state 0 sum to 0.9166"),
    ("0 : 1/3", "0 ; 1/3", r":16:1: '0 ; 1/3' is no state, action or branch"),
    ("\taction go [0]\n", "", r":21:1: a branch stands where an action is due"),
    ("\t\t2 : 1\n", "", r":19:1: state 1 stands where a branch is due"),
    (" init", "", r": 0 states have the label 'init'"),
    (
        "state 2\n\taction go\n\t\t0 : 0.333333\n\t\t1 : 0.666666\n",
        "",
        r": the file ends where state 2 is due",
    ),
    ("action go\n", "action go [nan]\n", r":24:13: a reward is 'nan'"),
]


@pytest.mark.parametrize(("old", "new", "message"), BAD_DRN, ids=lambda text: text[:20].strip())
def test_bad_drn_is_told_with_its_place(tmp_path, old, new, message):
    assert old in DRN
    (tmp_path / "p.drn").write_text(DRN.replace(old, new, 1))
    with pytest.raises((FormatError, MDPError), match=r"p\.drn" + message):
        read_process(tmp_path / "p.drn")


BAD_PRISM = [
    ("tra", "3 4 5", "3 4 6", r":1:1: the file has 3 4 5 states, choices and branches"),
    ("tra", "3 4 5", "3", r": the first line has to be the numbers"),
    ("tra", "2 0 2 1.0\n", "", r": state 2 has no choice"),
    ("tra", "0 1 2 1", "0 2 2 1", r":2:1: the one before choice 2 of state 0 is missing"),
    ("tra", "0 0 0 0.5 go", "0 0 1 0.5 go", r":4:1: choice 0 of state 0 leads to state 1 twice"),
    ("tra", "1 0 1 1", "1 0 1", r":5:1: '1 0 1' is no line with state, choice, target and number"),
    ("tra", "1 0 1 1", "1 0 3 1", r":5:1: '1 0 3 1' has a state above the last, 2"),
    ("lab", "1", "9", r":2:4: label 9 is none of the first line"),
    ("lab", "0: 0", "0 0", r":2:1: '0 0 1' is no line like '0: 1 2'"),
    ("lab", '"b"', "b", r":1:10: '1=b' is no label of its own"),
    ("trew", "0 0 1 2.5", "0 0 1", r":2:1: '0 0 1' is no line with state"),
    ("srew", "2 1.0", "2 inf", r":2:3: a reward is 'inf'"),
]


@pytest.mark.parametrize(("ending", "old", "new", "message"), BAD_PRISM)
def test_bad_prism_is_told_with_its_place(tmp_path, ending, old, new, message):
    files = {
        "tra": TRA,
        "lab": '0="init" 1="b"\n0: 0 1\n',
        "trew": "3 4 1\n0 0 1 2.5\n",
        "srew": "3 1\n2 1.0\n",
    }
    assert old in files[ending]
    where = files[ending].rfind(old) if ending == "lab" and old == "1" else files[ending].find(old)
    files[ending] = files[ending][:where] + new + files[ending][where + len(old) :]
    for name, text in files.items():
        (tmp_path / f"p.{name}").write_text(text)
    with pytest.raises(FormatError, match=rf"p\.{ending}" + message):
        read_process(tmp_path / "p.tra")


def archive(path, change):
    """Write COIN to ``path`` with the files of the archive changed."""
    write_process(path, COIN, force=True)
    files = _umb_reader._files(path.read_bytes())
    index = json.loads(files["index.json"])
    change(files, index)
    files["index.json"] = json.dumps(index).encode()
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w") as tar:
        for name, content in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(content)
            tar.addfile(info, io.BytesIO(content))
    path.write_bytes(stream.getvalue())


BAD_UMB = [
    (lambda _, i: i.update({"format-version": 2}), "format-version is 2; versions up to 1 are read"),
    (lambda _, i: i.pop("transition-system"), "index.json has null for 'transition-system'"),
    (lambda _, i: i["transition-system"].update({"#states": 1.5}), "index.json has 1.5 for '#states'"),
    (lambda _, i: i["transition-system"].update({"#states": 0}), "no state"),
    (lambda _, i: i["transition-system"].update({"#players": 2}), "another time, players"),
    (lambda _, i: i["transition-system"].pop("branch-probability-type"), "double is needed"),
    (lambda _, i: i["transition-system"].update({"#branches": 10**30}), "has to rise from 0 to 1,000"),
    (lambda _, i: i["annotations"].update({"aps": [1]}), "the annotations 'aps' are no object of objects"),
    (lambda f, _: f.pop("branch-to-probability.bin"), "has to hold numbers above 0"),
    (lambda f, _: f.update({"branch-to-target.bin": bytes(8)}), "8 bytes; 5 numbers of 8 are needed"),
    (lambda f, _: f.update({"branch-to-target.bin": b"\xff" * 40}), "numbers below 2 are needed"),
    (lambda f, _: f.update({"state-is-initial.bin": bytes(8)}), "0 states have the label 'init'"),
    (lambda f, _: f.update({"actions/choices/strings.bin": b"\xff" * 17}), "not UTF-8|has to rise"),
    (lambda f, _: f.update({"choice-to-branches.bin": bytes(32)}), "with no interval empty"),
]


@pytest.mark.parametrize(
    ("change", "message"), BAD_UMB, ids=lambda part: part if isinstance(part, str) else ""
)
def test_bad_umb_is_told(tmp_path, change, message):
    archive(tmp_path / "p.umb", change)
    with pytest.raises((FormatError, MDPError), match=rf"p\.umb: .*({message})"):
        read_process(tmp_path / "p.umb")


def test_what_is_left_out_of_umb_is_bounded(tmp_path):
    def boast(files, index):
        for name in ("state-to-choices.bin", "choice-to-branches.bin", "branch-to-target.bin"):
            del files[name]
        index["transition-system"].update(dict.fromkeys(["#states", "#choices", "#branches"], 10**12))

    archive(tmp_path / "p.umb", boast)
    with pytest.raises(FormatError, match="state-to-choices.bin is left out, and 1,000,000,000,000 entries"):
        read_process(tmp_path / "p.umb")


def test_umb_may_be_compressed(tmp_path):
    write_process(tmp_path / "p.umb", COIN)
    raw = (tmp_path / "p.umb").read_bytes()
    for pack in (gzip.compress, lzma.compress):
        (tmp_path / "packed.umb").write_bytes(pack(raw))
        assert choices_of(read_process(tmp_path / "packed.umb")) == choices_of(COIN)
        (tmp_path / "packed.umb").write_bytes(pack(raw)[:-40])
        with pytest.raises(FormatError):
            read_process(tmp_path / "packed.umb")


@settings(max_examples=60)
@given(data=st.data(), ending=st.sampled_from(ENDINGS))
def test_damaged_files_are_refused_without_a_traceback(tmp_path_factory, data, ending):
    path = tmp_path_factory.mktemp("damaged") / f"p{ending}"
    write_process(path, COIN)
    victim = data.draw(st.sampled_from(sorted(path.parent.iterdir())))
    raw = bytearray(victim.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(raw) - 1))
        cut = data.draw(st.integers(0, 3))
        raw[at : at + cut] = data.draw(st.binary(max_size=3))
    victim.write_bytes(raw)
    with suppress(FormatError, MDPError):  # some damage leaves another process, or names only
        read_process(path)


# --- by umbi, the reference for UMB -----------------------------------------------------------------------


def test_umbi_reads_what_is_written(tmp_path):
    umbi = pytest.importorskip("umbi")
    mdp = random_process(3)
    mdp = replace(mdp, reward=np.ones(len(mdp.reward)))  # its upper layer knows no groups of our own
    write_process(tmp_path / "p.umb", mdp)
    ats, laid = umbi.ats.read(tmp_path / "p.umb"), lay_out(mdp, None, None)
    assert (ats.num_states, ats.num_choices, ats.num_branches) == (5, len(laid.action), len(laid.target))
    umbi.ats.write(ats, tmp_path / "again.umb")
    back = read_process(tmp_path / "again.umb")
    assert [back.prob.sum(), *back.terminal] == pytest.approx([mdp.feasible.sum(), *mdp.terminal])


def test_umbi_validates_groups_of_our_own(tmp_path):
    umbi = pytest.importorskip("umbi")
    mdp = product(COIN, [random_rule(1)])
    write_process(tmp_path / "p.umb", mdp)
    found = umbi.umb.read(tmp_path / "p.umb")
    assert found.annotations["origin"]["part-1"]["states"] == mdp.origin[:, 1].tolist()
    assert found.annotations["outcomes"]["reward"]["branches"][:3] == [-1.0, -3.0, -1.0]
    assert found.branch_action_to_string[:2] == ["tails", "edge tails"]


# --- by Storm ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def storm():
    return pytest.importorskip("stormpy")


def checked(storm, model, text):
    """Return what Storm computes for each state: with sound methods, or exactly where the model is exact."""
    result = storm.model_checking(model, storm.parse_property(text))
    return np.array([float(result.get_value(s)) for s in range(model.nr_states)])


def built(storm, path, *, exact=False):
    """Return Storm's model of a file; of PRISM's it reads the columns, and has headers of its own."""
    if path.suffix == ".umb":
        options = storm.developer.storage.UmbImportOptions()
        options.value_type = getattr(type(options.value_type), "RATIONAL" if exact else "DOUBLE")
        return storm.build_model_from_umb(path, options=options)
    if path.suffix == ".drn":
        return storm.build_model_from_drn[storm.Rational if exact else float](path)
    (path.parent / "s.tra").write_text("mdp\n" + path.read_text().split("\n", 1)[1])
    (path.parent / "s.trew").write_text("mdp\n" + path.with_suffix(".trew").read_text().split("\n", 1)[1])
    head, *lines = path.with_suffix(".lab").read_text().splitlines()
    names = dict(re.findall(r'([0-9]+)="([^"]*)"', head))
    held = [re.sub(r" ([0-9]+)", lambda k: f" {names[k[1]]}", line.replace(":", "")) for line in lines]
    text = "\n".join(["#DECLARATION", " ".join(names.values()), "#END", *held])
    (path.parent / "s.lab").write_text(text + "\n")
    return storm.build_model_from_explicit(
        path.parent / "s.tra", path.parent / "s.lab", transition_rewards=path.parent / "s.trew"
    )


def best_reach(mdp, enabled, pick):
    """Return the best probability of reaching a marked state, by the sweeps of the book."""
    value = mdp.marked.astype(float)
    lines = [(s, mdp.outcomes(s, a)) for s, a in np.argwhere(enabled & ~mdp.marked[:, None]).tolist()]
    for _ in range(2000):
        fresh = {}
        for s, at in lines:
            fresh.setdefault(s, []).append(mdp.prob[at] @ value[mdp.next_state[at]])
        for s, values in fresh.items():
            value[s] = pick(values)
    return value


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("seed", range(4))
def test_storm_agrees_on_processes(storm, tmp_path, ending, seed):
    mdp = random_process(seed)
    mdp = replace(mdp, reward=np.abs(mdp.reward))  # Storm reads no negative ones from PRISM's files
    write_process(tmp_path / f"p{ending}", mdp)
    model, laid = built(storm, tmp_path / f"p{ending}"), merged(lay_out(mdp, None, None))
    sizes = (model.nr_states, model.nr_choices, model.nr_transitions)
    assert sizes == (laid.n_states, len(laid.action), len(laid.target))
    live = mdp.feasible & ~mdp.terminal[:, None]
    for name, pick in (("max", max), ("min", min)):
        if mdp.marked.any():
            found = checked(storm, model, f'P{name}=? [F "goal"]')
            assert found == pytest.approx(best_reach(mdp, live, pick), abs=1e-5), name
    reward = '{"reward"}' if ending != ".tra" else ""
    value = checked(storm, model, f"R{reward}max=? [Cdiscount={GAMMA}]")
    assert value == pytest.approx(value_iteration(mdp, gamma=GAMMA).value, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("ending", [".drn", ".umb"])
def test_storm_agrees_on_supervised_processes(storm, tmp_path, ending):
    seen = 0
    for seed in range(30):
        mdp, enabled, alive = supervised(seed)
        if not alive or not mdp.marked.any():
            continue
        mdp = replace(mdp, reward=np.sin(np.arange(len(mdp.reward))))
        seen += 1
        write_process(tmp_path / f"{seed}{ending}", mdp, enabled=enabled)
        model = built(storm, tmp_path / f"{seed}{ending}")
        found = checked(storm, model, 'Pmax=? [F "goal"]')
        assert found[: mdp.n_states] == pytest.approx(best_reach(mdp, enabled, max), abs=1e-5)
        value = checked(storm, model, f'R{{"reward"}}max=? [Cdiscount={GAMMA}]')
        mine = value_iteration(mdp, gamma=GAMMA, enabled=enabled).value
        assert value[: mdp.n_states] == pytest.approx(mine, rel=1e-5, abs=1e-5)
        if (mdp.initial > 0).sum() > 1:
            assert value[-1] == pytest.approx(GAMMA * mdp.initial @ mine, rel=1e-5, abs=1e-5)
    assert seen > 4


@pytest.mark.parametrize("ending", [".drn", ".umb"])
@pytest.mark.parametrize("seed", range(4))
def test_storm_agrees_on_chains(storm, tmp_path, ending, seed):
    mdp = random_process(seed)
    weights = mdp.feasible / np.maximum(mdp.feasible.sum(axis=1, keepdims=True), 1)
    mine = evaluate(mdp, weights, gamma=GAMMA)
    write_process(tmp_path / f"p{ending}", mdp, policy=weights)
    model = built(storm, tmp_path / f"p{ending}")
    assert "Dtmc" in type(model).__name__
    value = checked(storm, model, f'R{{"reward"}}=? [Cdiscount={GAMMA}]')[0]
    assert value == pytest.approx(mine.value, rel=1e-5, abs=1e-5)
    exact = built(storm, tmp_path / f"p{ending}", exact=True)  # iterating stops early below 0
    if mdp.marked.any():
        assert checked(storm, exact, 'P=? [F "goal"]')[0] == pytest.approx(mine.completion, abs=1e-12)
    if np.isfinite(mine.expected_steps):
        total = checked(storm, exact, 'R{"reward"}=? [F "terminal"]')[0]
        assert total == pytest.approx(mine.expected_return, rel=1e-12)


def test_storm_knows_names(storm, tmp_path):
    write_process(tmp_path / "p.umb", COIN)
    model = storm.build_model_from_umb(tmp_path / "p.umb")
    assert set(model.choice_labeling.get_labels()) == {"toss", "turn over", "stay"}
    assert {"init", "goal", "terminal", "deadlock", "broken", "up", "goal_2", "two words"} == set(
        model.labeling.get_labels()
    )


# --- on the command line ----------------------------------------------------------------------------------

EXAMPLES = Path(__file__).parents[1] / "examples"


def test_model_command_writes_a_task(tmp_path, monkeypatch):
    runner, task = CliRunner(), str(EXAMPLES / "pickup_delivery.toml")
    monkeypatch.chdir(tmp_path)
    done = runner.invoke(model_command, [task, "-o", "grid.umb"])
    assert done.exit_code == 0, done.output
    assert re.fullmatch(
        r"Wrote grid\.umb: [0-9,]+ states, of which 12,380 can be reached, with 24,110 enabled actions\.\n",
        done.output,
    )
    assert isinstance(runner.invoke(model_command, [task, "-o", "grid.umb"]).exception, FormatError)
    done = runner.invoke(model_command, [task, "-o", "grid.umb", "--force", "--optimal"])
    assert done.exit_code == 0, done.output
    chain = read_process(tmp_path / "grid.umb")
    assert chain.actions == ("step",)
    assert evaluate(chain, np.zeros(chain.n_states, int), gamma=0.99).violation == 0


def test_model_command_says_no(tmp_path, monkeypatch):
    runner, task = CliRunner(), str(EXAMPLES / "pickup_delivery.toml")
    monkeypatch.setattr("supremal.task.experiment.supervise", lambda *_: (COIN, np.zeros((2, 2), bool)))
    done = runner.invoke(model_command, [task, "-o", str(tmp_path / "p.drn")])
    assert (done.exit_code, list(tmp_path.iterdir())) == (1, [])
    assert done.output.startswith("The rules cannot be kept: nothing is written.")
    done = runner.invoke(model_command, [task, "-o", str(tmp_path / "p.drn"), "--unsupervised"])
    assert done.exit_code == 0, done.output
    done = runner.invoke(model_command, [task, "-o", str(tmp_path / "none" / "p.drn"), "--unsupervised"])
    assert "cannot write" in str(done.exception)
