"""Limits of a case text: what they allow is read, one more is refused."""

import pytest

from femgear.case.text import check_tree, dotted, parse, read_text
from femgear.errors import CaseError

# the table of the file and the number are the first and the last level
DEEP = {
    "lists": lambda levels: "a = " + "[" * (levels - 2) + "1" + "]" * (levels - 2),
    "tables": lambda levels: "[" + ".".join(["a"] * (levels - 2)) + "]\nb = 1",
}


def refused(text, code):
    with pytest.raises(CaseError) as caught:
        parse(text, "case.toml")
    assert caught.value.code == code
    return caught.value.limit


@pytest.mark.parametrize("line", ["[[a]]\n", "[k{i}]\n", "k{i} = 1\n"], ids=["list of tables", "tables", "numbers"])
def test_entries_of_a_table_or_list_of_tables(line):
    lines = [line.format(i=i) for i in range(1001)]
    read = parse("".join(lines[:1000]), "")
    assert len(read.get("a", read)) == 1000
    assert "at most 1000 of a table" in refused("".join(lines), "E-RANGE")


@pytest.mark.parametrize("other", [0, 50_000])
def test_entries_of_all_lists_together(other):
    """The lists are entries themselves."""
    data = {"a": [1] * (119_998 - other), "b": [1] * other}
    assert check_tree(data, "") == []
    data["a"].append(1)
    with pytest.raises(CaseError, match="too many") as caught:
        check_tree(data, "")
    assert "120000 of all together" in caught.value.limit


def test_keys():
    assert refused("b = 1\n" * 30_001, "E-RANGE") == "30000 keys and tables"
    # repeated, and only therefore refused
    refused("b = 1\n" * 30_000, "E-TOML")


@pytest.mark.parametrize("part", ["a", '"a b"', "'a'"])
def test_long_keys(part):
    """Of eight parts, seven of which end in a dot."""
    lines = [".".join([part] * 7) + f".k{i} = 1\n" for i in range(101)]
    parse("".join(lines[:100]), "")
    assert refused("".join(lines), "E-TOML") == "32 levels"
    # six dots are no long key
    parse("".join(line.replace(part + ".", "", 1) for line in lines), "")


@pytest.mark.parametrize("kind", DEEP)
def test_levels(kind):
    parse(DEEP[kind](32), "")
    assert refused(DEEP[kind](33), "E-TOML") == "32 levels"


def test_bytes_of_a_file(tmp_path):
    path = tmp_path / "case.toml"
    path.write_bytes(b"#" * 1_000_000)
    assert len(read_text(path)) == 1_000_000
    path.write_bytes(b"#" * 1_000_001)
    with pytest.raises(CaseError, match="too long") as caught:
        read_text(path)
    assert caught.value.limit == "1000000 bytes"


def test_characters_of_a_key_that_are_shown():
    assert dotted(("a" * 200, 3, "b" * 201)) == "a" * 200 + "[3]." + "b" * 200
