"""Windows of whole numbers, as they are read and as the JSON schema tells them."""

import pytest

from femgear.case.quantities import Count
from femgear.errors import CaseError


@pytest.mark.parametrize(("signed", "least"), [(False, 10), (True, -5000)])
def test_the_schema_takes_what_the_reader_takes(signed, least):
    """Negative teeth are ISO 21771's way to write an internal gear; they are read as positive."""
    count = Count(10, 5000, signed=signed)
    assert count.schema == {"type": "integer", "minimum": least, "maximum": 5000}
    assert count.read(10) == 10 and count.read(5000) == 5000 and count.read(abs(least)) == abs(least)
    if signed:
        assert count.read(least) == 5000 and count.read(-10) == 10
    for wrong in (9, 5001, least - 1, 0, True, 27.0, "27"):
        with pytest.raises(CaseError):
            count.read(wrong)
