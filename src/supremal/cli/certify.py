"""``supremal certify`` and ``supremal verify``: proof of what a run has learned, and its check."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from supremal import __version__, verifier
from supremal.errors import FormatError


@click.command("certify")
@click.argument("run", type=click.Path(path_type=Path))
@click.option(
    "--out", "-o", type=click.Path(path_type=Path), help="The file  [default: RUN/certificate.json]"
)
@click.option("--seed", type=int, help="The seed whose policy it is  [default: the run's first]")
@click.option("--force", is_flag=True, help="Replace the file if it is there.")
def certify_command(run: Path, out: Path | None, seed: int | None, force: bool) -> None:
    """Write a certificate of what the run in folder RUN has learned.

    It proves to anyone that the rules are never broken, what the policy is worth, and how far that is from
    the best; `supremal verify` checks it.
    """
    from supremal.decisions.certificate import certificate_text, certify
    from supremal.decisions.product import MAX_STATES
    from supremal.task.reading import read_task

    place = out or run / "certificate.json"
    if place.exists() and not force:
        message = "the file exists already; choose another with --out, or replace it with --force"
        raise FormatError(message, path=str(place))
    task = read_task(run / "task.toml")
    if task.environment is None:
        message = "a task without an environment has nothing to learn, and no policy to certify"
        raise FormatError(message, path=task.path)
    document = certify(
        task.environment,
        task.rules,
        task.reward_machine,
        read_policy(run / "learned.npz", seed),
        gamma=_read_gamma(run / "result.json"),
        nonblocking=task.options.nonblocking,
        max_states=task.options.max_states or MAX_STATES,
        name=task.name,
        made_by=f"supremal {__version__}",
    )
    try:
        place.write_text(certificate_text(document) + "\n", encoding="utf-8")
    except OSError as error:
        message = f"cannot write it: {error.strerror}; choose another file with --out"
        raise FormatError(message, path=str(place)) from None
    for said in document["claims"]["words"]:
        click.echo(f"  {said}")
    click.echo(f"Written to {place}: {len(document['states']):,} states.")


@click.command("verify")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print the verdict as JSON, and nothing else.")
@click.pass_context
def verify_command(ctx: click.Context, file: Path, as_json: bool) -> None:
    """Check a certificate, by definition and in exact fractions.

    Exit code 0: valid; 1: not valid; 2: no certificate.
    """
    ctx.exit(verifier.main([str(file), *(["--json"] if as_json else [])]))


def _read_gamma(path: Path) -> float:
    """Return the discount factor that a run used."""
    try:
        return float(json.loads(path.read_text(encoding="utf-8"))["settings"]["gamma"])
    except OSError as error:
        message = f"cannot read it: {error.strerror}; the folder of a finished run is needed"
    except (ValueError, KeyError, TypeError):
        message = "settings.gamma is missing; the result of a run is needed"
    raise FormatError(message, path=str(path))


def read_policy(path: Path, seed: int | None) -> Any:  # noqa: ANN401 - an array; numpy is imported late
    """Return the policy that a seed has learned, ``int [S]``."""
    from zipfile import BadZipFile
    from zlib import error as zlib_error

    import numpy as np

    try:
        with np.load(path, allow_pickle=False) as learned:
            seeds, policy = learned["seeds"], learned["policy"]
    except OSError as error:
        message = f"cannot read it: {error.strerror or error}; the folder of a finished run is needed"
        raise FormatError(message, path=str(path)) from None
    except (ValueError, KeyError, TypeError, EOFError, BadZipFile, zlib_error):
        message = "it has no arrays seeds [N] and policy [N, S]; what a run has written is needed"
        raise FormatError(message, path=str(path)) from None
    if seeds.ndim != 1 or policy.ndim != 2 or len(seeds) != len(policy) or not len(seeds):
        message = f"seeds has shape {seeds.shape}, policy {policy.shape}; [N] and [N, S] are needed"
        raise FormatError(message, path=str(path))
    known = seeds.tolist()
    if seed is not None and seed not in known:
        message = f"seed {seed} was not run; known: {', '.join(map(str, known))}"
        raise FormatError(message, path=str(path))
    return policy[0 if seed is None else known.index(seed)]
