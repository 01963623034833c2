# Tasks for developers and CI; `make help` lists them. Builds use the presets of CMakePresets.json in build/PRESET. The
# Python environment is .venv, and pictures go to out/.
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

bin := .venv/bin
python := $(bin)/python
# Files of tests run in parallel, each in one process, in the order of tests/python/conftest.py.
comma := ,
# Each process of tests has a core: threads of NumPy would wait for each other.
pytest = OPENBLAS_NUM_THREADS=1 $(python) -m pytest --numprocesses auto --dist loadfile --no-loadscope-reorder

# What is kept outside of the checkout, also for other checkouts: objects that ccache knows, in builds that begin while it is
# installed; the Debian 13 of test-debian13-rays; which trees of bench/ have passed their tests; and which groups of tests
# have passed for which files (tests/python/unchanged.py).
cache := $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/isospline
export CMAKE_CXX_COMPILER_LAUNCHER ?= $(shell command -v ccache)
export CCACHE_BASEDIR := $(CURDIR)
export CCACHE_NOHASHDIR := 1
# Python keeps what it has compiled, whatever the environment says: else each of the hundreds of processes that tests start
# would compile all modules again.
unexport PYTHONDONTWRITEBYTECODE
sphinx = $(python) -m sphinx -W --keep-going -n -q -d build/docs/doctrees
compiled := CMakeLists.txt CMakePresets.json pyproject.toml $(shell find bindings cmake core -type f)
sources := $(compiled) $(shell find python -type f -not -name '*.pyc' -not -name '*.so')

# The picture of `make demo`: a volume made from a formula, or the file VOLUME=path at LEVEL=number.
VOLUME ?=
LEVEL ?=

# How long `make fuzz` and `make soak` run.
MINUTES ?= 10

# Whether `make clang` compiles several sources as one.
UNITY ?= ON

# The files that `make tidy` checks.
FILES ?= /(core|bindings|bench|tests)/.*[.]cpp$$

# The parts of `make ci-long`, by default all.
PARTS ?=

# The rows of `make bench`, by default all, and options of bench/run.py.
ROWS ?=
BENCH ?=

# What `make bench-against` compares with, and the volumes whose names contain a text.
REV ?= c6962fb
VOLUMES ?=

.PHONY: help demo test say-test-time test-fast test-long test-bench ci-long develop stubs build-module test-module test-debian13 test-debian13-rays test-torch test-lowest test-aarch64 wheel test-wheel sdist test-sdist release \
    fuzz soak bench bench-docs bench-against docs docs-links pictures sanitize sanitize-address sanitize-python sanitize-thread tidy lint lint-types lint-stubs \
    lint-files lint-page clang format clean packages test-packages

help: ## list the targets
	@sed -n 's/^\([a-z0-9-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 22

# If the package is not installed yet, it is installed without what only tests need, and no test is built.
demo: $(or $(firstword $(wildcard .venv/.installed .venv/.linked)),.venv/.demo) ## render a picture; VOLUME=path LEVEL=number for your own file
ifeq ($(VOLUME),)
	@.venv/bin/isospline demo --output out
else
	@mkdir -p out
	@.venv/bin/isospline render "$(VOLUME)" $(if $(LEVEL),--level "$(LEVEL)") --output out/demo.png
endif

test: say-test-time .venv/.installed ## build everything and run the C++ and the Python tests
	@echo "== Building the C++ tests in build/release"
	@cmake --build --preset release
	@echo "== Running the C++ tests, and the Python tests beside them"
	@nice ctest --preset release > build/ctest.log & ctest=$$!; trap "kill $$ctest 2> /dev/null || true" EXIT; \
	    $(pytest) -m "not long and not lint" --leave-out-unchanged="$(cache)/passed" && failed=0 || failed=$$?; \
	    wait $$ctest && tail -n 3 build/ctest.log || { cat build/ctest.log; exit 1; }; exit $$failed
	@echo $$((($$(date +%s) - $$(cat build/test-begin)) / 60 + 1)) > build/test-minutes

say-test-time:
	@mkdir -p build
	@date +%s > build/test-begin
	@if [ -e build/test-minutes ]; then \
	    echo "== make test took $$(cat build/test-minutes) minutes the last time"; \
	else \
	    echo "== make test takes 8 minutes on two cores once everything is built, and 4 if nothing has changed since it passed"; \
	fi

# Tests that are marked as slow are left out.
test-fast: .venv/.linked ## build what has changed and run the fast tests, a minute; edits of Python files need no installation
	@echo "== Building the C++ tests in build/release"
	@cmake --build --preset release --target isospline_tests
	@echo "== Running the fast tests"
	@build/release/tests/isospline_tests "~[slow]" --reporter compact
	@$(pytest) tests/python -m "not slow and not long"

develop: .venv/.linked ## build the package and link it into .venv: edits of Python files need no installation

stubs: .venv/.linked ## write python/isospline/_core.pyi from the compiled module
	@$(python) tools/write_stub.py

# The rows of the benchmark run once for each state of bench/.
bench_key = $(cache)/bench-$(shell git rev-parse HEAD:bench)$(if $(shell git status --porcelain bench),-changed)
test-bench: .venv/.installed ## run all rows of the benchmark at their smallest size, if bench/ has changed
	@if [ ! -e "$(bench_key)" ] || [[ "$(bench_key)" == *-changed ]]; then \
	    cmake --build --preset release --target isospline_bench && \
	    $(python) -m pytest tests/python/project/test_bench.py tests/python/project/test_bench_against.py && \
	    mkdir -p "$(cache)" && touch "$(bench_key)"; \
	fi

test-long: .venv/.installed ## run all tests, also those that `make test` leaves out because they take long or did not change
	@cmake --build --preset release
	@echo "== Running the C++ tests"
	@ISOSPLINE_LONG_TESTS=1 ctest --preset release --parallel $$(nproc)
	@echo "== Running the Python tests"
	@$(pytest) -m "not lint"

ci-long: .venv/.installed ## run everything that .ci/run leaves out, or PARTS="fuzz soak", and write the table of docs/reliability.md
	@$(python) tools/long_checks.py $(PARTS)

# For tests on further platforms: only the parts that depend on the compiler and the libraries. Benchmarks, pages in a
# browser, fuzzing and tests that read the sources are left out, because they give the same results everywhere.
build-module: .venv/.module ## build the package and the C++ tests, with few Python packages
	@echo "== Building the C++ tests in build/release"
	@cmake --build --preset release --target isospline isospline_tests failing_allocations

test-module: build-module ## run only the tests of the compiled parts
	@echo "== Running the C++ tests"
	@ctest --preset release --parallel $$(nproc) --exclude-regex '^benchmarks_run$$'
	@echo "== Running the Python tests of the compiled module"
	@$(pytest) $$(tests/python/of_the_module)

test-debian13: ## test the compiled parts on Debian 13, in a folder: Embree 4, Catch2 3, GCC 14, Python 3.13
	@tests/debian13/run

test-debian13-rays: ## build on Debian 13 and test rays; the folder is kept for the next time
	@ROOT="$(cache)/debian13" tests/debian13/run rays

test-torch: .venv/.linked ## test isospline.torch with Debian's PyTorch
	@tests/pytorch/run

test-lowest: .venv/.requirements ## run the Python tests with the lowest versions that pyproject.toml allows
	@tests/lowest/run

test-aarch64: ## cross-compile for aarch64 and run the tests of rounding under qemu-user
	@tests/aarch64/run

wheel: .venv/.requirements ## build wheels for all CPythons of this machine into dist/
	@tools/build_wheels dist

test-wheel: .venv/.requirements ## test the wheels in dist/ on a Debian with only Python, and beside other packages with Embree
	@tests/wheel/run

sdist: .venv/.requirements ## pack the sources into dist/
	@tools/build_sdist dist

test-sdist: sdist ## build and install the sdist in dist/ in a clean environment, and run the demo
	@tests/sdist/run

release: .venv/.requirements ## build wheels, sources, documentation and checksums into dist/
	@tools/build_release dist

fuzz: .venv/.installed ## read damaged files and make invalid calls for MINUTES=10
	@echo "== Reading damaged files and making invalid calls for $(MINUTES) minutes"
	@mkdir -p out
	@cd tests && ../$(python) -m fuzz.runner --minutes $(MINUTES) --log ../out/fuzz.log

soak: .venv/.installed ## eight threads query, change, save, fork and interrupt shared scenes for MINUTES=10, also with little memory
	@echo "== Working on shared scenes for $(MINUTES) minutes"
	@mkdir -p out
	@cd tests && ../$(python) -m soak.runner --minutes $(MINUTES) --log ../out/soak.log

bench: .venv/.installed ## measure all rows of the benchmark, or ROWS="primary growth"; BENCH=--quick takes a minute
	@echo "== Installing the packages to compare with"
	@tools/install_packages libllvm19 || echo "Mitsuba 3 may lack the libLLVM that it needs."
	@tools/install_packages libusb-1.0-0 || echo "Open3D may lack the libusb that it needs."
	@$(pip) "isospline[bench,peers]" || $(pip) "isospline[bench]"
	@echo "== Building the C++ benchmarks in build/release"
	@cmake --build --preset release --target isospline_bench
	@echo "== Running the benchmark"
	@$(python) bench/run.py $(ROWS) $(BENCH) --output out/bench

bench-docs: ## write docs/benchmarks.md and the README's figures from the last run of the benchmark
	@$(python) bench/publish.py out/bench/benchmarks.json

bench-against: .venv/.installed ## measure REV=commit (or a built tree) and the working tree in turns; ROWS="packets single", VOLUMES=head, BENCH=--quick
	@$(pip) "isospline[bench]"
	@$(python) bench/against.py "$(REV)" $(ROWS) $(if $(VOLUMES),--volumes "$(VOLUMES)") $(BENCH) --output out/bench

docs: .venv/.installed ## build the documentation in build/docs/html
	@$(sphinx) -b html docs build/docs/html
	@echo "$(CURDIR)/build/docs/html/index.html"

pictures: .venv/.installed ## render the picture of the README from a real volume in the folder ISOSPLINE_VOLUMES
	@$(pip) "isospline[denoise]"
	@mkdir -p out docs/images
	@$(python) examples/195-skull.py
	@mv out/195-skull.jpg docs/images/hero.jpg

docs-links: .venv/.installed ## check the documentation's links to other sites
	@$(sphinx) -b linkcheck docs build/docs/links

sanitize: sanitize-address sanitize-python sanitize-thread ## run the tests under Address-, UndefinedBehavior- and ThreadSanitizer

sanitize-address: test-packages
	@echo "== Building with AddressSanitizer and UndefinedBehaviorSanitizer in build/asan-ubsan"
	@cmake --preset asan-ubsan
	@cmake --build --preset asan-ubsan
	@echo "== Running the C++ tests under AddressSanitizer and UndefinedBehaviorSanitizer"
	@ctest --preset asan-ubsan --parallel $$(nproc)

# The package is installed beside the build and not in .venv: only a Python with the preloaded sanitizer can import it.
# CPython keeps memory until it ends, so only the C++ tests look for leaks. libstdc++ is preloaded so that ASan finds
# the functions that throw. Without affinities of threads, Open Image Denoise does not load what ASan forbids. Slow tests
# are left out: they limit memory and time, fork beside threads, or run the same calls for longer. So are the command line
# and clusters, which make the same calls in other processes, and a test that limits memory. Tests of stores are in
# processes of their own: they limit memory, and ASan keeps what is free.
limits_memory = tests/python/interface/test_hostile_arguments.py::test_memory_errors_name_the_purpose_of_the_memory
sanitize-python: test-packages .venv/.installed
	@echo "== Building with AddressSanitizer and UndefinedBehaviorSanitizer in build/asan-ubsan"
	@$(call pip_install,asan-ubsan,.) --no-deps --upgrade --target build/asan-ubsan/package
	@echo "== Running the Python tests under AddressSanitizer and UndefinedBehaviorSanitizer"
	@export ASAN_OPTIONS=detect_leaks=0:quarantine_size_mb=32; \
	    export UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1 OIDN_SET_AFFINITY=0; \
	    export PYTHONPATH=build/asan-ubsan/package; \
	    preload="$$(g++ -print-file-name=libasan.so) $$(g++ -print-file-name=libstdc++.so)"; \
	    others="$$(tests/python/of_the_module) $$(printf -- ' --ignore=tests/python/%s' cli cluster store)"; \
	    failed=0; for tests in tests/python/store "$$others"; do \
	        LD_PRELOAD="$$preload" $(pytest) -p no:cacheprovider -m "not long and not slow" $$tests \
	            --deselect "$(limits_memory)" || failed=1; \
	    done; exit $$failed

sanitize-thread: test-packages
	@echo "== Building with ThreadSanitizer in build/tsan"
	@cmake --preset tsan
	@cmake --build --preset tsan
	@echo "== Running the threaded C++ tests under ThreadSanitizer"
	@ISOSPLINE_THREADS_SECONDS=60 ctest --preset tsan

# Clang compiles one SIMD target of each source, without optimization, and nothing is linked. Code takes it 15% longer than
# a look at the syntax, but ccache knows it the next time. With UNITY=OFF, each source is compiled alone: Clang then finds
# missing includes and names that shadow others.
clang: test-packages ## Clang's warnings about all C++, as errors; UNITY=OFF finds missing includes, too
	@tools/install_packages clang
	@echo "== Checking all C++ with Clang"
	@cmake --preset clang -D CMAKE_UNITY_BUILD=$(UNITY) > build/clang.log || { cat build/clang.log >&2; exit 1; }
	@ninja -C build/clang -t targets all | sed -n 's/: CXX_COMPILER__.*//p' | xargs ninja -C build/clang --quiet

lint: .venv/.installed ## check types, stubs, files in Python, C++ and CMake, and spelling, as CI does; not clang-tidy
	@tools/install_packages clang-format
	@$(MAKE) --no-print-directory --output-sync --jobs $$(nproc) lint-types lint-stubs lint-files lint-page

# What mypy knows of other packages is kept between checkouts, apart for two that run at once: mypy locks nothing.
lint-types lint-stubs: export MYPY_CACHE_DIR = $(cache)/mypy/$@
lint-types:
	@$(bin)/mypy -p isospline
	@$(bin)/mypy examples/*.py tests/python/project/typed_user.py

lint-stubs:
	@$(python) -m pytest -q -m "not long" tests/python/project/test_types.py

# ESLint and TypeScript, as the lock file has them.
build/page/.installed: $(addprefix tests/page/,.npmrc package.json package-lock.json eslint.config.js)
	@mkdir -p build/page
	@cp $^ build/page
	@PATH=$$PWD/$(bin):$$PATH npm --prefix build/page ci --ignore-scripts --silent
	@touch $@

lint-page: build/page/.installed
	@$(bin)/node build/page/node_modules/eslint/bin/eslint.js --config build/page/eslint.config.js --max-warnings 0 \
	    python/isospline/viewer/page tests/page
	@$(bin)/node build/page/node_modules/typescript/bin/tsc --project tests/page

lint-files:
	@$(bin)/ruff check .
	@$(bin)/ruff format --check .
	@$(bin)/codespell
	@git ls-files '*.cmake' '*CMakeLists.txt' | xargs $(bin)/gersemi --check
	@git ls-files '*.h' '*.cpp' | xargs clang-format --dry-run --Werror

tidy: .venv/.installed ## run clang-tidy over all C++ sources, or FILES=pattern; takes an hour
	@tools/install_packages clang clang-tidy
	@cmake --preset tidy -D pybind11_DIR=$$($(python) -m pybind11 --cmakedir) -D Python_EXECUTABLE=$$PWD/$(python)
	@run-clang-tidy -quiet -p build/tidy '$(FILES)'

format: .venv/.installed ## format all Python, C++ and CMake files
	@tools/install_packages clang-format
	@$(bin)/ruff check --fix --exit-zero --quiet .
	@$(bin)/ruff format .
	@git ls-files '*.cmake' '*CMakeLists.txt' | xargs $(bin)/gersemi --in-place
	@git ls-files '*.h' '*.cpp' | xargs clang-format -i

clean: ## remove builds, the virtual environment and pictures
	rm -rf build out .venv

packages:
	@tools/install_packages packages.txt

test-packages:
	@tools/install_packages packages.txt tests/packages.txt

# Modules are compiled when they are first imported: most of those of large packages never are.
pip = $(python) -m pip install -q --disable-pip-version-check --no-compile

.venv/.requirements: pyproject.toml | packages
	@if ! $(python) -c "" 2>/dev/null; then \
	    echo "== Making the virtual environment .venv"; \
	    python=$$(tools/find_python); \
	    "$$python" -m venv --clear .venv; \
	fi
	@echo "== Installing the build requirements into .venv"
	@$(python) tools/requirements.py | $(pip) -r /dev/stdin
	@touch $@

# The extras with everything that tests need.
extras := io interop store view test docs lint

# $(call pip_install,PRESET,WHAT,TESTS): builds the Python module in build/PRESET, which is kept, and installs the package.
# If TESTS is OFF, CMake needs none of the packages of tests and benchmarks.
pip_install = $(pip) --no-build-isolation $(2) \
    --config-settings=build-dir=build/$(1) --config-settings=cmake.args=--preset=$(1) \
    --config-settings=cmake.build-type= --config-settings=cmake.define.ISOSPLINE_BUILD_TESTS=$(or $(3),ON) \
    --config-settings=cmake.define.ISOSPLINE_BUILD_BENCH=$(or $(3),ON)

# $(call install_with_extras,WHAT): the same with all extras. Their packages are installed meanwhile: pip is one thread.
install_with_extras = $(python) tools/requirements.py $(extras) | $(pip) -r /dev/stdin & packages=$$!; \
    $(call pip_install,release,$(1) --no-deps) || { wait $$packages; false; }; wait $$packages

# Of these installations, the last one is in .venv.
installations := .venv/.installed .venv/.linked .venv/.module .venv/.demo

# The package with the requirements of the compiled module's tests.
.venv/.module: .venv/.requirements $(sources) | test-packages
	@echo "== Building the package in build/release and installing it into .venv (takes minutes the first time)"
	@rm -f $(installations)
	@$(call pip_install,release,".[test-module]")
	@touch $@

# The package for `make demo`, with what the commands that it suggests need.
.venv/.demo: .venv/.requirements $(sources)
	@echo "== Building the package in build/release and installing it into .venv (takes minutes the first time)"
	@rm -f $(installations)
	@$(call pip_install,release,".[view$(if $(VOLUME),$(comma)io)]",OFF)
	@touch $@

# The package with its Python files where they are edited, and everything that its tests need.
.venv/.linked: .venv/.requirements $(compiled) | test-packages
	@echo "== Building the package in build/release and linking it into .venv (takes minutes the first time)"
	@rm -f $(installations)
	@$(call install_with_extras,--editable .)
	@touch $@

# The package as users get it, which `make test` tests, with everything that its tests need.
.venv/.installed: .venv/.requirements $(sources) | test-packages
	@echo "== Building the package in build/release and installing it into .venv (takes minutes the first time)"
	@rm -f $(installations)
	@$(call install_with_extras,.)
	@touch $@
