"""Files: written in full or not at all, and by one writer only."""

import ast
import os
import stat

import pytest

from grasp_planner.exceptions import FileFormatError
from grasp_planner.files import writing
from grasp_planner.files.writing import AppendedFile, replacing, take_lock, write_bytes, write_text
from tests.architecture import FILES, PACKAGE

BY_NAME = {"write_text", "write_bytes", "touch", "to_csv", "to_parquet", "tofile", "mkstemp", "mkdtemp"}
INTO = {"save", "savez", "savefig", "write_table", "export"}
OPEN_FILES = {"file", "buffer"}
MODES = {mode + kind for mode in ("w", "a", "x", "r+", "w+", "a+", "x+") for kind in ("", "b", "t")} | {"rb+", "wb+"}


def writes(call):
    """Return whether a call opens or writes a file by its name."""
    owner = getattr(getattr(call.func, "value", None), "id", None)
    name = getattr(call.func, "attr", getattr(call.func, "id", ""))
    method = isinstance(call.func, ast.Attribute) and owner not in ("writing", "webbrowser")
    if name in ("open", "fdopen"):
        given = {a.value for a in (*call.args, *(k.value for k in call.keywords)) if isinstance(a, ast.Constant)}
        return owner == "os" or bool(given & MODES)
    into_open = any(getattr(argument, "id", "") in OPEN_FILES for argument in call.args)
    return method and (name in BY_NAME or (name in INTO and bool(call.args) and not into_open))


def written_by(tree):
    """Return the lines of a module that open or write a file by its name."""
    return sorted(node.lineno for node in ast.walk(tree) if isinstance(node, ast.Call) and writes(node))


def test_nothing_else_opens_a_file_for_writing():
    found = {}
    for path in FILES:
        lines = written_by(ast.parse(path.read_text(encoding="utf-8")))
        if lines and path.parent != PACKAGE / "files":
            found[str(path.relative_to(PACKAGE))] = lines
    assert not found


@pytest.mark.parametrize(
    "line",
    ["path.write_text('a')", "open(p, 'w')", "p.open('ab')", "p.open(mode='r+')", "os.open(p, 1)", "np.save(path, a)"],
)
def test_the_search_sees_what_writes(line):
    assert written_by(ast.parse(line))
    assert not written_by(ast.parse("p.open('rb'); open(p); np.save(file, a); write_text(p, 'a')"))


def test_a_file_is_replaced_and_keeps_its_permissions(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(0o640)
    write_text(path, "nëw")
    assert path.read_text(encoding="utf-8") == "nëw" and stat.S_IMODE(path.stat().st_mode) == 0o640
    assert os.listdir(tmp_path) == ["a.txt"]  # noqa: PTH208


def test_a_link_keeps_pointing_at_its_file(tmp_path):
    (tmp_path / "real").mkdir()
    link = tmp_path / "link.txt"
    link.symlink_to(tmp_path / "real" / "a.txt")
    write_text(link, "new")
    assert link.is_symlink() and (tmp_path / "real" / "a.txt").read_text() == "new"


@pytest.mark.parametrize("fault", [OSError(28, "No space left on device"), KeyboardInterrupt(), ValueError("other")])
def test_what_goes_wrong_meanwhile_leaves_the_old_file(tmp_path, fault):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    with pytest.raises((FileFormatError, KeyboardInterrupt, ValueError)) as caught, replacing(path) as file:
        file.write(b"half")
        raise fault
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]
    if isinstance(fault, OSError):
        assert str(caught.value) == f"{path}: can't be written: No space left on device"


def test_a_full_disk_at_the_last_moment_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.bin"
    write_bytes(path, b"old")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writing.os, "fsync", full)
    with pytest.raises(FileFormatError, match="No space left"):
        write_bytes(path, b"new")
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["none/a.txt", ".", "a" * 300, "loop"])
def test_what_is_no_place_for_a_file_is_one_error(tmp_path, name):
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(FileFormatError, match="can't be written"):
        write_text(tmp_path / name, "text")


def test_a_device_is_written_directly_and_a_full_one_is_said(tmp_path):
    link = tmp_path / "null"
    link.symlink_to("/dev/null")
    write_text(link, "text")
    assert link.is_symlink()
    (tmp_path / "full").symlink_to("/dev/full")
    with pytest.raises(FileFormatError, match="No space left"):
        write_text(tmp_path / "full", "text")


def test_a_piece_that_is_not_written_in_full_is_taken_back(tmp_path, monkeypatch):
    file = AppendedFile(tmp_path / "log")
    file.append(b"one\n")

    def half(handle, data):
        os.write(handle, data[:2])
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(writing, "write_all", half)
        with pytest.raises(OSError, match="No space"):
            file.append(b"two\n")
    file.append(b"three\n")
    file.close()
    again = AppendedFile(tmp_path / "log")
    again.append(b"four\n")
    again.close()
    assert (tmp_path / "log").read_bytes() == b"one\nthree\nfour\n"


def test_a_lock_is_held_by_one(tmp_path):
    handle = take_lock(tmp_path / "lock")
    assert handle is not None and take_lock(tmp_path / "lock") is None
    os.close(handle)
    other = take_lock(tmp_path / "lock")
    assert other is not None
    os.close(other)
