"""``supremal play``: choose what happens, and see what the supervisor allows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Sequence

    from supremal.cli._serving import PageServer
    from supremal.task.findings import Findings
    from supremal.task.game import Game
    from supremal.task.task import Task


@click.command("play")
@click.argument("path", metavar="TASK", type=click.Path(path_type=Path))
@click.option("--terminal", is_flag=True, help="Play here, and not in a browser.")
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Of the page  [default: a free one]")
@click.option("--no-browser", is_flag=True, help="Print the address of the page, and open no browser.")
@click.option(
    "--seed", type=click.IntRange(min=0), help="Of the start and of chance  [default: as in the file]"
)
@click.pass_context
def play_command(
    ctx: click.Context, path: Path, terminal: bool, port: int, no_browser: bool, seed: int | None
) -> None:
    """Play a TASK file (.toml): choose each next event, and see what the supervisor allows.

    A page is served to this machine only, until Ctrl-C.  Exit code 0: played; 1: the rules cannot be kept, so
    that there is nothing to play; 2: bad input.
    """
    from supremal.cli.check import NO, tell
    from supremal.task.findings import plants_of, study
    from supremal.task.game import game_of
    from supremal.task.reading import read_task

    task = read_task(path)
    findings = study(plants_of(task), tuple(rule.automaton for rule in task.rules), task.options, lost=False)
    game = game_of(task, findings, seed=task.seed if seed is None else seed)
    if game is None:
        tell(findings, worst_case=task.model == "anything")
        ctx.exit(NO)
    if terminal:
        from supremal.cli._asking import ask

        click.secho(task.title or task.name, bold=True)
        ask(game)
    else:
        _serve(_server(task, findings, game, port), browser=not no_browser)


def _server(task: Task, findings: Findings, game: Game, port: int) -> PageServer:
    """Return the server of a game's page.

    Raises
    ------
    OutputError
        If it cannot listen there.
    """
    from supremal.cli._serving import PageServer
    from supremal.cli.models import OutputError
    from supremal.show.play import content_policy, moment_document, play_html
    from supremal.task.page import checked, rule_views

    def answer(moves: Sequence[int]) -> dict[str, Any]:
        return moment_document(game.moment(moves), game.scene.free)

    page = play_html(checked(task, findings), game.scene, rule_views(task))
    try:
        return PageServer(port, page, content_policy(page), answer)
    except OSError as error:
        message = f"cannot listen at port {port}: {error.strerror}; leave --port out for a free one"
        raise OutputError(message) from None


def _serve(server: PageServer, *, browser: bool) -> None:
    """Serve until Ctrl-C."""
    import webbrowser

    with server:
        click.echo(f"Play at {server.url}, only from this machine.  Ctrl-C ends it.")
        try:
            if browser:
                webbrowser.open(server.url)
            server.serve_forever()
        except KeyboardInterrupt:
            click.echo("\nEnded.")
