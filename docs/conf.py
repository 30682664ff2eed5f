"""Settings of the documentation site: ``make site``."""

from __future__ import annotations

import dataclasses
import inspect
import re
from typing import Any

import gymnasium

import railenv
from railenv.vehicles import ParameterRecord, describe

project = "railenv"
author = "the railenv authors"
version = release = railenv.__version__
project_copyright = "the railenv authors, MIT licence"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "numpydoc",
    "sphinxcontrib.katex",
]
exclude_patterns = ["_build"]

# Links and anchors as code hosts have them, so that the pages read well in both places.
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4

# Names in the docstrings' cross-references must exist; types in prose need not be links.
nitpicky = True
nitpick_ignore_regex = [
    ("py:(class|data|exc|attr)", ".*"),
    ("py:(mod|func|meth)", "(numpy|control|math).*"),
]

autodoc_member_order = "alphabetical"
autodoc_typehints = "none"
autodoc_preserve_defaults = True
autodoc_mock_imports = ["stable_baselines3", "torch"]  # the extra `rl` is not needed for its pages
autodoc_default_options = {"members": True}
numpydoc_show_class_members = False
autosummary_generate = False  # loaded by numpydoc; it would import what is mocked
python_maximum_signature_line_length = 88

html_theme = "furo"
html_title = f"railenv {railenv.__version__}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False

# Style sheet and fonts of KaTeX are shipped here, its scripts with the extension: nothing is loaded
# from elsewhere.
katex_css_path = "katex/katex.min.css"
katex_options = "throwOnError: true, strict: true"


def _signature(
    app: Any, what: str, name: str, obj: Any, options: Any, signature: str | None, returns: str | None
) -> tuple[str, None] | None:
    """Leave out the signature of records, whose attributes are listed anyway."""
    if what != "class":
        return None
    if dataclasses.is_dataclass(obj):
        return "", None
    if signature == "(*args, **kwargs)":  # of a base class that is mocked
        own = list(inspect.signature(obj.__init__).parameters.values())[1:]
        plain = [p.replace(annotation=p.empty) for p in own]
        return str(inspect.Signature(plain)), None
    return None


def _docstring(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Add to the docstrings of classes what the code knows: pages, fields, base classes."""
    if what != "class":
        return
    short = name.rpartition(".")[2]
    if issubclass(obj, gymnasium.Env):  # its docstring is the Markdown of a page of its own
        del lines[next((i for i, line in enumerate(lines) if line.startswith("## ")), len(lines)) :]
        page = re.sub(r"(?<=[a-z])(?=[A-Z])", "-", short.removesuffix("Env")).lower()
        lines += ["", f"Spaces, rewards and settings: :doc:`/environments/{page}`.", ""]
    if issubclass(obj, ParameterRecord):
        rows = [row for row in describe(obj) if row.unit]
        fields = [f"- ``{row.name}`` ({row.unit}): {row.meaning}" for row in rows]
        lines += ["", ".. rubric:: Fields", "", *fields, ""]
    public = (base.__name__ for base in obj.__mro__[1:] if base.__name__ in railenv.__all__)
    if base := next(public, None):
        lines += ["", f"It also has what a :class:`railenv.{base}` has.", ""]


def setup(app: Any) -> None:
    """Connect what Sphinx calls."""
    app.connect("autodoc-process-docstring", _docstring)
    app.connect("autodoc-process-signature", _signature)
