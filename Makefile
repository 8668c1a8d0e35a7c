# Everything a user or a maintainer does, by name. Needs git, python3 (3.11 or newer) and make.
.DEFAULT_GOAL := help
.PHONY: help environment demo test test-browser lint docs validate soak bench mutants clean

export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
# Hundreds of commands and workers start here: none compiles again what another one has.
unexport PYTHONDONTWRITEBYTECODE

# Relative paths, so that the place of the clone may hold blanks.
PY := .venv/bin/python
FEMGEAR := .venv/bin/femgear
CASE := cases/planetary_27_40_108.toml
OUT := out/demo
# Further arguments, most for pytest: make test ARGS="tests/gears -k fillet"
ARGS :=
# How long make soak begins further pieces
MINUTES := 60

help:
	@echo "make environment  make .venv and install femgear there, as all others do first"
	@echo "make demo      run the reference planetary set ($(CASE)) and write its report"
	@echo "make test      run the tests"
	@echo "make test-browser  open the pages of all trains in Chromium, which must be installed"
	@echo "make lint      check style and formatting (ruff) and types (basedpyright)"
	@echo "make docs      build the documentation into out/docs/html"
	@echo "make validate  recompute docs/validation.csv with its page, run the slow verification tests"
	@echo "make soak      fuzz, damage, kill and starve femgear for MINUTES=60, write docs/reliability.md"
	@echo "make bench     measure time and memory of every stage"
	@echo "make mutants   change single expressions of the core and see whether a test notices"
	@echo "make clean     delete results, caches and generated grids (.venv stays)"

# Checks the system libraries, then makes .venv and installs femgear once.
environment:
	@bash scripts/setup_environment.sh

demo: environment
	$(FEMGEAR) run $(CASE) -o $(OUT) --force
	@echo "Report: $(OUT)/report.html"

# To rewrite every assert, so that it tells its values, takes as long as a tenth of the tests: those that fail have it.
test: environment
	@$(PY) -m pytest -n 2 --dist loadfile --benchmark-disable --assert=plain $(ARGS) \
	|| { echo "Those that failed once more, with the values that they compare:"; \
	$(PY) -m pytest --last-failed --last-failed-no-failures none --benchmark-disable $(ARGS); exit 1; }

test-browser: environment
	$(PY) -m pip install --quiet --disable-pip-version-check -e ".[browser]"
	$(PY) -m pytest -m browser tests/browser --benchmark-disable $(ARGS)

lint: environment
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m basedpyright

docs: environment
	$(PY) -m pip install --quiet --disable-pip-version-check -e ".[docs]"
	$(PY) -m sphinx -b html -j 2 -W --keep-going docs out/docs/html $(ARGS)
	@echo "Documentation: out/docs/html/index.html"

validate: environment
	$(PY) validation -o docs/validation.md
	$(PY) -m pytest -m slow --benchmark-disable $(ARGS)
	$(PY) validation/soak/supply.py

soak: environment
	$(PY) validation/soak --minutes $(MINUTES) --page docs/reliability.md

bench: environment
	$(PY) -m pytest benchmarks -o python_files="test_*.py bench_*.py" $(ARGS)

mutants: environment
	$(PY) validation/tools/mutation.py $(ARGS)

clean:
	rm -rf out dist docs/_generated .pytest_cache .ruff_cache .hypothesis .benchmarks
	find . -name __pycache__ -type d -not -path "./.venv/*" -prune -exec rm -rf {} +
	@if git rev-parse --is-inside-work-tree >/dev/null 2>&1; then git clean -fdXq meshes; \
	else find meshes -type f \( -name "*.vtu" -o -name "*.msh" \) -not -name "reference_*" -delete; fi
