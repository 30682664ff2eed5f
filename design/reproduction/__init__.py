"""The reproduction report: every result of the paper, computed again, beside the printed one.

A report is a list of :class:`Section` objects. Each names the :class:`Piece` objects (computations)
that it needs, and turns their results into text, figures and tables. :func:`reproduce` computes missing
pieces and writes the report. To add a section, write a subclass of :class:`Section` and put it into the
list for :func:`reproduce` (:func:`design.reproduction.sections.whole_report`).
"""

from design.reproduction.run import Interrupted, Report, reproduce
from design.reproduction.section import DataTable, Drawing, Section
from design.reproduction.sections import first_page, whole_report
from design.reproduction.settings import FULL, QUICK, Settings
from design.reproduction.store import Piece, Store

__all__ = [
    "FULL",
    "QUICK",
    "DataTable",
    "Drawing",
    "Interrupted",
    "Piece",
    "Report",
    "Section",
    "Settings",
    "Store",
    "first_page",
    "reproduce",
    "whole_report",
]
