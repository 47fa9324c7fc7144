"""Stamps tell which numbers of the documentation are older than their sources."""

from pathlib import Path

import pytest

from tools import renew
from tools.renew import RECORDS, Record, stale
from tools.sources import ROOT, code_hash, imported_by, importers_of


@pytest.fixture
def tree(tmp_path):
    """A repository of two modules, of which one imports the other."""
    package = tmp_path / "src" / "polychirp"
    package.mkdir(parents=True)
    (package / "law.py").write_text('"""A law."""\n\ndef double(x):\n    return 2 * x\n')
    (package / "user.py").write_text("from polychirp.law import double\n\nFOUR = double(2)\n")
    (package / "other.py").write_text("FIVE = 5\n")
    return tmp_path


LAW, USER, OTHER = (Path("src/polychirp") / f"{name}.py" for name in ("law", "user", "other"))


def changed_hash(tree, file, old, new):
    """Hash of the user's code after a change; the caches are of another root each time."""
    path = tree / file
    path.write_text(path.read_text().replace(old, new))
    moved = tree.rename(tree.with_name(f"{tree.name}-{len(new)}"))
    return code_hash([USER], moved)


def test_a_change_of_what_a_program_imports_changes_its_hash(tree):
    before = code_hash([USER], tree)
    assert changed_hash(tree, LAW, "2 * x", "2.0 * x") != before


def test_a_change_of_words_or_of_other_files_does_not(tree):
    before = code_hash([USER], tree)
    (tree / OTHER).write_text("FIVE = 6\n")
    assert changed_hash(tree, LAW, "A law.", "The law of doubling.") == before


def test_a_change_of_the_number_of_threads_does_not(tree):
    """Times alone depend on it; other decorators count."""
    (tree / "src/polychirp/threads.py").write_text("def one_thread():\n    return lambda f: f\n")
    before = code_hash([LAW], tree)
    decorated = "from polychirp.threads import one_thread\n\n@one_thread()\ndef double"
    path = tree / LAW
    path.write_text(path.read_text().replace("def double", decorated))
    alike = tree.rename(tree.with_name("alike"))
    assert code_hash([LAW], alike) == before
    (alike / LAW).write_text((alike / LAW).read_text().replace("@one_thread()", "@other()"))
    assert code_hash([LAW], alike.rename(alike.with_name("differs"))) != before


def test_the_graph_knows_both_directions(tree):
    assert imported_by([USER], tree) == {LAW, USER}
    assert importers_of(LAW, tree) == {LAW, USER}


def test_a_public_name_stands_for_the_module_that_defines_it(tree):
    """The package imports its public names when they are used, which its own code hides."""
    package = tree / "src" / "polychirp"
    (package / "__init__.py").write_text("")
    (package / "__init__.pyi").write_text("from polychirp.law import double as double\n")
    (tree / USER).write_text("from polychirp import double\n\nFOUR = double(2)\n")
    assert LAW in imported_by([USER], tree)
    assert OTHER not in imported_by([USER], tree)


def test_a_record_without_its_stamp_is_stale():
    record = Record(name="law", command=(), starts=("tools/sources.py",), minutes=1)
    assert stale([record], {}) == [record]
    assert stale([record], {"law": {"code": "0"}}) == [record]
    assert stale([record], {"law": {"code": record.hash()}}) == []


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: record.name)
def test_every_record_starts_from_files_that_exist(record):
    assert all((ROOT / start).exists() for start in record.starts)
    assert all((renew.IMAGES / figure).exists() for figure in record.copied)


def test_comparisons_start_from_the_tests_that_compare():
    (record,) = (record for record in RECORDS if record.name == "comparisons")
    assert "tests/conftest.py" in record.starts
    assert "tests/physics/test_rcs.py" in record.starts
    assert str(Path(__file__).relative_to(ROOT)) not in record.starts


def test_an_unknown_record_is_refused(capsys):
    with pytest.raises(SystemExit) as ended:
        renew.main(["nonsense"])
    assert ended.value.code == 2
    assert "there is no record 'nonsense'" in capsys.readouterr().err
