"""Processes, hosts and installations of every kind; each case is a process of its own."""

import compileall
import multiprocessing
import os
import shutil
import subprocess
import sys

import pytest

from tests.pages import ROOT

TIMEOUT = 300.0  # s, compiling included

ENVIRONMENT = """
import os
import gymnasium
import numpy as np
import railenv

def vector(n=1024):
    return gymnasium.make_vec("railenv/Bogie-v1", n, speed_range=(60.0, 100.0), tangent_share=1.0)

def stepped(env, n):
    env.reset(seed=0)
    for _ in range(n):
        observations = env.step(np.zeros(env.action_space.shape, np.float32))[0]
    return observations.copy()
"""

SMALL = """
import railenv

def equations(x, u, speed, curvature, cant, p):
    return [p.k * x[0]]

print(railenv.Model("small", ["x"], [], equations, {"k": 2.0}).rhs([1.0], speed=1.0))
"""


def python(code, folder, environment=None, **variables):
    """Run a script in a process of its own, with these packages."""
    script = folder / "script.py"
    script.write_text(code, encoding="utf-8")
    if environment is None:
        environment = dict(os.environ)
    return subprocess.run(
        [sys.executable, script],
        cwd=folder,
        env={"PYTHONPATH": str(ROOT), **environment, **variables},
        capture_output=True,
        text=True,
        check=False,
        timeout=TIMEOUT,
    )


def output(code, folder, environment=None, **variables):
    done = python(code, folder, environment, **variables)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


# --------------------------------------------------------------------- processes, threads

CHILDREN = """
import multiprocessing
import sys

def child(expected):
    sys.exit(0 if np.array_equal(stepped(vector(), 3), expected) else 3)

def main(method):
    env = vector()
    expected = stepped(env, 3)  # threads are at work in the parent
    context = multiprocessing.get_context(method)
    children = [context.Process(target=child, args=(expected,)) for _ in range(2)]
    for process in children:
        process.start()
    again = stepped(env, 3)
    for process in children:
        process.join()
    assert np.array_equal(again, expected)
    print([process.exitcode for process in children])

if __name__ == "__main__":
    main(METHOD)
"""


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_children_step_environments_as_their_parent_does(tmp_path, method):
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip(f"no {method} here")
    code = ENVIRONMENT + CHILDREN.replace("METHOD", repr(method))
    assert output(code, tmp_path, RAILENV_NUM_THREADS="3").strip() == "[0, 0]"


FORK_OF_A_THREAD = """
import sys
import threading

env = vector()
expected = stepped(env, 3)
stop = threading.Event()

def forever():
    mine = vector()
    while not stop.is_set():
        stepped(mine, 3)

thread = threading.Thread(target=forever)
thread.start()
codes = []
for _ in range(10):  # some while the other thread is in the middle of a step
    pid = os.fork()
    if pid == 0:
        os._exit(0 if np.array_equal(stepped(env, 3), expected) else 3)
    codes.append(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
stop.set()
thread.join()
print(codes)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_fork_in_the_middle_of_a_step_of_another_thread(tmp_path):
    found = output(ENVIRONMENT + FORK_OF_A_THREAD, tmp_path, RAILENV_NUM_THREADS="3")
    assert found.strip() == str([0] * 10)


TWO_THREADS = """
from concurrent.futures import ThreadPoolExecutor

with ThreadPoolExecutor(2) as executor:
    first, second = executor.map(lambda n: stepped(vector(n), 20), (512, 512))
print(np.array_equal(first, second))
"""


@pytest.mark.parametrize("layer", ["workqueue", "omp"])
def test_two_threads_with_512_environments_each(tmp_path, layer):
    code = ENVIRONMENT + TWO_THREADS
    found = output(code, tmp_path, RAILENV_NUM_THREADS="2", NUMBA_THREADING_LAYER=layer)
    assert found.strip() == "True"


ENDS = """
import threading

env = vector()
stepped(env, 3)

def forever():
    while True:
        stepped(env, 3)

threading.Thread(target=forever, daemon=True).start()
print("ends", flush=True)
"""


def test_the_interpreter_ends_while_a_daemon_steps(tmp_path):
    assert output(ENVIRONMENT + ENDS, tmp_path, RAILENV_NUM_THREADS="3").strip() == "ends"


AT_EXIT = """
import atexit

env = vector()
atexit.register(lambda: print(stepped(env, 2).shape[0]))  # no thread can be started any more
"""


def test_an_environment_is_stepped_at_exit(tmp_path):
    assert output(ENVIRONMENT + AT_EXIT, tmp_path, RAILENV_NUM_THREADS="3").strip() == "1024"


INTERRUPTED = """
import signal
import threading
import time

# what starts tests in the background lets them ignore interrupts
signal.signal(signal.SIGINT, signal.default_int_handler)
env = vector()
stepped(env, 3)
times = 0
for k in range(20):
    timer = threading.Timer(0.01, os.kill, (os.getpid(), signal.SIGINT))
    try:
        timer.start()
        while True:
            env.step(np.zeros(env.action_space.shape, np.float32))
    except KeyboardInterrupt:
        times += 1
    timer.join()
expected = stepped(vector(), 3)
print(times, np.array_equal(stepped(env, 3), expected))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_interrupts_from_the_keyboard_leave_everything_usable(tmp_path):
    found = output(ENVIRONMENT + INTERRUPTED, tmp_path, RAILENV_NUM_THREADS="2")
    assert found.strip() == "20 True"


# --------------------------------------------------------------------------------- hosts


def test_numba_that_compiles_nothing_is_told(tmp_path):
    done = python(SMALL, tmp_path, NUMBA_DISABLE_JIT="1")
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("railenv.errors.CompilationError: NUMBA_DISABLE_JIT is 1; it must be 0")


NOBODY = "import os\nos.setreuid(54321, 0)  # a user without an entry in passwd\n"


def left_in(folder):
    return [path.name for path in folder.iterdir() if path.name != "script.py"]


@pytest.mark.skipif(
    not (hasattr(os, "setreuid") and os.getuid() == 0), reason="only root can be another user"
)
def test_user_without_a_home_computes_and_leaves_nothing_behind(tmp_path):
    done = python(NOBODY + SMALL, tmp_path, {"TMPDIR": str(tmp_path)})
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[2.]"
    assert (
        "RuntimeWarning: compiled kernels cannot be kept in the user's cache directory" in done.stderr
    )
    assert "Set RAILENV_CACHE_DIR" in done.stderr
    assert left_in(tmp_path) == []


def test_cache_that_cannot_be_written_leaves_nothing_behind(tmp_path):
    obstacle = tmp_path / "script.py" / "kernels"  # below a file there can be no directory
    done = python(SMALL, tmp_path, TMPDIR=str(tmp_path), RAILENV_CACHE_DIR=str(obstacle))
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[2.]"
    assert done.stderr.count("RuntimeWarning: compiled kernels cannot be kept in") == 1
    assert left_in(tmp_path) == []


IN_A_CHILD = """
import multiprocessing

if __name__ == "__main__":
    process = multiprocessing.get_context(METHOD).Process(target=use)
    process.start()
    process.join()
    print(process.exitcode)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_children_whose_cache_cannot_be_written_leave_nothing_behind(tmp_path, method):
    body = SMALL.replace("print(", "def use():\n    print(")
    code = body + IN_A_CHILD.replace("METHOD", repr(method))
    obstacle = str(tmp_path / "script.py" / "kernels")
    found = output(code, tmp_path, TMPDIR=str(tmp_path), RAILENV_CACHE_DIR=obstacle)
    assert found.split() == ["[2.]", "0"]
    assert [name for name in left_in(tmp_path) if name.startswith("railenv")] == []


# -------------------------------------------------------------------------- installations

FROZEN = """
model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
assert railenv.__file__.endswith(".pyc"), railenv.__file__
print(model.rhs([1e-3] * model.n_states, speed=50.0).shape, stepped(vector(20), 2).shape[0])
"""


def test_byte_code_only(tmp_path):
    """As a frozen application has it: no source file of the packages is left."""
    for package in ("railenv", "design", "agents"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / package, tmp_path / package, ignore=ignored)
        assert compileall.compile_dir(tmp_path / package, legacy=True, quiet=2)
        for path in (tmp_path / package).rglob("*.py"):
            path.unlink()
    found = output(ENVIRONMENT + FROZEN, tmp_path, PYTHONPATH=str(tmp_path))
    assert found.strip() == "(24,) 20"


# ------------------------------------------------------------------------------ terminals


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["vehicles"],
        ["vehicles", "HIGH_SPEED_COACH"],
        ["critical-speed"],
        ["critical-speed", "--set", "conicity=½"],
        ["margins", "--controller", "lqr", "--speed", "100"],
        ["simulate", "--speed", "60", "--duration", "1"],
    ],
    ids=" ".join,
)
@pytest.mark.parametrize(
    "variables",
    [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}],
    ids=["ascii", "C locale"],
)
def test_commands_print_on_terminals_without_unicode(tmp_path, arguments, variables):
    inherited = {k: v for k, v in os.environ.items() if k not in ("PYTHONIOENCODING", "PYTHONUTF8")}
    done = subprocess.run(
        [sys.executable, "-m", "railenv.cli", *arguments],
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT), **inherited, **variables},
        capture_output=True,
        check=False,
        timeout=TIMEOUT,
    )
    said = done.stdout + done.stderr
    assert b"Traceback" not in said, said.decode(errors="replace")
    assert done.returncode == ("conicity=½" in arguments)
    assert said
    assert said.isascii()


def test_what_stands_for_a_character_can_be_read():
    code = (
        "from railenv.terminals import replace_what_cannot_be_shown as r; r(); "
        "print('12°, kg m², µ, α é Ω → ≤ 漢 \\udc80')"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "ascii"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == "12deg, kg m^2, u, alpha e omega -> <= ? ?"
