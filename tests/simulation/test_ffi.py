# SPDX-License-Identifier: BSD-3-Clause
"""A stale, foreign or missing library is one clear error. Each case is a process of its own: a library stays loaded."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from swarmevo import simulation


def load_in_new_process(library: Path, before: str = "") -> str:
    """Return the error that loading ``library``, after some code, ends with; empty if there is none."""
    code = (
        f"{before}\n"
        "from swarmevo.simulation import SimulatorError, library_info\n"
        "try: library_info()\n"
        "except SimulatorError as error: print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "SWARMEVO_LIBRARY": str(library)},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.strip()


def copy_of_library(folder: Path) -> tuple[Path, Path]:
    """Copy library and header into ``folder`` and return both paths."""
    path = Path(simulation.library_info()["path"])
    return Path(shutil.copy(path, folder)), Path(shutil.copy(path.with_name("swarmevo.h"), folder))


def test_a_copy_loads(tmp_path: Path) -> None:
    library, _ = copy_of_library(tmp_path)
    assert load_in_new_process(library) == ""


def test_a_missing_library(tmp_path: Path) -> None:
    error = load_in_new_process(tmp_path / "nothing.so")
    assert "cannot load the native library" in error
    assert "reinstall" in error
    assert "\n" not in error


def test_a_file_that_is_no_library(tmp_path: Path) -> None:
    (tmp_path / "noise.so").write_bytes(os.urandom(1000))
    assert "cannot load the native library" in load_in_new_process(tmp_path / "noise.so")


@pytest.mark.skipif(not shutil.which("gcc"), reason="needs a C compiler")
@pytest.mark.parametrize(
    ("lacking", "advice"),
    [
        ("libode.so.8", "install libode8 (Debian, Ubuntu), or a wheel of swarmevo that has it inside (make wheel)"),
        ("libother.so.2", "install the package that has libother.so.2, or a wheel of swarmevo"),
    ],
)
def test_a_library_that_lacks_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lacking: str, advice: str
) -> None:
    """Where the system may have it, an empty file stands before it."""
    library, _ = copy_of_library(tmp_path)
    (tmp_path / "nothing.c").write_text("")
    make = ["gcc", "-shared", "-o", lacking, f"-Wl,-soname,{lacking}", "nothing.c"]
    link = ["gcc", "-shared", "-o", library.name, "-Wl,--no-as-needed", "nothing.c", "-L.", f"-l:{lacking}"]
    for command in (make, link):
        subprocess.run(command, cwd=tmp_path, check=True)
    (tmp_path / lacking).unlink()
    if lacking == "libode.so.8":
        (tmp_path / lacking).touch()
    monkeypatch.setenv("LD_LIBRARY_PATH", str(tmp_path))
    error = load_in_new_process(library)
    assert f"{lacking}: " in error
    assert f"; {advice}" in error
    assert "find_library" not in error


def test_a_library_of_somebody_else() -> None:
    error = load_in_new_process(Path("libm.so.6"))
    assert "not a swarmevo library" in error


def test_a_library_older_than_its_header(tmp_path: Path) -> None:
    library, header = copy_of_library(tmp_path)
    text = header.read_text()
    header.write_text(text.replace("#define SWE_ABI_VERSION ", "#define SWE_ABI_VERSION 9"))
    assert "expected ABI version 9" in load_in_new_process(library)
    header.write_text(text.replace("    double wall_height;", "    double wall_height, more;"))
    assert "swe_scene_config has" in load_in_new_process(library)


def test_a_library_of_another_version_that_lacks_a_function(tmp_path: Path) -> None:
    library, header = copy_of_library(tmp_path)
    text = header.read_text().replace("swe_abi_layout", "swe_abi_layout_of_later")
    header.write_text(text)
    assert "not a swarmevo library" in load_in_new_process(library)
    header.write_text(text.replace("#define SWE_ABI_VERSION ", "#define SWE_ABI_VERSION 9"))
    assert "expected ABI version 9" in load_in_new_process(library)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ("channels['smell'] = p.Channel(('robots',), '1', 'of cheese')", "smell with 1 values a robot, got none"),
        ("channels.popitem()", "none, got "),
        ("channels['rf'] = p.Channel(('robots', 2), '1', '')", "rf with 2 values a robot, got rf with 1 values a rob"),
    ],
)
def test_a_library_with_other_channels(change: str, expected: str) -> None:
    library = Path(simulation.library_info()["path"])
    code = f"import swarmevo.protocols as p\nchannels = dict(p.CHANNELS)\n{change}\np.CHANNELS = channels"
    error = load_in_new_process(library, code)
    assert f"expected the channel {expected}" in error
    assert "\n" not in error


def test_a_header_without_its_markers(tmp_path: Path) -> None:
    library, header = copy_of_library(tmp_path)
    header.write_text("/* nothing */")
    assert "markers are missing" in load_in_new_process(library)
