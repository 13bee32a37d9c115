# Every target makes its own virtual environment; Python 3.11, venv and make are all that is needed.
PYTHON ?= python3.11
VENV ?= .venv
WORKERS ?= 2
TESTS ?=
PARTS ?=
PEERS ?=
ifeq ($(OS),Windows_NT)
BIN := $(VENV)/Scripts
EXE := .exe
TIMEOUT := thread
else
BIN := $(VENV)/bin
TIMEOUT := signal
endif
# Machine code of the kernels as they are now; after an edit kernels are compiled when they are first called.
NATIVE = $(BIN)/python -m cranktrain.fmu.native --package
# Modules become byte code when they are first imported; of what is installed few are.
INSTALL = $(BIN)/python -m pip install --disable-pip-version-check -q --no-compile
export PYTHONUNBUFFERED := 1
# Matrices are small. Where workers fill the cores, threads of linear algebra wait for each other in busy loops, for two
# to five times the processor time.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1

.PHONY: demo test test-all test-slow examples durations mutants lint docs figures bench bench-peers bench-cost install native wheel

# The demo makes the machine code itself, beside its finite elements.
demo: $(VENV)/.installed-bare
	$(BIN)/python examples/demo.py

# A skip of an unknown kind fails (tests/skips.py). A test that hangs is named and ended after half an hour, whatever
# else the machine does; the rest goes on. A test that ends its worker ends the run, with a list of what failed: with
# a worker in its place xdist waits for ever for the other tests of that file.
PYTEST = $(BIN)/python -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder --max-worker-restart 0 --known-skips \
	--timeout 1800 --timeout-method $(TIMEOUT) --durations 20 --durations-min 10

# The core, which tests/core.py chose by what each test took.
test: $(VENV)/.installed-test
	$(PYTEST) -m "not slow" --part=core --durations-to=out/durations/core.json $(TESTS)

# The core, then the rest.
test-all: test
	$(PYTEST) -m "not slow" --part=rest --durations-to=out/durations/rest.json $(TESTS)

# What takes more than 20 s a test, hours in all.
test-slow: $(VENV)/.installed-test
	$(PYTEST) -m slow $(TESTS)

# Other examples of hypothesis than those of every run; one that fails is pinned by @example.
examples: $(VENV)/.installed-test
	$(PYTEST) -m hypothesis --hypothesis-profile=others $(TESTS)

# The core anew, from what make test-all measured.
durations:
	$(BIN)/python tests/core.py out/durations/core.json out/durations/rest.json

mutants: $(VENV)/.installed-test
	$(BIN)/python tests/mutants.py

lint: $(VENV)/.installed-lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy --strict --follow-imports=silent tests/regression/typed_calls.py
	$(BIN)/lint-imports
	$(BIN)/python tests/advice.py
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff

docs: $(VENV)/.installed-docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

figures: $(VENV)/.installed
	$(BIN)/python docs/figures.py $(PARTS)

bench: $(VENV)/.installed
	$(BIN)/python -m benchmarks

# Each of the other programs gets a virtual environment of its own in the cache; CalculiX is Debian's calculix-ccx.
bench-peers: $(VENV)/.installed
	$(BIN)/python -m benchmarks.peers $(PEERS)

bench-cost: $(VENV)/.installed-dask
	$(BIN)/python -m benchmarks.cost_law out/cost_law.png

install: $(VENV)/.installed

native: $(VENV)/.installed
	$(NATIVE)

# The source archive, and the wheel from it, with machine code for both platforms; ziglang, of the extra native, compiles
# the C side.
wheel: $(VENV)/.installed-native
	$(NATIVE) linux64 win64
	rm -rf build
	$(BIN)/python -m build -o dist .
	rm -rf build

$(BIN)/python$(EXE):
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed-bare: pyproject.toml | $(BIN)/python$(EXE)
	@echo "cranktrain: NumPy, SciPy, numba and others go into $(VENV): about a minute"
	$(INSTALL) -e .
	touch $@

$(VENV)/.installed: $(VENV)/.installed-bare
	@echo "cranktrain: readers of files and the page of explore, then machine code of the kernels: some three minutes"
	$(INSTALL) -e .[all]
	$(NATIVE)
	touch $@

$(VENV)/.installed-%: pyproject.toml | $(BIN)/python$(EXE)
	$(INSTALL) -e .[$*]
	$(NATIVE)
	touch $@ $(VENV)/.installed-bare $(VENV)/.installed
