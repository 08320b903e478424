"""The command line.

Exit codes: 0 all went well, 1 the answer is no, 2 bad input or output (one line says what would be right),
130 stopped by Ctrl-C.
"""

from __future__ import annotations

import click

from supremal import __version__
from supremal.cli.check import check
from supremal.cli.convert import convert
from supremal.cli.demo import STOPPED, demo
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
def main() -> None:
    """Train agents that never break the rules, and know before training whether the rules can be kept."""


for command in (check, convert, demo, synthesize_command):
    main.add_command(command)
