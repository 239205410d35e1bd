# make            build build/ftcs
# make demo       install what is missing, build, watch a clock and eight drives being locked; build/demo.html
# make test       install what is missing, build, test (at most 5 minutes after the build)
# make test-all   everything, long runs too
# make test-vm    real clocks of a real kernel in a virtual machine: docs/vm.md (at most 10 minutes); JOB=busy: one job of it
# make test-embedded  the core and the integer servo for Cortex-M, run in QEMU and compared with x86
# make bench      nanoseconds and instructions per update, allocations
# make check      formatting, spelling, layers; make check-tidy: clang-tidy too
# make fuzz       each fuzz target for FUZZ_SECONDS
# make docs       the guides as a site with search in build-docs/
# make deb        Debian packages of this commit in build-deb/
# make mutate     flip signs and comparisons one at a time; every mutant must fail a test

CMAKE_FLAGS ?=
JOBS ?= $(shell nproc 2>/dev/null || echo 2)
# Those that wait for a network are many: one more at a time than there are processors. (With two more, a run that
# has to lock beside three that compute did not in time.)
TEST_JOBS ?= $(shell echo $$(($(JOBS) + 1)))
DEMO_FLAGS ?=
FUZZ_SECONDS ?= 60
JOB ?=
VM_LABEL ?= vm
VM_FLAGS ?=

.PHONY: all configure build demo test test-all test-embedded test-vm bench check check-tidy fuzz mutate docs deb deps deps-test clean

all: build

deps:
	@tools/install-deps build
deps-test:
	@tools/install-deps build test

configure: deps
	@cmake --preset default $(CMAKE_FLAGS) > build-configure.log 2>&1 || { cat build-configure.log; exit 1; }
	@mkdir -p build && mv build-configure.log build/configure.log

build: configure
	@cmake --build build -j $(JOBS) --target ftcs

demo: build
	@build/ftcs demo --html build/demo.html $(DEMO_FLAGS)

test: deps-test configure
	@cmake --build build -j $(JOBS)
	@ctest --test-dir build -j $(TEST_JOBS) --output-on-failure -LE '^(slow|vm)$$'

test-all: test
	@ctest --test-dir build -j $(JOBS) --output-on-failure -L slow

test-vm: deps-test configure
	@cmake --build build -j $(JOBS) --target ftcs vm_witness
	@test/vm/prepare build/vm || { code=$$?; [ $$code -eq 77 ] && exit 0; exit $$code; }
ifeq ($(JOB),)
	@FTCS_VM_FLAGS="$(VM_FLAGS)" ctest --test-dir build -j $(JOBS) --output-on-failure -L '^$(VM_LABEL)$$'
else
	@test/vm/run $(VM_FLAGS) $(JOB)
endif

test-embedded: build
	@test/embedded/run.sh

bench: deps-test
	@cmake --preset release > /dev/null
	@cmake --build build-release -j $(JOBS)
	@build-release/bin/ftcs_bench
	@build-release/bin/message_bench
	@build-release/bin/analysis_bench
	@build-release/bin/sim_bench
	@bench/instructions.sh build-release

docs:
	@tools/install-deps docs
	@rm -rf build-docs
	@mkdocs build --quiet --strict
	@ls build-docs/index.html

deb:
	@tools/install-deps build package
	@tools/make-deb

check: deps-test configure
	@tools/check

check-tidy: deps-test
	@tools/check tidy

fuzz: deps-test
	@FUZZ_SECONDS=$(FUZZ_SECONDS) test/fuzz/run.sh

mutate: deps-test
	@tools/mutate.py

clean:
	@cmake -E rm -rf build build-release build-clang build-asan-ubsan build-tsan build-tidy build-fuzz build-embedded
