# What a person or CI does with a checkout; `make help` lists it. Builds go through the presets of CMakePresets.json
# into build/PRESET, the Python environment is .venv, pictures go to out/.
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

python := .venv/bin/python
sources := CMakeLists.txt CMakePresets.json pyproject.toml \
    $(shell find bindings cmake core python -type f -not -name '*.pyc')

# Picture of `make demo`: the repository's own volume, or VOLUME=path at LEVEL=number.
VOLUME ?=
LEVEL ?=

# How long `make fuzz` runs.
MINUTES ?= 10

# Rows of `make bench`, all where none is named, and options of bench/run.py.
ROWS ?=
BENCH ?=

.PHONY: help demo test fuzz bench bench-docs sanitize sanitize-address sanitize-thread tidy format clean packages

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 22

demo: .venv/.installed ## render a picture; VOLUME=path LEVEL=number for a file of yours
	@mkdir -p out
ifeq ($(VOLUME),)
	@echo "== Making a volume"
	@$(python) tools/make_volume.py heart 192 out/demo.npy
	@echo "== Rendering it"
	@.venv/bin/isospline render out/demo.npy --level 0 --color 0.75,0.06,0.09 --view 0.4,-1,0.3 --background white --size 960x720 \
	    --output out/demo.png
else
	@echo "== Rendering $(VOLUME)"
	@.venv/bin/isospline render "$(VOLUME)" $(if $(LEVEL),--level "$(LEVEL)") --output out/demo.png
endif
	@echo "$(CURDIR)/out/demo.png"

test: .venv/.installed ## build everything and run the C++ and the Python tests
	@echo "== Building the C++ tests in build/release"
	@cmake --build --preset release
	@echo "== Running the C++ tests"
	@ctest --preset release
	@echo "== Running the Python tests"
	@$(python) -m pytest

fuzz: .venv/.installed ## read changed files and make senseless calls for MINUTES=10
	@echo "== Reading changed files and making senseless calls for $(MINUTES) minutes"
	@mkdir -p out
	@cd tests && ../$(python) -m fuzz.runner --minutes $(MINUTES) --log ../out/fuzz.log

bench: .venv/.installed ## measure all rows of the benchmark, or ROWS="primary growth"; BENCH=--quick takes a minute
	@echo "== Installing what to compare with"
	@tools/install_packages libllvm19 || echo "Mitsuba 3 may lack the libLLVM that it needs."
	@$(pip) "isospline[bench,peers]" || $(pip) "isospline[bench]"
	@echo "== Building the C++ benchmarks in build/release"
	@cmake --build --preset release --target isospline_bench
	@echo "== Running the benchmark"
	@$(python) bench/run.py $(ROWS) $(BENCH) --output out/bench

bench-docs: ## write docs/benchmarks.md and the README's figures from the last run of the benchmark
	@$(python) bench/publish.py out/bench/benchmarks.json

sanitize: sanitize-address sanitize-thread ## run the tests under Address-, UndefinedBehavior- and ThreadSanitizer

# The package is laid beside the build instead of into .venv: only a Python with the sanitizer preloaded can import it.
# CPython keeps memory until it ends, so leaks are looked for in the C++ tests alone. libstdc++ is preloaded for ASan to
# find the functions that throw.
sanitize-address: packages .venv/.installed
	@echo "== Building with AddressSanitizer and UndefinedBehaviorSanitizer in build/asan-ubsan"
	@$(call pip_install,asan-ubsan,.) --no-deps --upgrade --target build/asan-ubsan/package
	@cmake --build --preset asan-ubsan
	@echo "== Running the C++ tests under AddressSanitizer and UndefinedBehaviorSanitizer"
	@ctest --preset asan-ubsan
	@echo "== Running the Python tests under AddressSanitizer and UndefinedBehaviorSanitizer"
	@ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1 \
	    LD_PRELOAD="$$(g++ -print-file-name=libasan.so) $$(g++ -print-file-name=libstdc++.so)" \
	    PYTHONPATH=build/asan-ubsan/package $(python) -m pytest -p no:cacheprovider

sanitize-thread: packages
	@echo "== Building with ThreadSanitizer in build/tsan"
	@cmake --preset tsan
	@cmake --build --preset tsan
	@echo "== Running the threaded C++ tests under ThreadSanitizer"
	@ISOSPLINE_THREADS_SECONDS=60 ctest --preset tsan

tidy: ## run clang-tidy over the C++ sources
	@tools/install_packages $$(sed 's/#.*//' packages.txt) clang-tidy
	@cmake --preset tidy
	@cmake --build --preset tidy

format: ## lay out the C++ sources by .clang-format
	@tools/install_packages clang-format
	@find core bindings tests bench -name '*.h' -o -name '*.cpp' | xargs clang-format -i

clean: ## remove what was built, the virtual environment and the pictures
	rm -rf build out .venv

packages:
	@tools/install_packages

pip = $(python) -m pip install -q --disable-pip-version-check

.venv/.requirements: pyproject.toml | packages
	@if ! $(python) -c "" 2>/dev/null; then \
	    echo "== Making the virtual environment .venv"; \
	    python=$$(tools/find_python); \
	    "$$python" -m venv --clear .venv; \
	fi
	@echo "== Installing what builds the package into .venv"
	@$(python) tools/build_requirements.py | $(pip) -r /dev/stdin
	@touch $@

# The package with all that its tests need.
with_extras := .[io,interop,view,test]

# $(call pip_install,PRESET,WHAT): builds the Python module in build/PRESET, where it stays, and installs the package.
pip_install = $(pip) --no-build-isolation "$(2)" \
    --config-settings=build-dir=build/$(1) --config-settings=cmake.args=--preset=$(1) \
    --config-settings=cmake.build-type= --config-settings=cmake.define.ISOSPLINE_BUILD_TESTS=ON

.venv/.installed: .venv/.requirements $(sources)
	@echo "== Building the package in build/release and installing it into .venv (takes minutes the first time)"
	@$(call pip_install,release,$(with_extras))
	@touch $@
