"""What README and docs say is what the code does."""

import doctest
import re
import shlex
import tomllib

import matplotlib.pyplot as plt
import pytest
from typer.main import get_command
from typer.testing import CliRunner

from design.reproduction.sections.critical_speeds import CAPTION, HEADINGS, TITLE, CriticalSpeeds
from railenv import cli
from railenv.vehicles.lookup import named
from tests.pages import DOCS, ROOT, script

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md"))]
TEXTS = {page: page.read_text(encoding="utf-8") for page in PAGES}
IDS = {page: str(page.relative_to(ROOT)) for page in PAGES}
NEEDS_RL = re.compile(r"stable_baselines3|agents\.(train|resume|search_policy)\b")
NOT_INSTALLED = re.compile(r"^(from|import) (d3rlpy|ray|sbx|skrl|tianshou|torchrl)\b", re.MULTILINE)
"""What no extra installs; such code is only compiled."""


BLOCKS = {
    page: re.findall(r"^ *```([^\n]*)\n(.*?)^ *```$", text, re.DOTALL | re.MULTILINE)
    for page, text in TEXTS.items()
}
DIRECTIVES = {"{toctree}", "{include} ../CHANGELOG.md", "{include} ../CONTRIBUTING.md"}


def blocks(page, kind):
    """Return the fenced blocks of a kind; "" is those without one."""
    return [text for found, text in BLOCKS[page] if found == kind]


def write_files(page, folder):
    """Write the blocks of a page that are files: their first line is a comment with a name."""
    for block in blocks(page, "toml"):
        if found := re.match(r"# ([\w.]+\.toml)\n", block):
            (folder / found[1]).write_text(block)


def pages_with(kind):
    return [pytest.param(page, id=IDS[page]) for page in PAGES if blocks(page, kind)]


def test_every_block_is_of_a_kind_that_is_tested():
    for page in PAGES:
        assert TEXTS[page].count("```") == 2 * len(BLOCKS[page]), IDS[page]
        assert {kind for kind, _ in BLOCKS[page]} <= {"", "console", "python", "toml"} | DIRECTIVES


@pytest.mark.parametrize("page", pages_with("python"))
def test_python_blocks_run_and_print_what_their_comments_say(page, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    write_files(page, tmp_path)
    namespace = {"__name__": "__main__"}  # a block may go on from those above it
    for i, block in enumerate(blocks(page, "python")):
        name = f"{page.name}, block {i}"
        if block.startswith(">>>"):
            test = doctest.DocTestParser().get_doctest(block, {}, name, None, 0)
            assert doctest.DocTestRunner().run(test).failed == 0
            continue
        code = compile(block, name, "exec")
        if NOT_INSTALLED.search(block):
            continue
        if NEEDS_RL.search(block):
            pytest.importorskip("stable_baselines3", reason="needs the extra rl")
        exec(code, namespace)
        plt.close("all")
        printed = capsys.readouterr().out.splitlines()
        promised = [
            line.split("# ", 1)[1].strip() for line in block.splitlines() if line.startswith("print(")
        ]
        assert printed == promised


@pytest.mark.parametrize("page", pages_with("toml"))
def test_toml_blocks_are_vehicles(page, tmp_path):
    for block in blocks(page, "toml"):
        (tmp_path / "mine.toml").write_text(block)
        vehicle = named(str(tmp_path / "mine.toml"))
        assert vehicle.name == tomllib.loads(block)["name"]


# ----------------------------------------------------------------------------- commands


def commands(page):
    """Return the command lines of a page: those of its blocks, without prompts and comments."""
    text = "".join(blocks(page, "")) + "".join(blocks(page, "console"))
    lines = text.replace("\\\n", " ").splitlines()
    return [program(line.removeprefix("$ ")) for line in lines if line.strip()]


def program(line):
    """Split a command line into words, without settings of the environment before them."""
    words = shlex.split(line, comments=True)
    while "=" in words[0]:
        words = words[1:]
    return words


def pages_that_run(name):
    chosen = [page for page in PAGES if any(words[0] == name for words in commands(page))]
    return [pytest.param(page, id=IDS[page]) for page in chosen]


def shortened(words):
    """Return a command in a form that takes seconds; None where there is none."""
    if words[0] in ("reproduce", "explore") or "--resume" in words:
        return None
    if words[0] in ("tune", "evaluate") and "--problem" in words:
        return None  # minutes; tests/railenv/cli/test_problems.py has them
    if words[0] == "train-through":
        return [*words, "--evaluations", "1"]
    if words[0] == "train":
        pytest.importorskip("yaml", reason="needs the extra rl")
        return [*words, "--show"]  # reads and checks the recipe
    if words[0] == "map":
        return [re.sub(r":40\b", ":2", word) for word in words]
    return words


def parsed(words):
    """Parse a command as the command line does, and run nothing."""
    words = [re.sub(r"\$\w+", "1", word) for word in words]  # a shell's variables
    command = get_command(cli.app).commands[words[0]]
    command.make_context(words[0], words[1:])
    return words


@pytest.mark.parametrize("page", pages_that_run("railenv"))
def test_commands_run(page, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text('base = "HIGH_SPEED_COACH"\nname = "mine"\n')
    write_files(page, tmp_path)
    for name, *words in commands(page):
        if name != "railenv" or (short := shortened(parsed(words))) is None:
            continue
        result = CliRunner().invoke(cli.app, short)
        assert result.exit_code == 0, f"{words}: {result.output}"


def options_of(command):
    """Return the options of a command, those that switch something off among them."""
    return {o for p in command.params for o in (*p.opts, *p.secondary_opts)}


def test_commands_in_sentences_exist():
    known = get_command(cli.app).commands
    found = 0
    for page in PAGES:
        for text in re.findall(r"`railenv ([^`]+)`", TEXTS[page].replace("\n", " ")):
            name, *words = shlex.split(text)
            assert name in known or name.startswith("-"), f"{IDS[page]}: railenv {text}"
            options = options_of(known[name]) if name in known else {name}
            unknown = {word for word in words if word.startswith("-")} - options - {"--help"}
            assert not unknown, f"{IDS[page]}: railenv {text}"
            found += 1
    assert found > 10


def test_other_commands_name_what_exists():
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    programs = set()
    for page in PAGES:
        for words in commands(page):
            programs.add(words[0].rpartition("/")[2])
            if words[0] == "make":
                assert set(words[1:]) <= targets, IDS[page]
        for name in re.findall(r"`make ([a-z-]+)", TEXTS[page]):
            assert name in targets, f"{IDS[page]}: make {name}"
        for names in re.findall(r"(?:\.|railenv)\[([a-z,0-9]+)\]'", TEXTS[page]):
            assert set(names.split(",")) <= set(project["optional-dependencies"]), IDS[page]
        for name in re.findall(r"`?python -m ((?:examples|benchmarks|railenv)[\w.]*)", TEXTS[page]):
            assert (ROOT / f"{name.replace('.', '/')}.py").exists(), f"{IDS[page]}: {name}"
        for name in re.findall(
            r"`(?:python )?((?:examples|benchmarks|docs|notebooks)/[\w/.-]+\.\w+)`", TEXTS[page]
        ):
            assert (ROOT / name).exists(), f"{IDS[page]}: {name}"
    assert programs <= {"make", "pip", "python", "railenv"}


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
        for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", TEXTS[page]):
            if not target.startswith("http"):
                assert (page.parent / target).exists(), f"{IDS[page]}: {target}"


def test_page_of_vehicle_files_is_generated_from_the_metadata():
    text = (DOCS / "vehicle-files.md").read_text(encoding="utf-8")
    assert script("make_vehicle_files").page(text) == text
