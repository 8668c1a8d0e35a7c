"""What an error of the system becomes: its own words, and a remedy where the disk is full."""

import errno
import os

import pytest

from femgear.storage.disk_errors import storage_error


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_a_full_disk_says_so(number):
    error = storage_error(OSError(number, os.strerror(number)), "out/static.nc")
    assert error.code == "E-DISK-FULL" and os.strerror(number) in str(error) and "out/static.nc" in str(error)
    assert "free some space" in str(error)


@pytest.mark.parametrize(
    ("error", "text"),
    [(OSError(errno.EACCES, "Permission denied"), "Permission denied"), (OSError("odd"), "odd")],
)
def test_another_error_keeps_its_words(error, text):
    found = storage_error(error, None)
    assert found.code == "E-STORAGE" and text in str(found)
    assert "space" not in str(found) and "None" not in str(found)
