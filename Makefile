# make demo: set up .venv, design a PID for the thesis rotor, and set it beside observers.  make test: set up .venv and run the tests.
# make docs: set up .venv, run the tutorials and build the site in docs/_build/html.  make notebooks: the tutorials as notebooks.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

# One thread in BLAS: at the sizes of a rotor, threads only get in each other's way.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1

.PHONY: demo test lint types docs notebooks check clean

demo: $(VENV)/ready
	$(BIN)/amb-design optimise thesis-pid --starts 4 --out demo
	$(BIN)/amb-design compare thesis-pid-vs-lqg --out demo/comparison

test: $(VENV)/ready
	$(BIN)/python -m pytest -n auto --dist worksteal --durations=40

lint: $(VENV)/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports

types: $(VENV)/ready
	$(BIN)/mypy

docs: $(VENV)/ready
	$(BIN)/sphinx-build -q -E -W --keep-going -b html docs docs/_build/html
	@echo "docs/_build/html/index.html is built"

notebooks: $(VENV)/ready
	@mkdir -p docs/notebooks
	@for tutorial in docs/tutorials/*.py; do \
	  $(BIN)/jupytext --quiet --to ipynb --set-kernel python3 --output docs/notebooks/$$(basename $$tutorial .py).ipynb $$tutorial || exit 1; \
	done

check: lint types test docs

$(VENV)/ready: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "amb_design needs Python 3.11 or newer; name one with: make PYTHON=/path/to/python3"; exit 2; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[test,docs]"
	touch $@

clean:
	rm -rf $(VENV) demo build dist docs/_build docs/generated docs/notebooks
