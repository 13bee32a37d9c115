"""The cases of ``make mutants`` keep up with the sources; the tool itself on a tree of one line."""

import mutants
import pytest


def test_every_line_of_a_mutant_is_there_once():
    cases = mutants.read_cases()
    assert len(cases) == len({(case.file, case.old) for case in cases})
    for case in cases:
        assert case.mutated(mutants.ROOT) != (mutants.ROOT / "fmu_src" / case.file).read_text("utf-8")
        for test in case.tests:
            file, _, name = test.partition("::")
            assert f"def {name}" in (mutants.ROOT / "tests" / file).read_text("utf-8")


def test_a_line_that_is_gone_or_there_twice_is_an_error(tmp_path):
    (tmp_path / "fmu_src").mkdir()
    (tmp_path / "fmu_src" / "law.py").write_text("a = 1\nb = 1\n")
    assert mutants.Case("law.py", "b = 1", "b = 2", ()).mutated(tmp_path) == "a = 1\nb = 2\n"
    for old, count in (("= 1", 2), ("c = 1", 0)):
        with pytest.raises(ValueError, match=f"is there {count} times; mend the case"):
            mutants.Case("law.py", old, "", ()).mutated(tmp_path)


def test_verdicts_of_a_small_tree(tmp_path, monkeypatch, capsys):
    """Tests that look kill the mutant, others let it survive; the source is whole again, nothing is judged twice."""
    (tmp_path / "fmu_src").mkdir()
    (tmp_path / "tests").mkdir()
    (tmp_path / "fmu_src" / "law.py").write_text("def law(x):\n    return 2 * x\n")
    rows = []
    for name in ("looks", "sleeps"):
        (tmp_path / "tests" / f"{name}.py").write_text("")
        rows.append(f"[[case]]\nfile = 'law.py'\nold = '2 *'\nnew = '3 *'\ntests = ['{name}.py']\n")
    (tmp_path / "tests" / "mutants.toml").write_text("\n".join(rows))
    runs = []

    def run_tests(tree, tests):
        runs.append(tests)
        wrong = "3 *" in (tree / "fmu_src" / "law.py").read_text("utf-8")
        return mutants.FAILED if wrong and tests == ("looks.py",) else mutants.PASSED

    monkeypatch.setattr(mutants, "ROOT", tmp_path)
    monkeypatch.setattr(mutants, "CASES", tmp_path / "tests" / "mutants.toml")
    monkeypatch.setattr(mutants, "WORKSHOP", tmp_path / "out" / "mutants")
    monkeypatch.setattr(mutants, "run_tests", run_tests)
    for _ in range(2):
        assert mutants.main([]) == 1
        first, second, total = capsys.readouterr().out.splitlines()
        assert "1/2 killed" in first and "2/2 SURVIVED" in second and "1 of 2 mutants killed" in total
        assert (tmp_path / "out" / "mutants" / "tree" / "fmu_src" / "law.py").read_text("utf-8").endswith("2 * x\n")
    assert len(runs) == 4 and mutants.main(["--only", "nothing"]) == 0
