"""The notebooks run, in a shorter form, and are stored without outputs."""

import re

import nbformat
import pytest
from nbclient import NotebookClient

from tests.pages import DOCS, ROOT

NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))


@pytest.fixture(params=NOTEBOOKS, ids=lambda path: path.stem)
def notebook(request):
    return request.param


def test_notebook_runs(notebook, monkeypatch):
    if notebook.stem == "training-a-policy":
        pytest.importorskip("stable_baselines3")
    monkeypatch.setenv("RAILENV_FAST", "1")
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    content = nbformat.read(notebook, as_version=4)
    NotebookClient(
        content,
        timeout=300,
        kernel_name="python3",
        resources={"metadata": {"path": ROOT / "notebooks"}},
    ).execute()
    pictures = [
        output
        for cell in content.cells
        for output in cell.get("outputs", [])
        if "image/png" in output.get("data", {})
    ]
    assert len(pictures) == sum("plt.show()" in cell.source for cell in content.cells)


def test_notebook_is_stored_without_outputs(notebook):
    content = nbformat.read(notebook, as_version=4)
    code = [cell for cell in content.cells if cell.cell_type == "code"]
    assert all(not cell.outputs and cell.execution_count is None for cell in code)


def test_documentation_links_to_it_and_its_links_lead_somewhere(notebook):
    assert f"](../notebooks/{notebook.name})" in (DOCS / "index.md").read_text(encoding="utf-8")
    content = nbformat.read(notebook, as_version=4)
    text = "\n".join(cell.source for cell in content.cells if cell.cell_type == "markdown")
    for target in re.findall(r"\]\(([^)#]+)", text):
        assert (notebook.parent / target).exists(), target
