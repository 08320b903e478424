"""``python -m supremal`` is the command line."""

from supremal.cli import main

main(prog_name="supremal")
