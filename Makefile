# One command for each thing a person does here; CMake's presets do the work.
PRESET ?= release
BUILD := build/$(PRESET)
JOBS ?= $(shell nproc)
DATA ?= $(abspath ../shared/data)
SPILLIKIN := $(BUILD)/bin/spillikin

.PHONY: all setup configure build demo test accuracy verify bench fuzz install format lint clean

all: build

setup:
	@scripts/setup.sh

configure: setup
	@cmake --preset $(PRESET) -DSPILLIKIN_DATA=$(DATA) >/dev/null

build: configure
	@cmake --build $(BUILD) -j $(JOBS)

demo: configure
	@cmake --build $(BUILD) -j $(JOBS) --target spillikin_command
	@$(SPILLIKIN) render examples/bluntfin.vts --field Density --range 0.6,2.6 --tf plasma --opacity 1.6 \
	    --azimuth 25 --elevation 25 --zoom 1.55 -o demo.png
	@echo "The picture is in $(abspath demo.png)"

test: build
	@ctest --test-dir $(BUILD) --output-on-failure -j $(JOBS)

# The long suites: every mesh of DATA against the reference, every stage timed, every order held against rays, every
# reader fed with damaged files.
accuracy: build
	@scripts/accuracy.sh $(BUILD) $(DATA) docs/accuracy.md

verify: build
	@scripts/verify.sh $(BUILD) $(DATA)

bench: build
	@scripts/bench.sh $(BUILD) $(DATA) docs/performance.md

fuzz: build
	@scripts/fuzz.sh $(BUILD)

install: build
	@cmake --install $(BUILD) --prefix $(or $(PREFIX),/usr/local)

format:
	@git ls-files '*.h' '*.cpp' | xargs clang-format -i

lint: configure
	@git ls-files '*.h' '*.cpp' | xargs clang-format --dry-run -Werror
	@git ls-files 'spillikin/*.cpp' | xargs -P $(JOBS) -n 4 clang-tidy -p $(BUILD) --quiet

clean:
	@rm -rf build
