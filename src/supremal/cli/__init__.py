"""The command line.

Exit codes: 0 all went well, 1 the answer is no, 2 bad input or output (one line says what would be right),
130 stopped by Ctrl-C.
"""

from __future__ import annotations

import sys
from importlib import import_module

import click

from supremal import __version__
from supremal.cli.certify import certify_command, verify_command
from supremal.cli.check import check
from supremal.cli.convert import convert
from supremal.cli.demo import demo
from supremal.cli.export import export_command
from supremal.cli.export_model import model_command
from supremal.cli.init import init
from supremal.cli.monitor import monitor_command
from supremal.cli.play import play_command
from supremal.cli.report import report_command
from supremal.cli.rules import rules
from supremal.cli.run import STOPPED, run_command
from supremal.cli.show import show_command
from supremal.cli.study import study_command
from supremal.cli.synthesize import synthesize_command
from supremal.errors import SupremalError


class _BadInputError(click.ClickException):
    exit_code = 2


class _Group(click.Group):
    """A group whose commands report a user's mistake in one line, never with a traceback."""

    def invoke(self, ctx: click.Context) -> object:
        try:
            return super().invoke(ctx)
        except SupremalError as error:
            raise _BadInputError(str(error)) from None
        except KeyboardInterrupt:
            click.echo("Stopped before there was anything to write.", err=True)
            ctx.exit(STOPPED)


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="supremal")
@click.option("--import", "modules", multiple=True, metavar="MODULE",
              help="Import a module first, that registers environments of yours in Gymnasium.")  # fmt: skip
def main(modules: tuple[str, ...]) -> None:
    """Train agents that never break the rules, and know before training whether the rules can be kept."""
    if modules:
        sys.path.insert(0, "")  # as `python -m` does: modules of the folder that one is in
    for module in modules:
        try:
            import_module(module)
        except ImportError as error:
            message = f"cannot import {module}: {error}; give the name of a module that Python finds"
            raise _BadInputError(message) from None


for command in (
    certify_command,
    check,
    convert,
    demo,
    export_command,
    init,
    model_command,
    monitor_command,
    play_command,
    report_command,
    rules,
    run_command,
    show_command,
    study_command,
    synthesize_command,
    verify_command,
):
    main.add_command(command)
