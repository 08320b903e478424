"""Mutated rule texts and task files: each gives a result or a clear error, soon and in little memory.

Takes the texts below and the task files of ``examples/``, mutates each a few times, and asks of them what a
user would: the automaton of a rule and what it says of itself; the task and whether its rules can be kept.
Anything but an answer or a `SupremalError`, anything above 2 s of processor time, and a process above 1 GiB
fails.
``FUZZ_CASES`` and ``FUZZ_SEED`` in the environment set another number of cases and another seed.
"""

from __future__ import annotations

import os
import random
import re
import resource
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

from supremal import Alphabet, SupremalError
from supremal.rules.about import classify, example_words
from supremal.rules.ltlf import rule_from_ltlf, sentence_of_ltlf
from supremal.rules.regex import rule_from_regex, sentence_of_regex
from supremal.task.findings import plants_of, study
from supremal.task.reading import read_task
from supremal.task.task import Options

CASES = int(os.environ.get("FUZZ_CASES", "100000"))
SEED = int(os.environ.get("FUZZ_SEED", "0"))
EXAMPLES = Path(__file__).parents[1] / "examples"
SLOW = 2.0
LARGE = 1 << 20  # KiB
SIGMA = Alphabet(("a", "b", "c", "start1", "d_u", "p1"), uncontrollable=frozenset({"d_u"}))

REGEXES = [
    "(a b)* c?", "[^a]* (a [^a]* b [^a]*)*", "~(.* a .{3} b .*)", "(a | b){2,5} & ~(.* c)",
    "start1 (d_u p1)+ .*", "([a b] c){0,40}", "(a* b* c*)* & ~(. . .)", "((a b?){3} | c+) [^d_u]",
]  # fmt: skip
FORMULAS = [
    "G (a -> F b)", "G !(a & X a)", "(!b) W a", "G (a -> F[<=20] b)", "G (b -> O a)", "F (a & N G !b)",
    "G (p1 -> (!d_u U c)) & F start1", "(a S b) | H[<=3] !c", "G[<=7] (a | b) <-> F c",
    "[a b] R (c -> Y a)",
]  # fmt: skip
TOKENS = [
    "(", ")", "[", "]", "{", "}", "|", "&", "*", "+", "?", ".", "~", "^", "!", "->", "<->", "a", "b",
    "zz", "F", "G", "X", "U", "[<=3]", "[<=99999999]", "{2,3}", "{0,100000}", "{9999999999}", "=", '"',
    "'", "#", ",", "\n", " ", "-1", "0", "1e308", "nan", "true", "[[rule]]", "[check]", "pattern", "é",
    "\x00", "\\", "\u202e",
]  # fmt: skip


def mutated(text: str, rng: random.Random) -> str:
    """Return ``text`` with one to four slips of the pen."""
    for _ in range(rng.randint(1, 4)):
        at, to = sorted((rng.randint(0, len(text)), rng.randint(0, len(text))))
        to = min(to, at + rng.choice((1, 3, 20)))
        match rng.randrange(7):
            case 0:
                text = text[:at] + text[to:]
            case 1:
                text = text[:at] + rng.choice(TOKENS) + text[at:]
            case 2:
                text = text[:at] + rng.choice(TOKENS) + text[to:]
            case 3:
                text = text[:at] + text[at:to] * rng.choice((2, 2, 30)) + text[to:]
            case 4:
                lines = text.split("\n")
                rng.shuffle(lines) if rng.random() < 0.2 else lines.pop(rng.randrange(len(lines)))
                text = "\n".join(lines)
            case 5:
                text = re.sub(r"\d+", lambda m: rng.choice((m[0], m[0], "0", "7", "100000")), text)
            case 6:
                names = re.findall(r"[a-z_]\w*", text) or ["a"]
                text = text[:at] + rng.choice(names) + text[at:]
    return text


def ask_regex(text: str) -> None:
    rule = rule_from_regex(text, SIGMA, name="fuzz")
    classify(rule), example_words(rule), sentence_of_regex(text, SIGMA)


def ask_formula(text: str) -> None:
    rule = rule_from_ltlf(text, SIGMA, name="fuzz")
    classify(rule), example_words(rule), sentence_of_ltlf(text)


def ask_task(text: str, folder: Path) -> None:
    path = folder / "task.toml"
    path.write_text(text, encoding="utf-8", errors="surrogatepass")
    task = read_task(path)
    for rule in task.rules:
        classify(rule.automaton), example_words(rule.automaton)
    if task.model != "environment":
        options = Options(task.options.nonblocking, task.options.must_act, max_states=20_000)
        study(plants_of(task), tuple(rule.automaton for rule in task.rules), options)


def ask(verb: Callable[[str], None], text: str) -> str:
    """Return how a question ended: "answer", "error", or what went wrong."""
    begin = process_time()
    try:
        verb(text)
        ended = "answer"
    except SupremalError as error:
        ended = "error" if str(error) else "error without a message"
    except Exception:  # noqa: BLE001 - this is what is looked for
        ended = "traceback: " + traceback.format_exc().strip().splitlines()[-1]
    return ended if process_time() - begin < SLOW else "slow"


def run() -> dict[str, Any]:
    """Fuzz, and return how the cases ended."""
    rng = random.Random(SEED)
    tasks = [path.read_text(encoding="utf-8") for path in sorted(EXAMPLES.glob("*.toml"))]
    pools = {
        "regex": REGEXES,
        "ltlf": FORMULAS,
        "task": [text for text in tasks if "\nid = " not in text],
        "environment": tasks,
    }
    counts: Counter[str] = Counter()
    slowest, failures = 0.0, 0
    begin = perf_counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file in EXAMPLES.iterdir():
            if file.suffix != ".toml":
                (folder / file.name).write_bytes(file.read_bytes())
        asks: dict[str, Callable[[str], None]] = {"regex": ask_regex, "ltlf": ask_formula}
        for _ in range(CASES):
            kind = rng.choices(tuple(pools), (40, 40, 19, 1))[0]
            text = mutated(rng.choice(pools[kind]), rng)
            verb = asks.get(kind, lambda text: ask_task(text, folder))
            at = process_time()
            ended = ask(verb, text)
            slowest = max(slowest, process_time() - at)
            counts[f"{kind}: {ended.split(':')[0]}"] += 1
            if ended not in ("answer", "error"):
                failures += 1
                print(f"{kind}: {ended}\n{text!r}"[:1500], flush=True)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for what, count in sorted(counts.items()):
        print(f"{what:24} {count:8,}")
    print(f"slowest {slowest:.3f} s, peak memory {peak >> 10} MiB")
    assert not failures, f"{failures} cases failed"
    assert peak < LARGE, "more than 1 GiB of memory"
    return {
        "cases": CASES,
        "seed": SEED,
        "ended": dict(sorted(counts.items())),
        "failures": failures,
        "slowest_s": round(slowest, 3),
        "peak_mib": peak >> 10,
        "seconds": round(perf_counter() - begin, 1),
    }
