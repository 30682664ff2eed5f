"""What README and docs say is what the code does."""

import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from typer.testing import CliRunner

from design.reproduction.sections.critical_speeds import CAPTION, HEADINGS, TITLE, CriticalSpeeds
from railenv import cli

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.glob("*.md")), *sorted(DOCS.glob("how-to/*.md"))]
BLOCKS = {page: re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL) for page in PAGES}


@pytest.mark.parametrize("page", [page for page in PAGES if BLOCKS[page]], ids=lambda page: page.name)
def test_python_blocks_run_and_print_what_their_comments_say(page, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "__main__"}  # a block may go on from those above it
    for i, block in enumerate(BLOCKS[page]):
        exec(compile(block, f"{page.name}, block {i}", "exec"), namespace)
        plt.close("all")
        printed = capsys.readouterr().out.splitlines()
        promised = [
            line.split("# ", 1)[1].strip() for line in block.splitlines() if line.startswith("print(")
        ]
        assert printed == promised


def test_commands_of_the_readme_run(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "README.md").read_text()
    commands = re.findall(r"^railenv (.+)$", text, re.MULTILINE)
    assert len(commands) >= 5
    for command in commands:
        result = CliRunner().invoke(cli.app, command.split())
        assert result.exit_code == 0, result.output


def test_table_of_the_readme_is_the_reports():
    section = CriticalSpeeds()
    data = {
        piece.name: piece.function(**{**piece.inputs, "radii": [1000.0]}) for piece in section.pieces()
    }
    rows = [
        f"| {' | '.join(HEADINGS)} |",
        f"|---|{'---:|' * (len(HEADINGS) - 1)}",
        *(f"| {' | '.join(row)} |" for row in section.rows(data)),
        "",
        f"{TITLE}; {CAPTION}.",
    ]
    assert "\n".join(rows) in (ROOT / "README.md").read_text()


def test_vehicle_page_is_generated_from_the_metadata():
    result = CliRunner().invoke(cli.app, ["vehicles", "--markdown"])
    assert result.output == (ROOT / "docs" / "vehicles.md").read_text()


def test_links_between_the_pages_lead_somewhere():
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text()):
            if not target.startswith("http"):
                assert (page.parent / target).exists(), f"{page.name}: {target}"
