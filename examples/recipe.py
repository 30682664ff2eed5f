"""What the recipes share: tables in Markdown, figures in files, and a command line."""

import argparse
from pathlib import Path

import design

LIMITS = (20.0, 400.0)  # m/s, between which critical speeds of controlled vehicles are searched


def table(headings, rows):
    """Markdown table; the first column is text, the others are numbers."""
    rule = ["---", *["---:"] * (len(headings) - 1)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (headings, rule, *rows))


def critical(model, controller=None):
    """Critical speed of a loop, m/s; 0 if below LIMITS, inf if above."""
    found = design.critical_speed(model, controller=controller, speed_range=LIMITS)
    if found.speed is not None:
        return found.speed
    return float("inf") if found.loss == "none" else 0.0


def written(speed):
    """A critical speed from ``critical`` for a table."""
    if speed == 0.0:
        return f"< {LIMITS[0]:.0f}"
    return f"> {LIMITS[1]:.0f}" if speed == float("inf") else f"{speed:.1f}"


def save(figure, path):
    """Write a figure to a file."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)


def command_line(main):
    """Run a recipe with the options --fast and --figure."""
    parser = argparse.ArgumentParser(description=(main.__module__ and main.__doc__) or "")
    parser.add_argument("--fast", action="store_true", help="only what the table needs")
    parser.add_argument("--figure", help="file for the figure, such as figure.png")
    options = parser.parse_args()
    main(options.fast, options.figure)
