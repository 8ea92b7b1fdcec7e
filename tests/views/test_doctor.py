# SPDX-License-Identifier: BSD-3-Clause
"""The doctor sees a library that is older than the sources beside it."""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from swarmevo import simulation
from swarmevo.views import console, doctor
from swarmevo.views.doctor import Finding

ROOT = Path(__file__).parents[2]


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    for folder in ("src/world", "include"):
        (tmp_path / "native" / folder).mkdir(parents=True)
    (tmp_path / "native" / "src" / "b.cpp").write_bytes(b"int b;")
    (tmp_path / "native" / "src" / "b.cpp.orig").write_bytes(b"an editor's")
    (tmp_path / "native" / "src" / "world" / "c.hpp").write_bytes(b"int c;")
    (tmp_path / "native" / "include" / "a.h").write_bytes(b"int a;")
    return tmp_path


def examine(checkout: Path, build: str, monkeypatch: pytest.MonkeyPatch) -> list[Finding]:
    monkeypatch.setattr(simulation, "library_info", lambda: {"build": build})
    return list(doctor._sources(checkout))


def test_the_hash_by_hand(checkout: Path) -> None:
    listed = (
        f"{hashlib.sha256(b'int a;').hexdigest()}  native/include/a.h\n"
        f"{hashlib.sha256(b'int b;').hexdigest()}  native/src/b.cpp\n"
        f"{hashlib.sha256(b'int c;').hexdigest()}  native/src/world/c.hpp\n"
    )
    assert doctor.sources_hash(checkout) == hashlib.sha256(listed.encode()).hexdigest()[:16]


def test_a_library_of_these_sources_is_sound(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert examine(checkout, f"ODE 1, sources {doctor.sources_hash(checkout)}", monkeypatch) == []


@pytest.mark.parametrize(
    ("build", "built"),
    [("ODE 1, sources 0123456789abcdef", "0123456789abcdef"), ("ODE 1", "older ones")],
)
def test_a_library_of_other_sources_is_a_warning(
    build: str, built: str, checkout: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (finding,) = examine(checkout, build, monkeypatch)
    assert not finding.is_fault
    console.show_findings([finding])
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith("warn  sources: ")
    assert first.endswith(f" is {doctor.sources_hash(checkout)}, the library was built from {built}")
    assert second == f"      what to do: {doctor.REINSTALL}"


def test_nothing_is_said_where_there_is_nothing_to_compare(
    checkout: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> None:
        raise simulation.SimulatorError("cannot be loaded")

    assert examine(tmp_path / "site-packages", "ODE 1, sources 0123456789abcdef", monkeypatch) == []
    monkeypatch.setattr(simulation, "library_info", fail)
    assert list(doctor._sources(checkout)) == []


@pytest.mark.skipif(not shutil.which("cmake") or not shutil.which("ninja"), reason="needs CMake and Ninja")
def test_a_build_has_the_hash_also_after_a_change(tmp_path: Path) -> None:
    for name in ("native/src", "native/include", "configs"):
        shutil.copytree(ROOT / name, tmp_path / name)
    shutil.copy(ROOT / "CMakeLists.txt", tmp_path)
    build = tmp_path / "build"
    configure = ["cmake", "-S", str(tmp_path), "-B", str(build), "-G", "Ninja"]
    subprocess.run([*configure, "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"], check=True, capture_output=True)

    def built() -> set[str]:
        return set(re.findall(r"SWARMEVO_SOURCES=\W*(\w+)", (build / "compile_commands.json").read_text()))

    first = doctor.sources_hash(tmp_path)
    assert built() == {first}
    with (tmp_path / "native" / "src" / "rng.hpp").open("a") as header:
        header.write("// changed\n")
    (tmp_path / "native" / "src" / "world" / "new.hpp").write_text("#pragma once\n")
    subprocess.run(["ninja", "-C", str(build), "build.ninja"], check=True, capture_output=True)
    assert built() == {doctor.sources_hash(tmp_path)} != {first}
