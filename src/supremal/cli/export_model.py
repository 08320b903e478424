"""``supremal model``: a task's process under its supervisor, as a file for Storm or PRISM."""

from __future__ import annotations

from pathlib import Path

import click

from supremal.cli.check import NO
from supremal.cli.models import OutputError
from supremal.errors import MDPError


@click.command("model")
@click.argument("task", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    required=True,
    help="The file to write: .umb, .drn, or .tra and its companions.",
)
@click.option("--unsupervised", is_flag=True, help="Enable every feasible action; broken rules have a label.")
@click.option("--optimal", is_flag=True, help="Write the Markov chain of an optimal policy.")
@click.option("--force", is_flag=True, help="Replace files that are there.")
@click.pass_context
def model_command(
    ctx: click.Context, task: Path, out: Path, unsupervised: bool, optimal: bool, force: bool
) -> None:
    """Write the process of a task file, with its rules and reward machine, as a model checker reads it.

    Exit code 0: written; 1: the rules cannot be kept, so there is nothing to write; 2: bad input or output.
    """
    import numpy as np

    from supremal.decisions.planning import value_iteration
    from supremal.decisions.safety import reachable_states
    from supremal.formats.processes import find_process_ending, write_process
    from supremal.task.experiment import supervise
    from supremal.task.reading import read_task

    find_process_ending(out)
    found = read_task(task)
    if found.environment is None:
        message = f"task {found.name!r} has no environment, so there is no process to write"
        raise MDPError(message)
    product, mask = supervise(found.environment, found)
    stuck = (product.initial > 0) & ~product.terminal & ~mask.any(axis=1)
    if stuck.any() and not unsupervised:
        click.echo("The rules cannot be kept: nothing is written. Ask supremal check for the reason.")
        ctx.exit(NO)
    enabled = None if unsupervised else mask
    policy = value_iteration(product, gamma=found.settings.gamma, enabled=enabled).policy if optimal else None
    try:
        write_process(out, product, enabled=enabled, policy=policy, force=force)
    except OSError as error:
        message = f"cannot write {out}: {error.strerror}; choose another file with --out"
        raise OutputError(message) from None
    choices = product.feasible if enabled is None else enabled
    if policy is not None:
        choices = choices & (policy[:, None] == np.arange(product.n_actions))
    live = choices & ~product.terminal[:, None]
    reached = reachable_states(product, live)
    click.echo(
        f"Wrote {out}: {product.n_states:,} states, of which {reached.sum():,} can be reached, with "
        f"{live[reached].sum():,} enabled actions."
    )
