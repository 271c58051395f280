# The front door. Nothing but calls of the CMake presets and of tools/; docs/hacking.md has the rest.
MAKEFLAGS += --no-print-directory
.PHONY: help demo test bench results results-small peers check fuzz format clean setup build

help:    ## what there is to make
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 16

demo: setup build/release/build.ninja    ## learn a simulated intersection and predict, in a minute
	@cmake --build --preset release --target cli/all
	@tools/demo build/release/cli/sila out/demo

test: build    ## build everything and run all tests
	@ctest --preset release

bench: build    ## run the benchmarks
	@tools/bench build/release/benchmarks

results: build    ## make the tables of docs/results.md, in hours: make results DATA=DIR
	@tools/setup --python
	@tools/results $(DATA)

results-small: build    ## a small experiment from end to end, in minutes
	@tools/setup --python
	@tools/results --small

peers: build    ## compare with methods of others: make peers DATA=DIR [PEERS=DIR] [PYTHON=...]
	@tools/setup --python
	@PEERS=$(PEERS) BASE_MDN=$(BASE_MDN) PYTHON=$(or $(PYTHON),python3) tools/results $(DATA) peers

check:    ## format, layers, budgets, links, clang warnings, clang-tidy
	@tools/setup --check
	@tools/check

fuzz:    ## a minute of each fuzz target (tools/fuzz)
	@tools/setup --check
	@cmake --preset fuzz >/dev/null
	@cmake --build --preset fuzz --target fuzz
	@tools/fuzz

format:    ## format all C++ sources in place
	@tools/setup --check
	@git ls-files '*.cpp' '*.hpp' | xargs clang-format -i

clean:    ## remove all that was built
	rm -rf build out

build: setup build/release/build.ninja
	@cmake --build --preset release

setup:
	@tools/setup

# Only once: from then on ninja configures anew by itself when a CMake file changes.
build/release/build.ninja: | setup
	@cmake --preset release
