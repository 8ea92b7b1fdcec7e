# SPDX-License-Identifier: BSD-3-Clause
"""Case 10: a file is whole or not there; what was there stays when the new one cannot be written."""

from __future__ import annotations

import errno
import os
import stat
import threading
from pathlib import Path
from typing import NoReturn

import pytest

from swarmevo.errors import OutputError
from swarmevo.runs import files
from swarmevo.views.replay import video


def no_space(*_: object) -> NoReturn:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def everything(folder: Path) -> dict[str, bytes | None]:
    """Return all that is in a folder, however deep."""
    return {str(path): path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


# ---- the mechanism ---------------------------------------------------------------------------------------------------


def test_a_file_is_written(tmp_path: Path) -> None:
    files.write(tmp_path / "a", "\u00e4")
    files.write(tmp_path / "a", "\udcff\u00f6")
    assert (tmp_path / "a").read_bytes() == "\\udcff\u00f6".encode()
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("before", [None, "old"])
@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_what_was_there_stays_when_writing_fails(tmp_path: Path, before: str | None, error: BaseException) -> None:
    file = tmp_path / "page.html"
    if before:
        file.write_text(before)
    there = everything(tmp_path)

    def half() -> None:
        with files.opened(file) as stream:
            stream.write("ne")
            raise error

    expected = OutputError if isinstance(error, OSError) else KeyboardInterrupt
    with pytest.raises(expected) as raised:
        half()
    if expected is OutputError:
        assert str(raised.value) == f"no space left on {tmp_path}; free some, then try again"
    assert everything(tmp_path) == there


def test_a_disk_that_is_full_at_the_very_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where blocks are allocated late, only the last flush tells."""
    monkeypatch.setattr(os, "fsync", no_space)
    with pytest.raises(OutputError, match="no space left"):
        files.write(tmp_path / "a", "new")
    assert list(tmp_path.iterdir()) == []


def test_a_new_file_never_replaces_another(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("mine")
    with (
        pytest.raises(OutputError, match="exists already and is never overwritten"),
        files.opened(tmp_path / "a", True),
    ):
        pass
    assert everything(tmp_path) == {str(tmp_path / "a"): b"mine"}


def test_a_link_is_followed(tmp_path: Path) -> None:
    """Case 12: the link stays one, and the original is the new file."""
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to("there/file")
    for text in ("made", "replaced"):
        files.write(tmp_path / "link", text)
        assert (tmp_path / "link").is_symlink()
        assert (tmp_path / "there" / "file").read_text() == text
    assert len(list((tmp_path / "there").iterdir())) == 1


def test_permissions_are_those_of_any_new_file_or_stay(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        files.write(tmp_path / "a", "")
        (tmp_path / "b").write_text("")
        (tmp_path / "b").chmod(0o604)
        files.write(tmp_path / "b", "")
    finally:
        os.umask(before)
    assert [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in "ab"] == [0o640, 0o604]


def test_a_pipe_is_written_to(tmp_path: Path) -> None:
    pipe, read = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    files.write(pipe, "text")
    reader.join(10)
    assert read == ["text"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)


@pytest.mark.parametrize(
    ("name", "said"),
    [("x" * 300, "File name too long"), ("nowhere/a", "No such file or directory"), ("", "Is a directory")],
)
def test_a_file_that_cannot_be_is_one_line(tmp_path: Path, name: str, said: str) -> None:
    with pytest.raises(OutputError) as error:
        files.write(tmp_path / name, "")
    assert str(error.value) == f"{tmp_path / name}: {said}"
    assert list(tmp_path.iterdir()) == []


def test_folders_that_were_made_go_when_nothing_gets_into_them(tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    with pytest.raises(OutputError), files.folder_made(tmp_path / "old" / "new" / "newer"):
        files.write(tmp_path / "old" / "new" / "newer" / ("x" * 300), "")
    assert list(everything(tmp_path)) == [str(tmp_path / "old")]


def test_a_film_that_cannot_be_finished_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def half(file: Path, *_: object) -> None:
        file.write_bytes(b"RIFF")
        no_space()

    monkeypatch.setattr(video, "check", lambda file: None)
    monkeypatch.setattr(video, "_WRITERS", {".webp": half})
    with pytest.raises(OutputError, match=f"^no space left on {tmp_path}; free some, then try again$"):
        video.write(tmp_path / "film.webp", "", video.Film(0, 1), lambda done: None)
    assert list(tmp_path.iterdir()) == []
