"""Output of sections: figures as SVG and PNG, numbers as CSV and JSON."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from design.reproduction.codec import plain
from design.reproduction.document import Part, Picture
from design.reproduction.drawing import write_figure
from design.reproduction.section import Data, DataTable, Section

_LISTED = 3  # files are named one by one

FOLDERS = ("figures", "data")
"""Folders in the directory of the report."""


def write_part(section: Section, data: Data, directory: Path) -> tuple[Part, list[Path]]:
    """Draw a section, write its figures and data, and return it as a part of the document."""
    figures, tables = (directory / name for name in FOLDERS)
    for folder in (figures, tables):
        folder.mkdir(parents=True, exist_ok=True)
    pictures: list[Picture] = []
    files: list[Path] = []
    for drawing in section.draw(data):
        svg, paths = write_figure(drawing.figure, figures, drawing.name)
        pictures.append(Picture(svg, drawing.caption, drawing.group))
        files += paths
    names = []
    for table in section.tables(data):
        files += [write_csv(table, tables), write_json(table, tables)]
        names.append(f"data/{table.name}")
    shown = tuple(names) if len(names) <= _LISTED else (names[0], "...", names[-1])
    return Part(section.key, section.title, section.text(data), tuple(pictures), shown), files


def write_csv(table: DataTable, directory: Path) -> Path:
    """Write a table as CSV, with a line of headings."""
    path = directory / f"{table.name}.csv"
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(table.header)
        writer.writerows(table.rows)
    return path


def write_json(table: DataTable, directory: Path) -> Path:
    """Write a table as a JSON object of columns; numbers that are not finite become null."""
    path = directory / f"{table.name}.json"
    columns = json.dumps(plain(table.columns), allow_nan=False, separators=(",", ":"))
    path.write_text(columns + "\n", encoding="utf-8")
    return path
