"""The command line: ``railenv --help``. A module for each command."""

from railenv.cli.application import app, foreign_package, main

__all__ = ["app", "foreign_package", "main"]
