"""Write the tables and figures of docs/recipes.md from examples/: ``python docs/make_recipes.py``."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

DOCS = Path(__file__).resolve().parent
sys.path += [str(DOCS), str(DOCS.parent)]

from blocks import refilled  # noqa: E402

PAGE = DOCS / "recipes.md"
RECIPES = (
    "damper_sizing",
    "yaw_rate_feedback",
    "lqr_at_one_speed",
    "gain_scheduling",
    "lqg_and_conicity",
    "delay_sensitivity",
)


def run(name: str, *, fast: bool, figure: Path | None = None) -> Any:
    """Run a recipe and return its result."""
    return importlib.import_module(f"examples.{name}").main(fast, figure)


def page(text: str, results: dict[str, Any]) -> str:
    """Return the page with the tables of these results."""
    return refilled(text, {name: result.markdown for name, result in results.items()})


def main() -> None:
    """Write the page and its figures."""
    results = {
        name: run(name, fast=False, figure=DOCS / "pictures" / f"recipe-{name.replace('_', '-')}.png")
        for name in RECIPES
    }
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8"), results), encoding="utf-8")
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
