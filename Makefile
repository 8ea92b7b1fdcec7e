# SPDX-License-Identifier: BSD-3-Clause
# Each target installs what it needs, then runs.
#   make evolve    a small evolution, to a printed Pareto front and a report to open in a browser
#   make test      all tests, native ones included
#   make lint      formatting, types, the direction of imports, declared dependencies
#   make sanitize  the native tests under address, undefined-behaviour and thread sanitizers
#   make fuzz      the C interface under libFuzzer and sanitizers, the readers under hypothesis; FUZZ_SECONDS=20
#   make validation  measure the physics and write docs/validation.md; half an hour
#   make docs      docs/configuration.md from the code, then all pages as HTML in build/docs
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.PHONY: evolve test test-native test-python lint sanitize fuzz validation docs clean

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_ROOT_USER_ACTION := ignore

BUILD_PACKAGES := g++ cmake ninja-build pkg-config libode-dev libeigen3-dev python3-venv
TEST_PACKAGES := doctest-dev chromium
LINT_PACKAGES := clang-format
FUZZ_PACKAGES := clang libclang-rt-dev
FUZZ_SECONDS ?= 20

SOURCES := pyproject.toml CMakeLists.txt $(shell find native swarmevo plugins configs -type f -not -name '*.pyc')

evolve: $(VENV)/installed
	@run=runs/quick-$$(date +%Y%m%d-%H%M%S); \
	$(BIN)/swarmevo evolve --out $$run; \
	$(BIN)/swarmevo report $$run

test: test-native test-python

test-native: build/system-test
	cmake -S . -B build/native -G Ninja -DSWARMEVO_TESTS=ON >build/cmake.log || { cat build/cmake.log; exit 1; }
	cmake --build build/native --target native_tests
	build/native/native_tests

test-python: $(VENV)/installed-test
	cd tests && ../$(BIN)/python -m pytest -c ../pyproject.toml --rootdir .. .

lint: $(VENV)/installed-lint build/system-lint
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/deptry swarmevo plugins/swarmevo_paper
	clang-format --dry-run --Werror $$(find native benchmarks -name '*.[ch]' -o -name '*.[ch]pp')

sanitize: build/system-test
	for sanitizer in address,undefined thread; do \
	  cmake -S . -B build/$$sanitizer -G Ninja -DSWARMEVO_TESTS=ON -DSWARMEVO_SANITIZE=$$sanitizer \
	    -DCMAKE_BUILD_TYPE=RelWithDebInfo >build/cmake.log || { cat build/cmake.log; exit 1; }; \
	  cmake --build build/$$sanitizer --target native_tests; \
	  UBSAN_OPTIONS=halt_on_error=1 build/$$sanitizer/native_tests; \
	done

# What they find beyond native/fuzz/corpus stays in build/fuzz/corpus; an input that fails is left in build/fuzz.
fuzz: build/system-fuzz $(VENV)/installed-test
	cmake -S . -B build/fuzz -G Ninja -DSWARMEVO_FUZZ=ON -DSWARMEVO_SANITIZE=fuzzer-no-link,address,undefined \
	  -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_BUILD_TYPE=RelWithDebInfo >build/cmake.log || \
	  { cat build/cmake.log; exit 1; }
	cmake --build build/fuzz
	for target in scene network batch; do \
	  mkdir -p build/fuzz/corpus/$$target; \
	  ASAN_OPTIONS=allocator_may_return_null=1 UBSAN_OPTIONS=halt_on_error=1 build/fuzz/fuzz_$$target \
	    -max_total_time=$(FUZZ_SECONDS) -max_len=1000 -timeout=20 -verbosity=0 -print_final_stats=1 \
	    -artifact_prefix=build/fuzz/$$target- build/fuzz/corpus/$$target native/fuzz/corpus/$$target; \
	done
	cd tests && FUZZ_EXAMPLES=1000 ../$(BIN)/python -m pytest -c ../pyproject.toml --rootdir .. test_fuzz.py

validation: $(VENV)/installed-test
	$(BIN)/python -m benchmarks.validation

docs: $(VENV)/installed-docs
	$(BIN)/python docs/generate_configuration.py
	$(BIN)/sphinx-build -W --keep-going -q docs build/docs

clean:
	rm -rf build $(VENV)

# ---- what the targets need --------------------------------------------------------------------------------------------

# Installs the Debian packages that are missing; without root, prints the one line to run.
build/system build/system-test build/system-lint build/system-fuzz: build/system%: Makefile
	@mkdir -p build; \
	packages="$(BUILD_PACKAGES)"; \
	case "$*" in -test) packages+=" $(TEST_PACKAGES)";; -lint) packages+=" $(LINT_PACKAGES)";; -fuzz) packages+=" $(FUZZ_PACKAGES)";; esac; \
	missing=; \
	for package in $$packages; do \
	  dpkg-query -W -f '$${Status}' $$package 2>/dev/null | grep -q 'ok installed' || missing+=" $$package"; \
	done; \
	if [ -n "$$missing" ]; then \
	  if [ "$$(id -u)" != 0 ]; then \
	    echo "Some system packages are missing. Please run:  sudo apt-get install -y$$missing"; exit 1; \
	  fi; \
	  apt-get update -q && DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends$$missing; \
	fi; \
	touch $@

$(BIN)/python: | build/system
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "swarmevo needs Python 3.11 or newer: make PYTHON=...")'
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed $(VENV)/installed-test $(VENV)/installed-lint $(VENV)/installed-docs: $(VENV)/installed%: $(SOURCES) | $(BIN)/python build/system
	$(BIN)/pip install -q ".$(if $*,[$(patsubst -%,%,$*)])"
	touch $@
