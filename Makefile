# Everything a newcomer needs: `make demo` and `make test` set up what they use.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
OUT    ?= out/demo
READY  := $(VENV)/.ready
GL_PACKAGES := libegl1 libgl1 libgl1-mesa-dri

.PHONY: demo test lint bench validate setup gl clean

demo: setup
	$(BIN)/testtrack run in-car-day --seed 0 --tracker in-car --out $(OUT)
	@if [ -n "$(VIDEO)" ]; then $(BIN)/testtrack track "$(VIDEO)" --method in-car --out $(OUT)-recording; fi

test: setup
	$(BIN)/python -m pytest

# The long runs: trackers and simulator against truth and against the papers' mathematics.
validate: setup
	$(BIN)/python -m pytest -m slow

bench: setup
	$(BIN)/python -m tests.benchmarks

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

setup: gl $(READY)

$(READY): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "testtrack needs Python 3.11 or newer; $(PYTHON) is older: make PYTHON=python3.11 ..." >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	@touch $@

# Off-screen OpenGL: installed where that is allowed, otherwise named.
gl:
	@if ldconfig -p | grep -q 'libEGL\.so\.1' && ldconfig -p | grep -q 'libGL\.so\.1' \
	    && ls /usr/lib/*/dri/*swrast* /usr/lib/*/dri/libdril* >/dev/null 2>&1; then :; \
	elif [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  apt-get update -qq && apt-get install -y -qq --no-install-recommends $(GL_PACKAGES); \
	elif command -v apt-get >/dev/null && sudo -n true 2>/dev/null; then \
	  sudo apt-get update -qq && sudo apt-get install -y -qq --no-install-recommends $(GL_PACKAGES); \
	else \
	  echo "testtrack needs off-screen OpenGL; run: sudo apt-get install -y $(GL_PACKAGES)" >&2; exit 1; \
	fi

clean:
	rm -rf $(VENV) out build *.egg-info
