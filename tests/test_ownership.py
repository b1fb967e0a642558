"""Machine code and modules are read only from where nobody else could have put them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from symgen.runtime.code import cache
from symgen.runtime.code.cache import distrust, foreign_below, make_private, read_own

pytestmark = pytest.mark.skipif(os.name != "posix", reason="permissions of POSIX")
ROOT = Path(__file__).parents[1]
NOBODY = 65534


@pytest.fixture
def others(tmp_path, monkeypatch):
    """Give a file to another user: truly where the tests may, else by pretending to be somebody else."""

    def give(path: Path) -> None:
        if os.geteuid() == 0:
            os.chown(path, NOBODY, NOBODY, follow_symlinks=False)
        else:
            uid = os.geteuid()
            before = Path.lstat
            changed = {path.absolute()}
            monkeypatch.setattr(
                Path, "lstat", lambda p: _owned(before(p), uid + 1) if p.absolute() in changed else before(p)
            )

    return give


def _owned(status: os.stat_result, uid: int) -> os.stat_result:
    numbers = list(status)
    numbers[4] = uid
    return os.stat_result(numbers)


@pytest.fixture
def folder(tmp_path):
    own = tmp_path / "above" / "cache"
    make_private(own)
    return own


def test_own_folder_is_trusted_whatever_the_umask(tmp_path):
    before = os.umask(0)
    try:
        make_private(tmp_path / "a" / "b")
    finally:
        os.umask(before)
    assert distrust(tmp_path / "a" / "b") == ""


@pytest.mark.parametrize("which", ["itself", "above"])
@pytest.mark.parametrize(("mode", "says"), [(0o770, "its group"), (0o702, "everybody"), (0o722, "everybody")])
def test_folder_that_others_can_write(folder, which, mode, says):
    (folder if which == "itself" else folder.parent).chmod(mode)
    assert f"can be written by {says}" in distrust(folder)


def test_sticky_bit_protects_what_lies_in_a_folder_only(folder):
    folder.parent.chmod(0o1777)
    assert distrust(folder) == ""
    folder.chmod(0o1777)
    assert "everybody" in distrust(folder)


@pytest.mark.parametrize("which", ["itself", "above"])
def test_folder_of_another_user(folder, which, others):
    others(folder if which == "itself" else folder.parent)
    assert "another user" in distrust(folder)


def test_links_are_followed_and_judged(folder, tmp_path, others):
    link = tmp_path / "link"
    link.symlink_to(folder)
    assert distrust(link) == ""
    assert distrust(link / ".." / "cache") == ""
    folder.parent.chmod(0o770)
    assert "its group" in distrust(link)
    folder.parent.chmod(0o700)
    others(link)
    assert "another user" in distrust(link)
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    assert "symbolic links" in distrust(loop)


def test_file_must_be_plain_and_ones_own(folder, others):
    file = folder / "file"
    assert read_own(file) == (None, "")
    file.write_bytes(b"x")
    file.chmod(0o600)
    assert read_own(file) == (b"x", "")
    file.chmod(0o620)
    assert "its group" in read_own(file)[1]
    (folder / "link").symlink_to(file)
    assert read_own(folder / "link")[0] is None
    os.mkfifo(folder / "fifo")
    assert "no regular file" in read_own(folder / "fifo")[1]
    if os.geteuid() == 0:
        file.chmod(0o600)
        others(file)
        assert "another user" in read_own(file)[1]
        assert foreign_below(folder)


def test_planted_object_is_made_anew_with_a_word(folder):
    path = folder / "object"
    cache.store(path, b"planted")
    assert cache.fetch(path) == b"planted"
    path.chmod(0o660)
    with pytest.warns(cache.CacheWarning, match="made anew"):
        assert cache.fetch(path) is None
    assert not path.exists()


@pytest.mark.parametrize("part", ["", "kernels", "modules"])
def test_run_uses_nothing_from_a_folder_open_to_its_group(tmp_path, part):
    own = tmp_path / "cache"
    make_private(own / part)
    (own / part).chmod(0o770)
    script = f"from symgen.runtime.code.cache import cache_folder; print(cache_folder({part or 'kernels'!r}))"
    environment = {**os.environ, "SYMGEN_CACHE_DIR": str(own), "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
    assert not done.stdout.startswith(str(own))
    assert done.stderr.count("can be written by its group") == 1
    assert not Path(done.stdout.strip()).exists()  # the private folder ends with the process
